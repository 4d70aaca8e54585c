"""Sensitivity of rest positions to the stroke: against closed forms, and where no slope exists."""

import math

import pytest

from sandbox.games.billiards.shots.sensitivity import Slope, sensitivity
from sandbox.games.billiards.shots.shot import Variable, shot_setup
from sandbox.scene.compile.scene import Scene
from tests.games.billiards.shots.shots_by_hand import R, ball, pocket, scene_with, shot, straight_pot

pytestmark = pytest.mark.full  # long runs and sweeps


def slopes(scene: Scene, variable: Variable) -> dict[str, Slope]:
    return {slope.ball: slope for slope in sensitivity(scene, variables=(variable,))}


def travel(speed: float) -> float:
    """Return the distance that a ball travels that starts without spin, m."""
    return 12.0 * speed**2 / (49.0 * 0.2 * 9.81) + (5.0 * speed / 7.0) ** 2 / (2.0 * 0.01 * 9.81)


def test_single_ball_slopes_are_those_of_distance_proportional_to_speed_squared() -> None:
    scene = scene_with(shot(0.3, 1.5))
    fraction = 2.0 / (1.0 + 0.17 / 0.567)  # of the cue's speed
    distance = travel(1.5 * fraction)
    aim, speed = slopes(scene, "aim")["cue"], slopes(scene, "speed")["cue"]
    # m: a few hundred rounding errors of metres, over steps of 1e-3
    assert aim.value == pytest.approx((-distance * math.sin(0.3), distance * math.cos(0.3)), abs=1e-9)
    by_speed = 2.0 * distance / 1.5
    assert speed.value == pytest.approx((by_speed * math.cos(0.3), by_speed * math.sin(0.3)), abs=1e-9)
    assert aim.error is not None and aim.error < 1e-3
    assert aim.holds == 2.0**-6  # the largest step that is tried


@pytest.mark.parametrize("cut", [0.0, 0.3, 0.8])
def test_a_hit_amplifies_an_aim_error_as_the_ghost_ball_formula(cut: float) -> None:
    d = 0.4
    # φ is the angle between the path of the cue ball and the line of centres: sin φ = d sin(aim) / 2R
    aim = math.asin(2.0 * R * math.sin(cut) / d)
    scene = scene_with(ball("object", d), shot(aim, 2.0))
    outcome = shot_setup(scene).simulate()
    x, y = outcome.position[1].tolist()
    distance, heading = math.hypot(x - d, y), math.atan2(y, x - d)
    assert heading == pytest.approx(aim - cut, abs=1e-9)  # rad: bodies in contact are separated by 1e-12 m
    factor = 1.0 - d * math.cos(aim) / (2.0 * R * math.cos(cut))  # nearly −(d / (2R cos φ) − 1)
    slope = slopes(scene, "aim")["object"]
    assert slope.value is not None
    across = -slope.value[0] * math.sin(heading) + slope.value[1] * math.cos(heading)
    assert across == pytest.approx(distance * factor, rel=1e-6)  # accuracy of the extrapolation


def test_each_hit_of_a_row_multiplies_an_aim_error() -> None:
    d = 0.15
    scene = scene_with(*(ball(str(k), d * k) for k in (1, 2, 3)), shot(0.0, 3.0))
    found, outcome = slopes(scene, "aim"), shot_setup(scene).simulate()
    gap = d - 2.0 * R
    # Ball k leaves at (−g/2R)ᵏ times the error of the aim. The first balls hit the next one fully and then move only by
    # their spin, along their own path; the last ball travels freely.
    distance, value = outcome.position[3, 0] - 3.0 * d, found["3"].value
    assert value is not None
    assert value[1] == pytest.approx(distance * (-gap / (2.0 * R)) ** 3, rel=1e-5)  # g/2R is for small angles


def test_fitted_slopes_agree_with_finite_differences() -> None:
    for slope in sensitivity(straight_pot(0.4, 3.0, speed=1.5, aim=0.05)):
        assert slope.value is not None and slope.error is not None
        assert slope.fitted == pytest.approx(slope.value, abs=max(1e-9, 1.01 * slope.error))


def test_a_potted_ball_has_no_slope() -> None:
    slope = slopes(straight_pot(0.3, 0.5), "aim")["object"]
    assert (slope.value, slope.reason) == (None, "falls into 'hole'")
    assert slope.holds is not None


def test_a_grazing_hit_is_reported_as_not_smooth() -> None:
    d = 0.4
    scene = scene_with(ball("object", d), shot(math.asin(2.0 * R / d), 2.0))  # tangent: contact or no contact
    found = slopes(scene, "aim")
    assert found["cue"].value is None and found["object"].value is None
    assert found["object"].reason is not None and found["object"].reason.startswith(
        "not smooth: the sequence of contacts changes within"
    )


def test_a_ball_that_is_not_hit_has_zero_slope() -> None:
    d = 0.4
    scene = scene_with(ball("object", d), ball("bystander", 0.0, 2.0), shot(math.asin(2.0 * R / d), 1.0))
    slope = slopes(scene, "aim")["bystander"]
    assert (slope.value, slope.error, slope.reason) == ((0.0, 0.0), 0.0, None)


def test_side_and_height_have_slopes_too() -> None:
    scene = scene_with(pocket("hole", 0.0, 5.0), shot(0.0, 1.0))
    side, height = slopes(scene, "side")["cue"], slopes(scene, "height")["cue"]
    assert side.value is not None and height.value is not None
    assert side.value[1] > 0.1  # squirt: struck on the right, the ball goes to the left
    assert height.value[0] > 0.1  # follow
    assert side.value[0] == pytest.approx(0.0, abs=1e-6)  # the distance is greatest without side
    assert height.value[1] == pytest.approx(0.0, abs=1e-9)
