"""Stored: boundaries as a file keeps them, and what has become of them since."""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sandbox.echo import short_repr
from sandbox.measure.extremes.boundary import TOLERANCE, Limit
from sandbox.measure.extremes.matrix import Extremes
from sandbox.scene.files.nesting import check_text
from sandbox.whole import read_whole, whole

SLACK = 2.0
"""How many times the tolerance a boundary may have moved: both are known only to within it."""

MAX_BYTES = 64 * 2**20

Stored = Sequence[Mapping[str, Any]]


class StoredError(ValueError):
    """A file holds no boundaries."""


@dataclass(frozen=True)
class Change:
    """A boundary that is elsewhere."""

    axis: str
    setup: str
    before: float | None
    now: float | None
    worse: bool
    why: str

    def __str__(self) -> str:
        """Say it in a line."""
        word = "worse" if self.worse else "better"
        then, since = (_told(value) for value in (self.before, self.now))
        return f"{self.axis} on {self.setup}: {word}: passed up to {then} before, up to {since} now: {self.why}"

    def document(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return {
            "axis": self.axis,
            "setup": self.setup,
            "before": self.before,
            "now": self.now,
            "worse": self.worse,
            "why": self.why,
        }


def _told(value: float | None) -> str:
    return "no level" if value is None else f"{value:.4g}"


def store(result: Extremes, path: str | Path, others: Stored = ()) -> Path:
    """Write the limits of a run, after others that are kept, with versions and tolerance; to a temporary name first."""
    whole_document = result.document()
    kept = {key: whole_document[key] for key in ("tolerance", "timeout", "memory", "versions", "machine")}
    document = {**kept, "limits": [*map(dict, others), *whole_document["limits"]]}
    path = Path(path)
    with whole(path) as temporary:
        text = json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1)
        temporary.write_text(text + "\n", encoding="utf-8")
    return path


def read(path: str | Path) -> list[dict[str, Any]]:
    """Read stored limits: what `store` wrote, or an `extremes.json`.

    Raises:
        StoredError: the file cannot be read, or holds none.
    """
    try:
        text = read_whole(Path(path), MAX_BYTES).decode("utf-8")
        check_text(text)
        document = json.loads(text)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise StoredError(f"{path}: cannot be read: {reason}") from None
    limits = document.get("limits") if isinstance(document, dict) else None
    if not isinstance(limits, list) or not all(isinstance(each, dict) and _is_limit(each) for each in limits):
        raise StoredError(f"{path}: contains no boundaries; use an extremes.json of `sandbox extremes --out DIR`")
    for each in limits:
        if not all(each[key] is None or _is_number(each[key]) for key in ("limit", "first_failure")):
            raise StoredError(f"{path}: a limit of {short_repr(each['axis'])} is not a number")
    return limits


def _is_limit(document: dict[str, Any]) -> bool:
    named = all(isinstance(document.get(key), str) for key in ("axis", "setup"))
    return named and {"limit", "first_failure"} <= document.keys()


def _is_number(value: Any) -> bool:
    """Tell whether a JSON value is a number that is finite as a float."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def changes(before: Stored, now: Sequence[Limit], tolerance: float = TOLERANCE) -> list[Change]:
    """Return the boundaries that have moved by more than they are known to, of those that both have.

    Args:
        before: as `read`.
        now: measured since.
        tolerance: relative, to which each is known.
    """
    known = {(each["axis"], each["setup"]): each for each in before}
    found = []
    for limit in now:
        old = known.get((limit.axis, limit.setup))
        if old is None:
            continue
        moved = _harder(limit, old, tolerance)
        if moved:
            found.append(Change(limit.axis, limit.setup, old["limit"], limit.limit, moved < 0, limit.reason))
    return found


def _harder(limit: Limit, old: Mapping[str, Any], tolerance: float) -> int:
    """Return 1 where it goes farther now, −1 where less far, 0 where it is as it was."""
    from sandbox.measure.extremes.axes import AXES

    then, now, axis = old["limit"], limit.limit, AXES.get(limit.axis)
    slack = 1.0 if axis is not None and axis.scale == "whole" else 0.0
    if then is None or now is None:
        return (then is None and now is not None) - (now is None and then is not None)
    if math.isclose(then, now, rel_tol=SLACK * tolerance) or abs(then - now) <= slack:
        return _unbroken(limit.first_failure, old["first_failure"])
    # Which way is harder, the axis tells: towards its last level.
    rising = axis is None or axis.levels[-1] >= axis.levels[0]
    if _may_agree(_between(now, limit.first_failure, rising), _between(then, old["first_failure"], rising)):
        return 0
    return 1 if (now > then) == rising else -1


def _between(limit: float, failure: float | None, rising: bool) -> tuple[float, float]:
    """Return between what a boundary lies, the lower first; what never failed has one beyond all levels."""
    beyond = failure if failure is not None else math.inf if rising else -math.inf
    return min(limit, beyond), max(limit, beyond)


def _may_agree(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Tell whether one boundary may lie in both ranges: what was looked at level by level is known no better."""
    return max(one[0], other[0]) < min(one[1], other[1])


def _unbroken(now: float | None, then: float | None) -> int:
    """Return 1 where it now never fails, −1 where it never did and now does."""
    return (now is None and then is not None) - (then is None and now is not None)
