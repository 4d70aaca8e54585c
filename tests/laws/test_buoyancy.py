"""Liquids on every engine: what floats, how deep and which side up, how it bobs, sinks and drifts."""

import json
import math
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import MultiPoint, Polygon

import sandbox
from sandbox.action import Force, Move, SetParameter, Spawn
from sandbox.engines.contract import Refusal
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.forces.liquid import Liquids
from sandbox.engines.registry import ENGINES
from sandbox.engines.registry import start as start_plain
from sandbox.engines.switching import SwitchableSimulation, switch_engine
from sandbox.measure.analytic.solve import closed_form
from sandbox.measure.metrics.invariants import conserves_energy
from sandbox.measure.preflight.speed_bound import unknown_speeds
from sandbox.measure.preflight.stiffness import liquid_warnings
from sandbox.scene.compile.demands import Demand
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory
from tests.accounts import closed_account
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # runs of some seconds of simulated time, and compilation

WITH_LIQUIDS = [name for name, engine in ENGINES.items() if Demand.BUOYANCY in engine.capabilities]
every_engine = pytest.mark.parametrize("engine", WITH_LIQUIDS)
stiff_engine = pytest.mark.parametrize("engine", ["pymunk", "box2d"])  # reference evaluates drag explicitly

G, RHO = 10.0, 1000.0
POOL = [[-50.0, -50.0], [50.0, -50.0], [50.0, 0.0], [-50.0, 0.0]]
"""m; its surface is at y = 0"""
DT = 1e-3

Document = dict[str, Any]


def scene_of(liquid: Document | None = None, *, duration: float = 1.0, dt: float = DT, **tables: Any) -> Scene:
    world = {"duration": duration, "gravity": [0.0, -G], **tables.pop("world", {})}
    zone = {"points": POOL, "liquid": {"density": RHO, **(liquid or {})}, **tables.pop("zone", {})}
    return from_document({"world": world, "solver": {"dt": dt}, "zone": [zone], **tables})


def box(y: float = 0.0, **more: Any) -> Document:
    return {"name": "box", "position": [0.0, y], "size": [1.0, 0.5], "density": 400.0, **more}


def disc(y: float = 0.0, **more: Any) -> Document:
    return {"name": "disc", "position": [0.0, y], "radius": 0.2, "density": 400.0, **more}


def run(scene: Scene, engine: str, **settings: Any) -> Trajectory:
    result = sandbox.run(scene, engine, audit=False, **settings)
    assert result.status == "ok", result.reason
    return result


def test_pymunk_box2d_and_reference_model_liquids() -> None:
    assert {"pymunk", "box2d", "reference"} <= {*WITH_LIQUIDS}


# Rest


@every_engine
def test_box_comes_to_rest_with_its_part_of_the_height_submerged(engine: str) -> None:
    scene = scene_of({"linear_drag": 3000.0}, duration=10.0, dt=5e-3, box=[box(0.3)])
    height = float(run(scene, engine).position[-1, 0, 1])
    assert 0.25 - height == pytest.approx(0.4 * 0.5, abs=1e-5)  # bobs by e^(−kt/2ρ) of 0.3 m: 5e-7, and 32-bit numbers


@every_engine
def test_box_in_balance_stays_where_it_is(engine: str) -> None:
    moved = run(scene_of(box=[box(0.05)]), engine).position[:, 0] - (0.0, 0.05)
    assert np.abs(moved).max() < 1e-6  # 32-bit numbers of box2d: 0.25 m − 1e-8 m, in 1000 steps


@every_engine
def test_area_of_a_floating_disc_below_the_surface_is_its_part_of_the_density(engine: str) -> None:
    scene = scene_of({"linear_drag": 5000.0}, duration=8.0, dt=5e-3, ball=[disc(0.1)])
    height, radius = float(run(scene, engine).position[-1, 0, 1]), 0.2
    half = math.acos(height / radius)
    segment = radius**2 * (half - math.sin(half) * math.cos(half))
    assert segment / (math.pi * radius**2) == pytest.approx(0.4, abs=1e-4)  # the rest of the bobbing


@every_engine
def test_weight_of_the_displaced_liquid_has_nothing_to_do_with_the_gravity_scale(engine: str) -> None:
    balanced = box(0.05, density=800.0, gravity_scale=0.5)
    moved = run(scene_of(box=[balanced]), engine).position[:, 0] - (0.0, 0.05)
    assert np.abs(moved).max() < 1e-6  # 32-bit numbers of box2d


