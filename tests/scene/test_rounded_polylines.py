"""Rounded polylines: tangent arcs, chords within the tolerance, offset lines and parts."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import LineString

from sandbox.scene.geometry.polyline import RoundingError, arc_at, beside, length_of, part_of, rounded

SMALL = 1e-12  # m: rounding of lengths of about 1 m, with a margin

angles = st.floats(-2.8, 2.8).filter(lambda turn: abs(turn) > 0.05)
radii = st.floats(0.005, 0.1)


def bent(turn: float, radius: float) -> list[tuple[float, ...]]:
    """Return a polyline along x with one rounded corner and edges long enough for its arc."""
    edge = radius * math.tan(abs(turn) / 2.0) + 0.1
    return [(-edge, 0.0), (0.0, 0.0, radius), (edge * math.cos(turn), edge * math.sin(turn))]


@given(angles, radii)
def test_arc_is_tangent_to_both_edges(turn: float, radius: float) -> None:
    arc = arc_at(bent(turn, radius), 1)
    assert arc.turn == pytest.approx(turn, abs=SMALL)
    (bx, by), (ex, ey), (cx, cy) = arc.at(0.0), arc.at(1.0), arc.centre
    assert by == pytest.approx(0.0, abs=SMALL)  # begins on the first edge
    assert bx == pytest.approx(-arc.tangent_length, abs=SMALL)
    direction = math.cos(turn), math.sin(turn)
    assert ex * direction[1] - ey * direction[0] == pytest.approx(0.0, abs=SMALL)  # ends on the second edge
    assert ex * direction[0] + ey * direction[1] == pytest.approx(arc.tangent_length, abs=SMALL)
    # the radius is perpendicular to each edge there
    assert bx - cx == pytest.approx(0.0, abs=SMALL)
    assert (ex - cx) * direction[0] + (ey - cy) * direction[1] == pytest.approx(0.0, abs=SMALL)


@given(angles, radii, st.floats(1e-5, 1e-3))
def test_arc_has_the_fewest_chords_within_the_tolerance(turn: float, radius: float, tolerance: float) -> None:
    corners = bent(turn, radius)
    arc = arc_at(corners, 1)
    points = rounded(corners, tolerance=tolerance)[1:-1]
    assert [math.dist(point, arc.centre) for point in points] == pytest.approx([radius] * len(points), abs=SMALL)
    sagitta = [radius - math.dist(((a[0] + b[0]) / 2, (a[1] + b[1]) / 2), arc.centre) for a, b in pairwise(points)]
    assert max(sagitta) <= tolerance * (1.0 + 1e-6) + SMALL
    pieces = len(points) - 1
    if pieces > 1:
        wider = abs(turn) / (pieces - 1)
        assert radius * (1.0 - math.cos(wider / 2.0)) > tolerance


@given(angles, radii)
def test_length_of_a_rounded_line_is_that_of_edges_and_arc(turn: float, radius: float) -> None:
    corners, tolerance = bent(turn, radius), 1e-6
    straight = sum(math.dist(a[:2], b[:2]) for a, b in pairwise(corners))
    exact = straight - 2.0 * radius * math.tan(abs(turn) / 2.0) + radius * abs(turn)
    # a chord is shorter than its arc by about 8/3 of its sagitta squared over its length, at most its sagitta
    assert length_of(rounded(corners, tolerance=tolerance)) == pytest.approx(exact, rel=1e-3)
    assert length_of(rounded(corners, tolerance=tolerance)) <= exact + SMALL


def test_rectangle_rounded_by_half_its_width_has_a_semicircular_arch() -> None:
    points = np.asarray(rounded([(0.0, 0.0), (0.0, 1.0, 0.25), (0.5, 1.0, 0.25), (0.5, 0.0)]))
    arch = points[points[:, 1] > 0.75 + SMALL]
    assert np.hypot(*(arch - (0.25, 0.75)).T) == pytest.approx(np.full(len(arch), 0.25), abs=SMALL)
    assert points[:, 1].max() == pytest.approx(1.0, abs=2e-5)  # the tolerance


def test_corners_without_a_radius_and_ends_are_not_rounded() -> None:
    assert rounded([(0.0, 0.0, 0.3), (1.0, 0.0), (1.0, 1.0, 0.3)]) == ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))


def test_closed_line_is_rounded_at_every_corner() -> None:
    points = rounded([(0.0, 0.0, 0.5), (1.0, 0.0, 0.5), (1.0, 1.0, 0.5), (0.0, 1.0, 0.5)], closed=True)
    assert [math.dist(point, (0.5, 0.5)) for point in points] == pytest.approx([0.5] * len(points), abs=SMALL)
    assert len(set(points)) == len(points)


@pytest.mark.parametrize(
    ("corners", "corner", "words"),
    [
        ([(0.0, 0.0), (0.1, 0.0, 0.2), (0.1, 1.0)], 1, "take 0.2 m of an edge that is 0.1 m long"),
        ([(0.0, 0.0), (1.0, 0.0, 0.6), (1.0, 1.0, 0.6), (0.0, 1.0)], 1, "take 1.2 m"),
        ([(0.0, 0.0), (1.0, 0.0, 0.1), (0.0, 0.0)], 1, "reversal"),
        ([(0.0, 0.0), (0.0, 0.0, 0.1), (1.0, 0.0)], 1, "is at the same place as the next corner"),
    ],
)
def test_impossible_rounding_raises_with_its_corner(corners: list[tuple[float, ...]], corner: int, words: str) -> None:
    with pytest.raises(RoundingError, match=words) as caught:
        rounded(corners)
    assert caught.value.corner == corner


@given(angles, st.floats(0.03, 0.1), st.floats(-0.02, 0.02))
def test_offset_line_keeps_its_distance(turn: float, radius: float, distance: float) -> None:
    assume(abs(distance) > 1e-4)
    line = rounded(bent(turn, radius))
    other = LineString(beside(line, distance))
    # mitred vertices lie outside the offset arc by no more than the chords lie inside it
    near = [other.distance(LineString([a, b]).centroid) for a, b in pairwise(line)]
    assert near == pytest.approx([abs(distance)] * len(near), abs=1e-4)
    assert beside(line, distance)[0][1] == pytest.approx(distance, abs=SMALL)  # positive is to the left


@given(st.floats(0.0, 0.4), st.floats(0.5, 1.0))
def test_part_of_a_line_has_the_length_between_its_ends(begin: float, end: float) -> None:
    line = rounded([(0.0, 0.0), (0.6, 0.0, 0.1), (0.6, 0.6)])
    part = part_of(line, begin, end)
    assert length_of(part) == pytest.approx(end - begin, abs=1e-9)  # the sum of some dozen lengths
    assert LineString(line).distance(LineString(part)) < SMALL
