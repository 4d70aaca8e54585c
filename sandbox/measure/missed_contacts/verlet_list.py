"""Verlet list: pairs of bodies that may collide in a substep, kept from one substep to the next.

The list has every pair within a skin of contact, and stays complete as long as all bodies have moved by less than half
the skin. The few bodies that have moved farther are listed again, against all others in rows, with a larger skin if
they are as fast as a bullet; if they are many, the whole list is rebuilt. Source: L. Verlet, Computer "experiments" on
classical fluids I, Phys. Rev. 159 (1967), 98.
"""

from collections.abc import Callable, Iterator

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.geometry.neighbours import CHUNK, near_pairs

BUILD_COST = 20_000
"""Cost of building a list in entries of rows (measured), besides `BUILD_COST_PER_BODY` for each body."""
BUILD_COST_PER_BODY = 50
TARGET_LIFETIME = 32.0
"""Substeps for which a list should last, as long as half its skin then stays within a radius."""
MIN_SKIN = 0.1
"""Smallest half skin as a fraction of the typical radius: thinner lists save nothing more."""
ROUNDING = 1e-9
"""Relative increase of reaches, far above rounding (1e-16), so that no pair is lost."""
CELL_CANDIDATES = 4.5
"""Candidates in the nine cells of a body, if each pair is visited once."""

CanCollide = Callable[[IntArray, IntArray], BoolArray]
Pairs = tuple[IntArray, IntArray]
Encounters = tuple[IntArray, IntArray, IntArray]
"""Substep, first body and second body of each encounter, (K,) each."""