@every_engine
def test_liquid_of_a_zone_with_gravity_weighs_by_that(engine: str) -> None:
    scene = scene_of(zone={"gravity": [0.0, -2.0]}, box=[box(-20.0)], duration=0.5)
    velocity = run(scene, engine).velocity[-1, 0]
    # a force of 2·1000 N/m² up, and the weight, 2·400: the zone's gravity acts on the body from the start
    assert velocity.tolist() == pytest.approx([0.0, 0.5 * 2.0 * (1000.0 / 400.0 - 1.0)], abs=5e-3)  # h·a and 32 bits


# Stability of floating


def _tilted(width: float, angle: float, **liquid: float) -> Scene:
    body = box(0.0, size=[width, 1.0], density=0.5 * RHO, angle=angle)
    return scene_of(liquid, duration=2.0, box=[body])


@every_engine
def test_box_rolls_at_the_frequency_of_its_metacentric_height(engine: str) -> None:
    width, small = 1.6, 0.02
    metacentric = width**2 / (12.0 * 0.5) - 0.25  # BM − BG, by I/A of the waterline, with the height 1 half submerged
    frequency = math.sqrt(G * metacentric / ((width**2 + 1.0) / 12.0))
    result = run(_tilted(width, small), engine)
    expected = small * np.cos(frequency * result.time)
    # first-order phase, ωh/2, of pymunk and box2d; the period grows as θ²; Box2D rounds a start angle
    assert np.abs(result.angle[:, 0] - expected).max() < 0.01 * small + (4e-4 if engine == "box2d" else 0.0)


@every_engine
def test_box_below_its_metacentric_limit_capsizes_at_the_rate_of_the_formula(engine: str) -> None:
    width, small = 1.0, 1e-3  # stable from a width of √1.5 on
    metacentric = width**2 / (12.0 * 0.5) - 0.25
    rate = math.sqrt(-G * metacentric / ((width**2 + 1.0) / 12.0))
    result = run(_tilted(width, small), engine)
    expected = small * np.cosh(rate * result.time)
    until = expected < 0.02  # beyond it angles are not small
    # h·rate/2; Box2D rounds a start angle
    assert np.allclose(result.angle[until, 0], expected[until], rtol=0.02, atol=4e-4 if engine == "box2d" else 0.0)


@every_engine
@pytest.mark.parametrize("kind", ["capsule", "box"])
def test_stick_dropped_upright_comes_to_float_flat(engine: str, kind: str) -> None:
    size = {"length": 1.6, "radius": 0.1} if kind == "capsule" else {"size": [1.8, 0.2]}
    stick = {"name": "stick", "position": [0.0, 0.5], "density": 600.0, "angle": math.pi / 2 - 0.05, **size}
    scene = scene_of({"linear_drag": 1500.0}, duration=12.0, dt=5e-3, **{kind: [stick]})
    result = run(scene, engine)
    # the last tilt decays as e^(−kt/2ρ)
    assert math.sin(result.angle[-1, 0]) == pytest.approx(0.0, abs=2e-3)


# Motion


@every_engine
def test_box_bobs_at_the_frequency_of_its_waterline(engine: str) -> None:
    frequency, amplitude = math.sqrt(RHO * G * 1.0 / (400.0 * 0.5)), 0.05
    result = run(scene_of(box=[box(0.05 + amplitude)], duration=2.0), engine)
    expected = 0.05 + amplitude * np.cos(frequency * result.time)
    # ωh/2 = 0.0035 of phase, of first order in pymunk and box2d
    assert np.abs(result.position[:, 0, 1] - expected).max() < 0.006 * amplitude


@pytest.mark.parametrize(("integrator", "order"), [("semi_implicit_euler", 1), ("velocity_verlet", 2), ("rk4", 4)])
def test_reference_bobs_with_the_order_of_its_integrator(integrator: str, order: int) -> None:
    scene = scene_of({"linear_drag": 400.0}, box=[box(-0.05)], duration=0.5)
    finest = run(scene, "reference", integrator="rk4", dt=0.5 / 512).position[-1, 0, 1]
    errors = [
        abs(run(scene, "reference", integrator=integrator, dt=0.5 / n).position[-1, 0, 1] - finest) for n in (16, 32)
    ]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.4)  # the next order at h = 1/32 s, ωh = 0.2


