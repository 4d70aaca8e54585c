"""What a rehearsal notes of the space of a game besides the motion of its bodies."""

from pathlib import Path

import pytest

from sandbox.game_inputs import GameInputs
from sandbox.rehearsal.rehearse import rehearse

pytestmark = pytest.mark.fail_slow(60)  # the game runs in a process of its own

GAME = """
import pymunk

space = pymunk.Space()
space.gravity = 3.0, -900.0
ball = pymunk.Body(1, 1)
space.add(ball, pymunk.Circle(ball, 10))
coin = pymunk.Circle(space.static_body, 5, (100, 100))
space.add(coin)
for step in range(10):
    if step == 4:
        space.remove(coin)
    if step == 7:
        space.add(coin)
    space.step(1 / 60)
"""


def test_gravity_and_shapes_that_the_game_removes_are_noted(tmp_path: Path) -> None:
    program = tmp_path / "game.py"
    program.write_text(GAME, encoding="utf-8")
    times = tuple((frame + 1) / 60 for frame in range(10))
    found = rehearse(program, GameInputs(str(program), str(tmp_path), frame_times=times))
    assert found.failure is None
    assert found.gravity == (3.0, -900.0)
    assert found.window is None
    assert found.frames == 10
    # Without a window a frame lasts until the next step begins, so that steps 4 and 7 have not begun.
    assert found.shape_changes == ((3, False, 1), (6, True, 1))
