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
from sandbox.scene.zone import mask_of

FIXED_KINDS = (Plane, Wall, Post)


@dataclass(frozen=True, eq=False)
class Meetings:
    """What can meet what, among N bodies and F fixed things with S surfaces."""

    surfaces: Surfaces
    touches: BoolArray
    """(N,) can meet something"""
    held: BoolArray
    """(N,) is joined to something"""
    noted: BoolArray
    """(N,) can come into a zone; what a drive leads is not noted"""
    turnable: BoolArray
    """(N,) can be turned: by what rubs it; of other shapes than balls by all they meet; by joints, thrusts, drives"""
    mutual: bool
    """Some two bodies can meet."""
    ball_ball: bool
    """Some two balls can meet."""
    solid: BoolArray
    """(S,) surfaces of pieces that are no balls and can meet something"""
    ball_fixed: dict[type[Plane] | type[Wall] | type[Post], bool]
    """Whether some ball can meet a plane, a wall, a post."""
    touching: BoolArray
    """(S, S) surfaces of which some bearer can meet some bearer, symmetric"""

    @property
    def solids(self) -> bool:
        """Whether some body that is no ball can meet something."""
        return bool(self.solid.any())

    @property
    def free(self) -> BoolArray:
        """(N,) can meet nothing, comes into no zone, and is joined to nothing."""
        return ~self.touches & ~self.held & ~self.noted

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
    layers: IntArray
    """(K,) the bits of all layers that they can get to"""
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
    reached = reach(scene, bodies)
    kinds = _kinds(bodies, surfaces, reached)
    surface, to_all = kinds.surface, kinds.to_all
    moving, still = ~kinds.fixed & kinds.to_any, kinds.fixed & kinds.to_any
    pair = np.outer(moving & to_all, moving & to_all) & ~(np.eye(len(surface), dtype=bool) & kinds.alone)
    pair |= np.outer(moving, still & to_all) | np.outer(still & to_all, moving)
    pair &= (kinds.layers[:, None] & kinds.layers) != 0

    size = len(surfaces.surfaces)
    touching = np.zeros((size, size), dtype=bool)
    rows, columns = np.nonzero(pair)
    touching[surface[rows], surface[columns]] = True
    rubs = surfaces.friction > 0
    ground = [(moving & ((kinds.layers & mask) != 0), rows) for mask, rows in _by_layers(scene)]
    meets: BoolArray = np.asarray(pair.any(axis=1))
    for able, _ in ground:
        meets |= able
    turned = np.asarray((pair & rubs[np.ix_(surface, surface)]).any(axis=1)) | (meets & ~kinds.ball)

    for able, rows in ground:
        fixed_surface = np.unique(surfaces.of_fixed[rows])
        reaching = surface[able]
        touching[np.ix_(reaching, fixed_surface)] = True
        touching[np.ix_(fixed_surface, reaching)] = True
        turned |= able & rubs[np.ix_(surface, fixed_surface)].any(axis=1)

    links, body = scene.links, _body_of_piece(bodies)
    turnable = _any_of(body, (turned & moving)[kinds.of_piece], len(bodies)) | links.turned(len(bodies))
    return Meetings(
        surfaces=surfaces,
        touches=_any_of(body, meets[kinds.of_piece], len(bodies)),
        held=links.held(len(bodies)),
        noted=_noted(scene, bodies, reached) & ~driven_in(scene, bodies),
        turnable=(turnable | _thrust_turned(scene, bodies) | driven_in(scene, bodies, turning=True)) & ~bodies.fixed,
        mutual=bool(pair.any()),
        ball_ball=bool((pair & np.outer(kinds.ball, kinds.ball)).any()),
        solid=np.isin(np.arange(size), surface[meets & ~kinds.ball]),
        ball_fixed={
            kind: any(
                bool((able & kinds.ball).any()) and any(isinstance(scene.fixed[k], kind) for k in rows.tolist())
                for able, rows in ground
            )
            for kind in FIXED_KINDS
        },
        touching=touching,
    )


def reach(scene: Scene, bodies: Bodies) -> IntArray:
    """Return the bits of all layers that each body can get to, (N,), from the one that it is on."""
    layers = scene.layers
    if len(layers) == 1:
        return np.ones(len(bodies), np.int64)
    of_layer = [1 << k for k in range(len(layers))]
    mouths = [(mask_of(z.layers, layers), 1 << layers.index(z.to_layer)) for z in scene.zones if z.to_layer is not None]
    for _ in layers:  # a way from one to another is no longer than there are layers
        for mask, to in mouths:
            of_layer = [bits | to if bits & mask else bits for bits in of_layer]
    goes = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element] & ~bodies.fixed
    return np.asarray(np.where(goes, np.asarray(of_layer)[bodies.layer], 1 << bodies.layer))


def bits_of(layer: IntArray | None, count: int) -> IntArray:
    """Return the layers that bodies are on as bits, (N,), from a frame's numbers; without any, all on the ground."""
    return np.ones(count, np.int64) if layer is None else 1 << layer


def _noted(scene: Scene, bodies: Bodies, reached: IntArray) -> BoolArray:
    """Return which bodies zones can note, (N,)."""
    if not scene.zones:
        return np.zeros(len(bodies), np.bool_)
    some = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element] & ~bodies.fixed
    every = 0
    for zone in scene.zones:
        every |= mask_of(zone.layers, scene.layers)
    still_inside = bodies.visits.any(axis=1)  # of a zone whose layers it has left: that it goes out is noted too
    return np.asarray(some & ((reached & every != 0) | still_inside))


def _by_layers(scene: Scene) -> list[tuple[int, IntArray]]:
    """Return the layers that fixed things are on, as bits, each with the numbers of those that are on just these."""
    masks = np.asarray([mask_of(thing.layers, scene.layers) for thing in scene.fixed], dtype=np.int64)
    return [(mask, np.flatnonzero(masks == mask)) for mask in np.unique(masks).tolist()]


def _kinds(bodies: Bodies, surfaces: Surfaces, reached: IntArray) -> Kinds:
    """Group pieces by (surface, layers, ball, fixed, meets all, meets any)."""
    collides = [element.collides for element in bodies.elements]
    meets_all = np.asarray([c == "all" for c in collides], dtype=np.int64)[bodies.element]
    meets_any = np.asarray([c != "none" for c in collides], dtype=np.int64)[bodies.element]
    traits = bodies.round.astype(np.int64) << 3 | bodies.fixed.astype(np.int64) << 2 | meets_all << 1 | meets_any
    body = _body_of_piece(bodies)
    masks, layers = np.unique(reached, return_inverse=True)
    traits |= layers.reshape(-1) << 4
    count = max(len(masks), 1)
    code = surfaces.of_shape * (count << 4) + (traits if body is None else traits[body])
    counts = np.bincount(code if body is None else np.unique(np.column_stack((code, body)), axis=0)[:, 0])
    present = np.flatnonzero(counts)
    row_of = np.zeros(len(counts), np.int64)
    row_of[present] = np.arange(len(present))
    bits = [(present >> k & 1).astype(bool) for k in range(4)]
    return Kinds(
        surface=(present >> 4) // count,
        layers=masks[(present >> 4) % count] if len(masks) else np.empty(0, np.int64),
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
