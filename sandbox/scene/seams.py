"""Seams: the joints of ropes, cloth and ragdolls, by the numbers of a scene's bodies."""

from dataclasses import replace

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.layout import turned
from sandbox.scene.layouts import count_of
from sandbox.scene.limbs import limb_links
from sandbox.scene.links import Links
from sandbox.scene.model import Scene, default_name
from sandbox.scene.near import FloatArray
from sandbox.scene.part import Point
from sandbox.scene.ragdoll import Ragdoll
from sandbox.scene.surfaced import Mover
from sandbox.scene.weaves import ENDS, Cloth, Rope, Woven
from sandbox.scene.weaving import ENDS_AT, STARTS_AT, cloth_links, rope_links


def seams_of(scene: Scene, bodies: Bodies) -> Links:
    """Lay out the joints of a scene's generators, in their order, counted each by itself.

    The bodies that ropes are tied to must be there. Joints between fixed bodies are left out.
    """
    links = Links.none()
    if not (scene.ropes or scene.cloths or scene.ragdolls):
        return links
    first, still = 0, np.append(bodies.fixed, True)  # the world, −1, finds the last
    for kind, movers in scene.kinds.items():
        for k, mover in enumerate(movers):
            own = _own(mover, first, bodies)
            first += count_of(mover)
            own = own.some(~(still[own.a] & still[own.b]))
            if isinstance(mover, Woven) and mover.strength is not None:
                own = replace(own, strength=np.full(len(own), mover.strength))
            stem = mover.name or default_name(kind, k)
            links = links.joined(replace(own, names=tuple(f"{stem}-joint-{n}" for n in range(1, len(own) + 1))))
    return links


def _own(mover: Mover, first: int, bodies: Bodies) -> Links:
    """Return the joints of one generator, whose first body has that number."""
    match mover:
        case Rope():
            return _tied(_numbered(rope_links(mover), first), mover, bodies)
        case Cloth():
            return _numbered(cloth_links(mover), first)
        case Ragdoll():
            return _numbered(limb_links(mover), first)
        case _:
            return Links.none()


def _numbered(links: Links, first: int) -> Links:
    """Return links by the numbers of a scene's bodies; what is negative stands for something else."""
    return replace(
        links, a=np.where(links.a < 0, links.a, links.a + first), b=np.where(links.b < 0, links.b, links.b + first)
    )


def _tied(links: Links, rope: Rope, bodies: Bodies) -> Links:
    """Return a rope's links with the bodies that its ends are tied to, held where the ends start."""
    for end, place, stand_in in zip(ENDS, (rope.start, rope.end), (STARTS_AT, ENDS_AT), strict=True):
        name = rope.tied(end)
        if name is not None:
            number = bodies.names.index(name)
            anchor = _seen(place, number, bodies)
            first, second = links.a == stand_in, links.b == stand_in
            links = replace(
                links,
                a=np.where(first, number, links.a),
                b=np.where(second, number, links.b),
                anchor_a=np.where(first[:, None], anchor, links.anchor_a),
                anchor_b=np.where(second[:, None], anchor, links.anchor_b),
            )
    return links


def _seen(place: Point, number: int, bodies: Bodies) -> FloatArray:
    """Return a place in the world as a body sees it from its centre of mass, (2,) m."""
    return turned(np.asarray([place]) - bodies.position[number], -float(bodies.angle[number])).reshape(2)
