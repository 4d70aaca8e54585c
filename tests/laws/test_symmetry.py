"""Physics knows no left and right, no first and second, no fast and slow observer."""

import numpy as np
import pytest

from sandbox.scene.files.load import from_document
from tests.laws.ways import HARD, SOFT, named

SHIFT = 1e-12  # m and m/s: roundings of 1e-16 that one impact in four balls amplifies by less than 1e3

PAIRS = [{"between": [a, b], "restitution": 0.7, "friction": 0.4} for a, b in ("xx", "xy", "yy")]


def four(order=(0, 1, 2, 3), mirror=1.0, drift=(0.0, 0.0), gravity=0.0):
    """Four unlike balls that meet pairwise, once."""
    balls = [
        {"name": "a", "position": [-1.5, 0.1], "velocity": [2.0, 0.0], "radius": 0.5, "mass": 1.0, "material": "x"},
        {"name": "b", "position": [0.0, 0.0], "velocity": [0.0, 0.3], "radius": 0.4, "mass": 3.0, "material": "y"},
        {"name": "c", "position": [5.0, 1.0], "velocity": [0.0, -1.0], "radius": 0.3, "mass": 0.5, "material": "x"},
        {"name": "d", "position": [5.2, -0.5], "velocity": [0.0, 1.0], "radius": 0.6, "mass": 2.0, "material": "y"},
    ]
    for ball in balls:
        x, y = ball["position"]
        vx, vy = ball["velocity"]
        ball["position"], ball["velocity"] = [mirror * x, y], [mirror * (vx + drift[0]), vy + drift[1]]
    return from_document(
        {
            "world": {"duration": 1.0, "gravity": [0.0, gravity]},
            "material": [{"name": "x"}, {"name": "y"}],
            "pair": PAIRS,
            "ball": [balls[k] for k in order],
        }
    )


def state(done, order=(0, 1, 2, 3)):
    back = np.argsort(order)
    return done.position[-1][back], done.velocity[-1][back], done.angular_velocity[-1][back]


@named([*HARD, SOFT])
def test_the_order_in_the_file_does_not_matter(way):
    expected = way.run(four())
    assert len(expected.contact_time) == 2
    for order in ((1, 0, 3, 2), (3, 2, 1, 0), (2, 0, 3, 1)):
        for ours, theirs in zip(state(way.run(four(order)), order), state(expected), strict=True):
            np.testing.assert_allclose(ours, theirs, atol=SHIFT, rtol=0)


@named([*HARD, SOFT])
def test_a_mirror_image_stays_one(way):
    position, velocity, spin = state(way.run(four(gravity=-9.81)))
    there_position, there_velocity, there_spin = state(way.run(four(mirror=-1.0, gravity=-9.81)))
    np.testing.assert_allclose(there_position, position * [-1, 1], atol=SHIFT, rtol=0)
    np.testing.assert_allclose(there_velocity, velocity * [-1, 1], atol=SHIFT, rtol=0)
    np.testing.assert_allclose(there_spin, -spin, atol=SHIFT, rtol=0)


@named(HARD)
def test_a_moving_observer_sees_the_same(way):
    """Galilei: with a common drift, chosen exact in binary so that no step changes by rounding alone."""
    drift = np.array([0.5, -0.25])
    position, velocity, spin = state(way.run(four()))
    there_position, there_velocity, there_spin = state(way.run(four(drift=tuple(drift))))
    np.testing.assert_allclose(there_position, position + drift, atol=1e-10, rtol=0)  # times of impact by roots
    np.testing.assert_allclose(there_velocity, velocity + drift, atol=1e-10, rtol=0)
    np.testing.assert_allclose(there_spin, spin, atol=1e-10, rtol=0)


@named([*HARD, SOFT])
def test_a_run_repeats_bit_for_bit(way):
    one, two = way.run(four()), way.run(four())
    assert np.array_equal(one.position, two.position)
    assert np.array_equal(one.contact_impulse, two.contact_impulse)


@named(HARD)
@pytest.mark.parametrize("place", [1e3, 1e6])
def test_a_place_far_out_is_as_good_up_to_rounding(way, place):
    near, far = way.run(four()), None
    scene = four()
    document = {
        "world": {"duration": 1.0},
        "material": [{"name": "x"}, {"name": "y"}],
        "pair": PAIRS,
        "ball": [
            {**ball.model_dump(exclude_none=True), "position": [ball.position[0] + place, ball.position[1]]}
            for ball in scene.balls
        ],
    }
    far = way.run(from_document(document))
    # A coordinate is rounded to place·1e-16, a normal by that over the contact distance; ten of those.
    tolerance = 1e-14 * place
    np.testing.assert_allclose(far.position[-1] - [place, 0.0], near.position[-1], atol=tolerance, rtol=0)
