"""Bars of an error's parts."""

import re

import pytest

from sandbox.measure.tradeoff.split import Split
from sandbox.report.page.split_bars import split_bars
from sandbox.scene.description.world import Settings


def shares(split: Split) -> dict[str, float]:
    """Return the width of each part in its bar, as a share."""
    bars = re.findall(r'<rect[^>]*width="([0-9.e+-]+)"[^>]*class="bar (\w+)"', str(split_bars([split.document()])))
    whole = sum(float(width) for width, _ in bars)
    return {key: float(width) / whole for width, key in bars}


def split_of(model: float | None, time_step: float, left: float) -> Split:
    return Split("pymunk", Settings(), 1.0, 0.0, time_step, model, left, 16)


def test_model_counts_once() -> None:
    assert shares(split_of(0.25, 0.75, 0.25)) == pytest.approx(
        {"model": 0.25, "time_step": 0.75}, rel=1e-6
    )  # as printed


def test_what_is_left_is_shown_where_it_is_nobodys() -> None:
    assert shares(split_of(None, 0.75, 0.25)) == pytest.approx(
        {"left": 0.25, "time_step": 0.75}, rel=1e-6
    )  # as printed


def test_lengths_are_in_metres() -> None:
    assert "error, m" in str(split_bars([split_of(None, 0.75, 0.25).document()]))
