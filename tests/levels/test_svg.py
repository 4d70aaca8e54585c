"""SVG drawings: geometry, transforms, roles, keys, styles and names."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.levels import import_svg
from sandbox.scene.geometry.polygon import signed_area
from tests.levels.drawings import DATA, EXACT, dynamic, faults_of, imported, messages


def test_circle_becomes_a_post_or_a_ball_with_y_up() -> None:
    circle = '<circle id="c" cx="30" cy="20" r="5"/>'
    (post,) = imported(circle).scene.posts
    assert (post.name, post.position, post.radius) == ("c", (0.3, 0.8), 0.05)
    (ball,) = imported(dynamic(circle)).scene.balls
    assert (ball.name, ball.position, ball.radius) == ("c", (0.3, 0.8), 0.05)


def test_rectangle_becomes_a_box_and_turns_with_its_transform() -> None:
    (box,) = imported('<rect x="10" y="20" width="30" height="10" transform="rotate(30 25 25)"/>').scene.boxes
    assert (box.position, box.size, box.fixed) == ((0.25, 0.75), (0.3, 0.1), True)
    assert box.angle == pytest.approx(-math.pi / 6, abs=1e-12)  # clockwise on the page
    (turned,) = imported('<rect width="30" height="10" transform="rotate(90)"/>').scene.boxes
    assert abs(turned.angle) == pytest.approx(math.pi / 2, abs=1e-12)


def test_rounded_rectangle_becomes_a_box_with_a_radius() -> None:
    rounded = '<rect x="10" y="20" width="30" height="20" rx="4" transform="scale(2)"/>'
    (box,) = imported(dynamic(rounded)).scene.boxes
    assert box.position == pytest.approx((0.5, 0.4), abs=EXACT)
    assert (*box.size, box.radius) == pytest.approx((0.44, 0.24, 0.08), abs=EXACT)
    (fixed,) = imported(rounded).scene.boxes
    assert (fixed.size, fixed.radius, fixed.fixed) == (box.size, box.radius, True)


def test_rounded_rectangle_keeps_its_corners_as_a_zone_as_a_hollow_wall_and_in_a_body() -> None:
    area = (30.0 * 20.0 - (4.0 - math.pi) * 16.0) * 1e-4
    tolerance = 0.001 * 100e-4  # px of the outline, 100 px long, in m²
    rounded = '<rect x="10" y="20" width="30" height="20" rx="4" {}/>'
    (zone,) = imported(rounded.format('data-body="zone"'), tolerance=0.001).scene.zones
    (wall,) = imported(rounded.format('fill="none" stroke="black"'), tolerance=0.001).scene.walls
    for points in (zone.points, wall.points):
        assert points is not None
        assert abs(signed_area(points)) == pytest.approx(area, abs=tolerance)
    group = f'<g data-body="compound">{rounded.format("")}<circle cx="50" cy="30" r="10"/></g>'
    (body,) = imported(group).scene.compounds
    (box,) = body.boxes
    assert (*box.size, box.radius) == pytest.approx((0.22, 0.12, 0.04), abs=EXACT)
    assert body.position == pytest.approx((0.35, 0.7), abs=EXACT)  # of the bounding box, which has the round corners


def test_transforms_of_nested_groups_are_applied_from_the_inside() -> None:
    body = '<g transform="translate(10,20)"><g transform="scale(2) rotate(90)"><circle cx="3" cy="0" r="1"/></g></g>'
    (post,) = imported(body).scene.posts  # rotate: (0, 3); scale: (0, 6); translate: (10, 26)
    assert post.position == pytest.approx((0.1, 0.74), abs=EXACT)
    assert post.radius == 0.02


similarity = st.tuples(st.floats(-180, 180), st.floats(0.2, 5), st.floats(-50, 50), st.floats(-50, 50), st.booleans())


@given(similarity)
def test_any_similarity_keeps_circles_rectangles_and_areas(values: tuple[float, float, float, float, bool]) -> None:
    degrees, scale, dx, dy, mirror = values
    flip = " scale(-1,1)" if mirror else ""
    transform = f"translate({dx!r},{dy!r}) rotate({degrees!r}) scale({scale!r}){flip}"
    level = imported(
        f'<g transform="{transform}"><circle cx="7" cy="3" r="2"/><rect x="1" y="2" width="6" height="4"/>'
        '<polygon points="0,0 8,0 8,2 2,2 2,6 0,6"/></g>'
    )
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))

    def place(x: float, y: float) -> tuple[float, float]:
        x = -x if mirror else x
        px, py = dx + scale * (cos * x - sin * y), dy + scale * (sin * x + cos * y)
        return 0.01 * px, 0.01 * (100.0 - py)

    (post,), (box,), (polygon,) = level.scene.posts, level.scene.boxes, level.scene.polygons
    assert post.position == pytest.approx(place(7.0, 3.0), abs=EXACT)
    assert post.radius == pytest.approx(0.02 * scale, abs=EXACT)
    assert box.position == pytest.approx(place(4.0, 4.0), abs=EXACT)
    assert box.size == pytest.approx((0.06 * scale, 0.04 * scale), abs=EXACT)
    assert abs(signed_area(polygon.points)) == pytest.approx(24e-4 * scale**2, abs=EXACT)  # sides below 1 m
    corners = [(polygon.position[0] + x, polygon.position[1] + y) for x, y in polygon.points]
    expected = [place(*corner) for corner in ((0, 0), (8, 0), (8, 2), (2, 2), (2, 6), (0, 6))]
    for a, b in zip(corners, expected, strict=True):
        assert a == pytest.approx(b, abs=EXACT)


def test_sheared_circle_and_ellipse_become_polygons_and_it_is_said() -> None:
    level = imported('<circle cx="50" cy="50" r="10" transform="skewX(20)"/><ellipse cx="20" cy="20" rx="9" ry="5"/>')
    assert len(level.scene.polygons) == 2
    assert messages(level).count("becomes a polygon") == 2
    # × perimeter, px²
    assert abs(signed_area(level.scene.polygons[1].points)) == pytest.approx(math.pi * 45e-4, abs=0.25 * 45e-4)


def test_path_with_curves_is_flattened_to_the_tolerance() -> None:
    body = '<path d="M 10 50 Q 50 10 90 50 Z"/>'
    areas = {}
    for tolerance in (1.0, 0.001):
        (polygon,) = imported(body, tolerance=tolerance).scene.polygons
        areas[tolerance] = abs(signed_area(polygon.points))
    exact = 2.0 / 3.0 * 80.0 * 20.0 * 1e-4  # Archimedes: two thirds of the base times the height
    assert areas[0.001] == pytest.approx(exact, abs=0.001 * 90e-4)  # tolerance times the length of the curve, px²
    assert exact - areas[1.0] < 90e-4


def test_full_circle_drawn_with_arcs_is_a_circle() -> None:
    (post,) = imported('<path d="M 40 50 A 10 10 0 1 1 60 50 A 10 10 0 1 1 40 50 Z"/>').scene.posts
    assert post.position == pytest.approx((0.5, 0.5), abs=EXACT)
    assert post.radius == pytest.approx(0.1, abs=EXACT)


def test_open_lines_become_walls_as_thick_as_their_stroke() -> None:
    style = 'style="fill:none;stroke:#123456;stroke-width:2" transform="scale(2)"'
    level = imported(f'<line x1="0" y1="0" x2="10" y2="5" {style}/><path d="M0 0 L5 5 10 0" {style}/>')
    line, path = level.scene.walls
    assert line.points == ((0.0, 1.0), (0.2, 0.9))
    assert (line.thickness, line.colour, line.closed) == (0.04, "#123456", False)
    assert path.points == ((0.0, 1.0), (0.1, 0.9), (0.2, 1.0))
    (thin,) = imported('<polyline points="0,0 10,10"/>').scene.walls
    assert thin.thickness == 0.0


def test_static_shape_without_fill_is_a_closed_wall_and_a_dynamic_one_is_solid() -> None:
    frame = '<rect x="10" y="10" width="80" height="80" fill="none" stroke="black" stroke-width="2"/>'
    (wall,) = imported(frame).scene.walls
    assert wall.closed
    assert wall.thickness == 0.02
    assert sorted(wall.points) == [(0.1, 0.1), (0.1, 0.9), (0.9, 0.1), (0.9, 0.9)]
    assert len(imported(dynamic(frame)).scene.boxes) == 1


def test_hole_makes_walls_of_a_static_path_and_refuses_a_dynamic_one() -> None:
    ring = '<path id="ring" d="M 10 10 h 80 v 80 h -80 z M 30 30 v 40 h 40 v -40 z"/>'
    level = imported(ring)
    assert [wall.closed for wall in level.scene.walls] == [True, True]
    assert "hole" in messages(level)
    (fault,) = faults_of(dynamic(ring))
    assert fault.path == "path#ring"
    assert "hole" in fault.message


def test_separate_parts_of_a_dynamic_path_are_one_body() -> None:
    level = imported(dynamic('<path id="two" d="M 10 10 h 10 v 10 h -10 z M 50 10 h 10 v 10 h -10 z"/>'))
    (body,) = level.scene.compounds
    assert body.name == "two"
    assert len(body.polygons) == 2
    assert body.position == pytest.approx((0.35, 0.85), abs=EXACT)


def test_compound_group_is_one_body_with_the_keys_of_its_parts() -> None:
    body = (
        '<g id="hammer" data-body="compound" data-density="2" data-friction="0.5">'
        '<rect x="10" y="40" width="40" height="10"/><circle cx="60" cy="45" r="10" data-density="7"/></g>'
    )
    (hammer,) = imported(body).scene.compounds
    assert (hammer.name, hammer.density, hammer.friction) == ("hammer", 2.0, 0.5)
    (box,), (ball,) = hammer.boxes, hammer.balls
    assert (box.density, ball.density) == (None, 7.0)
    assert (hammer.position[0] + ball.position[0], hammer.position[1] + ball.position[1]) == pytest.approx(
        (0.6, 0.55), abs=EXACT
    )


@pytest.mark.parametrize(
    ("attributes", "table"),
    [
        ('data-body="dynamic"', "balls"), ('class="st0 dynamic"', "balls"),
        ('inkscape:label="Dynamic crates"', "balls"), ('id="dynamic_things"', "balls"),
        ('data-body="static" class="dynamic"', "posts"), ('class="dynamic static"', "posts"),
        ('data-body="zone"', "zones"), ('inkscape:label="sensor"', "zones"), ("", "posts"),
    ],
)  # fmt: skip
def test_role_comes_from_the_element_or_the_nearest_group(attributes: str, table: str) -> None:
    circle = '<circle cx="5" cy="5" r="2" {}/>'
    for body in (circle.format(attributes), f"<g {attributes}><g>{circle.format('')}</g></g>"):
        assert len(getattr(imported(body).scene, table)) == 1


def test_ignored_and_hidden_elements_are_left_out_without_a_warning() -> None:
    body = (
        '<rect width="5" height="5"/><rect width="9" height="9" display="none"/><g style="display:none"><circle r="3"/>'
        '</g><g visibility="hidden"><circle r="3"/><circle visibility="visible" cx="50" cy="50" r="3"/></g>'
        '<g data-body="ignore"><rect width="9" height="9"/></g><defs><circle r="4"/></defs>'
    )
    level = imported(body)
    assert dict(level.counts) == {"box": 1, "post": 1}
    assert [warning.message for warning in level.warnings if "nothing moves" not in warning.message] == []


def test_keys_are_taken_from_data_attributes_and_inherited() -> None:
    body = (
        '<g data-body="dynamic" data-friction="0.5" data-mass="3"><rect width="5" height="5" data-friction="0.25" '
        'data-angular-velocity="2" data-velocity="1, -2" data-collides="fixed" data-layer="2"/>'
        '<circle r="5" data-bounce="0.9"/></g><path d="M0 0 L9 9" data-one-way="true" data-kick="3" data-layers="a b"/>'
    )
    scene = imported(body).scene
    (box,), (ball,), (wall,) = scene.boxes, scene.balls, scene.walls
    assert (box.friction, box.mass, box.angular_velocity, box.velocity) == (0.25, 3.0, 2.0, (1.0, -2.0))
    assert (box.collides, box.layer) == ("fixed", "2")
    assert (ball.friction, ball.mass, ball.restitution) == (0.5, 3.0, 0.9)
    assert wall.one_way
    assert wall.kick.speed == 3.0
    assert wall.layers == ("a", "b")


def test_faults_of_keys_name_the_element_and_its_line() -> None:
    body = '<rect width="5" height="5"/>\n<circle id="ball" r="5" data-restitution="2" data-friction="rough"/>'
    faults = faults_of(body)
    assert [(fault.line, fault.path) for fault in faults] == [
        (3, "circle#ball.restitution"),
        (3, "circle#ball.friction"),
    ]
    assert "between 0 and 1" in faults[0].message


def test_unknown_keys_and_materials_are_warnings() -> None:
    level = imported('<g data-sound="boom"><circle r="5" data-frction="1" data-material="ice" data-mass="2"/></g>')
    text = messages(level)
    assert "did you mean 'friction'?" in text
    assert "'sound'" in text
    assert "'mass'" in text  # a post has none
    assert "material 'ice'" in text
    assert [material.name for material in level.scene.materials] == ["ice"]


def test_styles_come_from_sheets_attributes_and_groups() -> None:
    body = (
        "<style>/* c */ rect { fill: #111111 } .a{fill:#222222} #b{fill:#333333} rect.d { fill: #444444 }</style>"
        '<rect width="1" height="1"/><rect class="a" width="1" height="1"/>'
        '<rect id="b" class="a" width="1" height="1"/>'
        '<rect class="d a" width="1" height="1"/><rect class="a" style="fill:#555555" width="1" height="1"/>'
        '<g fill="rgb(102,102,102)"><circle r="1"/></g><circle fill="red" r="1"/><circle r="1"/>'
        '<circle fill="currentColor" color="#777" r="1"/>'
    )
    scene = imported(body).scene
    assert [box.colour for box in scene.boxes] == ["#111111", "#222222", "#333333", "#444444", "#555555"]
    assert [post.colour for post in scene.posts] == ["#666666", "#ff0000", None, "#777777"]


def test_copies_are_placed_and_named() -> None:
    body = (
        '<defs><symbol id="s" viewBox="0 0 10 10"><circle cx="5" cy="5" r="5"/></symbol></defs>'
        '<circle id="c" cx="10" cy="10" r="2"/><use xlink:href="#c" x="20"/>'
        '<use id="far" href="#c" transform="scale(3)"/>'
        '<use href="#s" x="40" y="40" width="20" height="20"/>'
    )
    scene = imported(body).scene
    assert [post.position for post in scene.posts] == [(0.1, 0.9), (0.3, 0.9), (0.3, 0.7), (0.5, 0.5)]
    assert [post.radius for post in scene.posts] == [0.02, 0.02, 0.06, 0.1]
    names = [post.name for post in scene.posts]
    assert len(set(names)) == 4
    assert names[2] == "far"


def test_names_are_unique_and_come_from_labels() -> None:
    labelled = '<circle id="a" inkscape:label="peg" r="1"/><circle inkscape:label="peg" r="1"/>'
    body = f'{labelled}<circle r="1"/><circle id="peg 2" r="1"/>'
    names = [post.name for post in imported(body).scene.posts]
    assert names[0] == "peg"
    assert len(set(names)) == 4


def test_title_description_and_gravity_of_the_drawing() -> None:
    level = imported("<title>Caves</title><desc>Mind\nthe gap</desc><circle r='1'/>", 'data-gravity="0 -1.62"')
    assert (level.scene.title, level.scene.about) == ("Caves", "Mind the gap")
    assert level.scene.world.gravity == (0.0, -1.62)
    assert imported("<circle r='1'/>").scene.world.gravity == (0.0, -9.81)
    assert imported("<circle r='1'/>", gravity=(0.0, 0.0)).scene.world.gravity == (0.0, 0.0)


@pytest.mark.parametrize(
    ("origin", "expected"), [("lower-left", (0.4, 0.6)), ("upper-left", (0.4, -0.4)), ("centre", (-0.1, 0.1))]
)
def test_origin_is_a_corner_of_the_page_or_its_centre(origin: str, expected: tuple[float, float]) -> None:
    for page in ('viewBox="-10 -10 100 100"', 'width="100" height="100"'):
        shift = -10 if "view" in page else 0
        body = f'<circle cx="{40 + shift}" cy="{40 + shift}" r="1"/>'
        (post,) = imported(body, page, origin=origin).scene.posts
        assert post.position == pytest.approx(expected, abs=EXACT)


def test_scale_is_metres_per_user_unit_of_the_view_box() -> None:
    (post,) = imported('<circle cx="10" cy="80" r="5"/>', 'width="210mm" viewBox="0 0 100 100"', scale=0.5).scene.posts
    assert (post.position, post.radius) == ((5.0, 10.0), 2.5)
    (box,) = imported('<rect width="1in" height="25.4mm"/>').scene.boxes
    assert box.size == (0.96, 0.96)


def test_parts_that_are_not_imported_are_named() -> None:
    body = (
        '<rect id="r" width="5" height="5" clip-path="url(#c)" fill="url(#g)"/><text id="t">x</text><image id="i"/>'
        '<foreignObject id="f"/><clipPath id="c"/><rect id="z" width="0" height="5"/><path id="e" d=""/>'
        "<style>a:hover { fill: red }</style>"
    )
    text = messages(imported(body))
    for part in (
        "rect#r: its clip-path",
        "gradient",
        "text#t",
        "image#i",
        "foreignObject#f",
        "rect#z",
        "path#e",
        "a:hover",
    ):
        assert part in text


def test_example_runs_and_its_text_loads_as_the_same_scene() -> None:
    level = import_svg(DATA / "level.svg")
    assert sandbox.loads(level.text) == level.scene
    assert dict(level.counts) == {"wall": 1, "post": 1, "zone": 1, "ball": 2, "body": 1, "box": 2, "polygon": 1}
    trajectory = sandbox.run(sandbox.loads(level.text, overrides=["world.duration=2"]), "pymunk")
    assert trajectory.status == "ok"
    heights = dict(zip(trajectory.names, trajectory.position[-1, :, 1], strict=True))
    starts = dict(zip(trajectory.names, trajectory.position[0, :, 1], strict=True))
    assert heights["floor"] == starts["floor"] == pytest.approx(0.1)
    for name in ("ball", "ball copy", "crate", "hammer"):
        assert 0.2 < heights[name] < starts[name]  # it fell, and lies above the top of the floor


def test_rectangles_that_share_a_side_become_one_box() -> None:
    """Rows first, as tiles of a map; others keep their places, names and text."""
    floor = "".join(f'<rect id="{name}" x="{x}" y="80" width="{w}" height="10"/>' for name, x, w in FLOOR)
    level = imported(f'{floor}<rect id="step" x="40" y="70" width="10" height="10"/><circle r="5"/>')
    assert [(box.name, box.position, box.size) for box in level.scene.boxes] == [
        ("left", (0.5, 0.15), (1.0, 0.1)),
        ("step", (0.45, 0.25), (0.1, 0.1)),
    ]
    assert "rect#left: is one box with 'middle', 'right', as bodies would stop at the seams" in messages(level)


FLOOR = ("left", 0, 33.3), ("middle", 33.3, 33.4), ("right", 66.7, 33.3)


@pytest.mark.parametrize("change", ['fill="red"', 'data-friction="1"', 'rx="1"', 'data-body="dynamic"'])
def test_rectangles_that_differ_stay_apart(change: str) -> None:
    rectangles = f'<rect x="0" y="80" width="50" height="10" {change}/><rect x="50" y="80" width="50" height="10"/>'
    assert len(imported(rectangles).scene.boxes) == 2
