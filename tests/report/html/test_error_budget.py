"""Bars of the parts of an error budget."""

import re
from typing import Any

import pytest

from sandbox.report.html.tradeoff import error_budget


def row(model: float | None, time_step: float, left: float) -> dict[str, Any]:
    """Return a row of the key `split` of a trade-off."""
    return {"engine": "pymunk", "total": 1.0, "solver": 0.0, "time_step": time_step, "model": model, "left": left}


def fractions(parts: dict[str, Any]) -> dict[str, float]:
    """Return the width of each part, as a fraction of its bar."""
    bars = re.findall(r'<rect[^>]*width="([0-9.e+-]+)"[^>]*class="bar (\w+)"', error_budget([parts]))
    total = sum(float(width) for width, _ in bars)
    return {key: float(width) / total for width, key in bars}


def test_error_at_the_finest_step_is_that_of_the_model() -> None:
    # Widths are written to six digits.
    assert fractions(row(0.25, 0.75, 0.25)) == pytest.approx({"model": 0.25, "time_step": 0.75}, rel=1e-6)


def test_error_at_the_finest_step_is_shown_if_the_model_is_unknown() -> None:
    assert fractions(row(None, 0.75, 0.25)) == pytest.approx({"left": 0.25, "time_step": 0.75}, rel=1e-6)


def test_zero_error_has_an_empty_bar() -> None:
    assert fractions(row(0.0, 0.0, 0.0)) == {}


def test_lengths_are_in_metres() -> None:
    assert "error, m" in error_budget([row(None, 0.75, 0.25)])
