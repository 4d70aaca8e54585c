"""Outlines of cushions, from the walls, jaws and facings of tables."""

import math

import pytest

from sandbox.games.billiards.tables import TABLES
from sandbox.games.billiards.view.table import (
    DEPTH,
    cushion_outlines,
    other_walls,
)
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.window.view_bounds import area_bounds, shorter_side


def table(name: str) -> Scene:
    ball = "white" if name.startswith("carom") else "cue"
    return loads(f'title = "t"\n[billiards]\ntable = "{name}"\n[billiards.place]\n{ball} = [0.5, 0.5]\n')


@pytest.mark.parametrize("name", TABLES)
def test_every_cushion_is_found_between_playing_area_and_rail(name: str) -> None:
    scene = table(name)
    area = scene.play.area
    assert area is not None
    found = cushion_outlines(scene, area)
    assert len(found) == (4 if name.startswith("carom") else 6)
    (left, bottom), (right, top) = area
    depth = DEPTH * shorter_side(area)
    for each in found:
        for x, y in each.outline:
            # A facing may end behind the edge of the rail, at its pocket.
            out = max(left - x, x - right, bottom - y, y - top)
            assert -1e-9 < out < max(depth, 0.1)
    assert area_bounds(area)[0][0] < left - depth


def test_cushion_noses_are_tangent_to_the_jaws() -> None:
    scene = table("pool-9ft")
    assert scene.play.area is not None
    jaws = [(post.position, post.radius) for post in scene.posts]
    for each in cushion_outlines(scene, scene.play.area):
        on_jaws = [
            point
            for point in each.nose
            if any(abs(math.dist(point, centre) - radius) < 1e-9 for centre, radius in jaws)  # rounding
        ]
        assert len(on_jaws) >= 8
        assert len(each.nose) - len(on_jaws) == 2  # the far ends of the facings


def test_cushions_without_jaws_share_their_corners() -> None:
    scene = table("carom-10ft")
    assert scene.play.area is not None
    corners = {point for each in cushion_outlines(scene, scene.play.area) for point in each.outline[2:]}
    assert len({(round(x, 9), round(y, 9)) for x, y in corners}) == 4


def test_other_walls_are_not_cushions() -> None:
    scene = loads(
        """
title = "t"
[billiards]
table = "carom-10ft"
[billiards.place]
white = [0.5, 0.5]
[[wall]]
points = [[0.2, 0.2], [0.2, 0.6]]
height = 0.037
"""
    )
    assert scene.play.area is not None
    assert len(cushion_outlines(scene, scene.play.area)) == 4
    assert other_walls(scene, scene.play.area) == ((scene.walls[0],), ())


@pytest.mark.parametrize("name", TABLES)
def test_tables_have_no_other_walls(name: str) -> None:
    scene = table(name)
    assert scene.play.area is not None
    assert other_walls(scene, scene.play.area) == ((), ())
