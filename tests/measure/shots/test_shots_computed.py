"""Odds, aim windows and sensitivity of shots, against closed forms, and where none exists."""

import math
from statistics import NormalDist

import numpy as np
import pytest
from scipy.optimize import brentq

from sandbox.engines.exact.tabletop.shots import Table
from sandbox.jsonable import to_json
from sandbox.measure.proportion import wilson_interval
from sandbox.measure.shots.aim_windows import END_ACCURACY, windows
from sandbox.measure.shots.monte_carlo import odds
from sandbox.measure.shots.sensitivity import Slope, sensitivity
from sandbox.measure.shots.shot import NoSuchShotError, Spread, Variable, shot_setup
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.surface import Stroke, struck
from tests.measure.shots.shots_by_hand import R, ball, pocket, scene_with, shot, straight_pot

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

SIGMAS = 4.0
"""Standard deviations that one in 16,000 draws exceeds; besides, the seed is fixed."""


@pytest.mark.parametrize("aim", [0.0, 0.004, 0.009])
def test_probability_is_that_of_the_window_under_a_normal_error(aim: float) -> None:
    scene, sigma = straight_pot(0.5, 1.0, speed=3.0, aim=aim), 0.005
    (window,) = windows(scene, "object", "hole", shots=401).found
    error = NormalDist(aim, sigma)
    known = error.cdf(window.high) - error.cdf(window.low)
    found = odds(scene, spread=Spread(aim=sigma, speed=0.0), count=1600)
    chance = found.chance("object", "hole")
    low, high = wilson_interval(chance.hits, chance.trials, SIGMAS)
    assert low < known < high
    assert found.chance("object").hits == chance.hits
    assert found.miscues == found.unfinished == 0


def test_scratch_and_pot_are_counted_separately() -> None:
    follow = scene_with(ball("object", 0.3), pocket("hole", 0.8), shot(0.0, 3.0, 0.0, 0.4))
    nothing = Spread(0.0, 0.0)
    both = odds(follow, spread=nothing, count=5)
    assert (both.chance("object").hits, both.scratch.hits, both.any_pot.hits) == (5, 5, 0)
    assert both.rest("cue") is None
    stun = odds(straight_pot(0.3, 0.5), spread=nothing, count=5)
    assert (stun.chance("object").hits, stun.scratch.hits, stun.any_pot.hits) == (5, 0, 5)


def test_spread_of_the_rest_position_of_a_single_ball_is_the_closed_form() -> None:
    found = odds(scene_with(shot(0.0, 1.0)), spread=Spread(aim=0.01, speed=0.02), count=1600)
    v = math.hypot(*struck(Stroke(aim=0.0, speed=1.0), 0.17, R)[0])
    distance = 12.0 * v**2 / (49.0 * 0.2 * 9.81) + (5.0 * v / 7.0) ** 2 / (2.0 * 0.01 * 9.81)
    rest = found.rest("cue")
    assert rest is not None and rest.count == 1600
    off = SIGMAS / math.sqrt(1600.0)
    assert rest.mean[0] == pytest.approx(distance * (1.0 + 0.02**2 - 0.5 * 0.01**2), abs=off * 0.04 * distance)
    # Spreads: of v² to first order, and distance times angle; the next order is 1e-3 of them.
    assert rest.spread == pytest.approx((0.04 * distance, 0.01 * distance), rel=off + 2e-3)


def test_odds_are_bit_identical_on_any_number_of_threads_and_extend_smaller_ensembles() -> None:
    scene = straight_pot(0.5, 1.0)
    every = Spread(0.004, 0.05, 0.05, 0.05)
    one, five = (odds(scene, spread=every, count=301, threads=n) for n in (1, 5))
    assert one.batch.position.tobytes() == five.batch.position.tobytes()
    assert one.batch.pocket.tobytes() == five.batch.pocket.tobytes()
    assert to_json(one) == to_json(five)
    more = odds(scene, spread=every, count=400)
    assert more.errors[:301].tobytes() == one.errors.tobytes()
    other = odds(scene, spread=every, count=301, seed=8)
    assert (one.seed, other.seed) == (7, 8)
    assert other.errors.tobytes() != one.errors.tobytes()


def test_given_errors_are_used_unchanged() -> None:
    scene = straight_pot(0.5, 1.0)
    errors = np.array([[0.0, 0.0, 0.0, 0.0], [0.003, -0.1, 0.1, -0.2]])
    found = odds(scene, errors=errors)
    one = Table(scene).shoot(Stroke(aim=0.003, speed=1.8, side=0.1, height=-0.2))
    assert found.count == 2
    assert found.batch.position[0] == pytest.approx(found.nominal.position, abs=0.0)
    assert found.batch.position[1] == pytest.approx(one.position, abs=1e-9)  # m: 0.9 · 2 differs from 1.8 by rounding


