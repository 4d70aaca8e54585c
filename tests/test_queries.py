"""Ray casts and distances against shapely, against pymunk's own queries, and by hand."""

import math

import numpy as np
import pymunk
import pytest
import shapely
import shapely.affinity
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.engines.registry import ENGINES
from sandbox.queries import NOTHING, SceneQueries
from sandbox.scene.compile.scene import Scene
from tests.runs_by_hand import scene_of

ARC = 256
"""Segments of a quarter circle in shapely: the arc is inside by a fraction 5e-6 of the radius"""

SHAPES = """
[[ball]]
name = "ball"
position = [1.0, 1.0]
radius = 0.4
[[box]]
name = "box"
position = [-1.0, 1.0]
size = [0.8, 0.5]
angle = 0.4
[[box]]
name = "rounded"
position = [-1.2, -0.9]
size = [0.7, 0.6]
radius = 0.1
angle = -0.3
[[capsule]]
name = "capsule"
position = [1.2, -1.0]
length = 0.8
radius = 0.15
angle = 1.1
[[polygon]]
name = "arrow"
position = [0.1, 0.0]
points = [[0.0, 0.0], [0.5, -0.4], [0.2, 0.3], [-0.4, 0.1]]
[[wall]]
name = "fence"
points = [[-2.0, 2.0], [0.0, 1.9], [2.0, 2.2]]
thickness = 0.06
[[post]]
name = "post"
position = [0.0, -2.0]
radius = 0.3
"""


def outlines(scene: Scene) -> dict[str, shapely.Geometry]:
    """Return the shape of each object as shapely builds it from the corners and radii of its pieces."""
    found: dict[str, shapely.Geometry] = {}
    shapes, bodies = scene.bodies.shapes, scene.bodies
    for k in range(len(shapes)):
        number = int(shapes.body[k])
        angle = float(bodies.angle[number])
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        corners = bodies.position[number] + shapes.corner[shapes.first[k] : shapes.first[k + 1]] @ turn.T
        core = shapely.MultiPoint(corners).convex_hull
        piece = core.buffer(float(shapes.radius[k]), quad_segs=ARC) if shapes.radius[k] else core
        name = bodies.names[number]
        found[name] = found[name].union(piece) if name in found else piece
    for name, thing in zip(scene.fixed_names, scene.fixed, strict=False):
        if hasattr(thing, "points"):
            found[name] = shapely.LineString(thing.points).buffer(0.5 * thing.thickness, quad_segs=ARC)
        else:
            found[name] = shapely.Point(thing.position).buffer(thing.radius, quad_segs=ARC)
    return found


SCENE = scene_of(SHAPES)
OUTLINES = outlines(SCENE)
COORDINATE = st.floats(-2.5, 2.5, allow_subnormal=False)
"""m; shapely's intersections of lines with subnormal coordinates are wrong"""
POINTS = st.tuples(COORDINATE, COORDINATE)


@settings(max_examples=300)
@given(POINTS, POINTS, st.sampled_from([0.0, 0.05, 0.3]))
def test_first_hit_is_that_of_shapely(start: tuple[float, float], end: tuple[float, float], radius: float) -> None:
    line = shapely.LineString([start, end])
    if line.length < 0.01:
        return
    hits: dict[str, float] = {}
    for name, outline in OUTLINES.items():
        grown = outline.buffer(radius, quad_segs=ARC) if radius else outline
        crossed = line.intersection(grown)
        if grown.distance(shapely.Point(start)) > 0.0 and not crossed.is_empty:
            hits[name] = shapely.Point(start).distance(crossed) / line.length
    found = SceneQueries(SCENE).cast_ray(start, end, radius)
    if found is None:
        # A ray that grazes an arc may miss it: its chord lies inside by 5e-6 of the radius.
        assert all(line.distance(OUTLINES[name]) - radius > -1e-5 for name in hits)
        return
    touched = shapely.Point(found.point).distance(OUTLINES[found.name].boundary)
    assert touched == pytest.approx(radius, abs=1e-5)  # chords of arcs
    assert math.hypot(*found.normal) == pytest.approx(1.0, abs=1e-12)
    assert (end[0] - start[0]) * found.normal[0] + (end[1] - start[1]) * found.normal[1] <= 1e-9  # against the way
    for fraction in hits.values():  # no other object is hit earlier, but for a graze, whose depth is the square root
        assert found.fraction <= fraction + 6e-3 / line.length


