"""Rasterisers of points, polygons and thin lines, compiled if numba is installed.

The array `scratch` is (V, 9). Columns 0 to 4 hold, for each corner, its x and y in px, then the unit normal and
the offset of the side that starts there. Columns 5 to 8 of the first row of a piece hold the inner and outer span of
the current row of pixels.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel, kernel
from sandbox.window.render.body_geometry import ConvexPieces

FULL = 256
"""Full coverage in fixed-point blending."""


@bare_kernel
def blend_packed(under: int, over: int, fraction: int) -> int:
    """Return `under` blended with `over` by fraction / `FULL`; all four bytes alike, two per multiplication."""
    rest = FULL - fraction
    even = ((under & 0xFF00FF) * rest + (over & 0xFF00FF) * fraction + 0x800080) >> 8 & 0xFF00FF
    odd = ((under >> 8 & 0xFF00FF) * rest + (over >> 8 & 0xFF00FF) * fraction + 0x800080) & 0xFF00FF00
    return even | odd


@kernel
def rasterise_points(
    pixels: npt.NDArray[np.uint32],
    stride: int,
    area: tuple[int, int, int, int],
    position: FloatArray,
    colours: npt.NDArray[np.uint32],
    present: BoolArray,
    centre: tuple[float, float],
    scale: float,
    middle: tuple[float, float],
    side: int,
) -> None:
    """Draw particles as squares.

    Args:
        pixels: pixels of the surface, flat.
        stride: length of a row, px.
        area: left, top, right and bottom of the clip rectangle, px.
        position: (N, 2) m.
        colours: (N,) in the pixel format of the surface.
        present: (N,) whether a particle is drawn.
        centre: centre of the camera, m.
        scale: scale of the camera, px/m.
        middle: centre of the surface, px.
        side: side of a square, px.
    """
    left, top, right, bottom = area
    half_side = side // 2
    for i in range(len(position)):
        if not present[i]:
            continue
        # Same order of operations as Camera.to_screen, so that both give the same pixel.
        x = (position[i, 0] - centre[0]) * scale + middle[0]
        y = (position[i, 1] - centre[1]) * -scale + middle[1]
        # For values from 0, int() rounds down. Comparisons with nan are false.
        if (
            x >= left + half_side
            and x < right - side + half_side + 1
            and y >= top + half_side
            and y < bottom - side + half_side + 1
        ):
            corner = (int(y) - half_side) * stride + int(x) - half_side
            for row in range(side):
                for column in range(side):
                    pixels[corner + row * stride + column] = colours[i]
        elif side > 1 and x > left - side and x < right + side and y > top - side and y < bottom + side:
            first, top_row = int(np.floor(x)) - half_side, int(np.floor(y)) - half_side
            for row in range(max(top_row, top), min(top_row + side, bottom)):
                for column in range(max(first, left), min(first + side, right)):
                    pixels[row * stride + column] = colours[i]


@kernel
def rasterise_faded_points(
    tones: npt.NDArray[np.uint32],
    shades: npt.NDArray[np.uint32],
    time: float,
    born: FloatArray,
    rate: FloatArray,
    first: IntArray,
    steps: int,
) -> None:
    """Set the colours of particles by their ages.

    Args:
        tones: (F,) in the pixel format of the surface, changed in place.
        shades: (S,) all shades.
        time: s.
        born: (F,) s.
        rate: (F,) shades per second.
        first: (F,) index of the first shade of each particle.
        steps: number of shades of each particle.
    """
    for i in range(len(tones)):
        age = (time - born[i]) * rate[i]
        tones[i] = shades[first[i] + int(min(max(age, 0.0), steps - 1.0))]


@bare_kernel
def span(
    y: float, scratch: FloatArray, first: int, last: int, offset: float, left: float, right: float
) -> tuple[float, float]:
    """Return the x range of a row of pixels that is at most `offset` outside all sides of a polygon."""
    from_x, to_x = left, right
    for k in range(first, last):
        across, bound = scratch[k, 2], offset - (scratch[k, 3] * y + scratch[k, 4])
        if across > 1e-9:
            to_x = min(to_x, bound / across)
        elif across < -1e-9:
            from_x = max(from_x, bound / across)
        elif bound < 0.0:
            to_x = left - 1.0
    return from_x, to_x


@bare_kernel
def inner_span(
    y: float, scratch: FloatArray, first: int, last: int, radius: float, left: float, right: float
) -> tuple[float, float]:
    """Return an x range of a row that is inside a piece (conservative bound); `radius` may be negative."""
    if last - first > 2:
        return span(y, scratch, first, last, min(radius, 0.0), left, right)
    if radius <= 0.0:
        return left, left - 1.0
    if last - first == 1:
        half2 = radius * radius - (y - scratch[first, 1]) ** 2
        half = math.sqrt(max(half2, 0.0))
        return max(left, scratch[first, 0] - half), min(right, scratch[first, 0] + half) if half2 > 0.0 else left - 1.0
    from_x, to_x = span(y, scratch, first, last, radius, left, right)
    for k in range(first, last):  # limited by the ends of the segment
        other_end = 2 * first + 1 - k
        dx, dy = scratch[other_end, 0] - scratch[k, 0], scratch[other_end, 1] - scratch[k, 1]
        bound = dy * (scratch[k, 1] - y)
        if dx > 1e-9:
            from_x = max(from_x, scratch[k, 0] + bound / dx)
        elif dx < -1e-9:
            to_x = min(to_x, scratch[k, 0] + bound / dx)
        elif bound > 0.0:
            to_x = left - 1.0
    return from_x, to_x


@bare_kernel
def outer_span(
    y: float, scratch: FloatArray, first: int, last: int, radius: float, left: float, right: float
) -> tuple[float, float]:
    """Return the x range of a row outside which no pixel lies inside the piece (conservative bound)."""
    low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
    for k in range(first, last):
        low_x, high_x = min(low_x, scratch[k, 0]), max(high_x, scratch[k, 0])
        low_y, high_y = min(low_y, scratch[k, 1]), max(high_y, scratch[k, 1])
    if y < low_y - radius or y > high_y + radius:
        return left, left - 1.0
    from_x, to_x = max(left, low_x - radius), min(right, high_x + radius)
    if last - first == 1:
        return from_x, to_x
    return span(y, scratch, first, last, radius, from_x, to_x)


class PolygonPose(NamedTuple):
    """Pose of a body on the screen."""

    x: float
    """px"""
    y: float
    cos: float
    """cosine of the angle, in world orientation (y up)"""
    sin: float
    scale: float
    """px/m"""


@bare_kernel
def _side_distance2(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the squared distance from a segment."""
    dx, dy, px, py = bx - ax, by - ay, x - ax, y - ay
    fraction = min(max((px * dx + py * dy) / max(dx * dx + dy * dy, 1e-300), 0.0), 1.0)
    px, py = px - fraction * dx, py - fraction * dy
    return px * px + py * py


