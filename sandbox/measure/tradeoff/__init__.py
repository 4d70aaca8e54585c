"""Trade-off of accuracy against computing time, measured over engines and settings."""

from sandbox.measure.tradeoff.weighed import Tradeoff
from sandbox.measure.tradeoff.weighing import tradeoff

__all__ = ["Tradeoff", "tradeoff"]
