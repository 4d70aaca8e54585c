"""Bob: the pendulum that tells how hard a table was pushed."""

import cmath
import math

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

STILL = 1e-5
"""rad, and as much speed over ω: a bob that swings less is at rest"""


class Bob:
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
        return abs(self.angle) < STILL and abs(self.rate) < STILL * self.omega

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
