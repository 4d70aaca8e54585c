"""Program: runs pymunk's own unit tests, and compares each of their spaces with the scene that is captured from it.

It prints one JSON list with a row for each space: the test, the largest difference of states over all steps, and
whether the capture has remarks. Callbacks of a space are shared with its copy, so unit tests may fail; only their
spaces matter.
"""

import json
import sys
import unittest
from collections.abc import Callable, Iterator
from typing import Any
from unittest.mock import patch

import pymunk
import pymunk.tests

from sandbox.pymunk_capture.space_capture import CaptureError, capture_space
from tests.pymunk_capture.test_space_capture import compare

MODULES = ("arbiter", "batch", "body", "common", "constraint", "shape", "shape_filter", "space")
SPACES_PER_TEST = 3
"""Some tests make hundreds of equal spaces."""

STEP = pymunk.Space.step


def main() -> None:
    """Run the unit tests and print the rows."""
    rows: list[tuple[str, float | None, bool]] = []
    seen: set[pymunk.Space] = set()
    for test in unit_tests():
        name = test.id().removeprefix("pymunk.tests.")
        with patch.object(pymunk.Space, "step", examining_step(name, rows, seen)):
            test.run(unittest.TestResult())
    sys.stdout.write(json.dumps(rows))


def unit_tests() -> Iterator[unittest.TestCase]:
    """Yield the unit tests of pymunk."""
    suites: list[Any] = [unittest.defaultTestLoader.loadTestsFromName(f"pymunk.tests.test_{name}") for name in MODULES]
    while suites:
        each = suites.pop(0)
        if isinstance(each, unittest.TestCase):
            yield each
        else:
            suites = [*each, *suites]


def examining_step(
    name: str, rows: list[tuple[str, float | None, bool]], seen: set[pymunk.Space]
) -> Callable[[pymunk.Space, float], None]:
    """Return a `Space.step` that examines spaces before their first step, and adds a row for each."""
    count = 0

    def step(self: pymunk.Space, dt: float) -> None:
        nonlocal count
        if self not in seen and count < SPACES_PER_TEST:
            seen.add(self)
            count += 1
            with patch.object(pymunk.Space, "step", STEP):
                rows.append((name, *examine(self)))
        STEP(self, dt)

    return step


def examine(space: pymunk.Space) -> tuple[float | None, bool]:
    """Return the largest difference of a space from its scene, and whether the capture has remarks.

    The difference is None if the space is out of the range of scenes, or if it has callbacks, which are not run.
    """
    copied: Any = space.copy()
    try:
        captured = capture_space(copied)
    except CaptureError:
        return None, True
    if captured.omitted:
        return None, True
    captured, differences = compare(copied)
    return max(differences), bool(captured.inexact)


if __name__ == "__main__":
    main()
