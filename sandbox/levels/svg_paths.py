"""Path data of SVG as polylines: the curves are flattened; circles that are drawn as arcs are found."""

import math
import re
from typing import Any, NamedTuple

from sandbox.echo import short_repr
from sandbox.levels.outlines import arc_steps, bezier_points
from sandbox.scene.description.base import Point

_PATH_TEXT = re.compile(r"[\sMmZzLlHhVvCcSsQqTtAa0-9eE+\-.,]*", re.ASCII)
MAX_SUBPATHS = 2000
"""Subpaths of one path."""
MAX_CLOSING_WORK = 20_000_000
"""Characters of subpaths times their `z`; at each the parser searches for the start, in 30 ns a character."""
MAX_SUBPATH_POINTS = 100_000
"""Corners of one subpath."""
_SAME = 1e-6
"""Relative difference of radii and centres of the arcs of one circle; programs write 6 to 8 digits."""


class PathError(ValueError):
    """Path data that are not valid; `str()` is the reason."""


class Subpath(NamedTuple):
    """One connected part of a path, in its user units."""

    points: tuple[Point, ...]
    closed: bool
    circle: tuple[Point, float] | None = None
    """centre and radius, if it is a full circle drawn with arcs"""


def subpaths(text: str, tolerance: float) -> list[Subpath]:
    """Return the parts of a path that have a length.

    Args:
        text: the attribute `d`.
        tolerance: largest distance of a polyline from its curve, in user units.

    Raises:
        PathError: the text is not path data, or has coordinates that are not finite.
    """
    from svgelements import Path

    if not _PATH_TEXT.fullmatch(text):
        wrong = text[_PATH_TEXT.match(text).end() :]  # type: ignore[union-attr]  # it also matches the empty text
        raise PathError(f"the path has the unknown command or sign {short_repr(wrong[:1])}")
    if not text.strip():
        return []
    if text.lstrip()[0] not in "Mm":
        raise PathError("the path must begin with M or m")
    parts = re.split("[Mm]", text)
    if len(parts) > MAX_SUBPATHS or sum(len(each) * each.lower().count("z") for each in parts) > MAX_CLOSING_WORK:
        raise PathError("the path has too many parts; break it apart (in Inkscape: Path > Break Apart)")
    try:
        segments = list(Path(text))
    except (ValueError, TypeError, IndexError, AttributeError, ZeroDivisionError, OverflowError):
        raise PathError("the path has too few numbers, or a command without its numbers") from None
    pens: list[_Pen] = []
    for segment in segments:
        kind = type(segment).__name__
        if kind == "Move" or not pens or pens[-1].closed:
            start = segment.end if kind == "Move" else segment.start
            pens.append(_Pen([_point(start)]))
            if kind == "Move":
                continue
        pens[-1].draw(segment, kind, tolerance)
        if len(pens[-1].points) > MAX_SUBPATH_POINTS:
            raise PathError(f"the path has more than {MAX_SUBPATH_POINTS:,} corners")
    return [each.subpath() for each in pens if len(each.points) > 1]


class _Pen:
    """A subpath while it is drawn."""

    def __init__(self, points: list[Point]) -> None:
        self.points = points
        self.closed = False
        self._arcs: list[Any] | None = []
        """its arcs of circles; None once it has another segment of some length"""

    def draw(self, segment: Any, kind: str, tolerance: float) -> None:
        """Append a segment of svgelements."""
        end = _point(segment.end)
        match kind:
            case "Close":
                self.closed = True
            case "QuadraticBezier":
                controls = [self.points[-1], _point(segment.control), end]
                self.points += bezier_points(controls, tolerance)
            case "CubicBezier":
                controls = [self.points[-1], _point(segment.control1), _point(segment.control2), end]
                self.points += bezier_points(controls, tolerance)
            case "Arc" if segment.sweep:
                self.points += _arc_points(segment, tolerance)
        if kind == "Arc" and segment.sweep and self._arcs is not None:
            self._arcs.append(segment)
        elif math.dist(end, self.points[-1]) > 0.0 or kind in ("QuadraticBezier", "CubicBezier"):
            self._arcs = None
        if end != self.points[-1]:
            self.points.append(end)

    def subpath(self) -> Subpath:
        """Return what was drawn; a line that ends where it began is closed."""
        closed = self.closed or (len(self.points) > 3 and self.points[0] == self.points[-1])
        return Subpath(tuple(self.points), closed, self._circle())

    def _circle(self) -> tuple[Point, float] | None:
        if not self._arcs or abs(abs(sum(arc.sweep for arc in self._arcs)) - 2.0 * math.pi) > _SAME:
            return None
        centre, radius = _point(self._arcs[0].center), float(self._arcs[0].rx)
        slack = _SAME * radius
        if any(
            abs(arc.rx - radius) > slack
            or abs(arc.ry - radius) > slack
            or math.dist(_point(arc.center), centre) > slack
            for arc in self._arcs
        ):
            return None
        return centre, radius


def _arc_points(arc: Any, tolerance: float) -> list[Point]:
    """Return the corners of an arc after its start, the end included."""
    radii = float(arc.rx), float(arc.ry)
    if not all(map(math.isfinite, (*radii, arc.sweep))):
        raise PathError("the path has an arc that is too large")
    count = arc_steps(max(radii), arc.sweep, tolerance)
    cos, sin = math.cos(arc.get_rotation()), math.sin(arc.get_rotation())
    start, (cx, cy) = float(arc.get_start_t()), _point(arc.center)
    points = []
    for k in range(1, count):
        angle = start + arc.sweep * k / count
        x, y = radii[0] * math.cos(angle), radii[1] * math.sin(angle)
        points.append((cx + cos * x - sin * y, cy + sin * x + cos * y))
    return [*points, _point(arc.end)]


def _point(point: Any) -> Point:
    """Return a point of svgelements."""
    if point is None:
        raise PathError("the path must begin with M or m")
    x, y = float(point.x), float(point.y)
    if not (math.isfinite(x) and math.isfinite(y)):
        raise PathError("the path has a coordinate that is too large")
    return x, y
