"""Lines that an advice prints: they make the measured steps, and nothing else of the program changes."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pymunk
import pytest

from sandbox.measure.game_advice.step_code import step_code

BEFORE = """body, joint, force, forces = "hero", "hinge", 1, 2
k, time, running = 0, 0.0, True
while k < 3:
    k += 1
"""
AFTER = """
result = body, joint, force, forces, k, time
"""


class SpaceLog:
    """Space that notes its steps."""

    def __init__(self) -> None:
        self.steps: list[float] = []
        self.bodies = [pymunk.Body(1, 1)]
        self.constraints = [SimpleNamespace()]

    def step(self, dt: float) -> None:
        """Note the step."""
        self.steps.append(dt)


class ClockLog:
    """Clock that counts its calls."""

    def __init__(self) -> None:
        self.calls = 0

    def tick(self) -> float:
        """Return 1000 ms."""
        self.calls += 1
        return 1000.0


def run(text: str) -> tuple[Any, SpaceLog, ClockLog]:
    space, clock = SpaceLog(), ClockLog()
    names: dict[str, Any] = {"space": space, "clock": clock}
    exec(text, names)
    return names["result"], space, clock


@pytest.mark.parametrize(
    "line",
    [
        "    space.step(1.0)",
        "    space.step(clock.tick() / 1000)",
        "    if running: space.step(1.0)",
        "    space.step(1.0); time += 1.0",
        "    time += 1.0; space.step(dt=1.0)",
        "    while time < k: space.step(1.0); time += 1.0",
        "    for _ in range(2): space.step(0.5)",
        "    if not running: pass\n    else: space.step(1.0)",
        "    space.step(\n        1.0,\n    )",
    ],
)
def test_lines_change_only_the_steps(line: str, tmp_path: Path) -> None:
    game = tmp_path / "game.py"
    text = f"{BEFORE}{line}{AFTER}"
    game.write_text(text)
    number = next(n for n, each in enumerate(text.splitlines(), 1) if ".step(" in each)
    code = step_code(str(game), number, 4, {"substeps": 4, "joint_bias": 0.5}, has_forces=True)
    assert text.count(code.old) == 1
    (expected, own, clock), (found, finer, finer_clock) = run(text), run(text.replace(code.old, "\n".join(code.new)))
    assert found == expected
    assert clock.calls == finer_clock.calls
    assert finer.steps == [each / 4 for each in own.steps for _ in range(4)]


def test_lines_let_bodies_without_forces_sleep(tmp_path: Path) -> None:
    game = tmp_path / "game.py"
    game.write_text("space.step(1.0)\n")
    code = step_code(str(game), 1, 4, {"substeps": 4}, has_forces=True)
    space = pymunk.Space()
    space.sleep_time_threshold = 10.0
    body = pymunk.Body(1, 1)
    space.add(body, pymunk.Circle(body, 1))
    space.step(1.0)
    body.sleep()
    exec("\n".join(code.new), {"space": space})
    assert body.is_sleeping
