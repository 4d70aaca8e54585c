"""Tyres on every engine: skidding, rolling, cornering, braking and rest, and the car of Gymnasium's CarRacing."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Force, Move, Remove, SetParameter, Steer, Switch
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import SwitchableSimulation
from sandbox.engines.switching import start as start_switchable
from sandbox.measure.analytic.solve import closed_form
from sandbox.measure.metrics.invariants import conserves_energy, momentum_drift
from sandbox.measure.preflight.speed_bound import unknown_speeds
from sandbox.scene.compile.demands import Demand
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory
from tests.accounts import closed_account
from tests.engines.stepping import advance
from tools.oracles.racing_car import FRAME, car_alone, steering_actions

pytestmark = pytest.mark.fail_slow(60)  # runs of some seconds of simulated time, and compilation

WITH_TYRES = [name for name, engine in ENGINES.items() if Demand.TYRES in engine.capabilities]
every_engine = pytest.mark.parametrize("engine", WITH_TYRES)
INTEGRATORS = ("explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4")

DT = 1e-3
M, GRIP = 2.0, 8.0
"""kg; N"""
LENGTH, DELTA = 1.6, 0.3
"""m, wheelbase; rad"""
CASES = json.loads((Path(__file__).parent / "cases" / "racing_car.json").read_text())

Document = dict[str, Any]


def car(*tyres: Document, duration: float = 1.0, dt: float = DT, **more: Any) -> Scene:
    """Return a scene with a box, 2 m by 1 m, along x."""
    world = {"gravity": [0.0, 0.0], "duration": duration, **more.pop("world", {})}
    tables = {key: more.pop(key) for key in ("wall", "ball", "event", "joint", "attraction") if key in more}
    box = {"name": "car", "size": [2.0, 1.0], "mass": M, "position": [0.0, 0.0], **more}
    named = [{"name": f"tyre {k}", "body": "car", "grip": GRIP, **tyre} for k, tyre in enumerate(tyres)]
    return from_document({"world": world, "solver": {"dt": dt}, "box": [box], "tyre": named, **tables})


def bicycle(front: Document | None = None, rear: Document | None = None, **more: Any) -> Scene:
    """Return a scene with a car of two tyres on its axis."""
    half = 0.5 * LENGTH
    return car({"point": [half, 0.0], **(front or {})}, {"point": [-half, 0.0], **(rear or {})}, **more)


def run(scene: Scene, engine: str, **settings: Any) -> Trajectory:
    result = sandbox.run(scene, engine, audit=False, **settings)
    assert result.status == "ok", result.reason
    return result


def forward(result: Trajectory) -> Any:
    """Return the speed of the car along its axis in each frame, m/s."""
    angle = result.angle[:, 0]
    return (result.velocity[:, 0] * np.column_stack((np.cos(angle), np.sin(angle)))).sum(axis=1)


def test_pymunk_box2d_and_reference_model_tyres_and_exact_refuses_them() -> None:
    assert {"pymunk", "box2d", "reference"} <= {*WITH_TYRES}
    assert any("tyres" in reason for reason in ENGINES["exact"].missing(car({}), car({}).solver))


# Sliding


@every_engine
@pytest.mark.parametrize("dt", [DT, 0.02])
def test_car_that_slides_sideways_stops_after_v2_over_2_mu_g_and_stays(engine: str, dt: float) -> None:
    result = run(car({}, velocity=[0.0, 4.0], duration=1.5, dt=dt), engine)
    deceleration = GRIP / M
    # positions follow velocities of one end of the step: half of v·h; 32-bit numbers of box2d
    assert result.position[-1, 0].tolist() == pytest.approx([0.0, 16.0 / (2.0 * deceleration)], abs=2.1 * dt)
    stopped = result.time > 4.0 / deceleration + dt
    assert np.abs(result.velocity[stopped, 0]).max() < 1e-6  # 32-bit numbers of box2d
    assert np.ptp(result.position[stopped, 0], axis=0).max() < 1e-6  # likewise


@every_engine
@pytest.mark.parametrize(
    "air",
    [{}, {"linear_drag": 0.5}, {"damping": 0.3}, {"quadratic_drag": 0.3}, {"quadratic_drag": 0.1, "wind": [0, 3]}],
)
def test_friction_never_reverses_the_sliding(engine: str, air: Document) -> None:
    result = run(car({}, velocity=[0.0, 4.0], duration=2.0, dt=0.03, world=air), engine)
    assert result.velocity[:, 0, 1].min() > -1e-6  # 32-bit numbers of box2d
    assert abs(result.velocity[-1, 0, 1]) < 1e-6  # likewise


@every_engine
def test_friction_does_not_reverse_a_body_with_damping_of_its_own(engine: str) -> None:
    own = {"linear_damping": 0.7, "angular_damping": 0.4, "angular_velocity": 1.0}
    tyres = [{"point": [x, 0.0], "rolling_drag": GRIP} for x in (-0.8, 0.8)]
    result = run(car(*tyres, velocity=[0.0, 4.0], duration=2.0, dt=0.03, **own), engine)
    lowest = min(result.velocity[:, 0, 1].min(), result.angular_velocity.min())
    assert lowest > -1e-6  # 32-bit numbers of box2d
    assert np.abs(result.velocity[-1]).max() + abs(result.angular_velocity[-1, 0]) < 1e-6  # likewise


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_every_integrator_comes_to_rest(integrator: str) -> None:
    scene = car({"brake": 20.0}, velocity=[1.0, 4.0], duration=2.0, dt=0.02)
    result = run(scene, "reference", integrator=integrator, actions=(Steer(time=0.0, tyre="tyre 0", brake=1.0),))
    stopped = result.time > math.hypot(1.0, 4.0) * M / GRIP + 0.02
    assert np.abs(result.velocity[stopped]).max() < 1e-12  # rounding


@every_engine
def test_rolling_is_free(engine: str) -> None:
    result = run(car({}, velocity=[3.0, 4.0], duration=2.0), engine)
    assert result.velocity[:, 0, 0] == pytest.approx(3.0, abs=1e-6)  # 32-bit numbers of box2d
    assert result.velocity[-1, 0, 1] == pytest.approx(0.0, abs=1e-6)  # likewise


@every_engine
def test_locked_tyre_slides_against_its_velocity_in_any_direction(engine: str) -> None:
    result = run(car({"rolling_drag": 2.0 * GRIP, "angle": 0.7}, velocity=[3.0, 4.0], duration=2.0), engine)
    distance = 25.0 / (2.0 * GRIP / M)
    assert result.position[-1, 0].tolist() == pytest.approx([0.6 * distance, 0.8 * distance], abs=3e-3)  # v·h/2
    assert result.velocity[-1, 0].tolist() == pytest.approx([0.0, 0.0], abs=1e-6)  # 32-bit numbers of box2d


@every_engine
def test_parked_car_withstands_a_force_below_its_grip_and_moves_under_a_greater_one(engine: str) -> None:
    scene = car({"rolling_drag": GRIP})
    for force, acceleration in ((0.9 * GRIP, 0.0), (1.5 * GRIP, 0.5 * GRIP / M)):
        result = run(scene, engine, actions=(Force(time=0.0, body="car", force=(0.6 * force, 0.8 * force)),))
        expected = [0.6 * acceleration, 0.8 * acceleration]
        assert result.velocity[-1, 0].tolist() == pytest.approx(expected, abs=2e-5)  # 1000 sums of 32 bits


@every_engine
def test_slip_below_the_grip_is_the_stated_speed_per_force(engine: str) -> None:
    slip = 0.05
    scene = car({"slip": slip}, duration=3.0)
    result = run(scene, engine, actions=(Force(time=0.0, body="car", force=(0.0, 5.0)),))
    rate = 1.0 / (slip * M)
    expected = slip * 5.0 * (1.0 - np.exp(-rate * result.time))
    assert np.abs(result.velocity[:, 0, 1] - expected).max() < 0.25 * rate * DT  # h·rate/2 of 0.25 m/s, of first order


# Driving and braking


@every_engine
def test_braking_distance_is_that_of_the_brake_or_of_the_grip(engine: str) -> None:
    for brake, force in ((0.5 * GRIP, 0.5 * GRIP), (3.0 * GRIP, GRIP)):
        scene = car({"brake": brake}, velocity=[4.0, 0.0], duration=3.0)
        result = run(scene, engine, actions=(Steer(time=0.0, tyre="tyre 0", brake=1.0),))
        assert result.position[-1, 0, 0] == pytest.approx(
            16.0 * M / (2.0 * force), abs=2.5e-3
        )  # v·h/2, and sums of 32-bit numbers
        assert result.velocity[-1, 0, 0] == pytest.approx(0.0, abs=1e-6)  # 32-bit numbers of box2d


@every_engine
def test_engine_drives_forwards_and_backwards_up_to_the_grip(engine: str) -> None:
    scene = car({"drive": 2.0 * GRIP, "rolling_drag": 1.0})
    for throttle, force in ((0.25, 0.5 * GRIP - 1.0), (-0.25, -0.5 * GRIP + 1.0), (1.0, GRIP)):
        result = run(scene, engine, actions=(Steer(time=0.0, tyre="tyre 0", throttle=throttle),))
        assert result.velocity[-1, 0].tolist() == pytest.approx([force / M, 0.0], abs=5e-5)  # 1000 sums of 32 bits


@every_engine
def test_driven_tyre_has_the_rest_of_the_friction_circle_for_cornering(engine: str) -> None:
    drive = 0.6 * GRIP
    result = run(
        car({"drive": drive}, velocity=[0.0, 8.0]), engine, actions=(Steer(time=0.0, tyre="tyre 0", throttle=1.0),)
    )
    expected = [drive / M, 8.0 - 0.8 * GRIP / M]
    assert result.velocity[-1, 0].tolist() == pytest.approx(expected, abs=1e-4)  # 1000 sums of 32-bit numbers of 8 m/s


@every_engine
def test_brake_that_locks_leaves_the_direction_of_sliding_and_a_weaker_one_its_force(engine: str) -> None:
    """A brake of 0.5 of the grip locks a tyre that slides at more than 60° to its rolling direction."""
    for vx, along in ((2.0, 0.1961), (10.0, 0.5)):  # 2/√(2² + 10²)
        scene = car({"brake": 0.5 * GRIP}, velocity=[vx, 10.0], duration=0.01)
        result = run(scene, engine, actions=(Steer(time=0.0, tyre="tyre 0", brake=1.0),))
        change = (result.velocity[-1, 0] - result.velocity[0, 0]) * M / (0.01 * GRIP)
        # the direction turns by 0.4 % in the run; 32 bits of 10 m/s in a change of 0.04 m/s
        assert change.tolist() == pytest.approx([-along, -math.sqrt(1.0 - along**2)], abs=3e-3)


# Cornering


@every_engine
@pytest.mark.parametrize("dt", [DT, 0.02])
def test_slow_car_turns_on_the_circle_of_the_bicycle_model(engine: str, dt: float) -> None:
    scene = bicycle({"angle": DELTA, "grip": 1e3}, {"grip": 1e3}, velocity=[1.0, 0.0], duration=3.0, dt=dt)
    result = run(scene, engine)
    radius = LENGTH / math.tan(DELTA)
    late = slice(len(result.time) // 2, None)
    # the rear tyre rolls on the radius: exact in pymunk; others turn by ω·h after the step's velocity
    assert forward(result)[late] / result.angular_velocity[late, 0] == pytest.approx(radius, rel=0.2 * dt)


@every_engine
def test_tyres_without_a_limit_hold_their_directions(engine: str) -> None:
    scene = bicycle({"angle": DELTA, "grip": 1e30}, {"grip": 1e30}, velocity=[1.0, 0.0], duration=0.1)
    result = run(scene, engine)
    # rounding; reference and box2d turn by ω·h = 2e-4 rad after the step's velocity
    assert forward(result)[-1] / result.angular_velocity[-1, 0] == pytest.approx(LENGTH / math.tan(DELTA), rel=2e-4)


@every_engine
def test_steering_is_left_and_keeps_its_circle(engine: str) -> None:
    scene = bicycle({"steer": 2.0 * DELTA, "grip": 1e3}, {"grip": 1e3}, velocity=[1.0, 0.0], duration=8.0)
    result = run(scene, engine, actions=(Steer(time=0.0, tyre="tyre 0", steer=0.5),))
    assert result.angular_velocity[-1, 0] > 0.0
    # the centre of mass is half the wheelbase in front of the rear tyre
    radius = math.hypot(LENGTH / math.tan(DELTA), 0.5 * LENGTH)
    middle = result.position[:, 0] - (0.0, 0.0)
    centre = np.array([-0.5 * LENGTH, LENGTH / math.tan(DELTA)])
    # the first impulses turn it; first order in h
    assert np.hypot(*(middle - centre).T) == pytest.approx(radius, abs=0.02)


@every_engine
def test_car_beyond_the_grip_runs_wide(engine: str) -> None:
    """The path of a car cannot be narrower than v²/(μ g): the whole grip is then across it."""
    speed, grip = 6.0, 2.0 * GRIP
    scene = bicycle({"angle": DELTA}, velocity=[speed, 0.0], duration=1.0)
    result = run(scene, engine)
    velocity = result.velocity[:, 0]
    turn = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    curvature = np.abs(np.gradient(turn, result.time)) / np.hypot(*velocity.T)
    assert speed**2 / (LENGTH / math.tan(DELTA)) > 1.5 * grip / (2.0 * M)  # asks for more than both tyres have
    narrowest = np.hypot(*velocity.T) ** 2 * M / grip
    assert (1.0 / curvature >= narrowest * (1.0 - 1e-2)).all()  # differences of 1 ms
    slow = run(bicycle({"angle": DELTA}, velocity=[0.5, 0.0], duration=1.0), engine)
    assert slow.angle[-1, 0] / 0.5 > 1.1 * result.angle[-1, 0] / speed  # turns more on the same way


@every_engine
def test_free_rolling_in_a_bend_loses_speed_of_first_order_in_the_step_only(engine: str) -> None:
    losses = []
    for dt in (0.01, 0.005):
        scene = bicycle({"angle": DELTA, "grip": 1e3}, {"grip": 1e3}, velocity=[2.0, 0.0], duration=2.0, dt=dt)
        speed = forward(run(scene, engine))
        losses.append(1.0 - speed[-1] / speed[len(speed) // 2])
    assert 0.0 < losses[1] < losses[0] < 0.005  # ω² h t/2 for ω = 0.38 rad/s, with the share of the rotation
    assert losses[0] / losses[1] == pytest.approx(2.0, rel=0.1)  # first order; 32-bit numbers of box2d


# Energy, symmetry


@pytest.mark.parametrize("engine", [name for name in WITH_TYRES if ENGINES[name].knows_impulses])
def test_friction_only_takes_energy_out_and_the_engine_gives_its_force_times_way(engine: str) -> None:
    scene = bicycle({"steer": 0.4, "slip": 0.01}, {"drive": 5.0, "brake": 9.0}, velocity=[3.0, 1.0], dt=0.005)
    actions = [
        (0, Steer(time=0.0, tyre="tyre 0", steer=1.0)),
        (0, Steer(time=0.0, tyre="tyre 1", throttle=1.0)),
        (100, Steer(time=0.0, tyre="tyre 1", brake=1.0)),
    ]
    account = closed_account(scene, 200, actions, engine=engine, closes=1e-12)
    assert account[Cause.FRICTION] < -1.0 and account[Cause.DRIVES] > 1.0
    assert account[Cause.PHANTOM] == 0.0


@pytest.mark.parametrize("engine", [name for name in WITH_TYRES if ENGINES[name].knows_impulses])
def test_friction_takes_the_kinetic_energy_of_a_car_that_stops(engine: str) -> None:
    scene = car({"rolling_drag": GRIP}, velocity=[3.0, 4.0], duration=2.0)
    account = closed_account(scene, 2000, engine=engine, closes=1e-12)
    assert account[Cause.FRICTION] == pytest.approx(-0.5 * M * 25.0, rel=1e-12)  # rounding


def _towing(**more: Any) -> Scene:
    """Return a scene with a car that turns, and tows a trailer."""
    half = 0.5 * LENGTH
    trailer = {"name": "trailer", "position": [-2.5, 0.0], "size": [2.0, 1.0], "mass": M, "velocity": [2.0, 0.0]}
    own = {"name": "car", "position": [0.0, 0.0], "size": [2.0, 1.0], "mass": M, "velocity": [2.0, 0.0]}
    tyres = [("car", half, 0.2), ("car", -half, 0.0), ("trailer", -0.3, 0.0)]
    return from_document(
        {
            "world": {"gravity": [0.0, 0.0], "duration": 6.0},
            "solver": {"dt": 0.005},
            "box": [{**each, "collides": "fixed"} for each in (own, trailer)],
            "joint": [{"kind": "pivot", "between": ["car", "trailer"], "anchors": [[-1.2, 0.0], [1.3, 0.0]]}],
            "tyre": [{"body": body, "point": [x, 0.0], "angle": angle, "grip": 100.0} for body, x, angle in tyres],
            **more,
        }
    )


@every_engine
def test_trailer_follows_at_the_angle_of_its_circle(engine: str) -> None:
    frame = run(_towing(), engine)
    radius = LENGTH / math.tan(0.2)
    # hitch 0.4 m behind the rear axle, axle of the trailer 1.6 m behind the hitch
    angle = math.atan(0.4 / radius) + math.asin(1.6 / math.hypot(radius, 0.4))
    assert frame.angle[-1, 0] - frame.angle[-1, 1] == pytest.approx(angle, rel=0.02)  # the pivot acts after tyres
    assert frame.angular_velocity[-1, 1] == pytest.approx(frame.angular_velocity[-1, 0], rel=0.01)  # likewise


@pytest.mark.parametrize("engine", [name for name in WITH_TYRES if ENGINES[name].knows_impulses])
def test_account_closes_with_joints_and_contacts(engine: str) -> None:
    wall = {"points": [[3.0, -9.0], [3.0, 9.0]], "restitution": 0.5, "friction": 0.3}
    account = closed_account(_towing(wall=[wall]), 400, engine=engine, closes=1e-10)
    assert account[Cause.FRICTION] < 0.0


@every_engine
def test_mirror_image_is_driven_as_the_mirror_image(engine: str) -> None:
    ways = []
    for side in (1.0, -1.0):
        tyres = [
            {"point": [0.8, side * 0.4], "angle": side * 0.3},
            {"point": [0.8, -side * 0.4], "angle": side * 0.3},
            {"point": [-0.8, 0.0]},
        ]
        ways.append(run(car(*tyres, velocity=[3.0, side * 0.5]), engine).position[:, 0])
    # 200 iterations do not find the forces of three rigid tyres exactly; box2d has 32-bit numbers
    assert ways[0] * (1.0, -1.0) == pytest.approx(ways[1], abs=1e-5)


# Oracle


@every_engine
@pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])
def test_racing_car_drives_as_that_of_gymnasium_with_light_wheels(engine: str, case: Document) -> None:
    """`tools/oracles/racing_car.py` writes the cases; Gymnasium's wheels have a spin, those here have none."""
    inputs, path = np.asarray(case["inputs"]), np.asarray(case["path"])
    scene = car_alone(case["speed"], len(inputs) * FRAME, DT)
    result = run(scene, engine, actions=steering_actions(scene, inputs))
    rows = np.searchsorted(result.time, np.arange(len(path)) * FRAME - 1e-9)  # rounding of times
    way = np.hypot(*np.diff(path[:, :2], axis=0).T).sum()
    distance = np.hypot(*(result.position[rows, 0] - path[:, :2]).T)
    # A wheel that spins freely at full power keeps a part of its grip across, in the direction of its slip.
    assert distance.max() < (0.08 if case["name"] == "full throttle in a bend" else 0.025) * way


