"""Runs: recorded frames, times of actions, ends of runs, and observation without side effects."""

import json
import math
import pickle
import re
from decimal import Decimal
from fractions import Fraction
from time import sleep
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.action import Action, Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.registry import UnknownEngineError, start
from sandbox.measure.missed_contacts.detector import Audit
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.runner import run
from sandbox.progress import Progress
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SettingsError
from sandbox.scene.files.load import from_document, loads
from sandbox.trajectory import RunFailedError, Trajectory

CROWD = """
title = "Crowd"
[world]
gravity = [0.0, -10.0]
duration = 0.8
seed = 4
[solver]
dt = 0.01
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
friction = 0.5
[[wall]]
points = [[2.0, 0.0], [2.0, 3.0]]
restitution = 0.9
[[grid]]
name = "g"
origin = [0.2, 0.3]
columns = 4
rows = 4
spacing = [0.3, 0.3]
jitter = 0.04
velocity_jitter = 2.0
radius = 0.1
restitution = 0.5
friction = 0.5
[[emitter]]
name = "e"
position = [0.0, 0.0]
count = 5
velocity_min = [-1.0, 1.0]
velocity_max = [1.0, 5.0]
"""
"""Balls with friction and spin that collide with a floor, a wall and each other, and sparks without collisions."""

FRAMES = ("time", "position", "velocity", "angle", "angular_velocity")
CONTACTS = ("contact_time", "contact_pair", "contact_point", "contact_normal", "contact_impulse")


def flight(duration: float, dt: float = 0.01, substeps: int = 1, every: int = 1, world: str = "") -> Scene:
    """Return a ball in free flight that starts at rest at (1, 2)."""
    return loads(
        f"[world]\nduration = {duration!r}\n{world}\n"
        f"[solver]\ndt = {dt!r}\nsubsteps = {substeps}\nrecord_every = {every}\n"
        '[[ball]]\nname = "a"\nposition = [1.0, 2.0]\nradius = 0.5\nmass = 2.0\n'
    )


def same(one: Trajectory, other: Trajectory, names: tuple[str, ...] = (*FRAMES, *CONTACTS)) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in names)


# Frames


steps_of_a_run = st.tuples(
    st.sampled_from(["0.01", "0.1", "0.003", "0.125", "0.016666666666666666", "0.0073"]),
    st.integers(0, 40),
    st.sampled_from(["0", "0", "0.5", "0.001", "0.999", "0.3333", "1e-6", "0.999999"]),
).filter(lambda t: t[1] > 0 or t[2] != "0")


@given(steps_of_a_run, st.integers(1, 4), st.integers(1, 45))
@example(("0.01", 0, "1e-6"), 1, 1)
@example(("0.1", 3, "0"), 1, 1)  # 0.3 / 0.1 = 2.9999999999999996
@example(("0.01", 30, "0.5"), 3, 30)
def test_frames_lie_at_multiples_of_dt_and_at_the_duration(steps, substeps, every):
    dt, whole, part = Decimal(steps[0]), steps[1], Decimal(steps[2])
    duration = float((whole + part) * dt)
    expected = [k * dt for k in range(0, whole + 1, every)]
    if part or whole % every:
        expected.append((whole + part) * dt)
    result = run(flight(duration, float(dt), substeps, every), "reference")
    assert len(result.time) == len(expected)
    assert result.time == pytest.approx([float(t) for t in expected], rel=1e-15)  # one rounding of k·dt
    assert (result.time[0], result.time[-1]) == (0.0, duration)
    assert result.info["steps"] == whole
    for name in FRAMES:
        assert len(getattr(result, name)) == len(expected)


