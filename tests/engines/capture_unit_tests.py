"""Program: runs pymunk's own unit tests, and compares each of their spaces with the scene that is captured from it.

It prints one JSON list with a row for each space: the test, the largest difference of states over all steps, and
whether the capture has remarks. Callbacks of a space are shared with its copy, so unit tests may fail; only their
spaces matter.
"""

import json
import sys
import unittest
from collections import Counter
from typing import Any

import pymunk
import pymunk.tests

from sandbox.engines.pymunk_adapter.capture import CaptureError, capture_space
from tests.engines.test_capture import compare

MODULES = ("arbiter", "batch", "body", "common", "constraint", "shape", "shape_filter", "space")
SPACES_PER_TEST = 3
"""Some tests make hundreds of equal spaces."""

STEP = pymunk.Space.step


def main() -> None:
    """Run the unit tests and print the rows."""
    rows: list[tuple[str, float | None, bool]] = []
    seen: set[pymunk.Space] = set()
    count: Counter[str] = Counter()
    running = ""

    class Result(unittest.TestResult):
        def startTest(self, test: unittest.TestCase) -> None:  # noqa: N802, name of unittest
            nonlocal running
            running = test.id().removeprefix("pymunk.tests.")
            super().startTest(test)

    def step(self: pymunk.Space, dt: float) -> None:
        if self not in seen and count[running] < SPACES_PER_TEST:
            seen.add(self)
            count[running] += 1
            setattr(pymunk.Space, "step", STEP)  # noqa: B010, a method
            try:
                rows.append((running, *examine(self)))
            finally:
                setattr(pymunk.Space, "step", step)  # noqa: B010
        STEP(self, dt)

    setattr(pymunk.Space, "step", step)  # noqa: B010
    load = unittest.defaultTestLoader.loadTestsFromName
    unittest.TestSuite(load(f"pymunk.tests.test_{name}") for name in MODULES).run(Result())
    sys.stdout.write(json.dumps(rows))


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
