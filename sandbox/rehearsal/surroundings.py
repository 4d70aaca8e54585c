"""Surroundings of a game while it is recorded or runs again: its inputs, its clock, its random numbers, its frames."""

import base64
import contextlib
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pygame
import pymunk

from sandbox.game_inputs import GameInputs, file_digest
from sandbox.rehearsal.game_clock import clock_from
from sandbox.rehearsal.guard import FileWatch, threads_noted
from sandbox.rehearsal.input_script import InputScript, ScriptedDevice
from sandbox.rehearsal.pygame_inputs import LiveDevice, PygameDevice, pygame_inputs_from
from sandbox.rehearsal.pyglet_inputs import pyglet_inputs_from
from sandbox.rehearsal.random_seeds import random_seed, seeded
from sandbox.rehearsal.space_log import SpaceLog, spaces_logged
from sandbox.rehearsal.tape import EndOfTape, InputTape, RecordingTape, ReplayTape

MAX_SAVED = 2**20
"""bytes, largest file that a program writes of which the content before is kept"""

MAX_CLOSING = 60
"""Frames that a program has to end after a script has closed its window"""


class InputRecorder:
    """Records the inputs of a program that runs within `recording`.

    Args:
        program: path of the program.
        arguments: of the program.
        pymunk6: whether the program uses names of pymunk 6.
        script: of inputs that replace keyboard, mouse and clock; None for those of the user.
    """

    def __init__(
        self, program: str, arguments: Sequence[str], script: InputScript | None = None, *, pymunk6: bool = False
    ) -> None:
        self._program, self._arguments, self._pymunk6 = program, tuple(arguments), pymunk6
        resolved = Path(program).resolve()
        self._own_folder = resolved if resolved.is_dir() else resolved.parent
        self._digests: dict[str, str] = {}
        self._saved: dict[str, str | None] = {}
        self._watch = FileWatch(self.note, self._note_read, self._note_written)
        self._started, self._origin = time.time(), time.perf_counter()
        self._device: PygameDevice = LiveDevice() if script is None else ScriptedDevice(script)
        self._tape = RecordingTape(self._now if script is None else self._device_time)
        self._log = SpaceLog(keeps_states=False)
        self._seed = random_seed() if script is None else script.seed
        self._notes: dict[str, None] = {}

    def _now(self) -> float:
        return time.perf_counter() - self._origin

    def _device_time(self) -> float:
        assert isinstance(self._device, ScriptedDevice)
        return self._device.time

    def note(self, remark: str) -> None:
        """Note something that the program did and inputs do not have."""
        self._notes[remark] = None

    @contextmanager
    def recording(self) -> Iterator[None]:
        """Record the inputs of the program that runs within a `with` block."""
        device = self._device
        scripted = device if isinstance(device, ScriptedDevice) else None

        def end_frame() -> None:
            self._tape.end_frame()
            if scripted is not None:
                scripted.end_frame()
                if scripted.frames_since_close > MAX_CLOSING:
                    self.note("its end: it runs on after its window is closed, and the recording ends it")
                    raise EndOfTape(0)

        with surroundings(
            self._tape,
            device,
            self._log,
            self._seed,
            end_frame=end_frame,
            sleep=time.sleep if scripted is None else scripted.sleep,
            now=None if scripted is None else scripted.now,
            note=self.note,
        ):
            self._watch.start()
            try:
                yield
            finally:
                self._watch.stop()

    def _note_read(self, path: Path) -> None:
        """Note a file that the program reads: a file in its own folder has a digest."""
        resolved = path.resolve()
        if resolved.is_relative_to(self._own_folder) and resolved.is_file() and resolved.suffix != ".pyc":
            name = os.path.relpath(resolved, self._own_folder)
            if name not in self._digests and name not in self._saved:
                self._digests[name] = file_digest(resolved)

    def _note_written(self, path: Path) -> None:
        """Note a file that the program is about to write, with its content."""
        resolved = path.resolve()
        name = os.path.relpath(resolved, self._own_folder)
        if (
            resolved.suffix == ".pyc"
            or resolved.parent.name == "__pycache__"
            or not _is_ordinary(resolved)
            or name in self._saved
        ):
            return
        if resolved.is_file() and resolved.stat().st_size > MAX_SAVED:
            self.note(f"{path}, which it writes, and which is larger than {MAX_SAVED // 2**20} MiB")
        elif not resolved.is_dir():
            self._saved[name] = base64.b64encode(resolved.read_bytes()).decode() if resolved.exists() else None
            self._digests.pop(name, None)

    def inputs(self, *, is_whole: bool) -> GameInputs:
        """Return the recorded inputs.

        Args:
            is_whole: whether the program ended by itself.
        """
        return GameInputs(
            program=self._program,
            folder=str(Path.cwd()),
            arguments=self._arguments,
            pymunk6=self._pymunk6,
            seed=self._seed,
            hash_seed=os.environ.get("PYTHONHASHSEED"),
            started=self._started,
            frame_times=tuple(self._tape.frame_times),
            readings={kind: tuple(readings) for kind, readings in self._tape.readings.items()},
            events=tuple(self._tape.recorded_events),
            steps=self._log.steps,
            is_whole=is_whole,
            frame_hashes=tuple(self._log.hashes),
            digests=self._digests,
            saved_files=self._saved,
            notes=tuple(self._notes),
        )


