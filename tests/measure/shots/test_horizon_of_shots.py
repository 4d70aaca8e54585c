"""Predictability horizon of a shot, against the growth of a perturbation in a row of hits."""

import math

import numpy as np
import pytest

from sandbox.measure.shots.predictability import By, ShotSeparation, horizon
from sandbox.measure.shots.shot import Spread, shot_setup
from tests.measure.shots.shots_by_hand import R, ball, pocket, scene_with, shot, straight_pot

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def test_perturbation_grows_by_gap_over_diameter_at_each_hit() -> None:
    d, nudge = 0.2, 1e-9
    hits = 4
    scene = scene_with(*(ball(str(k), d * k) for k in range(1, hits + 1)), shot(0.0, 4.0))
    attempt = shot_setup(scene)
    nominal, perturbed = (
        attempt.simulate(record_paths=True),
        attempt.simulate(attempt.changed("aim", nudge), record_paths=True),
    )
    pair = ShotSeparation(nominal, perturbed)
    times = [event.time for event in nominal.events if event.kind == "ball"]
    assert len(times) == hits
    gap = d - 2.0 * R
    # When ball k is hit, the ball that hits it is off by g times its heading error, which each hit multiplies by g/2R.
    for k, time in enumerate(times):
        off = pair.distances(np.array([time - 1e-9]))[0, k]
        # rounding: 1e-16 m of 1e-10 m, growing
        assert off == pytest.approx(nudge * gap * (gap / (2.0 * R)) ** k, rel=1e-4)


def test_growth_per_hit_is_gap_over_diameter() -> None:
    d, hits = 0.2, 4
    scene = scene_with(*(ball(str(k), d * k) for k in range(1, hits + 1)), shot(0.0, 4.0))
    gap = d - 2.0 * R
    # Three hits, each multiplying the error of the cue ball at the first hit by g/2R. A ball that has hit drifts
    # sideways as much as the ball that it hit, so either can exceed the tolerance first.
    tolerance = 0.999 * 1e-9 * gap * (gap / (2.0 * R)) ** (hits - 1)
    found = horizon(scene, nudge=1e-9, tolerance=tolerance, ladder=()).separation
    assert found.hits == hits - 1
    assert found.ball in ("2", "3")
    assert found.growth_per_hit == pytest.approx(gap / (2.0 * R), rel=1e-3)  # the factor 0.999, over three hits
    assert found.time is not None and found.growth_per_second is not None
    (first, *_, last) = [event.time for event in shot_setup(scene).simulate().events if event.kind == "ball"]
    assert first < found.time < last
    grown = found.growth_per_second * (found.time - first)
    assert math.exp(grown) == pytest.approx(found.growth_per_hit**found.hits, rel=1e-9)  # two rates of one growth


def test_single_ball_separates_when_distance_times_angle_reaches_the_tolerance() -> None:
    scene = scene_with(shot(0.0, 1.0))
    attempt = shot_setup(scene)
    found = horizon(scene, nudge=1e-3, tolerance=1e-3, ladder=(1e-3, 1e-4)).separation
    assert found.time is not None
    (position,) = attempt.simulate(record_paths=True).at(np.array([found.time]))[:, 0]
    assert math.hypot(*position) * 1e-3 == pytest.approx(1e-3, rel=1e-6)  # chord 2 sin(a/2) against the arc a
    assert (found.ball, found.hits, found.growth_per_hit) == ("cue", 0, None)


def test_smaller_perturbations_separate_later_or_never() -> None:
    scene = scene_with(ball("a", 0.3, 0.01), ball("b", 0.6, -0.03), ball("c", 0.9, 0.05), shot(0.0, 5.0))
    found = horizon(scene, spread=Spread())
    times = [each.time for each in found.ladder]
    known = [time for time in times if time is not None]
    assert times[: len(known)] == known == sorted(known)
    assert times[-1] is None
    assert found.digits_per_second is not None and found.digits_per_second > 0.0
    assert found.player is not None and found.player.time is not None
    assert all(time <= found.duration + 1.0 for time in known)


def test_position_can_be_perturbed_instead_of_the_aim() -> None:
    scene = scene_with(ball("a", 0.3), shot(0.0, 2.0))
    found = horizon(scene, nudge=1e-4, by="place", tolerance=1e-3, ladder=())
    # All shots differ by 1e-4 m from the start; after the hit the ball is off by that over 2R for each metre travelled.
    assert found.separation.ball == "a"
    assert found.separation.time is not None
    (position,) = shot_setup(scene).simulate(record_paths=True).at(np.array([found.separation.time]))[:, 1]
    # 1e-2: the position of the hit is off by 1e-4 / 2R, too
    assert (position[0] - 0.3) * 1e-4 / (2.0 * R) == pytest.approx(1e-3, rel=1e-2)


def test_potting_the_same_ball_slightly_later_is_no_separation() -> None:
    scene = straight_pot(0.3, 0.5)
    found = horizon(scene, nudge=1e-9, ladder=())
    assert found.separation.time is None
    assert found.separation.farthest < 1e-6  # m: a perturbation of 1e-9, multiplied by 4 at the hit, over half a metre
    assert found.by_a_radius.time is None
    attempt = shot_setup(scene)
    pair = ShotSeparation(
        attempt.simulate(record_paths=True), attempt.simulate(attempt.changed("speed", 1e-6), record_paths=True)
    )
    # m: the potted ball does not jump to the pocket's centre
    assert pair.distances(np.linspace(0.0, pair.end, 20_000)).max() < 1e-4


def test_a_ball_potted_in_only_one_shot_is_a_separation() -> None:
    scene = scene_with(pocket("hole", 1.0), shot(math.asin(0.06) - 1e-7, 2.0))  # just over the rim
    found = horizon(scene, nudge=1e-6, ladder=())
    assert found.separation.ball == "cue"
    assert found.by_a_radius.time is not None


@pytest.mark.parametrize(("nudge", "tolerance"), [(0.0, 1e-3), (1e-9, 0.0), (math.nan, 1e-3)])
def test_nudge_and_tolerance_must_be_positive(nudge: float, tolerance: float) -> None:
    with pytest.raises(ValueError, match="both must be greater than 0"):
        horizon(scene_with(shot()), nudge=nudge, tolerance=tolerance)


@pytest.mark.parametrize("by", ["aim", "place"])
def test_a_ball_that_is_not_hit_does_not_change_the_horizon(by: By) -> None:
    """Law: only the struck ball moves the others, so balls that are not hit have no influence."""
    balls = ball("a", 0.3, 0.01), ball("b", 0.6, -0.03)
    without, beside = scene_with(*balls, shot(0.0, 5.0)), scene_with(ball("far", -0.9, 0.4), *balls, shot(0.0, 5.0))
    found, other = (horizon(scene, nudge=1e-4, by=by, ladder=(1e-4,)) for scene in (without, beside))
    assert found.separation.time is not None
    assert other.separation == found.separation
    assert other.ladder == found.ladder