CENTIMETRES = st.integers(-60, 60).map(lambda n: n / 100)
CORNERS = st.tuples(CENTIMETRES, CENTIMETRES)
"""Corners of shapes; no slivers, which shapely's `buffer` makes too small."""


def moved(shape: shapely.Geometry, by: tuple[float, float]) -> shapely.Geometry:
    return shapely.affinity.translate(shape, *by)


@settings(max_examples=300)
@given(
    st.lists(CORNERS, min_size=1, max_size=6),
    POINTS,
    POINTS,
    st.floats(-math.pi, math.pi),
    st.sampled_from([0.0, 0.1]),
)
def test_first_hit_of_a_shape_is_that_of_shapely(
    corners: list[tuple[float, float]],
    start: tuple[float, float],
    end: tuple[float, float],
    angle: float,
    radius: float,
) -> None:
    """At the hit the shape touches the object that is named; on the way there it overlaps no other."""
    assume(math.dist(start, end) > 0.01)
    core = shapely.affinity.rotate(shapely.MultiPoint(corners).convex_hull, angle, origin=(0.0, 0.0), use_radians=True)
    shape = core.buffer(radius, quad_segs=ARC) if radius else core
    found = SceneQueries(SCENE).cast_shape(corners, start, end, angle=angle, radius=radius)
    last = end
    if found is not None:
        last = found.point
        # Chords of arcs, of a sum of radii up to 0.5 m.
        assert moved(shape, last).distance(OUTLINES[found.name]) < 1e-5
        assert moved(shape, start).distance(OUTLINES[found.name]) > 0.0
        assert last == pytest.approx([a + found.fraction * (b - a) for a, b in zip(start, end, strict=True)], abs=1e-12)
    swept = shapely.union(moved(shape, start), moved(shape, last)).convex_hull  # of a convex shape
    for name, outline in OUTLINES.items():
        # The arrow is not convex, so that the shape can start inside the hull of its pieces; its pieces are hit as one.
        if moved(shape, start).distance(outline) > 0.0 and (found is None or name != found.name):
            assert swept.distance(outline.buffer(-1e-5)) > 0.0, name  # chords of arcs


def test_box_stops_at_a_plane_and_passes_under_a_wall() -> None:
    scene = scene_of(
        """
        [[plane]]
        name = "ground"
        point = [0.0, 0.0]
        normal = [0.0, 2.0]
        [[wall]]
        name = "beam"
        points = [[2.0, 1.0], [4.0, 1.0]]
        thickness = 0.5
        """
    )
    queries, box = SceneQueries(scene), [(-0.5, -0.25), (0.5, -0.25), (0.5, 0.25), (-0.5, 0.25)]
    hit = queries.cast_shape(box, (0.0, 2.0), (0.0, -2.0))
    assert hit is not None
    assert (hit.name, hit.point, hit.normal) == ("ground", (0.0, 0.25), (0.0, 1.0))
    upright = queries.cast_shape(box, (0.0, 2.0), (0.0, -2.0), angle=0.5 * math.pi, radius=0.25)
    assert upright is not None
    assert upright.point == pytest.approx((0.0, 0.75), abs=1e-12)  # rounding of the cosine
    assert queries.cast_shape(box, (-1.0, 0.375), (9.0, 0.375)) is None
    high = queries.cast_shape(box, (-1.0, 0.625), (9.0, 0.625))
    assert high is not None
    # The upper right corner, at (0.5, 0.25), meets the round end about (2, 1) with a radius of 0.25 m at y = 0.875.
    assert (high.name, high.point[0]) == ("beam", pytest.approx(2.0 - math.sqrt(0.25**2 - 0.125**2) - 0.5, abs=1e-12))


