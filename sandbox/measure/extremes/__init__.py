"""Extremes: how far each engine and setting goes before it breaks, and whether the forecast saw it coming."""

from sandbox.measure.extremes.cell import Cell
from sandbox.measure.extremes.matrix import Extremes, Plan, extremes

__all__ = ["Cell", "Extremes", "Plan", "extremes"]
