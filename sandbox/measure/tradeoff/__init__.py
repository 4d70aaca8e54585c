"""Trade-off of accuracy against computing time, measured over engines and settings."""

from sandbox.measure.tradeoff.result import Tradeoff
from sandbox.measure.tradeoff.study import tradeoff

__all__ = ["Tradeoff", "tradeoff"]
