"""Workload of the window's loop without a display; a drag must be visible at the end of the same frame."""

import os
import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path

os.environ["SDL_VIDEODRIVER"] = os.environ["SDL_AUDIODRIVER"] = "dummy"
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"

import numpy as np
import pygame

from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from tools.benchmarks.workloads import timed

TURNS = 30
"""Number of frames in one timing."""
FRAME = 1.0 / 60.0
"""s"""


def turns(scene: str, hand: bool) -> Callable[[], float]:
    """Return a workload of frames of a paused scene, with a body dragged in each or without input; median seconds.

    Raises:
        AssertionError: at the end of the frame the body is not at the pointer.
    """

    def work() -> float:
        state = AppState()
        window = App(state)
        state.open(find(scene))
        state.paused = True
        window.run_frame(FRAME)
        found = [turn(window, k) if hand else timed(lambda: window.run_frame(FRAME)) for k in range(TURNS)]
        window.close()
        return statistics.median(found)

    def turn(window: App, k: int) -> float:
        live = window.app_state.live
        assert live is not None
        x, y = window.context.camera.to_screen(live.frame.position[0]).round().tolist()
        target = (int(x) + (7 if k % 2 else -7), int(y))
        for kind, position in ((pygame.MOUSEBUTTONDOWN, (int(x), int(y))), (pygame.MOUSEMOTION, target)):
            attributes = {"rel": (0, 0), "buttons": (1, 0, 0)} if kind == pygame.MOUSEMOTION else {"button": 1}
            pygame.event.post(pygame.event.Event(kind, pos=position, **attributes))
        pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONUP, pos=target, button=1))
        seconds = timed(lambda: window.run_frame(FRAME))
        now = window.context.camera.to_screen(live.frame.position[0])
        assert np.abs(now - target).max() <= 1.0, "the body is not at the pointer"
        return seconds

    return work


EDITED = """[world]
gravity = [0.0, -9.81]
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
""" + "".join(
    f'[[ball]]\nname = "b{k}"\nposition = [{0.3 * (k % 40):.2f}, {0.3 * (k // 40) + 0.2:.2f}]\nradius = 0.1\n'
    for k in range(1000)
)
"""A scene with 1,000 balls."""


def edits(hand: bool) -> Callable[[], float]:
    """Return a workload of frames of the editor with 1,000 balls, one of which is dragged or none; median seconds.

    Raises:
        AssertionError: at the end the ball has not moved.
    """

    def work() -> float:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "scene.toml"
            path.write_text(EDITED, encoding="utf-8")
            state = AppState()
            window = App(state, folder=Path(folder))
            state.open(path)
            window.run_frame(FRAME)
            window.start_editing()
            window.run_frame(FRAME)
            assert window.editing is not None
            x, y = window.context.camera.to_screen(np.asarray((6.0, 3.2))).round().tolist()
            if hand:
                pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONDOWN, pos=(int(x), int(y)), button=1))
            found = []
            for k in range(TURNS):
                if hand:
                    place = int(x) + 10 + k, int(y)
                    pygame.event.post(pygame.event.Event(pygame.MOUSEMOTION, pos=place, rel=(1, 0), buttons=(1, 0, 0)))
                found.append(timed(lambda: window.run_frame(FRAME)))
            gesture = window.editing.editor.gesture
            assert (gesture is not None) == hand, "no ball is dragged"
            window.editing.editor.cancel()
            window.close()
            return statistics.median(found)

    return work
