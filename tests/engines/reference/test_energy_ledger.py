"""Energy ledger of the reference engine: it closes, its entries follow the laws, and accounting changes no state."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sandbox.action import Action, Force, Impulse, Launch, Move, Pull, Remove, SetParameter, Spawn, Switch
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.switching import start
from sandbox.measure.metrics.energy import Ledger
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from tests.accounts import ledger
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

CLOSED = 1e-9  # the documented bound; measured: rounding of sums, 1e-11 at most
G = 9.81


def shipped(name: str, duration: float | None = None) -> Scene:
    scene = load(find(name))
    if duration is None:
        return scene
    return scene.model_copy(update={"world": scene.world.model_copy(update={"duration": duration})})


def floor(**more: Any) -> dict[str, Any]:
    return {"name": "floor", "point": [0, 0], "normal": [0, 1], "restitution": 1.0, "friction": 1.0, **more}


def ball(x: float = 0.0, y: float = 1.0, **more: Any) -> dict[str, Any]:
    return {"position": [x, y], "radius": 0.5, "mass": 2.0, "friction": 0.5, **more}


def scene_of(duration: float = 1.0, gravity: float = -G, world: dict[str, Any] | None = None, **rest: Any) -> Scene:
    about = {"gravity": [0, gravity], "duration": duration, **(world or {})}
    return from_document({"world": about, "solver": {"dt": 0.01, "integrator": "velocity_verlet"}, **rest})


def closed_ledger(scene: Scene, **settings: Any) -> Ledger:
    account = ledger(scene, "reference", **settings)
    assert account.closes_to < CLOSED
    return account


def pendulum(kind: str = "rod", **more: Any) -> Scene:
    bobs = [ball(1.0, 0.0, name="a", collides="none"), ball(2.0, 0.0, name="b", collides="none")]
    joints = [{"kind": kind, "between": ["a"], **more}, {"kind": "rod", "between": ["a", "b"]}]
    return scene_of(0.5, ball=bobs, joint=joints)


INTEGRATORS = ("explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4")
JOINTS = ("impulses", "relaxation", "xpbd", "rattle")
WIND = {"wind": [3.0, 1.0], "linear_drag": 0.3, "quadratic_drag": 0.1}

CLOSING_RUNS = [
    *(("tutorial/bounce", 1.3, {"dt": 0.01, "integrator": each}) for each in INTEGRATORS),
    *(("tutorial/bounce", 1.3, {"dt": 0.01, "detection": each}) for each in ("bisect", "swept", "shrink")),
    *(("benchmark/pile", 0.2, {"substeps": each}) for each in (1, 3)),
    ("benchmark/pile", 0.02, {"detection": "bisect", "integrator": "velocity_verlet"}),
    ("benchmark/pile", 0.1, {"response": "penalty"}),
    ("benchmark/incline", 0.5, {}),
    ("benchmark/box_slides", 0.1, {}),
    ("benchmark/pyramid", 0.2, {}),
    ("benchmark/kepler", 0.1, {}),
    ("benchmark/spring", 0.05, {}),
    ("joints/ragdoll_stairs", 0.2, {}),
    *(("joints/cloth", 0.05, {"joints": each}) for each in JOINTS),
    *(("joints/hanging_chain", 0.1, {"joints": each}) for each in JOINTS),
    ("particles/sparks", 0.3, {}),
]


@pytest.mark.parametrize(("name", "duration", "settings"), CLOSING_RUNS)
def test_entries_sum_to_the_energy_change(name: str, duration: float, settings: dict[str, Any]) -> None:
    account = closed_ledger(shipped(name, duration), **settings)
    assert np.abs(account.entries).max() > 0.0


@pytest.mark.parametrize("joints", JOINTS)
@pytest.mark.parametrize("kind", ["rod", "spring"])
def test_ledger_closes_for_every_joint_method(kind: str, joints: str) -> None:
    more = {"rest_length": 0.7, "stiffness": 300.0, "damping": 2.0} if kind == "spring" else {}
    account = closed_ledger(pendulum(kind, **more), joints=joints)
    assert account.of(Cause.DAMPING) < 0.0 if kind == "spring" else account.of(Cause.DAMPING) == 0.0


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_ledger_closes_with_wind_drag_and_thrust(integrator: str) -> None:
    thrust = {"body": "a", "point": [0.2, 0.1], "force": [5.0, 9.0], "begin": 0.1, "end": 0.4}
    scene = scene_of(0.6, world=WIND, ball=[ball(name="a", velocity=[1, 2])], plane=[floor()], thrust=[thrust])
    account = closed_ledger(scene, integrator=integrator)
    assert account.of(Cause.DRAG) != 0.0
    assert account.of(Cause.DRIVES) > 0.0


def test_ledger_closes_over_actions_engine_switches_spawns_and_removals() -> None:
    world = {"bounds": [[-20, -5], [4, 20]]}
    rain = {"name": "rain", "count": 3, "lower": [-3, 4], "upper": [-1, 6], "radius": 0.2}
    scene = scene_of(
        2.0,
        world=world,
        ball=[ball(name="a", restitution=0.6), ball(3.0, 3.0, name="b", velocity=[4, 0])],
        plane=[floor()],
        scatter=[rain],
    )
    actions: list[Action] = [
        Impulse(time=0.1, body="a", impulse=(1.0, 3.0), angular=0.2),
        Force(time=0.2, body="a", force=(2.0, 1.0), torque=0.3),
        Spawn(time=0.3, ball=Ball(position=(0.0, 5.0), radius=0.3, mass=1.0, restitution=0.5)),
        Move(time=0.4, body="a", position=(0.5, 2.0), velocity=(0.0, 1.0)),
        Pull(time=0.5, body="a", grip=(0.1, 0.0), target=(1.0, 3.0)),
        SetParameter(time=0.6, path="world.gravity", value=[0.5, -5.0]),
        Launch(time=0.7, generator="rain", seed=3),
        Switch(time=0.8, settings={"integrator": "semi_implicit_euler"}),
        Remove(time=0.9, body="a"),
    ]
    account = closed_ledger(scene, actions=actions)
    for cause in (Cause.ACTIONS, Cause.RETIRED, Cause.DRIVES):
        assert account.of(cause) != 0.0


def test_energy_of_a_body_that_leaves_the_bounds_is_booked_as_retired() -> None:
    scene = scene_of(1.0, 0.0, world={"bounds": [[-5, -5], [5, 5]]}, ball=[ball(4.9, 0.0, velocity=[3, 0])])
    assert closed_ledger(scene).of(Cause.RETIRED) == -9.0  # ½ m v²


def test_stored_energy_of_a_broken_spring_is_booked_as_parted() -> None:
    spring = {"kind": "spring", "between": ["a"], "anchors": [[0, 0], [0, 0]], "rest_length": 1.0}
    spring |= {"stiffness": 100.0, "strength": 50.0}
    account = closed_ledger(scene_of(0.1, 0.0, ball=[ball(2.0, 0.0, name="a")], joint=[spring]), dt=1e-3)
    # ½ k x² at x = 1 m; the force of 100 N exceeds the strength of 50 N, so it breaks in the first step.
    assert account.of(Cause.PARTED) == pytest.approx(-50.0, rel=1e-3)  # x has changed by ½·(k/m)·dt² in that step


@pytest.mark.parametrize("e", [0.0, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("detection", ["discrete", "swept", "bisect"])
def test_energy_loss_of_an_impact_follows_restitution(e: float, detection: str) -> None:
    two = [ball(0, 0, velocity=[3, 0], restitution=e), ball(2, 0, mass=1.0, restitution=e)]
    account = closed_ledger(scene_of(gravity=0.0, ball=two), detection=detection)
    mixed = e * e  # coefficients multiply
    reduced = 2.0 * 1.0 / 3.0
    loss = 0.5 * reduced * (1 - mixed**2) * 9.0
    assert account.of(Cause.RESTITUTION) == pytest.approx(-loss, rel=1e-13, abs=1e-13)  # rounding
    assert account.of(Cause.FRICTION) == account.of(Cause.INTEGRATOR) == account.of(Cause.CORRECTION) == 0.0
    assert abs(account.of(Cause.PHANTOM)) < 1e-14  # of 9 J: rounding


def test_an_elastic_gas_without_friction_has_no_entries() -> None:
    account = closed_ledger(shipped("benchmark/gas", 0.5))
    assert account.of(Cause.FRICTION) == 0.0
    assert np.abs(account.entries).max() < 1e-12 * account.scale  # each impact is elastic to rounding


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_an_elastic_ball_loses_nothing_to_restitution_under_gravity(integrator: str) -> None:
    account = closed_ledger(scene_of(2.0, ball=[ball(y=2.0, restitution=1.0)], plane=[floor()]), integrator=integrator)
    assert abs(account.of(Cause.RESTITUTION)) < 1e-12  # of 30 J
    assert account.of(Cause.PHANTOM) < 1e-12  # likewise
    exact = integrator in ("velocity_verlet", "leapfrog", "rk4")
    assert abs(account.of(Cause.INTEGRATOR)) < 1e-12 if exact else abs(account.of(Cause.INTEGRATOR)) > 1e-6


@pytest.mark.parametrize("integrator", ["explicit_euler", "semi_implicit_euler", "velocity_verlet"])
def test_resting_body_has_no_entries(integrator: str) -> None:
    """Gravity and the contact impulse of each step cancel and make no entry."""
    account = closed_ledger(scene_of(1.0, ball=[ball(y=0.5, restitution=0.0)], plane=[floor()]), integrator=integrator)
    # It sinks to its contact in the first steps. After that: rounding of ±9.6 mJ (½ m g² dt²) a step.
    assert np.abs(account.entries[-1] - account.entries[10]).max() < 1e-12


def test_friction_work_of_a_slide_is_mu_m_g_s() -> None:
    box = {"position": [0.0, 0.5], "size": [1, 1], "mass": 2.0, "friction": 0.5, "velocity": [5.0, 0.0]}
    scene = scene_of(0.5, box=[box], plane=[floor()])
    slid = run(scene, "reference").position[-1, 0, 0]
    # it sinks a little at first
    assert closed_ledger(scene).of(Cause.FRICTION) == pytest.approx(-0.5 * 2.0 * G * slid, rel=1e-6)
    stopped = closed_ledger(scene_of(2.0, box=[box], plane=[floor()]))
    assert stopped.of(Cause.FRICTION) == pytest.approx(-25.0, rel=1e-4)  # all of ½ m v²; likewise


def test_explicit_euler_gains_half_m_g2_h2_per_step() -> None:
    scene = scene_of(1.0, ball=[ball()])
    for n, h in ((100, 0.01), (500, 0.002)):
        account = closed_ledger(scene, integrator="explicit_euler", dt=h)
        assert account.of(Cause.INTEGRATOR) == pytest.approx(n * 0.5 * 2.0 * G**2 * h**2, rel=1e-10)  # sums round
        opposite = closed_ledger(scene, integrator="semi_implicit_euler", dt=h)
        assert opposite.of(Cause.INTEGRATOR) == pytest.approx(-n * 0.5 * 2.0 * G**2 * h**2, rel=1e-10)  # likewise


@pytest.mark.parametrize("integrator", ["velocity_verlet", "rk4"])
def test_drag_work_matches_its_integral(integrator: str) -> None:
    """∫ m (k + c |v|) v² dt against scipy's DOP853."""
    k, c = 0.3, 0.05
    scene = scene_of(2.0, world={"linear_drag": k, "quadratic_drag": c}, ball=[ball(mass=1.5)])

    def fall(_: float, y: Any) -> list[float]:
        drag = (k + c * abs(y[0])) * y[0]
        return [-G - drag, -1.5 * drag * y[0]]

    truth = solve_ivp(fall, (0, 2), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-12).y[1, -1]
    account = closed_ledger(scene, integrator=integrator, dt=0.01)
    # The path of a step is approximated by a parabola, so its work is of second order: (k h)²/12 = 1e-6.
    assert account.of(Cause.DRAG) == pytest.approx(truth, rel=2e-5)


