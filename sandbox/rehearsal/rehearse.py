"""Rehearsals: a game runs again with recorded inputs, in a process of its own, without a window."""

import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.game_inputs import GameInputs, inputs_to_json
from sandbox.rehearsal.space_log import GameCallback, GameChange, GameShape
from sandbox.rehearsal.step_settings import Nudge, RehearsalSettings
from sandbox.worker_process import ProcessEndedError, WorkerProcess, exit_text

DEFAULT_TIME_LIMIT = 300.0
"""s"""
DEFAULT_MEMORY_LIMIT = 4096
"""MiB"""
MAX_OUTPUT = 20_000
"""Characters of what a game prints that are kept"""


_running: set[WorkerProcess] = set()


class RehearsalError(Exception):
    """A rehearsal has no result."""


class CallbackCalls(NamedTuple):
    """Calls of a callback for two shapes in one frame."""

    frame: int
    callback: int
    """number of the callback"""
    shapes: tuple[int, int]
    """numbers of the shapes, in the order in which the game adds them to its spaces"""
    calls: int
    """calls in the frame"""


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """Run of a game with recorded inputs."""

    settings: RehearsalSettings
    offsets: IntArray
    """(F + 1,) first row of each frame in `bodies` and `states`"""
    bodies: IntArray
    """(R,) numbers of the bodies, in the order in which the game adds them to its spaces; ascending in each frame"""
    states: FloatArray
    """(R, 6) x, y, angle, velocity and angular velocity at the end of each frame, in units of the game"""
    callbacks: tuple[GameCallback, ...]
    calls: tuple[CallbackCalls, ...]
    """calls of callbacks, in order"""
    shape_bodies: Mapping[int, int]
    """number of the body of each shape; -1 for the static body of a space"""
    shapes: Mapping[int, GameShape]
    """form of each shape, when the game adds it"""
    changes: tuple[GameChange, ...]
    """bodies and joints that the game adds and removes, in order"""
    shape_changes: tuple[tuple[int, bool, int], ...]
    """frame, whether it is added, and number of each shape that the game adds or removes after the first step"""
    body_names: Mapping[int, str]
    """names of bodies by number, as far as the game has variables for them"""
    own_settings: Mapping[str, float]
    """settings of the space that makes the first step, by the names of `RehearsalSettings`"""
    gravity: tuple[float, float]
    """gravity of that space, in units of the game per s²"""
    window: tuple[int, int] | None
    """size of the window at the first step, px; None without a window"""
    dts: tuple[float, float, float]
    """least, median and largest argument of `Space.step`, s"""
    step_calls: tuple[tuple[str, int], ...]
    """file and line of each call of `Space.step`, the most frequent first"""
    has_forces: bool
    """whether the game applies forces for a step; known from runs with substeps only"""
    impulse_readers: tuple[int, ...]
    """numbers of the callbacks that read the impulse or the energy of a contact"""
    hashes: tuple[str, ...]
    """hash of the states at the end of each frame"""
    steps: int
    """calls of `Space.step` by the game"""
    ended: str
    """`program` if it ended by itself, `inputs` if the recorded inputs had ended, `error` if it failed"""
    failure: str | None
    """exception that ended it; None if none did"""
    seconds: float
    """processor time of the run, without the start of the process, s"""
    step_seconds: float
    """processor time of `Space.step`, with the callbacks of the game, s"""
    output: str = field(repr=False)
    """what the game printed"""
    notes: tuple[str, ...] = ()
    """what the game did that a rehearsal does not have"""

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.offsets) - 1

    def body_name(self, number: int) -> str:
        """Return the name of a body: that of its variable in the game, or its number."""
        return self.body_names.get(number, f"body {number}")

    def frame(self, number: int) -> tuple[IntArray, FloatArray]:
        """Return the numbers of the bodies and their states at the end of a frame."""
        rows = slice(self.offsets[number], self.offsets[number + 1])
        return self.bodies[rows], self.states[rows]