# Faults and actions


@pytest.mark.parametrize(
    ("tyre", "key", "message"),
    [
        ({"body": "van"}, "body", "no body is named 'van'"),
        ({"grip": 0.0}, "grip", "greater than 0"),
        ({"slip": -1.0}, "slip", "at least 0"),
        ({"grip": math.inf}, "grip", "finite"),
        ({"width": 0.2}, "width", "unknown key"),
    ],
)
def test_invalid_tyre_is_refused_where_it_is(tyre: Document, key: str, message: str) -> None:
    with pytest.raises(SceneError, match=f"tyre.*{key}.*{message}"):
        car(tyre)


@pytest.mark.parametrize("state", ["fixed", "kinematic"])
def test_tyre_of_a_body_that_no_force_moves_is_refused(state: str) -> None:
    with pytest.raises(SceneError, match=r"tyre.*body"):
        car({}, **{state: True})


def test_pymunk_refuses_tyres_with_attraction_and_with_sleep() -> None:
    attracted = car({}, attraction=[{"toward": [5.0, 0.0], "strength": 1.0}])
    assert any("tyres" in reason for reason in ENGINES["pymunk"].missing(attracted, attracted.solver))
    asleep = car({}).solver.replace(sleeping=True)
    assert any("tyres" in reason for reason in ENGINES["pymunk"].missing(car({}), asleep))


