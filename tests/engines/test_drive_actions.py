"""Drives in a running scene: checkpoints, switches, replay, refusals and removal."""

import math

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Impulse, Move, Pull, Remove, SetParameter, Spawn, Switch
from sandbox.engines import switching
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Refusal
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.description.discs import Ball
from tests.engines.flippers import ball, flipper, press, scene
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

TABLES = flipper(), {"ball": [ball(0.05, 0.2)]}
PLUNGER = {
    "box": [{"name": "rod", "size": [0.02, 0.1], "position": [1.0, 0.0]}],
    "drive": [{"name": "flip", "kind": "plunger", "body": "rod", "direction": [0, 1], "travel": 0.1, "speed": 1.0}],
}


@pytest.mark.parametrize("tables", [TABLES, (PLUNGER,)], ids=["torque", "plunger"])
@pytest.mark.parametrize("at", [25, 40, 80])
def test_resumed_checkpoint_is_bit_identical(start, tables, at):
    """Pressed at 0 and released at 70 ms: checkpoints in every phase of a stroke."""

    def step_with_stroke(simulation, k):
        if k in (0, 70):
            press(simulation, float(k == 0))
        simulation.step()

    first = start(scene(*tables, gravity=(0.0, -0.77)))
    for k in range(at):
        step_with_stroke(first, k)
    second = SwitchableSimulation.resumed(first.checkpoint())
    assert second.state_hash() == first.state_hash()
    for k in range(at, 200):
        step_with_stroke(first, k)
        step_with_stroke(second, k)
        assert second.state_hash() == first.state_hash(), k


def test_level_and_torque_are_part_of_the_state(start):
    simulation, other = start(scene(flipper())), start(scene(flipper()))
    assert simulation.state_hash() == other.state_hash()
    press(simulation)
    assert simulation.state_hash() != other.state_hash()
    np.testing.assert_array_equal(advance(simulation, 15).frame().drives, [[1.0, 0.5 * 0.513, 0.0]])


@pytest.mark.parametrize("at", [10, 36, 80])
def test_engine_switch_during_a_stroke_changes_nothing(start, engine, at):
    """Both engines use the same drive law; pymunk rounds angular velocities of up to 75 rad/s when it adds impulses."""
    simulation, other = start(scene(flipper(), gravity=(0.0, -0.77))), start(scene(flipper(), gravity=(0.0, -0.77)))
    for k in range(300):
        for each in (simulation, other):
            if k in (0, 70):
                press(each, float(k == 0))
        if k == at:
            simulation.apply(Switch(time=0.0, engine="reference" if engine == "pymunk" else "pymunk"))
        simulation.step()
        other.step()
        found, expected = simulation.frame(), other.frame()
        for key in ("angle", "angular_velocity", "drives"):
            np.testing.assert_allclose(getattr(found, key), getattr(expected, key), rtol=1e-13, atol=1e-12)
        np.testing.assert_allclose(found.position, expected.position, atol=1e-14)


ROD = {"joint": [{"kind": "rod", "between": ["bat"], "anchors": [[0.0, 0.0], [0.1, 0.1]]}]}
SUN = {"attraction": [{"toward": [0.0, 1.0], "strength": 1.0}]}


@pytest.mark.parametrize(
    ("solver", "more", "reason"),
    [
        ({"detection": "bisect"}, {}, "does not support drives"),
        ({"detection": "swept"}, {}, "does not support drives"),
        ({}, ROD, "a joint to 'bat', whose motion the drive 'flip' prescribes"),
        ({}, SUN, "attraction and drives together"),
    ],
    ids=["bisect", "swept", "joint", "attraction"],
)
def test_reference_refuses_drives_with_unsupported_features(solver, more, reason):
    with pytest.raises(Refusal, match=reason):
        switching.start(scene(flipper(), more, **solver), "reference")


def test_partial_step_follows_the_torque():
    full, partial = (switching.start(scene(flipper()), "reference") for _ in range(2))
    for simulation in (full, partial):
        press(simulation)
        advance(simulation, 20)
    before = full.frame()
    full.step()
    partial.finish(0.25)
    after, between = full.frame(), partial.frame()
    old, new = before.drives, after.drives
    np.testing.assert_allclose(between.drives, old + 0.25 * (new - old), rtol=1e-12)
    rate = 0.513 / 0.030 / (0.080 * 0.0702**2 / 3.0)  # rate of the angular acceleration, rad/s³
    for key, power in (("angle", 3), ("angular_velocity", 2)):
        expected = rate * 0.02025**power / math.factorial(power) + (key == "angle") * before.angle
        expected -= (key == "angle") * rate * 0.02**3 / 6.0
        # Angles: a torque that grows within the step acts by its mean, an error of rate·h³/12
        np.testing.assert_allclose(getattr(between, key), expected, atol=rate * 0.25e-3**3 / 6.0 + 1e-12)
    arm = np.hypot(*before.position[0])  # about the origin, where the hinge is
    np.testing.assert_allclose(np.hypot(*between.position[0]), arm, rtol=1e-14)  # on the arc, not on its chord
    across = between.angular_velocity[0] * np.array([-between.position[0, 1], between.position[0, 0]])
    np.testing.assert_allclose(between.velocity[0], across, rtol=1e-13)


