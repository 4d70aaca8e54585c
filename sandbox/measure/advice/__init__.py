"""Advice for a game: forecast and error of its present setting, the cheapest setting that suffices, and its code."""

from sandbox.measure.advice.result import Advice
from sandbox.measure.advice.study import advise

__all__ = ["Advice", "advise"]
