"""Helpers that call the command line, in this process or in a child process, and scenes for it."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from sandbox.cli.main import call
from sandbox.engines.common.compile_clock import ANNOUNCEMENT

DROP = """
title = "Drop"

[world]
gravity = [0.0, -10.0]
duration = 0.5

[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]

[[ball]]
name = "a"
position = [0.0, 1.0]
radius = 0.5
restitution = 0.5
"""
"""A ball half a metre above the ground, which it reaches after 0.32 s."""

SPARKS = """
[[emitter]]
position = [0.0, 3.0]
count = 3
velocity_min = [-1.0, -1.0]
velocity_max = [1.0, 1.0]
"""
"""An emitter, whose velocities depend on the seed of the scene."""

FAULTY = '[[ball]]\nname = "a"\nposition = [0.0]\nradius = -1.0\n'
"""Two faults, on lines 3 and 4."""

DIVERGING = ("--set", "world.gravity=[1e9, 0.0]", "--set", "world.duration=10.0", "--set", "solver.dt=0.1")
"""Settings that accelerate the ball of `DROP` along the ground until the run diverges."""


def write_scene(folder: Path, text: str = DROP, name: str = "drop.toml") -> str:
    """Write a scene and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def refuse_constant(name: str) -> None:
    """Refuse NaN and infinities, which are not JSON."""
    raise AssertionError(f"{name} is not JSON")


def document_of(text: str) -> dict[str, Any]:
    """Parse an output that is one JSON document."""
    return dict(json.loads(text, parse_constant=refuse_constant))


def json_of(capfd: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any], list[str]]:
    """Call with `--json`; return exit status, document, and lines of standard error."""
    status = call([arguments[0], "--json", *arguments[1:]])  # `record` passes what follows its file to the game
    out, err = capfd.readouterr()
    return status, document_of(out), _without_announcement(err)


def lines_of(capfd: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, list[str], list[str]]:
    """Call; return exit status, lines of standard output, and lines of standard error."""
    status = call(list(arguments))
    out, err = capfd.readouterr()
    return status, out.splitlines(), _without_announcement(err)


def document_from(capfd: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """Call with `--json`; return the document of a command that succeeds without a message."""
    status, document, err = json_of(capfd, *arguments)
    assert (status, err) == (0, [])
    return document


def output_of(capfd: pytest.CaptureFixture[str], *arguments: str) -> list[str]:
    """Call; return the lines of standard output of a command that succeeds without a message."""
    status, out, err = lines_of(capfd, *arguments)
    assert (status, err) == (0, [])
    return out


def _without_announcement(err: str) -> list[str]:
    """Return the lines of standard error without the announcement of a first compilation."""
    return [line for line in err.splitlines() if line != ANNOUNCEMENT]


def process(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Call in a child process."""
    return subprocess.run(
        [sys.executable, "-m", "sandbox", *arguments], capture_output=True, text=True, cwd=cwd, timeout=120, check=False
    )