@every_engine
def test_action_names_a_tyre_that_exists(engine: str) -> None:
    simulation = start_switchable(car({}), engine)
    with pytest.raises(ActionError, match="no tyre is named 'spare'"):
        simulation.apply(Steer(time=0.0, tyre="spare"))


@every_engine
def test_event_steers(engine: str) -> None:
    event = {"kind": "steer", "time": 0.5, "tyre": "tyre 0", "throttle": 1.0}
    result = run(car({"drive": 4.0}, event=[event]), engine)
    assert result.velocity[-1, 0, 0] == pytest.approx(0.5 * 4.0 / M, abs=2.5e-3)  # the event is a step early or late


def test_event_that_names_no_tyre_is_refused() -> None:
    with pytest.raises(SceneError, match="no tyre is named 'spare'"):
        car({}, event=[{"kind": "steer", "time": 0.0, "tyre": "spare"}])


@every_engine
def test_levels_survive_a_switch_to_any_engine_and_a_checkpoint(engine: str) -> None:
    scene = bicycle({"steer": 0.5}, {"drive": 3.0}, velocity=[1.0, 0.0], dt=0.01)
    for other in WITH_TYRES:
        simulation = start_switchable(scene, engine)
        simulation.apply(Steer(time=0.0, tyre="tyre 0", steer=0.6))
        simulation.apply(Steer(time=0.0, tyre="tyre 1", throttle=0.8))
        advance(simulation, 50)
        simulation.apply(Switch(time=simulation.time, engine=other))
        resumed = SwitchableSimulation.resumed(simulation.checkpoint())
        ends = [advance(each, 50).frame() for each in (simulation, resumed)]
        speed = np.hypot(*ends[0].velocity[0])
        assert speed > 1.9 and ends[0].angular_velocity[0] > 0.3  # 2.4 N of 2 kg for 1 s, on a circle
        assert ends[1].velocity == pytest.approx(ends[0].velocity, abs=1e-5)  # 32-bit numbers of box2d