def rehearse(
    program: str | Path,
    inputs: GameInputs,
    settings: RehearsalSettings | None = None,
    *,
    nudge: Nudge | None = None,
    jitter_seed: int | None = None,
    draws: bool = True,
    time_limit: float = DEFAULT_TIME_LIMIT,
    memory_limit: int = DEFAULT_MEMORY_LIMIT,
) -> Rehearsal:
    """Run a game again with recorded inputs, in a process of its own.

    Args:
        program: path of the program.
        inputs: its inputs.
        settings: that replace those of the game; default: its own.
        nudge: displacement of all bodies before the first step; default: none.
        jitter_seed: seed of delays of the inputs by up to a frame; default: no delays.
        draws: whether the game draws. Without, it shows an empty window, which is faster.
        time_limit: processor time of the process, and wall-clock time of the run, s.
        memory_limit: address space of the process, MiB.

    Raises:
        RehearsalError: the process has exceeded a limit, or has ended without a result.
    """
    settings = settings or RehearsalSettings()
    with tempfile.TemporaryDirectory(prefix="rehearsal-") as folder:
        scratch = Path(folder)
        (scratch / "inputs.json").write_text(json.dumps({"inputs": inputs_to_json(inputs)}), encoding="utf-8")
        request = {
            "program": str(program),
            "inputs": str(scratch / "inputs.json"),
            "states": str(scratch / "states.npz"),
            "scratch": folder,
            "settings": asdict(settings),
            "nudge": None if nudge is None else asdict(nudge),
            "jitter_seed": jitter_seed,
            "draws": draws,
            "time_limit": time_limit,
            "memory_limit": memory_limit,
        }
        command = [sys.executable, "-m", "sandbox.rehearsal.worker"]
        process = WorkerProcess(command, {"PYTHONHASHSEED": inputs.hash_seed or "0"})
        _running.add(process)
        try:
            process.send(request)
            answer = process.receive(time_limit)
            output = process.error_output()
        except TimeoutError:
            raise RehearsalError(f"it has not ended within {time_limit:g} s") from None
        except ProcessEndedError:
            lines = process.error_output().strip().splitlines()
            reason = f": {lines[-1]}" if lines else ""
            raise RehearsalError(f"{exit_text(process.exit_code())}{reason}") from None
        finally:
            _running.discard(process)
            process.end()
        return _rehearsal(settings, answer, scratch / "states.npz", output)


def kill_rehearsals() -> None:
    """Kill all rehearsals that run, in whichever thread: each raises `RehearsalError`."""
    for process in list(_running):
        process.kill()


def _rehearsal(settings: RehearsalSettings, answer: dict[str, Any], states: Path, output: str) -> Rehearsal:
    with np.load(states) as arrays:
        return Rehearsal(
            settings,
            arrays["offsets"],
            arrays["bodies"],
            arrays["states"],
            tuple(GameCallback(*each) for each in answer["callbacks"]),
            tuple(CallbackCalls(frame, kind, (a, b), count) for frame, kind, a, b, count in answer["calls"]),
            dict(answer["shape_bodies"]),
            {
                number: GameShape(kind, tuple(map(tuple, points)), *rest)
                for number, (kind, points, *rest) in answer["shapes"]
            },
            tuple(GameChange(*each) for each in answer["changes"]),
            tuple((frame, is_added, number) for frame, is_added, number in answer["shape_changes"]),
            dict(answer["body_names"]),
            answer["own_settings"],
            tuple(answer["gravity"]),
            None if answer["window"] is None else tuple(answer["window"]),
            tuple(answer["dts"]),
            tuple((file, line) for file, line in answer["step_calls"]),
            answer["has_forces"],
            tuple(answer["impulse_readers"]),
            tuple(answer["hashes"]),
            answer["steps"],
            answer["ended"],
            answer["failure"],
            answer["seconds"],
            answer["step_seconds"],
            output[-MAX_OUTPUT:],
            tuple(answer["notes"]),
        )


def densely_numbered(runs: Mapping[str, Rehearsal]) -> dict[str, Rehearsal]:
    """Return runs whose bodies have numbers from 0 on, without gaps, in the same order and equal in all runs."""
    numbers = np.unique(np.concatenate([[*run.bodies, *run.shape_bodies.values()] for run in runs.values()]))
    index = {number: place for place, number in enumerate(numbers[numbers >= 0].tolist())}
    return {
        name: replace(
            run,
            bodies=np.array([index[each] for each in run.bodies.tolist()], np.int64),
            shape_bodies={shape: index.get(body, body) for shape, body in run.shape_bodies.items()},
            body_names={index[body]: each for body, each in run.body_names.items() if body in index},
        )
        for name, run in runs.items()
    }


def first_difference(hashes: Sequence[str], others: Sequence[str]) -> int | None:
    """Return the first frame in which two runs differ; None if they are equal, bit for bit.

    Args:
        hashes: of the frames of a run.
        others: of those of another run.
    """
    for frame, (a, b) in enumerate(zip(hashes, others, strict=False)):
        if a != b:
            return frame
    return None if len(hashes) == len(others) else min(len(hashes), len(others))
