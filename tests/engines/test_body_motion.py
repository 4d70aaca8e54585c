"""How single bodies move: gravity scale, damping, and limits of speed and angular speed."""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.action import ActionError, Force, Remove, SetParameter, Spawn, Switch
from sandbox.engines.contract import Refusal
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.engines.switching import start as start_switchable
from sandbox.measure.analytic.solve import solution
from sandbox.measure.metrics.invariants import momentum_drift
from sandbox.measure.preflight.speed_bound import top_speeds
from sandbox.measure.run.ensemble import ensemble
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from tests.accounts import closed_account

G = 9.81
ABLE = ["pymunk", "box2d", "reference"]
LEDGERS = ["pymunk", "reference"]
ORDERS = {"explicit_euler": 1, "semi_implicit_euler": 1, "velocity_verlet": 2, "leapfrog": 2, "rk4": 4}


def ball(name: str = "a", x: float = 0.0, y: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.1, "mass": 2.0, **more}


def scene_of(*balls: dict[str, Any], duration: float = 1.0, solver: dict[str, Any] | None = None, **more: Any) -> Scene:
    world = {"gravity": [0.0, -G], "duration": duration, **more.pop("world", {})}
    return from_document({"world": world, "solver": {"dt": 0.01, **(solver or {})}, "ball": [*balls], **more})


def rounding(engine: str) -> float:
    """Return the tolerance of sums of 100 steps: 32-bit numbers on box2d, else 64-bit ones."""
    return 1e-4 if engine == "box2d" else 1e-12


@pytest.mark.fail_slow(60)  # kernels are loaded on first use
@pytest.mark.parametrize("collides", ["all", "none"])
@pytest.mark.parametrize("engine", ABLE)
def test_gravity_accelerates_each_body_by_its_own_factor(engine: str, collides: str) -> None:
    scales = [1.0, 0.5, 0.0, -0.25, 3.0]
    balls = [ball(f"b{k}", x=float(k), gravity_scale=scale, collides=collides) for k, scale in enumerate(scales)]
    scene = scene_of(*balls)
    result = run(scene, engine)
    assert result.velocity[-1, :, 1] == pytest.approx([-scale * G for scale in scales], abs=rounding(engine))
    assert result.position[-1, 2].tolist() == pytest.approx([2.0, 0.0], abs=1e-12)  # nothing acts on it
    drift = momentum_drift(result, scene)
    assert drift is not None and abs(drift) < rounding(engine)


@pytest.mark.parametrize("engine", ABLE)
def test_gravity_of_a_zone_is_scaled_too(engine: str) -> None:
    zone = {"position": [0.0, 0.0], "radius": 50.0, "gravity": [2.0, 0.0]}
    result = run(
        scene_of(ball(gravity_scale=0.5), ball("b", x=3.0), ball("c", x=100.0, gravity_scale=0.5), zone=[zone]), engine
    )
    expected = [[1.0, 0.0], [2.0, 0.0], [0.0, -0.5 * G]]
    assert result.velocity[-1] == pytest.approx(np.asarray(expected), abs=rounding(engine))


@pytest.mark.parametrize("engine", ABLE)
def test_gravity_set_during_a_run_is_scaled(engine: str) -> None:
    simulation = start(scene_of(ball(gravity_scale=0.5), ball("b", x=1.0, collides="none", gravity_scale=-2.0)), engine)
    simulation.apply(SetParameter(time=0.0, path="world.gravity", value=[1.0, 0.0]))
    for _ in range(100):
        simulation.step()
    assert simulation.frame().velocity == pytest.approx(np.asarray([[0.5, 0.0], [-2.0, 0.0]]), abs=rounding(engine))


