"""Whether two runs of a game are equal, and why they may not be."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sandbox.game_inputs import GameInputs
from sandbox.rehearsal.rehearse import Rehearsal, first_difference

CAUSES = {
    "datetime.now": "the date, which is not recorded",
    "datetime.today": "the date, which is not recorded",
    "datetime.utcnow": "the date, which is not recorded",
    "os.urandom": "random bytes without a seed",
    "secrets": "random numbers without a seed",
    "uuid.uuid1": "random numbers without a seed",
    "uuid.uuid4": "random numbers without a seed",
    "random.SystemRandom": "random numbers without a seed",
    "SystemRandom": "random numbers without a seed",
    "threading.Thread": "a thread, whose turns the operating system decides",
    "Thread": "a thread, whose turns the operating system decides",
    "id": "an address in memory",
    "hash": "a hash, which may follow from an address in memory",
    "gc.collect": "the collection of garbage",
}
"""Names in a program that make runs differ, and what they are"""
MAX_CAUSES = 5


class Mismatch(NamedTuple):
    """First difference of two runs."""

    frame: int
    what: str
    """a body, or the callbacks"""

    def __str__(self) -> str:
        """Return the difference in words."""
        return f"frame {self.frame}, {self.what}"


def first_mismatch(run: Rehearsal, other: Rehearsal) -> Mismatch | None:
    """Return the first difference of two runs; None if states and callbacks are equal, bit for bit."""
    frame = first_difference(run.hashes, other.hashes)
    calls = next((a for a, b in zip(run.calls, other.calls, strict=False) if a != b), None)
    if calls is None and len(run.calls) != len(other.calls):
        calls = max(run.calls, other.calls, key=len)[min(len(run.calls), len(other.calls))]
    if calls is not None and (frame is None or calls.frame < frame):
        return Mismatch(calls.frame, f"calls of {run.callbacks[calls.callback]}")
    if frame is None:
        return None
    if frame >= min(run.frames, other.frames):
        return Mismatch(frame, f"one run has {run.frames} frames, the other one {other.frames}")
    (bodies, states), (others, other_states) = run.frame(frame), other.frame(frame)
    if not np.array_equal(bodies, others):
        return Mismatch(frame, f"{len(bodies)} and {len(others)} bodies")
    rows = np.flatnonzero((states != other_states).any(axis=1))
    return Mismatch(frame, run.body_name(int(bodies[rows[0]])) if len(rows) else "states")


def likely_causes(program: str | Path, inputs: GameInputs) -> tuple[str, ...]:
    """Return why two runs of a program may differ: what its source reads that is no recorded input.

    Args:
        program: path of the program.
        inputs: its inputs, which name its files.
    """
    path = Path(program)
    folder = path if path.is_dir() else path.parent
    main = path if path.is_file() else path / "__main__.py"
    files = dict.fromkeys([main, *(folder / name for name in inputs.digests)])
    found = [cause for file in files if file.suffix == ".py" and file.is_file() for cause in _causes_in(file)]
    found += inputs.notes
    if not found:
        found = ["the order of a set of objects, which follows their addresses in memory; use a dict or a list"]
    return tuple(dict.fromkeys(found))[:MAX_CAUSES]


def _causes_in(file: Path) -> Iterator[str]:
    try:
        tree = ast.parse(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, SyntaxError):  # the interpreter has read it, so that it changed since
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            known = next((name for each in (name, name.split(".", 1)[-1], name.split(".")[0]) if each in CAUSES), None)
            if known is not None:
                cause = CAUSES.get(name) or CAUSES.get(name.split(".", 1)[-1]) or CAUSES[name.split(".")[0]]
                yield f"{file.name}:{node.lineno}: {name}() reads {cause}"
