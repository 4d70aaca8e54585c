"""Diagnostic: one certain or possible problem of a run of a scene, with a remedy; or a note about the scene."""

import math
from dataclasses import dataclass, field

from sandbox.jsonable import in_json
from sandbox.scene.description.world import Settings

ROUNDING = 1e-9
"""Relative: a limit that is exceeded by less counts as kept, because both sides are rounded."""

Detail = float | int | str
Details = dict[str, Detail]


@dataclass(frozen=True)
class Diagnostic:
    """Problem of a scene, or a note about it."""

    kind: str
    """identifier of the problem, such as `tunnelling`"""
    message: str
    """description with a remedy"""
    details: Details = field(default_factory=dict, metadata=in_json(inline=True))
    """the numbers and names in the message, by key"""


def floor_3_digits(limit: float) -> str:
    """Return a limit with three digits, rounded down, so that the written value satisfies it up to rounding."""
    from decimal import ROUND_FLOOR, Context  # takes 5 ms, and most scenes have no diagnostic

    return f"{float(Context(prec=3, rounding=ROUND_FLOOR).create_decimal(limit * (1.0 + ROUNDING))):g}"


def required_iterations(needed: float, settings: Settings) -> tuple[int, float]:
    """Return the iterations, and the dt, s, either of which alone raises iterations/h to a required value.

    Args:
        needed: required iterations per second.
        settings: the present settings.
    """
    iterations = math.ceil(needed * settings.h * (1.0 - ROUNDING))
    return iterations, settings.iterations * settings.substeps / needed