@pytest.mark.parametrize("engine", ABLE)
def test_a_weightless_ball_stays_on_the_floor_and_a_heavy_one_stays_above_it(engine: str) -> None:
    floor = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}
    balls = ball(y=0.1, gravity_scale=0.0), ball("b", x=1.0, y=0.1, gravity_scale=4.0)
    result = run(scene_of(*balls, plane=[floor]), engine)
    assert result.position[-1, 0, 1] == pytest.approx(0.1, abs=1e-6)  # 32-bit numbers on box2d
    assert result.position[-1, 1, 1] == pytest.approx(0.1, abs=0.012)  # slop of a tenth of the radius, and a tenth more
    assert np.abs(result.velocity[-1]).max() < 0.01  # m/s, of the correction of the overlap


@pytest.mark.parametrize("collides", ["all", "none"])
@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize("wind", [0.0, 1.5])
def test_velocity_decays_exponentially(engine: str, collides: str, wind: float) -> None:
    """v̇ = −λ v − k (v − w) tends to k w/(λ + k), and ω decays alone."""
    drag = 0.3 if wind else 0.0
    solver = {"integrator": "rk4"} if engine == "reference" else {}
    thing = ball(velocity=[3.0, -1.0], angular_velocity=5.0, gravity_scale=0.0, linear_damping=2.0, angular_damping=0.5)
    world = {"wind": [wind, 0.0], "linear_drag": drag}
    result = run(scene_of({**thing, "collides": collides}, solver=solver, world=world), engine)
    rate = 2.0 + drag
    end = np.asarray([drag * wind / rate, 0.0])
    error = 1e-8 if engine == "reference" else 1e-12  # (λh)⁵/120 of the velocity a step; exact but for rounding
    assert result.velocity[-1, 0] == pytest.approx(end + ([3.0, -1.0] - end) * math.exp(-rate), abs=error)
    assert result.angular_velocity[-1, 0] == pytest.approx(5.0 * math.exp(-0.5), abs=error)


def test_box2d_divides_by_one_plus_the_rate_times_the_step() -> None:
    thing = ball(velocity=[3.0, 0.0], angular_velocity=5.0, gravity_scale=0.0, linear_damping=2.0, angular_damping=0.5)
    result = run(scene_of(thing), "box2d")
    assert result.velocity[-1, 0, 0] == pytest.approx(3.0 / 1.02**100, rel=1e-5)  # 32-bit numbers
    assert result.angular_velocity[-1, 0] == pytest.approx(5.0 / 1.005**100, rel=1e-5)  # likewise


@pytest.mark.parametrize("integrator", ORDERS)
def test_reference_damps_at_the_order_of_its_integrator(integrator: str) -> None:
    errors = []
    for dt in (0.02, 0.01):
        solver = {"integrator": integrator, "dt": dt}
        thing = ball(velocity=[3.0, 0.0], linear_damping=2.0, gravity_scale=0.5)
        result = run(scene_of(thing, solver=solver), "reference")
        fallen = -0.5 * G / 2.0 * (1.0 - (1.0 - math.exp(-2.0)) / 2.0)
        expected = 1.5 * (1.0 - math.exp(-2.0)), fallen
        errors.append(float(np.hypot(*(result.position[-1, 0] - expected))))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(ORDERS[integrator], abs=0.2)  # of a fit to two steps


@pytest.mark.parametrize("collides", ["all", "none"])
def test_pymunk_damps_a_spin_with_a_constant_torque_to_the_torque_over_the_rate(collides: str) -> None:
    simulation = start(scene_of(ball(angular_damping=4.0, gravity_scale=0.0, collides=collides)), "pymunk")
    simulation.apply(Force(time=0.0, body="a", force=(0.0, 0.0), torque=0.2))
    for _ in range(100):
        simulation.step()
    moment = 0.5 * 2.0 * 0.1**2
    end = 0.2 / moment / 4.0
    assert simulation.frame().angular_velocity[0] == pytest.approx(end * (1.0 - math.exp(-4.0)), rel=1e-12)  # exact