def test_damper_work_matches_its_integral() -> None:
    spring = {"kind": "spring", "between": ["a"], "anchors": [[0, 0], [0, 0]], "rest_length": 0.0}
    spring |= {"stiffness": 50.0, "damping": 1.5}
    scene = scene_of(1.0, 0.0, ball=[ball(1.0, 0.0, name="a", mass=2.0)], joint=[spring])

    def swing(_: float, y: Any) -> list[float]:
        return [y[1], (-50.0 * y[0] - 1.5 * y[1]) / 2.0, -1.5 * y[1] ** 2]

    truth = solve_ivp(swing, (0, 1), [1.0, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-12).y[2, -1]
    # (ω h)² = 1.6e-4, over 12
    assert closed_ledger(scene, dt=2.5e-3).of(Cause.DAMPING) == pytest.approx(truth, rel=1e-4)


def test_work_of_a_constant_force_is_force_times_distance() -> None:
    scene = scene_of(1.0, 0.0, ball=[ball(0, 0, name="a", mass=2.0)])
    action = Force(time=0.0, body="a", force=(6.0, 8.0))
    account = closed_ledger(scene, actions=(action,))
    assert account.of(Cause.DRIVES) == pytest.approx(25.0, rel=1e-12)  # F²t²/2m: sums round


def test_undamped_penalty_contact_returns_its_stored_energy() -> None:
    """During contact the energy stored in the contact spring is booked as restitution; without damping all returns."""
    scene = scene_of(0.5, 0.0, ball=[ball(0.0, 0.6, velocity=[0, -2], restitution=1.0)], plane=[floor()])
    account = closed_ledger(scene, response="penalty", stiffness=2e4, damping=0.0, integrator="rk4", dt=1e-3)
    stored = account.entries[:, account.causes.index("restitution")]
    assert stored.min() == pytest.approx(-4.0, rel=1e-2)  # all of ½ m v², up to the position of the steps
    assert abs(stored[-1]) < 1e-12
    assert account.of(Cause.PHANTOM) == 0.0


def test_penalty_friction_only_removes_energy() -> None:
    scene = scene_of(0.5, ball=[ball(0.0, 0.6, velocity=[2, -2], restitution=0.5)], plane=[floor()])
    account = closed_ledger(scene, response="penalty", dt=1e-3)
    assert account.of(Cause.PHANTOM) == 0.0
    assert account.of(Cause.FRICTION) < 0.0


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("benchmark/pile", {}),
        ("benchmark/newtons_cradle", {"detection": "bisect", "integrator": "velocity_verlet"}),
        ("benchmark/pile", {"response": "penalty"}),
        ("joints/ragdoll_stairs", {}),
        ("joints/cloth", {"joints": "xpbd"}),
        ("joints/tearing_cloth", {}),
        ("benchmark/kepler", {}),
    ],
)
def test_accounting_changes_no_state_and_counts_no_work(name: str, settings: dict[str, Any]) -> None:
    scene = shipped(name)
    plain, accounted = (start(scene, "reference", scene.solver.replace(**settings)) for _ in range(2))
    accounted.account()
    for _ in range(25):
        plain.step()
        accounted.step()
    accounted.account()
    assert accounted.state_hash() == plain.state_hash()
    assert accounted.work == plain.work


def test_ledger_opened_after_the_start_is_empty() -> None:
    relay = start(scene_of(ball=[ball(y=3.0, restitution=0.5)], plane=[floor()]), "reference")
    advance(relay, 100)
    assert set(relay.account().values()) == {0.0}
    assert list(relay.account()) == list(Cause)
