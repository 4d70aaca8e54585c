"""Stored boundaries: which are better, worse or unchanged."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from sandbox.jsonable import to_json
from sandbox.measure.extremes.baseline import StoredError, changes, read
from sandbox.measure.extremes.boundary import Boundary

NOW = Boundary("speed", "pymunk", {}, "pymunk", 1.0, 1.01, "passed the wall", "through")


def before(limit: float | None, first: float | None = -1.0, axis: str = "speed") -> list[dict[str, Any]]:
    """Return a stored boundary; by default its first failure is 1 % beyond the limit."""
    if first == -1.0:
        first = 9.0 if limit is None else 1.01 * limit
    return [{"axis": axis, "setup": "pymunk", "limit": limit, "first_failure": first}]


@pytest.mark.parametrize(
    ("old", "now", "worse"),
    [
        (before(1.015), NOW, None),  # both are known to 1 %
        (before(1.03), NOW, True),
        (before(0.97), NOW, False),
        (before(None), NOW, False),
        (before(1.0), replace(NOW, limit=None), True),
        (before(None), replace(NOW, limit=None), None),
        (before(1.0, None), NOW, True),
        (before(1.0), replace(NOW, first_failure=None), False),
        (before(10.0, 9.0, "iterations"), replace(NOW, axis="iterations", limit=20.0, first_failure=19.0), True),
        (before(20.0, 19.0, "iterations"), replace(NOW, axis="iterations", limit=10.0, first_failure=9.0), False),
        (before(10.0, axis="stack"), replace(NOW, axis="stack", unit="boxes", limit=9.0), None),  # a difference of one
        (before(10.0, axis="stack"), replace(NOW, axis="stack", unit="boxes", limit=8.0), True),
        (before(5.0, axis="chain"), NOW, None),  # not in both
        # Without bisection, a boundary is known to lie between two levels only.
        (before(1.7, 1.72), replace(NOW, first_failure=2.0), None),
        (before(59.0, 60.0, "stack"), replace(NOW, axis="stack", limit=20.0, first_failure=None), None),
        (before(1.7, 1.72), replace(NOW, first_failure=1.69), True),
        (before(100.0, None), replace(NOW, limit=80.0, first_failure=90.0), True),
        (before(20.0, None, "iterations"), replace(NOW, axis="iterations", limit=10.0, first_failure=None), None),
    ],
)
def test_changes_are_found_beyond_the_accuracy_of_boundaries(
    old: list[dict[str, Any]], now: Boundary, worse: bool | None
) -> None:
    found = changes(old, [now])
    assert [change.worse for change in found] == ([] if worse is None else [worse])


def test_change_is_described_in_one_line() -> None:
    (change,) = changes(before(2.0), [NOW])
    assert str(change) == "speed on pymunk: worse: passed up to 2 before, up to 1 now: passed the wall"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "cannot be read"),
        ("[1, 2]", "contains no boundaries"),
        ('{"limits": [{"axis": "speed"}]}', "contains no boundaries"),
        ('{"limits": [{"axis": "a", "setup": "b", "limit": "x", "first_failure": null}]}', "is not a number"),
        ('{"limits": [{"axis": [], "setup": "b", "limit": 1, "first_failure": null}]}', "contains no boundaries"),
        ('{"limits": [{"axis": "a", "setup": {}, "limit": 1, "first_failure": null}]}', "contains no boundaries"),
        ('{"limits": [{"axis": "a", "setup": "b", "limit": true, "first_failure": null}]}', "is not a number"),
        ('{"limits": [{"axis": "a", "setup": "b", "limit": NaN, "first_failure": null}]}', "is not a number"),
        ('{"limits": [{"axis": "a", "setup": "b", "limit": 1e999, "first_failure": null}]}', "is not a number"),
        (
            f'{{"limits": [{{"axis": "a", "setup": "b", "limit": 1{"0" * 400}, "first_failure": 0}}]}}',
            "is not a number",
        ),
        ("[" * 100_000, "cannot be read"),
    ],
)
def test_file_without_boundaries_raises_stored_error(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "stored.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(StoredError, match=words):
        read(file)


def test_stored_limits_are_read(tmp_path: Path) -> None:
    file = tmp_path / "stored.json"
    file.write_text(json.dumps({"limits": [to_json(NOW)]}), encoding="utf-8")
    assert changes(read(file), [NOW]) == []
    with pytest.raises(StoredError, match="No such file"):
        read(tmp_path / "none.json")
