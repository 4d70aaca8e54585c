"""Pace: how many steps of fixed length each picture needs, and how fast the scene really goes.

The accumulator of G. Fiedler, "Fix Your Timestep!" (2004): real time is saved up and spent in whole steps; what is
left over says how far between two states the picture lies.
"""

from collections import deque

STEPS_TO_TENTH = 10
"""Speeds from one decade to the next: 100, 79, 63, 50, 40, 32, 25, 20, 16, 13, 10 %."""
SLOWEST, FASTEST = -30, 10
"""0.1 % to 1000 %"""
LONGEST = 0.1
"""s of real time that one picture may ask for: after a pause of the machine the scene does not jump"""
WINDOW = 0.5
"""s over which the real speed is measured"""


class Pace:
    """Turns real time into steps."""

    def __init__(self) -> None:
        self._rung = 0
        self._saved = 0.0
        self._seen: deque[tuple[float, float]] = deque()  # real and simulated time of each picture, s

    @property
    def speed(self) -> float:
        """Asked, as a share of real time."""
        return float(10.0 ** (self._rung / STEPS_TO_TENTH))

    @property
    def real_speed(self) -> float:
        """Reached lately, as a share of real time; as asked, before anything is known."""
        real = sum(each for each, _ in self._seen)
        return sum(each for _, each in self._seen) / real if real > WINDOW / 2.0 else self.speed

    def slower(self) -> None:
        """Go one rung down."""
        self._rung = max(self._rung - 1, SLOWEST)
        self._seen.clear()

    def faster(self) -> None:
        """Go one rung up."""
        self._rung = min(self._rung + 1, FASTEST)
        self._seen.clear()

    def due(self, elapsed: float, dt: float) -> int:
        """Save up real time, s, and return the whole steps of dt, s, that it is enough for."""
        self._saved += min(elapsed, LONGEST) * self.speed
        return int(self._saved / dt * (1.0 + 1e-12))

    def spent(self, elapsed: float, steps: int, asked: int, dt: float) -> None:
        """Take note of the steps that were made; those that could not be are dropped, and the scene is slower."""
        self._saved = max(self._saved - max(steps, asked) * dt, 0.0)
        self._seen.append((elapsed, steps * dt))
        while len(self._seen) > 1 and sum(each for each, _ in self._seen) > WINDOW:
            self._seen.popleft()

    def flow(self, elapsed: float) -> float:
        """Return how much simulated time, s, real time is, where there are no steps to be made of it."""
        time = min(elapsed, LONGEST) * self.speed
        self._seen.append((elapsed, time))
        while len(self._seen) > 1 and sum(each for each, _ in self._seen) > WINDOW:
            self._seen.popleft()
        return time

    def between(self, dt: float) -> float:
        """Return how far the picture lies from the last state but one to the last, 0 to 1."""
        return min(max(self._saved / dt, 0.0), 1.0)

    def rest(self) -> None:
        """Forget what was saved up, as in a pause: the picture shows the last state."""
        self._saved = 0.0
        self._seen.clear()
