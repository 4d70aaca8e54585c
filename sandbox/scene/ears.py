"""Cuts simple outlines into triangles, ear by ear, the best-shaped ear first.

An ear is a corner whose triangle with its neighbours holds no other corner. Every simple polygon of four or more
corners has two (G. H. Meisters, Polygons Have Ears, American Mathematical Monthly 82, 1975). All signs are exact.
"""

import math
from collections.abc import Sequence
from heapq import heapify, heappop, heappush

from sandbox.scene.outline import OutlineError, turn
from sandbox.scene.part import Point


def triangles(points: Sequence[Point]) -> list[tuple[int, int, int]]:
    """Cut a counter-clockwise simple outline of n corners into n - 2 triangles; O(n · reflex corners).

    Args:
        points: (n, 2) m; corners on straight edges are welcome.

    Returns:
        (n - 2, 3) indices of corners, each triangle counter-clockwise.

    Raises:
        OutlineError: there is no ear, so the outline is not simple.
    """
    n = len(points)
    before, after = [(i - 1) % n for i in range(n)], [(i + 1) % n for i in range(n)]
    hollow = {i for i in range(n) if turn(points[i - 1], points[i], points[(i + 1) % n]) <= 0.0}
    heap = [(-_shape(points, i - 1, i, (i + 1) % n), i, (i - 1) % n, (i + 1) % n) for i in range(n)]
    heapify(heap)
    cut: list[tuple[int, int, int]] = []
    while heap and len(cut) < n - 3:
        _, i, a, b = heappop(heap)
        if before[i] != a or after[i] != b or i in hollow or _blocked(points, hollow, (a, i, b)):
            continue  # out of date, or no ear; whatever blocks it goes on doing so until a neighbour is cut
        cut.append((a, i, b))
        after[a], before[b] = b, a
        before[i] = after[i] = -1
        for j in (a, b):
            corner = before[j], j, after[j]
            if j in hollow and turn(*(points[k] for k in corner)) > 0.0:
                hollow.remove(j)
            heappush(heap, (-_shape(points, *corner), j, corner[0], corner[2]))
    if len(cut) < n - 3:
        raise OutlineError("the outline has no corner that can be cut off; it may not cross or touch itself")
    last = next(i for i in range(n) if after[i] >= 0)
    return [*cut, (before[last], last, after[last])]


def _blocked(points: Sequence[Point], hollow: set[int], ear: tuple[int, int, int]) -> bool:
    """Tell whether a hollow corner lies in the triangle, or on it; if any corner does, then a hollow one."""
    a, b, c = (points[i] for i in ear)
    left, right = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
    low, high = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
    for i in hollow:
        p = points[i]
        if not (left <= p[0] <= right and low <= p[1] <= high) or i in ear:  # cheap first: most lie elsewhere
            continue
        if turn(a, b, p) >= 0.0 and turn(b, c, p) >= 0.0 and turn(c, a, p) >= 0.0:
            return True
    return False


def _shape(points: Sequence[Point], i: int, j: int, k: int) -> float:
    """Return how plump a triangle is: its doubled area over the square of its longest side; 0 for a needle."""
    a, b, c = points[i], points[j], points[k]
    return turn(a, b, c) / max(math.dist(a, b), math.dist(b, c), math.dist(c, a)) ** 2