@every_engine
def test_disc_sinks_to_its_terminal_velocity_by_linear_drag(engine: str) -> None:
    k, density = 2000.0, 2500.0
    result = run(scene_of({"linear_drag": k}, ball=[disc(-10.0, density=density)], duration=4.0), engine)
    terminal = (density - RHO) * G / k
    expected = -terminal * (1.0 - np.exp(-k / density * result.time))
    error = 0.5 * DT * k / density * terminal  # first order in h, of the largest change
    assert np.abs(result.velocity[:, 0, 1] - expected).max() < 2.0 * error


@every_engine
def test_disc_sinks_to_its_terminal_velocity_by_quadratic_drag(engine: str) -> None:
    c, density = 500.0, 2500.0
    result = run(scene_of({"quadratic_drag": c}, ball=[disc(-10.0, density=density)], duration=3.0), engine)
    acceleration = (1.0 - RHO / density) * G
    terminal = math.sqrt(acceleration * density / c)
    expected = -terminal * np.tanh(acceleration / terminal * result.time)
    assert np.abs(result.velocity[:, 0, 1] - expected).max() < 2.0 * acceleration * DT  # first order in h


@stiff_engine
@pytest.mark.parametrize("key", ["linear_drag", "quadratic_drag"])
def test_stiff_drag_is_stable_and_its_terminal_velocity_exact(engine: str, key: str) -> None:
    k, density = 1e5, 1500.0
    result = run(scene_of({key: k}, ball=[disc(-10.0, density=density)], duration=20.0, dt=0.1), engine)
    terminal = 500.0 * G / k
    terminal = terminal if key == "linear_drag" else math.sqrt(terminal)
    # h k/ρ is 6.7; box2d has 32-bit numbers
    assert result.velocity[-1, 0].tolist() == pytest.approx([0.0, -terminal], rel=1e-5, abs=1e-7)


@every_engine
def test_body_drifts_to_the_velocity_of_the_current(engine: str) -> None:
    k, current = 800.0, [1.5, -0.5]
    scene = scene_of({"linear_drag": k, "current": current}, ball=[disc(-10.0, density=RHO)], duration=2.0)
    result = run(scene, engine)
    expected = np.outer(1.0 - np.exp(-k / RHO * result.time), current)
    assert np.abs(result.velocity[:, 0] - expected).max() < 1e-3  # h·k/2ρ·1.5 m/s = 6e-4


@every_engine
def test_spin_in_a_liquid_decays_by_the_integral_of_the_linear_drag(engine: str) -> None:
    k = 800.0
    spun = box(-10.0, density=RHO, angular_velocity=3.0)
    result = run(scene_of({"linear_drag": k}, box=[spun], duration=1.0), engine)
    expected = 3.0 * np.exp(-k / RHO * result.time)  # the moments of area and of mass are in the ratio ρ
    assert np.abs(result.angular_velocity[:, 0] - expected).max() < 2e-3  # h·k/2ρ·3 rad/s = 1.2e-3
    assert np.abs(result.position[:, 0] - (0.0, -10.0)).max() < 1e-5  # 32 bits at 10 m


@every_engine
def test_body_that_collides_with_nothing_floats_too_and_other_layers_do_not(engine: str) -> None:
    ghost = disc(-10.0, name="ghost", collides="none", density=RHO)
    other = disc(-10.0, name="other", layer="air", density=RHO)
    still, falling = run(scene_of(ball=[ghost, other], duration=0.5), engine).velocity[-1, :, 1]
    assert still == pytest.approx(0.0, abs=1e-5)  # 32-bit numbers of box2d
    assert falling == pytest.approx(-0.5 * G, rel=1e-5)  # likewise


@every_engine
def test_fixed_and_kinematic_bodies_are_not_moved(engine: str) -> None:
    scene = scene_of({"linear_drag": 100.0}, box=[box(fixed=True)], ball=[disc(kinematic=True, velocity=[0.3, 0.0])])
    result = run(scene, engine)
    assert result.velocity[-1].tolist() == pytest.approx(np.array([[0.3, 0.0], [0.0, 0.0]]), abs=1e-7)  # 32 bits


# Area


