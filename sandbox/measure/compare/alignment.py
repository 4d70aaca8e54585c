"""Alignment: which contact of a run is which of the truth's, pair by pair."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from sandbox.measure.compare.errors import divergence_times
from sandbox.measure.compare.touches import CLOSE, Touch, touches
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

GAP = 5.0
"""Steps: what leaving a contact without a partner costs. So two may match that are less than twice this apart."""
MARGIN = 2.0
"""Steps before the end within which a contact alone is not judged: its partner may have come too late to be seen."""

Kind = Literal["matched", "missed", "phantom", "after_divergence"]
Choice = Literal["match", "above", "left"]


@dataclass(frozen=True)
class Event:
    """Contact of the truth and the matching contact of the run; values of an unmatched side are None."""

    kind: Kind
    between: tuple[str, str]
    time: float | None
    """s, time in the truth"""
    engine_time: float | None
    """s, time in the run"""
    delta_time: float | None = None
    """s, positive if the run is late"""
    delta_position: float | None = None
    """m, distance between the contact points at the first touch"""
    delta_impulse: float | None = None
    """N·s, size of the difference of the impulses; None if the contact lasts beyond the end"""
    lasting: bool = False
    """whether it is a lasting contact, or a series of impacts too fast to be resolved, and not a single impact"""

    @property
    def when(self) -> float:
        """The earlier of the two times, s."""
        return min(time for time in (self.time, self.engine_time) if time is not None)


def aligned(
    run: Trajectory, truth: Trajectory, scene: Scene, dt: float, tolerance: float, until: float
) -> tuple[Event, ...]:
    """Match the contacts of a run with the truth's, and return all in the order of time.

    Rows that no fixed step could tell apart are one touch first (`touches`). Within each pair, touches are matched
    in order so that the sum of |Δt| and of `GAP` steps for each one left alone is smallest. Alone in the truth is
    missed, alone in the run is phantom, with three exceptions: part of a touch that lasts in both is neither, neither
    is judged within `MARGIN` steps of the end, and where one of the two bodies was off by more than the tolerance
    before, both are `after_divergence`: the contact may as well have another time, place or partner then.

    Args:
        run: what is judged.
        truth: against what.
        scene: of both.
        dt: the step that they have in common, s.
        tolerance: of positions, m; two surfaces no farther apart are taken to stay in touch.
        until: contacts count up to here, s.
    """
    beyond = until + 2.0 * GAP * dt
    # What goes on beyond the end has an impulse from beyond it too; at the end of both runs there is no beyond.
    cut = until if until < max(run.time[-1], truth.time[-1]) else math.inf
    mine, its = (touches(each, scene, dt, tolerance, beyond) for each in (run, truth))
    found: list[Event] = []
    parted = divergence_times(run, truth, tolerance)
    for pair in sorted({*mine, *its}):
        names = _name(scene, pair[0]), _name(scene, pair[1])
        right, own = its.get(pair, []), mine.get(pair, [])
        partners = matched([t.start for t in right], [t.start for t in own], GAP * dt)
        for k, n in partners:
            if right[k].start <= until:
                found.append(_together(names, right[k], own[n], dt, cut))
        judged = until - MARGIN * dt
        sides: tuple[tuple[Literal["missed", "phantom"], list[Touch], list[Touch], set[int]], ...] = (
            ("missed", right, own, {k for k, _ in partners}),
            ("phantom", own, right, {n for _, n in partners}),
        )
        for kind, those, others, taken in sides:
            alone = [touch for k, touch in enumerate(those) if k not in taken and touch.start <= judged]
            followed = min(float(parted[number]) for number in pair if number >= 0)
            found += [
                _single(kind, touch.start > followed, names, touch, dt)
                for touch in alone
                if not _within(touch, others, dt)
            ]
    return tuple(sorted(found, key=lambda event: (event.when, event.between)))


def matched(truth: Sequence[float], run: Sequence[float], gap: float) -> list[tuple[int, int]]:
    """Match two ascending lists of times in order, so that Σ|Δt| + gap·(how many stay alone) is smallest.

    Equivalently, so that the gain Σ(2·gap − |Δt|) of the matches is largest. `best[j]` is that of the truth so far
    with the first j of the run. Beyond the band of times less than 2·gap away nothing can match, and `best` is
    level: time and memory go with the width of the bands, not with the product of the lengths.

    Returns:
        Index pairs, ascending in both.
    """
    best = [0.0]
    rows: list[tuple[int, list[Choice]]] = []  # for each of the truth, where its band starts, and what is best in it
    low = high = 0
    for time in truth:
        while high < len(run) and run[high] < time + 2.0 * gap:
            high += 1
        while low < high and run[low] <= time - 2.0 * gap:
            low += 1
        best += [best[-1]] * (high + 1 - len(best))
        choices: list[Choice] = []
        diagonal = best[low]  # of the row above, which is overwritten
        for j in range(low, high):
            gained, above = diagonal + 2.0 * gap - abs(run[j] - time), best[j + 1]
            diagonal = above
            best[j + 1] = max(gained, above, best[j])
            choices.append("match" if gained == best[j + 1] else "above" if above == best[j + 1] else "left")
        rows.append((low, choices))

    found: list[tuple[int, int]] = []
    j = len(run)
    for i in range(len(rows) - 1, -1, -1):
        low, choices = rows[i]
        j = min(j, low + len(choices))
        while j > low and choices[j - low - 1] == "left":
            j -= 1
        if j > low and choices[j - low - 1] == "match":
            j -= 1
            found.append((i, j))
    return found[::-1]


def _within(touch: Touch, others: Sequence[Touch], dt: float) -> bool:
    """Tell whether a touch that lasts, or soon follows, is part of one that lasts on the other side."""
    return _lasts(touch, dt) and any(
        _lasts(other, dt) and other.start <= touch.end and touch.start <= other.end for other in others
    )


def _lasts(touch: Touch, dt: float) -> bool:
    return touch.end - touch.start > CLOSE * dt


def _together(names: tuple[str, str], right: Touch, own: Touch, dt: float, cut: float) -> Event:
    lasting = _lasts(right, dt) or _lasts(own, dt)
    open_ended = max(right.end, own.end) > cut and lasting
    return Event(
        "matched",
        names,
        right.start,
        own.start,
        own.start - right.start,
        math.dist(right.point, own.point),
        None if open_ended else math.dist(right.impulse, own.impulse),
        lasting,
    )


def _single(
    kind: Literal["missed", "phantom"], diverged: bool, names: tuple[str, str], touch: Touch, dt: float
) -> Event:
    time, engine_time = (touch.start, None) if kind == "missed" else (None, touch.start)
    return Event("after_divergence" if diverged else kind, names, time, engine_time, lasting=_lasts(touch, dt))


def _name(scene: Scene, number: int) -> str:
    return scene.bodies.names[number] if number >= 0 else scene.fixed_names[-1 - number]
