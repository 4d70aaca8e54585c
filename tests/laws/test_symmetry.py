"""Symmetries: mirror images, order of bodies, moving frames, translation, rotation, repetition."""

import numpy as np
import pytest

from sandbox.engines.contract import Refusal
from sandbox.engines.registry import ENGINES
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.laws.engine_configs import IMPULSE_CONFIGS, PENALTY, each_config

pytestmark = pytest.mark.fail_slow(60)  # many runs

TOLERANCE = 1e-12  # m and m/s: rounding of 1e-16, amplified by less than 1e3 in the impacts

PAIRS = [{"between": [a, b], "restitution": 0.7, "friction": 0.4} for a, b in ("xx", "xy", "yy")]


def four_balls(order=(0, 1, 2, 3), mirror=1.0, drift=(0.0, 0.0), gravity=0.0):
    """Return four different balls that collide once in pairs."""
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
    return make_scene(
        world={"duration": 1.0, "gravity": [0.0, gravity]},
        material=[{"name": "x"}, {"name": "y"}],
        pair=PAIRS,
        ball=[balls[k] for k in order],
    )


def state(result, order=(0, 1, 2, 3)):
    by_name = np.argsort(order)
    return result.position[-1][by_name], result.velocity[-1][by_name], result.angular_velocity[-1][by_name]


@each_config([*IMPULSE_CONFIGS, PENALTY])
def test_result_does_not_depend_on_the_order_of_bodies_in_the_file(config):
    expected = config.run(four_balls())
    assert len(expected.contact_time) == 2
    for order in ((1, 0, 3, 2), (3, 2, 1, 0), (2, 0, 3, 1)):
        for actual, wanted in zip(state(config.run(four_balls(order)), order), state(expected), strict=True):
            np.testing.assert_allclose(actual, wanted, atol=config.rounding(TOLERANCE), rtol=0)


@each_config([*IMPULSE_CONFIGS, PENALTY])
def test_mirror_image_stays_a_mirror_image(config):
    position, velocity, spin = state(config.run(four_balls(gravity=-9.81)))
    mirrored_position, mirrored_velocity, mirrored_spin = state(config.run(four_balls(mirror=-1.0, gravity=-9.81)))
    np.testing.assert_allclose(mirrored_position, position * [-1, 1], atol=config.rounding(TOLERANCE), rtol=0)
    np.testing.assert_allclose(mirrored_velocity, velocity * [-1, 1], atol=config.rounding(TOLERANCE), rtol=0)
    np.testing.assert_allclose(mirrored_spin, -spin, atol=config.rounding(TOLERANCE), rtol=0)


@each_config(IMPULSE_CONFIGS)
def test_motion_is_the_same_in_a_moving_frame(config):
    """Galilean invariance, with a drift that is exact in binary, so that it causes no rounding by itself."""
    drift = np.array([0.5, -0.25])
    position, velocity, spin = state(config.run(four_balls()))
    drifting_position, drifting_velocity, drifting_spin = state(config.run(four_balls(drift=tuple(drift))))
    # accuracy of the roots for times of impact
    np.testing.assert_allclose(drifting_position, position + drift, atol=config.rounding(1e-10), rtol=0)
    np.testing.assert_allclose(drifting_velocity, velocity + drift, atol=config.rounding(1e-10), rtol=0)
    np.testing.assert_allclose(drifting_spin, spin, atol=config.rounding(1e-10), rtol=0)


@each_config([*IMPULSE_CONFIGS, PENALTY])
@pytest.mark.parametrize("angle", [0.5, 2.0, 4.0])  # signs of both components of the normal and of gravity differ
def test_motion_turns_with_the_world(config, angle):
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, sin], [-sin, cos]])  # from the right, of rows

    def falling(turn):
        balls = [ball.model_dump(exclude_none=True) for ball in four_balls().balls]
        for ball in balls:
            ball |= {key: (np.array(ball[key]) @ turn).tolist() for key in ("position", "velocity")}
        gravity, normal, point = ((np.array(v) @ turn).tolist() for v in ([0, -9.81], [0, 1], [0, -2.5]))
        return make_scene(
            world={"duration": 1.0, "gravity": gravity},
            material=[{"name": "x"}, {"name": "y"}],
            pair=PAIRS,
            ball=balls,
            plane=[{"point": point, "normal": normal, "material": "y"}],
        )

    straight, turned = config.run(falling(np.eye(2))), config.run(falling(turn))
    assert (straight.contact_pair[:, 1] < 0).any()  # some fall onto the plane
    assert (straight.contact_pair[:, 1] >= 0).any()
    for key in ("position", "velocity"):
        expected = getattr(straight, key)[-1] @ turn
        # accuracy of the roots for times of impact
        np.testing.assert_allclose(getattr(turned, key)[-1], expected, atol=config.rounding(1e-10), rtol=0)


@each_config([*IMPULSE_CONFIGS, PENALTY])
def test_run_repeats_bit_for_bit(config):
    one, two = config.run(four_balls()), config.run(four_balls())
    assert np.array_equal(one.position, two.position)
    assert np.array_equal(one.contact_impulse, two.contact_impulse, equal_nan=True)


@each_config(IMPULSE_CONFIGS)
@pytest.mark.parametrize("origin", [1e3, 1e6])
def test_motion_far_from_the_origin_is_the_same_up_to_rounding(config, origin):
    near, far = config.run(four_balls()), None
    scene = four_balls()
    document = {
        "world": {"duration": 1.0},
        "material": [{"name": "x"}, {"name": "y"}],
        "pair": PAIRS,
        "ball": [
            {**ball.model_dump(exclude_none=True), "position": [ball.position[0] + origin, ball.position[1]]}
            for ball in scene.balls
        ],
    }
    far_scene = from_document(document)
    if ENGINES[config.engine].epsilon > 2.0**-52 and origin > 1e5:  # coordinates are rounded to 0.06 m
        with pytest.raises(Refusal, match="32-bit"):
            config.start(far_scene)
        return
    far = config.run(far_scene)
    # A coordinate is rounded to origin·1e-16, a normal to that over the contact distance; ten such errors.
    tolerance = config.rounding(1e-14) * origin
    np.testing.assert_allclose(far.position[-1] - [origin, 0.0], near.position[-1], atol=tolerance, rtol=0)
