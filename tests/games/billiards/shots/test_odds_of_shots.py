"""Shot ensembles: probabilities against closed forms, spreads of rest positions, independence of threads."""

import math
from statistics import NormalDist

import numpy as np
import pytest

from sandbox.engines.exact.tabletop.shots import Table
from sandbox.games.billiards.shots.aim_windows import windows
from sandbox.games.billiards.shots.monte_carlo import odds, wilson
from sandbox.games.billiards.shots.shot import NoSuchShotError, Spread
from sandbox.jsonable import to_json
from sandbox.scene.description.surface import Stroke, struck
from tests.games.billiards.shots.shots_by_hand import R, ball, pocket, scene_with, shot, straight_pot

pytestmark = pytest.mark.full  # long runs and sweeps

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
    low, high = wilson(chance.hits, chance.trials, SIGMAS)
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
    assert to_json(one.document()) == to_json(five.document())
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
    found = to_json(odds(straight_pot(0.5, 1.0), count=50).document())
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
