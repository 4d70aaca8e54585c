"""Energy ledger of pymunk: it closes to rounding, its entries obey the laws, and it does not affect the run."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.energy_ledger import Cause
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests import accounts

SCENES = Path(__file__).parents[2] / "scenes"
# Rounding of a few hundreds of sums of energies up to 1e4 times the kinetic energy.
closed_account = partial(accounts.closed_account, engine="pymunk", closes=1e-11)


def scene_of(gravity: float = -10.0, substeps: int = 1, **more: Any) -> Scene:
    world = {"gravity": [0, gravity], "duration": 3.0, **more.pop("world", {})}
    solver = {"dt": 0.01, "substeps": substeps, **more.pop("solver", {})}
    return from_document({"world": world, "solver": solver, **more})


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.1, "mass": 1.0, **more}


FLOOR = {"point": [0, 0], "normal": [0, 1]}


STEPS_OF_SCENES = {
    "tutorial/spaceship": 60, "benchmark/newtons_cradle": 150, "benchmark/incline": 60, "benchmark/box_slides": 60,
    "benchmark/gas": 60, "benchmark/pile": 25, "benchmark/tower": 40, "benchmark/double_pendulum": 60,
    "benchmark/kepler": 60, "joints/bridge": 15, "joints/ragdoll_stairs": 15, "joints/cloth": 4, "particles/sparks": 15,
}  # fmt: skip


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(("name", "steps"), STEPS_OF_SCENES.items())
def test_ledger_of_a_shipped_scene_closes(name: str, steps: int) -> None:
    account = closed_account(sandbox.load(SCENES / f"{name}.toml"), steps)
    assert all(np.isfinite(list(account.values())))


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    "joints",
    [
        [{"kind": "rod", "anchors": [[0.3, 0.1], [-0.3, 0.0]]}],
        [{"kind": "pivot", "at": [0.5, 0]}],
        [{"kind": "slide", "least": 0.5, "most": 1.05}],
        [{"kind": "groove", "groove": [[0, -1], [2, 1]], "anchor": [0.1, 0]}],
        [{"kind": "rotary_limit", "least": -0.2, "most": 0.2}],
        [{"kind": "gear", "ratio": 2.0}],
        [{"kind": "pivot", "at": [0.5, 0]}, {"kind": "motor", "rate": 5.0, "max_torque": 3.0}],
        [
            {
                "kind": "spring",
                "anchors": [[0.3, 0.1], [-0.3, 0]],
                "stiffness": 300.0,
                "damping": 5.0,
                "rest_length": 0.2,
            }
        ],
        [{"kind": "rotary_spring", "stiffness": 30.0, "damping": 0.7, "rest_angle": 0.5}],
        [{"kind": "ratchet", "ratchet": 0.2}],
        [{"kind": "pivot", "at": [0.5, 0], "max_force": 4.0, "max_bias": 0.1}],
        [{"kind": "gear", "ratio": 2.0, "max_force": 0.1, "max_bias": 0.0}],
        [{"kind": "groove", "groove": [[0, -1], [2, 1]], "anchor": [0.1, 0], "max_force": 3.0, "bias": 0.5}],
        [{"kind": "spring", "stiffness": 300.0, "damping": 5.0, "rest_length": 0.2, "max_force": 20.0}],
        [{"kind": "rotary_spring", "stiffness": 30.0, "damping": 0.7, "rest_angle": 0.5, "max_force": 2.0}],
        # a motor next to joints that give way: its impulse is found among theirs
        [
            {"kind": "pivot", "at": [0.5, 0], "max_force": 4.0},
            {"kind": "ratchet", "ratchet": 0.2, "max_force": 0.1},
            {"kind": "motor", "rate": 5.0, "max_torque": 3.0},
        ],
    ],
    ids=lambda joints: "limited " * ("max_force" in joints[0]) + str(joints[-1]["kind"]),
)
def test_ledger_of_a_joint_in_wind_closes_with_the_expected_signs(joints: list[dict[str, Any]]) -> None:
    box = {"size": [0.6, 0.3], "mass": 2.0, "collides": "none"}
    boxes = [
        {"name": "a", "position": [0, 0], "angular_velocity": 2.0, **box},
        {"name": "b", "position": [1, 0.2], "velocity": [0, 1.0], "angular_velocity": -1.0, **box},
    ]
    joint_tables = [{"between": ["a", "b"], **joint} for joint in joints]
    account = closed_account(
        scene_of(box=boxes, joint=joint_tables, substeps=2, world={"linear_drag": 0.1, "wind": [1.0, 0.0]}), 60
    )
    kind = joints[-1]["kind"]
    assert account[Cause.DRAG] < 0.0
    assert (account[Cause.DAMPING] < 0.0) == kind.endswith("spring")
    assert (account[Cause.DRIVES] > 0.0) == (kind == "motor")
    assert (account[Cause.JOINTS] < 0.0) == (not kind.endswith("spring"))


def test_free_fall_gains_half_m_g_h_squared_in_each_substep() -> None:
    account = closed_account(
        scene_of(ball=[ball("a", 0, 5), ball("b", 1, 5, mass=2.0, collides="none")], plane=[FLOOR]), 50
    )
    # Explicit Euler: the fall lags by g h²/2 in each of 50 substeps, for 1 kg inside and 2 kg outside the space.
    assert account[Cause.INTEGRATOR] == pytest.approx(50 * 0.5 * 3.0 * (10.0 * 0.01) ** 2, rel=1e-12)  # rounding
    assert all(energy == 0.0 for cause, energy in account.items() if cause != Cause.INTEGRATOR)


def test_free_fall_with_half_kick_gains_no_energy() -> None:
    balls = [ball("a", 0, 5), ball("b", 1, 5, collides="none")]
    account = closed_account(scene_of(ball=balls, plane=[FLOOR], solver={"half_kick": True}), 50, part=0.3)
    assert account[Cause.INTEGRATOR] == pytest.approx(0.0, abs=1e-12)  # rounding


def test_energy_loss_of_an_impact_follows_restitution() -> None:
    e, m1, m2, v = 0.5, 1.0, 3.0, 4.0
    balls = [ball("a", 0, 0, velocity=[v, 0], mass=m1), ball("b", 1, 0, mass=m2)]
    balls = [{**each, "restitution": np.sqrt(e), "friction": 0.0} for each in balls]
    account = closed_account(scene_of(gravity=0.0, ball=balls), 60)
    reduced = m1 * m2 / (m1 + m2)
    assert account[Cause.RESTITUTION] == pytest.approx(-0.5 * reduced * (1 - e**2) * v**2, rel=1e-12)  # rounding
    assert account[Cause.FRICTION] == 0.0


def test_friction_work_of_a_slide_is_force_times_distance() -> None:
    scene = sandbox.load(SCENES / "benchmark/slide_to_stop.toml")
    time = 120 * scene.solver.dt
    account = closed_account(scene, 120)
    distance = 5.0 * time - 0.5 * (0.5 * 9.81) * time**2
    mass = float(scene.bodies.mass[0])
    # At first the box tips forward slightly into the slop, and its friction differs from μ m g.
    assert account[Cause.FRICTION] == pytest.approx(-0.5 * mass * 9.81 * distance, rel=5e-3)


def test_box_at_rest_has_no_entries() -> None:
    box = {"name": "a", "position": [0, 0.1], "size": [1.0, 0.2], "mass": 2.0}
    scene = scene_of(box=[box], plane=[FLOOR])
    earlier, later = closed_account(scene, 100), closed_account(scene, 200)
    # The contact cancels the kick of each substep, m g² h²/2 = 0.01 J; uncancelled, it would add 1 J in 1 s.
    assert all(later[cause] == pytest.approx(earlier[cause], abs=1e-5) for cause in Cause)


ACTIONS: accounts.Timed = [
    (5, Impulse(time=0, body="a", impulse=(1.0, 0.5), angular=0.1)),
    (10, Force(time=0, body="b", force=(0.5, 0.0), torque=0.01)),
    (20, Spawn(time=0, ball={"name": "n", "position": (0.5, 0.6), "radius": 0.1, "mass": 2.0, "velocity": (1.0, 2.0)})),
    (30, Remove(time=0, body="c")),
    (40, SetParameter(time=0, path="world.gravity", value=[1.0, -5.0])),
    (50, Move(time=0, body="a", position=(5.0, 2.0))),
    (60, SetParameter(time=0, path="world.quadratic_drag", value=0.2)),
]


@pytest.mark.parametrize("fraction", [None, 0.37])
def test_ledger_stays_closed_through_actions(fraction: float | None) -> None:
    balls = [ball("a", 0, 0.5), ball("b", 1, 0.3, velocity=[-1, 0]), ball("c", 2, 3, collides="none")]
    account = closed_account(scene_of(ball=balls, plane=[FLOOR], substeps=2), 80, ACTIONS, fraction)
    assert account[Cause.RETIRED] < 0.0
    assert account[Cause.ACTIONS] != 0.0
    assert account[Cause.DRIVES] != 0.0
    assert account[Cause.DRAG] < 0.0


def test_work_of_a_constant_force_is_booked_as_drives() -> None:
    account = closed_account(
        scene_of(gravity=0.0, ball=[ball("a", 0, 0)]), 50, [(0, Force(time=0, body="a", force=(2.0, 0.0)))]
    )
    assert account[Cause.DRIVES] == pytest.approx(0.5 * 1.0 * (2.0 * 0.5) ** 2, rel=1e-12)  # rounding of 50 sums


KINEMATIC_SCENE: dict[str, Any] = {
    "plane": [FLOOR],
    "box": [
        {"name": "lift", "position": [0, 0.3], "size": [2, 0.2], "kinematic": True, "velocity": [0.5, 1.0]},
        {"name": "mill", "position": [0, 3], "size": [1, 0.1], "kinematic": True, "angular_velocity": 3.0},
    ],
    "ball": [ball("a", 0.2, 1.5, restitution=0.5, friction=0.5), ball("b", -0.2, 0.8), ball("c", 0.7, 3.0)],
    "material": [{"name": "rubber", "restitution": 0.8, "friction": 0.6}],
}


@pytest.mark.parametrize(
    "joints",
    [
        [],
        [{"kind": "spring", "between": ["mill", "c"], "stiffness": 50.0, "damping": 1.0, "rest_length": 0.5}],
        [{"kind": "rod", "between": ["mill", "c"], "anchors": [[0.3, 0.0], [0.0, 0.0]]}],
        [
            {"kind": "pivot", "between": ["mill", "c"], "at": [0.4, 3.0]},
            {"kind": "motor", "between": ["lift", "b"], "rate": 5.0, "max_torque": 0.1},
        ],
        [{"kind": "rod", "between": ["c"], "anchors": [[0.0, 0.0], [0.7, 4.0]]}],
    ],
    ids=["free", "spring", "rod", "pivot and motor", "rod to the world"],
)
@pytest.mark.parametrize("fraction", [None, 0.3])
def test_ledger_closes_with_kinematic_bodies(joints: list[dict[str, Any]], fraction: float | None) -> None:
    boxes = [{**box, "material": "rubber"} for box in KINEMATIC_SCENE["box"]]
    actions = [(40, Move(time=0, body="lift", position=(0.1, 0.9), velocity=(0.0, -1.0)))]
    account = closed_account(scene_of(**KINEMATIC_SCENE | {"box": boxes}, joint=joints), 60, actions, fraction)
    # the lift becomes slower and is raised from 0.7 m; rounding
    assert account[Cause.ACTIONS] == pytest.approx(0.5 * (1.0 - 1.25) + 10.0 * (0.9 - 0.7), abs=1e-12)


def test_work_of_a_paddle_is_that_of_its_elastic_collision() -> None:
    """A ball of 1 kg at rest leaves a paddle of speed u at 2 u; the paddle's force on it does the work 2 u²."""
    paddle = {"name": "paddle", "position": [-1, 0], "size": [0.2, 1], "kinematic": True, "velocity": [3, 0]}
    account = closed_account(
        scene_of(gravity=0.0, ball=[ball("a", 0, 0, restitution=1.0)], box=[{**paddle, "restitution": 1.0}]), 50
    )
    assert account[Cause.DRIVES] == pytest.approx(2.0 * 3.0**2, rel=1e-9)  # pymunk solves one contact to rounding


