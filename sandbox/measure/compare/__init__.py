"""Comparison: one scene on several engines, aligned with the best known truth and scored."""

from sandbox.measure.compare.comparing import compare, compare_variants
from sandbox.measure.compare.comparison import Comparison, Row
from sandbox.measure.compare.sweep import Variant

__all__ = ["Comparison", "Row", "Variant", "compare", "compare_variants"]