@given(steps_of_a_run, st.integers(1, 4), st.integers(1, 45))
def test_partial_last_step_follows_the_scheme(steps: tuple[str, int, str], substeps: int, every: int) -> None:
    dt, end = Fraction(steps[0]), (steps[1] + Fraction(steps[2])) * Fraction(steps[0])
    scene = flight(float(end), float(dt), substeps, every, "gravity = [3.0, -10.0]")
    # Explicit Euler in exact arithmetic: between steps, positions move linearly with the previous velocity.
    h, time = dt / substeps, Fraction(0)
    position, velocity = [Fraction(1), Fraction(2)], [Fraction(0), Fraction(0)]
    while time < end:
        span = min(h, end - time)
        for axis, gravity in enumerate((3, -10)):
            position[axis] += velocity[axis] * span
            velocity[axis] += gravity * span
        time += span
    result = run(scene, "reference", integrator="explicit_euler")
    # 160 additions of numbers up to 30, each rounded by 4e-15 at most.
    assert result.position[-1, 0] == pytest.approx([float(x) for x in position], abs=1e-12)
    assert result.velocity[-1, 0] == pytest.approx([float(v) for v in velocity], abs=1e-12)  # likewise


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    ("duration", "every"), [(0.8, 2), (0.804, 7), (0.8, 79), (0.8099, 80), (0.804, 81), (0.8, 1000)]
)
def test_thinned_frames_are_a_subset_of_the_full_run(duration: float, every: int) -> None:
    scene = loads(CROWD, overrides=[("world.duration", duration)])
    full, thin = run(scene), run(scene, record_every=every)
    recorded = sorted({*range(0, 81, every), len(full.time) - 1})
    for name in FRAMES:
        assert np.array_equal(getattr(thin, name), getattr(full, name)[recorded])
    assert same(full, thin, (*CONTACTS, "missed_time", "missed_pair"))


def test_state_depends_on_the_substep_and_not_on_its_grouping() -> None:
    scene = loads(CROWD)
    fine, grouped = run(scene, dt=0.0078125), run(scene, dt=0.03125, substeps=4)  # powers of two: equal substeps
    at = np.searchsorted(fine.time, grouped.time[:-1])
    assert np.array_equal(fine.position[at], grouped.position[:-1])


# Observation has no side effects


def test_audit_and_contacts_do_not_change_the_state() -> None:
    scene = loads(CROWD)
    audited, plain = run(scene), run(scene, audit=False)
    assert same(audited, plain)
    assert len(audited.contact_time) > 10
    assert (audited.missed_contacts, plain.missed_contacts) == (len(audited.missed_time), None)
    bare = start(scene)
    for k in range(81):
        frame = bare.frame()
        for name in FRAMES[1:]:
            assert np.array_equal(getattr(frame, name), getattr(audited, name)[k])
        bare.step()


# Actions

ACTIONS: tuple[Action, ...] = (
    Impulse(time=0.105, body="g-1", impulse=(0.5, 1.0), angular=0.01),
    Force(time=0.2, body="e-1", force=(1.0, 2.0), torque=0.1),
    Move(time=0.25, body="g-16", position=(1.0, 2.0), velocity=(0.0, 1.0)),
    Spawn(time=0.3, ball=Ball(name="new", position=(0.5, 2.5), radius=0.1)),
    Remove(time=0.4, body="g-2"),
    SetParameter(time=0.5, path="world.gravity", value=[1.0, -5.0]),
    Force(time=0.6, body="e-1", force=(0.0, 0.0)),
)


@given(st.integers(0, 100), st.sampled_from(["0", "0.5"]))
def test_impulse_acts_from_the_first_step_at_or_after_its_time(thousandths: int, part: str) -> None:
    steps = 10 + Fraction(part)
    kick = Impulse(time=thousandths / 1000, body="a", impulse=(2.0, -4.0))
    result = run(flight(float(steps / 100)), "reference", actions=[kick])
    first = math.ceil(Fraction(thousandths, 10))  # index of the step
    for k, time in enumerate(result.time):
        after = max(Fraction(0), min(Fraction(k), steps) - first) / 100  # s since that step
        kicked = after > 0 or Fraction(k) == steps == first  # an impulse at the very end shows in the last frame
        assert result.velocity[k, 0].tolist() == ([1.0, -2.0] if kicked else [0.0, 0.0]), time
        # Ten additions of numbers up to 2.
        assert result.position[k, 0] == pytest.approx([1 + float(after), 2 - 2 * float(after)], abs=1e-14)


def test_actions_are_sorted_by_time_and_keep_their_order_at_equal_times() -> None:
    moves = [Move(time=t, body="a", position=(x, 0.0)) for t, x in ((0.05, 7.0), (0.02, 3.0), (0.02, 4.0))]
    result = run(flight(0.1), actions=moves)
    assert result.position[:, 0, 0].tolist() == [1.0] * 3 + [4.0] * 3 + [7.0] * 5


def test_actions_after_the_end_are_ignored() -> None:
    late = Spawn(time=0.101, ball=Ball(position=(0.0, 0.0), radius=1.0)), Remove(time=5.0, body="nobody")
    result = run(flight(0.1), actions=late)
    assert (result.status, result.names.tolist()) == ("ok", ["a"])
    assert same(result, run(flight(0.1)))


