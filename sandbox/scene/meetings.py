"""Meetings: which bodies can ever touch something, and with which coefficients.

Derived from the scene alone, by kind: nothing is simulated. What can meet nothing needs no shape, what meets
only frictionless things needs no moment.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.driven import driven_in
from sandbox.scene.model import Plane, Post, Scene, Wall
from sandbox.scene.near import BoolArray, IntArray
from sandbox.scene.shapes import form_of
from sandbox.scene.surfaces import Surfaces, surfaces_of

FIXED_KINDS = (Plane, Wall, Post)


@dataclass(frozen=True, eq=False)
class Meetings:
    """What can meet what, among N bodies and F fixed things with S surfaces."""

    surfaces: Surfaces
    touches: BoolArray
    """(N,) can meet something"""
    held: BoolArray
    """(N,) is joined to something"""
    turnable: BoolArray
    """(N,) can be turned: by what rubs it; of other shapes than balls by all they meet; by joints, thrusts, drives"""
    mutual: bool
    """Some two bodies can meet."""
    ball_ball: bool
    """Some two balls can meet."""
    solids: bool
    """Some body that is no ball can meet something."""
    ball_fixed: dict[type[Plane] | type[Wall] | type[Post], bool]
    """Whether some ball can meet a plane, a wall, a post."""
    touching: BoolArray
    """(S, S) surfaces of which some bearer can meet some bearer, symmetric"""

    @property
    def free(self) -> BoolArray:
        """(N,) can meet nothing and is joined to nothing."""
        return ~self.touches & ~self.held

    @property
    def restitution(self) -> float:
        """The largest restitution of any possible contact."""
        return float(np.max(self.surfaces.restitution[self.touching], initial=0.0))

    @property
    def friction(self) -> float:
        """The largest friction of any possible contact."""
        return float(np.max(self.surfaces.friction[self.touching], initial=0.0))


class Kinds(NamedTuple):
    """The kinds of pieces that there are, K of them; what holds for one of a kind holds for all."""

    surface: IntArray
    """(K,)"""
    fixed: BoolArray
    """(K,)"""
    to_all: BoolArray
    """(K,) of bodies that meet everything"""
    to_any: BoolArray
    """(K,) of bodies that meet anything"""
    ball: BoolArray
    """(K,) a lone disc"""
    alone: BoolArray
    """(K,) all of one body, which does not meet itself"""
    of_piece: IntArray
    """(S,) the kind of each piece"""


def meetings(scene: Scene, bodies: Bodies | None = None) -> Meetings:
    """Derive what can meet what, for the scene's own bodies or for `bodies` that grew from them."""
    bodies = scene.bodies if bodies is None else bodies
    surfaces = surfaces_of(scene, bodies)
    kinds = _kinds(bodies, surfaces)
    surface, to_all = kinds.surface, kinds.to_all
    moving, still = ~kinds.fixed & kinds.to_any, kinds.fixed & kinds.to_any
    pair = np.outer(moving & to_all, moving & to_all) & ~(np.eye(len(surface), dtype=bool) & kinds.alone)
    pair |= np.outer(moving, still & to_all) | np.outer(still & to_all, moving)

    size = len(surfaces.surfaces)
    touching = np.zeros((size, size), dtype=bool)
    rows, columns = np.nonzero(pair)
    touching[surface[rows], surface[columns]] = True
    rubs = surfaces.friction > 0
    meets = pair.any(axis=1) | (moving & (len(scene.fixed) > 0))
    turned = (pair & rubs[np.ix_(surface, surface)]).any(axis=1) | (meets & ~kinds.ball)

    fixed_surface = np.flatnonzero(np.bincount(surfaces.of_fixed))
    if len(fixed_surface):
        reached = surface[moving]
        touching[np.ix_(reached, fixed_surface)] = True
        touching[np.ix_(fixed_surface, reached)] = True
        turned |= moving & rubs[np.ix_(surface, fixed_surface)].any(axis=1)

    links, body = scene.links, _body_of_piece(bodies)
    turnable = _any_of(body, (turned & moving)[kinds.of_piece], len(bodies)) | links.turned(len(bodies))
    return Meetings(
        surfaces=surfaces,
        touches=_any_of(body, meets[kinds.of_piece], len(bodies)),
        held=links.held(len(bodies)),
        turnable=(turnable | _thrust_turned(scene, bodies) | driven_in(scene, bodies, turning=True)) & ~bodies.fixed,
        mutual=bool(pair.any()),
        ball_ball=bool((pair & np.outer(kinds.ball, kinds.ball)).any()),
        solids=bool((meets & ~kinds.ball).any()),
        ball_fixed={
            kind: bool((moving & kinds.ball).any()) and any(isinstance(f, kind) for f in scene.fixed)
            for kind in FIXED_KINDS
        },
        touching=touching,
    )


def _kinds(bodies: Bodies, surfaces: Surfaces) -> Kinds:
    """Group pieces by (surface, ball, fixed, meets all, meets any)."""
    collides = [element.collides for element in bodies.elements]
    meets_all = np.asarray([c == "all" for c in collides], dtype=np.int64)[bodies.element]
    meets_any = np.asarray([c != "none" for c in collides], dtype=np.int64)[bodies.element]
    traits = bodies.round.astype(np.int64) << 3 | bodies.fixed.astype(np.int64) << 2 | meets_all << 1 | meets_any
    body = _body_of_piece(bodies)
    code = surfaces.of_shape << 4 | (traits if body is None else traits[body])
    counts = np.bincount(code if body is None else np.unique(np.column_stack((code, body)), axis=0)[:, 0])
    present = np.flatnonzero(counts)
    row_of = np.zeros(len(counts), np.int64)
    row_of[present] = np.arange(len(present))
    bits = [(present >> k & 1).astype(bool) for k in range(4)]
    return Kinds(
        surface=present >> 4,
        fixed=bits[2],
        to_all=bits[1],
        to_any=bits[0],
        ball=bits[3],
        alone=counts[present] < 2,
        of_piece=row_of[code],
    )


def _body_of_piece(bodies: Bodies) -> IntArray | None:
    """Return the body of each piece; none where each body is one, as balls are."""
    return None if bodies.round.all() else bodies.shapes.body


def _any_of(body: IntArray | None, pieces: BoolArray, count: int) -> BoolArray:
    """Return which bodies have a piece of which something holds."""
    if body is None:
        return pieces
    found = np.zeros(count, dtype=np.bool_)
    found[body[pieces]] = True
    return found


def _thrust_turned(scene: Scene, bodies: Bodies) -> BoolArray:
    """Return which bodies have a thrust that does not point through their centre of mass."""
    found = np.zeros(len(bodies), dtype=np.bool_)
    for thrust in scene.thrusts:
        if thrust.body in bodies.names:
            number = bodies.names.index(thrust.body)
            x, y = form_of(bodies.elements[bodies.element[number]]).centre
            found[number] |= (thrust.point[0] - x) * thrust.force[1] != (thrust.point[1] - y) * thrust.force[0]
    return found