@pytest.mark.parametrize(
    ("corners", "more"),
    [
        ([], {}),
        ([(0.0, math.nan)], {}),
        ([(0.0, 0.0)], {"radius": -1.0}),
        ([(0.0, 0.0)], {"angle": math.inf}),
    ],
)
def test_invalid_shapes_are_rejected(corners: list[tuple[float, float]], more: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"corner|finite|radius"):
        SceneQueries(SCENE).cast_shape(corners, (0.0, 0.0), (1.0, 0.0), **more)


@settings(max_examples=200)
@given(POINTS)
def test_nearest_object_is_that_of_shapely(point: tuple[float, float]) -> None:
    where = shapely.Point(point)
    inside = {name for name, outline in OUTLINES.items() if outline.contains(where)}
    found = SceneQueries(SCENE).nearest(point)
    assert found is not None
    if inside:
        assert found.distance <= 0.0
        assert found.name in inside or found.distance > -1e-5
    else:
        least = min(outline.distance(where) for outline in OUTLINES.values())
        assert found.distance == pytest.approx(least, abs=1e-5)  # chords of arcs
        assert OUTLINES[found.name].boundary.distance(shapely.Point(found.point)) < 1e-5


@given(POINTS, POINTS)
def test_first_hit_is_that_of_pymunk(start: tuple[float, float], end: tuple[float, float]) -> None:
    """Pymunk's own query of a space that is built by hand."""
    space = pymunk.Space()
    disc = pymunk.Circle(space.static_body, 0.4, (1.0, 1.0))
    plank = pymunk.Segment(space.static_body, (-2.0, 2.0), (0.0, 1.9), 0.03)
    space.add(disc, plank)
    scene = scene_of(
        """
        [[ball]]
        position = [1.0, 1.0]
        radius = 0.4
        [[wall]]
        points = [[-2.0, 2.0], [0.0, 1.9]]
        thickness = 0.06
        """
    )
    known = space.segment_query_first(start, end, 0.0, pymunk.ShapeFilter())
    found = SceneQueries(scene).cast_ray(start, end)
    if known is None or found is None:
        near = [shape.point_query(start).distance for shape in (disc, plank)]
        graze = min(shapely.LineString([start, end]).distance(shapely.Point(1.0, 1.0)) - 0.4, 0.0)
        assert (known is None and found is None) or min(near) <= 1e-9 or graze > -1e-9 or abs(graze) < 1e-9
        return
    assert found.fraction == pytest.approx(known.alpha, abs=1e-9)  # rounding, near grazes of its square root
    assert found.name == ("ball-1" if known.shape is disc else "wall-1")


def test_all_engines_answer_alike_during_a_run() -> None:
    answers = []
    for engine in ENGINES:
        simulation = sandbox.start("bounce", engine)
        for _ in range(50):
            simulation.step()
        # Straight down beside the ball: the ground, wherever an engine has the ball.
        answers.append(simulation.cast_ray((3.0, 2.0), (3.0, -2.0)))
    assert answers[0] is not None
    assert answers == [answers[0]] * len(answers)


def test_ray_follows_a_body_and_ignores_the_one_that_looks() -> None:
    simulation = sandbox.start("bounce", "exact")
    name = simulation.bodies.names[0]
    for _ in range(30):
        simulation.step()
    x, y = simulation.frame().position[0].tolist()
    radius = float(simulation.bodies.radius[0])
    hit = simulation.cast_ray((x, y + 1.0), (x, y - 5.0))
    assert hit is not None
    assert hit.name == name
    assert hit.point[1] == pytest.approx(y + radius, rel=1e-12)
    below = simulation.cast_ray((x, y), (x, y - 50.0), ignore=[name])
    assert below is not None
    assert below.name != name


