"""Check of a recorded game: its replay on the engine pymunk is compared with the states of the game after each step."""

from dataclasses import replace

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, state_hash
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.sessions import rerun
from sandbox.progress import ProgressCallback
from sandbox.pymunk_capture.game_capture import GameCapture
from sandbox.pymunk_capture.state_log import LoggedStep
from sandbox.recording import Recording, ReplayCheck
from sandbox.trajectory import Trajectory

ROUNDING = 1e-6
"""Departure that counts as more than rounding: of a position, and of a velocity times dt, in radii of the body; of an
angle in rad. Differences of the last bits are 1e-16 of a coordinate, or 1e-13 of a radius; chaos lets them grow."""


def checked_recording(captured: GameCapture, on_progress: ProgressCallback | None = None) -> Recording:
    """Return the recording of a game, with the comparison of its replay and hashes of the last states of both.

    Args:
        captured: the game, after its end.
        on_progress: progress callback of the replay.

    Raises:
        ValueError: no space has made a step, or the space cannot be a scene.
    """
    recording = captured.recording
    game = recording.game
    assert game is not None
    try:
        replay = rerun(recording, audit=False, on_progress=on_progress)
    except TooLargeError as error:
        return replace(recording, game=replace(game, replay=ReplayCheck(False, reason=str(error))))
    check = _check(captured, recording, replay)
    if replay.status != "ok":
        return replace(recording, game=replace(game, replay=check))
    reached: str = replay.info["state_hash"]
    own_hash = reached if check.is_equal else _hash_of_game(captured, replay)
    return replace(recording, state_hash=reached, game=replace(game, replay=check, state_hash=own_hash))


def _check(captured: GameCapture, recording: Recording, replay: Trajectory) -> ReplayCheck:
    """Compare a replay with its game."""
    rows = {str(name): row for row, name in enumerate(replay.names.tolist())}
    last = captured.log.last
    assert last is not None
    radius, dt = _radii(recording, replay), recording.settings.dt
    check = ReplayCheck(is_equal=captured.has_constant_step)
    # A replay whose step is not that of the game has the same time as the game at the end only.
    steps = [each for each in captured.log.steps if each.step < min(last.step, len(replay.time))]
    if replay.status == "ok":
        steps.append(last)
    for logged in steps if captured.has_constant_step else ():
        known = [rows[name] for name in logged.names]
        difference = _difference(replay, logged.step, logged, known)
        distance = _distances(difference)
        check = replace(
            check,
            is_equal=check.is_equal and not difference.any(),
            largest=max(check.largest or 0.0, float(distance.max(initial=0.0))),
        )
        if check.step is None and (departs := _departs(difference, radius[known], dt)).any():
            check = replace(check, step=logged.step, departed=logged.names[int(departs.argmax())])
    if (missing := captured.first_missing) is not None:
        step, name = missing
        check = replace(check, is_equal=False)
        if captured.has_constant_step and (check.step is None or step <= check.step):
            check = replace(check, step=step, departed=f"{name}, which is missing")
    if replay.status != "ok":
        return replace(check, is_equal=False, reason=replay.reason)
    moving = [k for k, name in enumerate(last.names) if not _is_fixed(recording, rows[name])]
    known = [rows[last.names[k]] for k in moving]
    distance = _distances(_difference(replay, len(replay.time) - 1, last, [rows[name] for name in last.names]))[moving]
    if not len(known) or not np.isfinite(last.states[moving]).all():
        return check
    worst = int(distance.argmax())
    return replace(check, body=last.names[moving[worst]], distance=float(distance[worst]))


def _is_fixed(recording: Recording, row: int) -> bool:
    bodies = recording.scene.bodies
    return row < len(bodies) and bool(bodies.fixed[row])


def _distances(difference: FloatArray) -> FloatArray:
    """Return the distances of bodies from the game, (N,) m; 0 where pymunk has computed no finite position."""
    distances: FloatArray = np.nan_to_num(np.hypot(difference[:, 0], difference[:, 1]))
    return distances


def _difference(replay: Trajectory, frame: int, logged: LoggedStep, known: list[int]) -> FloatArray:
    """Return the states of a replay minus those of the game, (N, 6); 0 for bodies that callbacks have set.

    These get the state of the game by an action, after the step.
    """
    states = np.column_stack(
        (
            replay.position[frame, known],
            replay.velocity[frame, known],
            replay.angle[frame, known],
            replay.angular_velocity[frame, known],
        )
    )
    difference: FloatArray = states - logged.states
    difference[list(logged.is_set)] = 0.0
    return difference


def _departs(difference: FloatArray, radius: FloatArray, dt: float) -> BoolArray:
    """Return which bodies have departed by more than rounding, (N,); those without finite states have."""
    limit = ROUNDING * radius
    distance = np.hypot(difference[:, 0], difference[:, 1])
    speed = np.hypot(difference[:, 2], difference[:, 3])
    turn = np.abs(difference[:, 4])
    close: BoolArray = (distance <= limit) & (speed * dt <= limit) & (turn <= ROUNDING)
    return ~close


def _radii(recording: Recording, replay: Trajectory) -> FloatArray:
    """Return the radius of each body of a replay, (N,) m; that of the smallest for bodies that are added."""
    own = np.asarray(recording.scene.bodies.radius, np.float64)
    smallest = float(own[own > 0.0].min(initial=np.inf))
    radii = np.full(len(replay.names), smallest if np.isfinite(smallest) else 1.0)
    radii[: len(own)] = np.where(own > 0.0, own, radii[: len(own)])
    return radii


def _hash_of_game(captured: GameCapture, replay: Trajectory) -> str:
    """Return the hash of the last frame of a replay, with the states of the bodies of the game."""
    last = captured.log.last
    assert last is not None
    rows = {str(name): row for row, name in enumerate(replay.names.tolist())}
    known = [rows[name] for name in last.names]
    arrays = [each[-1].copy() for each in (replay.position, replay.velocity, replay.angle, replay.angular_velocity)]
    for array, states in zip(arrays, np.split(last.states, (2, 4, 5), axis=1), strict=True):
        array[known] = states if array.ndim == 2 else states[:, 0]
    return state_hash(float(replay.time[-1]), [*arrays, np.isnan(replay.retired_time)])
