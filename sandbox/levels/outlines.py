"""Shapes of a level: lines, circles, rectangles and polygons under affine transforms; curves as polygons.

Transforms map coordinates of a drawing, y down, to metres, y up. Curves become polygons with corners on the curve. The
sides are at most a tolerance away from it.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from sandbox.scene.description.base import Point
from sandbox.scene.geometry.polygon import min_corner_distance, signed_area

SIMILARITY = 1e-6
"""Largest relative difference of the scale factors of a transform that still counts as one factor; programs write
matrices with 6 to 8 digits."""
MAX_CURVE_CORNERS = 1000
"""Corners of one curve segment, whatever its tolerance."""


class Affine(NamedTuple):
    """Affine map (x, y) → (a·x + c·y + e, b·x + d·y + f), the order of SVG's `matrix(a b c d e f)`."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    def apply(self, x: float, y: float) -> Point:
        """Return the image of a point."""
        return self.a * x + self.c * y + self.e, self.b * x + self.d * y + self.f

    def after(self, inner: "Affine") -> "Affine":
        """Return the map that applies `inner` first, then this one."""
        e, f = self.apply(inner.e, inner.f)
        return Affine(
            self.a * inner.a + self.c * inner.b,
            self.b * inner.a + self.d * inner.b,
            self.a * inner.c + self.c * inner.d,
            self.b * inner.c + self.d * inner.d,
            e,
            f,
        )

    @property
    def is_finite(self) -> bool:
        """Whether all six numbers are finite."""
        return all(map(math.isfinite, self))

    @property
    def scale_factors(self) -> tuple[float, float]:
        """Largest and smallest factor by which it scales lengths: its singular values."""
        half_sum = 0.5 * math.hypot(self.a + self.d, self.b - self.c)
        half_difference = 0.5 * math.hypot(self.a - self.d, self.b + self.c)
        return half_sum + half_difference, abs(half_sum - half_difference)

    @property
    def is_similarity(self) -> bool:
        """Whether it scales all lengths by one factor; it may reflect."""
        largest, smallest = self.scale_factors
        return largest - smallest <= SIMILARITY * largest

    @property
    def keeps_right_angles(self) -> bool:
        """Whether the images of the x and y directions are perpendicular, so that rectangles stay rectangles."""
        product = self.a * self.c + self.b * self.d
        return abs(product) <= SIMILARITY * math.hypot(self.a, self.b) * math.hypot(self.c, self.d)

    @property
    def mean_scale(self) -> float:
        """Factor of the square root of areas."""
        return math.sqrt(abs(self.a * self.d - self.b * self.c))


def translation(x: float, y: float) -> Affine:
    """Return the map (x', y') → (x' + x, y' + y)."""
    return Affine(e=x, f=y)


def rotation(angle: float) -> Affine:
    """Return a rotation about the origin, rad, from +x towards +y; exact for multiples of a right angle."""
    quarter = angle / (0.5 * math.pi)
    if quarter == round(quarter):
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
    else:
        cos, sin = math.cos(angle), math.sin(angle)
    return Affine(cos, sin, -sin, cos)


class CircleShape(NamedTuple):
    """A solid circle."""

    centre: Point
    """m"""
    radius: float
    """m"""


class RectangleShape(NamedTuple):
    """A solid rectangle, which may have round corners."""

    centre: Point
    """m"""
    size: tuple[float, float]
    """width and height before rotation, without the radius, m"""
    angle: float
    """rad, counter-clockwise, between −π/2 and π/2"""
    radius: float = 0.0
    """radius by which it is widened on all sides, which rounds its corners, m"""


class PolygonShape(NamedTuple):
    """A solid polygon."""

    points: tuple[Point, ...]
    """corners, m"""


class LineShape(NamedTuple):
    """A polyline."""

    points: tuple[Point, ...]
    """corners, m"""
    thickness: float
    """full thickness, m"""
    closed: bool = False


LevelShape = CircleShape | RectangleShape | PolygonShape | LineShape