def _convex(draw: st.DrawFn, extent: float, least: int = 3) -> Polygon:
    """Return the hull of random points, none of them too close to a line of two others."""
    numbers = st.floats(-extent, extent).map(lambda x: round(x, 3))
    points = draw(st.lists(st.tuples(numbers, numbers), min_size=least, max_size=7, unique=True))
    hull = MultiPoint(points).convex_hull
    return hull if isinstance(hull, Polygon) and hull.area > 0.05 else shapely.box(-extent, -extent, extent, extent)


@st.composite
def bodies(draw: st.DrawFn) -> tuple[Document, shapely.Geometry]:
    """Return a body about the origin of its frame, and its shape there."""
    radius = draw(st.sampled_from([0.0, 0.1, 0.5]))
    kind = draw(st.sampled_from(["ball", "capsule", "polygon"]))
    if kind == "ball":
        return {"ball": [{"position": [0, 0], "radius": 0.7}]}, shapely.Point(0, 0).buffer(0.7, quad_segs=2000)
    if kind == "capsule":
        line = shapely.LineString([(-0.6, 0.0), (0.6, 0.0)])
        return {"capsule": [{"position": [0, 0], "length": 1.2, "radius": 0.3}]}, line.buffer(0.3, quad_segs=2000)
    hull = _convex(draw, 1.0)
    points = [list(each) for each in shapely.geometry.polygon.orient(hull).exterior.coords[:-1]]
    shape = hull.buffer(radius, quad_segs=2000) if radius else hull
    return {"polygon": [{"position": [0, 0], "points": points, "radius": radius}]}, shape


@st.composite
def pools(draw: st.DrawFn) -> Polygon:
    """Return a convex outline, or a concave one: a convex outline with a notch from a side to near its centroid."""
    hull = shapely.geometry.polygon.orient(_convex(draw, 2.0))
    corners = [*hull.exterior.coords[:-1]]
    if draw(st.booleans()):
        x, y = hull.centroid.coords[0]
        corners.insert(1, (round(x, 3), round(y, 3)))
    return Polygon(corners)


@given(bodies(), pools(), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-4.0, 4.0))
def test_submerged_area_and_moments_are_those_of_the_intersection(
    given_body: tuple[Document, shapely.Geometry], pool: Polygon, x: float, y: float, angle: float
) -> None:
    document, shape = given_body
    zone = {"points": [list(each) for each in pool.exterior.coords[:-1]], "liquid": {"density": 1.0}}
    try:
        scene = from_document({**document, "zone": [zone]})
    except SceneError:  # corners in line
        return
    placed, centre = scene.bodies, scene.bodies.position[0]
    pose = np.array([[x, y, angle]])
    acts, layer = np.ones(1, np.bool_), np.zeros(1, np.int64)
    area, mx, my, second = Liquids(scene).submerged(placed, layer, acts, pose)[0, 0].tolist()
    turned = shapely.affinity.rotate(shapely.affinity.translate(shape, *(-centre)), angle, (0, 0), use_radians=True)
    common = turned.intersection(shapely.affinity.translate(pool, -x, -y))
    ours = [area, mx, my]
    theirs = [common.area, *(np.multiply(common.area, common.centroid.coords[0]) if common.area else (0.0, 0.0))]
    assert ours == pytest.approx(theirs, abs=2e-6)  # circles of 8000 sides: 1e-7 of the area; shapely's own rounding
    spread = second * area - mx * mx - my * my  # the second moment about the centroid is at least that of a disc
    assert spread >= area**3 / (2.0 * math.pi) - 1e-9  # rounding


def test_overlapping_parts_displace_twice_as_they_weigh_twice() -> None:
    double = {"name": "double", "position": [0.0, -5.0], "density": RHO, "ball": [{"radius": 0.2}, {"radius": 0.2}]}
    scene = scene_of(body=[double], duration=0.2)
    assert run(scene, "reference").velocity[-1, 0].tolist() == pytest.approx([0.0, 0.0], abs=1e-9)  # rounding


