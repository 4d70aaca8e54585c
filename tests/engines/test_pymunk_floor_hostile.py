"""Balls on a surface on pymunk, with random parameters and actions."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Force, Impulse, Move, Remove, Spawn, Strike
from sandbox.engines.contract import Divergence, Simulation
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from tests.strategies import numbers

pytestmark = pytest.mark.full  # property tests with many examples

RADIUS = 0.03
NAMES = ("a", "b", "c", "d")

positions = st.tuples(numbers(-0.3, 0.3), numbers(-0.3, 0.3))
speeds = numbers(-5, 5) | numbers(-1e11, 1e11)
spins = st.tuples(*[numbers(-100, 100) | numbers(-1e11, 1e11)] * 3)
fractions = st.sampled_from([0.0, 0.5, 1.0])
frictions = st.sampled_from([0.0, 1e-3, 0.2, 1000.0])


@st.composite
def tables(draw: st.DrawFn) -> Scene:
    balls: list[dict[str, Any]] = [
        {
            "name": name,
            "position": draw(positions),
            "velocity": [draw(speeds), draw(speeds)],
            "spin": draw(spins),
            "radius": RADIUS,
            "mass": draw(st.sampled_from([0.2, 1e-15, 1e30])),
            "restitution": draw(fractions),
            "collides": draw(st.sampled_from(["all", "all", "fixed", "none"])),
        }
        for name in NAMES
    ]
    keys = ("sliding_friction", "rolling_friction", "spinning_friction")
    surface_values = {
        "restitution": draw(fractions),
        "friction": draw(frictions),
        "height": draw(st.sampled_from([0.001, 0.03, 0.059])),
    }
    return from_document(
        {
            "solver": {"dt": draw(st.sampled_from([1e-4, 0.01, 1.0])), "substeps": draw(st.sampled_from([1, 3]))},
            "surface": {key: draw(frictions) for key in keys},
            "contact_models": {
                "ball_ball": draw(st.sampled_from(["elastic", "frictional"])),
                "cushion": draw(st.sampled_from(["simple", "han2005"])),
            },
            "plane": [{"point": [0, -0.5], "normal": [0, 1]}] if draw(st.booleans()) else [],
            "wall": [
                {
                    **surface_values,
                    "points": [draw(positions), (0.4, 0.1), (0.4, 0.4)],
                    "thickness": draw(fractions) * 0.05,
                }
            ],
            "post": [{**surface_values, "position": draw(positions), "radius": 0.02}],
            "pocket": [{"position": draw(positions), "radius": 0.05}],
            "ball": balls,
        }
    )


@st.composite
def actions_on_balls(draw: st.DrawFn) -> Action:
    body = draw(st.sampled_from([*NAMES, "new", "nobody"]))
    pair = st.tuples(speeds, speeds)
    ball = Ball(name="new", position=draw(positions), radius=draw(st.sampled_from([RADIUS, 0.1])), spin=draw(spins))
    kinds: list[Action] = [
        Impulse(time=0, body=body, impulse=draw(pair), angular=draw(speeds)),
        Force(time=0, body=body, force=draw(pair), torque=draw(speeds)),
        Move(time=0, body=body, position=draw(positions), velocity=draw(st.none() | pair)),
        Remove(time=0, body=body),
        Spawn(time=0, ball=ball),
        Strike(time=0, ball=body, aim=1.0, speed=50.0, side=draw(numbers(-0.5, 0.5)), height=draw(numbers(-0.5, 0.5))),
    ]
    return draw(st.sampled_from(kinds))


def outcome(simulation: Simulation, actions: list[Action]) -> tuple[list[str], str]:
    """Apply each action and step; return the messages of errors and the final state hash."""
    messages = []
    for action in actions:
        try:
            simulation.apply(action)
            for _ in range(3):
                simulation.step()
                frame = simulation.frame()
                assert frame.spin is not None or frame.roll is None
                for each in (frame.position, frame.velocity, frame.angle, frame.roll):
                    assert each is None or np.isfinite(each).all()
        except (ActionError, Divergence) as error:
            messages.append(str(error))
            if isinstance(error, Divergence):
                break
    return messages, simulation.state_hash()


@given(tables(), st.lists(actions_on_balls(), min_size=1, max_size=6))
@settings(max_examples=30, deadline=None)
def test_any_table_and_action_stay_finite_or_diverge_reproducibly(scene: Scene, actions: list[Action]) -> None:
    first, again = start(scene), start(scene)
    first.contacts()
    first.account()  # queries must not change the result
    assert outcome(first, actions) == outcome(again, actions)
    assert np.isfinite(first.contacts().impulse).all()
