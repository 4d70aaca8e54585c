"""Billiard tables: noses, facings, jaws and pockets, compared with shapely geometry."""

import math
from functools import cache
from typing import get_args

import numpy as np
import pytest
import shapely
from shapely import LineString, Point, Polygon, box, unary_union

from sandbox.games.billiards.tables import BCA_CORNER, BCA_SIDE, INCH, TABLES, WPA_CORNER, WPA_SIDE, TableName
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

NAMES = get_args(TableName)
POCKETED = [name for name in NAMES if name != "carom-10ft"]
ROUND = 64
"""Segments of a quarter circle: shapely's discs are too small by 1 − cos(π/256), 8e-5 of the radius."""
FINE = 1e-5  # m: above the error of the polygons of discs of 0.1 m


@cache
def table(name: str) -> Scene:
    return from_document({"billiards": {"table": name, "place": {"cue": [0.5, 0.5]} if name != "carom-10ft" else {}}})


def radius_of(name: str) -> float:
    return {"pool": 0.028575, "snooker": 0.02625, "carom": 0.03075}[TABLES[name].balls]  # type: ignore[index]


def disc(centre: tuple[float, float], radius: float) -> Polygon:
    return Point(centre).buffer(radius, quad_segs=ROUND)


@cache
def cushions(name: str) -> list[Polygon]:
    scene = table(name)
    return [LineString(wall.points) for wall in scene.walls] + [
        disc(post.position, post.radius) for post in scene.posts
    ]


@cache
def pocket_area(name: str) -> Polygon:
    return unary_union([disc(pocket.position, pocket.radius) for pocket in table(name).pockets])


@cache
def reachable(name: str) -> Polygon:
    """Return the region that the centre of a ball can reach from the middle of the table before it is potted."""
    area = TABLES[name]  # type: ignore[index]
    near = box(-1.0, -1.0, area.width + 1.0, area.length + 1.0)
    obstacles = unary_union([each.buffer(radius_of(name) - FINE, quad_segs=ROUND) for each in cushions(name)])
    free = near.difference(unary_union([obstacles, pocket_area(name)]))
    parts = getattr(free, "geoms", [free])
    (part,) = [part for part in parts if part.contains(Point(area.width / 2.0, area.length / 2.0))]
    return part


@pytest.mark.parametrize("name", NAMES)
def test_balls_leave_a_table_only_into_a_pocket(name: str) -> None:
    area, centre = TABLES[name], reachable(name)  # type: ignore[index]
    # The centre is on the cloth, a radius from the noses, or between the facings of a pocket, up to its middle.
    assert box(0.0, 0.0, area.width, area.length).buffer(0.06).contains(centre)
    # Every edge of that region is a cushion in contact with the ball, or the rim of a pocket.
    edges = np.asarray(centre.exterior.segmentize(0.005).coords)
    reach = radius_of(name)
    rims = [(pocket.position, pocket.radius) for pocket in table(name).pockets]
    touched = shapely.distance(np.asarray(cushions(name))[:, None], shapely.points(edges)).min(axis=0)
    rim = np.min([np.abs(np.hypot(*(edges - at).T) - size) for at, size in rims], axis=0) if rims else np.inf
    assert np.minimum(np.abs(touched - reach), rim).max() < 3.0 * FINE  # polygons of discs, and FINE itself


@pytest.mark.parametrize("name", POCKETED)
def test_ball_aimed_at_the_middle_of_a_mouth_falls_without_touching_a_cushion(name: str) -> None:
    preset = TABLES[name]  # type: ignore[index]
    middle, walls = (preset.width / 2.0, preset.length / 2.0), cushions(name)
    for pocket in table(name).pockets:
        x, y = pocket.position
        corner = not 0.0 < y < preset.length
        opening = preset.corner if corner else preset.middle
        assert opening is not None
        out = np.array([math.copysign(1.0, x), math.copysign(1.0, y) if corner else 0.0])
        out /= np.hypot(*out)
        mouth = pocket.position - out * (opening.shelf + opening.radius)
        for start in (mouth - 0.3 * out, np.asarray(middle)):  # along its axis, and from the middle
            far = LineString([start, start + 3.0 * (mouth - start)])
            path = LineString([start, far.intersection(disc(pocket.position, pocket.radius)).coords[0]])
            assert min(each.distance(path) for each in walls) > radius_of(name)