# Energy, state, refusals


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_energy_account_closes_with_the_work_of_the_liquid(engine: str) -> None:
    drag = {"linear_drag": 300.0, "quadratic_drag": 100.0, "current": [0.4, 0.0]}
    floor = {"point": [0.0, -0.6], "normal": [0.0, 1.0], "friction": 0.3}
    scene = scene_of(drag, box=[box(0.5, angle=0.3)], ball=[disc(0.2, density=2000.0)], plane=[floor], dt=5e-3)
    account = closed_account(scene, 200, engine=engine, closes=1e-11)  # rounding of some thousand entries
    assert account[Cause.LIQUID] != 0.0
    assert account[Cause.DRAG] == 0.0


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_work_of_buoyancy_is_the_weight_of_the_liquid_times_the_rise(engine: str) -> None:
    scene = scene_of(ball=[disc(-10.0)], dt=5e-3)
    account = closed_account(scene, 200, engine=engine, closes=1e-11)  # rounding
    rise = float(run(scene, engine).position[-1, 0, 1]) + 10.0
    expected = RHO * G * math.pi * 0.2**2 * rise
    assert account[Cause.LIQUID] == pytest.approx(expected, rel=6e-3)  # h/T: pymunk drifts by the old velocity


@every_engine
def test_liquid_acts_after_a_switch_a_spawn_and_a_move(engine: str) -> None:
    scene = scene_of({"linear_drag": 500.0}, ball=[disc(-5.0)], dt=5e-3)
    simulation = SwitchableSimulation(scene, "reference")
    advance(simulation, 20)
    assert switch_engine(simulation, engine) is None
    late = Box(name="late", position=(3.0, -5.0), size=(0.4, 0.4), density=RHO)
    simulation.apply(Spawn(time=0.0, box=late))
    simulation.apply(Move(time=0.0, body="disc", position=(0.0, 5.0)))
    before = simulation.frame()
    advance(simulation, 20)
    after = simulation.frame()
    change = (after.velocity - before.velocity)[:, 1]
    assert change[0] == pytest.approx(-G * 0.1, rel=1e-4)  # above the liquid; 32 bits of box2d
    assert change[1] == pytest.approx(0.0, abs=1e-5)  # as dense as the liquid; likewise


def test_snapshot_repeats_the_run_to_the_bit() -> None:
    scene = scene_of({"linear_drag": 300.0}, box=[box(0.4, angle=0.4)], dt=5e-3)
    simulation = start_plain(scene, "reference")
    advance(simulation, 50)
    kept = simulation.snapshot()
    advance(simulation, 50)
    hashed = simulation.state_hash()
    again = kept.resumed()
    advance(again, 50)
    assert again.state_hash() == hashed


@pytest.mark.parametrize("zone", [{"position": [0, 0], "radius": 1.0}, {"points": [[0, 0], [1, 0]], "thickness": 0.2}])
def test_liquid_of_a_circle_or_strip_is_a_fault(zone: Document) -> None:
    with pytest.raises(SceneError, match=r"zone.*liquid.*polygon"):
        from_document({"ball": [disc()], "zone": [{**zone, "liquid": {"density": 1.0}}]})


@pytest.mark.parametrize("liquid", [{}, {"density": 0.0}, {"density": 1.0, "linear_drag": -1.0}, {"density": "wet"}])
def test_invalid_liquid_is_a_fault(liquid: Document) -> None:
    with pytest.raises(SceneError, match="liquid"):
        from_document({"ball": [disc()], "zone": [{"points": POOL, "liquid": liquid}]})


def test_exact_refuses_by_name() -> None:
    with pytest.raises(Refusal, match="buoyancy"):
        start_plain(scene_of(ball=[disc()]), "exact")


@pytest.mark.parametrize("settings", [{"half_kick": True}, {"sleeping": True}])
def test_pymunk_refuses_settings_that_need_free_or_resting_bodies(settings: Document) -> None:
    scene = scene_of(ball=[disc()])
    with pytest.raises(Refusal, match="zones"):
        start_plain(scene, "pymunk", scene.solver.replace(**settings))


# Interplay and forecasts


@every_engine
def test_another_gravity_of_the_world_changes_the_buoyancy(engine: str) -> None:
    simulation = start_plain(scene_of(box=[box(0.05)]), engine)
    simulation.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, -2.0 * G]))
    advance(simulation, 100)
    # it still displaces its own weight; 32-bit numbers of box2d
    assert simulation.frame().velocity[0].tolist() == pytest.approx([0.0, 0.0], abs=1e-5)


@every_engine
def test_air_and_liquid_together_slow_a_body_to_their_common_terminal_velocity(engine: str) -> None:
    k, air, density = 4000.0, 0.5, 2000.0
    tables = {"world": {"linear_drag": air}, "ball": [disc(-20.0, density=density)]}
    result = run(scene_of({"linear_drag": k}, duration=8.0, **tables), engine)
    terminal = (density - RHO) * G / (k + density * air)
    # with both, pymunk and box2d have an error of the order h·(k/ρ)
    assert result.velocity[-1, 0].tolist() == pytest.approx([0.0, -terminal], rel=2.0 * DT, abs=1e-6)