def arc_steps(radius: float, sweep: float, tolerance: float) -> int:
    """Return the number of chords of an arc whose distance from it is at most a tolerance.

    A chord over the angle δ is r (1 − cos(δ/2)) away from its arc.

    Args:
        radius: larger radius of the ellipse.
        sweep: angle, rad.
        tolerance: in the unit of the radius.
    """
    if radius <= tolerance:
        step = 0.5 * math.pi
    else:
        # 1 − cos(δ/2) = 2 sin²(δ/4); acos would lose the digits of small tolerances
        step = min(4.0 * math.asin(math.sqrt(0.5 * tolerance / radius)), 0.5 * math.pi)
    return min(max(math.ceil(abs(sweep) / step - 1e-9), 1), MAX_CURVE_CORNERS)  # 1e-9: rounding of a whole number


def bezier_steps(controls: Sequence[Point], tolerance: float) -> int:
    """Return the number of chords of a Bézier curve whose distance from it is at most a tolerance.

    Wang's formula: n² = d (d − 1) / 8 · max |second difference of the control points| / tolerance.
    Source: Wang, The subdivision method for finding the intersection between two Bézier curves or surfaces (1984).
    """
    degree = len(controls) - 1
    bend = max(
        (
            math.hypot(a[0] - 2.0 * b[0] + c[0], a[1] - 2.0 * b[1] + c[1])
            for a, b, c in zip(controls, controls[1:], controls[2:], strict=False)
        ),
        default=0.0,
    )
    count = math.sqrt(degree * (degree - 1) / 8.0 * bend / tolerance)
    return min(max(math.ceil(count), 1), MAX_CURVE_CORNERS)


def bezier_points(controls: Sequence[Point], tolerance: float) -> list[Point]:
    """Return the corners of a Bézier curve after its start, the end included."""
    n = bezier_steps(controls, tolerance)
    return [_bezier_point(controls, k / n) for k in range(1, n)] + [controls[-1]]


def _bezier_point(controls: Sequence[Point], t: float) -> Point:
    """Return a point of the curve by de Casteljau's algorithm."""
    points = list(controls)
    while len(points) > 1:
        points = [((1.0 - t) * a[0] + t * b[0], (1.0 - t) * a[1] + t * b[1]) for a, b in pairwise(points)]
    return points[0]


def _ellipse_corners(radius: float, tolerance: float) -> int:
    """Return the number of corners for an ellipse: a multiple of four, so that it stays symmetric and as wide."""
    return 4 * max(arc_steps(radius, 0.5 * math.pi, tolerance), 2)


def ellipse_shape(
    centre: Point, radii: tuple[float, float], transform: Affine, tolerance: float
) -> CircleShape | PolygonShape:
    """Return the image of an ellipse with axes along x and y: a circle if it is one, else a polygon.

    Args:
        centre: in the drawing.
        radii: along x and y, in the drawing.
        transform: from the drawing to metres.
        tolerance: m.
    """
    rx, ry = radii
    unit = transform.after(Affine(rx, 0.0, 0.0, ry, *centre))  # maps the unit circle to the ellipse
    if unit.is_similarity:
        return CircleShape((unit.e, unit.f), math.sqrt(math.prod(unit.scale_factors)))
    count = _ellipse_corners(unit.scale_factors[0], tolerance)
    angles = (2.0 * math.pi * k / count for k in range(count))
    return PolygonShape(tuple(unit.apply(math.cos(each), math.sin(each)) for each in angles))


def rectangle_shape(
    corner: Point,
    size: tuple[float, float],
    transform: Affine,
    tolerance: float = 0.0,
    radii: tuple[float, float] = (0.0, 0.0),
) -> RectangleShape | PolygonShape:
    """Return the image of a rectangle with sides along x and y: a polygon if it is sheared or its corners are elliptic.

    Rectangles whose round corners leave no straight side become polygons too, because a box has a width and a height.

    Args:
        corner: the corner with the smallest coordinates, in the drawing.
        size: width and height, in the drawing.
        transform: from the drawing to metres.
        tolerance: of rounded corners, m.
        radii: of rounded corners, in the drawing; at most half of the size.
    """
    (x, y), (width, height), (rx, ry) = corner, size, radii
    is_rounded = rx > 0.0 and ry > 0.0
    is_circular = (
        transform.is_similarity and abs(rx - ry) <= SIMILARITY * rx and 2.0 * rx < min(size) * (1 - SIMILARITY)
    )
    if transform.keeps_right_angles and (is_circular or not is_rounded):
        angle = math.atan2(transform.b, transform.a)
        if angle > 0.5 * math.pi:
            angle -= math.pi
        elif angle <= -0.5 * math.pi:
            angle += math.pi
        radius = rx if is_rounded else 0.0
        across, up = math.hypot(transform.a, transform.b), math.hypot(transform.c, transform.d)
        image = (width - 2.0 * radius) * across, (height - 2.0 * radius) * up
        return RectangleShape(
            transform.apply(x + 0.5 * width, y + 0.5 * height), image, angle, radius * transform.mean_scale
        )
    if not is_rounded:
        corners = ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
        return PolygonShape(tuple(transform.apply(*each) for each in corners))
    return PolygonShape(_rounded_corners(corner, size, (rx, ry), transform, tolerance))


