"""Comparison: one scene on several engines, aligned with the best known truth and scored."""

from sandbox.measure.compare.comparison import compare, compare_variants
from sandbox.measure.compare.result import Comparison, Row, Variant

__all__ = ["Comparison", "Row", "Variant", "compare", "compare_variants"]