@pytest.mark.parametrize("engine", ABLE)
def test_a_falling_body_keeps_its_largest_speed(engine: str) -> None:
    result = run(scene_of(ball(max_speed=2.0), ball("b", x=1.0)), engine)
    speed = np.hypot(result.velocity[:, 0, 0], result.velocity[:, 0, 1])
    assert speed.max() <= 2.0 + 1e-6  # 32-bit numbers on box2d
    assert speed[-1] == pytest.approx(2.0, abs=1e-6)  # likewise
    assert result.velocity[-1, 1, 1] == pytest.approx(-G, abs=rounding(engine))  # unlimited
    fallen = 2.0 * (1.0 - 2.0 / G) + 2.0**2 / (2.0 * G)
    assert result.position[-1, 0, 1] == pytest.approx(-fallen, abs=2.0 * 0.01)  # v·h, of first order


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "velocity_verlet", "rk4"])
def test_positions_follow_the_limit_within_the_step_on_reference(integrator: str) -> None:
    """Once the speed is at its limit, every step covers v·h, though gravity adds to the speed within it."""
    result = run(scene_of(ball(max_speed=2.0), solver={"integrator": integrator}), "reference")
    steps = np.diff(result.position[50:, 0, 1])
    assert steps == pytest.approx(np.full(len(steps), -0.02), abs=1e-12)  # rounding


@pytest.mark.parametrize("engine", ABLE)
def test_spin_is_limited(engine: str) -> None:
    simulation = start(scene_of(ball(max_angular_velocity=3.0, angular_velocity=-9.0), ball("b", x=1.0)), engine)
    simulation.step()
    assert simulation.frame().angular_velocity[0] == pytest.approx(-3.0, abs=1e-6)  # 32-bit numbers on box2d
    simulation.apply(Force(time=0.0, body="a", force=(0.0, 0.0), torque=1.0))
    for _ in range(50):
        simulation.step()
    assert simulation.frame().angular_velocity[0] == pytest.approx(3.0, abs=1e-6)  # likewise


@pytest.mark.parametrize("engine", ABLE)
def test_a_spawned_body_has_its_own_motion(engine: str) -> None:
    simulation = start(scene_of(ball()), engine)
    for k, more in enumerate(({"gravity_scale": 0.5}, {"max_speed": 2.0}, {"linear_damping": 3.0})):
        simulation.apply(Spawn(time=0.0, ball=Ball(**ball(f"new{k}", x=1.0 + k, **more))))
    for _ in range(100):
        simulation.step()
    found = simulation.frame().velocity[:, 1]
    damped = G / 3.0 * (1.0 - math.exp(-3.0))
    assert found == pytest.approx([-G, -0.5 * G, -2.0, -damped], abs=0.01 * G)  # first order of box2d and Euler


@pytest.mark.parametrize("engine", ABLE)
def test_other_bodies_are_free_again_after_the_removal_of_those_with_a_motion_of_their_own(engine: str) -> None:
    thing = ball("b", x=1.0, gravity_scale=0.5, max_speed=1.0, linear_damping=1.0)
    simulation = start(scene_of(ball(), thing), engine)
    simulation.step()
    simulation.apply(Remove(time=0.0, body="b"))
    for _ in range(99):
        simulation.step()
    assert simulation.frame().velocity[0, 1] == pytest.approx(-G, abs=rounding(engine))


ALL_KEYS = {"gravity_scale": 0.5, "linear_damping": 0.2, "angular_damping": 0.4, "max_speed": 3.0}
GENERATORS = {
    "grid": {"origin": [0.0, 5.0], "columns": 2, "rows": 2, "spacing": [1.0, 1.0], "radius": 0.1},
    "scatter": {"lower": [0.0, 0.0], "upper": [5.0, 5.0], "count": 3, "radius": 0.1},
    "emitter": {"position": [0.0, 0.0], "count": 3, "velocity_min": [0.0, 0.0], "velocity_max": [1.0, 1.0]},
    "stack": {"base": [0.0, 0.0], "size": [1.0, 1.0], "columns": 1, "rows": 2},
    "rope": {"start": [0.0, 0.0], "end": [1.0, 0.0], "links": 3},
    "cloth": {"corner": [0.0, 0.0], "columns": 3, "rows": 2, "spacing": [0.5, 0.5], "stiffness": 50.0},
    "ragdoll": {"position": [0.0, 0.0]},
}


