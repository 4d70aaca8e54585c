"""Turning: turns of the window's loop, without a display; what a hand does is to be seen at the end of its own turn."""

import os
import statistics
from collections.abc import Callable

os.environ["SDL_VIDEODRIVER"] = os.environ["SDL_AUDIODRIVER"] = "dummy"
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"

import numpy as np
import pygame

from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from tools.benchmarks.workloads import timed

TURNS = 30
"""Timed at once."""
FRAME = 1.0 / 60.0
"""s"""


def turns(scene: str, hand: bool) -> Callable[[], float]:
    """Time a turn of a paused scene: with a body dragged to another place in it, or with nothing done.

    Raises:
        AssertionError: the picture at the end of the turn does not show the body where the hand is.
    """

    def work() -> float:
        stage = AppState()
        window = App(stage)
        stage.open(find(scene))
        stage.paused = True
        window.run_frame(FRAME)
        found = [turn(window, k) if hand else timed(lambda: window.run_frame(FRAME)) for k in range(TURNS)]
        window.close()
        return statistics.median(found)

    def turn(window: App, k: int) -> float:
        live = window.app_state.live
        assert live is not None
        x, y = window.context.camera.to_screen(live.frame.position[0]).round().tolist()
        there = (int(x) + (7 if k % 2 else -7), int(y))
        for kind, at in ((pygame.MOUSEBUTTONDOWN, (int(x), int(y))), (pygame.MOUSEMOTION, there)):
            about = {"rel": (0, 0), "buttons": (1, 0, 0)} if kind == pygame.MOUSEMOTION else {"button": 1}
            pygame.event.post(pygame.event.Event(kind, pos=at, **about))
        pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONUP, pos=there, button=1))
        seconds = timed(lambda: window.run_frame(FRAME))
        now = window.context.camera.to_screen(live.frame.position[0])
        assert np.abs(now - there).max() <= 1.0, "the body is not where the hand is"
        return seconds

    return work
