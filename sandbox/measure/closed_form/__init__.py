"""Closed forms: what bodies do by formula, to hold a simulation against. Nothing is stepped.

`solution` covers a whole scene or refuses; `closed_form` is what a body does beside a recorded run, as far as it holds.
"""

from sandbox.measure.closed_form.bouncing import bounces
from sandbox.measure.closed_form.flight import free_flight, why_not
from sandbox.measure.closed_form.forms import Solution, solution
from sandbox.measure.closed_form.recorded import ClosedForm, closed_form, valid_until

__all__ = [
    "ClosedForm",
    "Solution",
    "bounces",
    "closed_form",
    "free_flight",
    "solution",
    "valid_until",
    "why_not",
]
