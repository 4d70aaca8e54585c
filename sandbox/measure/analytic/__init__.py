"""Analytic solutions: exact motion by formula, for comparison with simulations.

`solution` covers a whole scene or nothing; `closed_form` covers one body beside a recorded run, as far as it holds.
"""

from sandbox.measure.analytic.bouncing import bounces
from sandbox.measure.analytic.model import free_flight, unsupported_reason
from sandbox.measure.analytic.solve import ClosedForm, Solution, closed_form, solution, valid_until

__all__ = [
    "ClosedForm",
    "Solution",
    "bounces",
    "closed_form",
    "free_flight",
    "solution",
    "unsupported_reason",
    "valid_until",
]
