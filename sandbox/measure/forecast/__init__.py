"""Forecast: what would go wrong in a fixed-step run of a scene, told before running it, and what is worth knowing."""

from sandbox.measure.forecast.forecasts import FAILED, warnings
from sandbox.measure.forecast.notes import notes
from sandbox.measure.forecast.passages import Passage, largest_safe_dt, passages
from sandbox.measure.forecast.speeds import Speeds, top_speeds, unknown_speeds
from sandbox.measure.forecast.trial_run import Answer, forecast
from sandbox.measure.forecast.warning import Warning, at_most

__all__ = [
    "FAILED",
    "Answer",
    "Passage",
    "Speeds",
    "Warning",
    "at_most",
    "forecast",
    "largest_safe_dt",
    "notes",
    "passages",
    "top_speeds",
    "unknown_speeds",
    "warnings",
]
