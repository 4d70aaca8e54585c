"""Bots: without error they hit from any ground, in any air; with it they miss as much as their skill says."""

import copy
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.games.artillery.ballistics import landing
from sandbox.games.artillery.battlefield import WEAPONS, Battlefield, Muzzle
from sandbox.games.artillery.bot_planner import ANGLE_ERROR, BotPlanner, choose_shot, turn_generator
from sandbox.games.artillery.scene import Edges
from sandbox.games.artillery.targeting import AimSolver, FiringSolution, TargetingProblem
from sandbox.scene.files.load import loads
from tests.games.artillery.grounds import hills, world

pytestmark = pytest.mark.full  # long runs and sweeps

AIRS = [(0.0, 0.0), (0.06, 0.0), (0.0, 0.002)]
RADIUS = WEAPONS[0].radius


CASES = st.tuples(
    st.integers(0, 10_000),
    st.floats(0.0, 0.6),
    st.sampled_from(AIRS),
    st.floats(-8.0, 8.0),
    st.sampled_from(["open", "rubber", "wrap"]),
    st.floats(10.0, 130.0),
    st.floats(160.0, 290.0),
    st.booleans(),
)
"""Seed and roughness of the ground, drags, wind, sides, and where the two stand, one on each half; who shoots."""


@settings(max_examples=4)
@given(CASES)
def test_full_skill_hits_within_the_crater(case: tuple[Any, ...]) -> None:
    hits(*case)


@pytest.mark.slow
@settings(max_examples=60)
@given(CASES)
def test_full_skill_hits_wherever_it_stands(case: tuple[Any, ...]) -> None:
    hits(*case)


def hits(
    seed: int, roughness: float, drags: tuple[float, float], wind: float, edges: Edges, a: float, b: float, back: bool
) -> None:
    ground, air = hills(seed, roughness, (a, b)), world(*drags, wind)
    here, there = (b, a) if back else (a, b)
    muzzle = Muzzle((here, ground.under(here, 1.5) + 0.75), 2.25)
    aim = AimSolver(TargetingProblem(air, muzzle, ground, edges, 75.0, there, 0.2 * RADIUS)).all()
    velocity = aim.speed * np.array([math.cos(aim.angle), math.sin(aim.angle)])
    found = landing(air, muzzle.at(np.array([aim.angle]))[0], velocity, ground, edges)
    assert found is not None
    assert abs(found.place[0] - there) == pytest.approx(abs(aim.miss), abs=1e-9)
    assert abs(found.place[0] - there) <= RADIUS
    assert 0.0 < aim.speed <= 75.0


DUEL = """
[world]
gravity = [0.0, -9.81]
[terrain]
width = 300.0
[artillery]
money = 0
[[artillery.player]]
name = "Red"
position = 60.0
bot = 0.75
[[artillery.player]]
name = "Blue"
position = 240.0
"""


def laid_out(bot: float) -> Battlefield:
    scene = loads(DUEL, overrides=[f"artillery.player.0.bot={bot}"])
    field = Battlefield(scene, scene.bodies)
    for tank in field.tanks.every:
        x, y = scene.bodies.position[tank.number].tolist()
        tank.place = (x, y)
    return field


def thought_of(turn: int, bot: float) -> FiringSolution:
    field = laid_out(bot)
    aim = BotPlanner(loads(DUEL).world, field, field.tanks.every[0], turn_generator(0, turn)).go_on(10**9)
    assert aim is not None
    return aim


@pytest.mark.parametrize("edges", ["open", "rubber", "wrap"])
def test_search_by_and_by_and_by_copies_finds_what_one_go_does(edges: Edges) -> None:
    ground, air = hills(5, 0.4, (60.0, 240.0)), world(0.05, 0.0, 4.0)
    muzzle = Muzzle((60.0, ground.under(60.0, 1.5) + 0.75), 2.25)
    range_ = TargetingProblem(air, muzzle, ground, edges, 75.0, 240.0, 0.2 * RADIUS)
    at_once, slow, copies = AimSolver(range_).all(), AimSolver(range_), 0
    while slow.go_on(20_000) is None:
        left_behind, slow = slow, copy.deepcopy(slow)
        left_behind.go_on(50_000)  # what goes on elsewhere is none of the copy's
        copies += 1
    assert copies >= 10
    assert slow.found == at_once


def test_less_skill_errs_normally_and_by_the_turn() -> None:
    true = thought_of(0, bot=0.75)
    best = thought_of(0, bot=1.0)
    assert best == thought_of(1, bot=1.0)  # no error, whatever the chances
    assert true.angle != best.angle
    errors = np.array([turn_generator(3, turn).standard_normal(2) for turn in range(400)])
    assert abs(errors.mean()) < 4.0 / math.sqrt(800)  # 4 σ of a mean
    assert errors.std() == pytest.approx(1.0, abs=4.0 / math.sqrt(1600))
    random = turn_generator(0, 0)
    choose_shot(laid_out(0.75).tanks, laid_out(0.75).tanks.every[0], random)
    first = random.standard_normal(2)
    assert true.angle - best.angle == pytest.approx(0.25 * ANGLE_ERROR * first[0], abs=1e-12)