def test_spawned_bodies_are_seen_and_removed_ones_are_not() -> None:
    simulation = sandbox.start("bounce", "pymunk")
    simulation.step()
    simulation.apply(sandbox.Spawn(time=0.0, box={"name": "crate", "position": [0.0, 8.0], "size": [1.0, 1.0]}))
    hit = simulation.cast_ray((0.0, 10.0), (0.0, 0.0))
    assert hit is not None
    assert (hit.name, hit.point) == ("crate", (0.0, 8.5))
    for name in ("crate", "ball"):
        simulation.apply(sandbox.Remove(time=0.0, body=name))
    hit = simulation.cast_ray((0.0, 10.0), (0.0, 0.0))
    assert hit is not None
    assert hit.name == "ground"


def test_ray_that_starts_inside_sees_what_is_behind() -> None:
    queries = SceneQueries(SCENE)
    assert queries.cast_ray((1.0, 1.0), (1.0, 1.1)) is None  # it stays inside the ball
    hit = queries.cast_ray((1.0, 1.0), (-1.0, 1.0))
    assert hit is not None
    assert hit.name == "box"


def test_many_rays_are_those_one_by_one() -> None:
    random = np.random.default_rng(2)
    start, end = random.uniform(-2.5, 2.5, (2, 500, 2))
    queries = SceneQueries(SCENE)
    hits = queries.cast_rays(start, end, 0.02)
    assert np.isnan(hits.point[hits.target == NOTHING]).all()
    for k in range(0, 500, 7):
        single = queries.cast_ray(tuple(start[k]), tuple(end[k]), 0.02)
        if single is None:
            assert hits.target[k] == NOTHING
        else:
            assert (queries.name_of(int(hits.target[k])), hits.fraction[k]) == (single.name, single.fraction)


def test_only_named_categories_are_seen() -> None:
    scene = scene_of(
        """
        [[ball]]
        name = "coin"
        position = [0.0, 2.0]
        radius = 0.2
        categories = ["coin"]
        [[plane]]
        name = "floor"
        point = [0.0, 0.0]
        normal = [0.0, 1.0]
        categories = ["ground"]
        """
    )
    hit = SceneQueries(scene, categories=["ground"]).cast_ray((0.0, 5.0), (0.0, -1.0))
    assert hit is not None
    assert hit.name == "floor"
    assert hit.fraction == 5.0 / 6.0
    with pytest.raises(ValueError, match=r"categories: unknown 'grund'; those of the scene: ground, coin"):
        SceneQueries(scene, categories=["grund"])
    with pytest.raises(ValueError, match="ignore: the scene has no body or static object 'foot'"):
        SceneQueries(scene, ignore=["foot"])


def test_bodies_that_collide_with_nothing_and_walls_that_are_switched_off_are_not_seen() -> None:
    scene = scene_of(
        """
        [[ball]]
        position = [0.0, 0.0]
        radius = 0.2
        collides = "none"
        [[wall]]
        points = [[1.0, -1.0], [1.0, 1.0]]
        solid = false
        """
    )
    queries = SceneQueries(scene)
    assert queries.cast_ray((-2.0, 0.0), (2.0, 0.0)) is None
    assert queries.nearest((0.0, 0.0)) is None


@pytest.mark.parametrize("bad", [(math.nan, 0.0), (math.inf, 0.0)])
def test_coordinates_that_are_not_finite_are_rejected(bad: tuple[float, float]) -> None:
    queries = SceneQueries(SCENE)
    with pytest.raises(ValueError, match="not finite"):
        queries.cast_ray(bad, (0.0, 0.0))
    with pytest.raises(ValueError, match="must be finite"):
        queries.nearest(bad)
    with pytest.raises(ValueError, match="radius"):
        queries.cast_ray((0.0, 0.0), (1.0, 0.0), -1.0)
