"""Meetings: which bodies can ever touch something, and with which coefficients.

Derived from the scene alone, by kind: nothing is simulated. What can meet nothing needs no shape, what meets
only frictionless things needs no moment.
"""

from dataclasses import dataclass

import numpy as np

from sandbox.scene.bodies import Bodies, BoolArray
from sandbox.scene.model import Plane, Post, Scene, Wall
from sandbox.scene.near import IntArray
from sandbox.scene.surfaces import Surfaces, surfaces_of

FIXED_KINDS = (Plane, Wall, Post)


@dataclass(frozen=True, eq=False)
class Meetings:
    """What can meet what, among N bodies and F fixed things with S surfaces."""

    surfaces: Surfaces
    free: BoolArray
    """(N,) can meet nothing"""
    turnable: BoolArray
    """(N,) can meet something that rubs"""
    ball_ball: bool
    """Some ball can meet another."""
    ball_fixed: dict[type[Plane] | type[Wall] | type[Post], bool]
    """Whether some ball can meet a plane, a wall, a post."""
    touching: BoolArray
    """(S, S) surfaces of which some bearer can meet some bearer, symmetric"""

    @property
    def restitution(self) -> float:
        """The largest restitution of any possible contact."""
        return float(np.max(self.surfaces.restitution[self.touching], initial=0.0))

    @property
    def friction(self) -> float:
        """The largest friction of any possible contact."""
        return float(np.max(self.surfaces.friction[self.touching], initial=0.0))


def meetings(scene: Scene, bodies: Bodies | None = None) -> Meetings:
    """Derive what can meet what, for the scene's own bodies or for `bodies` that grew from them."""
    bodies = scene.bodies if bodies is None else bodies
    surfaces = surfaces_of(scene, bodies)
    classes, member, count = _classes(bodies, surfaces)
    surface, fixed, meets_all, meets_any = (classes[:, k] for k in range(4))

    moving, still = ~fixed.astype(bool) & (meets_any == 1), fixed.astype(bool) & (meets_any == 1)
    to_all = meets_all == 1
    alone = np.eye(len(classes), dtype=bool) & (count < 2)[:, None]
    pair = np.outer(moving & to_all, moving & to_all) & ~alone
    pair |= np.outer(moving, still & to_all) | np.outer(still & to_all, moving)

    size = len(surfaces.surfaces)
    touching = np.zeros((size, size), dtype=bool)
    rows, columns = np.nonzero(pair)
    touching[surface[rows], surface[columns]] = True
    rubs = surfaces.friction > 0
    turned = (pair & rubs[np.ix_(surface, surface)]).any(axis=1)

    fixed_surface = np.flatnonzero(np.bincount(surfaces.of_fixed))
    if len(fixed_surface):
        reached = surface[moving]
        touching[np.ix_(reached, fixed_surface)] = True
        touching[np.ix_(fixed_surface, reached)] = True
        turned |= moving & rubs[np.ix_(surface, fixed_surface)].any(axis=1)

    meets = pair.any(axis=1) | (moving & (len(fixed_surface) > 0))
    return Meetings(
        surfaces=surfaces,
        free=~meets[member],
        turnable=(turned & moving)[member],
        ball_ball=bool(pair.any()),
        ball_fixed={kind: bool(moving.any()) and any(isinstance(f, kind) for f in scene.fixed) for kind in FIXED_KINDS},
        touching=touching,
    )


def _classes(bodies: Bodies, surfaces: Surfaces) -> tuple[IntArray, IntArray, IntArray]:
    """Group bodies by (surface, fixed, meets all, meets any): rows, each body's row, how many in each."""
    collides = [element.collides for element in bodies.elements]
    meets_all = np.asarray([c == "all" for c in collides], dtype=np.int64)[bodies.element]
    meets_any = np.asarray([c != "none" for c in collides], dtype=np.int64)[bodies.element]
    code = surfaces.of_body << 3 | bodies.fixed.astype(np.int64) << 2 | meets_all << 1 | meets_any
    counts = np.bincount(code)
    present = np.flatnonzero(counts)
    row_of = np.zeros(len(counts), np.int64)
    row_of[present] = np.arange(len(present))
    classes = np.column_stack((present >> 3, present >> 2 & 1, present >> 1 & 1, present & 1))
    return classes, row_of[code], counts[present]
