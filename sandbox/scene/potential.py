"""Potential: the energy stored between bodies, in springs and in attraction."""

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.forces import Attraction
from sandbox.scene.links import LinkKind, Links
from sandbox.scene.model import Scene
from sandbox.scene.near import BoolArray, FloatArray, IntArray

ROUNDING = 1e-12
"""Share of a time."""


class Potential:
    """What springs and attraction store, frame by frame.

    A spring stores ½ k (l − l₀)², a rotary one ½ k (φ − φ₀)². An attraction a = s/(r² + ε²) has −m s/r where ε = 0,
    else −(m s/ε)·atan(ε/r), which is 0 far away; between a body and one that attracts it counts once. What two
    moving bodies store belongs half to each, what one stores against the world or a fixed body is all its own.
    """

    def __init__(self, scene: Scene, bodies: Bodies, body: int | None = None, breaks: FloatArray | None = None) -> None:
        """Take what a scene has of them.

        Args:
            scene: its springs hold by the numbers of its own bodies.
            bodies: those and any that were spawned since: they are attracted too.
            body: the only one whose share counts; else all.
            breaks: (J,) s, when each of the scene's joints broke; inf where it never did, without, none did.
        """
        links = scene.links
        breaks = np.full(len(links), np.inf) if breaks is None else breaks
        kinds = (LinkKind.SPRING, _stretch), (LinkKind.ROTARY_SPRING, _turn)
        self._springs = [(links.of(kind), breaks[links.kind == kind], strain) for kind, strain in kinds]
        number = {name: k for k, name in enumerate(bodies.names)} if scene.attractions else {}
        self._attractions = [
            (each, number.get(each.toward) if isinstance(each.toward, str) else None)
            for each in scene.attractions
            if not isinstance(each.toward, str) or each.toward in number
        ]
        self._mass = np.where(bodies.fixed, 0.0, bodies.mass)
        self._fixed = bodies.fixed
        self._body = body

    @property
    def springs(self) -> bool:
        """There are springs."""
        return any(len(links) for links, _, _ in self._springs)

    @property
    def attracts(self) -> bool:
        """There is attraction."""
        return bool(self._attractions)

    def __bool__(self) -> bool:
        """Tell whether there is anything of it."""
        return self.attracts or self.springs

    def at(self, time: FloatArray, position: FloatArray, angle: FloatArray, there: BoolArray) -> FloatArray:
        """Return what is stored in each of T frames, (T,) J.

        Args:
            time: (T,) s; what has broken by then stores nothing.
            position: (T, N, 2) m.
            angle: (T, N) rad.
            there: (T, N) who is; what held or attracted the others is no more.
        """
        return self.of_springs(time, position, angle, there) + self.of_attraction(position, there)

    def of_springs(self, time: FloatArray, position: FloatArray, angle: FloatArray, there: BoolArray) -> FloatArray:
        """Return what springs store in each of T frames, (T,) J; the arguments are those of `at`."""
        stored = np.zeros(len(position))
        for links, breaks, strain in self._springs:
            if len(links):
                energy = 0.5 * links.figures[:, 1] * np.square(strain(links, position, angle) - links.figures[:, 0])
                holds = both_there(links, there) & ~parted(breaks, time)
                stored += np.where(holds, energy, 0.0) @ self._share(links.a, links.b)
        return stored

    def of_attraction(self, position: FloatArray, there: BoolArray) -> FloatArray:
        """Return what attraction stores in each of T frames, (T,) J; the arguments are those of `at`."""
        stored = np.zeros(len(position))
        for attraction, toward in self._attractions:
            stored += self._attracted(attraction, toward, position, there)
        return stored

    def _attracted(
        self, attraction: Attraction, toward: int | None, position: FloatArray, there: BoolArray
    ) -> FloatArray:
        drawn = np.flatnonzero(self._mass)
        if toward is None:
            place = np.asarray(attraction.toward, dtype=np.float64)
            share = np.ones(len(drawn)) if self._body is None else (drawn == self._body).astype(np.float64)
            counts = there[:, drawn]
        else:
            drawn = drawn[drawn != toward]
            place = position[:, toward, None]
            share = self._share(np.full(len(drawn), toward), drawn)
            counts = there[:, drawn] & there[:, toward, None]
        away = position[:, drawn] - place
        distance, soft = np.hypot(away[..., 0], away[..., 1]), attraction.softening
        with np.errstate(divide="ignore"):
            depth = np.arctan2(soft, distance) / soft if soft > 0.0 else 1.0 / distance
        return np.asarray(np.where(counts, -attraction.strength * depth, 0.0) @ (self._mass[drawn] * share))

    def _share(self, a: IntArray, b: IntArray) -> FloatArray:
        """Return the share of what pairs store that counts, (K,)."""
        if self._body is None:
            return np.ones(len(b))
        first, second = (a >= 0) & ~self._fixed[a], ~self._fixed[b]
        mine = ((a == self._body) & first).astype(np.float64) + ((b == self._body) & second)
        return np.asarray(mine / np.maximum(first.astype(np.float64) + second, 1.0))


def both_there(links: Links, there: BoolArray) -> BoolArray:
    """Tell which links still have both their bodies, (T, J), from who is there, (T, N)."""
    return np.asarray(there[:, links.b] & (there[:, links.a] | (links.a < 0)))


def parted(breaks: FloatArray, time: FloatArray) -> BoolArray:
    """Tell which joints have broken by each of some times, (T, J).

    Args:
        breaks: (J,) s, inf for what never does.
        time: (T,) s. Times of frames are sums that round: what breaks within rounding of one has broken by then.
    """
    return np.asarray(breaks * (1.0 - ROUNDING) <= time[:, None])


def ends_over_time(links: Links, position: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where links hold their first and second bodies, (T, J, 2) m each, in T frames."""
    return (
        _placed(links.a, links.anchor_a, position, angle),
        _placed(links.b, links.anchor_b, position, angle),
    )


def turned_by(links: Links, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the angles of the first and second bodies of links, (T, J) rad each; the world's is 0."""
    return np.where(links.a >= 0, angle[:, links.a], 0.0), angle[:, links.b]


def _stretch(links: Links, position: FloatArray, angle: FloatArray) -> FloatArray:
    first, second = ends_over_time(links, position, angle)
    return np.asarray(np.hypot(*np.moveaxis(second - first, 2, 0)))


def _turn(links: Links, _: FloatArray, angle: FloatArray) -> FloatArray:
    first, second = turned_by(links, angle)
    return np.asarray(second - first)


def _placed(number: IntArray, anchor: FloatArray, position: FloatArray, angle: FloatArray) -> FloatArray:
    cos, sin = np.cos(angle[:, number]), np.sin(angle[:, number])
    x, y = anchor.T
    turned = position[:, number] + np.stack((cos * x - sin * y, sin * x + cos * y), axis=2)
    return np.where((number >= 0)[:, None], turned, anchor)
