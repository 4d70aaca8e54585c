"""Bot: it pots easy balls, its errors have the stated distribution, and higher skill wins."""

import numpy as np
import pytest

from sandbox.engines.exact.tabletop.shots import Table
from sandbox.games.billiards.bot import MAX_AIM_ERROR, MIN_AIM_ERROR, BilliardsBot, parse_bots
from sandbox.games.billiards.headless import play_frame
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.shot_search import best_pot_chance, pot_options
from sandbox.games.billiards.table_geometry import TableGeometry
from sandbox.scene.description.base import Point
from tests.games.billiards.tables_by_hand import changed_match, match, table

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

FAR = {str(k): (0.06 + 0.075 * k, 0.12) for k in range(2, 10)}


def match_with_one_at(one: Point, cue: Point) -> Match:
    """Return a match with the 1 on and the other balls away from it."""
    return changed_match(match("9-ball"), {**FAR, "1": one, "cue": cue}, opening=False, in_hand=None)


def pots_the_one(bot: BilliardsBot, now: Match) -> bool:
    plan = bot.plan(now)
    ready = Table(now.scene).with_balls(dict(zip(now.layout.names, now.position, strict=True)))
    return "1" in ready.shoot(plan.stroke).pocketed


STRAIGHT = [
    ((0.9, 0.95), (0.7, 0.65)),
    ((0.25, 0.25), (0.5, 0.5)),
    ((1.0, 1.27), (0.7, 1.27)),
    ((0.3, 1.2), (0.7, 1.1)),
]


def test_skilled_bot_pots_simple_shots() -> None:
    potted = [pots_the_one(BilliardsBot(0.8, seed), match_with_one_at(*shot)) for shot in STRAIGHT for seed in range(5)]
    assert np.mean(potted) >= 0.9  # σ is 0.75 mrad: the pockets are at least 20 σ wide


def test_unskilled_bot_misses_more_often() -> None:
    now = match_with_one_at((0.9, 2.0), (0.3, 0.5))
    potted = {
        skill: np.mean([pots_the_one(BilliardsBot(skill, seed), now) for seed in range(8)]) for skill in (0.0, 1.0)
    }
    assert potted[1.0] == 1.0
    assert potted[0.0] <= 0.5  # σ is 30 mrad, 5 cm over 1.6 m: nearly the diameter of a ball


def test_same_seed_gives_the_same_plan_and_errors_have_the_stated_deviation() -> None:
    now = match_with_one_at((0.9, 0.95), (0.7, 0.65))
    bot = BilliardsBot(0.3, 7)
    assert bot.plan(now) == BilliardsBot(0.3, 7).plan(now)
    assert bot.plan(now) != BilliardsBot(0.3, 8).plan(now)
    intended = bot.intend(now).stroke
    strokes = [bot.with_error(intended, k) for k in range(4000)]
    errors = np.array([(s.aim - intended.aim, s.speed / intended.speed - 1.0) for s in strokes])
    # the standard deviation of n = 4000 normal errors is known to 1/√(2n) = 1.1 %; the tolerance is four times that
    assert errors.std(axis=0) == pytest.approx((bot.sigma, bot.speed_error), rel=0.045)
    assert errors.mean(axis=0) == pytest.approx((0.0, 0.0), abs=4.0 * bot.speed_error / 4000**0.5)
    assert (BilliardsBot(0.0).sigma, BilliardsBot(1.0).sigma) == pytest.approx(
        (MAX_AIM_ERROR, MIN_AIM_ERROR), rel=1e-12
    )


def test_ball_in_hand_is_placed_where_a_pot_is_easier() -> None:
    now = changed_match(match_with_one_at((0.9, 2.0), (0.3, 0.5)), in_hand="anywhere")
    plan = BilliardsBot(0.5, 1).intend(now)
    assert plan.place is not None
    assert now.refusal(plan.place) is None
    before, after = match_with_one_at((0.9, 2.0), (0.3, 0.5)), match_with_one_at((0.9, 2.0), plan.place)
    assert best_pot_chance(after, 0.01) > best_pot_chance(before, 0.01)


