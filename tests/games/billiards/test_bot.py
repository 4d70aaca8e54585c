"""The bot: it pots what is easy, keeps to its chances, and more skill wins."""

import numpy as np
import pytest

from sandbox.engines.exact.tabletop.shots import Table
from sandbox.games.billiards.bot import MAX_AIM_ERROR, MIN_AIM_ERROR, BilliardsBot, parse_bots
from sandbox.games.billiards.headless import play_frame
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.shot_search import ease, pot_options
from sandbox.games.billiards.table_geometry import TableGeometry
from sandbox.scene.description.base import Point
from tests.games.billiards.tables_by_hand import lying, match, table

pytestmark = pytest.mark.full  # long runs and sweeps

FAR = {str(k): (0.06 + 0.075 * k, 0.12) for k in range(2, 10)}


def alone(one: Point, cue: Point) -> Match:
    """The 1 to be played, the others out of the way."""
    plain = lying("9-ball", {**FAR, "1": one, "cue": cue}).document()
    plain["state"] |= {"opening": False, "in_hand": None}
    return Match.restored(table("9-ball"), plain)


def pots_it(bot: BilliardsBot, now: Match) -> bool:
    plan = bot.plan(now)
    ready = Table(now.scene).with_balls(dict(zip(now.layout.names, now.position, strict=True)))
    return "1" in ready.shoot(plan.stroke).pocketed


STRAIGHT = [
    ((0.9, 0.95), (0.7, 0.65)),
    ((0.25, 0.25), (0.5, 0.5)),
    ((1.0, 1.27), (0.7, 1.27)),
    ((0.3, 1.2), (0.7, 1.1)),
]


def test_simple_shots_fall() -> None:
    made = [pots_it(BilliardsBot(0.8, seed), alone(*shot)) for shot in STRAIGHT for seed in range(5)]
    assert np.mean(made) >= 0.9  # σ is 0.75 mrad: the pockets are 20 σ and more wide


def test_unskilled_miss_more() -> None:
    now = alone((0.9, 2.0), (0.3, 0.5))
    made = {skill: np.mean([pots_it(BilliardsBot(skill, seed), now) for seed in range(8)]) for skill in (0.0, 1.0)}
    assert made[1.0] == 1.0
    assert made[0.0] <= 0.5  # σ is 30 mrad, over 1.6 m 5 cm: nearly a ball


def test_same_seed_plays_the_same_and_errors_are_as_told() -> None:
    now = alone((0.9, 0.95), (0.7, 0.65))
    bot = BilliardsBot(0.3, 7)
    assert bot.plan(now) == BilliardsBot(0.3, 7).plan(now)
    assert bot.plan(now) != BilliardsBot(0.3, 8).plan(now)
    meant = bot.intend(now).stroke
    erred = np.array(
        [(s.aim - meant.aim, s.speed / meant.speed - 1.0) for k in range(4000) if (s := bot.with_error(meant, k))]
    )
    # the spread of n = 4000 normal errors is known to 1/√(2n) = 1.1 %, here within four times that
    assert erred.std(axis=0) == pytest.approx((bot.sigma, bot.speed_error), rel=0.045)
    assert erred.mean(axis=0) == pytest.approx((0.0, 0.0), abs=4.0 * bot.speed_error / 4000**0.5)
    assert (BilliardsBot(0.0).sigma, BilliardsBot(1.0).sigma) == pytest.approx(
        (MAX_AIM_ERROR, MIN_AIM_ERROR), rel=1e-12
    )


def test_ball_in_hand_is_put_where_a_pot_is_easy() -> None:
    plain = alone((0.9, 2.0), (0.3, 0.5)).document()
    plain["state"] |= {"in_hand": "anywhere"}
    now = Match.restored(table("9-ball"), plain)
    plan = BilliardsBot(0.5, 1).intend(now)
    assert plan.place is not None
    assert now.refusal(plan.place) is None
    before, after = alone((0.9, 2.0), (0.3, 0.5)), alone((0.9, 2.0), plan.place)
    assert ease(after, 0.01) > ease(before, 0.01)


