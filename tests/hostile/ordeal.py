"""Ordeals: Python code run in a process of its own, so that an abort, a crash or a hang fails one test only."""

import json
import subprocess
import sys
from typing import Any

import pytest

from sandbox.engines.common.compile_clock import ANNOUNCEMENT

PRELUDE = """
import json, math, sys
import numpy as np
from pydantic import ValidationError
from sandbox.action import ActionError, Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import UnknownEngineError, start
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.runner import run
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document, loads
from sandbox.scene.description.discs import Ball

EXPECTED = (
    SceneError, ValidationError, ActionError, Refusal, Divergence, Exhaustion, TooLargeError, UnknownEngineError
)

def outcome(do, *arguments, **named):
    "Say how a call ended: done, or the name of an exception that belongs to the interface. Any other escapes."
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

def survey(simulation):
    "Is every number of the present state finite?"
    frame = simulation.frame()
    state = (frame.position, frame.velocity, frame.angle, frame.angular_velocity)
    return all(bool(np.isfinite(each).all()) for each in state)

def say(value):
    print(json.dumps(value))
"""

WAYS = pytest.mark.parametrize("flags", [(), pytest.param(("-O",), marks=pytest.mark.slow)], ids=["plain", "optimised"])
"""`python -O` leaves out every assert, pymunk's own among them. To do all of it twice takes its time."""


def endure(code: str, flags: tuple[str, ...] = (), timeout: float = 60.0) -> Any:
    """Run code after `PRELUDE` and return what it says.

    Warnings are errors there too. A timeout is no measurement: what must end in it takes a few seconds.

    Raises:
        AssertionError: the process was killed, complained, or failed.
        subprocess.TimeoutExpired: it hangs.
    """
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-W", "error", *flags, "-c", PRELUDE + code],
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    assert done.returncode == 0, f"status {done.returncode}\n{done.stderr[-4000:]}"
    assert done.stderr.replace(f"{ANNOUNCEMENT}\n", "") == "", done.stderr  # kernels may be compiled here first
    return json.loads(done.stdout)
