"""Motors, gears, grooves and pulleys: Jacobians, closed forms by every joint method, limits, energy, and pymunk."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.arrays import FloatArray
from sandbox.engines.reference.joint_data import GROOVE_ENDS, constrained_value, select_joints
from sandbox.engines.reference.joints import METHODS
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.files.load import from_document
from tests.engines.reference.joint_rig import compile_joints, link

pytestmark = pytest.mark.fail_slow(60)  # many runs of a second

METHOD_ERRORS = {"impulses": 6e-3, "relaxation": 6e-3, "xpbd": 6e-3, "rattle": 1e-9}
"""m, error after 1 s in steps of 1 ms with accelerations up to 10 m/s²: of order h·a·t/2; with RATTLE the error that
60 iterations leave"""

every_method = pytest.mark.parametrize("method", METHODS)


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.1, "mass": 1.0, "collides": "none", **more}


def box(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "size": [1.0, 0.2], "mass": 1.0, "collides": "none", **more}


def joint(kind: str, *between: str, **more: Any) -> dict[str, Any]:
    return {"kind": kind, "between": list(between), **more}


def scene_of(*joints: dict[str, Any], gravity: float = 0.0, method: str | None = None, **tables: Any) -> sandbox.Scene:
    solver = {"dt": 0.001, "iterations": 60, **({} if method is None else {"joints": method})}
    world = {"gravity": [0.0, -gravity], "duration": 1.0, **tables.pop("world", {})}
    return from_document({"world": world, "solver": solver, "joint": [*joints], **tables})


def atwood(method: str, **more: Any) -> sandbox.Scene:
    pulley = joint("pulley", "a", "b", wheels=[[0.0, 0.0], [1.0, 0.0]], **more)
    return scene_of(pulley, gravity=10.0, method=method, ball=[ball("a", 0, -1, mass=3.0), ball("b", 1, -6)])


pose = st.floats(-3.0, 3.0).map(lambda value: round(value, 3))


@given(
    kind=st.sampled_from([JointKind.GROOVE, JointKind.GEAR, JointKind.PULLEY]),
    numbers=st.lists(pose, min_size=6, max_size=6),
    figures=st.tuples(st.floats(0.5, 3.0), st.floats(0.5, 3.0)),
    anchors=st.tuples(*[st.floats(-1.0, 1.0)] * 4),
    first=st.sampled_from([-1, 0]),
)
def test_jacobian_is_the_derivative_of_the_value(
    kind: JointKind, numbers: list[float], figures: tuple[float, float], anchors: tuple[float, ...], first: int
) -> None:
    if kind == JointKind.PULLEY:
        first = 0
    joints = select_joints(
        compile_joints(
            link(kind, first, 1, *figures, anchor_a=anchors[:2], anchor_b=anchors[2:], wheels=(-9.0, 8.0, 7.0, 9.0))
        ),
        kind,
    )
    at: FloatArray = np.asarray(numbers).reshape(2, 3)
    for k in range(len(joints.kind)):
        _, jacobian = constrained_value(joints, k, at)
        for column in range(6):
            if first < 0 and column < 3:
                continue
            shift = np.zeros(6)
            shift[column] = 1e-6
            ends = [constrained_value(joints, k, at + sign * shift.reshape(2, 3))[0] for sign in (1.0, -1.0)]
            # the rounding of values up to 50 over the shift, and the third derivative times its square
            assert (ends[0] - ends[1]) / 2e-6 == pytest.approx(jacobian[column], abs=1e-7)


@every_method
@pytest.mark.parametrize("ratio", [1.0, 2.0])
def test_atwood_machine(method: str, ratio: float) -> None:
    tension = 10.0 * (1 + ratio) / (1 / 3.0 + ratio**2)
    run = sandbox.run(atwood(method, ratio=ratio), engine="reference")
    t = run.time
    expected = np.column_stack((-1 - 0.5 * (10 - tension / 3) * t**2, -6 - 0.5 * (10 - ratio * tension) * t**2))
    assert run.position[:, :, 1] == pytest.approx(expected, abs=METHOD_ERRORS[method])
    assert run.position[:, :, 0] == pytest.approx(np.asarray([[0.0, 1.0]] * len(t)), abs=1e-12)  # rounding


@every_method
def test_rope_of_a_pulley_pulls_and_never_pushes(method: str) -> None:
    """Both bodies start at rest with 0.2 m of slack: they fall freely until it is used up after sqrt(0.2/g)."""
    run = sandbox.run(atwood(method, length=7.2), engine="reference")
    free = run.time < math.sqrt(0.2 / 10.0) - 0.002
    fallen = np.asarray([[-1.0, -6.0]]) - 5.0 * run.time[free, None] ** 2
    assert run.position[free, :, 1] == pytest.approx(fallen, abs=METHOD_ERRORS[method])
    length = -run.position[:, :, 1].sum(axis=1)
    assert length.max() < 7.2 + 0.006  # one step of falling, at most 6 m/s of both bodies, before the rope is taut


def test_rope_of_a_pulley_breaks_at_its_strength() -> None:
    tension = 20.0 / (1 / 3.0 + 1.0)
    for factor, broken in ((0.99, 1), (1.01, 0)):
        run = sandbox.run(atwood("impulses", strength=factor * tension), engine="reference")
        assert run.info["broken"] == broken


def machine(method: str | None, gears: bool, torque: float | None) -> sandbox.Scene:
    """Return two wheels on axles, a motor at the first, and perhaps a gear between them."""
    motor = joint("motor", "a", rate=8.0, **({} if torque is None else {"max_torque": torque}))
    axles = [joint("pivot", name, at=[x, 0.0]) for name, x in (("a", 0.0), ("b", 2.0))]
    gear = [joint("gear", "a", "b", ratio=-2.0)] if gears else []
    return scene_of(*axles, motor, *gear, method=method, box=[box("a", 0, 0), box("b", 2, 0, mass=3.0)])


MOMENT = (1.0**2 + 0.2**2) / 12
"""kg·m², of the first wheel; that of the second is three times as large"""


@every_method
def test_motor_turns_at_its_rate(method: str) -> None:
    run = sandbox.run(machine(method, False, None), engine="reference")
    assert run.angular_velocity[1:, 0] == pytest.approx(np.full(len(run.time) - 1, 8.0), abs=1e-9)  # rounding
    assert (run.angular_velocity[:, 1] == 0.0).all()


@every_method
def test_motor_of_limited_torque_accelerates_uniformly(method: str) -> None:
    run = sandbox.run(machine(method, False, 0.2), engine="reference")
    expected = np.minimum(0.2 / MOMENT * run.time, 8.0)
    assert run.angular_velocity[:, 0] == pytest.approx(expected, abs=1e-9)  # rounding of 1,000 steps


@every_method
def test_gear_transmits_the_torque_of_a_motor(method: str) -> None:
    """ω_a = −2 ω_b: the second wheel adds I_b/4 to the moment of the first."""
    run = sandbox.run(machine(method, True, 0.2), engine="reference")
    rate = 0.2 / (MOMENT + 3.0 * MOMENT / 4.0)
    # The solver iterates over motor and gear in turns: 60 passes leave 1e-9 of their difference.
    assert run.angular_velocity[:, 0] == pytest.approx(rate * run.time, abs=1e-6)
    assert run.angular_velocity[:, 1] == pytest.approx(-0.5 * rate * run.time, abs=1e-6)
    assert run.angle[:, 1] * -2.0 == pytest.approx(run.angle[:, 0], abs=METHOD_ERRORS[method])


@every_method
def test_motor_work_is_that_of_drives_in_the_energy_account(method: str) -> None:
    run = sandbox.run(machine(method, True, 0.2), engine="reference", account=True)
    account = {cause: values[-1] for cause, values in zip(run.info["causes"], run.account.T, strict=True)}
    energy = 0.5 * MOMENT * (run.angular_velocity[-1, 0] ** 2 + 3.0 * run.angular_velocity[-1, 1] ** 2)
    assert account["drives"] == pytest.approx(0.2 * run.angle[-1, 0], rel=2e-3)  # the angle lags by half a step
    assert sum(account.values()) == pytest.approx(energy, rel=1e-12)  # rounding


@every_method
def test_groove_prescribes_the_motion_of_a_slider_crank(method: str) -> None:
    """The piston is at r cos φ + √(L² − r² sin² φ) with the crank at φ = ω t."""
    omega = 2.0 * math.pi
    joints = [
        joint("pivot", "crank", at=[0.0, 0.0]),
        joint("motor", "crank", rate=omega),
        joint("rod", "crank", "piston", anchors=[[0.25, 0.0], [0.0, 0.0]], length=1.5),
        joint("groove", "piston", groove=[[0.5, 0.0], [2.5, 0.0]]),
    ]
    crank = box("crank", 0.25, 0.0, angular_velocity=omega, velocity=[0.0, 0.25 * omega])
    run = sandbox.run(scene_of(*joints, method=method, box=[crank], ball=[ball("piston", 2.0, 0.0)]), "reference")
    phi = omega * run.time
    expected = 0.5 * np.cos(phi) + np.sqrt(1.5**2 - (0.5 * np.sin(phi)) ** 2)
    assert run.position[:, 0, 0] == pytest.approx(expected, abs=METHOD_ERRORS[method])
    assert run.position[:, 0, 1] == pytest.approx(np.zeros(len(phi)), abs=METHOD_ERRORS[method])


@every_method
def test_groove_ends_stop_a_slider(method: str) -> None:
    groove = joint("groove", "s", groove=[[0.0, 0.0], [0.5, 0.0]])
    run = sandbox.run(scene_of(groove, method=method, ball=[ball("s", 0.25, 0.0, velocity=[1.0, 0.0])]), "reference")
    assert run.position[:, 0, 0].max() < 0.5 + 0.0011  # beyond by one step at 1 m/s
    assert run.position[-1, 0, 0] == pytest.approx(0.5, abs=2e-3)  # it does not rebound
    assert run.velocity[-1, 0] == pytest.approx([0.0, 0.0], abs=1e-3)


@every_method
def test_groove_in_a_free_body_conserves_momentum(method: str) -> None:
    groove = joint("groove", "a", "s", groove=[[-0.4, 0.0], [0.4, 0.0]])
    bodies = {"box": [box("a", 0, 0, angular_velocity=3.0)], "ball": [ball("s", 0.1, 0.0, mass=0.5)]}
    run = sandbox.run(scene_of(groove, method=method, **bodies), "reference")
    momentum = (run.velocity * np.asarray([0.5, 1.0])[:, None]).sum(axis=1)
    assert momentum == pytest.approx(np.zeros_like(momentum), abs=1e-12)  # rounding
    error = sandbox.run(scene_of(groove, method=method, **bodies), "reference", audit=True).info["joint_error"]
    assert error < 0.02


@pytest.mark.parametrize("gears", [False, True])
@pytest.mark.parametrize("torque", [None, 0.2])
def test_motor_and_gear_agree_with_pymunk(gears: bool, torque: float | None) -> None:
    """Both engines iterate over the same constraints in the same order with the same correction of errors."""
    runs = [sandbox.run(machine(None, gears, torque), engine) for engine in ("pymunk", "reference")]
    assert runs[1].angle == pytest.approx(runs[0].angle, abs=1e-9)  # rounding of 1,000 steps


def test_groove_agrees_with_pymunk() -> None:
    """The slider swings a bar in which it slides; pymunk clamps the impulse of a point, so passes differ."""
    joints = [joint("pivot", "a", at=[-0.5, 0.0]), joint("groove", "a", "s", groove=[[-0.4, 0.0], [0.5, 0.0]])]
    bodies = {"box": [box("a", 0, 0)], "ball": [ball("s", 0.1, 0.0, mass=0.5)]}
    runs = [sandbox.run(scene_of(*joints, gravity=9.81, **bodies), engine) for engine in ("pymunk", "reference")]
    early = runs[0].time < 0.3  # before the slider reaches the end of the groove
    assert runs[1].position[early] == pytest.approx(runs[0].position[early], abs=1e-6)  # passes that are left
    assert runs[1].position == pytest.approx(runs[0].position, abs=0.02)  # the impact at the end of the groove


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"between": ["a"]}, "joint[0].between"),
        ({"wheels": [[0.0, -1.0], [1.0, 0.0]]}, "joint[0].wheels[0]"),
        ({"ratio": 0.0}, "joint[0].ratio"),
    ],
)
def test_faults_of_pulleys_are_reported(change: dict[str, Any], path: str) -> None:
    pulley = {**joint("pulley", "a", "b", wheels=[[0.0, 0.0], [1.0, 0.0]]), **change}
    with pytest.raises(sandbox.SceneError) as caught:
        scene_of(pulley, gravity=10.0, ball=[ball("a", 0, -1), ball("b", 1, -6)])
    assert path in str(caught.value)


def test_last_constraint_of_a_groove_is_its_length() -> None:
    joints = select_joints(
        compile_joints(link(JointKind.ROD, -1, 0, 1.0), link(JointKind.GROOVE, -1, 0, 1.0)), *JointKind
    )
    assert joints.kind.tolist() == [JointKind.ROD, JointKind.GROOVE, GROOVE_ENDS]
    assert joints.joint.tolist() == [0, 1, 1]