def test_one_who_is_snookered_still_hits_the_ball_on() -> None:
    # The 1 lies behind a row of others: only by a cushion can it be hit.
    row = {str(k): (0.36 + 0.06 * k, 1.2) for k in range(2, 10)}
    plain = lying("9-ball", {**row, "1": (0.7, 1.6), "cue": (0.7, 0.9)}).document()
    plain["state"] |= {"opening": False, "in_hand": None}
    now = Match.restored(table("9-ball"), plain)
    assert ease(now, 0.001) == 0.0
    plan = BilliardsBot(1.0, 1).intend(now)
    outcome = Table(now.scene).with_balls(dict(zip(now.layout.names, now.position, strict=True))).shoot(plan.stroke)
    after = now.played(outcome.contacts, outcome.position, plan.call)
    assert after.verdict is not None
    assert not after.verdict.fouls


def test_ease_is_the_chance_of_normal_errors() -> None:
    """Straight in, so that the object ball's error is that of the touch: erf(δ / √2 σ) within that of the formula."""
    layout = TableGeometry.of(table("9-ball"))
    radius = layout.radius[0]
    one, cue = np.array([[1.0, 1.27]]), np.array([0.6, 1.27])
    shots = pot_options(layout, radius, cue, one, one, 0.02)
    side = list(layout.pockets).index("right pocket")
    assert shots.ghost[0, side] == pytest.approx((1.0 - 2.0 * radius, 1.27), abs=1e-12)
    x, _, hole = layout.pockets["right pocket"]
    far = 1.27 - 0.7 * radius - 1.0  # to the mouth
    margin = (hole - radius) / far * 2.0 * radius / (0.4 - 2.0 * radius)
    errors = np.random.default_rng(3).normal(0.0, 0.02, 200_000)
    # 5e-4 of the formula, and 3 σ of 2e5 draws, 3e-3
    assert shots.chance[0, side] == pytest.approx(np.mean(np.abs(errors) < margin), abs=4e-3)
    assert x > 1.27
    blocked = pot_options(layout, radius, cue, one, np.array([[1.0, 1.27], [0.8, 1.27]]), 0.02)
    assert blocked.chance[0, side] == 0.0


def test_players_are_named() -> None:
    assert parse_bots("bot:0.5, bot", 3) == (BilliardsBot(0.5, 6), BilliardsBot(0.7, 7))
    for wrong in ("cat", "bot:2", "bot:", "bot:x", "bot:nan", "", "bot,bot,bot"):
        with pytest.raises(GameError):
            parse_bots(wrong)
    with pytest.raises(GameError, match="0 to 1"):
        BilliardsBot(1.5)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "terms"), [("9-ball", {}), ("straight-rail", {"distance": 10})])
def test_skill_wins(name: str, terms: dict[str, int]) -> None:
    won = 0
    for seed in range(8):
        scene = table(name, seed)
        good = seed % 2  # the first shot goes round
        bots = [BilliardsBot(0.9 if each == good else 0.2, seed) for each in (0, 1)]
        won += play_frame(Match.begin(scene, **terms), bots).match.state.winner == good
    assert won >= 6  # of equals one in seven wins so many


def test_every_call_is_one_that_can_be_made() -> None:
    now = match("8-ball")
    plain = now.document()
    plain["state"] |= {"opening": False, "in_hand": None, "groups": ["solids", "stripes"], "table": ["8", "9"]}
    pocket = table("8-ball").pockets[2].position
    for ball in range(1, 16):
        if ball not in (8, 9):
            plain["position"][now.layout.number[str(ball)]] = list(pocket)
    plain["position"][now.layout.number["8"]] = [1.0, 1.27]
    plain["position"][now.layout.number["9"]] = [0.3, 0.3]
    plain["position"][now.layout.number["cue"]] = [0.7, 1.27]
    plan = BilliardsBot(0.9, 1).intend(Match.restored(table("8-ball"), plain))
    assert (plan.call.ball, plan.call.pocket) == ("8", "right pocket")
