"""Rows of recorded games: what a recording adds to a frame, a rehearsal, and advice for a game."""

import contextlib
import os
import runpy
from functools import cache
from pathlib import Path
from unittest.mock import patch

from sandbox.game_inputs import GameInputs
from tools.benchmarks.clock import cpu_time, wall_time
from tools.benchmarks.row import Bench
from tools.benchmarks.workloads import Timed

GAME = str(Path(__file__).with_name("hundred_bodies.py"))
FPS = 60
SECONDS = 10
FRAMES = FPS * SECONDS
SEED = 3
FRAME_FRACTION = 0.1
"""Part of a frame that a recording may take"""


class _Clock:
    """Clock of a game that does not wait."""

    def tick(self, _fps: float = 0) -> int:
        """Return the length of a frame, ms."""
        return 1000 // FPS


def _plain() -> float:
    """Play the game without a recording and without waiting; return its processor time, s."""
    os.environ |= {"SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy"}
    import pygame

    frames = 0
    flip = pygame.display.flip

    def show() -> None:
        nonlocal frames
        flip()
        frames += 1
        if frames == FRAMES:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    with patch.object(pygame.time, "Clock", _Clock), patch.object(pygame.display, "flip", show):
        begin = cpu_time()
        _play()
        return cpu_time() - begin


def _play() -> None:
    import random

    random.seed(SEED)
    with contextlib.suppress(SystemExit):
        runpy.run_path(GAME, run_name="__main__")


def _recorded() -> tuple[float, GameInputs]:
    """Play the game with a recording of its space and its inputs, without waiting."""
    os.environ |= {"SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy"}
    from sandbox.pymunk_capture.game_capture import capture
    from sandbox.rehearsal.input_script import InputScript, ScriptedInput
    from sandbox.rehearsal.surroundings import InputRecorder

    throws = [
        each
        for k in range(1, 10)
        for each in (
            ScriptedInput(frame=60 * k, mouse=(80 * k, 500)),
            ScriptedInput(frame=60 * k + 1, press="mouse 1"),
            ScriptedInput(frame=60 * k + 5, release="mouse 1"),
        )
    ]
    recorder = InputRecorder(GAME, (), InputScript(frames=FRAMES, fps=FPS, seed=SEED, input=tuple(throws)))
    with capture(), recorder.recording():
        begin = cpu_time()
        with contextlib.suppress(SystemExit):
            runpy.run_path(GAME, run_name="__main__")
        seconds = cpu_time() - begin
    return seconds, recorder.inputs(is_whole=True)


@cache
def _inputs() -> GameInputs:
    return _recorded()[1]


def plain_frames() -> Timed:
    """Return a workload of a frame without a recording."""
    return lambda: _plain() / FRAMES


def recorded_frames() -> Timed:
    """Return a workload of a frame with a recording."""
    return lambda: _recorded()[0] / FRAMES


def rehearsals() -> Timed:
    """Return a workload of a rehearsal with the settings of the game."""
    from sandbox.rehearsal.rehearse import rehearse

    return lambda: rehearse(GAME, _inputs()).seconds


def plays() -> Timed:
    """Return a workload of the game without a recording and without waiting."""
    return _plain


def advices() -> Timed:
    """Return a workload of advice for the game."""
    from sandbox.measure.game_advice.study import GameStudy

    def work() -> float:
        begin = wall_time()
        GameStudy(GAME, _inputs()).advise()
        return wall_time() - begin

    return work


def session() -> Timed:
    """Return the length of the recorded session."""
    return lambda: _inputs().duration


def same_states() -> None:
    """Check that a rehearsal is the recorded game, bit for bit."""
    from sandbox.rehearsal.rehearse import rehearse

    inputs = _inputs()
    assert rehearse(GAME, inputs).hashes == inputs.frame_hashes


REHEARSALS: tuple[Bench, ...] = (
    Bench(
        "record-frame",
        f"a frame of a game of 100 bodies with / without a recording; 10 % of a frame are {100.0 / FPS:.3g} ms",
        recorded_frames,
        plain_frames,
        FRAME_FRACTION / FPS,
        above=True,
    ),
    Bench(
        "rehearse",
        f"a rehearsal of {SECONDS} s of a game of 100 bodies / its physics and drawing alone",
        rehearsals,
        plays,
        1.5,
        same=same_states,
    ),
    Bench(
        "advise-game",
        f"advice for {SECONDS} s of a game of 100 bodies / the length of the session",
        advices,
        session,
        6.0,
    ),
)
