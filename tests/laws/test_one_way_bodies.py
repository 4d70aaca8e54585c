"""One-way bodies: solid from their direction, and open from elsewhere until a body has passed; fixed or moving."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Remove, Spawn, Switch
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import ENGINES
from sandbox.engines.registry import start as start_plain
from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.preflight.checks import warnings
from sandbox.pymunk_export import obstacles
from sandbox.scene.compile.demands import Demand
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # runs of some seconds of simulated time, and compilation

ABLE = [name for name, engine in ENGINES.items() if Demand.ONE_WAY_BODIES in engine.capabilities]
every_engine = pytest.mark.parametrize("engine", ABLE)
G = 10.0
SHAPES: dict[str, dict[str, Any]] = {"ball": {"radius": 0.1}, "box": {"size": [0.2, 0.2]}, "polygon": {
    "points": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]
}}  # fmt: skip


def scene_of(
    jumper: dict[str, Any],
    shape: str = "ball",
    platform: dict[str, Any] | None = None,
    *,
    gravity: float = G,
    dt: float = 1 / 200,
    **tables: Any,
) -> Scene:
    """Return a body, `jumper`, of half a height of 0.1 m, and a platform, 0.2 m thick, whose top is at y = 0.1 m."""
    base = {"name": "platform", "position": [0.0, 0.0], "size": [4.0, 0.2], "fixed": True, "one_way": [0, 2]}
    document: dict[str, Any] = {
        "world": {"duration": 2.0, "gravity": [0.0, -gravity]},
        "solver": {"dt": dt, **tables.pop("solver", {})},
        "box": [{**base, **(platform or {})}],
    }
    moved = {"name": "jumper", **SHAPES[shape], **jumper}
    document.setdefault(shape, []).append(moved)
    return from_document({**document, **tables})


KINEMATIC = {"fixed": False, "kinematic": True}
PLATFORMS: dict[str, dict[str, Any]] = {
    "fixed": {},
    "kinematic": KINEMATIC,
    "moving": {**KINEMATIC, "path": {"points": [[0, 0], [1.2, 0]], "period": 2.0, "easing": "smooth"}},
    "rising": {**KINEMATIC, "velocity": [0.0, 0.3]},
}
every_platform = pytest.mark.parametrize("platform", PLATFORMS)


def index_of(scene: Scene) -> int:
    return scene.bodies.number_of["jumper"]


@every_engine
@every_platform
@pytest.mark.parametrize("shape", SHAPES)
def test_body_jumps_through_from_below_without_contact_and_lands_on_top(engine: str, platform: str, shape: str) -> None:
    """It rises freely to 1.5 m above its start, and comes to rest on the platform."""
    scene = scene_of({"position": [0.5, -0.5], "velocity": [0.0, math.sqrt(2 * G * 1.5)]}, shape, PLATFORMS[platform])
    simulation, k = sandbox.start(scene, engine), index_of(scene)
    simulation.contacts()
    velocity = [float(simulation.frame().velocity[k, 1])]
    while velocity[-1] > 0.0:
        simulation.step()
        velocity.append(float(simulation.frame().velocity[k, 1]))
    assert np.diff(velocity) == pytest.approx(np.full(len(velocity) - 1, -G / 200), rel=1e-9)  # free flight
    assert simulation.frame().passing is None and not len(simulation.contacts())
    frame = advance(simulation, 340).frame()
    top = float(frame.position[1 - k, 1]) + 0.1
    assert frame.position[k, 1] == pytest.approx(top + 0.1, abs=0.005)  # slop, and v h of a rising platform
    assert frame.velocity[k, 1] == pytest.approx(0.3 if platform == "rising" else 0.0, abs=0.06)  # g h
    simulation.close()


@every_engine
@pytest.mark.parametrize("shape", SHAPES)
def test_body_passes_from_the_side_and_from_below(engine: str, shape: str) -> None:
    scene = scene_of({"position": [-2.5, 0.05], "velocity": [3.0, 0.0]}, shape, gravity=0.0)
    run = sandbox.run(scene, engine)
    k = index_of(scene)
    assert run.position[-1, k] == pytest.approx([3.5, 0.05], abs=1e-9)  # sums of some hundred displacements
    assert not len(run.contact_time) and not len(run.missed_pair)


@every_engine
def test_body_that_turns_round_inside_falls_back_freely(engine: str) -> None:
    """It rises until its centre is above the top, without leaving the platform, and falls."""
    scene = scene_of({"position": [0.0, -1.0], "velocity": [0.0, math.sqrt(2 * G * 1.15)]})
    run = sandbox.run(scene, engine)
    k = index_of(scene)
    assert run.position[:, k, 1].max() > 0.13 and run.position[-1, k, 1] < -1.0
    assert np.diff(run.velocity[:, k, 1]) == pytest.approx(np.full(len(run.time) - 1, -G / 200), rel=1e-9)


@every_engine
@pytest.mark.parametrize("angle", [0.5, math.pi / 2.0, math.pi])
def test_direction_turns_with_the_body(engine: str, angle: float) -> None:
    """Without gravity: a ball that moves against the direction rebounds, one that moves along it passes."""
    out = np.array([-math.sin(angle), math.cos(angle)])
    for sign in (1.0, -1.0):
        jumper = {"position": (sign * out).tolist(), "velocity": (-2.0 * sign * out).tolist(), "restitution": 1.0}
        scene = scene_of(jumper, platform={"angle": angle, "restitution": 1.0}, gravity=0.0)
        run = sandbox.run(scene, engine)
        assert run.velocity[-1, index_of(scene)] == pytest.approx(2.0 * out, abs=1e-9)  # rounding


@every_engine
def test_platform_that_comes_from_above_passes_and_from_below_lifts(engine: str) -> None:
    """The ball lies on a plane, and on a post 0.5 m high; platforms move at 1 m/s."""
    plane = [{"point": [0.0, -0.5], "normal": [0.0, 1.0]}]
    down = {**KINEMATIC, "position": [0.0, 0.5], "velocity": [0.0, -1.0]}
    run = sandbox.run(scene_of({"position": [0.0, -0.4]}, platform=down, plane=plane), engine)
    assert np.abs(run.position[:, 0, 1] + 0.4).max() < 1e-3  # slop
    up = {**KINEMATIC, "position": [0.0, -0.5], "velocity": [0.0, 1.0]}
    run = sandbox.run(scene_of({"position": [0.0, 0.1]}, platform=up, gravity=2.0), engine)
    assert run.position[-1, 0, 1] == pytest.approx(-0.5 + 2.0 + 0.2, abs=0.01)  # slop, and v h


@every_engine
def test_fast_body_that_overlaps_deeply_is_stopped(engine: str) -> None:
    """In a substep it moves from above the top nearly to the middle: the side on which it was decides."""
    scene = scene_of({"position": [0.0, 0.21], "velocity": [0.0, -20.0]}, gravity=0.0, dt=1 / 120)
    run = sandbox.run(scene, engine)
    assert run.velocity[-1, 0, 1] >= 0.0 and run.position[-1, 0, 1] > 0.0


@every_engine
def test_body_that_is_passing_goes_on_after_a_change_of_engine(engine: str) -> None:
    """In the middle of the platform, and after another body, with a lower number, was removed."""
    other = {"name": "a", "position": [9.0, 9.0], "radius": 0.1}
    scene = scene_of({"position": [0.5, -0.5], "velocity": [0.0, 3.0]}, gravity=0.0, platform=KINEMATIC)
    document = {"world": {"duration": 2.0}, "ball": [other, *[_dump(each) for each in scene.balls]]}
    scene = from_document({**document, "box": [_dump(each) for each in scene.boxes], "solver": {"dt": 1 / 200}})
    simulation, k = sandbox.start(scene, engine), index_of(scene)
    advance(simulation, 30)
    simulation.apply(Remove(time=0.0, body="a"))
    for target in [name for name in ABLE if name != engine] + [engine]:
        passing = simulation.frame().passing
        assert passing is not None and passing.tolist() == [[k, scene.bodies.number_of["platform"]]]
        simulation.apply(Switch(time=0.0, engine=target))
        advance(simulation, 3)
    point = simulation.checkpoint() if isinstance(simulation, SwitchableSimulation) else None
    assert point is not None
    resumed = SwitchableSimulation.resumed(point)
    for each in (simulation, resumed):
        frame = advance(each, 60).frame()
        assert frame.velocity[k].tolist() == [0.0, 3.0] and frame.passing is None
        each.close()


def _dump(part: Any) -> dict[str, Any]:
    return dict(part.model_dump(mode="json", by_alias=True, exclude_unset=True))


@every_engine
def test_body_at_rest_on_top_stays_there_after_a_change_of_engine(engine: str) -> None:
    scene = scene_of({"position": [0.0, 0.2]}, "box", PLATFORMS["moving"] | {"friction": 1.0}, solver={"dt": 1 / 400})
    simulation, k = sandbox.start(scene, engine), index_of(scene)
    for target in (*ABLE, engine, *ABLE):
        advance(simulation, 40)
        simulation.apply(Switch(time=0.0, engine=target))
    assert advance(simulation, 100).frame().position[k, 1] == pytest.approx(0.2, abs=2e-3)  # slop
    simulation.close()


def test_snapshot_of_reference_in_the_middle_of_a_passage_continues_bit_for_bit() -> None:
    scene = scene_of({"position": [0.5, -0.5], "velocity": [0.0, 4.0]}, "box", PLATFORMS["moving"])
    simulation = advance(sandbox.start(scene, "reference"), 30)
    assert simulation.frame().passing is not None
    snapshot = simulation.snapshot()
    first = advance(simulation, 200).state_hash()
    simulation.restore(snapshot)
    assert advance(simulation, 200).state_hash() == first


@pytest.mark.parametrize("settings", [{"response": "penalty", "damping": 1.0}, {"detection": "shrink"}])
@pytest.mark.parametrize("broad_phase", ["all_pairs", "sweep", "grid"])
def test_methods_of_reference_let_a_body_pass_and_land(settings: dict[str, Any], broad_phase: str) -> None:
    jumper = {"position": [0.5, -0.5], "velocity": [0.0, 5.0], "restitution": 0.2}
    scene = scene_of(jumper, solver={**settings, "broad_phase": broad_phase}, dt=1 / 500)
    run = sandbox.run(scene.with_duration(3.0), "reference")
    assert run.position[:, 0, 1].max() > 0.7
    assert run.position[-1, 0, 1] == pytest.approx(0.2, abs=0.01)  # overlap of springs


@pytest.mark.parametrize("detection", ["bisect", "swept"])
def test_detection_within_a_step_lets_a_ball_pass_a_fixed_body(detection: str) -> None:
    ball = {"position": [0.0, 0.0], "radius": 0.3, "fixed": True, "one_way": [0, 1], "name": "platform"}
    document = {"world": {"duration": 1.0}, "solver": {"dt": 0.01, "detection": detection}}
    for y, speed, expected in ((-1.0, 2.0, 2.0), (1.0, -2.0, 2.0)):
        other = {"name": "jumper", "position": [0.0, y], "velocity": [0.0, speed], "radius": 0.1, "restitution": 1.0}
        run = sandbox.run(from_document({**document, "ball": [ball, other]}), "reference")
        assert run.velocity[-1, 1, 1] == pytest.approx(expected, abs=1e-9)  # rounding


def test_check_does_not_warn_of_a_body_that_starts_in_a_one_way_body() -> None:
    scene = scene_of({"position": [0.0, 0.05]}, "box")
    assert not [each for each in warnings(scene, scene.solver) if each.kind == "overlap"]


def test_engines_and_programs_without_them_refuse_by_name() -> None:
    scene = scene_of({"position": [0.0, 1.0]})
    for engine in set(ENGINES) - set(ABLE):
        with pytest.raises(Refusal, match="one-way bodies"):
            start_plain(scene, engine)
    with pytest.raises(Refusal, match="sleeping does not support one-way bodies"):
        start_plain(scene, "pymunk", scene.solver.replace(sleeping=True))
    assert any("one-way bodies" in each.message for each in obstacles(scene))


@every_engine
def test_one_way_body_cannot_be_added_during_a_run(engine: str) -> None:
    simulation = start_plain(scene_of({"position": [0.0, 1.0]}), engine)
    with pytest.raises(ActionError, match="'new' is a one-way body"):
        simulation.apply(Spawn(time=0, box=Box(name="new", position=(9, 9), size=(1, 1), fixed=True, one_way=(0, 1))))
    simulation.close()


@pytest.mark.parametrize(
    ("platform", "message"),
    [
        ({"fixed": False}, "needs `fixed = true` or `kinematic = true`"),
        ({"one_way": [0, 0]}, "has no direction"),
        ({"one_way": True}, ""),
    ],
)
def test_faults_name_the_key(platform: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene_of({"position": [0.0, 1.0]}, platform=platform)
    assert [fault.path for fault in caught.value.faults] == ["box.platform.one_way"]
    assert message in caught.value.faults[0].message


def test_body_of_several_shapes_is_refused() -> None:
    body = {"name": "a", "position": [0, 0], "fixed": True, "one_way": [0, 1], "ball": [{"radius": 1.0}]}
    with pytest.raises(SceneError, match=r"body\.a\.one_way: is not supported for a \[\[body\]\] of several shapes"):
        from_document({"body": [body]})


@every_engine
def test_body_that_passed_when_the_run_was_continued_is_not_passing_again_when_another_is_added(engine: str) -> None:
    scene = scene_of({"position": [0.5, -0.3], "velocity": [0.0, 5.0]})
    simulation = advance(sandbox.start(scene, engine), 10)
    assert simulation.frame().passing is not None
    simulation.apply(Switch(time=0.0, engine=engine, settings={"iterations": 20}))
    assert advance(simulation, 300).frame().position[0, 1] == pytest.approx(0.2, abs=2e-3)  # slop
    simulation.apply(Spawn(time=0, ball=Ball(name="new", position=(9.0, 9.0), radius=0.1)))
    assert simulation.frame().passing is None
    assert advance(simulation, 50).frame().position[0, 1] == pytest.approx(0.2, abs=2e-3)  # slop
    simulation.close()
