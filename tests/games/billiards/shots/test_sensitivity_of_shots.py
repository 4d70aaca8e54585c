"""How rests move with a stroke: against closed forms, and where there is nothing to tell."""

import math

import pytest

from sandbox.games.billiards.shots.sensitivity import Slope, sensitivity
from sandbox.games.billiards.shots.shot import Variable, shot_setup
from sandbox.scene.compile.scene import Scene
from tests.games.billiards.shots.shots_by_hand import R, ball, floor, pocket, shot, straight_pot

pytestmark = pytest.mark.full  # long runs and sweeps


def slopes(scene: Scene, variable: Variable) -> dict[str, Slope]:
    return {slope.ball: slope for slope in sensitivity(scene, variables=(variable,))}


def far(speed: float) -> float:
    """How far a ball goes that starts without spin."""
    return 12.0 * speed**2 / (49.0 * 0.2 * 9.81) + (5.0 * speed / 7.0) ** 2 / (2.0 * 0.01 * 9.81)


def test_a_lone_ball_turns_with_the_aim_and_goes_as_its_speed_squared() -> None:
    scene = floor(shot(0.3, 1.5))
    share = 2.0 / (1.0 + 0.17 / 0.567)  # of the cue's speed
    way = far(1.5 * share)
    aim, speed = slopes(scene, "aim")["cue"], slopes(scene, "speed")["cue"]
    # m: a few hundred roundings of metres, over steps of 1e-3
    assert aim.value == pytest.approx((-way * math.sin(0.3), way * math.cos(0.3)), abs=1e-9)
    by_speed = 2.0 * way / 1.5
    assert speed.value == pytest.approx((by_speed * math.cos(0.3), by_speed * math.sin(0.3)), abs=1e-9)
    assert aim.error is not None and aim.error < 1e-3
    assert aim.holds == 2.0**-6  # as far as it was tried


@pytest.mark.parametrize("cut", [0.0, 0.3, 0.8])
def test_a_hit_turns_an_error_of_aim_as_ghost_balls_say(cut: float) -> None:
    d = 0.4
    # φ, between the way of the cue ball and the line of centres, from the aim: sin φ = d sin(aim) / 2R
    aim = math.asin(2.0 * R * math.sin(cut) / d)
    scene = floor(ball("object", d), shot(aim, 2.0))
    outcome = shot_setup(scene).simulate()
    x, y = outcome.position[1].tolist()
    way, heading = math.hypot(x - d, y), math.atan2(y, x - d)
    assert heading == pytest.approx(aim - cut, abs=1e-9)  # rad: bodies that meet are parted by 1e-12 m
    turned = 1.0 - d * math.cos(aim) / (2.0 * R * math.cos(cut))  # nearly −(d / (2R cos φ) − 1)
    slope = slopes(scene, "aim")["object"]
    assert slope.value is not None
    across = -slope.value[0] * math.sin(heading) + slope.value[1] * math.cos(heading)
    assert across == pytest.approx(way * turned, rel=1e-6)  # as well as extrapolation gets to


def test_a_row_of_hits_multiplies_an_error_each_time() -> None:
    d = 0.15
    scene = floor(*(ball(str(k), d * k) for k in (1, 2, 3)), shot(0.0, 3.0))
    found, outcome = slopes(scene, "aim"), shot_setup(scene).simulate()
    gap = d - 2.0 * R
    for k in (1, 2, 3):
        # Ball k leaves at (−g/2R)ᵏ of the aim's error. The first ones hit the next fully, and stay there but for what
        # they have of spin, along their own way; the last one goes on alone.
        if k == 3:
            way = outcome.position[k, 0] - d * k
            value = found[str(k)].value
            assert value is not None
            assert value[1] == pytest.approx(way * (-gap / (2.0 * R)) ** k, rel=1e-5)  # g/2R is for small angles


def test_a_fit_agrees_with_the_differences() -> None:
    for slope in sensitivity(straight_pot(0.4, 3.0, speed=1.5, aim=0.05)):
        assert slope.value is not None and slope.error is not None
        assert slope.fitted == pytest.approx(slope.value, abs=max(1e-9, 1.01 * slope.error))


def test_a_ball_that_falls_has_no_slope() -> None:
    slope = slopes(straight_pot(0.3, 0.5), "aim")["object"]
    assert (slope.value, slope.reason) == (None, "falls into 'hole'")
    assert slope.holds is not None


def test_a_graze_is_not_smooth_and_says_so() -> None:
    d = 0.4
    scene = floor(ball("object", d), shot(math.asin(2.0 * R / d), 2.0))  # it just touches, or does not
    found = slopes(scene, "aim")
    assert found["cue"].value is None and found["object"].value is None
    assert found["object"].reason is not None and found["object"].reason.startswith(
        "not smooth: the sequence of contacts changes within"
    )


def test_who_is_not_concerned_stays_smooth() -> None:
    d = 0.4
    scene = floor(ball("object", d), ball("bystander", 0.0, 2.0), shot(math.asin(2.0 * R / d), 1.0))
    slope = slopes(scene, "aim")["bystander"]
    assert (slope.value, slope.error, slope.reason) == ((0.0, 0.0), 0.0, None)


def test_side_and_height_have_slopes_too() -> None:
    scene = floor(pocket("hole", 0.0, 5.0), shot(0.0, 1.0))
    side, height = slopes(scene, "side")["cue"], slopes(scene, "height")["cue"]
    assert side.value is not None and height.value is not None
    assert side.value[1] > 0.1  # squirt: struck on its right it goes to the left
    assert height.value[0] > 0.1  # follow
    assert side.value[0] == pytest.approx(0.0, abs=1e-6)  # no side is the best for going far
    assert height.value[1] == pytest.approx(0.0, abs=1e-9)
