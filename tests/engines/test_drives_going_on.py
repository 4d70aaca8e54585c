"""Drives as part of a running scene: what is known of them is handed over, replayed, refused, taken away."""

import math

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Drive, Impulse, Move, Pull, Remove, SetParameter, Spawn, Switch
from sandbox.engines import switching as relay
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Refusal
from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import dumps, loads
from tests.engines.flippers import END, ball, bat, press, scene

pytestmark = pytest.mark.full  # long runs and sweeps

TABLES = bat(), {"ball": [ball(0.05, 0.2)]}
LEVER = {
    "box": [{"name": "rod", "size": [0.02, 0.1], "position": [1.0, 0.0]}],
    "drive": [
        {"name": "flip", "kind": "plunger", "body": "rod", "direction": [0, 1], "travel": 0.1, "speed": 1.0},
    ],
}


def stepped(running, steps):
    for _ in range(steps):
        running.step()
    return running.frame()


@pytest.mark.parametrize("tables", [TABLES, (LEVER,)], ids=["torque", "plunger"])
@pytest.mark.parametrize("at", [5, 25, 33, 40, 60, 80, 130])
def test_checkpoint_goes_on_bit_for_bit(start, tables, at):
    """Pressed at 0, let go at 70 ms: in every phase of a stroke."""

    def pressed(running, k):
        if k in (0, 70):
            press(running, float(k == 0))
        running.step()

    first = start(scene(*tables, gravity=(0.0, -0.77)))
    for k in range(at):
        pressed(first, k)
    second = SwitchableSimulation.resumed(first.checkpoint())
    assert second.state_hash() == first.state_hash()
    for k in range(at, 200):
        pressed(first, k)
        pressed(second, k)
        assert second.state_hash() == first.state_hash(), k


def test_level_and_torque_are_part_of_the_state(start):
    running, other = start(scene(bat())), start(scene(bat()))
    assert running.state_hash() == other.state_hash()
    press(running)
    assert running.state_hash() != other.state_hash()
    np.testing.assert_array_equal(stepped(running, 15).drives, [[1.0, 0.5 * 0.513, 0.0]])


def test_switch_takes_level_and_torque_along(start):
    running, other = start(scene(bat())), start(scene(bat()))
    for each in (running, other):
        press(each)
        stepped(each, 20)
    running.apply(Switch(time=0.0, settings={"iterations": 20}))
    assert stepped(running, 20).state_hash() == stepped(other, 20).state_hash()
    with pytest.raises(ActionError, match="does not model drives"):
        running.apply(Switch(time=0.0, engine="exact"))


@pytest.mark.parametrize("at", [10, 30, 36, 60, 80, 130, 250])
def test_switch_of_engine_amid_a_stroke_changes_nothing(start, engine, at):
    """Both turn the bat by the same law; pymunk rounds spins, up to 75 rad/s, as it adds what kicks them."""
    running, other = start(scene(bat(), gravity=(0.0, -0.77))), start(scene(bat(), gravity=(0.0, -0.77)))
    for k in range(300):
        for each in (running, other):
            if k in (0, 70):
                press(each, float(k == 0))
        if k == at:
            running.apply(Switch(time=0.0, engine="reference" if engine == "pymunk" else "pymunk"))
        running.step()
        other.step()
        now, told = running.frame(), other.frame()
        for key in ("angle", "angular_velocity", "drives"):
            np.testing.assert_allclose(getattr(now, key), getattr(told, key), rtol=1e-13, atol=1e-12)
        np.testing.assert_allclose(now.position, told.position, atol=1e-14)


def test_engine_without_drives_refuses():
    assert Demand.DRIVES in demands(scene(bat()))
    with pytest.raises(Refusal, match="does not model drives"):
        relay.start(scene(bat()), "exact")


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
def test_reference_says_with_what_it_has_no_drives(solver, more, reason):
    with pytest.raises(Refusal, match=reason):
        relay.start(scene(bat(), more, **solver), "reference")


def test_recorded_strokes_are_replayed_to_the_same_state(engine):
    made = scene(*TABLES, gravity=(0.0, -0.77))
    actions = tuple(Drive(time=t, drive="flip", level=level) for t, level in ((0.1, 1.0), (0.2, 0.0), (0.32, 0.6)))
    run = sandbox.run(made, engine, actions=actions)
    again = sandbox.run(loads(dumps(made)), engine, actions=actions)
    assert run.info["state_hash"] == again.info["state_hash"]
    assert run.angle[:, 1].max() == END


