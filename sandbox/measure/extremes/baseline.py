"""Baseline: boundaries stored in a file, and the comparison of new boundaries with them."""

import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sandbox.atomic_write import atomic_write
from sandbox.echo import short_repr
from sandbox.measure.extremes.boundary import TOLERANCE, Boundary
from sandbox.measure.extremes.runner import Extremes, ExtremesPlan
from sandbox.measure.extremes.scenarios import AXES
from sandbox.resource_limits import read_limited
from sandbox.scene.files.document import check_text

SLACK = 2.0
"""Multiple of the tolerance by which a boundary may differ: the old and the new one each have this tolerance."""

STORED_KEYS = ("tolerance", "set", "starts", "spread", "timeout", "memory", "versions", "machine")
"""Keys of the document that are stored with the boundaries."""

MAX_BYTES = 64 * 2**20

StoredBoundaries = Sequence[Mapping[str, Any]]


class StoredError(ValueError):
    """The file contains no boundaries, or those of a plan with other scenes or starts."""


@dataclass(frozen=True)
class BoundaryChange:
    """Boundary that has moved."""

    axis: str
    setup: str
    """name of the engine configuration"""
    before: float | None
    """last level that passed in the baseline; None if none did"""
    now: float | None
    """last level that passes now; None if none does"""
    worse: bool
    """whether fewer levels pass now"""
    why: str
    """reason for the first failure now"""

    def __str__(self) -> str:
        """Describe the change in one line."""
        word = "worse" if self.worse else "better"
        before, now = (_level_text(value) for value in (self.before, self.now))
        return f"{self.axis} on {self.setup}: {word}: passed up to {before} before, up to {now} now: {self.why}"


def _level_text(value: float | None) -> str:
    return "no level" if value is None else f"{value:.4g}"


def store(result: Extremes, path: str | Path, others: StoredBoundaries = ()) -> Path:
    """Write boundaries into a file, with versions and tolerance, by way of a temporary file.

    Args:
        result: results with the boundaries.
        path: the file.
        others: further boundaries, of other axes.
    """
    whole_document = result.document()
    kept = {key: whole_document[key] for key in STORED_KEYS}
    limits = [*map(dict, others), *whole_document["limits"]]
    order = list(AXES)
    document = {**kept, "limits": sorted(limits, key=lambda limit: order.index(limit["axis"]))}
    path = Path(path)
    with atomic_write(path) as temporary:
        text = json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1)
        temporary.write_text(text + "\n", encoding="utf-8")
    return path


def read(path: str | Path, plan: ExtremesPlan | None = None) -> list[dict[str, Any]]:
    """Return the boundaries of a file that `store` wrote, or of an `extremes.json`.

    Args:
        path: the file.
        plan: plan whose boundaries are to be compared with them; its starts and changes of the scenes must be those of
            the file. Its limits of time and memory may differ, as results that depend on them differ between machines.

    Raises:
        StoredError: the file cannot be read, contains no boundaries, or has those of another plan.
    """
    try:
        text = read_limited(Path(path), MAX_BYTES).decode("utf-8")
        check_text(text)
        document = json.loads(text)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise StoredError(f"{path}: cannot be read: {reason}") from None
    limits = document.get("limits") if isinstance(document, dict) else None
    if not isinstance(limits, list) or not all(isinstance(each, dict) and _is_limit(each) for each in limits):
        raise StoredError(f"{path}: contains no boundaries; use an extremes.json of `sandbox extremes --out DIR`")
    for each in limits:
        bounds = (None, None) if each.get("bounds") is None else each["bounds"]
        if not isinstance(bounds, list | tuple) or len(bounds) != 2:
            raise StoredError(f"{path}: the bounds of {short_repr(each['axis'])} are not two levels")
        if not all(level is None or _is_number(level) for level in (each["limit"], each["first_failure"], *bounds)):
            raise StoredError(f"{path}: a limit of {short_repr(each['axis'])} is not a number")
    differences = [] if plan is None else list(_differences(document, plan))
    if differences:
        raise StoredError(f"{path}: cannot be compared: {'; '.join(differences)}")
    return limits


