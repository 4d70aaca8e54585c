"""Nudge: the table is jolted, its balls lag behind, and a bob tells when it was too much."""

from collections.abc import Iterator
from itertools import pairwise

from sandbox.action import Force
from sandbox.games.pinball.board import Board
from sandbox.games.pinball.bob import GRAVITY, Bob
from sandbox.games.pinball.effects import Cue, Effect, Machine, Now, Say

JOLT = 0.5 * GRAVITY
"""m/s², of the table. Source, as of the time: Visual Pinball's nudge of a key"""

SECONDS = 0.025
"""of a jolt: a free ball gains .123 m/s"""

AGAIN = 0.3
"""s, in which the bob's further strokes on the ring are of the same push"""

WARNINGS = 2
"""of a ball; the next stroke is a tilt"""

_AWAKE = 1e-12  # s, of rounding in the ends of jolts


class Nudge(Machine):
    """Jolts and the tilt.

    In the table's frame a jolt is an inertial force on what can move. That force is laid on each loose ball by itself:
    a change of `world.gravity` would have the whole scene checked anew, four times a jolt, and would not reach a ball
    in a zone with a gravity of its own. A jolt need not be a multiple of the step: the force in a step is the mean.
    """

    def __init__(self, board: Board) -> None:
        self.board = board
        self.jolts: list[tuple[float, complex]] = []
        """when each began, s, and how its balls are accelerated, m/s²"""
        self.pushed: dict[int, complex] = {}
        """ball → acceleration that acts on it now, m/s²"""
        self.bob = Bob()
        self.time = 0.0
        """until which the bob has swung, s"""
        self.quiet = 0.0
        """until then strokes are of the last push, s"""
        self.warnings = 0
        self.tilted = False

    def jolt(self, direction: complex, strength: float, now: Now) -> Iterator[Effect]:
        """Jolt the table from now on, so that its balls go in a direction, of length 1, with a strength from 0 to 1."""
        self.jolts.append((now.time, direction * strength * JOLT))
        yield Cue("nudge")
        yield from self._pushes(now)

    def tick(self, now: Now) -> Iterator[Effect]:
        """Swing the bob until now; push the balls from now on."""
        struck = self._swung(now.time)
        self.jolts = [(began, a) for began, a in self.jolts if began + SECONDS > now.time + _AWAKE]
        yield from self._pushes(now)
        if not struck or self.tilted or now.time < self.quiet or not now.loose:  # a ball that waits gains nothing
            return
        self.quiet = now.time + AGAIN
        self.warnings += 1
        if self.warnings <= WARNINGS:
            yield Cue("warning")
            yield Say("danger!" if self.warnings < WARNINGS else "danger, danger!")
        else:
            self.tilted = True
            yield Cue("tilt")
            yield Say("tilt")

    def begin(self, now: Now) -> Iterator[Effect]:
        """Forgive, and let the bob hang still."""
        self.warnings, self.tilted, self.bob = 0, False, Bob()
        return iter(())

    def _swung(self, until: float) -> int:
        """Swing the bob from edge to edge of the jolts; return how often it struck the ring."""
        began, self.time = self.time, until
        if not self.jolts and self.bob.still:
            return 0
        edges = {edge for start, _ in self.jolts for edge in (start, start + SECONDS) if began < edge < until}
        times = [began, *sorted(edges), until]
        # The balls lag behind: the table itself goes the other way.
        return sum(self.bob.swing(b - a, -self._mean(a, b)) for a, b in pairwise(times) if b > a)

    def _mean(self, begin: float, end: float) -> complex:
        """Return how balls are accelerated between two times, on average, m/s²."""
        parts = ((min(start + SECONDS, end) - max(start, begin), a) for start, a in self.jolts)
        return sum((max(overlap, 0.0) * a for overlap, a in parts), 0j) / (end - begin)

    def _pushes(self, now: Now) -> Iterator[Effect]:
        """Yield the forces that differ from those that act."""
        wanted = self._mean(now.time, now.time + self.board.dt) if self.jolts else 0j
        for ball in sorted({*self.pushed, *now.loose}) if wanted or self.pushed else ():
            push = wanted if ball in now.loose else 0j
            if push == self.pushed.get(ball, 0j):
                continue
            self.pushed[ball] = push
            if not push:
                del self.pushed[ball]
            force = push * self.board.mass[ball]
            yield Force(time=now.time, body=self.board.names[ball], force=(force.real, force.imag))
