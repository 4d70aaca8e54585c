"""Comparison: one scene on several engines, aligned with the best known truth and scored."""

from sandbox.measure.compare.comparing import compare
from sandbox.measure.compare.comparison import Comparison, Row

__all__ = ["Comparison", "Row", "compare"]
