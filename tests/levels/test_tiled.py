"""Maps of Tiled: objects, tiles, layers, properties and tilesets."""

import base64
import gzip
import json
import math
import struct
import zlib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.levels import import_tmx
from sandbox.scene.errors import SceneError
from sandbox.scene.geometry.polygon import signed_area
from tests.levels.drawings import DATA, EXACT, FULL, map_file, messages, objects, tiles

DYNAMIC = '<properties><property name="dynamic" type="bool" value="true"/></properties>'


def test_objects_become_the_shapes_that_they_are(tmp_path: Path) -> None:
    body = objects(
        '<object id="1" name="box" x="10" y="5" width="6" height="4"/>'
        f'<object id="2" name="ball" x="10" y="5" width="6" height="6">{DYNAMIC}<ellipse/></object>'
        '<object id="3" name="egg" x="10" y="5" width="6" height="4"><ellipse/></object>'
        f'<object id="4" name="tri" x="10" y="5">{DYNAMIC}<polygon points="0,0 6,0 0,6"/></object>'
        '<object id="5" name="line" x="10" y="5"><polyline points="0,0 6,-2 8,0"/></object>'
        '<object id="6" name="pill" x="10" y="5" width="8" height="4"><capsule/></object>'
    )
    level = import_tmx(map_file(tmp_path, body), tolerance=0.01)
    scene = level.scene
    (box,), (ball,), (wall,) = scene.boxes, scene.balls, scene.walls
    assert (box.position, box.size, box.fixed) == ((0.13, 0.23), (0.06, 0.04), True)
    assert (ball.position, ball.radius) == ((0.13, 0.22), 0.03)
    assert wall.points == ((0.1, 0.25), (0.16, 0.27), (0.18, 0.25))
    areas = {polygon.name: abs(signed_area(polygon.points)) for polygon in scene.polygons}
    assert areas["tri"] == pytest.approx(18e-4, abs=1e-9)  # rounding of 1e-8 m times its length
    assert areas["egg"] == pytest.approx(math.pi * 6e-4, abs=0.01 * 16e-4)  # tolerance × perimeter, px²
    assert areas["pill"] == pytest.approx((4 * 4 + math.pi * 4) * 1e-4, abs=0.01 * 21e-4)
    assert [polygon.fixed for polygon in scene.polygons] == [True, False, True]
    assert "object#3 'egg': an ellipse becomes a polygon" in messages(level)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
# the file is written anew for each
@given(st.floats(-720, 720), st.floats(-50, 50), st.floats(-50, 50), st.floats(1, 20), st.floats(1, 20))
def test_rotation_is_clockwise_about_the_corner_of_an_object(tmp_path, degrees, x, y, width, height):
    attributes = f'x="{x!r}" y="{y!r}" width="{width!r}" height="{height!r}" rotation="{degrees!r}"'
    (box,) = import_tmx(map_file(tmp_path, objects(f'<object id="1" {attributes}/>'))).scene.boxes
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    px, py = x + 0.5 * (cos * width - sin * height), y + 0.5 * (sin * width + cos * height)
    assert box.position == pytest.approx((0.01 * px, 0.01 * (30.0 - py)), abs=EXACT)
    assert box.size == pytest.approx((0.01 * width, 0.01 * height), abs=EXACT)
    assert math.cos(2.0 * (box.angle + math.radians(degrees))) == pytest.approx(1.0, abs=1e-9)  # modulo half a turn


@pytest.mark.parametrize(
    ("attributes", "properties", "table"),
    [
        ("", '<property name="dynamic" type="bool" value="true"/>', "balls"),
        ("", '<property name="body" value="dynamic"/>', "balls"),
        ("", '<property name="sensor" type="bool" value="true"/>', "zones"),
        ('class="Dynamic"', "", "balls"),
        ('type="dynamic"', "", "balls"),
        ('type="dynamic"', '<property name="dynamic" type="bool" value="false"/>', "posts"),
        ("", "", "posts"),
    ],
)
def test_role_of_an_object_comes_from_properties_or_its_class(attributes, properties, table, tmp_path):
    own = f"<properties>{properties}</properties>"
    body = objects(f'<object id="1" x="0" y="0" width="4" height="4" {attributes}>{own}<ellipse/></object>')
    assert len(getattr(import_tmx(map_file(tmp_path, body)).scene, table)) == 1


def test_groups_and_layers_give_offsets_roles_and_keys(tmp_path: Path) -> None:
    circle = '<object id="1" x="0" y="0" width="4" height="4"><ellipse/></object>'
    friction = '<properties><property name="friction" type="float" value="0.5"/></properties>'
    inner = objects(friction + circle, 'name="a" offsetx="10" offsety="5"')
    hidden = objects(circle, 'name="b" visible="0"')
    body = f'<group name="dynamic things" offsetx="1">{inner}{hidden}</group>'
    level = import_tmx(map_file(tmp_path, body))
    (ball,) = level.scene.balls
    assert ball.position == pytest.approx((0.13, 0.23), abs=EXACT)
    assert ball.friction == 0.5


