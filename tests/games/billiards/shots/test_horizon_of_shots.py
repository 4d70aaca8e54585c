"""Until when a shot can be foretold: against how a nudge grows in a row of hits."""

import math

import numpy as np
import pytest

from sandbox.games.billiards.shots.predictability import By, ShotSeparation, horizon
from sandbox.games.billiards.shots.shot import Spread, shot_setup
from tests.games.billiards.shots.shots_by_hand import R, ball, floor, pocket, shot, straight_pot

pytestmark = pytest.mark.full  # long runs and sweeps


def test_a_nudge_grows_as_gaps_over_diameters_hit_after_hit() -> None:
    d, nudge = 0.2, 1e-9
    hits = 4
    scene = floor(*(ball(str(k), d * k) for k in range(1, hits + 1)), shot(0.0, 4.0))
    attempt = shot_setup(scene)
    meant, aside = attempt.simulate(ways=True), attempt.simulate(attempt.changed("aim", nudge), ways=True)
    pair = ShotSeparation(meant, aside)
    times = [event.time for event in meant.events if event.kind == "ball"]
    assert len(times) == hits
    gap = d - 2.0 * R
    # When ball k is hit, what hits it is off by g times its heading's error, which each hit makes g/2R times as much.
    for k, time in enumerate(times):
        off = pair.distances(np.array([time - 1e-9]))[0, k]
        assert off == pytest.approx(nudge * gap * (gap / (2.0 * R)) ** k, rel=1e-4)  # 1e-16 m of 1e-10, and growing


def test_growth_per_hit_is_that_of_the_gaps() -> None:
    d, hits = 0.2, 4
    scene = floor(*(ball(str(k), d * k) for k in range(1, hits + 1)), shot(0.0, 4.0))
    gap = d - 2.0 * R
    # Three hits that each make g/2R of what the cue ball was off by at the first. Balls that have hit drift aside as
    # much as who they hit goes astray, so it may be either.
    tolerance = 0.999 * 1e-9 * gap * (gap / (2.0 * R)) ** (hits - 1)
    found = horizon(scene, nudge=1e-9, tolerance=tolerance, ladder=()).separation
    assert found.hits == hits - 1
    assert found.ball in ("2", "3")
    assert found.growth_per_hit == pytest.approx(gap / (2.0 * R), rel=1e-3)  # 0.999, over three hits
    assert found.time is not None and found.growth_per_second is not None
    (first, *_, last) = [event.time for event in shot_setup(scene).simulate().events if event.kind == "ball"]
    assert first < found.time < last
    grown = found.growth_per_second * (found.time - first)
    assert math.exp(grown) == pytest.approx(found.growth_per_hit**found.hits, rel=1e-9)  # the same growth twice told


def test_a_lone_ball_is_off_when_its_way_times_the_nudge_is_the_tolerance() -> None:
    scene = floor(shot(0.0, 1.0))
    attempt = shot_setup(scene)
    found = horizon(scene, nudge=1e-3, tolerance=1e-3, ladder=(1e-3, 1e-4)).separation
    assert found.time is not None
    (place,) = attempt.simulate(ways=True).at(np.array([found.time]))[:, 0]
    assert math.hypot(*place) * 1e-3 == pytest.approx(1e-3, rel=1e-6)  # 2 sin(a/2) for a
    assert (found.ball, found.hits, found.growth_per_hit) == ("cue", 0, None)


def test_smaller_nudges_part_later_and_too_small_ones_never() -> None:
    scene = floor(ball("a", 0.3, 0.01), ball("b", 0.6, -0.03), ball("c", 0.9, 0.05), shot(0.0, 5.0))
    found = horizon(scene, spread=Spread())
    times = [each.time for each in found.ladder]
    known = [time for time in times if time is not None]
    assert times[: len(known)] == known == sorted(known)
    assert times[-1] is None
    assert found.digits_per_second is not None and found.digits_per_second > 0.0
    assert found.player is not None and found.player.time is not None
    assert all(time <= found.duration + 1.0 for time in known)


def test_place_can_be_nudged_instead() -> None:
    scene = floor(ball("a", 0.3), shot(0.0, 2.0))
    found = horizon(scene, nudge=1e-4, by="place", tolerance=1e-3, ladder=())
    # At once all shots differ by 1e-4; after the hit the ball is off by that over 2R, for each metre it goes.
    assert found.separation.ball == "a"
    assert found.separation.time is not None
    (place,) = shot_setup(scene).simulate(ways=True).at(np.array([found.separation.time]))[:, 1]
    assert (place[0] - 0.3) * 1e-4 / (2.0 * R) == pytest.approx(1e-3, rel=1e-2)  # the hit is 1e-4 / 2R elsewhere, too


def test_balls_that_fall_a_moment_apart_are_not_apart() -> None:
    scene = straight_pot(0.3, 0.5)
    found = horizon(scene, nudge=1e-9, ladder=())
    assert found.separation.time is None
    assert found.separation.farthest < 1e-6  # m: a nudge of 1e-9, a hit that makes 4 times it, over half a metre
    assert found.by_a_radius.time is None
    attempt = shot_setup(scene)
    pair = ShotSeparation(attempt.simulate(ways=True), attempt.simulate(attempt.changed("speed", 1e-6), ways=True))
    assert pair.distances(np.linspace(0.0, pair.end, 20_000)).max() < 1e-4  # m: no jump to the pocket's centre


def test_a_ball_that_falls_in_one_shot_alone_is_apart() -> None:
    scene = floor(pocket("hole", 1.0), shot(math.asin(0.06) - 1e-7, 2.0))  # just over the rim
    found = horizon(scene, nudge=1e-6, ladder=())
    assert found.separation.ball == "cue"
    assert found.by_a_radius.time is not None


@pytest.mark.parametrize(("nudge", "tolerance"), [(0.0, 1e-3), (1e-9, 0.0), (math.nan, 1e-3)])
def test_what_is_not_positive_is_refused(nudge: float, tolerance: float) -> None:
    with pytest.raises(ValueError, match="both must be greater than 0"):
        horizon(floor(shot()), nudge=nudge, tolerance=tolerance)


@pytest.mark.parametrize("by", ["aim", "place"])
def test_a_ball_that_is_not_hit_changes_no_horizon(by: By) -> None:
    """Law: all that moves is moved by the struck ball, so its nudge says all, whatever else lies on the table."""
    balls = ball("a", 0.3, 0.01), ball("b", 0.6, -0.03)
    alone, beside = floor(*balls, shot(0.0, 5.0)), floor(ball("far", -0.9, 0.4), *balls, shot(0.0, 5.0))
    found, other = (horizon(scene, nudge=1e-4, by=by, ladder=(1e-4,)) for scene in (alone, beside))
    assert found.separation.time is not None
    assert other.separation == found.separation
    assert other.ladder == found.ladder
