"""One example of each command that needs no window: exit status and keys of the JSON document."""

from pathlib import Path

import pytest

from sandbox.cli.main import COMMANDS, call
from tests.cli.calling import DROP, json_of, write_scene

PUTT = """
[surface]
sliding_friction = 0.2
rolling_friction = 0.01

[[ball]]
name = "cue"
position = [0.0, 0.0]
radius = 0.03

[[ball]]
name = "8"
position = [0.3, 0.0]
radius = 0.03

[[pocket]]
position = [0.5, 0.0]
radius = 0.05

[[shot]]
name = "stun"
aim = 0.0
speed = 2.0
"""
SHELL = """
title = "Shell"
[world]
gravity = [0.0, -9.81]
[[ball]]
position = [0.0, 0.0]
radius = 1.0
"""

GAME = """
import pymunk
space = pymunk.Space()
body = pymunk.Body(1, 1)
space.add(body, pymunk.Circle(body, 1))
space.step(0.01)
"""
LEVEL = '<svg xmlns="http://www.w3.org/2000/svg"><circle r="5"/></svg>'

EXAMPLES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "run": (("drop.toml", "--engine", "pymunk"), ("runs",)),
    "runs": (("runs",), ("count", "statuses", "runs")),
    "compare": (("drop.toml", "--engines", "pymunk,reference"), ("truth", "engines")),
    "tradeoff": (
        ("drop.toml", "--engine", "pymunk", "--points", "2", "--repeats", "1", "--tolerance", "1"),
        ("points",),
    ),
    "advise": (
        ("drop.toml", "--effort", "0.1", "--repeats", "1", "--tolerance", "1m"),
        ("present", "recommended", "code"),
    ),
    "shots": (("putt.toml", "--count", "20", "--threads", "1"), ("odds", "sensitivity", "horizon")),
    "extremes": (("--axes", "speed", "--engines", "pymunk", "--quick", "--workers", "1"), ("cells", "limits")),
    "report": (("drop.toml", "--engine", "pymunk", "--out", "page.html"), ("scenes", "page")),
    "record": (("game.py",), ("recording", "steps", "actions", "omitted")),
    "import": (("level.svg", "--to", "level.toml"), ("level", "scene", "counts", "warnings")),
    "check": (("drop.toml", "--no-trial"), ("ok", "faults", "engines", "warnings")),
    "scenes": ((), ("scenes",)),
    "engines": ((), ("engines",)),
    "schema": (("ball",), ("properties",)),
    "export": (("runs", "--to", "drop.csv"), ("files",)),
    "miss": (("shell.toml", "--dt", "0.1", "--angle", "30", "--speed", "40"), ("range", "rows")),
    "match": (
        ("straight-rail", "--distance", "1", "--players", "bot:0.9,bot:0.8", "--frames", "1"),
        ("players", "frames", "wins"),
    ),
}
"""Arguments, and keys of the JSON document, by command."""
WITH_WINDOW = {"play", "replay"}
"""Commands that are tested with the window."""


def test_every_command_has_an_example() -> None:
    assert set(EXAMPLES) | WITH_WINDOW == set(COMMANDS)


@pytest.mark.full
@pytest.mark.timeout(1200)  # the first run compiles kernels
@pytest.mark.parametrize("command", EXAMPLES)
def test_example_of_a_command_succeeds(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    files = (("drop.toml", DROP), ("putt.toml", PUTT), ("shell.toml", SHELL), ("level.svg", LEVEL), ("game.py", GAME))
    for name, text in files:
        write_scene(tmp_path, text, name)
    if command in ("export", "runs"):
        assert call(["run", "drop.toml", "--out", "runs", "--quiet"]) == 0
    arguments, keys = EXAMPLES[command]
    status, document, _ = json_of(capfd, command, *arguments)
    assert status == 0
    assert set(keys) <= set(document)
