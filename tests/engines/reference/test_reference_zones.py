"""Layers, zones and one-way walls on the reference engine: all settings, closed forms and edge cases."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.action import Impulse, Reshape, Spawn, Toggle
from sandbox.engines.common.zoned_bodies import is_inside, make_zone_shapes
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import HELD, Zone
from sandbox.scene.files.load import from_document
from sandbox.scene.geometry.shapes import contains

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

H = 0.001
"""Substep, s."""

VARIANTS: dict[str, dict[str, Any]] = {
    "discrete": {},
    "semi-implicit": {"integrator": "semi_implicit_euler"},
    "verlet": {"integrator": "velocity_verlet"},
    "leapfrog": {"integrator": "leapfrog"},
    "rk4": {"integrator": "rk4"},
    "bisect": {"detection": "bisect", "integrator": "velocity_verlet"},
    "swept": {"detection": "swept", "integrator": "velocity_verlet"},
    "shrink": {"detection": "shrink"},
    "penalty": {"response": "penalty", "damping": 0.0},
    "penalty-rk4": {"response": "penalty", "damping": 0.0, "integrator": "rk4", "detection": "shrink"},
    "grid": {"broad_phase": "grid"},
    "sweep": {"broad_phase": "sweep"},
}
each_variant = pytest.mark.parametrize("variant", list(VARIANTS))


def course(body: dict[str, Any] | None = None, **world: Any) -> Scene:
    """Return a course for one body.

    It moves to an upper layer, over a fence, back to the ground, through a gate, to a wall and back to the gate.
    """
    moving = {"name": "it", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "restitution": 1.0}
    moving |= body or {"radius": 0.05}
    return from_document(
        {
            "world": {"duration": 5.0, **world},
            "solver": {"dt": 5 * H, "substeps": 5},
            "box" if "size" in moving else "ball": [moving],
            "wall": [
                {"name": "fence", "points": [[1, -1], [1, 1]]},
                {"name": "gate", "points": [[2, 1], [2, -1]], "one_way": True},
                {"name": "end", "points": [[2.5, -1], [2.5, 1]]},
            ],
            "zone": [
                {"name": "mouth", "points": [[0.5, -1], [0.5, 1]], "thickness": 0.1, "to_layer": "up"},
                {"name": "foot", "position": [1.5, 0.0], "radius": 0.1, "layers": ["up"], "to_layer": "ground"},
            ],
        }
    )


def start_variant(scene: Scene, variant: str) -> SwitchableSimulation:
    return start(scene, "reference", scene.solver.replace(**VARIANTS[variant]))


def advance(simulation: SwitchableSimulation, seconds: float) -> None:
    while simulation.time < seconds - 1e-9:
        simulation.step()


CASES = [(variant, "ball") for variant in VARIANTS]
CASES += [(variant, "box") for variant in ("discrete", "bisect", "shrink", "penalty-rk4")]
"""Contacts of boxes differ by detection and response; swept supports balls only."""


@pytest.mark.parametrize(("variant", "kind"), CASES)
def test_layers_and_gates_work_with_every_variant(variant: str, kind: str) -> None:
    scene = course({"size": [0.1, 0.1]} if kind == "box" else {"radius": 0.05})
    run = sandbox.run(scene, "reference", account=True, **VARIANTS[variant])
    assert run.status == "ok", run.reason
    touched = [scene.fixed_names[-1 - other] for _, other in run.contact_pair.tolist()]
    # 0.45 m from gate to end in both directions, between 1.5 and 5 s: it ends moving towards the gate.
    assert [*dict.fromkeys(touched)] == ["mouth", "foot", "end", "gate"]
    assert touched.count("mouth") == touched.count("foot") == 1
    before_contact = run.time < 1.95  # no contact up to here
    assert (run.velocity[before_contact, 0] == [1.0, 0.0]).all()
    # Elastic bounces between 2.05 and 2.45 m; a penalty force acts to the end of the step in which its contact ends.
    # 1e-12 per impact
    assert np.abs(run.velocity[-1, 0]) == pytest.approx([1.0, 0.0], abs=0.05 if "penalty" in variant else 1e-11)
    assert 2.05 - 0.01 < run.position[-1, 0, 0] < 2.45 + 0.01
    residual = run.energy - run.energy[0] - run.account.sum(axis=1)
    assert np.abs(residual).max() < 1e-12  # J, rounding; it has 0.5 J


@each_variant
def test_holding_zone_holds_and_releases_with_every_variant(variant: str) -> None:
    zones = [
        {"name": "hole", "position": [0.5, 0.0], "radius": 0.06, "holds": True},
        {"points": [[0.2, -1], [0.4, -1], [0.4, 1], [0.2, 1]], "gravity": [2.0, 0.0]},
    ]
    striking = {"position": [0.5, 1.0], "velocity": [0.0, -1.0], "radius": 0.05, "restitution": 1.0}
    balls = [
        {"name": "it", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05, "restitution": 1.0},
        striking,
    ]
    scene = from_document({"solver": {"dt": 5 * H, "substeps": 5}, "ball": balls, "zone": zones})
    simulation = start_variant(scene, variant)
    simulation.account()
    initial_energy = sandbox.engines.common.energy_balance.total_energy(simulation)
    advance(simulation, 2.0)
    frame = simulation.frame()
    assert frame.visits is not None and frame.visits[0].tolist() == [HELD, 0]
    assert frame.position[0].tolist() == [0.5, 0.0]
    # 1e-12 per impact
    assert frame.velocity[1] == pytest.approx([0.0, 1.0], abs=0.05 if "penalty" in variant else 1e-11)
    simulation.apply(Impulse(time=0.0, body="it", impulse=(-1.0, 0.0)))
    advance(simulation, 2.2)
    assert simulation.frame().velocity[0, 0] < -1.0 + 2.0 * 0.2 + 0.01
    assert simulation.frame().position[0, 0] < 0.42
    booked = sum(simulation.account().values())
    assert sandbox.engines.common.energy_balance.total_energy(simulation) - initial_energy == pytest.approx(
        booked, abs=1e-12
    )  # rounding of 1 J


@pytest.mark.parametrize("integrator", ["explicit_euler", "velocity_verlet"])
def test_energy_gained_in_a_gravity_zone_is_booked_as_drives(integrator: str) -> None:
    """A zone 0.4 m wide with g = 5 adds m g·0.4 to drives, up to one substep, v·h, at either edge."""
    slope = {"points": [[0.2, -1], [0.6, -1], [0.6, 1], [0.2, 1]], "gravity": [5.0, -2.0]}
    ball = {"position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05, "mass": 2.0}
    world = {"duration": 0.8, "gravity": [0.0, -2.0]}
    document = {"world": world, "solver": {"dt": 5 * H, "substeps": 5}, "ball": [ball], "zone": [slope]}
    run = sandbox.run(from_document(document), "reference", account=True, integrator=integrator)
    drives = run.account[-1, run.info["causes"].index("drives")]
    fastest = math.sqrt(1.0 + 2.0 * 5.0 * 0.4)
    assert drives == pytest.approx(2.0 * 5.0 * 0.4, abs=2.0 * 5.0 * 2.0 * fastest * H)
    assert np.abs(run.energy - run.energy[0] - run.account.sum(axis=1)).max() < 1e-12  # J, rounding of 10 J


@given(
    st.lists(st.tuples(st.floats(0.2, 1.0), st.floats(0.3, 1.0)), min_size=3, max_size=8),
    st.floats(-1.2, 1.2),
    st.floats(-1.2, 1.2),
)
def test_is_inside_agrees_with_contains_for_star_outlines(
    spokes: list[tuple[float, float]], x: float, y: float
) -> None:
    """A star about the origin with corners at ascending angles: two independent point-in-polygon tests agree."""
    turns = np.cumsum([turn for _, turn in spokes])
    angles = 2.0 * math.pi * turns / (turns[-1] + 0.1)
    corners = tuple((r * math.cos(a), r * math.sin(a)) for (r, _), a in zip(spokes, angles.tolist(), strict=True))
    ends = np.asarray(corners)
    edges = np.roll(ends, -1, axis=0) - ends
    offset = np.asarray((x, y)) - ends
    fraction = np.clip((offset * edges).sum(axis=1) / (edges * edges).sum(axis=1), 0.0, 1.0)[:, None]
    on_edge = np.hypot(*(offset - fraction * edges).T).min() < 1e-9  # decided by rounding
    zones = [Zone(points=corners), Zone(points=corners, thickness=0.2), Zone(position=(0.1, 0.2), radius=0.5)]
    edge, first, reach, _ = make_zone_shapes(zones)
    for k, zone in enumerate(zones):
        if k == 0 and (on_edge or np.diff(angles).max() > math.pi):
            continue
        assert is_inside(edge, first[k], first[k + 1], reach[k], x, y) == contains(zone, (x, y))


@given(st.floats(-0.9, 0.6), st.floats(0.3, 30.0))
def test_closed_gate_admits_bodies_from_outside_and_stops_them_inside(height: float, speed: float) -> None:
    """A closed gate with its left side inside: a body enters without contact and never leaves.

    Corners are an exception: a body that enters there passes both walls at once and may leave by the other.
    """
    for corners in ([[-1, -1], [1, -1], [1, 1], [-1, 1]], [[-1, -1], [1, -1], [0.2, 0.0], [1, 1], [-1, 1]]):
        wall = {"points": corners, "closed": True, "one_way": True, "restitution": 1.0, "thickness": 0.02}
        ball = {"position": [-1.5, height], "velocity": [speed, 0.3 * speed], "radius": 0.05}
        dt = 0.02 / speed  # less than its radius a step, to prevent tunnelling
        document = {"solver": {"dt": dt}, "world": {"duration": 1.0}, "ball": [ball], "wall": [wall]}
        simulation = start(from_document(document), "reference")
        entered = False
        for _ in range(400):
            simulation.step()
            frame = simulation.frame()
            inside = contains(Zone(points=tuple(map(tuple, corners))), tuple(frame.position[0].tolist()))
            assert inside or not entered
            if not entered:
                assert frame.velocity[0].tolist() == [speed, 0.3 * speed]
            entered = entered or inside
        assert entered


def test_held_bodies_do_not_collide_with_each_other_or_with_a_fixed_body() -> None:
    zones = [{"position": [x, 0.0], "radius": 0.05, "holds": True} for x in (0.0, 0.1)]
    balls = [{"name": f"b{k}", "position": [0.1 * k, 0.0], "radius": 0.1} for k in range(2)]
    fixed = {"position": [0.05, 0.1], "radius": 0.1, "fixed": True}
    scene = from_document({"world": {"gravity": [0.0, -5.0]}, "ball": [*balls, fixed], "zone": zones})
    simulation = start(scene, "reference")
    simulation.contacts()
    advance(simulation, 0.5)
    assert simulation.frame().position[:2].tolist() == [[0.0, 0.0], [0.1, 0.0]]
    assert not simulation.frame().velocity.any()
    assert {other for _, other in simulation.contacts().pair.tolist()} == {-1, -2}  # zone entries only


def test_gate_made_solid_stops_or_passes_overlapping_bodies_by_their_side() -> None:
    """The gate becomes solid while two bodies overlap it: the one on the left is pushed back, the other passes."""
    balls = [
        {"name": name, "position": [x, y], "velocity": [v, 0.0], "radius": 0.1}
        for name, x, y, v in (("left", -0.2, 0.5, 1.0), ("right", 0.25, -0.5, -1.0))
    ]
    gate = {"name": "gate", "points": [[0, -1], [0, 1]], "one_way": True, "solid": False}
    scene = from_document({"solver": {"dt": 0.005}, "ball": balls, "wall": [gate]})
    simulation = start(scene, "reference")
    advance(simulation, 0.15)  # one is at −0.05 m, the other at 0.1 m
    simulation.apply(Toggle(time=0.0, thing="gate", solid=True))
    advance(simulation, 1.0)
    x = simulation.frame().position[:, 0]
    assert x[0] < 0.0
    assert x[1] == pytest.approx(0.25 - 1.0, abs=1e-12)  # sums of v·h
    # its left side now faces right
    simulation.apply(Reshape(time=0.0, thing="gate", points=((-2.0, 1.0), (-2.0, -1.0))))
    advance(simulation, 3.0)
    assert simulation.frame().position[1, 0] > -2.0


@pytest.mark.parametrize("response", ["impulse", "penalty"])
def test_first_box_spawned_among_balls_keeps_layers_and_gates(response: str) -> None:
    """The first box switches the collision pipeline and the format of contact keys."""
    scene = course()
    simulation = start(scene, "reference", scene.solver.replace(response=response))
    advance(simulation, 1.95)  # as it enters the gate
    box = Box(name="box", position=(0.7, 0.5), velocity=(1.0, 0.0), size=(0.1, 0.1))
    simulation.apply(Spawn(time=0.0, box=box))
    advance(simulation, 2.2)
    assert simulation.frame().velocity[0].tolist() == [1.0, 0.0]  # it has passed
    advance(simulation, 3.0)
    assert simulation.frame().position[1, 0] < 1.0  # the fence blocks the ground layer


def test_zone_entry_in_a_partial_last_step_is_recorded() -> None:
    zone = {"position": [1.0, 0.0], "radius": 0.5, "to_layer": "up"}
    ball = {"position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05}
    document = {"solver": {"dt": 0.1, "substeps": 4}, "ball": [ball], "zone": [zone]}
    simulation = start(from_document(document), "reference")
    simulation.contacts()
    for _ in range(4):
        simulation.step()
    simulation.finish(0.95)  # at 0.495 s it is 5 mm before the edge of the zone
    assert simulation.frame().layer.tolist() == [0]
    simulation = start(from_document({**document, "solver": {"dt": 0.1, "substeps": 1}}), "reference")
    simulation.contacts()
    for _ in range(5):
        simulation.step()
    simulation.finish(0.1)
    assert simulation.frame().layer.tolist() == [1]
    assert simulation.contacts().time.tolist() == pytest.approx([0.51])


def test_zone_entry_of_a_spawned_body_is_recorded_after_the_next_substep() -> None:
    zone = {"position": [1.0, 0.0], "radius": 0.5, "to_layer": "up"}
    scene = from_document({"solver": {"dt": 0.01}, "ball": [{"position": [-1.0, 0.0], "radius": 0.1}], "zone": [zone]})
    simulation = start(scene, "reference")
    simulation.contacts()
    simulation.apply(Spawn(time=0.0, ball=Ball(name="new", position=(1.0, 0.1), radius=0.1)))
    assert simulation.frame().layer.tolist() == [0, 0]
    simulation.step()
    assert simulation.frame().layer.tolist() == [0, 1]
    assert simulation.contacts().time.tolist() == [0.01]