@bare_kernel
def _piece_distance(x: float, y: float, scratch: FloatArray, first: int, last: int, radius: float) -> float:
    """Return the signed distance from a piece placed by `_place_corners`; beyond ½ px, a lower bound."""
    if last - first > 2:
        largest, side = -np.inf, first
        for k in range(first, last):
            distance = scratch[k, 2] * x + scratch[k, 3] * y + scratch[k, 4]
            if distance > largest:
                largest, side = distance, k
        if largest <= 0.0 or largest - radius >= 0.5:
            return largest - radius
        after = first if side + 1 == last else side + 1
        nx, ny = scratch[side, 2], scratch[side, 3]
        before_end = (scratch[side, 1] - y) * nx - (scratch[side, 0] - x) * ny
        after_end = (scratch[after, 1] - y) * nx - (scratch[after, 0] - x) * ny
        if before_end * after_end <= 0.0:  # the foot of the perpendicular lies on the side
            return largest - radius
    best = np.inf
    for k in range(first, last if last - first > 2 else first + 1):
        after = first if k + 1 == last else k + 1
        best = min(best, _side_distance2(x, y, scratch[k, 0], scratch[k, 1], scratch[after, 0], scratch[after, 1]))
    return math.sqrt(best) - radius


@bare_kernel
def _body_distance(
    x: float, y: float, body: int, pieces: ConvexPieces, scratch: FloatArray, scale: float, inner_limit: float
) -> float:
    """Return the minimum signed distance from the pieces of a body, px; clamped below at `inner_limit`."""
    distance = np.inf
    for piece in range(pieces.piece[body], pieces.piece[body + 1]):
        first, last = pieces.first[piece], pieces.first[piece + 1]
        if x < scratch[first, 7] or x > scratch[first, 8]:
            continue
        distance = min(distance, _piece_distance(x, y, scratch, first, last, pieces.radius[piece] * scale))
        if distance <= inner_limit:
            return inner_limit
    return distance


