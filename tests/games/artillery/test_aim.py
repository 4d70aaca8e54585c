"""Bots: without error they hit from any ground, in any air; with it they miss as much as their skill says."""

import math
from typing import Any

import numpy as np
import pytest
from grounds import hills, world
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.games.artillery.aim import best_aim
from sandbox.games.artillery.bot import ANGLE_ERROR, aimed, chances
from sandbox.games.artillery.field import Field
from sandbox.games.artillery.flight import landing
from sandbox.games.artillery.weapons import WEAPONS
from sandbox.scene.artillery.described import Edges
from sandbox.scene.file import loads
from sandbox.trajectory import FloatArray

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
    own = np.array([here, ground.under(here, 1.5) + 0.75])

    def muzzle(angle: FloatArray) -> FloatArray:
        return own + 2.25 * np.column_stack((np.cos(angle), np.sin(angle)))

    target = there, ground.under(there, 1.5) + 0.75
    aim = best_aim(air, muzzle, ground, edges, 75.0, target, 0.2 * RADIUS)
    velocity = aim.speed * np.array([math.cos(aim.angle), math.sin(aim.angle)])
    found = landing(air, muzzle(np.array([aim.angle]))[0], velocity, ground, edges)
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
[[artillery.player]]
name = "Red"
position = 60.0
bot = 0.75
[[artillery.player]]
name = "Blue"
position = 240.0
"""


def test_less_skill_errs_normally_and_by_the_turn() -> None:
    scene = loads(DUEL)
    field = Field(scene, scene.bodies)
    red, blue = field.tanks.every
    for tank in (red, blue):
        x, y = scene.bodies.position[tank.number].tolist()
        tank.place = (x, y)
    true = aimed(scene.world, field, red, blue, RADIUS, chances(0, 0))
    red.player = red.player.model_copy(update={"bot": 1.0})
    best = aimed(scene.world, field, red, blue, RADIUS, chances(0, 0))
    assert best == aimed(scene.world, field, red, blue, RADIUS, chances(0, 1))  # no error, whatever the chances
    assert true.angle != best.angle
    errors = np.array([chances(3, turn).standard_normal(2) for turn in range(400)])
    assert abs(errors.mean()) < 4.0 / math.sqrt(800)  # 4 σ of a mean
    assert errors.std() == pytest.approx(1.0, abs=4.0 / math.sqrt(1600))
    first = chances(0, 0).standard_normal(2)
    assert true.angle - best.angle == pytest.approx(0.25 * ANGLE_ERROR * first[0], abs=1e-12)