def _is_ordinary(path: Path) -> bool:
    """Return whether a path is no device."""
    return not path.exists() or path.is_file() or path.is_dir()


@contextmanager
def replayed(inputs: GameInputs, log: SpaceLog, *, draws: bool = True) -> Iterator[ReplayTape]:
    """Give recorded inputs to the program that runs within a `with` block.

    Args:
        inputs: of the program.
        log: of its spaces.
        draws: whether windows of pyglet are drawn.

    Yields:
        The tape.
    """
    tape = ReplayTape(inputs)

    def note(remark: str) -> None:
        tape.unread[remark] = None

    max_steps = None if inputs.is_whole else inputs.steps
    with surroundings(
        tape,
        _NoDevice(),
        log,
        inputs.seed,
        end_frame=tape.end_frame,
        sleep=lambda _: None,
        note=note,
        max_steps=max_steps,
        draws=draws,
    ):
        yield tape


class _NoDevice(ScriptedDevice):
    """Idle keyboard and mouse, for readings that the recording has none of."""

    def __init__(self) -> None:
        super().__init__(InputScript(frames=1))

    def set_timer(self, event: object, milliseconds: int, loops: int) -> None:
        """Do nothing: the events of timers are in the recording."""


@contextmanager
def surroundings(
    tape: InputTape,
    device: PygameDevice,
    log: SpaceLog,
    seed: int,
    *,
    end_frame: Callable[[], None],
    sleep: Callable[[float], None],
    now: Callable[[], float] | None = None,
    note: Callable[[str], None],
    max_steps: int | None = None,
    draws: bool = True,
) -> Iterator[None]:
    """Let a program read its inputs from a tape, and log its spaces frame by frame, within a `with` block.

    Args:
        tape: of the inputs.
        device: from which a tape that records reads.
        log: of the spaces.
        seed: of the random numbers.
        end_frame: called at the end of each frame.
        sleep: replaces `time.sleep`.
        now: virtual clock from which a tape that records reads, s; default: the real clocks.
        note: called with a remark on what the tape cannot have.
        max_steps: calls of `Space.step` after which the next one raises `EndOfTape`; default: unlimited.
        draws: whether windows of pyglet are drawn.
    """
    has_window = False  # of pyglet

    def finish_frame() -> None:
        log.end_frame()
        end_frame()

    foreign = pygame.display.get_surface()  # a window that this process had before the program

    def open_window() -> None:
        nonlocal has_window
        has_window = True

    def before_step(space: pymunk.Space) -> None:
        # A program without a window has a frame for each step.
        if log.has_stepped(space) and not has_window and pygame.display.get_surface() in (None, foreign):
            finish_frame()
        if max_steps is not None and log.steps >= max_steps:
            raise EndOfTape(0)

    with ExitStack() as stack:
        stack.enter_context(seeded(seed))
        stack.enter_context(threads_noted(note))
        stack.enter_context(spaces_logged(log, before_step))
        stack.enter_context(pygame_inputs_from(tape, device, end_frame=finish_frame, note=note))
        scripted = device if isinstance(device, ScriptedDevice) else None
        stack.enter_context(
            pyglet_inputs_from(tape, scripted, open_window=open_window, end_frame=finish_frame, note=note, draws=draws)
        )
        stack.enter_context(clock_from(tape, sleep=sleep, now=now))
        try:
            yield
        finally:
            if log.is_stepped:
                with contextlib.suppress(EndOfTape):
                    finish_frame()


@contextmanager
def started_as(program: str, arguments: Sequence[str]) -> Iterator[None]:
    """Give a program the arguments and the import path that the interpreter would give it, within a `with` block.

    Args:
        program: path of a Python file, or of a folder with a `__main__.py`.
        arguments: of the program.
    """
    before = sys.argv, sys.path[:]
    folder = Path(program).resolve()
    sys.argv = [program, *arguments]
    sys.path.insert(0, str(folder if folder.is_dir() else folder.parent))
    try:
        yield
    finally:
        sys.argv, sys.path[:] = before[0], before[1]
