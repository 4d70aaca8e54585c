"""Neighbours: the pairs of balls that may meet in a substep, kept from one substep to the next.

A Verlet list: it holds every pair within a skin of contact, and stays complete for all bodies that have moved
less than half the skin since. The few that moved farther are listed again, against all others in rows, with a
skin of their own if they are as fast as a bullet; when they are many, the whole list is built anew.
Source: L. Verlet, Computer "experiments" on classical fluids I, Phys. Rev. 159 (1967), 98.
"""

from collections.abc import Callable, Iterator

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.geometry.neighbours import CHUNK, near_pairs

BUILDING = 20_000
"""What building a list costs, in entries of rows (measured), beside `BUILDING_EACH` for each body."""
BUILDING_EACH = 50
LASTING = 32.0
"""Substeps for which a list is meant to last, as far as half its skin then stays within a radius."""
LEAST_SKIN = 0.1
"""Half the skin is at least this part of the typical radius: thin lists save nothing more."""
ROUNDING = 1e-9
"""Reaches are taken longer by this part, far above rounding (1e-16), so that it hides no pair."""
CELL_SHARE = 4.5
"""Of the candidates in a body's nine cells, each pair is met once."""

Meet = Callable[[IntArray, IntArray], BoolArray]
Pairs = tuple[IntArray, IntArray]
Encounters = tuple[IntArray, IntArray, IntArray]
"""In which substep, which body, which other one, (K,) each."""


