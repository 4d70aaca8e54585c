"""Joints at the start: those that the first step would have to pull together, and anchors in the wrong order."""

from collections.abc import Iterator

import numpy as np

from sandbox.measure.forecast.warning import Figures, Warning
from sandbox.measure.joint_error import sizes, starting_errors
from sandbox.scene.links import WORLD, LinkKind, Links
from sandbox.scene.model import Scene
from sandbox.trajectory import BoolArray

LOOSE = 0.01
"""An error below this part of a joint's length is rounding of the figures in a file, which have two or three digits."""

FAR = 2.0
"""An anchor beyond this many radii of its own body is held by nothing of it: a lever without mass, or a mistake."""

ANGLES = (LinkKind.ROTARY_LIMIT, LinkKind.GEAR)
ANCHORED = (LinkKind.ROD, LinkKind.PIVOT, LinkKind.SLIDE, LinkKind.SPRING)

ORDER = "of a joint with one body, the first of its `anchors` is in the body's frame and the second in the world"


def joint_start_warnings(scene: Scene) -> Iterator[Warning]:
    """Yield a warning for the joint that starts farthest from what it holds, and for each with swapped anchors.

    A joint is taken for swapped where it holds one body by a point far outside it, its other anchor would be within
    the body, and the joint does not start satisfied in a way that only the given order explains.
    """
    links = scene.links
    if not len(links):
        return
    errors = starting_errors(scene)
    shares = np.nan_to_num(errors / sizes(links, scene.bodies))
    swapped = _swapped(scene, links) & ~((links.kind == LinkKind.PIVOT) & (shares <= LOOSE))
    off = (shares > LOOSE) & ~swapped
    if off.any():
        worst = int(np.argmax(np.where(off, shares, 0.0)))
        yield _off(links, worst, float(errors[worst]), int(off.sum()) - 1)
    for k in np.flatnonzero(swapped).tolist():
        name, body = links.names[k], scene.bodies.names[int(links.b[k])]
        x, y = links.anchor_b[k].tolist()
        message = (
            f"the joint {name!r} holds {body!r} by the point ({x:g}, {y:g}), {np.hypot(x, y):.3g} m from its centre "
            f"and outside it: {ORDER}; swapped, they would fit"
        )
        yield Warning("anchors", message, {"joint": name, "body": body})


def _off(links: Links, k: int, error: float, others: int) -> Warning:
    """Return the warning for a joint that starts off by an error, m or rad."""
    unit, name = "rad" if links.kind[k] in ANGLES else "m", links.names[k]
    more = f" (and {others:,} other{'s' if others > 1 else ''} by less)" if others else ""
    message = (
        f"the joint {name!r} starts {error:.3g} {unit} away from what it holds{more}; the first steps correct it, "
        "fast and with energy from nowhere"
    )
    figures: Figures = {"joint": name, "error": error, "others": others}
    return Warning("joint_start", message, figures)


def _swapped(scene: Scene, links: Links) -> BoolArray:
    """Tell which joints of one body with the world have anchors that would fit in the other order, (J,)."""
    radius = scene.bodies.radius[links.b]
    own, other = np.hypot(*links.anchor_b.T), np.hypot(*links.anchor_a.T)
    stated = np.arange(len(links)) < len(scene.joints)
    held = stated & (links.a == WORLD) & np.isin(links.kind, ANCHORED)
    return np.asarray(held & (own > FAR * radius) & (other <= radius))