def _differences(document: Mapping[str, Any], plan: ExtremesPlan) -> Iterator[str]:
    """Yield each option by which the boundaries of a document are those of other scenes or starts than a plan's.

    Files of earlier versions lack some of them: without `set` there was none; unknown starts are not compared.
    """
    own = {"set": list(plan.overrides), "starts": plan.starts, "spread": plan.spread}
    stored = {"set": document.get("set", [])} | {key: document.get(key, own[key]) for key in ("starts", "spread")}
    for key, value in own.items():
        if stored[key] != value:
            yield f"it was measured with {_option_text(key, stored[key])}, not {_option_text(key, value)}"


def _option_text(key: str, value: Any) -> str:
    """Return an option as it is typed; `--set` may be repeated or absent."""
    if key != "set" or not isinstance(value, list):
        return f"--{key} {short_repr(value)}"
    return " ".join(f"--set {short_repr(each)}" for each in value) if value else "no --set"


def _is_limit(document: dict[str, Any]) -> bool:
    named = all(isinstance(document.get(key), str) for key in ("axis", "setup"))
    return named and {"limit", "first_failure"} <= document.keys()


def _is_number(value: Any) -> bool:
    """Return whether a JSON value is a number that is finite as a float."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def changes(before: StoredBoundaries, now: Sequence[Boundary], tolerance: float = TOLERANCE) -> list[BoundaryChange]:
    """Return the boundaries that have moved beyond their bounds and tolerance, of those that exist in both.

    Args:
        before: boundaries of the baseline.
        now: new boundaries.
        tolerance: relative tolerance to which each is known.
    """
    known = {(each["axis"], each["setup"]): each for each in before}
    found = []
    for limit in now:
        old = known.get((limit.axis, limit.setup))
        if old is None:
            continue
        moved = _compare(limit, old, tolerance)
        if moved:
            found.append(BoundaryChange(limit.axis, limit.setup, old["limit"], limit.limit, moved < 0, limit.reason))
    return found


def _compare(limit: Boundary, old: Mapping[str, Any], tolerance: float) -> int:
    """Return 1 if more levels pass now, −1 if fewer do, 0 if the boundary has not moved.

    Boundaries that were measured from several starts have not moved if their bounds overlap.
    """
    from sandbox.measure.extremes.scenarios import AXES

    then, now, axis = old["limit"], limit.limit, AXES.get(limit.axis)
    slack = 1.0 if axis is not None and axis.scale == "whole" else 0.0
    # Levels become harder towards the last one of the axis.
    rising = axis is None or axis.levels[-1] >= axis.levels[0]
    own = limit.bounds or (now, limit.first_failure)
    stored = old.get("bounds") or (then, old["first_failure"])
    overlap = _ranges_overlap(_range(own, rising), _range(stored, rising))
    if overlap and (limit.bounds is not None or old.get("bounds") is not None):
        return 0
    if then is None or now is None:
        return (then is None and now is not None) - (now is None and then is not None)
    if math.isclose(then, now, rel_tol=SLACK * tolerance) or abs(then - now) <= slack:
        return _compare_unbroken(limit.first_failure, old["first_failure"])
    if overlap:
        return 0
    return 1 if (now > then) == rising else -1


def _range(levels: Sequence[float | None], rising: bool) -> tuple[float, float]:
    """Return the interval between an easier and a harder level, the lower end first; None leaves it unbounded."""
    easier, harder = levels
    low, high = (easier, harder) if rising else (harder, easier)
    return -math.inf if low is None else low, math.inf if high is None else high


def _ranges_overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Return whether one boundary can lie in both intervals: without bisection it is known to a level only."""
    return max(one[0], other[0]) < min(one[1], other[1])


def _compare_unbroken(now: float | None, then: float | None) -> int:
    """Return 1 if no level fails any more, −1 if no level failed before and one does now."""
    return (now is None and then is not None) - (then is None and now is not None)
