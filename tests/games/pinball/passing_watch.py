"""Whether a ball goes through a bat, or a gate against its sense: looked at after every substep, by plain geometry.

The audit of missed contacts knows of a bat only the largest disc within it, and of gates nothing.
"""

import math

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.forces import PlungerDrive

LENGTH, BASE, TIP = 0.0702, 0.0116, 0.007
"""m, of the bats of all tables: between the middles of their ends, and the radii of these"""


class Watch:
    """An observer of a simulation."""

    def __init__(self, scene: Scene, bodies: Bodies, balls: tuple[int, ...]) -> None:
        bats = [drive for drive in scene.drives if not isinstance(drive, PlungerDrive)]
        self.bats = [(bodies.names.index(drive.body), drive.pivot) for drive in bats]
        self.gates = [(wall.points[0], wall.points[-1], wall.thickness / 2.0) for wall in scene.walls if wall.one_way]
        self.balls = {ball: float(bodies.radius[ball]) for ball in balls}
        self.through: list[tuple[float, str]] = []
        """when, s, and through what"""
        self.deepest = 0.0
        """m, of a ball into a bat"""
        self._clear: set[tuple[int, int]] = set()  # ball and gate, of balls that were last wholly on its left

    def __call__(self, time: float, start: FloatArray, end: FloatArray, _: IntArray) -> None:
        for ball, radius in self.balls.items():
            (ax, ay), (bx, by) = start[ball].tolist(), end[ball].tolist()
            for bat, (px, py) in self.bats:
                if abs(bx - px) + abs(by - py) < 0.2:
                    old = _beside(ax - px, ay - py, start[bat, 0] - px, start[bat, 1] - py)
                    new = _beside(bx - px, by - py, end[bat, 0] - px, end[bat, 1] - py)
                    self._bat(time, radius, old, new)
            for k, (a, b, half) in enumerate(self.gates):
                self._gate(time, (ball, k), radius + half, a, b, (bx, by))

    def _bat(self, time: float, radius: float, old: tuple[float, float], new: tuple[float, float]) -> None:
        """Look at a ball by a bat: how far along its middle line, and to its left, m."""
        along, aside = new
        near = min(max(along, 0.0), LENGTH)
        deep = radius + BASE + (TIP - BASE) * near / LENGTH - math.hypot(along - near, aside)
        self.deepest = max(self.deepest, deep)
        if old[1] * aside < 0.0 and 0.0 <= along <= LENGTH:  # beyond its ends the ball goes round it
            self.through.append((time, "bat"))

    def _gate(
        self,
        time: float,
        who: tuple[int, int],
        room: float,
        a: tuple[float, float],
        b: tuple[float, float],
        at: tuple[float, float],
    ) -> None:
        along, aside = _beside(at[0] - a[0], at[1] - a[1], b[0] - a[0], b[1] - a[1])
        beside = 0.0 <= along <= math.dist(a, b)
        if aside > room and beside:
            self._clear.add(who)
        elif aside < 0.0 and beside and who in self._clear:
            self.through.append((time, "gate"))
        if aside < 0.0 or not beside:
            self._clear.discard(who)


def _beside(x: float, y: float, dx: float, dy: float) -> tuple[float, float]:
    """Return how far a point is along a direction, and to its left, m."""
    size = math.hypot(dx, dy)
    return (x * dx + y * dy) / size, (dx * y - dy * x) / size