def test_full_tiles_are_merged_and_keep_their_keys(tmp_path: Path) -> None:
    friction = '<properties><property name="friction" type="float" value="0.1"/></properties>'
    tileset = f'<tile id="0">{FULL}</tile><tile id="1">{friction}{FULL}</tile><tile id="2"/>'
    level = import_tmx(map_file(tmp_path, tiles("3,3,3,0, 1,1,1,2, 1,1,1,2", tileset)))
    stone, ice = sorted(level.scene.boxes, key=lambda box: box.position[0])
    assert (stone.position, stone.size, stone.friction, stone.fixed) == ((0.15, 0.1), (0.3, 0.2), None, True)
    assert (ice.position, ice.size, ice.friction) == ((0.35, 0.1), (0.1, 0.2), 0.1)


def test_solid_layer_makes_boxes_of_tiles_without_shapes(tmp_path: Path) -> None:
    plain = tiles("0,0,0,0, 0,0,0,0, 1,1,1,1", "", 'name="ground"')
    with pytest.raises(SceneError, match="solid = true"):
        import_tmx(map_file(tmp_path, plain))
    solid = '<properties><property name="solid" type="bool" value="true"/></properties><data'
    (box,) = import_tmx(map_file(tmp_path, plain.replace("<data", solid))).scene.boxes
    assert (box.position, box.size) == ((0.2, 0.05), (0.4, 0.1))


_TRIANGLE = '<object id="1" x="0" y="10"><polygon points="0,0 10,0 10,-4"/></object>'
SLOPE = f'<tile id="0"><objectgroup>{_TRIANGLE}</objectgroup></tile>'


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        (0, {(0, 10), (10, 10), (10, 6)}), (1 << 31, {(10, 10), (0, 10), (0, 6)}),
        (1 << 30, {(0, 0), (10, 0), (10, 4)}), (1 << 29, {(10, 0), (10, 10), (6, 10)}),
        (1 << 31 | 1 << 29, {(0, 0), (0, 10), (4, 10)}),
    ],
)  # fmt: skip
def test_flipped_tiles_have_flipped_shapes(flags: int, expected: set[tuple[int, int]], tmp_path: Path) -> None:
    rows = f"{1 + flags},0,0,0, 0,0,0,0, 0,0,0,0"
    (polygon,) = import_tmx(map_file(tmp_path, tiles(rows, SLOPE))).scene.polygons
    corners = {
        (round(100 * (polygon.position[0] + x), 4) + 0.0, round(100 * (0.3 - polygon.position[1] - y), 4) + 0.0)
        for x, y in polygon.points
    }
    assert corners == expected


@pytest.mark.parametrize("kind", ["csv", "plain", "zlib", "gzip"])
def test_tile_data_of_every_encoding(kind: str, tmp_path: Path) -> None:
    gids = [0] * 8 + [1] * 4
    packed = struct.pack("<12L", *gids)
    text = {
        "csv": ",".join(map(str, gids)),
        "plain": base64.b64encode(packed).decode(),
        "zlib": base64.b64encode(zlib.compress(packed)).decode(),
        "gzip": base64.b64encode(gzip.compress(packed)).decode(),
    }[kind]
    encoding = 'encoding="csv"' if kind == "csv" else 'encoding="base64"'
    compression = f'compression="{kind}"' if kind in ("zlib", "gzip") else ""
    body = tiles("", f'<tile id="0">{FULL}</tile>').replace(
        '<data encoding="csv"></data>', f"<data {encoding} {compression}>{text}</data>"
    )
    (box,) = import_tmx(map_file(tmp_path, body)).scene.boxes
    assert box.size == (0.4, 0.1)


def test_infinite_map_has_its_origin_at_its_first_tile(tmp_path: Path) -> None:
    chunks = (
        '<chunk x="-2" y="0" width="2" height="1">1,1</chunk><chunk x="0" y="0" width="2" height="2">1,0,0,0</chunk>'
    )
    body = tiles("", f'<tile id="0">{FULL}</tile>').replace("</data>", f"{chunks}</data>")
    (box,) = import_tmx(map_file(tmp_path, body, 'infinite="1"')).scene.boxes
    assert (box.position, box.size) == ((-0.05, -0.05), (0.3, 0.1))


