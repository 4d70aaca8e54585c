"""Bodies on paths, on every engine: they are where their path is, and carry, lift and push other bodies."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Force, Impulse, Move, Remove, Spawn, Switch
from sandbox.arrays import FloatArray
from sandbox.engines.contract import Refusal
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import ENGINES
from sandbox.engines.registry import start as start_plain
from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.preflight.speed_bound import SpeedBounds
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import Demand
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads
from sandbox.trajectory import Trajectory
from tests.accounts import closed_account
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # runs of some seconds of simulated time, and compilation

WITH_PATHS = [name for name, engine in ENGINES.items() if Demand.PATHS in engine.capabilities]
every_engine = pytest.mark.parametrize("engine", WITH_PATHS)

G = 9.81
FRICTION = 0.4

ON_PATH = 1e-12
"""relative: rounding of the time, k·dt, and of the pose"""


def platform(path: dict[str, Any], **more: Any) -> dict[str, Any]:
    box = {"name": "platform", "position": [0.0, 0.0], "size": [8.0, 0.2], "kinematic": True, "friction": 1.0}
    return {**box, **more, "path": path}


def passenger(**more: Any) -> dict[str, Any]:
    box = {"name": "passenger", "position": [0.0, 0.15], "size": [0.4, 0.1], "friction": FRICTION, "mass": 2.0}
    return {**box, **more}


def scene_of(*boxes: dict[str, Any], duration: float = 2.0, dt: float = 1 / 240, **tables: Any) -> Scene:
    solver = {"dt": dt, **tables.pop("solver", {})}
    world = {"duration": duration, "gravity": [0.0, -G]}
    return from_document({"world": world, "solver": solver, "box": list(boxes), **tables})


def poses(scene: Scene, times: FloatArray, body: int = 0) -> FloatArray:
    """Return the poses (T, 3) of a body on its path."""
    motion = scene.bodies.paths[body]
    return np.asarray([motion.pose(time) for time in times.tolist()])


def follows_path(run: Trajectory, scene: Scene, body: int = 0) -> None:
    """Assert that a body is on its path in every frame."""
    expected = poses(scene, run.time, body)
    got = np.column_stack((run.position[:, body], run.angle[:, body]))
    assert np.abs(got - expected).max() <= ON_PATH * max(1.0, np.abs(expected).max())


PATHS: dict[str, dict[str, Any]] = {
    "there and back": {"points": [[0, 0], [4, 1]], "speed": 3.0},
    "smooth": {"points": [[0, 0], [4, 1]], "period": 1.7, "easing": "smooth", "start": -0.4},
    "loop": {"points": [[0, 0], [1, 0], [1, 1], [0, 1]], "period": 1.1, "repeat": "loop"},
    "once": {"points": [[0, 0], [1, 0], [1, 1]], "speed": 2.0, "repeat": "once", "start": 0.21},
    "lift": {"points": [[0, 0], [0, 1], [0, 2]], "speed": 4.0, "pause": 0.13, "easing": "smooth"},
    "door": {"angles": [0.0, 1.5], "pivot": [-4.0, 0.0], "period": 0.9, "pause": 0.1},
    "tilt": {"points": [[0, 0], [1, 0], [2, 0]], "angles": [0.0, -0.5, 0.5], "period": 1.3, "easing": "smooth"},
}


@every_engine
@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("substeps", [1, 3])
def test_body_is_on_its_path_after_every_step_whatever_is_in_the_way(engine: str, name: str, substeps: int) -> None:
    """Boxes on it, a fixed box and a plane do not change its motion; a frame has the velocity of the last substep."""
    block = {"position": [3.0, 1.0], "size": [0.5, 0.5], "fixed": True}
    plane = {"point": [0.0, -0.2], "normal": [0.0, 1.0]}
    others = [passenger(), passenger(name="b", position=[1.0, 1.0]), block]
    solver = {"substeps": substeps}
    scene = scene_of(platform(PATHS[name]), *others, plane=[plane], solver=solver, dt=1 / 60, duration=3.0)
    run = sandbox.run(scene, engine)
    assert run.status == "ok"
    follows_path(run, scene)
    h = 1 / 60 / substeps
    expected = (poses(scene, run.time[1:]) - poses(scene, run.time[1:] - h)) / h
    rate = np.column_stack((run.velocity[1:, 0], run.angular_velocity[1:, 0]))
    assert rate == pytest.approx(expected, abs=1e-11)  # rounding of the poses over h


@every_engine
def test_body_is_on_its_path_after_many_steps(engine: str) -> None:
    """No error grows: the pose follows from the time and not from the last one."""
    scene = scene_of(platform(PATHS["smooth"]), duration=200.0, dt=0.01)
    follows_path(sandbox.run(scene, engine, record_every=1000), scene)


@every_engine
def test_box_on_a_platform_that_starts_suddenly_slips_and_is_then_carried(engine: str) -> None:
    """Friction gives it the speed v in v / (μ g); it lags by v² / (2 μ g)."""
    v, h = 1.0, 1 / 960
    scene = scene_of(platform({"points": [[0, 0], [6, 0]], "speed": v, "start": 0.5}), passenger(), dt=h)
    run = sandbox.run(scene, engine, record_every=8)
    lag = run.position[:, 0, 0] - run.position[:, 1, 0]
    assert lag[-1] == pytest.approx(v * v / (2.0 * FRICTION * G), abs=0.6 * v * h)  # h/2 of the first step, of order 1
    assert run.velocity[-1, 1, 0] == pytest.approx(v, abs=1e-5)  # 32-bit rounding of Box2D, and residual slip
    after = run.time > 0.5 + v / (FRICTION * G) + 0.05
    assert np.ptp(lag[after]) < 1e-4  # carried; residual slip of iterated friction
    assert np.abs(lag[run.time < 0.5]).max() < 2e-5  # Box2D's soft contact settles


@every_engine
def test_box_on_a_smooth_platform_does_not_slip_below_the_acceleration_of_friction(engine: str) -> None:
    """The largest acceleration is 10/√3 L/T²: at 0.9 μ g it is carried all the way, at 1.5 μ g it slips for good."""
    length, h = 1.5, 1 / 960
    for fraction in (0.9, 1.5):
        duration = math.sqrt(10.0 / math.sqrt(3.0) * length / (fraction * FRICTION * G))
        path = {"points": [[0, 0], [length, 0]], "period": duration, "repeat": "once", "easing": "smooth"}
        run = sandbox.run(scene_of(platform(path), passenger(), duration=duration, dt=h), engine, record_every=8)
        slip = np.abs(run.position[:, 1, 0] - run.position[:, 0, 0])
        fastest = 15.0 / 8.0 * length / duration
        if fraction < 1.0:
            # A scheme that moves bodies by their old velocities lets it lag by a substep, v h, while the speed is v.
            assert slip.max() < 1.1 * fastest * h and slip[-1] < 2e-5
        else:
            assert slip.max() > 0.01


@pytest.mark.parametrize("engine", [name for name in WITH_PATHS if ENGINES[name].knows_impulses])
def test_lift_that_accelerates_pushes_with_the_force_of_weight_and_inertia(engine: str) -> None:
    """While it speeds up, the impulse of its contacts in a step is m (g Δt + Δv), v the velocity of the lift.

    While it slows down, the passenger, which a scheme of old velocities moves a h² too far, hops; the sum is the same.
    """
    height, duration = 2.0, 1.5
    path = {"points": [[0, 0], [0, height]], "period": duration, "repeat": "once", "easing": "smooth"}
    simulation = sandbox.start(scene_of(platform(path), passenger()), engine)
    advance(simulation, 1)
    simulation.contacts()
    dt, impulses, speeds = simulation.settings.dt, [], [float(simulation.frame().velocity[0, 1])]
    for _ in range(round((duration + 0.2) / dt)):
        simulation.step()
        impulses.append(float(simulation.contacts().impulse[:, 1].sum()))
        speeds.append(float(simulation.frame().velocity[0, 1]))
    simulation.close()
    expected = 2.0 * (G * dt + np.diff(speeds))
    rising = round(0.5 * duration / dt)
    assert max(expected) > 2.0 * (G + 5.0) * dt and min(expected) < 2.0 * (G - 5.0) * dt
    assert np.abs(impulses[:rising]) == pytest.approx(expected[:rising], rel=1e-6)  # residue of the iterations
    assert np.abs(impulses).sum() == pytest.approx(expected.sum(), rel=1e-4)  # likewise, at rest at the end


@every_engine
def test_door_pushes_a_ball_away(engine: str) -> None:
    """A door at ω hits a ball at rest at a distance r from its hinge: without loss it leaves at 2 ω r."""
    omega, r = 1.0, 0.8
    path = {"angles": [0.0, 2.0], "pivot": [-0.5, 0.0], "period": 4.0 / omega}
    door = platform(path, size=[1.0, 0.02], friction=0.0, restitution=1.0)
    # the door arrives at π/2 on the line x = −0.5 with its face at 0.01 m; the ball touches it there
    ball = {"name": "ball", "position": [-0.5 - 0.01 - 0.05, r], "radius": 0.05, "restitution": 1.0, "friction": 0.0}
    scene = from_document(
        {"world": {"duration": 2.0}, "solver": {"dt": 1 / 2000}, "box": [door], "ball": [{**ball, "collides": "all"}]}
    )
    run = sandbox.run(scene, engine, record_every=20)
    speed = math.hypot(*run.velocity[-1, 0])
    assert speed == pytest.approx(2.0 * omega * r, rel=0.01)  # it is hit up to v h early, at another angle


@pytest.mark.parametrize(
    ("engine", "sleeping"), [*((each, False) for each in WITH_PATHS), *((each, True) for each in ("pymunk", "box2d"))]
)
def test_platform_takes_along_a_stack_that_has_come_to_rest_on_it(engine: str, sleeping: bool) -> None:
    """Bodies that could sleep during a long pause wake when the platform starts."""
    path = {"points": [[0, 0], [2, 0]], "period": 4.0, "repeat": "once", "easing": "smooth", "start": 3.0}
    stack = [passenger(), passenger(name="upper", position=[0.0, 0.25])]
    scene = scene_of(platform(path), *stack, duration=8.0, solver={"sleeping": True} if sleeping else {})
    run = sandbox.run(scene, engine)
    follows_path(run, scene)
    assert run.position[-1, 1:, 0] == pytest.approx([2.0, 2.0], abs=2e-3)  # residual slip of iterated friction


@every_engine
def test_engine_can_be_exchanged_and_the_path_goes_on(engine: str) -> None:
    """The pose depends on the time of the session and not on that of a segment or engine."""
    scene = scene_of(platform(PATHS["tilt"]), passenger(), duration=4.0)
    simulation = sandbox.start(scene, engine)
    for other in (*WITH_PATHS, engine):
        advance(simulation, 37)
        simulation.apply(Switch(time=0.0, engine=other))
        advance(simulation, 23)
        frame = simulation.frame()
        expected = poses(scene, np.asarray([frame.time]))[0]
        assert [*frame.position[0], frame.angle[0]] == pytest.approx(expected, abs=ON_PATH)
    simulation.close()


@every_engine
def test_resumed_run_continues_on_the_path(engine: str) -> None:
    scene = scene_of(platform(PATHS["lift"]), passenger(position=[20.0, 0.0], collides="none"), duration=4.0)
    simulation = advance(sandbox.start(scene, engine), 100)
    assert isinstance(simulation, SwitchableSimulation)
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    for _ in range(150):
        simulation.step()
        resumed.step()
        a, b = simulation.frame(), resumed.frame()
        # the times of both differ by rounding
        assert b.position[0] == pytest.approx(a.position[0], abs=ON_PATH) and a.time == b.time
        assert b.velocity[0] == pytest.approx(a.velocity[0], abs=1e-10)  # that over h
    simulation.close()
    resumed.close()


def test_snapshot_of_reference_continues_bit_for_bit() -> None:
    scene = scene_of(platform(PATHS["tilt"]), passenger(), passenger(name="b", position=[0.5, 1.0]), duration=4.0)
    simulation = advance(sandbox.start(scene, "reference"), 50)
    snapshot = simulation.snapshot()
    first = advance(simulation, 100).state_hash()
    simulation.restore(snapshot)
    assert advance(simulation, 100).state_hash() == first


@every_engine
def test_shorter_last_step_ends_on_the_path(engine: str) -> None:
    scene = scene_of(platform(PATHS["smooth"]), passenger(), duration=1.003, dt=0.01)
    run = sandbox.run(scene, engine)
    assert run.time[-1] >= 1.003
    follows_path(run, scene)


@pytest.mark.parametrize(
    "settings",
    [
        {"response": "penalty", "damping": 1.0},
        {"detection": "shrink"},
        {"integrator": "rk4"},
        {"integrator": "velocity_verlet"},
        {"integrator": "semi_implicit_euler"},
    ],
)
def test_methods_of_reference_keep_a_body_on_its_path_and_carry_the_passenger(settings: dict[str, Any]) -> None:
    path = {"points": [[0, 0], [1, 0]], "period": 2.0, "repeat": "once", "easing": "smooth"}
    scene = scene_of(platform(path), passenger(), duration=2.5, solver=settings, dt=1 / 480)
    run = sandbox.run(scene, "reference")
    follows_path(run, scene)
    slip = np.abs(run.position[:, 1, 0] - run.position[:, 0, 0])
    # a substep of the largest speed; springs of penalty contacts creep, as friction is a damper below its limit
    assert slip.max() < (0.05 if "response" in settings else 1.1 * 15.0 / 8.0 / 2.0 / 480)


@pytest.mark.parametrize("engine", [name for name in WITH_PATHS if ENGINES[name].knows_impulses])
@pytest.mark.parametrize("name", ["lift", "tilt", "there and back"])
def test_energy_account_closes_and_books_the_work_of_a_lift_as_drives(engine: str, name: str) -> None:
    scene = scene_of(platform(PATHS[name]), passenger(), passenger(name="b", position=[0.5, 1.0]), duration=3.0)
    closed_account(scene, 400, engine=engine, closes=1e-11)  # hundreds of sums


@pytest.mark.parametrize("engine", [name for name in WITH_PATHS if ENGINES[name].knows_impulses])
def test_work_of_a_lift_is_the_gain_of_height(engine: str) -> None:
    """The lift of 1 kg and its passenger of 2 kg are at rest 3 m higher: their path did the work 3 m g."""
    path = {"points": [[0, 0], [0, 3]], "period": 2.0, "repeat": "once", "easing": "smooth"}
    scene = scene_of(platform(path, mass=1.0), passenger(), duration=3.0, dt=1 / 960)
    account = closed_account(scene, 960 * 5 // 2, engine=engine, closes=1e-11)
    assert account[Cause.DRIVES] == pytest.approx(3.0 * G * 3.0, rel=2e-3)  # of order 1 in h: v h / height


@every_engine
def test_actions_on_a_body_with_a_path_are_refused(engine: str) -> None:
    scene = scene_of(platform(PATHS["loop"]))
    simulation = start_plain(scene, engine)
    for action in (
        Move(time=0, body="platform", position=(1.0, 1.0)),
        Impulse(time=0, body="platform", impulse=(1.0, 0.0)),
        Force(time=0, body="platform", force=(1.0, 0.0)),
    ):
        with pytest.raises(ActionError, match="'platform' follows its path"):
            simulation.apply(action)
    other = Box.model_validate({**platform(PATHS["loop"], name="other"), "position": (0.0, 0.0), "size": (1.0, 1.0)})
    with pytest.raises(ActionError, match="'other' has a path"):
        simulation.apply(Spawn(time=0, box=other))
    simulation.apply(Remove(time=0, body="platform"))
    advance(simulation, 10)
    assert not simulation.frame().present[0]
    simulation.close()


def test_exact_refuses_paths_by_name() -> None:
    ball = {"position": [0, 0], "radius": 0.1, "kinematic": True, "path": {"points": [[0, 0], [1, 0]], "speed": 1}}
    with pytest.raises(Refusal, match="paths"):
        start_plain(from_document({"ball": [ball]}), "exact")


def test_speed_bound_is_that_of_the_fastest_point_and_other_speeds_are_unknown() -> None:
    """Of a smooth leg 15/8 of its mean; a door of 8 m about its end turns its far corner."""
    scene = scene_of(platform({"points": [[0, 0], [4, 0]], "period": 4.0, "easing": "smooth"}), passenger())
    speeds = SpeedBounds(scene, contact_matrix(scene))
    assert speeds.own[0] == pytest.approx(15.0 / 8.0 * 2.0) and speeds.unknown == ("kinematic bodies",)
    door = scene_of(platform({"angles": [0.0, 1.0], "pivot": [-4.0, 0.0], "period": 4.0}))
    own = SpeedBounds(door, contact_matrix(door)).own[0]
    corner = math.hypot(8.0, 0.1) * 0.5
    assert corner <= own < 1.01 * corner  # a bound: that of the centre and that about it


@pytest.mark.parametrize("word", ["waypoints", "patrol", "boundary_left", "change_x"])
def test_words_of_other_engines_are_refused_with_the_key(word: str) -> None:
    box = {"position": [0, 0], "size": [1, 1], "kinematic": True, word: 1}
    with pytest.raises(SceneError, match="moves along a `path`"):
        from_document({"box": [box]})


def test_words_of_other_engines_within_a_path_are_explained() -> None:
    path = {"points": [[0, 0], [1, 0]], "period": 2.0, "wait": 1.0}
    with pytest.raises(SceneError, match="did you mean 'pause'"):
        from_document({"box": [{"position": [0, 0], "size": [1, 1], "kinematic": True, "path": path}]})


def test_kinematic_bodies_on_paths_can_be_built_in_python_and_written_to_a_file() -> None:
    path = sandbox.BodyPath(points=[[0.0, 0.0], [4.0, 0.0]], period=4.0, easing="smooth")
    lift = sandbox.Box(name="lift", position=[0.0, 0.0], size=[2.0, 0.2], kinematic=True, path=path, one_way=[0.0, 1.0])
    scene = sandbox.Scene(boxes=[lift])
    assert loads(dumps(scene)) == scene
    assert scene.bodies.paths[0].pose(1.0).x == pytest.approx(2.0)


@pytest.mark.parametrize("engine", ["pymunk", "box2d"])  # reference has no joints to kinematic bodies
def test_trolley_carries_a_load_on_a_rod(engine: str) -> None:
    """The load swings by the formula of a pendulum whose support moves along x(t): L θ'' = −g sin θ − x'' cos θ."""
    path = {"points": [[0, 0], [2, 0]], "period": 3.0, "repeat": "once", "easing": "smooth"}
    trolley = platform(path, name="trolley", size=[0.4, 0.2], collides="none")
    ball = {"name": "load", "position": [0.0, -1.0], "radius": 0.1, "collides": "none"}
    rod = {"kind": "rod", "between": ["trolley", "load"], "anchors": [[0, 0], [0, 0]]}
    scene = scene_of(trolley, ball=[ball], joint=[rod], duration=3.0, dt=1 / 2000)
    run = sandbox.run(scene, engine, record_every=20)
    follows_path(run, scene, 1)
    arm = run.position[:, 0] - run.position[:, 1]
    assert np.hypot(*arm.T) == pytest.approx(1.0, abs=2e-3)  # of order 1: v h
    h, theta, rate = 1e-4, 0.0, 0.0  # leapfrog, whose error is of order h²
    motion = scene.bodies.paths[1]
    for k in range(round(3.0 / h)):
        x = [motion.pose(time).x for time in (k * h - 1e-3, k * h, k * h + 1e-3)]
        rate += h * (-G * math.sin(theta) - (x[0] - 2.0 * x[1] + x[2]) / 1e-6 * math.cos(theta))
        theta += h * rate
    assert math.atan2(arm[-1, 0], -arm[-1, 1]) == pytest.approx(theta, abs=0.01)  # of order 1 in the substep
    assert np.abs(np.arctan2(arm[:, 0], -arm[:, 1])).max() > 0.1
    if engine == "pymunk":
        closed_account(scene, 1000, engine=engine, closes=1e-11)  # hundreds of sums
