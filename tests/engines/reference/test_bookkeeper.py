"""The reference's account of energy: it closes, its entries are the laws', and it changes nothing."""

import json
import math
import os
import subprocess
import sys
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

pytestmark = pytest.mark.full  # long runs and sweeps

CLOSED = 1e-9  # the promise; what is found is the rounding of sums, some 1e-11 at most
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


def books(scene: Scene, **settings: Any) -> Ledger:
    kept = ledger(scene, "reference", **settings)
    assert kept.closes_to < CLOSED
    return kept


def pendulum(kind: str = "rod", **more: Any) -> Scene:
    bobs = [ball(1.0, 0.0, name="a", collides="none"), ball(2.0, 0.0, name="b", collides="none")]
    joints = [{"kind": kind, "between": ["a"], **more}, {"kind": "rod", "between": ["a", "b"]}]
    return scene_of(0.5, ball=bobs, joint=joints)


INTEGRATORS = ("explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4")
JOINTS = ("impulses", "relaxation", "xpbd", "rattle")
WIND = {"wind": [3.0, 1.0], "linear_drag": 0.3, "quadratic_drag": 0.1}

CLOSING = [
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


@pytest.mark.parametrize(("name", "duration", "settings"), CLOSING)
def test_causes_sum_to_what_energy_changed_by(name: str, duration: float, settings: dict[str, Any]) -> None:
    kept = books(shipped(name, duration), **settings)
    assert np.abs(kept.entries).max() > 0.0


@pytest.mark.parametrize("joints", JOINTS)
@pytest.mark.parametrize("kind", ["rod", "spring"])
def test_it_closes_for_joints_however_they_are_held(kind: str, joints: str) -> None:
    more = {"rest_length": 0.7, "stiffness": 300.0, "damping": 2.0} if kind == "spring" else {}
    kept = books(pendulum(kind, **more), joints=joints)
    assert kept.of(Cause.DAMPING) < 0.0 if kind == "spring" else kept.of(Cause.DAMPING) == 0.0


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_it_closes_with_wind_drag_and_thrust(integrator: str) -> None:
    thrust = {"body": "a", "point": [0.2, 0.1], "force": [5.0, 9.0], "begin": 0.1, "end": 0.4}
    scene = scene_of(0.6, world=WIND, ball=[ball(name="a", velocity=[1, 2])], plane=[floor()], thrust=[thrust])
    kept = books(scene, integrator=integrator)
    assert kept.of(Cause.DRAG) != 0.0
    assert kept.of(Cause.DRIVES) > 0.0


def test_it_closes_over_actions_switches_and_whoever_comes_and_goes() -> None:
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
    kept = books(scene, actions=actions)
    for cause in (Cause.ACTIONS, Cause.RETIRED, Cause.DRIVES):
        assert kept.of(cause) != 0.0


def test_a_body_that_leaves_takes_what_it_has() -> None:
    scene = scene_of(1.0, 0.0, world={"bounds": [[-5, -5], [5, 5]]}, ball=[ball(4.9, 0.0, velocity=[3, 0])])
    assert books(scene).of(Cause.RETIRED) == -9.0  # ½ m v²


def test_a_spring_that_breaks_takes_what_it_stores() -> None:
    spring = {"kind": "spring", "between": ["a"], "anchors": [[0, 0], [0, 0]], "rest_length": 1.0}
    spring |= {"stiffness": 100.0, "strength": 50.0}
    kept = books(scene_of(0.1, 0.0, ball=[ball(2.0, 0.0, name="a")], joint=[spring]), dt=1e-3)
    # ½ k x² at its strength of 50 N, half the 1 m that it starts with: it breaks in the first step.
    assert kept.of(Cause.PARTED) == pytest.approx(-50.0, rel=1e-3)  # x has changed by ½·(k/m)·dt² in that step


@pytest.mark.parametrize("e", [0.0, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("detection", ["discrete", "swept", "bisect"])
def test_an_impact_takes_what_restitution_says(e: float, detection: str) -> None:
    two = [ball(0, 0, velocity=[3, 0], restitution=e), ball(2, 0, mass=1.0, restitution=e)]
    kept = books(
        scene_of(
            gravity=0.0,
            ball=two,
        ),
        detection=detection,
    )
    mixed = e * e  # coefficients multiply
    reduced = 2.0 * 1.0 / 3.0
    loss = 0.5 * reduced * (1 - mixed**2) * 9.0
    assert kept.of(Cause.RESTITUTION) == pytest.approx(-loss, rel=1e-13, abs=1e-13)  # rounding
    assert kept.of(Cause.FRICTION) == kept.of(Cause.INTEGRATOR) == kept.of(Cause.CORRECTION) == 0.0
    assert abs(kept.of(Cause.PHANTOM)) < 1e-14  # of 9 J: rounding


def test_an_elastic_gas_without_friction_has_no_entries() -> None:
    kept = books(shipped("benchmark/gas", 0.5))
    assert kept.of(Cause.FRICTION) == 0.0
    assert np.abs(kept.entries).max() < 1e-12 * kept.scale  # each impact is elastic to rounding


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_an_elastic_ball_loses_nothing_to_restitution_under_gravity(integrator: str) -> None:
    kept = books(scene_of(2.0, ball=[ball(y=2.0, restitution=1.0)], plane=[floor()]), integrator=integrator)
    assert abs(kept.of(Cause.RESTITUTION)) < 1e-12  # of 30 J
    assert kept.of(Cause.PHANTOM) < 1e-12  # likewise
    exact = integrator in ("velocity_verlet", "leapfrog", "rk4")
    assert abs(kept.of(Cause.INTEGRATOR)) < 1e-12 if exact else abs(kept.of(Cause.INTEGRATOR)) > 1e-6


@pytest.mark.parametrize("integrator", ["explicit_euler", "semi_implicit_euler", "velocity_verlet"])
def test_what_rests_has_no_entries(integrator: str) -> None:
    """Each step kicks it down, and its contact kicks it back: neither is an entry."""
    kept = books(scene_of(1.0, ball=[ball(y=0.5, restitution=0.0)], plane=[floor()]), integrator=integrator)
    # The first steps let it sink to where it touches. After that: rounding, of 9.6 mJ (½ m g² dt²) a step, both ways.
    assert np.abs(kept.entries[-1] - kept.entries[10]).max() < 1e-12


def test_friction_takes_mu_m_g_s_of_a_slide() -> None:
    box = {"position": [0.0, 0.5], "size": [1, 1], "mass": 2.0, "friction": 0.5, "velocity": [5.0, 0.0]}
    scene = scene_of(0.5, box=[box], plane=[floor()])
    slid = run(scene, "reference").position[-1, 0, 0]
    assert books(scene).of(Cause.FRICTION) == pytest.approx(-0.5 * 2.0 * G * slid, rel=1e-6)  # it sinks a little first
    stopped = books(scene_of(2.0, box=[box], plane=[floor()]))
    assert stopped.of(Cause.FRICTION) == pytest.approx(-25.0, rel=1e-4)  # all of ½ m v²; likewise


def test_explicit_euler_gives_half_m_g2_h2_a_step() -> None:
    scene = scene_of(1.0, ball=[ball()])
    for n, h in ((100, 0.01), (500, 0.002)):
        kept = books(scene, integrator="explicit_euler", dt=h)
        assert kept.of(Cause.INTEGRATOR) == pytest.approx(n * 0.5 * 2.0 * G**2 * h**2, rel=1e-10)  # sums round
        opposite = books(scene, integrator="semi_implicit_euler", dt=h)
        assert opposite.of(Cause.INTEGRATOR) == pytest.approx(-n * 0.5 * 2.0 * G**2 * h**2, rel=1e-10)  # likewise


@pytest.mark.parametrize("integrator", ["velocity_verlet", "rk4"])
def test_drag_takes_what_its_integral_says(integrator: str) -> None:
    """∫ m (k + c |v|) v² dt against scipy's DOP853."""
    k, c = 0.3, 0.05
    scene = scene_of(2.0, world={"linear_drag": k, "quadratic_drag": c}, ball=[ball(mass=1.5)])

    def fall(_: float, y: Any) -> list[float]:
        drag = (k + c * abs(y[0])) * y[0]
        return [-G - drag, -1.5 * drag * y[0]]

    truth = solve_ivp(fall, (0, 2), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-12).y[1, -1]
    kept = books(scene, integrator=integrator, dt=0.01)
    # The way of a step is taken for a parabola, so that its work is of second order: (k h)²/12 = 1e-6.
    assert kept.of(Cause.DRAG) == pytest.approx(truth, rel=2e-5)


def test_a_damper_takes_what_its_integral_says() -> None:
    spring = {"kind": "spring", "between": ["a"], "anchors": [[0, 0], [0, 0]], "rest_length": 0.0}
    spring |= {"stiffness": 50.0, "damping": 1.5}
    scene = scene_of(1.0, 0.0, ball=[ball(1.0, 0.0, name="a", mass=2.0)], joint=[spring])

    def swing(_: float, y: Any) -> list[float]:
        return [y[1], (-50.0 * y[0] - 1.5 * y[1]) / 2.0, -1.5 * y[1] ** 2]

    truth = solve_ivp(swing, (0, 1), [1.0, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-12).y[2, -1]
    assert books(scene, dt=2.5e-3).of(Cause.DAMPING) == pytest.approx(truth, rel=1e-4)  # (ω h)² = 1.6e-4, over 12


def test_a_steady_force_brings_force_times_way() -> None:
    scene = scene_of(1.0, 0.0, ball=[ball(0, 0, name="a", mass=2.0)])
    action = Force(time=0.0, body="a", force=(6.0, 8.0))
    kept = books(scene, actions=(action,))
    assert kept.of(Cause.DRIVES) == pytest.approx(25.0, rel=1e-12)  # F²t²/2m: sums round


def test_contacts_that_are_springs_give_back_what_they_store() -> None:
    """While it touches, what the spring stores is booked as taken; an undamped one gives all of it back."""
    scene = scene_of(0.5, 0.0, ball=[ball(0.0, 0.6, velocity=[0, -2], restitution=1.0)], plane=[floor()])
    kept = books(scene, response="penalty", stiffness=2e4, damping=0.0, integrator="rk4", dt=1e-3)
    taken = kept.entries[:, kept.causes.index("restitution")]
    assert taken.min() == pytest.approx(-4.0, rel=1e-2)  # all of ½ m v², but for where the steps lie
    assert abs(taken[-1]) < 1e-12
    assert kept.of(Cause.PHANTOM) == 0.0


def test_penalty_friction_and_dampers_only_take() -> None:
    scene = scene_of(0.5, ball=[ball(0.0, 0.6, velocity=[2, -2], restitution=0.5)], plane=[floor()])
    kept = books(scene, response="penalty", dt=1e-3)
    assert kept.of(Cause.PHANTOM) == 0.0
    assert kept.of(Cause.FRICTION) < 0.0


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
    plain, kept = (start(scene, "reference", scene.solver.replace(**settings)) for _ in range(2))
    kept.account()
    for _ in range(25):
        plain.step()
        kept.step()
    kept.account()
    assert kept.state_hash() == plain.state_hash()
    assert kept.work == plain.work


def test_an_account_opens_empty_and_late() -> None:
    relay = start(scene_of(ball=[ball(y=3.0, restitution=0.5)], plane=[floor()]), "reference")
    for _ in range(100):
        relay.step()
    assert set(relay.account().values()) == {0.0}
    assert list(relay.account()) == list(Cause)


SAME = """
import json, sys
from sandbox.jsonable import to_json
from tests.accounts import ledger
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find
scene = load(find("joints/ragdoll_stairs"))
scene = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 0.1})})
print(json.dumps(to_json(ledger(scene, "reference").document())))
"""


def test_accounts_are_the_same_with_and_without_compiled_kernels() -> None:
    told = []
    for disabled in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled}
        done = subprocess.run([sys.executable, "-c", SAME], env=environment, capture_output=True, text=True, check=True)
        told.append(json.loads(done.stdout))
    assert told[0] == told[1]
    assert told[0]["closes_to"] < CLOSED
    assert math.isfinite(told[0]["end"])
