"""Rebound: the speed at which two bodies part after a hit, one law for every engine.

    r(v) = e / (1 + f·v) · v,        v the speed of approach along the normal
    parting = r(v) + kick            a kick that adds to the rebound (bumper)
    parting = r(v + kick)            a kick that adds to the approach (slingshot)

Restitution falls with speed as in Visual Pinball (`ElasticityWithFalloff`, src/physics/collide.h), whose rubber
rebounds at 0.8/(1 + 0.3 v) of v m/s. A kick acts once for each hit above its threshold. The two laws are those of
`BumperHitCircle::Collide` and `LineSegSlingshot::Collide` (src/physics/collideex.cpp); there a slingshot's kick is a
parabola along its length.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.scene.part import Point


def rebound(restitution: float, falloff: float, closing: float) -> float:
    """Return how fast two part by themselves, m/s, that meet at `closing`, m/s; `falloff` is in s/m."""
    if closing <= 0.0:
        return restitution * closing
    return restitution / (1.0 + falloff * closing) * closing


def kicked(speed: float, threshold: float, middle: bool, share: float, closing: float) -> float:
    """Return the speed of a kick at a point of its surface, m/s; 0 below the threshold.

    Args:
        speed: of the kick, m/s.
        threshold: of the approach, m/s, up to which there is none.
        middle: whether it is most in the middle.
        share: of the length at which it was hit, 0 to 1.
        closing: the speed of approach, m/s.
    """
    if closing <= threshold:
        return 0.0
    return speed * 4.0 * share * (1.0 - share) if middle else speed


def kick_gain(restitution: float, falloff: float, kick: float, to_approach: bool, closing: float) -> float:
    """Return by how much a kick raises the speed of parting, m/s.

    Args:
        restitution: of the two surfaces.
        falloff: of the two surfaces, s/m.
        kick: speed of the kick, m/s, as `kicked` returns it.
        to_approach: whether it adds to the approach instead of the rebound.
        closing: the speed of approach, m/s.
    """
    if not to_approach or kick == 0.0:
        return kick
    driven = closing + kick
    return restitution / (1.0 + falloff * driven) * driven - restitution / (1.0 + falloff * closing) * closing


compiled_rebound, compiled_kicked, compiled_kick_gain = kernel(rebound), kernel(kicked), kernel(kick_gain)
"""The same for kernels; for one contact at a time compiling takes longer than it saves."""


def stretches(points: Sequence[Point]) -> list[tuple[float, float]]:
    """Return for each segment of a polyline at which shares of the whole length it begins and ends."""
    lengths = [math.dist(a, b) for a, b in pairwise(points)]
    whole, begin = math.fsum(lengths), 0.0
    found = []
    for length in lengths:
        found.append((begin / whole, (begin + length) / whole))
        begin += length
    return found


def share_at(a: Point, b: Point, stretch: tuple[float, float], point: Point) -> float:
    """Return at which share of a whole polyline the nearest place of its segment from a to b lies."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    along = ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / (dx * dx + dy * dy)
    return stretch[0] + (stretch[1] - stretch[0]) * min(max(along, 0.0), 1.0)