def test_tile_objects_scale_turn_and_use_the_shapes_of_their_tile(tmp_path: Path) -> None:
    two = (
        '<tile id="0" type="dynamic"><objectgroup><object id="1" x="0" y="0" width="5" height="10"/>'
        '<object id="2" x="5" y="5" width="5" height="5"/></objectgroup></tile>'
    )
    tileset = f'<tileset firstgid="1" name="t" tilewidth="10" tileheight="10">{two}</tileset>'
    body = tileset + objects(
        '<object id="1" name="stairs" gid="1" x="10" y="20" width="20" height="10"/>'
        '<object id="2" name="plain" gid="2" x="10" y="20" width="4" height="6" rotation="90"/>'
    )
    scene = import_tmx(map_file(tmp_path, body)).scene
    (stairs,), (plain,) = scene.compounds, scene.boxes
    first, second = stairs.boxes
    assert (first.size, second.size) == ((0.1, 0.1), (0.1, 0.05))
    assert stairs.position[0] + second.position[0] == pytest.approx(0.25, abs=EXACT)
    assert stairs.position[1] + second.position[1] == pytest.approx(0.1 + 0.025, abs=EXACT)
    assert plain.position == pytest.approx((0.13, 0.08), abs=EXACT)  # its lower left corner turns to the upper left


def test_external_tileset_in_a_folder_below_is_read(tmp_path: Path) -> None:
    (tmp_path / "sets").mkdir()
    text = f'<tileset name="t" tilewidth="10" tileheight="10"><tile id="0">{FULL}</tile></tileset>'
    (tmp_path / "sets" / "t.tsx").write_text(text)
    body = tiles("0,0,0,0, 0,0,0,0, 1,1,0,0", "")
    external = '<tileset firstgid="1" source="sets/t.tsx"/><layer'
    (box,) = import_tmx(map_file(tmp_path, external + body.partition("<layer")[2])).scene.boxes
    assert box.size == (0.2, 0.1)


def _json_value(text: str) -> object:
    return json.loads(text) if text in ("true", "false") or text[:1].isdigit() or text[:1] == "-" else text


def _json_members(node: ElementTree.Element, *left_out: str) -> dict[str, Any]:
    """Return attributes and properties of an element of a tileset as Tiled writes them in JSON."""
    found: dict[str, Any] = {key: _json_value(text) for key, text in node.items() if key not in left_out}
    if node.find("properties") is not None:
        found["properties"] = [
            {key: _json_value(text) if key == "value" else text for key, text in each.items()}
            for each in node.iterfind("properties/property")
        ]
    return found


def _json_object(node: ElementTree.Element) -> dict[str, Any]:
    found = {"name": "", "type": "", "rotation": 0, "visible": True} | _json_members(node)
    for child in node:
        if child.tag in ("ellipse", "point", "capsule"):
            found[child.tag] = True
        elif child.tag in ("polygon", "polyline"):
            pairs = [each.split(",") for each in child.attrib["points"].split()]
            found[child.tag] = [{"x": float(x), "y": float(y)} for x, y in pairs]
    return found


def _json_tile(node: ElementTree.Element) -> dict[str, Any]:
    found = _json_members(node)
    if node.find("objectgroup") is not None:
        shapes = [_json_object(each) for each in node.iterfind("objectgroup/object")]
        found["objectgroup"] = {"type": "objectgroup", "objects": shapes}
    return found


def as_json(tsx: str) -> str:
    """Return a tileset (.tsx) as the JSON (.tsj) that Tiled writes of it."""
    root = ElementTree.fromstring(tsx)
    document = {"type": "tileset", "columns": 2, "image": "t.png", "version": "1.10"} | _json_members(root)
    document["tiles"] = [_json_tile(tile) for tile in root.iterfind("tile")]
    return json.dumps(document)


number = st.floats(0.5, 10.0).map(lambda value: round(value, 3))
outline = st.lists(st.tuples(number, number), min_size=3, max_size=3, unique=True).filter(
    lambda points: (
        abs(
            (points[1][0] - points[0][0]) * (points[2][1] - points[0][1])
            - (points[1][1] - points[0][1]) * (points[2][0] - points[0][0])
        )
        > 0.5
    )
)
collider = st.one_of(
    st.builds(lambda w, h: f'width="{w}" height="{h}"', number, number),
    st.builds(lambda w, h, a: f'width="{w}" height="{h}" rotation="{a}"', number, number, number),
    st.builds(lambda w: f'width="{w}" height="{w}"><ellipse/>', number),
    st.builds(lambda w, h: f'width="{w}" height="{h}"><capsule/>', number, number),
    st.builds(lambda points: f'><polygon points="{" ".join(f"{x},{y}" for x, y in points)}"/>', outline),
    st.builds(lambda points: f'><polyline points="{" ".join(f"{x},{y}" for x, y in points)}"/>', outline),
).map(lambda text: f'<object id="1" x="1.5" y="2" {text}{"" if ">" in text else ">"}</object>')
keys = st.sampled_from(
    [
        "",
        '<property name="friction" type="float" value="0.25"/>',
        '<property name="solid" type="bool" value="true"/>',
        '<property name="restitution" type="float" value="1"/><property name="colour" type="color" value="#ff102030"/>',
        '<property name="layer" value="upper"/><property name="unused" type="int" value="-3"/>',
    ]
)
tile = st.builds(
    lambda keys, colliders: (
        (f"<properties>{keys}</properties>" if keys else "")
        + (f"<objectgroup>{''.join(colliders)}</objectgroup>" if colliders else "")
    ),
    keys,
    st.lists(collider, max_size=3),
)


