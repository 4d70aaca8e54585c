"""Random pinball tables: gates, kicks, holes, slopes, layers and drives together, with walls that change."""

import copy
import random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Drive, Impulse, Remove, Reshape, Spawn, Switch, Toggle
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Divergence
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # fuzzing and inputs at the ends of their ranges

STEPS = 40
LAYERS = (["ground"], ["ramp"], ["ground", "ramp"])
TimedActions = list[tuple[int, Action]]


def table(r: random.Random) -> dict[str, Any]:
    """Return a scene with every kind of element of a pinball table, at random positions, with overlaps."""

    def point(low: float = -1.5) -> list[float]:
        return [r.uniform(-1.5, 1.5), r.uniform(low, 1.5)]

    def surface(profile: str = "even") -> dict[str, Any]:
        found: dict[str, Any] = {"restitution": r.random(), "friction": r.random(), "layers": r.choice(LAYERS)}
        if r.random() < 0.5:
            found["kick"] = {"speed": r.uniform(0.0, 3.0), "profile": profile}
        return found

    walls = [
        {"name": f"wall {k}", "points": course(r), "thickness": 0.05, "one_way": r.random() < 0.5}
        | surface(r.choice(["even", "middle"]))
        for k in range(3)
    ]
    zones = [{"position": point(), "radius": r.uniform(0.2, 1.0), "layers": r.choice(LAYERS)} for _ in range(3)]
    zones[0]["holds"], zones[1]["gravity"], zones[2]["to_layer"] = True, [r.uniform(-5.0, 5.0), 2.0], "ramp"
    hinge, home = point(), point()
    air = r.choice([{}, {"linear_drag": 0.5}, {"quadratic_drag": 0.3}])
    return {
        "world": {"gravity": [0.0, -4.0], "duration": 1.0, **air},
        "solver": {"dt": 0.01, "substeps": r.choice([1, 4])},
        "plane": [{"point": [0.0, -1.6], "normal": [0.0, 1.0], "restitution": 0.5}],
        "wall": walls,
        "post": [{"name": "post", "position": point(), "radius": 0.1, **surface()}],
        "zone": zones,
        "ball": [
            {"name": f"ball {k}", "position": point(), "velocity": point(), "radius": 0.1, "friction": 0.5}
            for k in range(4)
        ],
        "box": [
            {"name": "bat", "position": hinge, "size": [0.5, 0.1], "mass": 0.5, "friction": 0.5},
            {"name": "rod", "position": home, "size": [0.1, 0.3], "mass": 0.5},
        ],
        "drive": [
            {"name": "flip", "kind": "torque", "body": "bat", "stops": [0.0, 0.8], "torque": 5.0, "bounce": 0.3}
            | {"pivot": [hinge[0] - 0.2, hinge[1]]},
            {"name": "shoot", "kind": "plunger", "body": "rod", "direction": [0.3, 1.0], "travel": 0.3, "speed": 3.0}
            | {"draw_time": 0.1},
        ],
    }


def course(r: random.Random) -> list[list[float]]:
    """Return a wall's points from left to right."""
    xs = sorted(r.uniform(-1.5, 1.5) for _ in range(3))
    return [[x + 0.1 * k, r.uniform(-1.5, 1.5)] for k, x in enumerate(xs)]


def drive_actions(r: random.Random) -> TimedActions:
    """Return actions that apply equally to a mirrored table."""
    return [
        (r.randrange(STEPS), Drive(time=0.0, drive=r.choice(["flip", "shoot"]), level=float(r.randrange(2))))
        if r.random() < 0.7
        else (r.randrange(STEPS), Toggle(time=0.0, thing=r.choice(["wall 0", "post"]), solid=r.random() < 0.5))
        for _ in range(6)
    ]


def table_actions(r: random.Random) -> TimedActions:
    """Return these actions and others, that do not apply to a mirrored table."""
    points = tuple((x, y) for x, y in course(r))
    ball = Ball(name="late", position=(r.uniform(-1.0, 1.0), r.uniform(-1.0, 1.0)), radius=0.1)
    each: list[Action] = [
        Reshape(time=0.0, thing="wall 1", points=points),
        Spawn(time=0.0, ball=ball),
        Remove(time=0.0, body=r.choice(["ball 0", "bat", "rod"])),
        Impulse(time=0.0, body="ball 1", impulse=(r.uniform(-0.1, 0.1), 0.1)),
        Switch(time=0.0, settings={"substeps": 2}),
    ]
    return [*drive_actions(r), *((r.randrange(STEPS), action) for action in r.sample(each, 3))]


def play(running: SwitchableSimulation, actions: TimedActions, steps: int = STEPS) -> None:
    for k in range(steps):
        for when, action in actions:
            if when == k:
                try:
                    running.apply(action)
                except ActionError:  # the body has been removed
                    continue
        running.step()


tables = st.integers(0, 2**32).map(random.Random)


@settings(max_examples=5)
@given(tables)
def test_energy_account_closes_with_any_elements_and_actions(r: random.Random) -> None:
    scene, actions = from_document(table(r)), table_actions(r)
    running = start(scene)
    running.account()
    initial = total_energy(running)
    try:
        play(running, actions)
        running.finish(0.6)
    except Divergence:  # a ball is squeezed between a kinematic body and the floor
        reject()  # a property that almost always diverges fails
    account = running.account()
    turnover = max(1.0, *(abs(energy) for energy in account.values()))
    assert abs(total_energy(running) - initial - sum(account.values())) < 1e-10 * turnover  # sums of rounding
    assert account["kicks"] >= 0.0


def mirrored(document: dict[str, Any]) -> dict[str, Any]:
    other = copy.deepcopy(document)
    for wall in other["wall"]:  # reversed, so that the left side of a wall stays its left side
        wall["points"] = [[-x, y] for x, y in reversed(wall["points"])]
    for kind in ("post", "zone", "ball", "box"):
        for each in other[kind]:
            for key in {"position", "velocity", "gravity"} & set(each):
                each[key][0] *= -1.0
    flip, shoot = other["drive"]
    flip["pivot"][0] *= -1.0
    flip["stops"] = [-angle for angle in flip["stops"]]
    shoot["direction"][0] *= -1.0
    return other


@pytest.mark.parametrize("seed", range(4))
def test_mirrored_table_gives_the_mirrored_motion(seed: int) -> None:
    r = random.Random(seed)
    document, actions = table(r), drive_actions(r)
    one, other = start(from_document(document)), start(from_document(mirrored(document)))
    for running in (one, other):
        play(running, actions)
    frame, mirror = one.frame(), other.frame()
    np.testing.assert_allclose(frame.position * [-1.0, 1.0], mirror.position, rtol=0.0, atol=1e-9)  # amplified rounding
    np.testing.assert_allclose(-frame.angle, mirror.angle, rtol=0.0, atol=1e-8)  # 1e-9 m on discs of 0.1 m
    assert (frame.visits == mirror.visits).all()
    assert (frame.layer == mirror.layer).all()