def _rounded_corners(
    corner: Point, size: tuple[float, float], radii: tuple[float, float], transform: Affine, tolerance: float
) -> tuple[Point, ...]:
    """Return the corners of the image of a rounded rectangle; the arguments are those of `rectangle_shape`."""
    (x, y), (width, height), (rx, ry) = corner, size, radii
    count = arc_steps(max(rx, ry) * transform.scale_factors[0], 0.5 * math.pi, tolerance)
    centres = (
        (x + width - rx, y + height - ry),
        (x + rx, y + height - ry),
        (x + rx, y + ry),
        (x + width - rx, y + ry),
    )
    points = []
    for quarter, (cx, cy) in enumerate(centres):
        for k in range(count + 1):
            angle = 0.5 * math.pi * (quarter + k / count)
            points.append(transform.apply(cx + rx * math.cos(angle), cy + ry * math.sin(angle)))
    return tuple(points)


def outline_of(shape: LevelShape, tolerance: float) -> tuple[Point, ...]:
    """Return the corners of a shape; those of circles and round corners are within a tolerance, m."""
    match shape:
        case CircleShape(centre, radius):
            count = _ellipse_corners(radius, tolerance)
            unit = Affine(radius, 0.0, 0.0, radius, *centre)
            angles = (2.0 * math.pi * k / count for k in range(count))
            return tuple(unit.apply(math.cos(each), math.sin(each)) for each in angles)
        case RectangleShape((x, y), (width, height), angle, radius):
            frame = translation(x, y).after(rotation(angle))
            if radius > 0.0:
                corner = -0.5 * width - radius, -0.5 * height - radius
                outer = width + 2.0 * radius, height + 2.0 * radius
                return _rounded_corners(corner, outer, (radius, radius), frame, tolerance)
            signs = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
            return tuple(frame.apply(i * width, j * height) for i, j in signs)
        case PolygonShape(points) | LineShape(points):
            return points
    raise AssertionError(shape)


def without_repeats(points: Sequence[Point], closed: bool) -> tuple[Point, ...]:
    """Return points without those that coincide with the one before, by the rule of scenes for corners."""
    if len(points) < 2:
        return tuple(points)
    shortest = min_corner_distance(points)
    kept = [points[0]]
    for point in points[1:]:
        if math.dist(point, kept[-1]) >= shortest:
            kept.append(point)
    while closed and len(kept) > 1 and math.dist(kept[0], kept[-1]) < shortest:
        kept.pop()
    return tuple(kept)


def is_straight(points: Sequence[Point]) -> bool:
    """Return whether points lie on one line, within a millionth of their extent."""
    ax, ay = points[0]
    bx, by = max(points, key=lambda point: math.dist(point, points[0]))
    length = math.hypot(bx - ax, by - ay)
    return all(abs((bx - ax) * (y - ay) - (by - ay) * (x - ax)) <= 1e-6 * length * length for x, y in points)


def centroid(points: Sequence[Point]) -> Point:
    """Return the centre of the area of a polygon, or of its corners if it has no area, m."""
    ox, oy = points[0]
    area, mx, my = signed_area(points), 0.0, 0.0
    for (ax, ay), (bx, by) in zip(points, [*points[1:], points[0]], strict=True):
        cross = (ax - ox) * (by - oy) - (bx - ox) * (ay - oy)
        mx += cross * (ax + bx - 2.0 * ox)
        my += cross * (ay + by - 2.0 * oy)
    if area == 0.0:
        return sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)
    return ox + mx / (6.0 * area), oy + my / (6.0 * area)


def contains_point(outline: Sequence[Point], point: Point) -> bool:
    """Return whether a point lies inside a polygon, by the even-odd rule."""
    x, y = point
    inside = False
    for (ax, ay), (bx, by) in zip(outline, [*outline[1:], outline[0]], strict=True):
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            inside = not inside
    return inside