@pytest.mark.parametrize("kind", GENERATORS)
def test_generators_pass_the_keys_on_to_their_bodies(kind: str) -> None:
    bodies = from_document({kind: [{**GENERATORS[kind], **ALL_KEYS, "max_angular_velocity": 7.0}]}).bodies
    movable = ~bodies.immovable
    for key, value in {**ALL_KEYS, "max_angular_velocity": 7.0}.items():
        assert (getattr(bodies, key)[movable] == value).all(), key
    assert (bodies.gravity_scale[~movable] == 1.0).all()  # nothing acts on fixed nodes


@pytest.mark.parametrize("engine", LEDGERS)
@pytest.mark.parametrize("collides", ["all", "none"])
@pytest.mark.parametrize(
    ("more", "cause"),
    [
        ({"gravity_scale": 0.5}, Cause.RESTITUTION),
        ({"gravity_scale": -0.5}, Cause.RESTITUTION),
        ({"linear_damping": 1.0, "angular_damping": 3.0, "gravity_scale": 2.0}, Cause.DRAG),
        ({"max_speed": 1.5, "max_angular_velocity": 2.0}, Cause.SPEED_LIMITS),
    ],
)
def test_the_account_of_energy_balances(engine: str, collides: str, more: dict[str, Any], cause: Cause) -> None:
    things = (
        ball(y=0.5, velocity=[1.0, 0.0], angular_velocity=4.0, restitution=0.5, friction=0.5),
        ball("b", y=0.9, x=0.05),
    )
    walls = [{"points": [[-9.0, 0.0], [9.0, 0.0]], "friction": 0.5}, {"points": [[-9.0, 2.0], [9.0, 2.0]]}]
    scene = scene_of(*({**thing, **more, "collides": collides} for thing in things), wall=walls)
    account = closed_account(scene, 80, engine=engine, closes=1e-12)
    if cause is Cause.RESTITUTION:
        assert (account[cause] < 0.0) is (collides == "all")
    else:
        assert account[cause] < 0.0


METHODS: list[dict[str, Any]] = [
    {"response": "penalty"}, {"detection": "bisect"}, {"detection": "swept"}, {"detection": "shrink"},
    {"impact": "dissipative"}, {"integrator": "velocity_verlet"}, {"integrator": "rk4"},
]  # fmt: skip


@pytest.mark.fail_slow(60)  # 400 steps with an account, and as many without
@pytest.mark.parametrize("method", METHODS, ids=lambda method: next(iter(method.values())))
@pytest.mark.parametrize("key", ["gravity_scale", "linear_damping", "angular_damping", "max_speed"])
def test_the_account_balances_with_every_method_of_reference(method: dict[str, Any], key: str) -> None:
    floor = {"point": [0.0, 0.0], "normal": [0.0, 1.0], "restitution": 0.5, "friction": 0.4}
    own = {key: 1.5, "restitution": 0.5}
    things = ball(y=0.6, velocity=[1.0, 0.0], angular_velocity=3.0, **own), ball("b", x=0.1, y=1.0, **own)
    scene = scene_of(*things, plane=[floor], solver={"dt": 0.002, **method})
    account = closed_account(scene, 400, engine="reference", closes=1e-12)
    causes = {"linear_damping": Cause.DRAG, "angular_damping": Cause.DRAG, "max_speed": Cause.SPEED_LIMITS}
    assert account[causes.get(key, Cause.RESTITUTION)] < 0.0


