"""Leaving out what a scene does not demand changes nothing else, bit for bit."""

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


def same(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def row_of_balls(collides):
    """Ten balls dropped side by side: they meet the floor, and never each other."""
    balls = [{"position": [2.0 * k, 3 + 0.1 * k], "radius": 0.5, "collides": collides} for k in range(10)]
    return from_document({"world": {"gravity": [0, -9.81]}, "plane": [FLOOR], "ball": balls})


def test_bodies_filtered_apart_bounce_as_if_they_were_tested():
    apart, tested = start(row_of_balls("fixed")), start(row_of_balls("all"))
    assert same(run(apart, 300), run(tested, 300))


def test_free_flight_outside_of_the_space_is_as_inside():
    """A spawned floor-goer far away brings the flying ones into the space, and changes nothing for them."""
    ball = {"velocity": [3, 20], "angular_velocity": 1.0, "radius": 0.1}
    document = {"world": {"gravity": [0, -9.81]}, "ball": [{"position": [0, 0], **ball}]}
    outside, inside = start(from_document(document)), start(from_document(document))
    run(outside, 50)
    run(inside, 50)
    assert (outside.flying, inside.flying) == (1, 1)
    inside.apply(Spawn(time=0.5, ball=Ball(position=(1e3, 0.0), radius=0.1)))
    assert inside.flying == 0
    positions, velocities = run(inside, 100)
    assert same(run(outside, 100), (positions[:, :1], velocities[:, :1]))


@pytest.mark.parametrize("name", ["bounce", "two_balls", "incline", "newtons_cradle"])
def test_recording_contacts_and_watching_change_nothing(name):
    scene = load(find(name))
    silent, recorded, watched = start(scene), start(scene), start(scene)
    recorded.contacts()
    watched.watch(lambda *_: None)
    expected = run(silent, 300)
    assert same(expected, run(recorded, 300))
    assert same(expected, run(watched, 300))


def with_moments(simulation, scene):
    """Give every body the moment that the engine left out."""
    half = simulation._population.space_bodies
    for number, moment in enumerate(scene.bodies.moment.tolist()):
        half.give_moment(number, moment)
    return simulation


def test_a_moment_left_out_changes_nothing_where_normals_are_exact():
    scene = row_of_balls("all")
    left_out, given = start(scene), with_moments(start(scene), scene)
    assert np.isinf(left_out._population.space_bodies.moment(0))
    assert same(run(left_out, 300), run(given, 300))


def test_a_moment_left_out_takes_away_rounding_noise_of_oblique_contacts():
    """Pymunk rounds lever arms, so oblique frictionless contacts turn bodies by some 1e-13 rad/s.

    Left out, that noise is gone: the spin is exactly 0. Positions then differ in their last bits, and in a gas
    those grow; so here is no bit-identity, but agreement to rounding while it is young.
    """
    scene = load(find("gas"))
    left_out, given = start(scene), with_moments(start(scene), scene)
    (mine, _), (noisy, _) = run(left_out, 400), run(given, 400)
    assert (left_out.frame().angular_velocity == 0).all()
    assert 0 < np.abs(given.frame().angular_velocity).max() < 1e-11  # the noise: some 1e3 contacts of 1e-16 to 1e-13
    assert np.abs(mine - noisy).max() < 1e-11  # 2 s of a gas whose errors grow tenfold in some 0.3 s


def test_no_drag_costs_no_drag():
    """A drag that is stated as 0 leaves the plain rule, and a vanishing one agrees with it to rounding."""
    ball = {"position": [0, 0], "velocity": [3, 20], "radius": 0.1}
    plain = start(from_document({"world": {"gravity": [0, -9.81]}, "ball": [ball]}))
    zero = start(from_document({"world": {"gravity": [0, -9.81], "linear_drag": 0.0, "wind": [5, 5]}, "ball": [ball]}))
    tiny = start(from_document({"world": {"gravity": [0, -9.81], "linear_drag": 1e-300}, "ball": [ball]}))
    expected = run(plain, 200)
    assert same(expected, run(zero, 200))
    assert np.allclose(run(tiny, 200)[0], expected[0], rtol=1e-13, atol=1e-13)  # 200 steps of roundings