@bare_kernel
def _place_corners(
    pieces: ConvexPieces, body: int, pose: PolygonPose, scratch: FloatArray
) -> tuple[float, float, float, float]:
    """Transform the corners of a body to the screen and compute the outward normal and the offset of each side.

    Returns:
        Left, top, right and bottom of the bounding box of the body with a margin of 1, px.
    """
    left, top, right, bottom = np.inf, np.inf, -np.inf, -np.inf
    for piece in range(pieces.piece[body], pieces.piece[body + 1]):
        margin = pieces.radius[piece] * pose.scale + 1.0
        first, last = pieces.first[piece], pieces.first[piece + 1]
        for k in range(first, last):
            x, y = pieces.corner[k, 0], pieces.corner[k, 1]
            px = pose.x + (pose.cos * x - pose.sin * y) * pose.scale
            py = pose.y - (pose.sin * x + pose.cos * y) * pose.scale
            scratch[k, 0], scratch[k, 1] = px, py
            left, right = min(left, px - margin), max(right, px + margin)
            top, bottom = min(top, py - margin), max(bottom, py + margin)
        for k in range(first, last):
            next_corner = first if k + 1 == last else k + 1
            nx, ny = scratch[k, 1] - scratch[next_corner, 1], scratch[next_corner, 0] - scratch[k, 0]
            length = max(math.sqrt(nx * nx + ny * ny), 1e-300)
            scratch[k, 2], scratch[k, 3] = nx / length, ny / length
            scratch[k, 4] = -(nx * scratch[k, 0] + ny * scratch[k, 1]) / length
    return left, top, right, bottom


@bare_kernel
def _shaded(pixel: int, distance: float, inner_limit: float, fill: int, rim: int, hollow: bool, antialias: bool) -> int:
    """Return a pixel blended with the body, whose edge is at a signed distance, px."""
    cover, shade = min(max(0.5 - distance, 0.0), 1.0), min(max(distance - inner_limit, 0.0), 1.0)
    if not antialias:
        cover, shade = math.floor(cover + 0.5), math.floor(shade + 0.5)
    if hollow:
        cover, shade = cover * shade, 1.0
    tone = blend_packed(fill, rim, int(shade * FULL + 0.5)) if shade < 1.0 else rim
    coverage = int(cover * FULL + 0.5)
    return tone if coverage == FULL else blend_packed(pixel, tone, coverage)


@bare_kernel
def _polygon_row(
    pixels: npt.NDArray[np.uint32],
    start: int,
    y: float,
    scratch: FloatArray,
    corners: tuple[int, int],
    ends: tuple[float, float],
    inner_limit: float,
    fill: int,
    rim: int,
    hollow: bool,
    antialias: bool,
) -> None:
    """Draw a row of a body that is a single polygon: the common case, with no search over the pieces for each pixel."""
    first, last = corners
    from_x, to_x = span(y, scratch, first, last, 0.5, ends[0], ends[1])
    from_in, to_in = span(y, scratch, first, last, inner_limit, ends[0], ends[1])
    column, stop = int(from_x), math.ceil(to_x)
    inner, outer = stop, stop
    if from_in <= to_in:
        inner, outer = max(math.ceil(from_in - 0.5), column), min(math.floor(to_in - 0.5) + 1, stop)
    while column < stop:
        if column == inner and inner < outer:
            if not hollow:
                pixels[start + inner : start + outer] = fill
            column = outer
            continue
        distance = _piece_distance(column + 0.5, y, scratch, first, last, 0.0)
        if distance < 0.5:
            pixels[start + column] = _shaded(
                int(pixels[start + column]), distance, inner_limit, fill, rim, hollow, antialias
            )
        column += 1


