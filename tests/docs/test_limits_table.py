"""The table of limits in the documentation agrees with the stored limits of `sandbox extremes`."""

import json
import re
from typing import Any

import pytest

from tests.environment import ROOT

STORED = ROOT / "tools" / "calibration" / "boundaries.json"
PAGE = ROOT / "docs" / "results" / "limits.md"
COLUMNS = ("pymunk", "pymunk, 4 substeps", "box2d", "box2d, 4 substeps", "reference", "exact")
CELL = re.compile(
    r"(?P<end>≥ |to )?(?P<value>none|refused|[\d.]+(?:e-?\d+)?)(?:: refuses)?"
    r"(?: \((?P<low>…|[^–]+)–(?P<high>…|[^)]+)\))?(?P<star> \*)?"
)
STEP_AXES = ("dt", "speed", "stiffness")
"""Axes whose levels are proportional to the time step."""


def _stored() -> dict[str, dict[str, dict[str, Any]]]:
    """Return the stored limits by axis and setup, in their order."""
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for limit in json.loads(STORED.read_text(encoding="utf-8"))["limits"]:
        found.setdefault(limit["axis"], {})[limit["setup"]] = limit
    return found


def _tables() -> list[list[dict[str, str]]]:
    """Return the cells of each row by setup, of all tables of the page: limits, costs, limits at equal cost."""
    tables: list[list[dict[str, str]]] = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("| axis |"):
            tables.append([])
        elif line.startswith("|") and not line.startswith("|---"):
            _, *cells, others = (cell.strip() for cell in line.strip("|").split("|"))
            row = dict(zip(COLUMNS, cells, strict=True))
            for each in filter(None, others.split("; ")):
                name, _, value = each.replace("\\", "").partition(" ")
                row[f"reference, {name}"] = value
            tables[-1].append(row)
    return tables


LIMITS, COSTS, EQUAL_COSTS = _tables()
STORED_ROWS = list(_stored().items())
STEP_ROWS = [(axis, limits) for axis, limits in STORED_ROWS if axis in STEP_AXES]


def _rounded(value: float) -> float:
    """Return a number with the three digits of the tables."""
    return float(f"{value:.3g}")


def test_tables_have_one_row_per_axis() -> None:
    assert len(LIMITS) == len(COSTS) == len(STORED_ROWS)
    assert len(EQUAL_COSTS) == len(STEP_ROWS)


@pytest.mark.parametrize("index", range(len(STORED_ROWS)), ids=lambda index: STORED_ROWS[index][0])
def test_row_of_the_table_agrees_with_the_stored_limits(index: int) -> None:
    row, (_, limits) = LIMITS[index], STORED_ROWS[index]
    assert set(row) == set(limits)
    for setup, text in row.items():
        cell, limit = CELL.fullmatch(text), limits[setup]
        assert cell is not None, (setup, text)
        assert (cell["value"] == "refused") == limit["refused"], setup
        assert (cell["star"] is None) == limit["monotone"], setup
        if cell["value"] in ("refused", "none"):
            assert limit["limit"] is None, setup
            continue
        assert float(cell["value"]) == _rounded(limit["limit"]), setup
        if cell["end"] is not None:
            assert limit["first_failure"] is None, setup
        elif limit["first_failure"] is not None and limit["bounds"] != [limit["limit"], limit["first_failure"]]:
            shown = [None if cell[key] == "…" else float(cell[key]) for key in ("low", "high")]
            assert shown == [None if level is None else _rounded(level) for level in limit["bounds"]], setup


@pytest.mark.parametrize("index", range(len(STORED_ROWS)), ids=lambda index: STORED_ROWS[index][0])
def test_row_of_costs_agrees_with_the_stored_ones(index: int) -> None:
    row, (_, limits) = COSTS[index], STORED_ROWS[index]
    assert set(row) == set(limits)
    for setup, text in row.items():
        ratio = limits[setup]["cost_ratio"]
        assert text == "–" if ratio is None else float(text) == _rounded(ratio), setup


@pytest.mark.parametrize("index", range(len(STEP_ROWS)), ids=lambda index: STEP_ROWS[index][0])
def test_limits_at_equal_cost_agree_with_the_stored_ones(index: int) -> None:
    row, (_, limits) = EQUAL_COSTS[index], STEP_ROWS[index]
    assert set(row) == set(limits)
    for setup, text in row.items():
        limit = limits[setup]
        if limit["limit_at_equal_cost"] is None:
            assert text == ("refused" if limit["refused"] else "none"), setup
            continue
        assert text.startswith("≥ ") == (limit["first_failure"] is None), setup
        assert float(text.removeprefix("≥ ")) == _rounded(limit["limit_at_equal_cost"]), setup
