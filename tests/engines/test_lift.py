"""Lift on spinning bodies: a = s ω ẑ × w, w = v − wind."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sandbox.action import ActionError, Force, Remove, SetParameter, Spawn
from sandbox.arrays import FloatArray
from sandbox.engines.contract import Refusal
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.measure.analytic import free_flight, unsupported_reason
from sandbox.measure.metrics.invariants import conserves_energy, momentum_drift
from sandbox.measure.preflight.checks import warnings
from sandbox.measure.preflight.speed_bound import unknown_speeds
from sandbox.measure.run.runner import run
from sandbox.pymunk_export.obstacles import obstacles
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import World
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from tests import accounts

S, SPIN, SPEED = 0.05, 40.0, 3.0
TURNING = S * SPIN  # 2 rad/s

ABLE = ["pymunk", "box2d", "reference"]


def ball(**more: Any) -> dict[str, Any]:
    state = {"position": [1.0, 2.0], "velocity": [SPEED, 0.0], "angular_velocity": SPIN}
    return {"name": "a", **state, "radius": 0.1, "mass": 2.0, "lift": S, **more}


def scene_of(*balls: dict[str, Any], duration: float = 1.0, solver: dict[str, Any] | None = None, **more: Any) -> Scene:
    world = {"gravity": [0.0, 0.0], "duration": duration, **more.pop("world", {})}
    return from_document({"world": world, "solver": {"dt": 0.01, **(solver or {})}, "ball": [*balls], **more})


@pytest.mark.parametrize("collides", ["all", "none"])
@pytest.mark.parametrize(
    ("engine", "integrator", "error"),
    [
        ("pymunk", None, 0.0201),  # drift by old velocities: h·v/2 at each end of the chord
        ("box2d", None, 0.0201),  # likewise, by new velocities
        ("reference", "rk4", 1e-8),  # (Ωh)⁵/120 of the radius a step
        ("reference", "velocity_verlet", 1e-3),  # (Ωh)³/6 of the radius a step
    ],
)
def test_path_is_a_circle_whose_radius_is_the_speed_over_the_turning_rate(
    engine: str, integrator: str | None, error: float, collides: str
) -> None:
    """ẇ = iΩw has the solution w₀ e^(iΩt): the speed stays, and the path has the radius v/Ω, to the left of v."""
    solver = {} if integrator is None else {"integrator": integrator}
    result = run(scene_of(ball(collides=collides), duration=3.14, solver=solver), engine)
    centre = np.array([1.0, 2.0 + SPEED / TURNING])
    radius = np.hypot(*(result.position[:, 0] - centre).T)
    assert radius == pytest.approx(SPEED / TURNING, abs=error)
    # pymunk and box2d turn velocities exactly, box2d with 24 bits; the schemes lose what is stated above
    kept = {"pymunk": 1e-12, "box2d": 3e-6}.get(engine, error)
    assert np.hypot(*result.velocity[:, 0].T) == pytest.approx(SPEED, abs=kept)
    turned = np.unwrap(np.arctan2(*result.velocity[:, 0, ::-1].T))[-1]
    assert turned == pytest.approx(TURNING * result.time[-1], abs=max(kept, 3e-6))


def test_flight_in_closed_form_agrees_with_an_integration() -> None:
    """A cycloid with drag and wind, against DOP853 at its smallest tolerances; without drag too."""
    for drag in (0.0, 0.4):
        world = World(gravity=(0.25, -9.81), linear_drag=drag, wind=(-4.3, 2.2))

        def derivative(_: float, s: FloatArray, world: World = world) -> list[float]:
            wx, wy = s[2] - world.wind[0], s[3] - world.wind[1]
            ax = world.gravity[0] - world.linear_drag * wx - TURNING * wy
            return [s[2], s[3], ax, world.gravity[1] - world.linear_drag * wy + TURNING * wx]

        start_state = [3.7, -1.9, 11.3, 7.1]
        truth = solve_ivp(derivative, (0.0, 3.0), start_state, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        # The second body has no lift: its flight is that of the call without lift.
        positions, velocities = np.array([start_state[:2]] * 2), np.array([start_state[2:]] * 2)
        position, velocity = free_flight(np.array([3.0]), positions, velocities, world, np.array([TURNING, 0.0]))
        # tolerance of the integration over its steps
        assert [*position[0, 0], *velocity[0, 0]] == pytest.approx(truth, rel=1e-11, abs=1e-11)
        plain = free_flight(np.array([3.0]), positions[1], velocities[1], world)
        assert position[0, 1] == pytest.approx(plain[0][0], rel=1e-14)  # a few roundings
        assert velocity[0, 1] == pytest.approx(plain[1][0], rel=1e-14)  # likewise


def test_ball_drifts_across_gravity() -> None:
    """Released at rest, it does not fall: it follows a cycloid with the mean velocity g/Ω, to the left of gravity."""
    period = 2.0 * math.pi / TURNING
    world = World(gravity=(0.0, -9.81))
    times = period * np.arange(4.0)
    position, velocity = free_flight(times, np.zeros(2), np.zeros(2), world, TURNING)
    assert position[:, 1] == pytest.approx(np.zeros(4), abs=1e-13)  # rounding
    assert position[:, 0] == pytest.approx(9.81 / TURNING * times, rel=1e-13)  # likewise
    assert velocity == pytest.approx(np.zeros((4, 2)), abs=1e-13)  # likewise


@pytest.mark.parametrize(("engine", "response"), [*((engine, None) for engine in ABLE), ("reference", "penalty")])
def test_flight_with_drag_wind_and_lift_follows_the_closed_form(engine: str, response: str | None) -> None:
    """With penalty contacts too: two other balls are pressed together meanwhile."""
    world = {"gravity": [0.0, -9.81], "linear_drag": 0.5, "wind": [4.0, -1.0]}
    more, solver = [], {"dt": 1e-3}
    if response is not None:
        solver |= {"response": response, "integrator": "velocity_verlet", "stiffness": 2e4, "damping": 1.0}
        more = [ball(name=f"b{k}", position=[50.0 + 0.199 * k, 0.0], velocity=[0.0, 0.0]) for k in range(2)]
    scene = scene_of(ball(), *more, world=world, solver=solver)
    result = run(scene, engine)
    position, velocity = free_flight(result.time, np.array([1.0, 2.0]), np.array([SPEED, 0.0]), scene.world, TURNING)
    # Schemes of order 1: h/2 times the largest acceleration, 20 m/s², over 1 s, and three times the safety.
    assert np.abs(result.position[:, 0] - position).max() < 0.03
    assert np.abs(result.velocity[:, 0] - velocity).max() < 0.03


@pytest.mark.parametrize("collides", ["all", "none"])
@pytest.mark.parametrize("engine", ["pymunk", "box2d"])
def test_terminal_velocity_is_exact_at_any_step(engine: str, collides: str) -> None:
    """W = g/(k − iΩ): gravity, drag and lift balance. κh = 4, at which an explicit step is unstable."""
    scene = scene_of(
        ball(angular_velocity=500.0, lift=0.1, collides=collides),
        world={"gravity": [0.0, -9.81], "linear_drag": 40.0, "wind": [1.0, 0.0]},
        solver={"dt": 0.1, "substeps": 64 if engine == "box2d" else 1},  # box2d stops at 45° in a substep
        duration=2.0,
    )
    expected = complex(0.0, -9.81) / (40.0 - 50.0j) + 1.0
    found = complex(*run(scene, engine).velocity[-1, 0])
    assert abs(found - expected) < (1e-14 if engine == "pymunk" else 1e-6)  # rounding, of 24 bits in box2d


def test_flight_with_torque_and_lift_is_the_same_in_the_space_and_beside_it() -> None:
    """Bodies that touch nothing are advanced beside the space, and their spins change between substeps."""
    paths = []
    for other in ({}, {"plane": [{"point": [0.0, -50.0], "normal": [0.0, 1.0]}]}):  # a plane puts it into the space
        scene = scene_of(ball(fixed_rotation=False), world={"gravity": [0.0, -9.81]}, solver={"substeps": 5}, **other)
        simulation = start(scene, "pymunk")
        simulation.apply(Force(time=0.0, body="a", force=(0.0, 0.0), torque=0.02))
        for _ in range(50):
            simulation.step()
        frame = simulation.frame()
        paths.append([*frame.position[0], *frame.velocity[0], frame.angular_velocity[0]])
    assert paths[0][4] != SPIN
    assert paths[0] == pytest.approx(paths[1], rel=1e-13)  # rounding: 1/m·m


@pytest.mark.parametrize("engine", ABLE)
def test_spawned_body_has_lift(engine: str) -> None:
    """The spawned ball follows the same path as one that has been there from the start."""
    plain = scene_of(ball(name="b", position=[9.0, 9.0], lift=0.0), world={"gravity": [0.0, -9.81]})
    simulation = start(plain, engine)
    spawned = Ball(position=(1.0, 2.0), velocity=(SPEED, 0.0), angular_velocity=SPIN, radius=0.1, mass=2.0, lift=S)
    simulation.apply(Spawn(time=0.0, ball=spawned))
    both = start(
        scene_of(ball(name="b", position=[9.0, 9.0], lift=0.0), ball(), world={"gravity": [0.0, -9.81]}), engine
    )
    for _ in range(60):
        simulation.step()
        both.step()
    one, other = simulation.frame(), both.frame()
    assert one.velocity[1] == pytest.approx(other.velocity[1], abs=1e-13)  # rounding
    assert other.velocity[1, 1] > -9.81 * 0.6 + 3.0  # lift of 6 m/s² and more


@pytest.mark.parametrize("collides", ["all", "none"])
@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize("world", [{}, {"linear_drag": 0.3, "quadratic_drag": 0.1, "wind": [4.0, -1.0]}])
def test_ledger_closes_with_lift(engine: str, world: dict[str, Any], collides: str) -> None:
    scene = scene_of(ball(collides=collides), world={"gravity": [0.0, -9.81], **world}, solver={"substeps": 2})
    account = accounts.closed_account(scene, 60, engine=engine, closes=1e-11)  # rounding of sums
    if not world:  # in still air lift does no work
        assert account[Cause.DRAG] == pytest.approx(0.0, abs=0.3 if engine == "pymunk" else 1e-9)


def test_work_of_lift_in_wind_matches_its_integral() -> None:
    """∫ m s ω (ẑ × w)·v dt against DOP853: wind does work through lift."""
    world = {"wind": [5.0, 1.0]}
    scene = scene_of(ball(), world=world, solver={"integrator": "rk4"})

    def derivative(_: float, s: FloatArray) -> list[float]:
        ax, ay = -TURNING * (s[1] - 1.0), TURNING * (s[0] - 5.0)
        return [ax, ay, 2.0 * (ax * s[0] + ay * s[1])]

    work = solve_ivp(derivative, (0.0, 1.0), [SPEED, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-12).y[2, -1]
    account = accounts.closed_account(scene, 100, engine="reference", closes=1e-12)
    assert abs(work) > 5.0
    assert account[Cause.DRAG] == pytest.approx(work, rel=1e-7)  # fourth order at Ωh = 0.02


def test_scene_with_lift_conserves_neither_energy_nor_momentum() -> None:
    scene = scene_of(ball())
    assert not conserves_energy(scene)
    assert momentum_drift(run(scene, "pymunk"), scene) is None
    assert conserves_energy(scene_of(ball(lift=0.0)))


@pytest.mark.parametrize(
    ("engine", "tables", "reason"),
    [
        ("exact", {}, "with lift the time of an impact"),
        ("pymunk", {"solver": {"half_kick": True}}, "half_kick does not support lift"),
        ("pymunk", {"world": {"damping": 0.5}}, "lift and damping together"),
        ("pymunk", {"solver": {"sleeping": True}}, "sleeping does not support lift"),
        ("pymunk", {"surface": {"sliding_friction": 0.2}}, "lift on a floor"),
        ("reference", {"surface": {"sliding_friction": 0.2}}, "lift on a floor"),
    ],
)
def test_lift_that_an_engine_does_not_model_is_refused_by_name(
    engine: str, tables: dict[str, Any], reason: str
) -> None:
    with pytest.raises(Refusal, match=reason):
        start(scene_of(ball(), **tables), engine)


@pytest.mark.parametrize(
    ("engine", "solver", "reason"),
    [("exact", {}, "does not model lift"), ("pymunk", {"half_kick": True}, "half_kick does not support lift")],
)
def test_spawn_of_lift_that_an_engine_does_not_model_leaves_the_simulation_unchanged(
    engine: str, solver: dict[str, Any], reason: str
) -> None:
    simulation = start(scene_of(ball(lift=0.0), solver=solver), engine)
    before = simulation.state_hash()
    with pytest.raises(ActionError, match=reason):
        simulation.apply(Spawn(time=0.0, ball=Ball(position=(5.0, 5.0), radius=0.1, lift=0.1)))
    assert simulation.state_hash() == before


@pytest.mark.parametrize("engine", ["pymunk", "reference", "exact"])
def test_spawn_of_lift_on_a_surface_is_refused(engine: str) -> None:
    scene = scene_of(ball(lift=0.0), surface={"sliding_friction": 0.2})
    with pytest.raises(ActionError, match="does not model lift"):
        start(scene, engine).apply(Spawn(time=0.0, ball=Ball(position=(5.0, 5.0), radius=0.1, lift=0.1)))


@pytest.mark.parametrize("engine", ABLE)
def test_lift_of_a_removed_body_counts_no_more(engine: str) -> None:
    simulation = start(scene_of(ball(), ball(name="b", position=[9.0, 9.0], lift=0.0)), engine)
    simulation.apply(Remove(time=0.0, body="a"))
    simulation.apply(SetParameter(time=0.0, path="world.damping", value=0.5))  # pymunk refuses it together with lift
    for _ in range(100):
        simulation.step()
    assert simulation.frame().velocity[1, 0] == pytest.approx(0.5 * SPEED, rel=0.005)  # box2d: 1/(1 + λh) a step


def test_lift_on_a_driven_body_is_an_error() -> None:
    drive = {"kind": "stroke", "name": "d", "body": "a", "rate": 1.0, "pivot": [1.0, 2.0], "stops": [0.0, 1.0]}
    with pytest.raises(SceneError, match="has lift, which has no effect on a driven body"):
        scene_of(ball(velocity=[0.0, 0.0], angular_velocity=0.0), drive=[drive])


def test_no_speed_is_known_where_lift_meets_wind() -> None:
    """In the air's frame a wall moves, and a bounce on it adds speed each time."""
    wall = {"name": "w", "point": [3.0, 0.0], "normal": [-1.0, 0.0], "restitution": 1.0}
    assert unknown_speeds(scene_of(ball(), world={"wind": [2.0, 0.0]}, plane=[wall])) == ("lift in wind",)
    assert unknown_speeds(scene_of(ball(), plane=[wall])) == ()


