"""Layers, zones and one-way walls on the reference: under every choice, against closed forms, and at their edges."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.action import Impulse, Reshape, Spawn, Toggle
from sandbox.engines.reference.zones import is_inside, make_zone_shapes
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import HELD, Zone
from sandbox.scene.files.load import from_document
from sandbox.scene.geometry.shapes import contains

pytestmark = pytest.mark.full  # long runs and sweeps

H = 0.001
"""s, the substep"""

HOWS: dict[str, dict[str, Any]] = {
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
hows = pytest.mark.parametrize("how", list(HOWS))


def course(body: dict[str, Any] | None = None, **world: Any) -> Scene:
    """Return a body that goes up a mouth, over a fence, down again, through a gate, to a wall and back to the gate."""
    one = {"name": "it", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "restitution": 1.0}
    one |= body or {"radius": 0.05}
    return from_document(
        {
            "world": {"duration": 5.0, **world},
            "solver": {"dt": 5 * H, "substeps": 5},
            "box" if "size" in one else "ball": [one],
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


def begun(scene: Scene, how: str) -> SwitchableSimulation:
    return start(scene, "reference", scene.solver.replace(**HOWS[how]))


def advance(relay: SwitchableSimulation, seconds: float) -> None:
    while relay.time < seconds - 1e-9:
        relay.step()


CASES = [(how, "ball") for how in HOWS] + [(how, "box") for how in HOWS if how != "swept"]
"""swept knows balls alone, and says so"""


@pytest.mark.parametrize(("how", "kind"), CASES)
def test_every_choice_knows_layers_and_gates(how: str, kind: str) -> None:
    scene = course({"size": [0.1, 0.1]} if kind == "box" else {"radius": 0.05})
    run = sandbox.run(scene, "reference", account=True, **HOWS[how])
    assert run.status == "ok", run.reason
    touched = [scene.fixed_names[-1 - other] for _, other in run.contact_pair.tolist()]
    # 0.45 m from gate to end, both ways, between 1.5 and 5 s: it is on its way to the gate again.
    assert [*dict.fromkeys(touched)] == ["mouth", "foot", "end", "gate"]
    assert touched.count("mouth") == touched.count("foot") == 1
    out = run.time < 1.95  # through all this nothing has touched it
    assert (run.velocity[out, 0] == [1.0, 0.0]).all()
    # Back and forth between 2.05 and 2.45 m, elastic; a spring lets go within a step, and each time acts to its end.
    assert np.abs(run.velocity[-1, 0]) == pytest.approx(
        [1.0, 0.0], abs=0.05 if "penalty" in how else 1e-11
    )  # 1e-12 an impact
    assert 2.05 - 0.01 < run.position[-1, 0, 0] < 2.45 + 0.01
    residual = run.energy - run.energy[0] - run.account.sum(axis=1)
    assert np.abs(residual).max() < 1e-12  # J, rounding; it has 0.5 J


@hows
def test_every_choice_holds_and_lets_go(how: str) -> None:
    zones = [
        {"name": "hole", "position": [0.5, 0.0], "radius": 0.06, "holds": True},
        {"points": [[0.2, -1], [0.4, -1], [0.4, 1], [0.2, 1]], "gravity": [2.0, 0.0]},
    ]
    hits = {"position": [0.5, 1.0], "velocity": [0.0, -1.0], "radius": 0.05, "restitution": 1.0}
    balls = [{"name": "it", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05, "restitution": 1.0}, hits]
    scene = from_document({"solver": {"dt": 5 * H, "substeps": 5}, "ball": balls, "zone": zones})
    relay = begun(scene, how)
    relay.account()
    began = sandbox.engines.common.energy_balance.total_energy(relay)
    advance(relay, 2.0)
    frame = relay.frame()
    assert frame.visits is not None and frame.visits[0].tolist() == [HELD, 0]
    assert frame.position[0].tolist() == [0.5, 0.0]
    assert frame.velocity[1] == pytest.approx(
        [0.0, 1.0], abs=0.05 if "penalty" in how else 1e-11
    )  # 1e-12 an impact  # as above
    relay.apply(Impulse(time=0.0, body="it", impulse=(-1.0, 0.0)))
    advance(relay, 2.2)
    assert relay.frame().velocity[0, 0] < -1.0 + 2.0 * 0.2 + 0.01
    assert relay.frame().position[0, 0] < 0.42
    brought = sum(relay.account().values())
    assert sandbox.engines.common.energy_balance.total_energy(relay) - began == pytest.approx(
        brought, abs=1e-12
    )  # rounding of 1 J


@pytest.mark.parametrize("integrator", ["velocity_verlet", "leapfrog", "rk4"])
def test_free_body_in_a_gravity_zone_moves_by_the_closed_form(integrator: str) -> None:
    """X = v t + ½ g t² with the zone's g, whatever the world's; these schemes are exact for it."""
    zone = {"position": [0.0, 0.0], "radius": 90.0, "gravity": [0.7, -1.3]}
    world = {"duration": 2.0, "gravity": [0.0, -9.81]}
    ball = {"position": [0.0, 0.0], "velocity": [1.0, 3.0], "radius": 0.1}
    scene = from_document({"world": world, "ball": [ball], "zone": [zone]})
    run = sandbox.run(scene, "reference", integrator=integrator)
    t, g, v = run.time[:, None], np.asarray([0.7, -1.3]), np.asarray([1.0, 3.0])
    np.testing.assert_allclose(run.position[:, 0], v * t + 0.5 * g * t * t, rtol=0, atol=1e-12)  # rounding of 200 sums
    np.testing.assert_allclose(run.velocity[:, 0], v + g * t, rtol=0, atol=1e-12)


@pytest.mark.parametrize("integrator", ["explicit_euler", "velocity_verlet"])
def test_energy_gained_on_a_slope_is_the_slopes(integrator: str) -> None:
    """Through a slope of 0.4 m at g = 5: m g·0.4 by drives, but for the substeps at both edges, v·h each."""
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
@settings(max_examples=100, deadline=None)
def test_outlines_agree_with_convex_pieces(spokes: list[tuple[float, float]], x: float, y: float) -> None:
    """A star about the origin, its corners at growing angles: two ways to tell what is inside, which share nothing."""
    turns = np.cumsum([turn for _, turn in spokes])
    angles = 2.0 * math.pi * turns / (turns[-1] + 0.1)
    corners = tuple((r * math.cos(a), r * math.sin(a)) for (r, _), a in zip(spokes, angles.tolist(), strict=True))
    ends = np.asarray(corners)
    lines = np.roll(ends, -1, axis=0) - ends
    off = np.asarray((x, y)) - ends
    share = np.clip((off * lines).sum(axis=1) / (lines * lines).sum(axis=1), 0.0, 1.0)[:, None]
    on_edge = np.hypot(*(off - share * lines).T).min() < 1e-9  # where rounding decides
    zones = [Zone(points=corners), Zone(points=corners, thickness=0.2), Zone(position=(0.1, 0.2), radius=0.5)]
    edge, first, reach, _ = make_zone_shapes(zones)
    for k, zone in enumerate(zones):
        if k == 0 and (on_edge or np.diff(angles).max() > math.pi):
            continue
        assert is_inside(edge, first[k], first[k + 1], reach[k], x, y) == contains(zone, (x, y))


@given(st.floats(-0.9, 0.6), st.floats(0.3, 30.0))
@settings(max_examples=30, deadline=None)
def test_bent_gate_stops_who_is_inside_and_lets_in_who_is_outside(height: float, speed: float) -> None:
    """A closed gate, its left inside: it is entered without a trace, and never left.

    At its corners it is: who comes in there passes both walls at once, and may leave by the other.
    """
    for corners in ([[-1, -1], [1, -1], [1, 1], [-1, 1]], [[-1, -1], [1, -1], [0.2, 0.0], [1, 1], [-1, 1]]):
        wall = {"points": corners, "closed": True, "one_way": True, "restitution": 1.0, "thickness": 0.02}
        ball = {"position": [-1.5, height], "velocity": [speed, 0.3 * speed], "radius": 0.05}
        dt = 0.02 / speed  # less than its radius a step, so that none passes unseen
        document = {"solver": {"dt": dt}, "world": {"duration": 1.0}, "ball": [ball], "wall": [wall]}
        relay = start(from_document(document), "reference")
        entered = False
        for _ in range(400):
            relay.step()
            frame = relay.frame()
            inside = contains(Zone(points=tuple(map(tuple, corners))), tuple(frame.position[0].tolist()))
            assert inside or not entered
            if not entered:
                assert frame.velocity[0].tolist() == [speed, 0.3 * speed]
            entered = entered or inside
        assert entered


def test_two_that_are_held_side_by_side_and_one_that_is_fixed_leave_each_other_alone() -> None:
    zones = [{"position": [x, 0.0], "radius": 0.05, "holds": True} for x in (0.0, 0.1)]
    balls = [{"name": f"b{k}", "position": [0.1 * k, 0.0], "radius": 0.1} for k in range(2)]
    fixed = {"position": [0.05, 0.1], "radius": 0.1, "fixed": True}
    scene = from_document({"world": {"gravity": [0.0, -5.0]}, "ball": [*balls, fixed], "zone": zones})
    relay = start(scene, "reference")
    relay.contacts()
    advance(relay, 0.5)
    assert relay.frame().position[:2].tolist() == [[0.0, 0.0], [0.1, 0.0]]
    assert not relay.frame().velocity.any()
    assert {other for _, other in relay.contacts().pair.tolist()} == {-1, -2}  # notes alone


def test_gate_that_closes_about_somebody_stops_or_lets_through_by_where_it_is() -> None:
    """Solid again while two stand in it, one on either side: the one on the left is pushed back, the other passes."""
    balls = [
        {"name": name, "position": [x, y], "velocity": [v, 0.0], "radius": 0.1}
        for name, x, y, v in (("left", -0.2, 0.5, 1.0), ("right", 0.25, -0.5, -1.0))
    ]
    gate = {"name": "gate", "points": [[0, -1], [0, 1]], "one_way": True, "solid": False}
    scene = from_document({"solver": {"dt": 0.005}, "ball": balls, "wall": [gate]})
    relay = start(scene, "reference")
    advance(relay, 0.15)  # the one is at −0.05 m, the other at 0.1
    relay.apply(Toggle(time=0.0, thing="gate", solid=True))
    advance(relay, 1.0)
    x = relay.frame().position[:, 0]
    assert x[0] < 0.0
    assert x[1] == pytest.approx(0.25 - 1.0, abs=1e-12)  # sums of v·h
    relay.apply(Reshape(time=0.0, thing="gate", points=((-2.0, 1.0), (-2.0, -1.0))))  # its left is to the right now
    advance(relay, 3.0)
    assert relay.frame().position[1, 0] > -2.0


@pytest.mark.parametrize("response", ["impulse", "penalty"])
def test_first_box_among_balls_comes_where_there_are_layers_and_gates(response: str) -> None:
    """From then on contacts are looked for in another way, and go by other keys."""
    scene = course()
    relay = start(scene, "reference", scene.solver.replace(response=response))
    advance(relay, 1.95)  # as it comes into the gate
    box = Box(name="box", position=(0.7, 0.5), velocity=(1.0, 0.0), size=(0.1, 0.1))
    relay.apply(Spawn(time=0.0, box=box))
    advance(relay, 2.2)
    assert relay.frame().velocity[0].tolist() == [1.0, 0.0]  # it has passed
    advance(relay, 3.0)
    assert relay.frame().position[1, 0] < 1.0  # on the ground the fence is in its way


def test_zone_is_noted_in_a_last_part_of_a_step() -> None:
    zone = {"position": [1.0, 0.0], "radius": 0.5, "to_layer": "up"}
    ball = {"position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05}
    document = {"solver": {"dt": 0.1, "substeps": 4}, "ball": [ball], "zone": [zone]}
    relay = start(from_document(document), "reference")
    relay.contacts()
    for _ in range(4):
        relay.step()
    relay.finish(0.95)  # at 0.495 s it is 5 mm before the edge
    assert relay.frame().layer.tolist() == [0]
    relay = start(from_document({**document, "solver": {"dt": 0.1, "substeps": 1}}), "reference")
    relay.contacts()
    for _ in range(5):
        relay.step()
    relay.finish(0.1)
    assert relay.frame().layer.tolist() == [1]
    assert relay.contacts().time.tolist() == pytest.approx([0.51])


def test_body_that_appears_in_a_zone_is_noted_after_the_next_substep() -> None:
    zone = {"position": [1.0, 0.0], "radius": 0.5, "to_layer": "up"}
    scene = from_document({"solver": {"dt": 0.01}, "ball": [{"position": [-1.0, 0.0], "radius": 0.1}], "zone": [zone]})
    relay = start(scene, "reference")
    relay.contacts()
    relay.apply(Spawn(time=0.0, ball=Ball(name="new", position=(1.0, 0.1), radius=0.1)))
    assert relay.frame().layer.tolist() == [0, 0]
    relay.step()
    assert relay.frame().layer.tolist() == [0, 1]
    assert relay.contacts().time.tolist() == [0.01]
