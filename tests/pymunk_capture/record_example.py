"""Records an example of pymunk in this process with simulated input, and replays it: a child process of the tests.

Usage: python -m tests.pymunk_capture.record_example NAME STEPS. It prints JSON: the steps, the number of actions,
what the recording lacks, reasons for rounding, and whether all dynamic bodies end in the state of the game,
bit for bit.
"""

import json
import os
import runpy
import sys
from contextlib import suppress
from typing import Any

os.environ |= {"SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy"}

import pygame
import pymunk

from sandbox.measure.run.runner import run
from sandbox.pymunk_capture.game_capture import GameCapture, StepLimitReached, capture

PERIOD = 40
"""Frames after which the simulated input repeats"""


def simulate_input() -> None:
    """Let `pygame.event.get` return clicks, drags and keys besides the events of the window."""
    get, frames = pygame.event.get, 0

    def with_input(*arguments: Any, **more: Any) -> list[pygame.event.Event]:
        nonlocal frames
        frames += 1
        surface = pygame.display.get_surface()
        width, height = (600, 600) if surface is None else surface.get_size()
        at = width // 2 + frames % 50, height // 2 - frames % 30
        simulated = {
            5: (pygame.MOUSEBUTTONDOWN, {"button": 1, "pos": at}),
            12: (pygame.KEYDOWN, {"key": pygame.K_UP, "mod": 0, "unicode": ""}),
            20: (pygame.KEYUP, {"key": pygame.K_UP, "mod": 0, "unicode": ""}),
            30: (pygame.MOUSEBUTTONUP, {"button": 1, "pos": at}),
        }.get(frames % PERIOD)
        events = list(get(*arguments, **more))
        return events if simulated is None else [*events, pygame.event.Event(*simulated)]

    pygame.event.get = with_input


def recorded(name: str, steps: int) -> GameCapture:
    """Return the recording of an example."""
    with capture(steps) as game, suppress(StepLimitReached):
        runpy.run_module(f"pymunk.examples.{name}", run_name="__main__")
    return game


def is_replayed(game: GameCapture) -> bool:
    """Return whether a replay ends in the state of the game."""
    found = run(game.recording.whole_scene, "pymunk", actions=game.recording.actions)
    names = found.names.tolist()
    space = max(game.spaces, key=lambda each: each.steps)
    for body, name in space.names.items():
        if body.body_type == pymunk.Body.DYNAMIC and name in names:
            row = names.index(name)
            state = [*found.position[-1, row], *found.velocity[-1, row], found.angle[-1, row]]
            if state != [*body.position, *body.velocity, body.angle]:
                return False
    return found.status == "ok"


if __name__ == "__main__":
    simulate_input()
    game = recorded(sys.argv[1], int(sys.argv[2]))
    document = {"steps": game.steps, "actions": len(game.recording.actions), "omitted": game.omitted}
    print("RESULT", json.dumps(document | {"inexact": game.inexact, "replayed": is_replayed(game)}))
