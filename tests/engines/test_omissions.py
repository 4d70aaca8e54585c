"""Omitting what a scene does not need changes nothing else, bit for bit."""

import numpy as np
import pytest

from sandbox.engines.registry import start
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


@pytest.mark.parametrize("name", ["bounce", "two_balls", "incline", "newtons_cradle"])
def test_recording_contacts_and_watching_change_nothing(name):
    scene = load(find(name))
    plain, recorded, watched = start(scene), start(scene), start(scene)
    recorded.contacts()
    watched.watch(lambda *_: None)
    expected = run(plain, 300)
    assert identical(expected, run(recorded, 300))
    assert identical(expected, run(watched, 300))


def test_zero_drag_is_the_plain_scheme():
    """Drag 0 uses the plain scheme, and a negligible drag agrees with it to rounding."""
    ball = {"position": [0, 0], "velocity": [3, 20], "radius": 0.1}
    plain = start(from_document({"world": {"gravity": [0, -9.81]}, "ball": [ball]}))
    zero = start(from_document({"world": {"gravity": [0, -9.81], "linear_drag": 0.0, "wind": [5, 5]}, "ball": [ball]}))
    tiny = start(from_document({"world": {"gravity": [0, -9.81], "linear_drag": 1e-300}, "ball": [ball]}))
    expected = run(plain, 200)
    assert identical(expected, run(zero, 200))
    assert np.allclose(run(tiny, 200)[0], expected[0], rtol=1e-13, atol=1e-13)  # rounding of 200 steps
