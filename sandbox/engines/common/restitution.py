"""Restitution: the speed at which two bodies separate after an impact, one law for every engine.

    r(v) = e / (1 + f·v) · v,        v the speed of approach along the normal
    separation = r(v) + kick         a kick that adds to the rebound (bumper)
    separation = r(v + kick)         a kick that adds to the approach (slingshot)

Restitution falls with speed as in Visual Pinball (`ElasticityWithFalloff`, src/physics/collide.h), whose rubber
rebounds at 0.8/(1 + 0.3 v) of v m/s. A kick acts once for each impact above its threshold. The two laws are those of
`BumperHitCircle::Collide` and `LineSegSlingshot::Collide` (src/physics/collideex.cpp); there a slingshot's kick is a
parabola along its length.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

from sandbox.scene.description.base import Point
from sandbox.scene.geometry.vectors import nearest_fraction


def rebound(restitution: float, falloff: float, closing: float) -> float:
    """Return the speed of separation without a kick, m/s, after an approach at `closing`, m/s; `falloff` is in s/m."""
    if closing <= 0.0:
        return restitution * closing
    return restitution / (1.0 + falloff * closing) * closing


def kicked(speed: float, threshold: float, middle: bool, fraction: float, closing: float) -> float:
    """Return the speed of a kick at a point of its surface, m/s; 0 below the threshold.

    Args:
        speed: of the kick, m/s.
        threshold: speed of approach, m/s, up to which there is no kick.
        middle: whether the kick is largest in the middle of the surface and 0 at its ends.
        fraction: position of the contact as a fraction of the length, 0 to 1.
        closing: speed of approach, m/s.
    """
    if closing <= threshold:
        return 0.0
    return speed * 4.0 * fraction * (1.0 - fraction) if middle else speed


def kick_gain(restitution: float, falloff: float, kick: float, to_approach: bool, closing: float) -> float:
    """Return the increase of the speed of separation by a kick, m/s.

    Args:
        restitution: of the two surfaces.
        falloff: of the two surfaces, s/m.
        kick: speed of the kick, m/s, as `kicked` returns it.
        to_approach: whether it adds to the approach instead of the rebound.
        closing: the speed of approach, m/s.
    """
    if not to_approach or kick == 0.0:
        return kick
    increased = closing + kick
    return restitution / (1.0 + falloff * increased) * increased - restitution / (1.0 + falloff * closing) * closing


def segment_fractions(points: Sequence[Point]) -> list[tuple[float, float]]:
    """Return the fractions of a polyline's length at which each segment begins and ends."""
    lengths = [math.dist(a, b) for a, b in pairwise(points)]
    total, begin = math.fsum(lengths), 0.0
    fractions = []
    for length in lengths:
        fractions.append((begin / total, (begin + length) / total))
        begin += length
    return fractions


def fraction_at(a: Point, b: Point, fractions: tuple[float, float], point: Point) -> float:
    """Return the fraction of a polyline's length at the point of its segment from a to b that is nearest to a point.

    Args:
        a: begin of the segment, m.
        b: its end, m.
        fractions: fractions at which the segment begins and ends, as from `segment_fractions`.
        point: m.
    """
    fraction = nearest_fraction(a[0], a[1], b[0], b[1], point[0], point[1])
    return fractions[0] + (fractions[1] - fractions[0]) * fraction