@bare_kernel
def rasterise_polygons(
    pixels: npt.NDArray[np.uint32],
    stride: int,
    area: tuple[int, int, int, int],
    pieces: ConvexPieces,
    scratch: FloatArray,
    indices: IntArray,
    pose: FloatArray,
    line: FloatArray,
    fill: npt.NDArray[np.uint32],
    rim: npt.NDArray[np.uint32],
    hollow: bool,
    antialias: bool,
) -> None:
    """Draw bodies in order.

    Args:
        pixels: of the surface, flat.
        stride: of a row, px.
        area: left, top, right and bottom of the clip rectangle, px.
        pieces: of all bodies.
        scratch: (V, 9) scratch array.
        indices: (K,) indices of the bodies that are drawn.
        pose: (K, 5) as in `PolygonPose`.
        line: (K,) rim widths, px.
        fill: (K,) colours in the pixel format of the surface.
        rim: (K,) colours of the rims.
        hollow: whether only the rims are drawn.
        antialias: whether edges are smooth.
    """
    for k in range(len(indices)):
        body, body_pose = indices[k], PolygonPose(pose[k, 0], pose[k, 1], pose[k, 2], pose[k, 3], pose[k, 4])
        begin, end = pieces.piece[body], pieces.piece[body + 1]
        low, high = pieces.first[begin], pieces.first[end]
        left, top, right, bottom = _place_corners(pieces, body, body_pose, scratch)
        left, top = max(left, float(area[0])), max(top, float(area[1]))
        right, bottom = min(right, float(area[2])), min(bottom, float(area[3]))
        if not (left < right and top < bottom):
            continue
        polygon = pieces.radius[begin] == 0.0 and end - begin == 1 and high - low > 2
        radius = pieces.radius[begin] * body_pose.scale
        inner_limit = -(line[k] + 0.5)
        inner, outer = int(fill[k]), int(rim[k])
        for row in range(int(top), math.ceil(bottom)):
            y, start = row + 0.5, row * stride
            if polygon:
                _polygon_row(
                    pixels, start, y, scratch, (low, high), (left, right), inner_limit, inner, outer, hollow, antialias
                )
                continue
            for piece in range(begin, end):
                first, last = pieces.first[piece], pieces.first[piece + 1]
                piece_radius = pieces.radius[piece] * body_pose.scale
                scratch[first, 5], scratch[first, 6] = inner_span(
                    y, scratch, first, last, piece_radius + inner_limit, left, right
                )
                scratch[first, 7], scratch[first, 8] = outer_span(
                    y, scratch, first, last, piece_radius + 0.5, left, right
                )
            column, stop = int(left), math.ceil(right)
            while column < stop:
                x, filled, empty = column + 0.5, column, stop
                for piece in range(begin, end):
                    first = pieces.first[piece]
                    if scratch[first, 5] <= x <= scratch[first, 6]:
                        filled = max(filled, min(int(scratch[first, 6] - 0.5) + 1, stop))
                    if x <= scratch[first, 8]:
                        empty = min(empty, int(max(scratch[first, 7] - 0.5, float(column))))
                if empty > column:  # no piece covers this column
                    column = empty
                    continue
                if filled > column:
                    if not hollow:
                        pixels[start + column : start + filled] = inner
                    column = filled
                    continue
                if end - begin == 1:  # passing all arrays costs more than the rest
                    distance = _piece_distance(x, y, scratch, low, high, radius)
                else:
                    distance = _body_distance(x, y, body, pieces, scratch, body_pose.scale, inner_limit)
                pixel = int(pixels[start + column])
                pixels[start + column] = _shaded(pixel, distance, inner_limit, inner, outer, hollow, antialias)
                column += 1


@bare_kernel
def rasterise_lines(
    pixels: npt.NDArray[np.uint32],
    stride: int,
    area: tuple[int, int, int, int],
    ends: FloatArray,
    tones: npt.NDArray[np.uint32],
) -> None:
    """Draw lines of 1 px in order by the method of Wu, 1991: each step along a line is shared by two pixels.

    Args:
        pixels: of the surface, flat.
        stride: of a row, px.
        area: left, top, right and bottom of the clip rectangle, px.
        ends: (K, 4) px, x and y of both ends, clipped to an area not much larger than the surface.
        tones: (K,) in the pixel format of the surface.
    """
    left, top, right, bottom = area
    for k in range(len(ends)):
        ax, ay, bx, by = ends[k, 0] - 0.5, ends[k, 1] - 0.5, ends[k, 2] - 0.5, ends[k, 3] - 0.5
        steep = abs(by - ay) > abs(bx - ax)
        if steep:
            ax, ay, bx, by = ay, ax, by, bx
        if ax > bx:
            ax, ay, bx, by = bx, by, ax, ay
        slope = (by - ay) / (bx - ax) if bx > ax else 0.0
        first, last = math.floor(ax + 0.5), math.floor(bx + 0.5)
        along_low, along_high = (top, bottom) if steep else (left, right)
        across_low, across_high = (left, right) if steep else (top, bottom)
        tone = int(tones[k])
        for along in range(max(first, along_low), min(last + 1, along_high)):
            fraction = min(along + 0.5, bx) - max(along - 0.5, ax) if last > first else max(bx - ax, 0.5)
            across = ay + slope * (along - ax)
            row = math.floor(across)
            upper_fraction = across - row
            for side in range(2):
                cover = fraction * (upper_fraction if side else 1.0 - upper_fraction)
                if across_low <= row + side < across_high:
                    index = along * stride + row + side if steep else (row + side) * stride + along
                    pixels[index] = blend_packed(int(pixels[index]), tone, int(cover * FULL + 0.5))