def test_snookered_bot_hits_the_ball_on() -> None:
    # The 1 lies behind a row of other balls: it can be hit only by a cushion.
    row = {str(k): (0.36 + 0.06 * k, 1.2) for k in range(2, 10)}
    now = changed_match(match("9-ball"), {**row, "1": (0.7, 1.6), "cue": (0.7, 0.9)}, opening=False, in_hand=None)
    assert best_pot_chance(now, 0.001) == 0.0
    plan = BilliardsBot(1.0, 1).intend(now)
    outcome = Table(now.scene).with_balls(dict(zip(now.layout.names, now.position, strict=True))).shoot(plan.stroke)
    after = now.played(outcome.contacts, outcome.position, plan.call)
    assert after.verdict is not None
    assert not after.verdict.fouls


def test_chance_of_a_pot_is_the_pot_probability_under_normal_errors() -> None:
    """Straight pot, where the error of the object ball is that of the contact point: erf(δ / √2 σ)."""
    layout = TableGeometry.of(table("9-ball"))
    radius = layout.radius[0]
    one, cue = np.array([[1.0, 1.27]]), np.array([0.6, 1.27])
    shots = pot_options(layout, radius, cue, one, one, 0.02)
    side = list(layout.pockets).index("right pocket")
    assert shots.ghost[0, side] == pytest.approx((1.0 - 2.0 * radius, 1.27), abs=1e-12)
    x, _, hole = layout.pockets["right pocket"]
    far = 1.27 - 0.7 * radius - 1.0  # to the mouth of the pocket
    margin = (hole - radius) / far * 2.0 * radius / (0.4 - 2.0 * radius)
    errors = np.random.default_rng(3).normal(0.0, 0.02, 200_000)
    # error of the formula 5e-4, plus 3 σ of 2e5 draws, 3e-3
    assert shots.chance[0, side] == pytest.approx(np.mean(np.abs(errors) < margin), abs=4e-3)
    assert x > 1.27
    blocked = pot_options(layout, radius, cue, one, np.array([[1.0, 1.27], [0.8, 1.27]]), 0.02)
    assert blocked.chance[0, side] == 0.0


def test_bots_are_parsed_from_text() -> None:
    assert parse_bots("bot:0.5, bot", 3) == (BilliardsBot(0.5, 6), BilliardsBot(0.7, 7))
    for wrong in ("cat", "bot:2", "bot:", "bot:x", "bot:nan", "", "bot,bot,bot"):
        with pytest.raises(GameError):
            parse_bots(wrong)
    with pytest.raises(GameError, match="0 to 1"):
        BilliardsBot(1.5)


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "terms"), [("9-ball", {}), ("straight-rail", {"distance": 10})])
def test_higher_skill_wins_more_frames(name: str, terms: dict[str, int]) -> None:
    won = 0
    for seed in range(8):
        scene = table(name, seed)
        good = seed % 2  # the better bot breaks in every second frame
        bots = [BilliardsBot(0.9 if each == good else 0.2, seed) for each in (0, 1)]
        won += play_frame(Match.begin(scene, **terms), bots).match.state.winner == good
    assert won >= 6  # between equal bots the probability of 6 of 8 is one in seven


def test_bot_calls_the_eight_and_its_pocket() -> None:
    now = match("8-ball")
    pocketed = dict.fromkeys(map(str, range(1, 16)), table("8-ball").pockets[2].position)
    positions = {**pocketed, "8": (1.0, 1.27), "9": (0.3, 0.3), "cue": (0.7, 1.27)}
    groups = ("solids", "stripes")
    now = changed_match(now, positions, opening=False, in_hand=None, groups=groups, table=("8", "9"))
    plan = BilliardsBot(0.9, 1).intend(now)
    assert (plan.call.ball, plan.call.pocket) == ("8", "right pocket")
