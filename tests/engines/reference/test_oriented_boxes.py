"""Oriented boxes: that they hold their pieces, are exact for rectangles, and part no two that are near."""

import math

import numpy as np
import pytest
import shapely

from sandbox.engines.reference.polygon_contacts import are_separated, oriented_box
from tests.engines.reference.outlines import (
    any_outline,
    box,
    capsule,
    disc,
    laid_out,
    moved,
    ring,
    separation_of,
    size_of,
)


def boxed(outline):
    return oriented_box(*laid_out(outline), 0)


def rectangle(oriented):
    """Return an oriented box as shapely has it."""
    x, y, ax, ay, along, across = oriented
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return shapely.Polygon(
        [(x + s * along * ax - t * across * ay, y + s * along * ay + t * across * ax) for s, t in signs]
    )


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
def test_the_box_of_a_rectangle_is_the_rectangle(angle):
    x, y, ax, ay, along, across = boxed(box(3.0, -2.0, 4.0, 1.0, angle))
    assert (x, y) == pytest.approx((3.0, -2.0), abs=1e-15)  # an ulp or two
    assert abs(ax * math.cos(angle) + ay * math.sin(angle)) == pytest.approx(1.0, abs=1e-15)  # likewise
    assert (along, across) == pytest.approx((2.0, 0.5), abs=1e-15)  # likewise


def test_the_boxes_of_discs_and_capsules_are_as_wide_as_they():
    assert boxed(disc(1.0, 2.0, 0.5)) == (1.0, 2.0, 1.0, 0.0, 0.5, 0.5)
    assert boxed(capsule(0.0, 0.0, 0.0, 2.0, 0.25)) == (0.0, 1.0, 0.0, 1.0, 1.25, 0.25)


def test_a_box_holds_its_piece_and_touches_it_on_all_sides():
    random = np.random.default_rng(1)
    for _ in range(300):
        outline = any_outline(random)
        x, y, ax, ay, along, across = boxed(outline)
        place = (outline[0] - (x, y)) @ np.array([(ax, -ay), (ay, ax)])
        size = size_of(outline)
        assert place.max(axis=0) + outline[1] == pytest.approx((along, across), abs=1e-14 * size)  # rounding
        assert place.min(axis=0) - outline[1] == pytest.approx((-along, -across), abs=1e-14 * size)  # likewise


def test_boxes_are_apart_exactly_where_an_axis_parts_them():
    random = np.random.default_rng(2)
    told = [0, 0]
    for _ in range(1500):
        a, b = boxed(any_outline(random)), boxed(moved(any_outline(random), *random.normal(0, 1.5, 2)))
        distance = rectangle(a).distance(rectangle(b))
        apart = are_separated(a, b, 0.0)
        assert apart == are_separated(b, a, 0.0)
        assert apart == are_separated(np.array(a), np.array(b), 0.0)  # rows will do
        told[apart] += 1
        if abs(distance) > 1e-12 or rectangle(a).intersection(rectangle(b)).area > 1e-12:  # not just touching
            assert apart == (distance > 0.0)
    assert min(told) > 300


def test_no_pieces_nearer_than_the_margin_are_called_apart():
    random = np.random.default_rng(3)
    near = saved = 0
    for _ in range(1500):
        p, q = any_outline(random), moved(any_outline(random), *random.normal(0, 2, 2))
        margin = random.choice([0.0, 0.1, 1.0])
        separation, apart = separation_of(p, q), are_separated(boxed(p), boxed(q), margin)
        if separation <= margin:
            near += 1
            assert not apart
        saved += apart
    assert near > 400
    assert saved > 0.7 * (1500 - near)


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("angle", [0.0, 0.4, 1.1])
def test_boxes_that_touch_are_not_called_apart_far_from_the_origin(offset, angle):
    reach = 1.5 * math.cos(angle), 1.5 * math.sin(angle)
    p = box(offset, -offset, 1.0, 1.0, angle)
    q = box(offset + reach[0], -offset + reach[1], 2.0, 1.0, angle)
    assert not are_separated(boxed(p), boxed(q), 0.0)
    assert are_separated(boxed(p), boxed(moved(q, *(0.1 * each for each in reach))), 0.0)


def test_the_box_of_a_ring_is_a_square():
    *_, along, across = boxed(ring(1000))
    assert along == pytest.approx(1.0, abs=1e-5)  # (π / 1000)² / 2
    assert across == pytest.approx(1.0, abs=1e-5)  # likewise
