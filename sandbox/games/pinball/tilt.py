"""Nudge: the table is jolted, its balls lag behind, and a bob tells when it was too much.

Bob: the pendulum that tells how hard a table was pushed.
"""

import cmath
import math
from collections.abc import Iterator
from itertools import pairwise

from sandbox.action import Force
from sandbox.games.pinball.events import Device, Effect, PlaySound, ShowMessage, StepContext
from sandbox.games.pinball.playfield import Playfield

LENGTH = 0.10
"""m"""

TRIP = math.radians(1.0)
"""rad from the plumb, where the ring is"""

DAMPING = 0.05
"""of critical: a free swing has lost nine tenths after seven periods"""

BOUNCE = 0.3
"""of its speed is left to a bob that has struck the ring"""

GRAVITY = 9.81
"""m/s²"""

SUBSTEP = 1e-3
"""s, between looks at the ring: at the greatest speed of a nudge, 1.25 rad/s, the bob is seen .07° too late at most"""

REST_SPEED = 1e-5
"""rad, and as much speed over ω: a bob that swings less is at rest"""


class TiltBob:
    """A pendulum on the table's frame, small angles, both directions at once: z = x + iy, in rad.

    The frame's acceleration a drives it: z″ + 2ζω·z′ + ω²z = −a/L, ω² = g/L. While a is constant this has a closed
    form, so steps of any length are exact: about z∞ = −a/g the free motion e^(−ζωt)·(A cos ω′t + B sin ω′t), with
    ω′ = ω√(1 − ζ²). One push a of length τ leaves an undamped bob with the amplitude 2(a/g)·sin(ωτ/2).
    """

    def __init__(self, damping: float = DAMPING, trip: float = TRIP) -> None:
        """Hang it at rest; a trip of inf is no ring."""
        self.damping, self.trip = damping, trip
        self.omega = math.sqrt(GRAVITY / LENGTH)
        self.angle = 0j
        self.rate = 0j
        """rad/s"""

    @property
    def still(self) -> bool:
        """Whether nothing moves, so that time need not pass."""
        return abs(self.angle) < REST_SPEED and abs(self.rate) < REST_SPEED * self.omega

    def swing(self, seconds: float, acceleration: complex) -> int:
        """Let time pass under a constant acceleration of the table, m/s²; return how often the bob struck the ring."""
        struck, parts = 0, max(1, math.ceil(seconds / SUBSTEP - 1e-9))
        for _ in range(parts):
            self._step(seconds / parts, acceleration)
            if abs(self.angle) < self.trip:
                continue
            out = self.angle / abs(self.angle)
            way = (self.rate * out.conjugate()).real
            self.angle = self.trip * out
            if way > 0.0:
                self.rate -= (1.0 + BOUNCE) * way * out
                struck += 1
        return struck

    def _step(self, h: float, acceleration: complex) -> None:
        decay, omega = self.damping * self.omega, self.omega * math.sqrt(1.0 - self.damping**2)
        rest = -acceleration / GRAVITY
        a = self.angle - rest
        b = (self.rate + decay * a) / omega
        turn = cmath.exp(complex(-decay, omega) * h)
        c, s = turn.real, turn.imag
        self.angle = rest + a * c + b * s
        self.rate = (b * omega - decay * a) * c - (a * omega + decay * b) * s


JOLT = 0.5 * GRAVITY
"""m/s², of the table. Source, as of the time: Visual Pinball's nudge of a key"""

SECONDS = 0.025
"""of a jolt: a free ball gains .123 m/s"""

AGAIN = 0.3
"""s, in which the bob's further strokes on the ring are of the same push"""

WARNINGS = 2
"""of a ball; the next stroke is a tilt"""

_AWAKE = 1e-12  # s, of rounding in the ends of jolts


class NudgeAndTilt(Device):
    """Jolts and the tilt.

    In the table's frame a jolt is an inertial force on what can move. That force is laid on each loose ball by itself:
    a change of `world.gravity` would have the whole scene checked anew, four times a jolt, and would not reach a ball
    in a zone with a gravity of its own. A jolt need not be a multiple of the step: the force in a step is the mean.
    """

    def __init__(self, board: Playfield) -> None:
        self.board = board
        self.jolts: list[tuple[float, complex]] = []
        """when each began, s, and how its balls are accelerated, m/s²"""
        self.pushed: dict[int, complex] = {}
        """ball → acceleration that acts on it now, m/s²"""
        self.bob = TiltBob()
        self.time = 0.0
        """until which the bob has swung, s"""
        self.quiet = 0.0
        """until then strokes are of the last push, s"""
        self.warnings = 0
        self.tilted = False

    def jolt(self, direction: complex, strength: float, now: StepContext) -> Iterator[Effect]:
        """Jolt the table from now on, so that its balls go in a direction, of length 1, with a strength from 0 to 1."""
        self.jolts.append((now.time, direction * strength * JOLT))
        yield PlaySound("nudge")
        yield from self._pushes(now)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Swing the bob until now; push the balls from now on."""
        struck = self._swung(now.time)
        self.jolts = [(began, a) for began, a in self.jolts if began + SECONDS > now.time + _AWAKE]
        yield from self._pushes(now)
        if not struck or self.tilted or now.time < self.quiet or not now.loose:  # a ball that waits gains nothing
            return
        self.quiet = now.time + AGAIN
        self.warnings += 1
        if self.warnings <= WARNINGS:
            yield PlaySound("warning")
            yield ShowMessage("danger!" if self.warnings < WARNINGS else "danger, danger!")
        else:
            self.tilted = True
            yield PlaySound("tilt")
            yield ShowMessage("tilt")

    def begin(self, now: StepContext) -> Iterator[Effect]:
        """Forgive, and let the bob hang still."""
        self.warnings, self.tilted, self.bob = 0, False, TiltBob()
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

    def _pushes(self, now: StepContext) -> Iterator[Effect]:
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
