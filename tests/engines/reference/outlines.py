"""Random convex pieces in the layout of the kernels, and reference results from shapely and qhull."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely
from scipy.spatial import ConvexHull

from sandbox.engines.reference.polygon import collide_half_plane, collide_pieces

Outline = tuple[np.ndarray, float]
"""corners (n, 2), counter-clockwise, and radius"""


def pack_outlines(*outlines: Outline) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return corner, first, radius."""
    corners = [np.asarray(corners, dtype=np.float64).reshape(-1, 2) for corners, _ in outlines]
    first = np.cumsum([0, *(len(each) for each in corners)])
    return np.concatenate(corners), first, np.asarray([radius for _, radius in outlines], dtype=np.float64)


def collide(p: Outline, q: Outline, reach: float = math.inf) -> np.ndarray:
    """Return the rows that collide_pieces writes."""
    out = np.full((2, 6), math.nan)
    return out[: collide_pieces(*pack_outlines(p, q), 0, 1, reach, out)]


def collide_plane(p: Outline, point: tuple[float, float], normal: tuple[float, float], reach: float) -> np.ndarray:
    """Return the rows that collide_half_plane writes."""
    out = np.full((2, 6), math.nan)
    return out[: collide_half_plane(*pack_outlines(p), 0, *point, *normal, reach, out)]


def moved(outline: Outline, x: float, y: float, angle: float = 0.0) -> Outline:
    """Return an outline rotated about the origin, then translated."""
    cos, sin = math.cos(angle), math.sin(angle)
    return outline[0] @ np.array([[cos, sin], [-sin, cos]]) + (x, y), outline[1]


def box(x: float = 0.0, y: float = 0.0, width: float = 1.0, height: float = 1.0, angle: float = 0.0) -> Outline:
    w, h = 0.5 * width, 0.5 * height
    return moved((np.array([(-w, -h), (w, -h), (w, h), (-w, h)]), 0.0), x, y, angle)


def disc(x: float, y: float, radius: float) -> Outline:
    return np.array([(x, y)]), radius


def capsule(ax: float, ay: float, bx: float, by: float, radius: float) -> Outline:
    return np.array([(ax, ay), (bx, by)]), radius


def ring(count: int, radius: float = 1.0) -> Outline:
    """Return a regular polygon about the origin."""
    angle = np.arange(count) * (2 * math.pi / count)
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle))), 0.0


def random_outline(random: np.random.Generator) -> Outline:
    """Return a disc, capsule, box, triangle, sliver or polygon of about 1 m near the origin; some are rounded."""
    radius = 0.0 if random.random() < 0.5 else random.uniform(0.01, 0.5)
    kind = random.integers(6)
    if kind == 0:
        return random.normal(0, 0.2, (1, 2)), max(radius, 0.05)
    if kind == 1:
        return random.normal(0, 0.7, (2, 2)), radius
    if kind == 2:
        corners = box(0, 0, *random.uniform(0.2, 2.0, 2))[0]
    elif kind == 3:  # a sliver, down to a thousandth of its length
        corners = box(0, 0, 2.0, 10 ** random.uniform(-3, -1))[0]
    else:
        cloud = random.normal(0, 0.7, (3 if kind == 4 else random.integers(4, 20), 2))
        corners = cloud[ConvexHull(cloud).vertices]
    return moved((corners, radius), 0.0, 0.0, random.uniform(0, 2 * math.pi))


def size_of(*outlines: Outline) -> float:
    """Return the extent of the larger, radius included, m."""
    return max(float(np.ptp(corners, axis=0).max()) + 2 * radius for corners, radius in outlines)


def random_pairs(seed: int, count: int) -> Iterator[tuple[Outline, Outline, float]]:
    """Yield pairs of outlines and their size; about half of the pairs overlap."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        p = random_outline(random)
        q = moved(random_outline(random), *random.normal(0.0, 1.0, 2))
        yield p, q, size_of(p, q)


def hull_of(outline: Outline) -> Any:
    """Return the convex hull of the corners as a shapely geometry."""
    return shapely.MultiPoint(outline[0]).convex_hull


def separation_of(p: Outline, q: Outline) -> float:
    """Return the separation, m: shapely's distance where the hulls are apart, else qhull's least penetration."""
    radii = p[1] + q[1]
    distance = float(shapely.distance(hull_of(p), hull_of(q)))
    if distance > 0.0 or len(p[0]) + len(q[0]) < 4:
        return distance - radii
    difference = (q[0][None, :, :] - p[0][:, None, :]).reshape(-1, 2)
    return float(ConvexHull(difference).equations[:, 2].max()) - radii
