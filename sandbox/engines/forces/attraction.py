"""Attraction towards points and bodies: a = G·M/(d² + ε²) along the line to the target."""

from sandbox.arrays import Number


def pull(strength: float, softening: float, distance: Number) -> Number:
    """Return the acceleration towards a target, m/s²; for floats, or for arrays of them.

    Args:
        strength: G·M of the target, m³/s².
        softening: ε, m.
        distance: m.
    """
    return strength / (distance * distance + softening * softening)
