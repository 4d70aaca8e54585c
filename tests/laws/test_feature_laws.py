"""Every feature of a scene obeys the same laws on every engine that is able to run it.

A law is a function of a scene and an engine. A representative sample of the features is tested on every change, all of
them nightly; shipped scenes obey the laws that need no actions.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from sandbox.action import (
    Action,
    ActionError,
    Drive,
    Force,
    Impulse,
    Launch,
    Pull,
    Remove,
    Reshape,
    SetParameter,
    Spawn,
    Steer,
    Switch,
    Throttle,
    Toggle,
)
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import ENGINES, able
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, load, loads
from sandbox.scene.files.shipped_scenes import find
from tests.accounts import closed_account
from tests.engines.stepping import advance, advanced, assert_same_frames, continued, stepped
from tests.laws.features import BODIES, FEATURES, document, scene_with
from tests.samples import each_shipped_scene

pytestmark = pytest.mark.fail_slow(60)  # pile and fireworks are large, and kernels compile on first use

STEPS = 30
"""in each part of a run; two balls fall on a wall after about 14"""

SAMPLE = (
    "attractions", "thrusts", "tyres", "wall", "kicking wall", "drifting wall", "one-way wall", "groups",
    "kinematic body", "path", "one-way body", "liquid",
    "holding zone", "sensors", "layers", "bounds", "damping", "pockets", "pucks", "emitter", "rope", "torque drive",
    "plunger drive", "pivot between two", "pulley between two", "friction of the ground", "weak spring",
)  # fmt: skip
"""One of each kind of feature; `able` names every engine among them."""

ACTIONS: tuple[Action, ...] = (
    Impulse(time=0.0, body="a", impulse=(0.1, 0.2)),
    Force(time=0.0, body="a", force=(0.1, 0.0)),
    Throttle(time=0.0, thrust="t", level=0.5),
    Steer(time=0.0, tyre="y", throttle=0.5, steer=-1.0),
    Steer(time=0.0, tyre="z", brake=0.5),
    Drive(time=0.0, drive="d", level=0.5),
    Reshape(time=0.0, thing="w", points=((-5.0, 2.4), (0.0, 2.3), (5.0, 2.4))),
)
LATER: tuple[Action, ...] = (
    Pull(time=0.0, body="b", target=(2.0, 3.5)),
    Launch(time=0.0, generator="g", seed=3),
    Throttle(time=0.0, thrust="t", level=1.0),
    Steer(time=0.0, tyre="y", throttle=-1.0, steer=0.5),
    Drive(time=0.0, drive="d", level=1.0),
    SetParameter(time=0.0, path="world.gravity", value=[0.0, -1.0]),
    Spawn(time=0.0, ball=Ball(name="new", position=(9.0, 3.0), radius=0.5)),
    Toggle(time=0.0, thing="w", solid=False),
)


def accepted(simulation: Any, actions: tuple[Action, ...]) -> list[Action]:
    """Apply the actions that a scene has the elements for, and return them with the time at which they apply."""
    found = []
    for action in actions:
        timed = action.model_copy(update={"time": simulation.time})
        try:
            simulation.apply(timed)
        except ActionError:
            continue
        found.append(timed)
    return found


def started(scene: Scene, engine: str) -> SwitchableSimulation:
    """Start a scene, apply the actions that it accepts, and make some steps."""
    simulation = start(scene, engine)
    simulation.contacts()
    accepted(simulation, ACTIONS)
    return advance(simulation, STEPS if len(scene.bodies) < 1000 else 3)


def kept(simulation: SwitchableSimulation) -> list[object]:
    """Return what no change of the engine may change."""
    frame = simulation.frame()
    return [
        simulation.time,
        simulation.state_hash(),
        frame.present.tolist(),
        *(None if each is None else each.tolist() for each in (frame.layer, frame.visits, frame.passing, frame.drives)),
        dict(simulation.retired),
        dict(simulation.broken),
        dict(simulation.pulls),
        dict(simulation.throttles),
        dict(simulation.steering),
        simulation.bodies.names,
        simulation.scene,
    ]


def survives_switch(scene: Scene, engine: str) -> None:
    """A switch of the engine changes nothing by itself, there and back, and removed bodies stay removed."""
    point = started(scene, engine).checkpoint()
    for other in able(scene):
        simulation, steps = SwitchableSimulation.resumed(point), STEPS
        simulation.contacts()
        for removed in ("a", None):
            for target in (other, engine):
                before, gone = kept(simulation), set(simulation.retired)
                try:
                    simulation.apply(Switch(time=0.0, engine=target))
                except ActionError as refusal:  # a state that only this engine cannot start from
                    assert "refuses" in str(refusal) or "does not" in str(refusal)
                    assert kept(simulation) == before and target in ("exact", "box2d")
                    break
                assert kept(simulation) == before
                steps += 3
                # no sum of parts, which rounds differently
                assert advance(simulation, 3).time == steps * scene.solver.dt
                assert np.isfinite(simulation.frame().position).all()
                assert gone <= set(simulation.retired)
                accepted(simulation, LATER)
            if removed in simulation.bodies.names and not accepted(simulation, (Remove(time=0.0, body=removed),)):
                assert not simulation.frame().present[simulation.bodies.names.index(removed)]


COPYING = ("exact", "reference")
"""Engines with snapshots; pymunk and Box2D keep their state inside their space or world."""


def survives_snapshot(scene: Scene, engine: str) -> None:
    """A snapshot continues as the simulation did, and a checkpoint as a recorded switch that resumes."""
    simulation = started(scene, engine)
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    assert kept(resumed)[:-1] == kept(simulation)[:-1]
    assert loads(dumps(resumed.scene)) == loads(dumps(simulation.scene))
    steps = STEPS if len(scene.bodies) < 1000 else 3  # exact cannot compute a pile for long
    if engine in COPYING:
        snapshot = simulation.snapshot()
        first = continued(simulation, steps)
        simulation.restore(snapshot)
        assert continued(simulation, steps) == first
        simulation.restore(snapshot)
    simulation.apply(Switch(time=0.0, resumes=True))
    for each in (simulation, resumed):
        accepted(each, LATER)
        advance(each, steps)
    assert resumed.state_hash() == simulation.state_hash()


def replays(scene: Scene, engine: str) -> None:
    """A session that is recorded, written, read and run again ends in the same state."""
    simulation = start(scene, engine)
    actions = accepted(simulation, ACTIONS)
    actions += accepted(advance(simulation, STEPS), (*LATER, Switch(time=0.0, settings={"dt": 0.004})))
    advance(simulation, STEPS)
    last = simulation.state_hash()
    recording = Recording(scene, engine, scene.solver, tuple(actions), simulation.time, last)
    assert rerun(Recording.from_json(recording.to_json())).info["state_hash"] == last


def ledger_closes(scene: Scene, engine: str) -> None:
    """The account of energy balances through actions and a cut step, and does not affect the run."""
    if not ENGINES[engine].knows_impulses:
        with pytest.raises(Refusal, match="impulses"):
            start(scene, engine).account()
        return
    probe = start(scene, engine)
    timed = [(0, action) for action in accepted(probe, ACTIONS)]
    timed += [(STEPS, action) for action in accepted(advance(probe, STEPS), (*LATER[2:],))]
    closed_account(scene, 2 * STEPS, timed, 0.3, engine=engine, closes=1e-11)  # rounding of sums


def advance_equals_steps(scene: Scene, engine: str) -> None:
    """`advance` makes the same steps as `step`, bit for bit."""
    splits = [1, 2] if len(scene.bodies) >= (1000 if engine == "exact" else 5000) else [1, 7, 40, 30]
    (one, seen), (other, seen_other) = (way(start(scene, engine), splits, 2) for way in (stepped, advanced))
    assert seen == seen_other
    assert_same_frames(one, other)


def has_prefix(scene: Scene, engine: str) -> None:
    """A shorter run is bit for bit the prefix of a longer one: states do not depend on the duration of the scene."""

    def states(duration: float) -> Iterator[str]:
        world = scene.world.model_copy(update={"duration": duration})
        simulation = start(scene.model_copy(update={"world": world}), engine)
        simulation.contacts()  # as a run and a session do
        try:
            for _ in range(steps):
                simulation.step()
                yield simulation.state_hash()
        except (Divergence, Exhaustion) as end:
            yield type(end).__name__

    steps = {"Pile": 120, "Ragdoll on stairs": 240}.get(scene.title, 40)  # these fall first
    assert list(states(steps * scene.solver.dt)) == list(states(1000.0))


Law = Callable[[Scene, str], None]
LAWS: tuple[Law, ...] = (survives_switch, survives_snapshot, replays, ledger_closes, advance_equals_steps, has_prefix)
SPRING_WORK = "pymunk's account misses work of a spring on a driven body"
FAULTS: dict[tuple[str, str, Law], str] = {
    ("springs tied to a drive", "pymunk", ledger_closes): SPRING_WORK,
}
"""Known faults of engines: `xfail_strict` makes a case fail once its fault is repaired."""


def case(feature: str, engine: str, law: Law) -> Any:
    marks = [] if feature in SAMPLE else [pytest.mark.nightly]
    if (feature, engine, law) in FAULTS:
        marks.append(pytest.mark.xfail(reason=FAULTS[feature, engine, law]))
    return pytest.param(feature, engine, law, id=f"{feature}-{engine}-{law.__name__}", marks=marks)


@pytest.mark.parametrize(
    ("feature", "engine", "law"),
    [case(feature, engine, law) for feature in FEATURES for engine in able(scene_with(feature)) for law in LAWS],
)
def test_feature_obeys_law(feature: str, engine: str, law: Law) -> None:
    law(scene_with(feature), engine)


def shipped_cases() -> Iterator[Any]:
    """Yield each shipped scene with each engine that is able to run it; all but those of sample scenes are nightly."""
    for each in each_shipped_scene():
        (name,) = each.values
        for engine in able(load(find(name))):
            yield pytest.param(name, engine, marks=each.marks)


@pytest.mark.parametrize(("name", "engine"), list(shipped_cases()))
def test_shipped_scene_obeys_the_laws_that_need_no_action(name: str, engine: str) -> None:
    scene = load(find(name))
    advance_equals_steps(scene, engine)
    has_prefix(scene, engine)
    if engine in COPYING:
        survives_snapshot(scene, engine)


def test_sample_of_features_needs_every_engine() -> None:
    assert {engine for feature in SAMPLE for engine in able(scene_with(feature))} == set(ENGINES)
    assert set(SAMPLE) <= set(FEATURES)


CHOICES: list[dict[str, Any]] = [
    *({"joints": word} for word in ("relaxation", "xpbd", "rattle")),
    *({"detection": word} for word in ("bisect", "swept", "shrink")),
    *({"broad_phase": word} for word in ("grid", "sweep")),
    {"response": "penalty"}, {"integrator": "rk4"}, {"half_kick": True},
]  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("feature", FEATURES)
def test_feature_runs_with_any_bodies_and_settings_where_an_engine_is_able_to(feature: str) -> None:
    """Scenes with no body, one, or static bodies only; what `able` says is what `start` does."""
    for bodies in BODIES:
        try:
            scene = from_document(document(bodies, feature))
        except SceneError:
            continue
        for engine, choice in [(name, {}) for name in ENGINES] + [("reference", each) for each in CHOICES]:
            settings = scene.solver.replace(**choice)
            if engine not in able(scene, settings):
                with pytest.raises(Refusal):
                    start(scene, engine, settings)
                continue
            simulation = start(scene, engine, settings)
            try:
                advance(simulation, 2)
            except (Divergence, Exhaustion):  # e.g. close to an attracting body
                continue
            assert np.isfinite(simulation.frame().velocity).all()