def test_reference_returns_to_a_snapshot_bit_for_bit() -> None:
    simulation = start_switchable(bicycle({"steer": 0.5}, {"drive": 3.0}, velocity=[1.0, 0.5]), "reference")
    simulation.apply(Steer(time=0.0, tyre="tyre 0", steer=0.6))
    simulation.apply(Steer(time=0.0, tyre="tyre 1", throttle=0.8))
    snapshot = advance(simulation, 20).snapshot()
    first = advance(simulation, 50).state_hash()
    simulation.apply(Steer(time=simulation.time, tyre="tyre 1", brake=1.0))
    simulation.restore(snapshot)
    assert advance(simulation, 50).state_hash() == first


@every_engine
def test_car_that_was_moved_and_pushed_stops_and_one_that_left_has_no_tyres(engine: str) -> None:
    simulation = start_switchable(car({"rolling_drag": GRIP}, ball=[{"position": [9, 9], "radius": 1.0}]), engine)
    simulation.apply(Move(time=0.0, body="car", position=(5.0, 0.0)))
    simulation.apply(SetParameter(time=0.0, path="world.linear_drag", value=0.5))
    simulation.apply(Force(time=0.0, body="car", force=(2.0 * GRIP, 0.0)))
    assert advance(simulation, 100).frame().velocity[1, 0] > 0.3  # half of 4 m/s² for 0.1 s
    simulation.apply(Force(time=simulation.time, body="car", force=(0.0, 0.0)))
    stopped = advance(simulation, 300).frame().velocity
    simulation.apply(Remove(time=simulation.time, body="car"))
    advance(simulation, 10)
    assert np.abs(stopped).max() < 1e-6  # 32-bit numbers of box2d


# Measures


def test_no_closed_form_ignores_tyres_and_checks_know_them() -> None:
    scene = car({"drive": 1.0, "keys": True}, velocity=[0.0, 3.0])
    free = car(velocity=[0.0, 3.0])
    assert closed_form(run(scene, "pymunk"), scene, 0) is None
    assert closed_form(run(free, "pymunk"), free, 0) is not None
    assert not conserves_energy(scene)
    assert momentum_drift(run(scene, "pymunk"), scene) is None
    assert "tyres on keys" in unknown_speeds(scene)
