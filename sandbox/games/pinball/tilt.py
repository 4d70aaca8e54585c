"""Nudging and tilt: jolts of the table accelerate its balls; a pendulum in a ring, the tilt bob, detects excess."""

import cmath
import math
from collections.abc import Iterator
from itertools import pairwise

from sandbox.action import Force
from sandbox.games.pinball.events import Device, Effect, PlaySound, ShowMessage, StepContext
from sandbox.games.pinball.playfield import Playfield

BOB_LENGTH = 0.10
"""m, length of the pendulum"""

TRIP_ANGLE = math.radians(1.0)
"""rad from the vertical, position of the ring"""

DAMPING_RATIO = 0.05
"""damping ratio: a free swing loses nine tenths of its amplitude in seven periods"""

BOB_RESTITUTION = 0.3
"""restitution of the bob at the ring"""

GRAVITY = 9.81
"""m/s²"""

SUBSTEP = 1e-3
"""s between tests of the ring: at the largest speed of a nudge, 1.25 rad/s, the bob overshoots by at most 0.07°"""

REST_SPEED = 1e-5
"""rad, for the angle and the speed over ω, below which the bob is at rest"""


class TiltBob:
    """A pendulum on the table's frame, small angles, both directions at once: z = x + iy, in rad.

    The frame's acceleration a drives it: z″ + 2ζω·z′ + ω²z = −a/L, ω² = g/L. While a is constant this has a closed
    form, so steps of any length are exact: about z∞ = −a/g the free motion e^(−ζωt)·(A cos ω′t + B sin ω′t), with
    ω′ = ω√(1 − ζ²). One push a of length τ leaves an undamped bob with the amplitude 2(a/g)·sin(ωτ/2).
    """

    def __init__(self, damping: float = DAMPING_RATIO, trip: float = TRIP_ANGLE) -> None:
        """Create a bob at rest; `trip=inf` removes the ring."""
        self.damping, self.trip = damping, trip
        self.omega = math.sqrt(GRAVITY / BOB_LENGTH)
        self.angle = 0j
        self.rate = 0j
        """rad/s"""

    @property
    def still(self) -> bool:
        """Whether the bob is at rest, so that it need not be stepped."""
        return abs(self.angle) < REST_SPEED and abs(self.rate) < REST_SPEED * self.omega

    def swing(self, seconds: float, acceleration: complex) -> int:
        """Step under a constant acceleration of the table, m/s²; return the number of strikes on the ring."""
        struck, parts = 0, max(1, math.ceil(seconds / SUBSTEP - 1e-9))
        for _ in range(parts):
            self._step(seconds / parts, acceleration)
            if abs(self.angle) < self.trip:
                continue
            out = self.angle / abs(self.angle)
            outward_rate = (self.rate * out.conjugate()).real
            self.angle = self.trip * out
            if outward_rate > 0.0:
                self.rate -= (1.0 + BOB_RESTITUTION) * outward_rate * out
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


JOLT_ACCELERATION = 0.5 * GRAVITY
"""m/s², acceleration of the table. Source, as of the duration: the keyboard nudge of Visual Pinball"""

JOLT_TIME = 0.025
"""s, duration of a jolt: a free ball gains 0.123 m/s"""

SAME_PUSH_TIME = 0.3
"""s in which further strikes on the ring count as the same push"""

MAX_WARNINGS = 2
"""warnings per ball; the next strike is a tilt"""

_TIME_ROUNDING = 1e-12  # s, rounding error of the ends of jolts


class NudgeAndTilt(Device):
    """Jolts and the tilt.

    In the frame of the table a jolt is an inertial force on movable bodies. It is applied to each loose ball: changing
    `world.gravity` would validate the scene four times per jolt, and not affect balls in a zone with its own gravity.
    A jolt need not be a multiple of the step: the force of a step is the mean.
    """

    def __init__(self, board: Playfield) -> None:
        self.board = board
        self.jolts: list[tuple[float, complex]] = []
        """start, s, and acceleration of the balls, m/s², of each jolt"""
        self.pushed: dict[int, complex] = {}
        """ball → its present acceleration, m/s²"""
        self.bob = TiltBob()
        self.time = 0.0
        """s, time up to which the bob has been stepped"""
        self.quiet = 0.0
        """s, time until which strikes count as the last push"""
        self.warnings = 0
        self.tilted = False

    def jolt(self, direction: complex, strength: float, now: StepContext) -> Iterator[Effect]:
        """Start a jolt that accelerates the balls in a direction, of length 1, with a strength from 0 to 1."""
        self.jolts.append((now.time, direction * strength * JOLT_ACCELERATION))
        yield PlaySound("nudge")
        yield from self._forces(now)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Step the bob up to now, and set the forces on the balls."""
        struck = self._step_bob(now.time)
        self.jolts = [(began, a) for began, a in self.jolts if began + JOLT_TIME > now.time + _TIME_ROUNDING]
        yield from self._forces(now)
        if not struck or self.tilted or now.time < self.quiet or not now.loose_balls:
            return
        self.quiet = now.time + SAME_PUSH_TIME
        self.warnings += 1
        if self.warnings <= MAX_WARNINGS:
            yield PlaySound("warning")
            yield ShowMessage("danger!" if self.warnings < MAX_WARNINGS else "danger, danger!")
        else:
            self.tilted = True
            yield PlaySound("tilt")
            yield ShowMessage("tilt")

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Reset warnings, tilt and bob."""
        self.warnings, self.tilted, self.bob = 0, False, TiltBob()
        return iter(())

    def _step_bob(self, until: float) -> int:
        """Step the bob between the starts and ends of jolts; return the number of strikes on the ring."""
        began, self.time = self.time, until
        if not self.jolts and self.bob.still:
            return 0
        edges = {edge for start, _ in self.jolts for edge in (start, start + JOLT_TIME) if began < edge < until}
        times = [began, *sorted(edges), until]
        # The table moves opposite to the balls.
        return sum(self.bob.swing(b - a, -self._mean_acceleration(a, b)) for a, b in pairwise(times) if b > a)

    def _mean_acceleration(self, begin: float, end: float) -> complex:
        """Return the mean acceleration of the balls between two times, m/s²."""
        parts = ((min(start + JOLT_TIME, end) - max(start, begin), a) for start, a in self.jolts)
        return sum((max(overlap, 0.0) * a for overlap, a in parts), 0j) / (end - begin)

    def _forces(self, now: StepContext) -> Iterator[Effect]:
        """Yield the forces that change."""
        wanted = self._mean_acceleration(now.time, now.time + self.board.dt) if self.jolts else 0j
        for ball in sorted({*self.pushed, *now.loose_balls}) if wanted or self.pushed else ():
            push = wanted if ball in now.loose_balls else 0j
            if push == self.pushed.get(ball, 0j):
                continue
            self.pushed[ball] = push
            if not push:
                del self.pushed[ball]
            force = push * self.board.mass[ball]
            yield Force(time=now.time, body=self.board.names[ball], force=(force.real, force.imag))