@pytest.mark.parametrize("engine", ["pymunk", "box2d"])
def test_bodies_with_scaled_gravity_fall_asleep_and_wake(engine: str) -> None:
    """On pymunk a body that is asleep has no contacts in the log; a new one that falls onto it wakes it."""
    floor = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}
    solver = {"sleeping": True}
    scene = scene_of(ball(y=0.1, gravity_scale=2.0), duration=4.0, plane=[floor], solver=solver)
    simulation = start(scene, engine)
    for _ in range(200):
        simulation.step()
    at_rest = simulation.frame().position[0].copy()
    if engine == "pymunk":
        simulation.contacts()
        simulation.step()
        assert not len(simulation.contacts())
    simulation.apply(Spawn(time=0.0, ball=Ball(**ball("new", x=0.05, y=1.0, gravity_scale=0.5))))
    for _ in range(100):
        simulation.step()
    frame = simulation.frame()
    assert np.hypot(*(frame.position[0] - at_rest)) > 0.01  # pushed aside
    assert frame.velocity[1, 1] > -0.5 * G  # it has been stopped


def test_pymunk_accounts_for_sleeping_bodies_with_scaled_gravity() -> None:
    floor = {"point": [0.0, 0.0], "normal": [0.0, 1.0], "restitution": 0.3}
    things = ball(y=0.5, gravity_scale=2.0), ball("b", x=1.0, y=0.3, gravity_scale=0.5), ball("c", x=2.0, y=0.3)
    scene = scene_of(*things, plane=[floor], solver={"sleeping": True, "sleep_time": 0.2})
    account = closed_account(scene, 300, engine="pymunk", closes=1e-12)
    assert account[Cause.RESTITUTION] < 0.0


@pytest.mark.parametrize("engine", LEDGERS)
def test_the_account_balances_with_springs_and_rods_on_limited_bodies(engine: str) -> None:
    joints = [
        {"kind": "rod", "between": ["a"], "anchors": [[0.0, 1.0], [0.0, 0.0]]},
        {"kind": "spring", "between": ["a", "b"], "stiffness": 40.0, "damping": 0.3},
    ]
    own = {"gravity_scale": 1.5, "max_speed": 0.8, "linear_damping": 0.3}
    scene = scene_of(ball(x=1.0, y=1.0, **own), ball("b", x=1.5, y=1.0, **own), joint=joints)
    account = closed_account(scene, 100, engine=engine, closes=1e-12)
    assert account[Cause.SPEED_LIMITS] < 0.0
    assert account[Cause.DRAG] < 0.0


def test_reference_continues_from_a_snapshot_bit_for_bit() -> None:
    things = ball(y=0.5, **ALL_KEYS, velocity=[2.0, 0.0]), ball("b", x=0.3, y=0.7, **ALL_KEYS)
    simulation = start(scene_of(*things, plane=[{"point": [0.0, 0.0], "normal": [0.0, 1.0]}]), "reference")
    for _ in range(20):
        simulation.step()
    kept = simulation.snapshot()
    ends = []
    for _ in range(2):
        for _ in range(50):
            simulation.step()
        ends.append(simulation.state_hash())
        simulation.restore(kept)
    assert ends[0] == ends[1]


