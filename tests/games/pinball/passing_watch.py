"""Observer that detects balls passing through a flipper, or through a gate from its solid side, after every substep.

The audit of missed contacts knows only the largest inscribed disc of a flipper, and ignores gates.
"""

import math

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.forces import PlungerDrive

LENGTH, BASE, TIP = 0.0702, 0.0116, 0.007
"""m, flippers of all tables: distance between the centres of their ends, and radii of the ends"""


class PassageObserver:
    """Observer of a simulation that records passages and the depth of overlaps with flippers."""

    def __init__(self, scene: Scene, bodies: Bodies, balls: tuple[int, ...]) -> None:
        flippers = [drive for drive in scene.drives if not isinstance(drive, PlungerDrive)]
        self.flippers = [(bodies.names.index(drive.body), drive.pivot) for drive in flippers]
        self.gates = [(wall.points[0], wall.points[-1], wall.thickness / 2.0) for wall in scene.walls if wall.one_way]
        self.balls = {ball: float(bodies.radius[ball]) for ball in balls}
        self.passages: list[tuple[float, str]] = []
        """time, s, and element of each passage"""
        self.max_depth = 0.0
        """m, overlap of a ball with a flipper"""
        # ball and gate, for balls that were last wholly on the left of the gate
        self._clear: set[tuple[int, int]] = set()

    def __call__(self, time: float, start: FloatArray, end: FloatArray, _: IntArray) -> None:
        for ball, radius in self.balls.items():
            (ax, ay), (bx, by) = start[ball].tolist(), end[ball].tolist()
            for flipper, (px, py) in self.flippers:
                if abs(bx - px) + abs(by - py) < 0.2:
                    old = _along_and_left(ax - px, ay - py, start[flipper, 0] - px, start[flipper, 1] - py)
                    new = _along_and_left(bx - px, by - py, end[flipper, 0] - px, end[flipper, 1] - py)
                    self._check_flipper(time, radius, old, new)
            for k, (a, b, half) in enumerate(self.gates):
                self._check_gate(time, (ball, k), radius + half, a, b, (bx, by))

    def _check_flipper(self, time: float, radius: float, old: tuple[float, float], new: tuple[float, float]) -> None:
        """Check a ball near a flipper; `old` and `new` are its coordinates along the centre line and to its left, m."""
        along, offset = new
        nearest = min(max(along, 0.0), LENGTH)
        depth = radius + BASE + (TIP - BASE) * nearest / LENGTH - math.hypot(along - nearest, offset)
        self.max_depth = max(self.max_depth, depth)
        if old[1] * offset < 0.0 and 0.0 <= along <= LENGTH:  # beyond the ends the ball passes around the flipper
            self.passages.append((time, "bat"))

    def _check_gate(
        self,
        time: float,
        key: tuple[int, int],
        clearance: float,
        a: tuple[float, float],
        b: tuple[float, float],
        position: tuple[float, float],
    ) -> None:
        along, offset = _along_and_left(position[0] - a[0], position[1] - a[1], b[0] - a[0], b[1] - a[1])
        beside = 0.0 <= along <= math.dist(a, b)
        if offset > clearance and beside:
            self._clear.add(key)
        elif offset < 0.0 and beside and key in self._clear:
            self.passages.append((time, "gate"))
        if offset < 0.0 or not beside:
            self._clear.discard(key)


def _along_and_left(x: float, y: float, dx: float, dy: float) -> tuple[float, float]:
    """Return the coordinates of a point along a direction and to its left, m."""
    size = math.hypot(dx, dy)
    return (x * dx + y * dy) / size, (dx * y - dy * x) / size