def test_cut_step_ends_between_its_ends(engine, start):
    whole, cut = start(scene(bat())), start(scene(bat()))
    for running in (whole, cut):
        press(running)
        stepped(running, 20)
    before = whole.frame()
    whole.step()
    cut.finish(0.25)
    after, between = whole.frame(), cut.frame()
    old, new = before.drives, after.drives
    np.testing.assert_allclose(between.drives, old + 0.25 * (new - old), rtol=1e-12)
    rate = 0.513 / 0.030 / (0.080 * 0.0702**2 / 3.0)  # of its angular acceleration, rad/s³
    for key, power in (("angle", 3), ("angular_velocity", 2)):
        old, new = getattr(before, key), getattr(after, key)
        line = old + 0.25 * (new - old)
        if engine == "pymunk":  # which takes no other than whole steps
            np.testing.assert_allclose(getattr(between, key), line, rtol=1e-12)
        else:
            told = rate * 0.02025**power / math.factorial(power) + (key == "angle") * before.angle
            told -= (key == "angle") * rate * 0.02**3 / 6.0
            # Angles: a torque that grows within the step is taken at its mean, which leaves rate·h³/12
            np.testing.assert_allclose(getattr(between, key), told, atol=rate * 0.25e-3**3 / 6.0 + 1e-12)
    arm = np.hypot(*before.position[0])  # about the origin, where the hinge is
    np.testing.assert_allclose(np.hypot(*between.position[0]), arm, rtol=1e-14)  # on the arc, not on its chord
    across = between.angular_velocity[0] * np.array([-between.position[0, 1], between.position[0, 0]])
    np.testing.assert_allclose(between.velocity[0], across, rtol=1e-13)


def test_account_closes_where_a_step_is_cut(start):
    running = start(scene(bat(), gravity=(0.0, -9.81)))
    running.account()
    press(running)
    stepped(running, 20)
    running.finish(0.77)
    booked, energy = sum(running.account().values()), total_energy(running)
    assert energy > 0.03  # J, amid the stroke
    start_energy = total_energy(start(scene(bat(), gravity=(0.0, -9.81))))
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
def test_nothing_but_its_drive_moves_a_driven_body(start, action):
    running = start(scene(bat()))
    before = running.state_hash()
    with pytest.raises(ActionError, match="'bat' is held by its drive"):
        running.apply(action)
    assert running.state_hash() == before


def test_drive_of_no_such_name(start):
    with pytest.raises(ActionError, match="no drive is named 'flop'; known names: flip"):
        press(start(scene(bat())), drive="flop")


def test_bat_can_be_taken_away_and_others_join(start):
    running = start(scene(*TABLES, gravity=(0.0, -0.77)))
    press(running)
    running.apply(Spawn(time=0.0, ball=Ball(name="new", position=(0.06, 0.1), radius=0.01)))
    running.apply(SetParameter(time=0.0, path="polygon.bat.restitution", value=0.1))
    running.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, -9.81]))
    assert stepped(running, 40).angle[1] > 0.0
    running.apply(Remove(time=0.0, body="bat"))
    press(running, 0.0)
    frame = stepped(running, 20)
    assert frame.present.tolist() == [True, False, True]
    resumed = SwitchableSimulation.resumed(running.checkpoint())
    assert stepped(resumed, 5).present.tolist() == [True, False, True]


def test_other_bodies_do_not_feel_that_there_is_a_drive(engine):
    """A ball that meets no bat flies as in a scene without, bit for bit."""
    wall = {"points": [[-5, 0.3], [5, 0.3]], "restitution": 1.0}
    own = {"ball": [ball(0.05, 0.5, 1.0, restitution=0.9)], "wall": [wall]}
    with_bat = sandbox.run(scene(bat(), own, gravity=(0.0, -0.77)), engine)
    fixed = bat()
    del fixed["drive"]
    fixed["polygon"][0]["fixed"] = True
    without = sandbox.run(scene(fixed, own, gravity=(0.0, -0.77)), engine)
    np.testing.assert_array_equal(with_bat.position[:, 0], without.position[:, 0])


@pytest.mark.parametrize("drag", [0.0, 0.5])
def test_gravity_and_air_do_not_move_a_hinge(start, drag):
    """Level with its hinge, at a weak torque: τ = m g d falls it; drag is not felt."""
    tables = bat(torque=1e-9, ramp=0.0, stops=[-0.5, 0.5], angle=0.0)
    made = scene(tables, gravity=(0.0, -9.81))
    world = made.world.model_copy(update={"linear_drag": drag})
    running = start(made.model_copy(update={"world": world}))
    arm, moment = float(running.bodies.position[0, 0]), 0.080 * 0.0702**2 / 3.0
    frame = stepped(running, 10)
    rate = -0.080 * 9.81 * arm / moment
    assert frame.angular_velocity[0] == pytest.approx(rate * 0.01, rel=1e-3)  # cos of 1 mrad and less
    assert math.hypot(*frame.position[0]) == pytest.approx(arm, rel=1e-14)


def test_session_with_drives_is_recorded(engine, start, tmp_path):
    made = scene(*TABLES, gravity=(0.0, -0.77))
    running = start(made)
    press(running)
    frame = stepped(running, 60)
    actions = (Drive(time=0.0, drive="flip", level=1.0),)
    recording = Recording(made, engine, running.settings, actions, 0.06, frame.state_hash())
    path = recording.save(tmp_path / "session.json")
    assert rerun(Recording.load(path)).info["state_hash"] == frame.state_hash()
