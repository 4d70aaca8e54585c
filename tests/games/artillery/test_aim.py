"""Bots: without error they hit on any ground, in any air; otherwise their error follows from their skill."""

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
from tests.toml_text import toml

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

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
"""Seed and roughness of the ground, drags, wind, edges, positions of both tanks, and whether the right one shoots."""


@settings(max_examples=4)
@given(CASES)
def test_full_skill_hits_within_the_crater(case: tuple[Any, ...]) -> None:
    assert_hit(*case)


@pytest.mark.nightly
@given(CASES)
def test_full_skill_hits_from_any_position(case: tuple[Any, ...]) -> None:
    assert_hit(*case)


def assert_hit(
    seed: int, roughness: float, drags: tuple[float, float], wind: float, edges: Edges, a: float, b: float, back: bool
) -> None:
    ground, air = hills(seed, roughness, (a, b)), world(*drags, wind)
    origin, target = (b, a) if back else (a, b)
    muzzle = Muzzle((origin, ground.under(origin, 1.5) + 0.75), 2.25)
    aim = AimSolver(TargetingProblem(air, muzzle, ground, edges, 75.0, target, 0.2 * RADIUS)).solve()
    velocity = aim.speed * np.array([math.cos(aim.angle), math.sin(aim.angle)])
    found = landing(air, muzzle.at(np.array([aim.angle]))[0], velocity, ground, edges)
    assert found is not None
    assert abs(found.position[0] - target) == pytest.approx(abs(aim.miss), abs=1e-9)
    assert abs(found.position[0] - target) <= RADIUS
    assert 0.0 < aim.speed <= 75.0


DUEL = (
    toml("world", gravity=[0.0, -9.81])
    + toml("terrain", width=300.0)
    + toml("artillery", money=0)
    + toml("artillery.player", name="Red", position=60.0, bot=0.75)
    + toml("artillery.player", name="Blue", position=240.0)
)


def battlefield(bot: float) -> Battlefield:
    scene = loads(DUEL, overrides=[f"artillery.player.0.bot={bot}"])
    field = Battlefield(scene, scene.bodies)
    for tank in field.tanks.every:
        x, y = scene.bodies.position[tank.number].tolist()
        tank.position = (x, y)
    return field


def solution(turn: int, bot: float) -> FiringSolution:
    field = battlefield(bot)
    aim = BotPlanner(loads(DUEL).world, field, field.tanks.every[0], turn_generator(0, turn)).advance(10**9)
    assert aim is not None
    return aim


@pytest.mark.parametrize("edges", ["open", "rubber", "wrap"])
def test_search_in_steps_and_in_copies_finds_the_same_solution(edges: Edges) -> None:
    ground, air = hills(5, 0.4, (60.0, 240.0)), world(0.05, 0.0, 4.0)
    muzzle = Muzzle((60.0, ground.under(60.0, 1.5) + 0.75), 2.25)
    problem = TargetingProblem(air, muzzle, ground, edges, 75.0, 240.0, 0.2 * RADIUS)
    complete, stepwise, copies = AimSolver(problem).solve(), AimSolver(problem), 0
    while stepwise.advance(20_000) is None:
        original, stepwise = stepwise, copy.deepcopy(stepwise)
        original.advance(50_000)  # continuing the original does not change the copy
        copies += 1
    assert copies >= 10
    assert stepwise.found == complete


def test_lower_skill_has_normal_errors_that_depend_on_the_turn() -> None:
    erring = solution(0, bot=0.75)
    perfect = solution(0, bot=1.0)
    assert perfect == solution(1, bot=1.0)  # no error, whatever the random numbers
    assert erring.angle != perfect.angle
    errors = np.array([turn_generator(3, turn).standard_normal(2) for turn in range(400)])
    assert abs(errors.mean()) < 4.0 / math.sqrt(800)  # 4 σ of the mean
    assert errors.std() == pytest.approx(1.0, abs=4.0 / math.sqrt(1600))
    random = turn_generator(0, 0)
    choose_shot(battlefield(0.75).tanks, battlefield(0.75).tanks.every[0], random)
    first = random.standard_normal(2)
    assert erring.angle - perfect.angle == pytest.approx(0.25 * ANGLE_ERROR * first[0], abs=1e-12)
