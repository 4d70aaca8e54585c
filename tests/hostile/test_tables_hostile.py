"""Tables under attack: gates, kicks, holes, slopes, layers and drives all at once, and walls that come, go and bend."""

import copy
import random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Drive, Impulse, Remove, Reshape, Spawn, Switch, Toggle
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Divergence
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.sessions import rerun
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from sandbox.window.playback.session import Session

pytestmark = pytest.mark.full  # fuzzing and inputs at the ends of their ranges

STEPS = 40
LAYERS = (["ground"], ["ramp"], ["ground", "ramp"])
Timed = list[tuple[int, Action]]


def table(r: random.Random) -> dict[str, Any]:
    """Return a scene of all that a pinball table is made of, anywhere, and on top of each other."""

    def place(low: float = -1.5) -> list[float]:
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
    zones = [{"position": place(), "radius": r.uniform(0.2, 1.0), "layers": r.choice(LAYERS)} for _ in range(3)]
    zones[0]["holds"], zones[1]["gravity"], zones[2]["to_layer"] = True, [r.uniform(-5.0, 5.0), 2.0], "ramp"
    hinge, home = place(), place()
    air = r.choice([{}, {"linear_drag": 0.5}, {"quadratic_drag": 0.3}])
    return {
        "world": {"gravity": [0.0, -4.0], "duration": 1.0, **air},
        "solver": {"dt": 0.01, "substeps": r.choice([1, 4])},
        "plane": [{"point": [0.0, -1.6], "normal": [0.0, 1.0], "restitution": 0.5}],
        "wall": walls,
        "post": [{"name": "post", "position": place(), "radius": 0.1, **surface()}],
        "zone": zones,
        "ball": [
            {"name": f"ball {k}", "position": place(), "velocity": place(), "radius": 0.1, "friction": 0.5}
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


def driven(r: random.Random) -> Timed:
    """Return what a mirrored table can be told alike."""
    return [
        (r.randrange(STEPS), Drive(time=0.0, drive=r.choice(["flip", "shoot"]), level=float(r.randrange(2))))
        if r.random() < 0.7
        else (r.randrange(STEPS), Toggle(time=0.0, thing=r.choice(["wall 0", "post"]), solid=r.random() < 0.5))
        for _ in range(6)
    ]


def interfering(r: random.Random) -> Timed:
    """Return what else can be done to it."""
    points = tuple((x, y) for x, y in course(r))
    ball = Ball(name="late", position=(r.uniform(-1.0, 1.0), r.uniform(-1.0, 1.0)), radius=0.1)
    each: list[Action] = [
        Reshape(time=0.0, thing="wall 1", points=points),
        Spawn(time=0.0, ball=ball),
        Remove(time=0.0, body=r.choice(["ball 0", "bat", "rod"])),
        Impulse(time=0.0, body="ball 1", impulse=(r.uniform(-0.1, 0.1), 0.1)),
        Switch(time=0.0, settings={"substeps": 2}),
    ]
    return [*driven(r), *((r.randrange(STEPS), action) for action in r.sample(each, 3))]


def play(running: SwitchableSimulation | Session, told: Timed, steps: int = STEPS) -> None:
    for k in range(steps):
        for when, action in told:
            if when == k:
                try:
                    running.apply(action)
                except ActionError:  # of who is gone
                    continue
        running.advance() if isinstance(running, Session) else running.step()


tables = st.integers(0, 2**32).map(random.Random)


@settings(max_examples=5, deadline=None)
@given(tables)
def test_account_closes_whatever_comes_together(r: random.Random) -> None:
    scene, told = from_document(table(r)), interfering(r)
    running = start(scene)
    running.account()
    begin = total_energy(running)
    try:
        play(running, told)
        running.finish(0.6)
    except Divergence:  # a ball between a kinematic body and the floor has nowhere to go
        return
    booked = running.account()
    turned_over = max(1.0, *(abs(energy) for energy in booked.values()))
    assert abs(total_energy(running) - begin - sum(booked.values())) < 1e-10 * turned_over  # sums of rounding
    assert booked["kicks"] >= 0.0


def mirrored(document: dict[str, Any]) -> dict[str, Any]:
    other = copy.deepcopy(document)
    for wall in other["wall"]:  # turned round, so that its left is where it was
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
def test_mirrored_table_is_played_mirrored(seed: int) -> None:
    r = random.Random(seed)
    document, told = table(r), driven(r)
    one, other = start(from_document(document)), start(from_document(mirrored(document)))
    for running in (one, other):
        play(running, told)
    here, there = one.frame(), other.frame()
    np.testing.assert_allclose(here.position * [-1.0, 1.0], there.position, rtol=0.0, atol=1e-9)  # rounding that grew
    np.testing.assert_allclose(-here.angle, there.angle, rtol=0.0, atol=1e-8)  # on discs of 0.1 m
    assert (here.visits == there.visits).all()
    assert (here.layer == there.layer).all()


@pytest.mark.parametrize("seed", range(3))
def test_table_is_seen_again_as_it_was(seed: int) -> None:
    r = random.Random(seed)
    session = Session(from_document(table(r)))
    play(session, interfering(r))
    there = session.simulation.state_hash()
    for step in (10, 25, STEPS):
        assert all(0.0 < share <= 1.0 for share in session.seek(step))
    assert session.simulation.state_hash() == there
    recording = session.recording()
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash == there
