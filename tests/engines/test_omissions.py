"""Omitting what a scene does not need changes nothing else, bit for bit."""

import numpy as np
import pytest

from sandbox.action import Spawn
from sandbox.engines.registry import start
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find

FLOOR = {"point": [0, 0], "normal": [0, 1], "restitution": 0.9}


def run(simulation, steps):
    frames = []
    for _ in range(steps):
        simulation.step()
        frames.append(simulation.frame())
    return np.array([f.position for f in frames]), np.array([f.velocity for f in frames])


def identical(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def row_of_balls(collides):
    """Return ten balls dropped side by side, which hit the floor but never each other."""
    balls = [{"position": [2.0 * k, 3 + 0.1 * k], "radius": 0.5, "collides": collides} for k in range(10)]
    return from_document({"world": {"gravity": [0, -9.81]}, "plane": [FLOOR], "ball": balls})


def test_bodies_excluded_by_the_filter_bounce_as_if_tested():
    filtered, tested = start(row_of_balls("fixed")), start(row_of_balls("all"))
    assert identical(run(filtered, 300), run(tested, 300))


def test_free_flight_is_the_same_outside_and_inside_the_space():
    """A colliding ball spawned far away moves the flying balls into the space without changing their flight."""
    ball = {"velocity": [3, 20], "angular_velocity": 1.0, "radius": 0.1}
    document = {"world": {"gravity": [0, -9.81]}, "ball": [{"position": [0, 0], **ball}]}
    outside, inside = start(from_document(document)), start(from_document(document))
    run(outside, 50)
    run(inside, 50)
    assert (outside.flying, inside.flying) == (1, 1)
    inside.apply(Spawn(time=0.5, ball=Ball(position=(1e3, 0.0), radius=0.1)))
    assert inside.flying == 0
    positions, velocities = run(inside, 100)
    assert identical(run(outside, 100), (positions[:, :1], velocities[:, :1]))


@pytest.mark.parametrize("name", ["bounce", "two_balls", "incline", "newtons_cradle"])
def test_recording_contacts_and_watching_change_nothing(name):
    scene = load(find(name))
    plain, recorded, watched = start(scene), start(scene), start(scene)
    recorded.contacts()
    watched.watch(lambda *_: None)
    expected = run(plain, 300)
    assert identical(expected, run(recorded, 300))
    assert identical(expected, run(watched, 300))


def set_moments(simulation, scene):
    """Set the moments of inertia that the engine omitted."""
    space_bodies = simulation._population.space_bodies
    for index, moment in enumerate(scene.bodies.moment.tolist()):
        space_bodies.give_moment(index, moment)
    return simulation


def test_omitted_moment_changes_nothing_with_exact_normals():
    scene = row_of_balls("all")
    omitted, explicit = start(scene), set_moments(start(scene), scene)
    assert np.isinf(omitted._population.space_bodies.moment(0))
    assert identical(run(omitted, 300), run(explicit, 300))


def test_omitted_moment_removes_rounding_noise_of_oblique_contacts():
    """Pymunk rounds lever arms, so oblique frictionless contacts turn bodies by about 1e-13 rad/s.

    Without a moment that noise is absent, and the spin is exactly 0. Positions then differ in their last bits, which
    grow in a gas, so the runs are not bit-identical but agree to rounding at first.
    """
    scene = load(find("gas"))
    omitted, explicit = start(scene), set_moments(start(scene), scene)
    (clean, _), (noisy, _) = run(omitted, 400), run(explicit, 400)
    assert (omitted.frame().angular_velocity == 0).all()
    assert 0 < np.abs(explicit.frame().angular_velocity).max() < 1e-11  # noise of about 1e3 contacts of 1e-16 to 1e-13
    assert np.abs(clean - noisy).max() < 1e-11  # 2 s of a gas whose errors grow tenfold in about 0.3 s


def test_zero_drag_is_the_plain_scheme():
    """Drag 0 uses the plain scheme, and a negligible drag agrees with it to rounding."""
    ball = {"position": [0, 0], "velocity": [3, 20], "radius": 0.1}
    plain = start(from_document({"world": {"gravity": [0, -9.81]}, "ball": [ball]}))
    zero = start(from_document({"world": {"gravity": [0, -9.81], "linear_drag": 0.0, "wind": [5, 5]}, "ball": [ball]}))
    tiny = start(from_document({"world": {"gravity": [0, -9.81], "linear_drag": 1e-300}, "ball": [ball]}))
    expected = run(plain, 200)
    assert identical(expected, run(zero, 200))
    assert np.allclose(run(tiny, 200)[0], expected[0], rtol=1e-13, atol=1e-13)  # rounding of 200 steps
