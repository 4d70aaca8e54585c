"""Calling the command line, in this process and as a process of its own, and the scenes that are called."""

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
"""Half a metre above the ground: it is reached after 0.32 s."""

SPARKS = """
[[emitter]]
position = [0.0, 3.0]
count = 3
velocity_min = [-1.0, -1.0]
velocity_max = [1.0, 1.0]
"""
"""What follows from the seed of a scene."""

FAULTY = '[[ball]]\nname = "a"\nposition = [0.0]\nradius = -1.0\n'
"""Two faults, on lines 3 and 4."""

DIVERGING = ("--set", "world.gravity=[1e9, 0.0]", "--set", "world.duration=10.0", "--set", "solver.dt=0.1")
"""Takes the ball of `DROP` along the ground out of any reach."""


def written(folder: Path, text: str = DROP, name: str = "drop.toml") -> str:
    """Write a scene and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def no_constant(name: str) -> None:
    """Refuse NaN and infinities, which are no JSON."""
    raise AssertionError(f"{name} is no JSON")


def document_of(text: str) -> dict[str, Any]:
    """Read the one JSON document that an output is."""
    return dict(json.loads(text, parse_constant=no_constant))


def json_of(capfd: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any], list[str]]:
    """Call with `--json`; return status, document, and the lines on standard error."""
    status = call([*arguments, "--json"])
    out, err = capfd.readouterr()
    return status, document_of(out), _told(err)


def lines_of(capfd: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, list[str], list[str]]:
    """Call; return status, and the lines on standard output and standard error."""
    status = call(list(arguments))
    out, err = capfd.readouterr()
    return status, out.splitlines(), _told(err)


def _told(err: str) -> list[str]:
    """Return the lines of standard error, but for the one that only a machine's first run has."""
    return [line for line in err.splitlines() if line != ANNOUNCEMENT]


def process(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Call as a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "sandbox", *arguments], capture_output=True, text=True, cwd=cwd, timeout=120, check=False
    )
