"""Joints at the start: warnings of joints with an initial error, and of anchors in the wrong order."""

from collections.abc import Iterator

import numpy as np

from sandbox.arrays import BoolArray
from sandbox.measure.forecast.warning import Figures, Warning
from sandbox.measure.joint_error import sizes, starting_errors
from sandbox.scene.compile.joint_arrays import WORLD, JointArrays, LinkKind
from sandbox.scene.scene import Scene

LOOSE = 0.01
"""An error below this part of a joint's length is rounding of the figures in a file, which have two or three digits."""

FAR = 2.0
"""An anchor farther than this many radii from its body's centre is a lever without mass, or a mistake."""

ANGLES = (LinkKind.ROTARY_LIMIT, LinkKind.GEAR)
ANCHORED = (LinkKind.ROD, LinkKind.PIVOT, LinkKind.SLIDE, LinkKind.SPRING)

ORDER = "in a joint with one body, the first of `anchors` is in the frame of the body, the second in world coordinates"


def joint_start_warnings(scene: Scene) -> Iterator[Warning]:
    """Yield a warning for the joint with the largest initial error, and one for the first joint with swapped anchors.

    Anchors count as swapped where a joint with one body holds it by a point far outside it while the other anchor would
    lie within the body; not so of a pivot that starts satisfied, since the other order would violate it.
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
    if swapped.any():
        k, others = int(np.argmax(swapped)), int(swapped.sum()) - 1
        name, body = links.names[k], scene.bodies.names[int(links.b[k])]
        x, y = links.anchor_b[k].tolist()
        message = (
            f"the joint {name!r} is attached to {body!r} at ({x:g}, {y:g}), outside the body and "
            f"{np.hypot(x, y):.3g} m from its centre: {ORDER}; swapped, they would fit{_and_others(others)}"
        )
        yield Warning("anchors", message, {"joint": name, "body": body, "others": others})


def _off(links: JointArrays, k: int, error: float, others: int) -> Warning:
    """Return the warning for a joint that starts off by an error, m or rad."""
    unit, name = "rad" if links.kind[k] in ANGLES else "m", links.names[k]
    message = (
        f"the joint {name!r} starts with an error of {error:.3g} {unit}{_and_others(others)}; "
        "the first steps correct it, which adds energy"
    )
    figures: Figures = {"joint": name, "error": error, "others": others}
    return Warning("joint_start", message, figures)


def _and_others(count: int) -> str:
    return f" (and {count:,} other{'s' if count > 1 else ''})" if count else ""


def _swapped(scene: Scene, links: JointArrays) -> BoolArray:
    """Tell which joints of one body with the world have anchors that would fit in the other order, (J,)."""
    radius = scene.bodies.radius[links.b]
    own, other = np.hypot(*links.anchor_b.T), np.hypot(*links.anchor_a.T)
    stated = np.arange(len(links)) < len(scene.joints)
    held = stated & (links.a == WORLD) & np.isin(links.kind, ANCHORED)
    return np.asarray(held & (own > FAR * radius) & (other <= radius))
