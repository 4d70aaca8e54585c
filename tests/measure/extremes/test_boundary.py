"""Boundaries between levels that pass and fail, their scores, and changes against stored ones."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.jsonable import to_json
from sandbox.measure.extremes.baseline import StoredError, changes, read
from sandbox.measure.extremes.boundary import Boundary, Bracket, find_boundary, halfway
from sandbox.measure.extremes.experiment import Scale


def search_boundary(
    edge: float, levels: tuple[float, ...], scale: Scale = "log", falling: bool = False
) -> tuple[Bracket, int]:
    calls = 0

    def passes(level: float) -> bool:
        nonlocal calls
        calls += 1
        return level >= edge if falling else level <= edge

    known = {level: passes(level) for level in levels}
    calls = 0
    return find_boundary(known, passes, scale), calls


@given(st.floats(1.0, 9.9e5))
def test_boundary_is_found_within_1_percent_by_bisecting_the_logarithm(edge: float) -> None:
    result, calls = search_boundary(edge, (1.0, 1e2, 1e4, 1e6))
    assert result.limit is not None and result.first_failure is not None
    assert result.limit <= edge < result.first_failure <= result.limit / (1.0 - 0.01)  # the tolerance it is given
    assert result.monotone
    assert calls <= 12  # log2(ln(100)/0.01) = 8.8 bisections, and two calls beside the boundary


@given(st.floats(0.01, 0.99))
def test_boundary_of_a_decreasing_axis_is_found_within_1_percent(edge: float) -> None:
    result, _ = search_boundary(edge, (1.0, 0.1, 0.01 / 2), falling=True)
    assert result.limit is not None and result.first_failure is not None
    assert result.first_failure < edge <= result.limit <= result.first_failure / (1.0 - 0.01)  # as above
    assert result.monotone


@given(st.integers(5, 99))
def test_boundary_of_whole_numbers_is_exact(edge: int) -> None:
    result, _ = search_boundary(edge, (5, 20, 100), "whole")
    assert result.limit == edge
    assert result.first_failure == edge + 1 or edge == 100


def test_axis_without_a_passed_or_failed_level_has_an_open_boundary() -> None:
    assert search_boundary(1e9, (1.0, 10.0))[0] == Bracket(10.0, None, True)
    assert search_boundary(0.5, (1.0, 10.0))[0] == Bracket(None, 1.0, True)
    assert find_boundary({}, None, "log") == Bracket(None, None, True)


def test_boundary_without_bisection_is_between_levels() -> None:
    assert find_boundary({1.0: True, 2.0: False, 3.0: False}, None, "log") == Bracket(1.0, 2.0, True)
    assert find_boundary({1.0: True, 2.0: False, 3.0: True}, None, "log") == Bracket(1.0, 2.0, False)


@pytest.mark.parametrize(
    ("passes", "limit"),
    [
        (lambda x: x < 2.0 or 50.0 < x < 200.0, 2.0),  # passes again at a level
        (lambda x: x < 2.0 or 2.1 < x < 2.3, 2.0),  # passes again right beyond, between two levels
        (lambda x: x < 1.75 or 1.82 < x < 2.0, 2.0),  # fails just before
    ],
)
def test_failure_that_is_not_monotone_is_detected(passes: object, limit: float) -> None:
    assert callable(passes)
    result = find_boundary({x: passes(x) for x in (1.0, 4.0, 100.0)}, passes, "log")
    assert not result.monotone
    assert result.limit is not None
    assert result.limit == pytest.approx(limit, rel=0.15)  # one of the boundaries


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
def test_halfway_is_between_its_arguments(a: float, b: float) -> None:
    scales: tuple[Scale, ...] = ("log", "linear")
    for scale in scales:
        assert min(a, b) * (1.0 - 1e-12) <= halfway(a, b, scale) <= max(a, b) * (1.0 + 1e-12)  # a rounding or two


def test_halfway_from_zero_and_between_whole_numbers() -> None:
    assert halfway(0.0, 1.0, "log") == 0.5
    assert halfway(4, 5, "whole") == 4
    assert halfway(0, 2, "whole") == 1


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
def test_changes_are_found_beyond_the_accuracy_of_boundaries(old, now, worse):
    found = changes(old, [now])
    assert [change.worse for change in found] == ([] if worse is None else [worse])


@pytest.mark.parametrize(
    ("old", "new", "worse"),
    [
        (None, (0.9, 1.2), None),  # 1.15 without bounds is within the new ones
        ((1.1, 1.3), (0.9, 1.2), None),
        ((1.1, 1.3), None, True),  # 1 to 1.01 without bounds is beyond the old ones
        ((1.3, 1.4), (0.9, 1.2), True),
        ((0.5, 0.7), (0.9, 1.2), False),
        ((1.1, None), (0.9, 1.2), None),
        ((None, 0.7), (0.9, 1.2), False),
    ],
)
def test_boundary_is_worse_only_outside_of_the_bounds_of_its_survival(old, new, worse):
    (stored,) = before({None: 1.15, (0.5, 0.7): 0.6, (None, 0.7): 0.6}.get(old, 1.15))
    found = changes([stored if old is None else {**stored, "bounds": old}], [replace(NOW, bounds=new)])
    assert [change.worse for change in found] == ([] if worse is None else [worse])


def test_change_is_described_in_one_line() -> None:
    (change,) = changes(before(2.0), [NOW])
    assert str(change) == "speed on pymunk: worse: passed up to 2 before, up to 1 now: passed the wall"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "cannot be read"),
        ("[1, 2]", "contains no boundaries"),
        ('{"limits": [{"axis": "a", "setup": "b", "limit": "x", "first_failure": null}]}', "is not a number"),
        ('{"limits": [{"axis": [], "setup": "b", "limit": 1, "first_failure": null}]}', "contains no boundaries"),
        ('{"limits": [{"axis": "a", "setup": "b", "limit": true, "first_failure": null}]}', "is not a number"),
        ('{"limits": [{"axis": "a", "setup": "b", "limit": NaN, "first_failure": null}]}', "is not a number"),
        (
            f'{{"limits": [{{"axis": "a", "setup": "b", "limit": 1{"0" * 400}, "first_failure": 0}}]}}',
            "is not a number",
        ),
        ("[" * 100_000, "cannot be read"),
        ('{"limits": [{"axis": "a", "setup": "b", "limit": 1, "first_failure": 2, "bounds": 3}]}', "not two levels"),
        ('{"limits": [{"axis": "a", "setup": "b", "limit": 1, "first_failure": 2, "bounds": [1]}]}', "not two levels"),
        (
            '{"limits": [{"axis": "a", "setup": "b", "limit": 1, "first_failure": 2, "bounds": [1, ""]}]}',
            "not a number",
        ),
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