@pytest.mark.fail_slow(60)  # several runs on each engine
@pytest.mark.parametrize("engine", ABLE)
def test_ensembles_have_the_keys(engine: str) -> None:
    """Compiled steps and batches of worlds either have them or are not taken."""
    floor = {"point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 0.5}
    for more in ({"gravity_scale": 0.5}, {"max_speed": 1.0}, {"linear_damping": 1.0}, {"rolling_resistance": 0.1}):
        thing = ball(y=0.4, velocity=[2.0, 0.0], **more)
        scene = scene_of(thing, duration=0.5, plane=[floor])
        many = ensemble(scene, 2, engine=engine, vary={"ball.a.velocity": 0.0})
        assert (many.position == run(scene, engine).position[-1]).all(), more


def test_the_keys_hold_after_a_change_of_the_engine() -> None:
    simulation = start_switchable(scene_of(ball(gravity_scale=0.5), ball("b", x=1.0, max_speed=2.0)), "reference")
    for engine in ("pymunk", "box2d", "reference"):
        for _ in range(20):
            simulation.step()
        simulation.apply(Switch(time=0.2, engine=engine))
    for _ in range(40):
        simulation.step()
    velocity = simulation.frame().velocity[:, 1]
    assert velocity == pytest.approx([-0.5 * G, -2.0], abs=1e-4)  # of 32-bit numbers in between


@pytest.mark.parametrize("key", ["gravity_scale", "linear_damping", "max_speed"])
def test_exact_and_surfaces_refuse_the_keys_by_name(key: str) -> None:
    name = {"gravity_scale": "gravity_scale", "linear_damping": "damping of bodies", "max_speed": "speed limits"}[key]
    with pytest.raises(Refusal, match=name):
        start(scene_of(ball(**{key: 0.5})), "exact")
    with pytest.raises(ActionError, match=name):
        start(scene_of(ball()), "exact").apply(Spawn(time=0.0, ball=Ball(**ball("new", x=5.0, **{key: 0.5}))))
    table = {"world": {"gravity": [0.0, 0.0]}, "surface": {"sliding_friction": 0.2}}
    for engine in LEDGERS:
        with pytest.raises(Refusal, match=name):
            start(scene_of(ball(**{key: 0.5}), **table), engine)


def test_pymunk_refuses_what_it_does_not_combine_by_name() -> None:
    for key, solver in (("gravity_scale", "half_kick"), ("max_speed", "half_kick"), ("linear_damping", "half_kick")):
        with pytest.raises(Refusal, match="half_kick does not support"):
            start(scene_of(ball(**{key: 0.5}), solver={solver: True}), "pymunk")
    with pytest.raises(Refusal, match="sleeping does not support damping of bodies"):
        start(scene_of(ball(linear_damping=0.5), solver={"sleeping": True}), "pymunk")
    with pytest.raises(Refusal, match="it does not model damping of bodies and damping together"):
        start(scene_of(ball(linear_damping=0.5), world={"damping": 0.9}), "pymunk")


@pytest.mark.parametrize("owner", ["fixed", "kinematic"])
@pytest.mark.parametrize("key", [*ALL_KEYS, "max_angular_velocity"])
def test_keys_without_effect_are_faults(owner: str, key: str) -> None:
    with pytest.raises(SceneError, match=f"ball.a.{key}: has no effect on a {owner} body"):
        scene_of(ball(**{key: 0.5, owner: True}))


@pytest.mark.parametrize(
    ("key", "value"),
    [("linear_damping", -1.0), ("max_speed", 0.0), ("max_angular_velocity", -1.0), ("gravity_scale", 1e9)],
)
def test_values_out_of_range_are_faults(key: str, value: float) -> None:
    with pytest.raises(SceneError, match=f"ball.a.{key}"):
        scene_of(ball(**{key: value}))


def test_forecasts_of_speeds_use_the_keys() -> None:
    floor = {"point": [0.0, -2.0], "normal": [0.0, 1.0]}
    things = (
        ball(),
        ball("heavy", x=1.0, gravity_scale=4.0),
        ball("slow", x=2.0, max_speed=1.0),
        ball("rising", x=3.0, gravity_scale=-1.0),
        ball("damped", x=4.0, linear_damping=5.0),
    )
    scene = scene_of(*({**each, "collides": "fixed"} for each in things), plane=[floor])
    speeds = top_speeds(scene, contact_matrix(scene))
    fall = math.sqrt(2.0 * G * 1.9)
    assert speeds == pytest.approx([fall, 2.0 * fall, 1.0, G, G / 5.0])
    assert (np.abs(run(scene, "reference").velocity[:, :, 1]).max(axis=0) <= speeds + G * 0.01).all()  # one step


@pytest.mark.parametrize("key", ["gravity_scale", "linear_damping", "max_speed"])
def test_no_formula_is_claimed_for_a_body_with_a_motion_of_its_own(key: str) -> None:
    assert solution(scene_of(ball())) is not None
    assert solution(scene_of(ball(**{key: 0.5}))) is None
