"""Events: actions that a scene makes itself, at their times, on every engine, in every kind of run."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import Explosion, Impulse, Switch
from sandbox.engines.contract import Exhaustion
from sandbox.engines.registry import ENGINES
from sandbox.measure.preflight import run_preflight
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, from_document, loads
from tests.scene.faults import faults_of

pytestmark = pytest.mark.fail_slow(60)  # kernels compile

every_engine = pytest.mark.parametrize("engine", sorted(ENGINES))


def scene_of(*events: dict[str, Any], duration: float = 1.0, **tables: Any) -> Scene:
    """Return a scene without gravity of a ball of 2 kg at rest at the origin."""
    ball = {"name": "a", "position": [0.0, 0.0], "radius": 0.1, "mass": 2.0}
    world = {"gravity": [0.0, 0.0], "duration": duration, **tables.pop("world", {})}
    document = {"world": world, "solver": {"dt": 0.01}, "ball": [ball, *tables.pop("balls", [])], "event": [*events]}
    return from_document({**document, **tables})


def impulse(time: float, x: float, **more: Any) -> dict[str, Any]:
    return {"kind": "impulse", "time": time, "body": "a", "impulse": [x, 0.0], **more}


@every_engine
def test_events_happen_in_order_at_the_first_step_from_their_time(engine: str) -> None:
    """Written in any order; one between two steps waits for the next one."""
    events = [impulse(0.605, -2.0), impulse(0.2, 2.0)]
    run = sandbox.run(scene_of(*events), engine)
    velocity = run.velocity[:, 0, 0]
    moving = np.flatnonzero(velocity)
    # The frame of 0.2 s is the state before the event, that of 0.21 s the first one after it; 0.605 s waits for 0.61.
    assert run.time[moving].tolist() == pytest.approx(np.arange(0.21, 0.615, 0.01).tolist())
    assert run.position[-1, 0, 0] == pytest.approx(1.0 * (0.61 - 0.2), abs=1e-6)  # 32-bit numbers of box2d


@every_engine
def test_explosion_pushes_bodies_away_and_less_the_farther_they_are(engine: str) -> None:
    """The impulse is (1 − d/r)·J along the line from the centre; nothing happens beyond r, and to fixed bodies."""
    balls = [
        {"name": "near", "position": [0.6, 0.8], "radius": 0.1, "mass": 0.5},
        {"name": "far", "position": [3.0, 0.0], "radius": 0.1},
        {"name": "rock", "position": [-0.5, 0.0], "radius": 0.1, "fixed": True},
    ]
    blast = {"kind": "explosion", "time": 0.0, "position": [0.0, 0.0], "radius": 2.0, "impulse": 4.0}
    run = sandbox.run(scene_of(blast, balls=balls, duration=0.1), engine)
    # m/s; `a` is at the centre itself, where there is no direction
    assert run.velocity[-1] == pytest.approx(np.array([[0, 0], [0.6 * 4.0, 0.8 * 4.0], [0, 0], [0, 0]]), abs=1e-5)


def test_explosion_is_an_action_too() -> None:
    simulation = sandbox.start(scene_of())
    simulation.apply(Explosion(time=0.0, position=(-1.0, 0.0), radius=2.0, impulse=8.0))
    simulation.step()
    assert simulation.frame().velocity[0] == pytest.approx([8.0 * 0.5 / 2.0, 0.0])


@every_engine
def test_bodies_come_and_go(engine: str) -> None:
    events = [
        {"kind": "spawn", "time": 0.2, "ball": {"name": "b", "position": [1, 0], "velocity": [1, 0], "radius": 0.1}},
        {"kind": "remove", "time": 0.5, "body": "a"},
        impulse(0.6, 1.0),  # its body has left: nothing happens
    ]
    run = sandbox.run(scene_of(*events), engine)
    assert run.names.tolist() == ["a", "b"]
    assert run.retired_time[0] == pytest.approx(0.5, abs=0.011)
    assert run.position[-1, 1] == pytest.approx([1.8, 0.0], abs=1e-5)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_steps_by_hand_many_at_once_and_from_a_later_state_agree(engine: str) -> None:
    scene = scene_of(impulse(0.3, 1.0), impulse(0.7, 1.0), world={"gravity": [0.0, -9.81]})
    run = sandbox.run(scene, engine, record_every=7)
    by_hand = sandbox.start(scene, engine)
    for _ in range(50):
        by_hand.step()
    resumed = type(by_hand).resumed(by_hand.checkpoint())
    by_hand.apply(Switch(time=0.0, settings={"iterations": 12}))
    for _ in range(50):
        by_hand.step()
        resumed.step()
    assert run.position[-1].tolist() == by_hand.frame().position.tolist() == resumed.frame().position.tolist()


def test_event_that_cannot_be_applied_ends_the_run_with_its_reason() -> None:
    scene = scene_of({"kind": "join", "time": 0.3, "joint": {"kind": "weld", "between": ["a"]}})
    run = sandbox.run(scene, "exact", strict=False)
    assert run.status == "failed"
    assert "the event 'join' of 0.3 s cannot be applied: exact refuses" in run.info["reason"]
    with pytest.raises(Exhaustion):
        simulation = sandbox.start(scene, "exact")
        for _ in range(40):
            simulation.step()


def test_ensemble_and_truth_include_events() -> None:
    scene = scene_of(impulse(0.5, 2.0))
    ends = sandbox.ensemble(scene, 3, vary={"ball.*.velocity": 1e-12}, engine="reference")
    assert ends.position[:, 0, 0] == pytest.approx([0.5] * 3, abs=1e-9)
    comparison = sandbox.compare(scene, engines=["pymunk", "reference"])
    assert "closed form" not in str(comparison.truth)
    assert max(row.score.max_position for row in comparison.rows) < 1e-6


def test_scene_with_events_is_written_and_read_again() -> None:
    scene = scene_of(
        impulse(0.3, 1.0),
        {"kind": "spawn", "time": 0.5, "box": {"position": [3, 0], "size": [1, 1], "angle": math.pi / 8}},
        {"kind": "set", "time": 0.6, "path": "world.gravity", "value": [0, -1]},
    )
    assert loads(dumps(scene)) == scene


@pytest.mark.parametrize(
    ("event", "path", "word"),
    [
        ('kind="impulse"\nbody="q"\nimpulse=[1,0]', "event[0].body", "'a'"),
        ('kind="impulse"\nbody="a"', "event[0].impulse", "missing"),
        ('kind="bang"', "event[0].kind", "explosion"),
        ('kind="set"\npath="world.seed"\nvalue=1', "event[0].path", "world.gravity"),
        ('kind="throttle"\nthrust="t"\nlevel=1', "event[0].thrust", "none"),
        ('kind="unjoin"\njoint="j"', "event[0].joint", "none"),
        ('kind="actuate"\nlevels={j=1.0}', "event[0].levels.j", "no motor is named 'j'"),
        ('kind="actuate"\nlevels={}', "event[0].levels", "table that is not empty"),
        ('kind="join"\njoint={kind="rod", between=["a","q"]}', "event[0].joint.between[1]", "'a'"),
        ('kind="join"\njoint={kind="prismatic", between=["a"], axis=[0,0], travel=[0,1]}', "event[0].joint.axis", "no"),
        ('kind="join"\njoint={kind="weld", between=["a","a"]}', "event[0].joint.between", "twice"),
        ('kind="spawn"\nball={position=[3,0], radius=1, layer="x"}', "event[0]", "'ground'"),
        ('kind="spawn"\nball={position=[3,0], radius=1, kinematic=true, path={angles=[0,1]}}', "event[0]", "path"),
        ('kind="spawn"\nball={name="a", position=[0,0], radius=1}', "event[0]", "already named"),
        ('kind="switch"', "event[0].kind", "explosion"),
    ],
)
def test_invalid_events_are_refused(event: str, path: str, word: str) -> None:
    document = '[[ball]]\nname="a"\nposition=[0,0]\nradius=1\n[[event]]\ntime=1.0\n' + event
    faults = faults_of(document)
    assert any(each.path == path and word in each.message for each in faults), faults


@pytest.mark.parametrize(
    ("element", "event"),
    [
        ('[[tyre]]\nname="t"\nbody="a"', 'kind="steer"\ntyre="t"'),  # without grip
        ('[[joint]]\nname="t"\nkind="motor"\nbetween=["a"]', 'kind="actuate"\nlevels={t=1.0}'),  # without rate
        ('[[joint]]\nname="t"\nkind="motor"\nbetween=["a"]', 'kind="unjoin"\njoint="t"'),
    ],
)
def test_faulty_element_is_the_only_fault_of_a_scene_whose_events_name_it(element: str, event: str) -> None:
    faults = faults_of(f'[[ball]]\nname="a"\nposition=[0,0]\nradius=1\n{element}\n[[event]]\ntime=1.0\n{event}')
    assert len(faults) == 1
    assert faults[0].path.startswith(("tyre.t", "joint.t"))


def test_impulse_without_a_time_is_refused() -> None:
    faults = faults_of('[[ball]]\nname="a"\nposition=[0,0]\nradius=1\n[[event]]\nkind="remove"\nbody="a"')
    assert [each.path for each in faults] == ["event[0].time"]


def test_events_of_python_are_actions() -> None:
    ball = sandbox.Ball(name="a", position=(0.0, 0.0), radius=0.1)
    world = sandbox.World(duration=0.2)
    scene = sandbox.Scene(world=world, balls=[ball], events=[Impulse(time=0.1, body="a", impulse=(1.0, 0.0))])
    assert sandbox.run(scene).velocity[-1, 0, 0] == 1.0


@every_engine
def test_events_from_a_later_setup_happen_at_their_times(engine: str) -> None:
    """Times of a simulation that starts from a setup count from 0, those of events from the start of the scene."""
    simulation = sandbox.start(scene_of(impulse(0.1, 2.0), impulse(0.35, 2.0)), engine)
    for _ in range(20):
        simulation.step()
    later = sandbox.start(simulation.checkpoint().present_setup(), engine)
    for _ in range(30):
        simulation.step()
        later.step()
    assert simulation.frame().velocity[0, 0] == later.frame().velocity[0, 0] == pytest.approx(2.0, abs=1e-6)  # 32 bits
    assert later.frame().position[0, 0] == pytest.approx(simulation.frame().position[0, 0], abs=1e-6)


def test_event_between_two_steps_happens_after_a_checkpoint_before_the_second() -> None:
    simulation = sandbox.start(scene_of(impulse(0.205, 2.0)))
    for _ in range(21):
        simulation.step()
    resumed = type(simulation).resumed(simulation.checkpoint())
    simulation.step()
    resumed.step()
    assert simulation.frame().velocity[0, 0] == resumed.frame().velocity[0, 0] == 1.0


def test_events_happen_in_the_steps_of_actions_at_their_times() -> None:
    """23 steps of 1/60 s end before 23/60 s, by rounding."""
    dt = 1.0 / 60.0
    assert 23 * dt < 23 / 60
    by_event = sandbox.run(scene_of(impulse(23 / 60, 2.0)), dt=dt)
    by_action = sandbox.run(scene_of(), dt=dt, actions=[Impulse(time=23 / 60, body="a", impulse=(2.0, 0.0))])
    assert by_event.position.tolist() == by_action.position.tolist()


@pytest.mark.parametrize(
    ("engine", "account"),
    [("pymunk", False), ("pymunk", True), ("box2d", False), ("reference", False), ("reference", True)],
)
def test_event_that_changes_the_joints_before_a_single_step(engine: str, account: bool) -> None:
    """Runs with an energy account, and those by hand, make single steps."""
    rope = {"name": "rope", "kind": "slide", "between": ["a"], "anchors": [[0, 0], [0, 1]], "most": 1.0}
    scene = scene_of(
        {"kind": "unjoin", "time": 0.3, "joint": "rope"}, joint=[rope], world={"gravity": [0.0, -10.0]}, duration=0.5
    )
    run = sandbox.run(scene, engine, account=account)
    assert run.status == "ok"
    assert run.velocity[-1, 0, 1] == pytest.approx(-10.0 * 0.2, abs=0.02)  # the rope yields at up to a few mm/s
    simulation = sandbox.start(scene, engine)
    for _ in range(50):
        simulation.step()
    assert simulation.state_hash() == run.info["state_hash"]


def test_check_and_comparison_of_a_scene_whose_events_add_bodies() -> None:
    """The added ball passes a wall between two steps, which `check` reports; it is not compared."""
    fast = {"name": "late", "position": [-3.0, 2.0], "velocity": [400.0, 0.0], "radius": 0.1}
    crate = {"name": "crate", "position": [0.0, -3.0], "size": [1.0, 1.0]}  # `exact`, whose truth is trusted, has none
    scene = scene_of(
        {"kind": "spawn", "time": 0.2, "ball": fast},
        impulse(0.5, 2.0),
        box=[crate],
        wall=[{"name": "wall", "points": [[1.0, 1.0], [1.0, 3.0]], "thickness": 0.01}],
    )
    found = run_preflight(scene, engine="pymunk", starts=3)
    assert [each.details["ball"] for each in found.warnings if each.kind == "tunnelling"] == ["late"]
    comparison = sandbox.compare(scene, engines=["pymunk", "reference"])
    assert max(row.score.max_position for row in comparison.rows) < 1e-6
    # The impulse changes momentum and energy, which is no breach of their conservation.
    assert "trusted until" not in str(comparison.truth)
    ends = sandbox.ensemble(scene, 3, vary={"ball.*.velocity": 1e-12}, engine="pymunk", keep="frames")
    assert ends.names == ("a", "crate")
    assert ends.position[:, 0, 0] == pytest.approx([0.5] * 3, abs=1e-9)


@pytest.mark.parametrize("engine", ["pymunk", "box2d", "reference"])
def test_joints_of_bodies_and_joints_that_have_left_are_passed_over(engine: str) -> None:
    rope = {"name": "rope", "kind": "slide", "between": ["a"], "anchors": [[0, 0], [0, 1]], "most": 1.0}
    weak = {**rope, "name": "weak", "strength": 1e-3}
    scene = scene_of(
        impulse(0.0, -4.0),  # breaks the weak one
        {"kind": "unjoin", "time": 0.7, "joint": "weak"},
        {"kind": "remove", "time": 0.8, "body": "a"},
        {"kind": "join", "time": 0.9, "joint": {"kind": "weld", "between": ["a"]}},
        {"kind": "unjoin", "time": 0.95, "joint": "rope"},
        joint=[weak, rope],
        world={"gravity": [0.0, -10.0]},
    )
    run = sandbox.run(scene, engine)
    assert (run.status, run.info["reason"]) == ("ok", None)
    assert run.broken_time[0] < 0.7


def test_energy_at_the_end_of_a_run_is_that_of_the_present_gravity() -> None:
    """At rest 1 m above 0 with 2 kg, gravity falls from 10 to 5 m/s²: 10 J less are stored."""
    shelf = {"points": [[-1.0, 0.9], [1.0, 0.9]]}
    event = {"kind": "set", "time": 0.5, "path": "world.gravity", "value": [0.0, -5.0]}
    ball = {"name": "a", "position": [0.0, 1.0], "radius": 0.1, "mass": 2.0}
    world = {"gravity": [0.0, -10.0], "duration": 1.0}
    run = sandbox.run(from_document({"world": world, "ball": [ball], "wall": [shelf], "event": [event]}), "reference")
    assert run.info["energy_start"] == pytest.approx(20.0, rel=1e-9)
    assert run.info["energy_end"] == pytest.approx(10.0, abs=0.02)  # slop of the contact
