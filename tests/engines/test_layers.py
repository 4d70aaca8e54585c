"""Layers: bodies without a common layer do not affect each other; bit for bit, but for the 32-bit rounding of Box2D."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.action import ActionError, Launch, Spawn, Switch
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.filters import reachable_layers
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

every_engine = pytest.mark.parametrize("engine", ["pymunk", "box2d", "reference"])

LAYERS = ("ground", "one", "two")
FRAME = {"points": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "closed": True, "restitution": 0.9, "layers": list(LAYERS)}


def run_on(engine: str, scene: Scene) -> Trajectory:
    return sandbox.run(scene, engine)


def start_on(engine: str, scene: Scene) -> SwitchableSimulation:
    return sandbox.start(scene, engine)


def scatter(layer: str, seed: float, count: int = 5) -> dict[str, Any]:
    return {
        "name": f"crowd-{layer}",
        "count": count,
        "lower": [-0.9, -0.9],
        "upper": [0.9, 0.9],
        "radius": 0.1,
        "velocity": [seed, 1.0 - seed],
        "velocity_jitter": 2.0,
        "restitution": 1.0,
        "layer": layer,
    }


def scene_of(*scatters: dict[str, Any], **more: Any) -> Scene:
    return from_document({"world": {"duration": 0.6, "gravity": [0.0, -4.0]}, "scatter": list(scatters), **more})


@every_engine
@given(seed=st.floats(-1.0, 1.0), jitter=st.integers(0, 1000))
@example(seed=1.0, jitter=0)  # 32-bit rounding in Box2D
@example(seed=0.0, jitter=153)  # two of one layer graze by 0.5 % of their distance and separate between two frames
@settings(max_examples=15)
def test_each_layer_runs_as_if_alone(engine: str, seed: float, jitter: int) -> None:
    """The random numbers of generators depend on their order in the file, so the compared generator comes first."""
    world = {"duration": 0.6, "gravity": [0.0, -4.0], "seed": jitter}
    alone = run_on(engine, scene_of(scatter("ground", seed), wall=[FRAME], world=world))
    # pymunk and Box2D solve contacts that share a body in the order of their trees, which depends on all bodies.
    assume(engine == "reference" or not has_contacts_that_share_a_body(alone))
    post = {"position": [0.0, 0.0], "radius": 0.3, "layers": ["one", "two"]}
    others = (scatter("one", -seed), scatter("two", seed / 2.0))
    full = scene_of(scatter("ground", seed), *others, wall=[FRAME], post=[post], world=world)
    mixed = run_on(engine, full)
    count = alone.position.shape[1]
    # Box2D also orders candidate pairs that do not touch yet, whose zero impulses round 32-bit positions: measured
    # 6e-8 m over 640 scenes; a collision multiplies it by about the distance flown over the radius, 10.
    tolerance = 1e-5 if engine == "box2d" else 0.0
    np.testing.assert_allclose(mixed.position[:, :count], alone.position, rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(mixed.velocity[:, :count], alone.velocity, rtol=0.0, atol=10.0 * tolerance)
    layer = full.bodies.layer
    missed = mixed.missed_pair  # bodies of different layers miss no contact; those of one layer may at this dt
    for a, b in (*mixed.contact_pair.tolist(), *missed.tolist()):
        assert layer[a] == layer[b] if b >= 0 else not (layer[a] == 0 and full.fixed_names[-1 - b] == "post-1")
    assert np.array_equal(missed[missed[:, 0] < count], alone.missed_pair)


def has_contacts_that_share_a_body(run: Trajectory) -> bool:
    """Return whether two contacts of a body begin within two steps."""
    starts: dict[int, list[float]] = {}
    for time, pair in zip(run.contact_time.tolist(), run.contact_pair.tolist(), strict=True):
        for body in pair:
            if body >= 0:
                starts.setdefault(body, []).append(time)
    step = float(run.time[1] - run.time[0])
    return any(b - a < 2.5 * step for times in starts.values() for a, b in pairwise(sorted(times)))


@every_engine
@pytest.mark.parametrize("layers", [["ground"], ["ramp"], ["ground", "ramp"]])
@pytest.mark.parametrize("layer", ["ground", "ramp"])
def test_wall_stops_bodies_with_a_common_layer(engine: str, layers: list[str], layer: str) -> None:
    ball = {"position": [0.0, 0.0], "velocity": [2.0, 0.0], "radius": 0.1, "restitution": 1.0, "layer": layer}
    wall = {"points": [[0.5, -1], [0.5, 1]], "layers": layers}
    run = run_on(engine, from_document({"world": {"duration": 1.0}, "ball": [ball], "wall": [wall]}))
    assert run.velocity[-1, 0, 0] == pytest.approx(-2.0 if layer in layers else 2.0, rel=1e-12)  # rounding of a solve


@every_engine
def test_planes_are_on_all_layers_by_default(engine: str) -> None:
    balls = [{"position": [x, 1.0], "radius": 0.1, "layer": name} for x, name in ((0.0, "ground"), (5.0, "up"))]
    world = {"duration": 1.0, "gravity": [0.0, -10.0]}
    for layers, falls in ((None, [False, False]), (["up"], [True, False])):
        plane: dict[str, Any] = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}
        plane |= {} if layers is None else {"layers": layers}
        run = run_on(engine, from_document({"world": world, "ball": balls, "plane": [plane]}))
        assert (run.position[-1, :, 1] < -1.0).tolist() == falls


@every_engine
def test_fixed_bodies_collide_on_their_layer_only(engine: str) -> None:
    fixed = {"position": [0.5, 0.0], "size": [0.1, 1.0], "fixed": True, "layer": "up"}
    balls = [
        {"position": [0.0, y], "velocity": [1.0, 0.0], "radius": 0.1, "layer": name}
        for y, name in ((-0.2, "up"), (0.2, "ground"))
    ]
    run = run_on(engine, from_document({"world": {"duration": 1.0}, "ball": balls, "box": [fixed]}))
    assert run.velocity[-1, :2, 0].tolist() == [0.0, 1.0]


@every_engine
def test_contacts_of_a_layer_end_when_a_body_leaves_it(engine: str) -> None:
    """A ball rolls on a shelf into a zone, changes its layer and falls through the shelf."""
    shelf = {"points": [[-1, 0], [1, 0]]}
    ball = {"name": "ball", "position": [-0.5, 0.1], "velocity": [1.0, 0.0], "radius": 0.1}
    mouth = {"position": [0.0, 0.1], "radius": 0.1, "to_layer": "below"}
    world = {"duration": 1.5, "gravity": [0.0, -10.0]}
    run = run_on(engine, from_document({"world": world, "ball": [ball], "wall": [shelf], "zone": [mouth]}))
    entry_time = float(run.time[np.flatnonzero(run.layer[:, 0])[0]])
    assert entry_time == pytest.approx(0.4, abs=0.02)
    expected = 0.1 - 5.0 * (1.5 - entry_time) ** 2
    assert run.position[-1, 0, 1] == pytest.approx(expected, abs=0.1 * 1.1)  # within the travel of a frame at 11 m/s
    assert run.missed_contacts == 0


def test_contact_matrix_includes_every_reachable_layer() -> None:
    zones = [
        {"position": [0, 0], "radius": 1, "to_layer": "a"},
        {"position": [0, 0], "radius": 1, "layers": ["a"], "to_layer": "b"},
        {"position": [0, 0], "radius": 1, "layers": ["far"], "to_layer": "farther"},
    ]
    balls = [
        {"position": [0, 0], "radius": 0.1},
        {"position": [1, 0], "radius": 0.1, "layer": "b"},
        {"position": [2, 0], "radius": 0.1, "layer": "far"},
        {"position": [3, 0], "radius": 0.1, "collides": "none"},
        {"position": [4, 0], "radius": 0.1, "layer": "none"},
    ]
    scene = from_document({"ball": balls, "zone": zones})
    names = scene.layers
    assert names == ("ground", "a", "b", "far", "farther", "none")
    reachable = [
        {name for k, name in enumerate(names) if bits >> k & 1}
        for bits in reachable_layers(scene, scene.bodies).tolist()
    ]
    assert reachable == [{"ground", "a", "b"}, {"b"}, {"far", "farther"}, {"ground"}, {"none"}]
    contacts = contact_matrix(scene)
    assert contacts.touches.tolist() == [True, True, False, False, False]
    assert contacts.can_enter_zone.tolist() == [True, False, True, False, False]
    assert contacts.free.tolist() == [False, False, False, True, True]


@every_engine
def test_spawned_body_is_on_its_layer_and_an_unknown_one_is_refused(engine: str) -> None:
    ball = {"position": [0.0, 0.0], "radius": 0.1}
    wall = {"points": [[0.5, -1], [0.5, 1]], "layers": ["up"]}
    simulation = start_on(engine, from_document({"ball": [ball], "wall": [wall]}))
    for name, y in (("up", 0.5), ("ground", -0.5)):
        spawned = Ball(name=name, position=(0.0, y), velocity=(2.0, 0.0), radius=0.1, layer=name)
        simulation.apply(Spawn(time=0, ball=spawned))
    with pytest.raises(ActionError, match=r"no layer is named 'attic'.*ground, up"):
        simulation.apply(Spawn(time=0, ball=Ball(position=(0.0, 3.0), radius=0.1, layer="attic")))
    advance(simulation, 50)
    simulation.apply(Switch(time=0))
    advance(simulation, 50)
    assert simulation.frame().layer.tolist() == [0, 1, 0]
    # rounding of a solve, in 32-bit numbers on Box2D
    assert simulation.frame().velocity[:, 0].tolist() == pytest.approx(
        [0.0, 0.0, 2.0], abs=1e-8 if engine == "box2d" else 1e-12
    )
    assert simulation.frame().position[2, 0] == pytest.approx(2.0, rel=1e-6)


@every_engine
def test_launched_bodies_return_to_their_initial_layer(engine: str) -> None:
    emitter = {"name": "jet", "position": [0, 0], "count": 3, "velocity_min": [1, 0], "velocity_max": [2, 0]}
    emitter |= {"collides": "fixed", "radius": 0.01}
    zone = {"points": [[0.2, -1], [0.2, 1]], "thickness": 0.1, "to_layer": "up"}
    simulation = start_on(engine, from_document({"emitter": [emitter], "zone": [zone]}))
    advance(simulation, 60)
    assert simulation.frame().layer.tolist() == [1, 1, 1]
    simulation.apply(Launch(time=0, generator="jet", seed=3))
    assert simulation.frame().layer.tolist() == [0, 0, 0]
    assert not simulation.frame().visits.any()


@every_engine
def test_layers_are_stored_with_a_run(engine: str, tmp_path) -> None:
    ball = {"position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.1}
    zone = {"position": [0.5, 0.0], "radius": 0.2, "to_layer": "up"}
    run = run_on(engine, from_document({"world": {"duration": 1.0}, "ball": [ball], "zone": [zone]}))
    loaded = type(run).load(run.save(tmp_path / "run.npz"))
    assert np.array_equal(loaded.layer, run.layer)
    assert sorted(np.unique(run.layer).tolist()) == [0, 1]
    plain = run_on(engine, from_document({"world": {"duration": 0.1}, "ball": [ball]}))
    assert plain.layer.size == 0