def test_actions_at_the_end_show_only_in_the_last_frame() -> None:
    result = run(flight(0.1), actions=[Spawn(time=0.1, ball=Ball(name="b", position=(3.0, 4.0), radius=1.0))])
    assert result.names.tolist() == ["a", "b"]
    assert np.isnan(result.position[:-1, 1]).all()
    assert result.position[-1, 1].tolist() == [3.0, 4.0]


# Added and retired bodies


def test_retired_body_keeps_its_position_and_is_reported() -> None:
    scene = flight(1.0, 0.1, world="bounds = [[0.0, 0.0], [1.45, 5.0]]")
    result = run(scene, actions=[Impulse(time=0.0, body="a", impulse=(2.0, 0.0))])
    assert result.status == "ok"
    assert result.retired_time.tolist() == [0.5]
    retired = result.time >= 0.5
    assert (result.position[retired] == result.position[5]).all()
    assert result.position[5, 0, 0] == pytest.approx(1.5, rel=1e-15)  # five additions
    assert not result.velocity[retired].any()
    assert (result.velocity[~retired][1:, 0, 0] == 1.0).all()


def test_removed_body_keeps_its_position_and_is_reported() -> None:
    kick = Impulse(time=0.0, body="a", impulse=(2.0, 0.0))
    result = run(flight(1.0, 0.1), actions=[kick, Remove(time=0.3, body="a")])
    assert result.retired_time.tolist() == [pytest.approx(0.3, rel=1e-15)]  # 3·0.1
    assert (result.position[3:] == result.position[3]).all()
    assert not result.velocity[4:].any()


def test_spawned_body_is_nan_before_it_is_added() -> None:
    ball = Ball(name="b", position=(5.0, 5.0), velocity=(1.0, 0.0), radius=0.1, angular_velocity=2.0)
    result = run(flight(1.0, 0.1), actions=[Spawn(time=0.35, ball=ball)])
    assert result.names.tolist() == ["a", "b"]
    for array in (result.position, result.velocity, result.angle, result.angular_velocity):
        assert np.isnan(array[:5, 1]).all()  # it is added with the step that starts at 0.4 s
        assert not np.isnan(array[5:, 1]).any()
        assert not np.isnan(array[:, 0]).any()
    assert result.position[5, 1].tolist() == [5.1, 5.0]
    assert np.isnan(result.retired_time).all()
    assert math.isfinite(result.info["energy_end"])


# Ends of runs


def test_run_info_has_scene_settings_actions_and_results() -> None:
    scene = loads(CROWD)
    result = run(scene, actions=ACTIONS, dt=0.02)
    info = json.loads(json.dumps(dict(result.info), allow_nan=False))
    assert set(info) >= {
        "scene", "engine", "settings", "actions", "seed", "versions", "status", "reason", "steps", "seconds",
        "energy_start", "energy_end", "joint_error", "audited",
    }  # fmt: skip
    assert from_document(info["scene"]) == scene
    assert (info["engine"], info["seed"]) == ("pymunk", 4)
    assert (info["status"], info["reason"], info["steps"]) == ("ok", None, 40)
    settings = Settings.model_validate_json(json.dumps(info["settings"]))
    assert (settings.dt, settings.slop, settings.integrator) == (0.02, 0.001, "explicit_euler")
    assert len(info["actions"]) == len(ACTIONS)
    assert {"python", "pymunk", "numpy", "sandbox"} <= set(info["versions"])
    assert (info["seconds"] > 0, info["audited"]) == (True, True)


def test_diverging_run_keeps_its_frames() -> None:
    # 9.5e11 m/s a step: just allowed, and out of range with the eleventh.
    push = Force(time=0.3, body="a", force=(1.9e13, 0.0))
    result = run(flight(2.0, 0.1, every=2), actions=[push])
    assert (result.status, result.info["steps"]) == ("diverged", 13)
    assert result.reason == "at 1.4 s: 'a' is not finite, or is out of range"
    assert result.time == pytest.approx(np.arange(8) * 0.2, rel=1e-15)  # k·dt
    assert result.velocity[-1, 0, 0] == pytest.approx(11 * 9.5e11)
    assert result.info["energy_start"] == 0.0


@pytest.mark.parametrize(
    ("action", "reason"),
    [
        (Remove(time=0.05, body="b"), "at 0.05 s: no body is named 'b'"),
        (SetParameter(time=0.05, path="solver.dt", value=1.0), "at 0.05 s: 'solver.dt' cannot be changed"),
    ],
)
def test_invalid_action_fails_the_run_and_keeps_its_frames(action: Action, reason: str) -> None:
    for every, times in ((1, [0.0, 0.01, 0.02, 0.03, 0.04, 0.05]), (5, [0.0, 0.05]), (3, [0.0, 0.03, 0.05])):
        result = run(flight(0.1, every=every), actions=[action])
        assert (result.status, result.info["steps"]) == ("failed", 5)
        assert result.reason.startswith(reason)
        assert result.time == pytest.approx(times, rel=1e-15)  # k·dt