@pytest.mark.fail_slow(60)  # hundreds of files
@pytest.mark.parametrize("suffix", [".tsj", ".json"])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(tiles=st.lists(tile, min_size=1, max_size=3), align=st.sampled_from(["", 'objectalignment="center"']))
def test_tileset_in_json_is_that_in_xml(tmp_path: Path, suffix: str, tiles: list[str], align: str) -> None:
    own = "".join(f'<tile id="{k}">{text}</tile>' for k, text in enumerate(tiles))
    tsx = f'<tileset name="t" tilewidth="10" tileheight="10" {align}>{own}</tileset>'
    (tmp_path / "t.tsx").write_text(tsx)
    (tmp_path / f"t{suffix}").write_text(as_json(tsx))
    things = objects('<object id="5" gid="1" x="5" y="20" width="10" height="20"/>')
    layer = '<layer name="ground" width="4" height="3"><data encoding="csv">1,2,3,0,0,1,1,1,0,3,2,1</data></layer>'
    found = []
    for name in ("t.tsx", f"t{suffix}"):
        body = f'<tileset firstgid="1" source="{name}"/>{things}{layer}'
        try:
            level = import_tmx(map_file(tmp_path, body))
        except SceneError as error:  # a property may not fit its shapes
            found.append([(fault.path, fault.message) for fault in error.faults])
        else:
            warnings = [(each.path, each.message) for each in level.warnings]
            found.append([(level.scene, warnings)])
    assert found[0] == found[1]


def test_fault_in_a_json_tileset_names_its_file_and_tile(tmp_path: Path) -> None:
    tsx = f'<tileset tilewidth="10" tileheight="10"><tile id="3">{FULL.replace("10", "1e99")}</tile></tileset>'
    (tmp_path / "t.tsj").write_text(as_json(tsx))
    body = '<tileset firstgid="1" source="t.tsj"/>' + objects('<object id="1" gid="4" x="0" y="9"/>')
    with pytest.raises(SceneError) as caught:
        import_tmx(map_file(tmp_path, body))
    (fault,) = caught.value.faults
    assert "tile#3 object#1: width must be a number" in fault.message


def test_fault_of_a_property_names_the_object_and_its_line(tmp_path: Path) -> None:
    own = '<properties><property name="restitution" type="float" value="1.5"/></properties>'
    body = objects(f'<object id="7" name="a" x="0" y="0" width="4" height="4">{own}</object>')
    path = map_file(tmp_path, body)
    with pytest.raises(SceneError) as caught:
        import_tmx(path)
    (fault,) = caught.value.faults
    assert (fault.file, fault.line, fault.path) == (str(path), 2, "object#7 'a'.restitution")


def test_parts_that_are_not_imported_are_named(tmp_path: Path) -> None:
    body = objects(
        '<object id="1" x="0" y="0" width="4" height="4"/><object id="2" x="1" y="1"><point/></object>'
        '<object id="3" x="0" y="0" width="4" height="4"><text>hi</text></object><object id="4" template="t.tx"/>'
        '<object id="5" x="0" y="0" width="4" height="0"/>'
    )
    text = messages(import_tmx(map_file(tmp_path, body + '<imagelayer name="sky"/>')))
    for part in ("object#2", "object#3: text", "object#4", "object#5: has no area", "imagelayer 'sky'"):
        assert part in text


def test_point_with_a_radius_is_a_circle(tmp_path: Path) -> None:
    radius = '<properties><property name="radius" type="float" value="0.07"/></properties>'
    (post,) = import_tmx(
        map_file(tmp_path, objects(f'<object id="1" x="10" y="10">{radius}<point/></object>'))
    ).scene.posts
    assert (post.position, post.radius) == ((0.1, 0.2), 0.07)


def test_example_runs_and_its_text_loads_as_the_same_scene() -> None:
    level = import_tmx(DATA / "level.tmx")
    assert sandbox.loads(level.text) == level.scene
    assert level.scene.title == "Tiled level"
    assert level.scene.world.gravity == (0.0, -10.0)
    trajectory = sandbox.run(sandbox.loads(level.text, overrides=["world.duration=1"]), "pymunk")
    assert trajectory.status == "ok"
    names = list(trajectory.names)
    assert trajectory.position[-1, names.index("ball"), 1] < trajectory.position[0, names.index("ball"), 1]