class Neighbours:
    """Pairs of bodies that may come into contact, among `member` of N bodies with these radii (N,), m.

    `meet` says of numbers (K,), (K,) which pairs can touch at all.
    """

    def __init__(self, radius: FloatArray, member: BoolArray, meet: Meet) -> None:
        self._radius = radius
        self._member = member
        self._meet = meet
        self._party = np.flatnonzero(member)
        self._typical = float(np.median(radius[self._party])) if len(self._party) else 0.0
        self._few = BUILDING_EACH + BUILDING // max(len(self._party), 1)
        self._anchor = np.full((len(radius), 2), np.inf)
        self._skin = self._typical
        self._half_skin = np.full(len(radius), self._typical)
        self._first = self._second = np.empty(0, np.int64)

    def encounters(self, start: FloatArray, end: FloatArray, fast: BoolArray) -> Encounters:
        """Return at least every pair that comes into contact on its way, in each of B substeps.

        Args:
            start: centres (B, N, 2) at the start of each substep, m; rows that are nan never pair.
            end: the same at its end.
            fast: (B, N) of each pair at least one is.

        Returns:
            Substeps, and of each pair the lower and the higher number, (K,) each; nothing twice.
        """
        strays = self._strays(start, end)
        if np.count_nonzero(strays) > self._few:
            usual = self._usual(start[0], end[0])
            skin = min(max(LASTING * usual, LEAST_SKIN * self._typical), self._typical)
            lasting = max(1, int(skin / usual)) if usual > 0 else len(start)
            if lasting < len(start):
                early = self.encounters(start[:lasting], end[:lasting], fast[:lasting])
                when, first, second = self.encounters(start[lasting:], end[lasting:], fast[lasting:])
                late = when + lasting, first, second
                when, first, second = map(np.concatenate, zip(early, late, strict=True))
                return when, first, second
            if usual > skin:
                return self._swept(start[0], end[0], fast[0])
            self._build(start[0], skin)
            strays = self._strays(start, end)
        if strays.any():
            self._renew(start, end, np.flatnonzero(strays))
        ever: BoolArray = np.asarray(fast.any(axis=0))
        listed = np.flatnonzero(ever[self._first] | ever[self._second])
        first, second = self._first[listed], self._second[listed]
        when, at = np.nonzero(fast[:, first] | fast[:, second])
        return when, first[at], second[at]

    def _strays(self, start: FloatArray, end: FloatArray) -> BoolArray:
        """Return who leaves its half of the common skin in any of the substeps, or had one of its own, (N,)."""
        gone = np.isnan(start[0, :, 0])
        home = (_farthest(start, end, self._anchor) <= self._skin) & (self._half_skin <= self._skin)
        return self._member & ~gone & ~home

    def _whole(self, start: FloatArray, end: FloatArray) -> IntArray:
        """Return the numbers of those who are there before and after."""
        return self._party[np.isfinite(start[self._party] + end[self._party]).all(axis=1)]

    def _swept(self, start: FloatArray, end: FloatArray, fast: BoolArray) -> Encounters:
        """Return the pairs that may meet in one substep: by the circles around their paths."""
        self._anchor[:] = np.inf
        self._first = self._second = np.empty(0, np.int64)
        party = self._whole(start, end)
        here, move = start[party], end[party] - start[party]
        reach = self._radius[party] + 0.5 * np.sqrt((move * move).sum(axis=1)) * (1 + ROUNDING)
        first, second = self._numbered(party, self._close(here + 0.5 * move, reach), fast)
        return np.zeros_like(first), first, second

    def _renew(self, start: FloatArray, end: FloatArray, strays: IntArray) -> None:
        """Take strays back into the list, where they are now, with a skin that holds them for these substeps."""
        self._anchor[strays] = start[0, strays]
        here = start[0, strays]
        first, last = (np.where(np.isnan(way), here, way) for way in (start[:, strays], end[:, strays]))
        self._half_skin[strays] = np.maximum(_farthest(first, last, here), self._skin)
        party = self._party[np.isfinite(self._anchor[self._party]).all(axis=1)]
        reach = self._radius[party] + self._half_skin[party] * (1 + ROUNDING)
        astray = np.zeros_like(self._member)
        astray[strays] = True
        rows = np.flatnonzero(astray[party])
        everyone = np.ones_like(self._member)
        first, second = self._numbered(party, _in_rows(rows, self._anchor[party], reach), everyone)
        keep = ~(astray[self._first] | astray[self._second])
        self._first = np.concatenate((self._first[keep], first))
        self._second = np.concatenate((self._second[keep], second))

    def _usual(self, start: FloatArray, end: FloatArray) -> float:
        """Return how far bodies move in a substep, all but a few, m."""
        party = self._whole(start, end)
        jump = np.sort(np.sqrt(((end[party] - start[party]) ** 2).sum(axis=1)))
        return float(jump[max(len(jump) - 1 - self._few // 2, len(jump) // 2)]) if len(jump) else 0.0

    def _build(self, place: FloatArray, skin: float) -> None:
        """List the pairs that are less than two half skins from contact."""
        self._skin = skin
        self._half_skin[:] = skin
        self._anchor[:] = place
        party = self._whole(place, place)
        reach = self._radius[party] + skin * (1 + ROUNDING)
        everyone = np.ones_like(self._member)
        self._first, self._second = self._numbered(party, self._close(place[party], reach), everyone)

    def _close(self, place: FloatArray, reach: FloatArray) -> Iterator[Pairs]:
        """Yield every pair nearer than the sum of its reaches, by cells.

        Large reaches would make the cells large and let all the small ones meet: those go in rows.
        """
        order = np.argsort(-reach, kind="stable")
        crowd = np.minimum((reach[order] / self._typical) ** 2, len(order))
        large = int(np.argmin(np.arange(len(order)) + CELL_SHARE * crowd))
        if large:
            yield from _in_rows(np.sort(order[:large]), place, reach)
        small = order[large:]
        x, y = np.ascontiguousarray(place.T)
        for i, j in near_pairs(place[small], 2 * float(reach[small].max(initial=0.0))):
            i, j = small[i], small[j]
            across, up = x[j] - x[i], y[j] - y[i]
            near = across * across + up * up < (reach[i] + reach[j]) ** 2
            yield i[near], j[near]

    def _numbered(self, party: IntArray, found: Iterator[Pairs], fast: BoolArray) -> Pairs:
        """Join chunks of pairs, given as places in the party, that can touch at all and have a fast body."""
        pairs = [np.empty((2, 0), np.int64)]
        for chunk in found:
            i, j = party[chunk[0]], party[chunk[1]]
            able = self._meet(i, j) & (fast[i] | fast[j])
            pairs.append(np.stack((np.minimum(i, j)[able], np.maximum(i, j)[able])))
        first, second = np.concatenate(pairs, axis=1)
        return first, second


def _in_rows(rows: IntArray, centre: FloatArray, reach: FloatArray) -> Iterator[Pairs]:
    """Yield, in chunks, every pair with one of `rows` that is nearer than the sum of its reaches, once."""
    in_rows = np.zeros(len(centre), dtype=np.bool_)
    in_rows[rows] = True
    for part in np.array_split(rows, max(1, len(rows) * len(centre) // CHUNK)):
        across, up = (centre[part, axis, None] - centre[:, axis] for axis in (0, 1))
        near = across * across + up * up < (reach[part, None] + reach) ** 2
        at, j = np.nonzero(near)
        i = part[at]
        once = (j > i) | ~in_rows[j]
        yield i[once], j[once]


def _farthest(start: FloatArray, end: FloatArray, anchor: FloatArray) -> FloatArray:
    """Return how far (N,) bodies get from their anchors in B substeps, at most: to corners of boxes."""
    low = np.minimum(start.min(axis=0), end.min(axis=0)) - anchor
    high = np.maximum(start.max(axis=0), end.max(axis=0)) - anchor
    far = np.maximum(high, -low)
    far *= far
    return np.asarray(np.sqrt(far[:, 0] + far[:, 1]))
