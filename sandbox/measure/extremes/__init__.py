"""Extremes: boundaries beyond which an engine configuration fails, and whether the preflight checks predict them."""

from sandbox.measure.extremes.outcome import Sample
from sandbox.measure.extremes.runner import Extremes, ExtremesPlan, extremes

__all__ = ["Extremes", "ExtremesPlan", "Sample", "extremes"]