def test_ball_that_lift_turns_into_a_plane_is_bounded_by_its_speed() -> None:
    """It starts along the plane, and meets it at its full speed."""
    plane = {"name": "p", "point": [-1.5, 0.0], "normal": [1.0, 0.0]}
    straight = ball(velocity=[-30.0, 0.0], lift=0.0)
    along = ball(velocity=[0.0, 30.0], lift=0.3)
    scenes = scene_of(straight, plane=[plane]), scene_of(along, plane=[plane])
    for scene in scenes:
        assert "depth" in {each.kind for each in warnings(scene, scene.solver.replace(dt=0.05), "reference")}


@pytest.mark.parametrize("turn", [0.005, 0.05, 0.5, 3.0])
@pytest.mark.parametrize("integrator", ["explicit_euler", "velocity_verlet", "leapfrog", "rk4"])
def test_change_of_speed_by_a_scheme_is_predicted(integrator: str, turn: float) -> None:
    """`check` warns exactly where a run of 100 steps changes the speed by more than a tenth."""
    scene = scene_of(ball(lift=turn / (SPIN * 0.01)), solver={"integrator": integrator})
    found = [each for each in warnings(scene, scene.solver, "reference") if each.kind == "lift"]
    speed = float(np.hypot(*run(scene, "reference").velocity[-1, 0]))
    assert bool(found) == (not SPEED / 1.1 <= speed <= 1.1 * SPEED)
    if found:
        dt = float(found[0].message.split("dt <= ")[1].split(" s")[0])
        kept = run(scene.with_duration(dt * round(1.0 / dt)), "reference", dt=dt)
        assert np.hypot(*kept.velocity[-1, 0]) == pytest.approx(SPEED, rel=0.101)  # three digits of dt


@pytest.mark.parametrize("key", ["fixed", "kinematic"])
def test_lift_on_a_body_that_no_force_moves_is_an_error(key: str) -> None:
    still = {} if key == "kinematic" else {"velocity": [0.0, 0.0], "angular_velocity": 0.0}
    with pytest.raises(SceneError, match=f"ball.a.lift: has no effect on a {key} body"):
        scene_of(ball(**{key: True}, **still))


def test_flight_with_lift_and_damping_has_no_closed_form() -> None:
    reason = unsupported_reason(scene_of(ball(), world={"damping": 0.5}))
    assert reason is not None
    assert "world.damping" in reason
    with pytest.raises(ValueError, match="lift and damping"):
        free_flight(np.zeros(1), np.zeros(2), np.ones(2), World(damping=0.5), 1.0)


def test_program_for_pymunk_names_lift_as_an_obstacle() -> None:
    assert any("lift" in each.message for each in obstacles(scene_of(ball())))