def test_miscues_are_counted_as_trials_without_a_pot() -> None:
    scene = straight_pot(0.3, 0.5)
    errors = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.4, 0.4], [0.0, -1.5, 0.0, 0.0]])
    found = odds(scene, errors=errors)
    assert (found.miscues, len(found.batch.duration)) == (2, 1)
    assert (found.chance("object").hits, found.chance("object").trials) == (1, 3)


def test_document_has_every_field() -> None:
    found = to_json(odds(straight_pot(0.5, 1.0), count=50))
    figures = {"count", "seed", "spread", "miscues", "unfinished", "interrupted"}
    assert set(found) == {*figures, "scratch", "any_pot", "balls"}
    into = found["balls"]["object"]["pockets"]["hole"]
    assert into["probability"] == into["hits"] / 50
    assert into["low"] <= into["probability"] <= into["high"]


@pytest.mark.parametrize("wrong", [-0.1, math.nan, math.inf])
def test_invalid_spread_is_refused(wrong: float) -> None:
    with pytest.raises(ValueError, match="is not a standard deviation"):
        Spread(aim=wrong)


def test_a_scene_without_a_shot_is_refused() -> None:
    with pytest.raises(NoSuchShotError, match=r"the scene has no \[\[shot\]\]"):
        odds(scene_with())


def object_heading(aim: float, d: float) -> float:
    """Return the heading of the object ball, rad: the line of centres when the cue ball is 2R away from it."""
    return aim - math.asin(d * math.sin(aim) / (2.0 * R))


@pytest.mark.parametrize(("d", "far"), [(0.2, 0.4), (0.5, 1.0), (1.0, 0.3)])
def test_window_of_a_straight_pot_is_the_closed_form(d: float, far: float) -> None:
    allowed = math.asin(0.06 / far)  # the centre of the ball must pass the rim
    edge = brentq(lambda aim: abs(object_heading(aim, d)) - allowed, 0.0, math.asin(2.0 * R / d) - 1e-12, xtol=1e-15)
    found = windows(straight_pot(d, far, speed=3.0), "object", "hole", reach=0.2, shots=801)
    (window,) = found.found
    assert (window.low, window.high) == pytest.approx((-edge, edge), abs=2.0 * END_ACCURACY)
    assert window.centre == pytest.approx(0.0, abs=2.0 * END_ACCURACY)
    assert window.half == pytest.approx(edge, abs=2.0 * END_ACCURACY)
    assert found.nearest is window
    # The approximation of players: the angle of the pocket over the amplification of an error by the hit.
    assert window.half == pytest.approx(allowed / (d / (2.0 * R) - 1.0), rel=0.1)  # angles of up to 0.2 are not small


def test_window_of_a_cut_is_the_closed_form() -> None:
    d, far, cut = 0.5, 0.6, 0.6
    hole = pocket("hole", d + far * math.cos(cut), -far * math.sin(cut))
    allowed = math.asin(0.06 / far)
    limits = [
        brentq(lambda aim, to=to: object_heading(aim, d) - to, 0.0, math.asin(2.0 * R / d), xtol=1e-15)
        for to in (-cut + allowed, -cut - allowed)
    ]
    aim = 0.5 * sum(limits) + 0.001
    found = windows(scene_with(ball("object", d), hole, shot(aim, 3.0)), "object", "hole", reach=0.02, shots=401)
    (window,) = found.found
    assert [window.low, window.high] == pytest.approx(limits, abs=2.0 * END_ACCURACY)
    assert aim in window


def test_a_window_beyond_the_searched_range_is_extended() -> None:
    scene = straight_pot(0.2, 0.1, speed=3.0)
    narrow = windows(scene, "object", "hole", reach=0.01, shots=101)
    (window,) = narrow.found
    assert narrow.reach > 0.01
    edge = brentq(
        lambda aim: abs(object_heading(aim, 0.2)) - math.asin(0.6), 0.0, math.asin(R / 0.1) - 1e-12, xtol=1e-15
    )
    assert window.half == pytest.approx(edge, abs=2.0 * END_ACCURACY)


def test_no_window_where_no_aim_pots_the_ball() -> None:
    found = windows(scene_with(ball("object", 0.5), pocket("hole", -0.5, 0.5), shot()), "object", "hole", shots=101)
    assert found.found == ()
    assert found.nearest is None
    assert found.within is False


def test_windows_are_the_same_on_any_number_of_threads() -> None:
    scene = straight_pot(0.5, 1.0)
    one, three = (windows(scene, "object", "hole", shots=301, threads=n) for n in (1, 3))
    assert one.found == three.found


def test_unknown_names_are_refused_with_those_known() -> None:
    scene = straight_pot(0.5, 1.0)
    with pytest.raises(NoSuchShotError, match="no ball is named 'x'; known names: cue, object"):
        windows(scene, "x", "hole")
    with pytest.raises(NoSuchShotError, match="no pocket is named 'x'; known names: hole"):
        windows(scene, "object", "x")
    with pytest.raises(NoSuchShotError, match="no shot is named 'x'; known names: it"):
        windows(scene, "object", "hole", "x")


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