@every_engine
def test_force_of_an_action_pushes_a_body_to_where_the_drag_balances_it(engine: str) -> None:
    k = 1000.0
    area = math.pi * 0.2**2
    scene = scene_of({"linear_drag": k}, ball=[disc(-20.0, density=RHO)], duration=12.0)
    result = sandbox.run(
        scene, engine, audit=False, actions=[Force(time=0.0, body="disc", force=(k * area * 0.5, 0.0))]
    )
    assert result.velocity[-1, 0].tolist() == pytest.approx([0.5, 0.0], abs=2e-5)  # 0.5·e^(−12) = 3e-6, and 32 bits


@every_engine
def test_boat_of_several_parts_floats_by_its_mass_and_keeps_its_keel_down(engine: str) -> None:
    hull = {"points": [[-1.0, 0.4], [-1.0, -0.4], [1.0, -0.4], [1.0, 0.4]], "density": 200.0}
    keel = {"position": [0.0, -0.6], "size": [1.0, 0.4], "density": 2000.0}
    boat = {"name": "boat", "position": [0.0, 0.5], "angle": 2.0, "polygon": [hull], "box": [keel]}
    scene = scene_of({"linear_drag": 1500.0}, body=[boat], duration=15.0, dt=5e-3)
    result = run(scene, engine)
    mass, x, y = 1.6 * 200.0 + 0.4 * 2000.0, *result.position[-1, 0]
    below = y + (0.4 * 2000.0 * 0.6) / mass  # centre of the hull
    displaced = 0.4 + 2.0 * (0.4 - below)
    assert displaced * RHO == pytest.approx(mass, rel=1e-3)  # the rest of the bobbing
    assert math.cos(result.angle[-1, 0]) == pytest.approx(1.0, abs=1e-4)  # likewise
    assert abs(x) < 5.0


def test_check_warns_of_a_drag_that_makes_reference_diverge_and_of_no_weaker_one() -> None:
    def scene(k: float) -> Scene:
        ball = disc(-10.0, density=RHO, velocity=[1.0, 0.0])
        return scene_of({"linear_drag": k}, ball=[ball], dt=0.1, duration=10.0)

    for part, diverges in ((0.95, False), (1.05, True)):
        k = part * 2.0 * RHO / 0.1  # κ A h/m is 2 at part 1
        warned = any(each.kind == "liquid" for each in liquid_warnings(scene(k), scene(k).solver))
        result = sandbox.run(scene(k), "reference", audit=False)
        grows = bool(np.hypot(*result.velocity[-1, 0]) > 1.0)
        assert (warned, grows) == (diverges, diverges)


def test_speeds_in_liquids_have_no_bound_and_their_motion_no_closed_form() -> None:
    scene = scene_of(ball=[disc(-10.0)], duration=0.2)
    assert "liquids" in unknown_speeds(scene)
    assert not conserves_energy(scene)
    assert closed_form(run(scene, "reference"), scene, 0) is None


def test_compiled_and_plain_kernels_give_the_same_area_to_the_bit() -> None:
    document = {"capsule": [{"position": [0, 0], "length": 1.2, "radius": 0.3}], "zone": [{"points": POOL}]}
    document["zone"][0]["liquid"] = {"density": 1.0}
    code = (
        "import json, sys, numpy as np\n"
        "from sandbox.engines.forces.liquid import Liquids\n"
        "from sandbox.scene.files.load import from_document\n"
        "scene = from_document(json.loads(sys.argv[1]))\n"
        "poses = [[0.1 * k, 0.2 * np.sin(k), k] for k in range(20)]\n"
        "for pose in poses:\n"
        "    one = np.ones(1, bool), np.array([pose], float)\n"
        "    print(Liquids(scene).submerged(scene.bodies, np.zeros(1, np.int64), *one).tobytes().hex())\n"
    )
    outputs = [
        subprocess.run(
            [sys.executable, "-c", code, json.dumps(document)],
            env={**os.environ, "NUMBA_DISABLE_JIT": disabled},
            capture_output=True,
            check=True,
        ).stdout
        for disabled in ("0", "1")
    ]
    assert outputs[0] == outputs[1]