def test_stored_energy_of_a_broken_spring_is_booked_as_parted() -> None:
    spring = {"kind": "spring", "between": ["a"], "stiffness": 100.0, "rest_length": 0.5, "strength": 12.0}
    account = closed_account(scene_of(ball=[ball("a", 0, -0.5)], joint=[spring]), 40)
    # It breaks in the first substep in which its force exceeds 12 N, when it stores more than 12²/2k = 0.72 J.
    assert -0.85 < account[Cause.PARTED] < -0.72


def test_contacts_that_separate_and_return_are_booked_once() -> None:
    boxes = [
        {
            "name": f"b{k}",
            "position": [0.3 * (k % 3), 0.5 + 0.35 * k],
            "size": [0.3, 0.3],
            "mass": 1.0,
            "angle": 0.3 * k,
        }
        for k in range(9)
    ]
    # Munk2D starts a contact point that it remembers with its old impulse and reports that again.
    closed_account(scene_of(box=boxes, plane=[FLOOR], solver={"persistence": 8}), 120)


@pytest.mark.fail_slow(60)  # 400 substeps with a ledger
def test_run_that_diverges_does_so_with_a_ledger_too() -> None:
    # The moment of inertia of the ball is far below that of its mass at the pivot.
    balls = [ball("tiny", 0, 0, angular_velocity=1.0) | {"radius": 1e-9}, ball("turned", 1, 3)]
    joints = [
        {"kind": "pivot", "between": ["tiny"], "at": [2.57, 0]},
        {"kind": "motor", "between": ["turned"], "rate": 3.0},
    ]
    scene = scene_of(ball=balls, joint=joints, substeps=100, solver={"dt": 1 / 60}, world={"duration": 0.1})
    plain, accounted = (sandbox.run(scene, "pymunk", audit=False, account=account) for account in (False, True))
    assert (accounted.status, accounted.reason) == (plain.status, plain.reason)
    assert plain.status == "diverged"
    assert np.array_equal(accounted.position, plain.position, equal_nan=True)
