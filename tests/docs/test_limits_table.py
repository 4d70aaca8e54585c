"""The table of limits in the documentation agrees with the stored limits of `sandbox extremes`."""

import json
import re
from typing import Any

import pytest

from tests.environment import ROOT

STORED = ROOT / "tools" / "calibration" / "boundaries.json"
PAGE = ROOT / "docs" / "results" / "limits.md"
COLUMNS = ("pymunk", "pymunk, 4 substeps", "box2d", "box2d, 4 substeps", "reference", "exact")
CELL = re.compile(r"(?P<end>≥ |to )?(?P<value>none|refused|[\d.]+(?:e-?\d+)?)(?:: refuses)?(?P<star> \*)?")


def _stored() -> dict[str, dict[str, dict[str, Any]]]:
    """Return the stored limits by axis and setup, in their order."""
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for limit in json.loads(STORED.read_text(encoding="utf-8"))["limits"]:
        found.setdefault(limit["axis"], {})[limit["setup"]] = limit
    return found


def _table() -> list[dict[str, str]]:
    """Return the cells of each row by setup."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("| axis |"))
    rows = []
    for line in lines[first + 2 :]:
        if not line.startswith("|"):
            break
        _, *cells, others = (cell.strip() for cell in line.strip("|").split("|"))
        row = dict(zip(COLUMNS, cells, strict=True))
        for each in filter(None, others.split("; ")):
            name, _, value = each.replace("\\", "").partition(" ")
            row[f"reference, {name}"] = value
        rows.append(row)
    return rows


STORED_ROWS = list(_stored().items())


def test_table_has_one_row_per_axis() -> None:
    assert len(_table()) == len(STORED_ROWS)


@pytest.mark.parametrize("index", range(len(STORED_ROWS)), ids=lambda index: STORED_ROWS[index][0])
def test_row_of_the_table_agrees_with_the_stored_limits(index: int) -> None:
    row, (_, limits) = _table()[index], STORED_ROWS[index]
    assert set(row) == set(limits)
    for setup, text in row.items():
        cell, limit = CELL.fullmatch(text), limits[setup]
        assert cell is not None, (setup, text)
        assert (cell["value"] == "refused") == limit["refused"], setup
        assert (cell["star"] is None) == limit["monotone"], setup
        if cell["value"] in ("refused", "none"):
            assert limit["limit"] is None, setup
        else:
            assert float(cell["value"]) == float(f"{limit['limit']:.3g}"), setup
        if cell["end"] is not None:
            assert limit["first_failure"] is None, setup