def test_refused_run_has_no_frames() -> None:
    result = run(loads(CROWD), integrator="rk4")
    assert result.status == "refused"
    assert result.reason is not None
    assert "integrator 'rk4'" in result.reason
    assert (result.time.shape, result.position.shape, result.angle.shape) == ((0,), (0, 21, 2), (0, 21))
    assert (result.info["steps"], result.info["energy_end"], result.missed_contacts) == (0, None, None)


def test_unknown_engine_and_invalid_settings_raise() -> None:
    scene = flight(0.1)
    with pytest.raises(UnknownEngineError, match="unknown engine 'none'; engines: pymunk"):
        run(scene, "none")
    for wrong, message in (
        ({"dt": -1.0}, "solver.dt: must be more than 0, is -1"),
        ({"dt": "0.1"}, 'solver.dt: must be a number, is "0.1"'),
        ({"dt": math.inf}, "solver.dt: must be a finite number, is Infinity"),
        ({"zzz": 1}, "solver.zzz: unknown key; known: dt, "),
        ({"substeps": 1.5}, "solver.substeps: must be a whole number, is 1.5"),
    ):
        with pytest.raises(SettingsError) as caught:
            run(scene, **wrong)
        assert str(caught.value).startswith(f"settings: {message}")


@pytest.mark.fail_slow(60)  # takes over half a second
def test_run_too_large_for_memory_is_rejected_before_its_first_step() -> None:
    states: list[Progress] = []
    scene = loads("[world]\nduration = 1.0\n[[grid]]\norigin = [0, 0]\ncolumns = 10000\nspacing = [3, 3]\nradius = 1\n")
    with pytest.raises(TooLargeError, match=r"solver\.record_every = \d+ would fit"):
        run(scene, dt=1e-9, on_progress=states.append)
    assert states == []


def test_progress_increases_to_1() -> None:
    states: list[Progress] = []
    run(loads(CROWD), on_progress=states.append)
    fractions = [state.fraction for state in states if state.fraction is not None]
    assert fractions[-1] == 1.0
    assert fractions == sorted(fractions)
    assert fractions[0] > 0.0


# Runs that do not reach their end


@pytest.mark.parametrize(
    ("settings", "actions", "status"),
    [
        ({"integrator": "rk4"}, (), "refused"),
        ({}, (Force(time=0.0, body="a", force=(1e14, 0.0)),), "diverged"),
        ({}, (Remove(time=0.1, body="a"), Impulse(time=0.2, body="a", impulse=(1.0, 0.0))), "failed"),
    ],
)
def test_run_that_is_not_ok_raises_only_if_asked(
    settings: dict[str, Any], actions: tuple[Action, ...], status: str
) -> None:
    done = run(flight(1.0), "pymunk", actions=actions, **settings)
    assert done.status == status
    with pytest.raises(RunFailedError, match=f"^pymunk: {status}: ") as caught:
        done.raise_if_failed()
    assert caught.value.run is done
    assert pickle.loads(pickle.dumps(caught.value)).run.reason == done.reason
    with pytest.raises(RunFailedError, match=re.escape(str(done.reason))):
        run(flight(1.0), "pymunk", actions=actions, strict=True, **settings)


def test_run_that_is_ok_is_returned_by_raise_if_failed() -> None:
    done = run(flight(1.0), strict=True)
    assert done.raise_if_failed() is done


def test_compilation_during_the_audit_is_left_out_of_the_time_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The time of a run is that of the engine: what it does in a moment cannot become negative."""
    original, compiled = Audit.__call__, []

    def compiling(self: Audit, *substep: Any) -> None:
        if not compiled:
            COMPILE_CLOCK.begin("test")
            sleep(0.3)  # s, more than the engine takes
            COMPILE_CLOCK.end()
            compiled.append(True)
        original(self, *substep)

    monkeypatch.setattr(Audit, "__call__", compiling)
    scene = from_document({"world": {"duration": 0.1}, "ball": [{"position": [0.0, 0.0], "radius": 0.5}]})
    done = run(scene, "pymunk")
    assert compiled
    assert done.info["seconds"] > 0.0