def test_ledger_closes_over_a_partial_step(start):
    simulation = start(scene(flipper(), gravity=(0.0, -9.81)))
    simulation.account()
    press(simulation)
    advance(simulation, 20)
    simulation.finish(0.77)
    booked, energy = sum(simulation.account().values()), total_energy(simulation)
    assert energy > 0.03  # J, during the stroke
    start_energy = total_energy(start(scene(flipper(), gravity=(0.0, -9.81))))
    assert abs(energy - start_energy - booked) < 1e-14  # J, rounding of 0.1 J


@pytest.mark.parametrize(
    "action",
    [
        Move(time=0.0, body="bat", position=(1.0, 0.0)),
        Impulse(time=0.0, body="bat", impulse=(1.0, 0.0)),
        Pull(time=0.0, body="bat", target=(1.0, 0.0)),
    ],
    ids=lambda action: action.kind,
)
def test_actions_that_move_a_driven_body_are_refused(start, action):
    simulation = start(scene(flipper()))
    before = simulation.state_hash()
    with pytest.raises(ActionError, match="'bat' is held by its drive"):
        simulation.apply(action)
    assert simulation.state_hash() == before


def test_unknown_drive_is_refused_by_name(start):
    with pytest.raises(ActionError, match="no drive is named 'flop'; known names: flip"):
        press(start(scene(flipper())), drive="flop")


def test_flipper_can_be_removed_and_bodies_added(start):
    simulation = start(scene(*TABLES, gravity=(0.0, -0.77)))
    press(simulation)
    simulation.apply(Spawn(time=0.0, ball=Ball(name="new", position=(0.06, 0.1), radius=0.01)))
    simulation.apply(SetParameter(time=0.0, path="polygon.bat.restitution", value=0.1))
    simulation.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, -9.81]))
    assert advance(simulation, 40).frame().angle[1] > 0.0
    simulation.apply(Remove(time=0.0, body="bat"))
    press(simulation, 0.0)
    frame = advance(simulation, 20).frame()
    assert frame.present.tolist() == [True, False, True]
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    assert advance(resumed, 5).frame().present.tolist() == [True, False, True]


def test_drive_does_not_affect_bodies_that_miss_it(engine):
    """A ball that does not hit the flipper flies bit-identically to a scene without a drive."""
    wall = {"points": [[-5, 0.3], [5, 0.3]], "restitution": 1.0}
    others = {"ball": [ball(0.05, 0.5, 1.0, restitution=0.9)], "wall": [wall]}
    driven = sandbox.run(scene(flipper(), others, gravity=(0.0, -0.77)), engine)
    fixed = flipper()
    del fixed["drive"]
    fixed["polygon"][0]["fixed"] = True
    undriven = sandbox.run(scene(fixed, others, gravity=(0.0, -0.77)), engine)
    np.testing.assert_array_equal(driven.position[:, 0], undriven.position[:, 0])


@pytest.mark.parametrize("drag", [0.0, 0.5])
def test_gravity_and_drag_do_not_move_a_hinge(start, drag):
    """A level flipper with a weak drive torque falls by τ = m g d; drag has no effect."""
    tables = flipper(torque=1e-9, ramp=0.0, stops=[-0.5, 0.5], angle=0.0)
    scene_with_drive = scene(tables, gravity=(0.0, -9.81))
    world = scene_with_drive.world.model_copy(update={"linear_drag": drag})
    simulation = start(scene_with_drive.model_copy(update={"world": world}))
    arm, moment = float(simulation.bodies.position[0, 0]), 0.080 * 0.0702**2 / 3.0
    frame = advance(simulation, 10).frame()
    rate = -0.080 * 9.81 * arm / moment
    assert frame.angular_velocity[0] == pytest.approx(rate * 0.01, rel=1e-3)  # cos of 1 mrad and less
    assert math.hypot(*frame.position[0]) == pytest.approx(arm, rel=1e-14)
