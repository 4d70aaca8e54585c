"""Limits of Box2D v3, in its units of length, and the scale between these and metres."""

import math

from sandbox.scene.description.world import Settings

SLOP_LENGTHS = 0.005
"""overlap that Box2D does not correct, `B2_LINEAR_SLOP`"""

FARTHEST_LENGTHS = 4e4
"""distance from the origin at which the spacing of 32-bit numbers, 2⁻⁸, is about the slop"""

CLAMPED_LENGTHS = 1e9
"""per second, speed to which Box2D clamps; its default of 400 would slow bodies down"""

FASTEST_LENGTHS = 7e8
"""per second, largest coordinate of a velocity: the speed is then certainly below the clamp"""

MAX_TURN = 0.25 * math.pi
"""rad, angle per substep to which Box2D clamps rotation, `B2_MAX_ROTATION`"""

MAX_CORNERS = 8
"""corners of a convex polygon, `B2_MAX_POLYGON_VERTICES`"""

MAX_WORLDS = 128
"""worlds of a process, `B2_MAX_WORLDS`"""


def scale_for(settings: Settings) -> float:
    """Return the number of Box2D's units of length in a metre, for resolved settings."""
    assert settings.slop is not None
    return SLOP_LENGTHS / settings.slop
