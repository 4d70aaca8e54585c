"""Isolated runs: Python code in a child process, so that an abort, a crash or a hang fails one test only."""

import json
import subprocess
import sys
from typing import Any

import pytest

from sandbox.engines.common.compile_clock import ANNOUNCEMENT

PRELUDE = """
import json, math, sys
import numpy as np
from sandbox.action import ActionError, Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import UnknownEngineError, start
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.runner import run
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document, loads
from sandbox.scene.description.discs import Ball

EXPECTED = (
    SceneError, ActionError, Refusal, Divergence, Exhaustion, TooLargeError, UnknownEngineError
)

def outcome(do, *arguments, **named):
    "Return how a call ended: done, or the name of an exception of the interface. Any other exception propagates."
    try:
        do(*arguments, **named)
    except EXPECTED as error:
        if not str(error).strip():
            sys.exit(f"{type(error).__name__} without a message")
        return type(error).__name__
    return "done"

def steps(simulation, count):
    for _ in range(count):
        simulation.step()

def is_finite(simulation):
    "Return whether every number of the present state is finite."
    frame = simulation.frame()
    state = (frame.position, frame.velocity, frame.angle, frame.angular_velocity)
    return all(bool(np.isfinite(each).all()) for each in state)

def report(value):
    print(json.dumps(value))
"""

INTERPRETER_FLAGS = pytest.mark.parametrize(
    "flags", [(), pytest.param(("-O",), marks=pytest.mark.nightly)], ids=["plain", "optimised"]
)
"""`python -O` removes every assert, including those of pymunk; that variant is slow, as all code runs twice."""


def cases_of(text: str) -> list[list[str]]:
    """Return name, outcome and code of each case of a text with one case per line."""
    return [line.split(" | ", 2) for line in text.strip().splitlines()]


def lambdas_of(text: str) -> str:
    """Return the code of a mapping from the name of each case to a function that makes its scene."""
    return "{" + ", ".join(f"{name!r}: lambda: {code}" for name, _, code in cases_of(text)) + "}"


def run_isolated(code: str, flags: tuple[str, ...] = (), timeout: float = 60.0) -> Any:
    """Run code after `PRELUDE` in a child process and return the value that it reports.

    Warnings are errors there too. The timeout only detects hangs: the code normally takes a few seconds.

    Raises:
        AssertionError: the process was killed, failed, or wrote to stderr.
        subprocess.TimeoutExpired: the process hangs.
    """
    process = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-W", "error", *flags, "-c", PRELUDE + code],
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    assert process.returncode == 0, f"status {process.returncode}\n{process.stderr[-4000:]}"
    # kernels may be compiled in this process first
    assert process.stderr.replace(f"{ANNOUNCEMENT}\n", "") == "", process.stderr
    return json.loads(process.stdout)
