"""What every part of a scene file shares: strictness, the ranges of its numbers, its short texts.

The ranges keep nonsense away from compiled engines. They are wide enough for every experiment that
double precision can express, and narrow enough that no square or cube of a value overflows.
"""

import math
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

MAX_POSITION = 1e16  # m
MAX_SPEED = 1e12  # m/s
MAX_BODIES = 1_000_000
MAX_STEPS = 1e9
BACKING = 1000.0  # m: how deep the solid behind a plane is taken to be; no centre may start deeper


class Part(BaseModel):
    """A frozen, strict piece of a scene: no unknown keys, no coercion, no infinities."""

    # Validators are built on first use: of a dozen models, a command mostly needs the one of a whole scene.
    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, allow_inf_nan=False, validate_by_name=True, defer_build=True
    )


def _speed_in_range(vector: tuple[float, float]) -> tuple[float, float]:
    speed = math.hypot(*vector)
    if speed > MAX_SPEED:
        raise ValueError(f"a speed of {speed:g} m/s is out of range; at most {MAX_SPEED:g}")
    return vector


Coordinate = Annotated[float, Field(ge=-MAX_POSITION, le=MAX_POSITION)]
Point = tuple[Coordinate, Coordinate]
"""A place, m."""

Vector = tuple[float, float]

Velocity = Annotated[Vector, AfterValidator(_speed_in_range)]
"""A velocity, m/s."""

AngularVelocity = Annotated[float, Field(ge=-1e12, le=1e12)]
Radius = Annotated[float, Field(ge=1e-9, le=1e9)]
Acceleration = Annotated[float, Field(ge=-1e9, le=1e9)]
Mass = Annotated[float, Field(ge=1e-15, le=1e30)]
Density = Annotated[float, Field(ge=1e-30, le=1e30)]
Restitution = Annotated[float, Field(ge=0, le=1)]
Friction = Annotated[float, Field(ge=0, le=1000)]
Falloff = Annotated[float, Field(ge=0, le=1e6)]
"""How restitution falls with speed, s/m: e(v) = e / (1 + f·v), v the speed of approach."""

Name = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]*$")]
"""A body's or material's name: any text without control characters."""

Colour = Annotated[str, StringConstraints(pattern=r"^#[0-9a-fA-F]{6}$")]
"""An sRGB colour, `#rrggbb`."""