class VerletList:
    """Pairs that may come into contact among the `member` bodies of N bodies with radii (N,), m.

    `can_collide` returns which pairs of indices (K,), (K,) can collide at all.
    """

    def __init__(self, radius: FloatArray, member: BoolArray, can_collide: CanCollide) -> None:
        self._radius = radius
        self._member = member
        self._can_collide = can_collide
        self._members = np.flatnonzero(member)
        self._typical = float(np.median(radius[self._members])) if len(self._members) else 0.0
        self._max_renewed = BUILD_COST_PER_BODY + BUILD_COST // max(len(self._members), 1)
        self._anchor = np.full((len(radius), 2), np.inf)
        self._skin = self._typical
        self._half_skin = np.full(len(radius), self._typical)
        self._first = self._second = np.empty(0, np.int64)

    def encounters(self, start: FloatArray, end: FloatArray, fast: BoolArray) -> Encounters:
        """Return at least every pair that comes into contact on its path, in each of B substeps.

        Args:
            start: centres at the start of each substep, (B, N, 2) m; nan for bodies that are not present.
            end: centres at the end, (B, N, 2) m.
            fast: (B, N); at least one of each pair is fast.

        Returns:
            Substep, lower and higher index of each pair, (K,) each, without duplicates.
        """
        found: list[Encounters] = []
        begin = 0
        while begin < len(start):
            lasting, (when, first, second) = self._first_encounters(start[begin:], end[begin:], fast[begin:])
            found.append((when + begin, first, second))
            begin += lasting
        if len(found) == 1:
            return found[0]
        when, first, second = map(np.concatenate, zip(*found, strict=True))
        return when, first, second

    def _first_encounters(self, start: FloatArray, end: FloatArray, fast: BoolArray) -> tuple[int, Encounters]:
        """Return the encounters of the first substeps, for which one list lasts, and their number."""
        moved_beyond_skin = self._moved_beyond_skin(start, end)
        if np.count_nonzero(moved_beyond_skin) > self._max_renewed:
            typical = self._typical_displacement(start[0], end[0])
            skin = min(max(TARGET_LIFETIME * typical, MIN_SKIN * self._typical), self._typical)
            lasting = max(1, int(skin / typical)) if typical > 0 else len(start)
            if lasting < len(start):
                _, encounters = self._first_encounters(start[:lasting], end[:lasting], fast[:lasting])
                return lasting, encounters
            if typical > skin:
                return len(start), self._swept(start[0], end[0], fast[0])
            self._build(start[0], skin)
            moved_beyond_skin = self._moved_beyond_skin(start, end)
        if moved_beyond_skin.any():
            self._renew(start, end, np.flatnonzero(moved_beyond_skin))
        ever: BoolArray = np.asarray(fast.any(axis=0))
        listed = np.flatnonzero(ever[self._first] | ever[self._second])
        first, second = self._first[listed], self._second[listed]
        when, at = np.nonzero(fast[:, first] | fast[:, second])
        return len(start), (when, first[at], second[at])

    def _moved_beyond_skin(self, start: FloatArray, end: FloatArray) -> BoolArray:
        """Return which bodies leave their half of the common skin or had a larger skin, (N,)."""
        absent = np.isnan(start[0, :, 0])
        within_skin = (_max_displacement(start, end, self._anchor) <= self._skin) & (self._half_skin <= self._skin)
        return self._member & ~absent & ~within_skin

    def _present_members(self, start: FloatArray, end: FloatArray) -> IntArray:
        """Return the indices of the members that are present before and after."""
        return self._members[np.isfinite(start[self._members] + end[self._members]).all(axis=1)]

    def _swept(self, start: FloatArray, end: FloatArray, fast: BoolArray) -> Encounters:
        """Return the pairs that may collide in one substep, by the circles around their paths."""
        self._anchor[:] = np.inf
        self._first = self._second = np.empty(0, np.int64)
        members = self._present_members(start, end)
        position, move = start[members], end[members] - start[members]
        reach = self._radius[members] + 0.5 * np.sqrt((move * move).sum(axis=1)) * (1 + ROUNDING)
        first, second = self._colliding_pairs(members, self._close(position + 0.5 * move, reach), fast)
        return np.zeros_like(first), first, second

    def _renew(self, start: FloatArray, end: FloatArray, moved_beyond_skin: IntArray) -> None:
        """List some bodies again at their present position, with a skin that contains their paths."""
        self._anchor[moved_beyond_skin] = start[0, moved_beyond_skin]
        position = start[0, moved_beyond_skin]
        first, last = (
            np.where(np.isnan(path), position, path)
            for path in (start[:, moved_beyond_skin], end[:, moved_beyond_skin])
        )
        self._half_skin[moved_beyond_skin] = np.maximum(_max_displacement(first, last, position), self._skin)
        members = self._members[np.isfinite(self._anchor[self._members]).all(axis=1)]
        reach = self._radius[members] + self._half_skin[members] * (1 + ROUNDING)
        renewed = np.zeros_like(self._member)
        renewed[moved_beyond_skin] = True
        rows = np.flatnonzero(renewed[members])
        all_bodies = np.ones_like(self._member)
        first, second = self._colliding_pairs(members, _in_rows(rows, self._anchor[members], reach), all_bodies)
        keep = ~(renewed[self._first] | renewed[self._second])
        self._first = np.concatenate((self._first[keep], first))
        self._second = np.concatenate((self._second[keep], second))

    def _typical_displacement(self, start: FloatArray, end: FloatArray) -> float:
        """Return the displacement of bodies in a substep, without that of a few fast ones, m."""
        members = self._present_members(start, end)
        jump = np.sort(np.sqrt(((end[members] - start[members]) ** 2).sum(axis=1)))
        return float(jump[max(len(jump) - 1 - self._max_renewed // 2, len(jump) // 2)]) if len(jump) else 0.0

    def _build(self, position: FloatArray, skin: float) -> None:
        """List the pairs that are less than two half skins from contact."""
        self._skin = skin
        self._half_skin[:] = skin
        self._anchor[:] = position
        members = self._present_members(position, position)
        reach = self._radius[members] + skin * (1 + ROUNDING)
        all_bodies = np.ones_like(self._member)
        self._first, self._second = self._colliding_pairs(members, self._close(position[members], reach), all_bodies)

    def _close(self, position: FloatArray, reach: FloatArray) -> Iterator[Pairs]:
        """Yield every pair nearer than the sum of its reaches, by cells.

        Large reaches would make large cells, in which all small ones are candidates; these go in rows.
        """
        order = np.argsort(-reach, kind="stable")
        crowd = np.minimum((reach[order] / self._typical) ** 2, len(order))
        large = int(np.argmin(np.arange(len(order)) + CELL_CANDIDATES * crowd))
        if large:
            yield from _in_rows(np.sort(order[:large]), position, reach)
        small = order[large:]
        x, y = np.ascontiguousarray(position.T)
        for i, j in near_pairs(position[small], 2 * float(reach[small].max(initial=0.0))):
            i, j = small[i], small[j]
            across, up = x[j] - x[i], y[j] - y[i]
            is_near = across * across + up * up < (reach[i] + reach[j]) ** 2
            yield i[is_near], j[is_near]

    def _colliding_pairs(self, members: IntArray, found: Iterator[Pairs], fast: BoolArray) -> Pairs:
        """Join chunks of pairs, given as positions among the members, that can collide and have a fast body."""
        pairs = [np.empty((2, 0), np.int64)]
        for chunk in found:
            i, j = members[chunk[0]], members[chunk[1]]
            able = self._can_collide(i, j) & (fast[i] | fast[j])
            pairs.append(np.stack((np.minimum(i, j)[able], np.maximum(i, j)[able])))
        first, second = np.concatenate(pairs, axis=1)
        return first, second


def _in_rows(rows: IntArray, centre: FloatArray, reach: FloatArray) -> Iterator[Pairs]:
    """Yield, in chunks, every pair with one of `rows` nearer than the sum of its reaches, without duplicates."""
    in_rows = np.zeros(len(centre), dtype=np.bool_)
    in_rows[rows] = True
    for part in np.array_split(rows, max(1, len(rows) * len(centre) // CHUNK)):
        across, up = (centre[part, axis, None] - centre[:, axis] for axis in (0, 1))
        is_near = across * across + up * up < (reach[part, None] + reach) ** 2
        at, j = np.nonzero(is_near)
        i = part[at]
        once = (j > i) | ~in_rows[j]
        yield i[once], j[once]


def _max_displacement(start: FloatArray, end: FloatArray, anchor: FloatArray) -> FloatArray:
    """Return an upper bound of the displacement of bodies in B substeps, (N,) m: to corners of boxes.

    Args:
        start: (B, N, 2) m.
        end: (B, N, 2) m.
        anchor: positions from which displacements count, (N, 2) m.
    """
    low = np.minimum(start.min(axis=0), end.min(axis=0)) - anchor
    high = np.maximum(start.max(axis=0), end.max(axis=0)) - anchor
    farthest = np.maximum(high, -low)
    farthest *= farthest
    return np.asarray(np.sqrt(farthest[:, 0] + farthest[:, 1]))