@pytest.mark.parametrize("name", POCKETED)
def test_pockets_are_reachable_and_overlap_the_cloth_only_in_corners(name: str) -> None:
    area, reach = TABLES[name], radius_of(name)  # type: ignore[index]
    bed = box(0.0, 0.0, area.width, area.length).buffer(-reach, join_style="mitre")
    for pocket in table(name).pockets:
        rim = disc(pocket.position, pocket.radius)
        assert rim.exterior.intersection(reachable(name).buffer(FINE)).length > reach  # at least as wide as a ball
        corner = pocket.position[1] < 0.0 or pocket.position[1] > area.length
        # A corner pocket begins behind its mouth, so that a ball rolling along a cushion falls; a side pocket lies
        # behind the noses.
        overlap = rim.intersection(bed).area
        assert overlap < 0.1 * rim.area if corner else overlap == 0.0
        assert all(rim.intersection(Polygon(each.buffer(1e-9))).area < 1e-4 * rim.area for each in cushions(name))


@pytest.mark.parametrize("name", NAMES)
def test_tables_are_symmetric(name: str) -> None:
    scene, area = table(name), TABLES[name]  # type: ignore[index]
    circles = [(*each.position, each.radius) for each in (*scene.posts, *scene.pockets)]
    ends = np.array([(*point, 0.0) for wall in scene.walls for point in wall.points] + circles)
    for across, along in ((True, False), (False, True)):
        mirrored = np.where((across, along, False), (area.width, area.length, 0.0) - ends, ends)
        gaps = np.abs(ends[:, None] - mirrored[None]).max(axis=2)
        assert gaps.min(axis=1).max() < 1e-14  # rounding of lengths of a few metres
        assert gaps.min(axis=0).max() < 1e-14


@pytest.mark.parametrize("name", POCKETED)
def test_jaws_are_tangent_to_nose_and_facing(name: str) -> None:
    scene = table(name)
    for post in scene.posts:
        near = [
            wall for wall in scene.walls if LineString(wall.points).distance(Point(post.position)) < 1.1 * post.radius
        ]
        noses = [wall for wall in near if wall.name is not None and wall.name.endswith("cushion")]
        assert len(noses) == 1
        for wall in near:
            # the end of each line lies on the arc, and the line leaves perpendicular to the radius; rounding
            end = min(wall.points, key=lambda at: math.dist(at, post.position))
            assert math.dist(end, post.position) == pytest.approx(post.radius, abs=1e-14)
            other = next(at for at in wall.points if at != end)
            path = np.subtract(other, end) / math.dist(other, end)
            assert np.dot(path, np.subtract(end, post.position)) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize(
    ("opening", "mouth", "shelf", "angle"),
    [
        (WPA_CORNER, (4.5, 4.625), (1.0, 2.25), (141, 143)),
        (WPA_SIDE, (5.0, 5.125), (0.0, 0.375), (103, 105)),
        (BCA_CORNER, (4.875, 5.125), (1.625, 1.875), (141, 143)),
        (BCA_SIDE, (5.375, 5.625), (0.0, 0.375), (101, 105)),
    ],
)
def test_pool_pocket_openings_follow_the_rules(opening, mouth, shelf, angle) -> None:  # type: ignore[no-untyped-def]
    assert mouth[0] <= opening.mouth / INCH <= mouth[1]
    assert shelf[0] <= opening.shelf / INCH <= shelf[1]
    assert angle[0] <= opening.angle <= angle[1]


@pytest.mark.parametrize("name", ["pool-7ft", "pool-8ft", "pool-9ft"])
def test_facings_meet_the_noses_at_the_cut_angle(name: str) -> None:
    walls = {wall.name: np.asarray(wall.points) for wall in table(name).walls}
    for facing, nose, opening in (
        ("lower left pocket facing 2", "lower cushion", TABLES[name].corner),  # type: ignore[index]
        ("left pocket facing 2", "lower left cushion", TABLES[name].middle),  # type: ignore[index]
    ):
        into = np.subtract(*walls[facing][::-1])
        along = np.subtract(*walls[nose][::-1])
        cosine = np.dot(into, along) / np.hypot(*into) / np.hypot(*along)
        assert opening is not None
        # rounding; both cushions run away from the pocket, or towards it
        assert abs(cosine) == pytest.approx(abs(math.cos(math.radians(opening.angle))), abs=1e-12)


def test_snooker_spots_follow_the_rules() -> None:
    spots = TABLES["snooker-12ft"].spots
    length, width = 3.569, 1.778
    assert spots["brown"] == (width / 2.0, 0.737)
    assert math.dist(spots["brown"], spots["yellow"]) == pytest.approx(0.292, abs=1e-15)  # one rounding
    assert math.dist(spots["brown"], spots["green"]) == pytest.approx(0.292, abs=1e-15)
    assert spots["yellow"][0] > spots["green"][0]  # on the right from baulk
    assert spots["blue"][1] == length / 2.0
    assert spots["pink"][1] == pytest.approx((length / 2.0 + length) / 2.0, abs=1e-15)
    assert length - spots["black"][1] == pytest.approx(0.324, abs=1e-15)
