"""Hostile levels: clear faults, soon, and nothing is fetched, executed or written."""

import base64
import os
import re
import struct
import zlib
from pathlib import Path

import pytest

from sandbox.cli.main import call
from sandbox.levels import import_svg, import_tmx
from sandbox.levels.safe_xml import MAX_XML_DEPTH
from sandbox.scene.errors import SceneError
from tests.levels.drawings import FULL, dynamic, faults_of, imported, map_file, objects, svg, tiles

pytestmark = pytest.mark.fail_slow(60)  # large files

LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE svg [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>'
    '<svg xmlns="http://www.w3.org/2000/svg"><title>&b;</title></svg>'
)
EXTERNAL = (
    '<?xml version="1.0"?><!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
    '<svg xmlns="http://www.w3.org/2000/svg"><title>&x;</title></svg>'
)
PARAMETER = '<!DOCTYPE svg [<!ENTITY % p SYSTEM "http://localhost:9/x.dtd"> %p;]><svg/>'
SKIPPED = '<!DOCTYPE svg SYSTEM "http://localhost:9/x.dtd"><svg><title>&x;</title></svg>'
RECT = '<rect width="5" height="5"/>'


@pytest.mark.parametrize("text", [LAUGHS, EXTERNAL, PARAMETER, SKIPPED])
def test_entities_are_refused(text: str) -> None:
    with pytest.raises(SceneError, match="entities are refused"):
        import_svg(text)


def test_plain_document_type_is_accepted() -> None:
    kind = '<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">'
    assert len(import_svg(kind + svg(RECT)).scene.boxes) == 1


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"", "empty"), (b"\x00\x01\x02\xff\xfe", "UTF-8"), (b"\x1f\x8b\x08\x00", "compressed"),
        ("<svg/>".encode("utf-16"), "UTF-8"), (b"<svg><g></svg>", "well-formed"), (b"<svg/>", "no shape"),
        (b'<svg xmlns="http://example.com/other"/>', "root element"),
    ],
)  # fmt: skip
def test_file_that_is_no_drawing_is_refused(content: bytes, word: str, tmp_path: Path) -> None:
    path = tmp_path / "a.svg"
    path.write_bytes(content)
    with pytest.raises(SceneError) as caught:
        import_svg(path)
    assert word in str(caught.value)
    assert caught.value.faults[0].file == str(path)


def test_missing_file_folder_and_endless_file_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.svg", tmp_path, Path("/dev/zero")):
        with pytest.raises(SceneError, match=r"cannot be read|too large"):
            import_svg(path)


def test_file_size_and_number_of_elements_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SceneError, match="elements"):
        imported("<g/>" * 200_001)
    monkeypatch.setenv("SANDBOX_MAX_FILE_SIZE", "1KB")
    with pytest.raises(SceneError, match="too large"):
        imported(RECT * 100)


def test_number_of_shapes_and_corners_is_bounded() -> None:
    with pytest.raises(SceneError, match="20,000 shapes"):
        imported(RECT * 20_001)
    with pytest.raises(SceneError, match="corners"):
        imported('<path d="M0 0 Q 50 99 99 0z"/>' * 200, tolerance=1e-7)


def test_deeply_nested_groups_are_refused() -> None:
    assert len(imported("<g>" * (MAX_XML_DEPTH - 2) + RECT + "</g>" * (MAX_XML_DEPTH - 2)).scene.boxes) == 1
    for depth in (MAX_XML_DEPTH, 50_000):
        with pytest.raises(SceneError, match="nested"):
            imported("<g>" * depth + RECT + "</g>" * depth)


@pytest.mark.parametrize(
    "body",
    [
        '<g id="a"><use href="#a"/></g>',
        '<use id="a" href="#a"/>',
        '<g id="a"><use href="#b"/></g><g id="b"><use href="#a"/></g>',
        '<symbol id="a"><use href="#a"/></symbol><use href="#a"/>',
    ],
)
def test_recursive_copies_are_refused(body: str) -> None:
    assert "contains this copy itself" in str(faults_of(RECT + body))


def test_copies_of_copies_do_not_explode() -> None:
    levels = "".join(f'<g id="l{k}">' + f'<use href="#l{k - 1}"/>' * 10 + "</g>" for k in range(1, 12))
    with pytest.raises(SceneError, match=r"copies of copies|shapes"):
        imported(f'<rect id="l0" width="5" height="5"/><defs>{levels}</defs><use href="#l11"/>')
    deep = "".join(f'<g id="l{k}">{"<g>" * 80}<use href="#l{k - 1}"/>{"</g>" * 80}</g>' for k in range(1, 12))
    with pytest.raises(SceneError, match="copies of copies"):
        imported(f'<rect id="l0" width="5" height="5"/><defs>{deep}</defs><use href="#l11"/>')
    text = f'<polygon id="p" points="{"0,0 " * 50_000}"/>' + '<use href="#p"/>' * 10_000
    with pytest.raises(SceneError, match=r"path data|corners|copies"):
        imported(text)


@pytest.mark.parametrize("address", ["http://localhost:9/a.svg#x", "other.svg#x", "#none", "", "file:///etc/passwd"])
def test_copies_of_other_files_are_refused(address: str) -> None:
    assert len(faults_of(f'{RECT}<use href="{address}"/>')) == 1


@pytest.mark.parametrize(
    "element",
    [
        '<rect width="nan" height="5"/>', '<rect width="-5" height="5"/>', '<rect width="50%" height="5"/>',
        '<rect x="1e300" width="5" height="5"/>', '<circle r="5" transform="scale(1e200) scale(1e200)"/>',
        '<circle r="5" transform="matrix(1 2 3)"/>', '<polygon points="0,0 1,1 x,2"/>',
        '<polygon points="0,0 9,9 9,0 0,9"/>', '<path d="M 0 0 L 1e999 3 4 4 z"/>', '<path d="L 0 0 5 5"/>',
        '<path d="M0 0 X 5 5"/>', '<path d="M1e308 0 A 1 1 0 0 1 -1e308 0 z"/>',
        f'<path d="M0 0 {"l1 0 " * 50_000}{"z" * 1990}"/>', f'<path d="{"M0 0 l1 0 0 1 z" * 5000}"/>',
        '<rect width="5" height="5" data-body="flying"/>', '<line x2="5" data-body="dynamic"/>',
        '<g data-body="compound"><circle r="5" data-body="zone"/></g>',
        '<line x2="5" stroke="red" stroke-width="wide"/>', '<svg viewBox="0 0 0 0">' + RECT + "</svg>",
        '<svg viewBox="0 0 5 5" preserveAspectRatio="xMaxYMax slice">' + RECT + "</svg>",
        '<rect width="5" height="5" data-mass="-1" data-body="dynamic"/>',
    ],
)  # fmt: skip
def test_invalid_element_is_one_fault_with_its_line(element: str) -> None:
    faults = faults_of(f"{RECT}\n{element}")
    assert [fault.line for fault in faults] == [3]
    assert len(str(faults[0])) < 1500


@pytest.mark.parametrize(
    "attributes",
    ['viewBox="0 0 nan 5"', 'viewBox="1 2"', 'width="x" height="5"', 'transform="scale(x)"', 'data-gravity="down"',
     'data-body="x"'],
)  # fmt: skip
def test_invalid_root_is_a_fault(attributes: str) -> None:
    assert len(faults_of(RECT, attributes)) == 1


@pytest.mark.parametrize(
    "element",
    [
        '<circle r="0"/>', '<rect width="0" height="5"/>', '<line x1="3" x2="3"/>', '<polygon points="1,1 1,1 1,1"/>',
        '<path d="M 5 5"/>', '<path d=""/>', '<rect width="5" height="5" transform="scale(0)"/>',
    ],
)  # fmt: skip
def test_element_without_area_is_left_out_with_a_warning(element: str) -> None:
    for body in (element, dynamic(element)):
        level = imported(RECT + body)
        assert sum(level.counts.values()) == 1
        assert "left out" in str([str(warning) for warning in level.warnings])


def test_names_and_texts_with_control_characters_and_quotes_are_written_safely() -> None:
    label = "a\"b\\c&#10;[[ball]]&#10;radius = 3 '&#x7f;&#x2028;" + "x" * 500
    body = (
        f'<title>{label}</title><rect id="r" inkscape:label="{label.replace(chr(34), "&quot;")}" width="5" height="5"/>'
    )
    level = imported(body)
    assert dict(level.counts) == {"box": 1}
    assert len(level.scene.balls) == 0
    assert level.scene.boxes[0].name is not None
    assert len(level.scene.boxes[0].name) <= 200


def test_scripts_do_nothing_and_are_named() -> None:
    body = f"{RECT}<script>alert(1)</script><rect onclick='alert(1)' width='3' height='3'/>"
    level = imported(body)
    assert dict(level.counts) == {"box": 2}
    assert any("<script>" in warning.message for warning in level.warnings)


TSX = f'<tileset name="t" tilewidth="10" tileheight="10"><tile id="0">{FULL}</tile></tileset>'


@pytest.mark.parametrize(
    "source",
    ["../t.tsx", "../../../../etc/passwd", "/etc/passwd", "C:\\t.tsx", "..\\t.tsx", "http://localhost:9/t.tsx",
     "link.tsx", "missing.tsx", "a" * 300, "file:///etc/passwd", "loop.tsx", "", ".", "sub/../../t.tsx"],
)  # fmt: skip
def test_tileset_outside_of_the_folder_or_missing_is_refused(source: str, tmp_path: Path) -> None:
    folder = tmp_path / "level"
    folder.mkdir()
    (tmp_path / "t.tsx").write_text(TSX)
    (folder / "link.tsx").symlink_to(tmp_path / "t.tsx")
    (folder / "loop.tsx").symlink_to(folder / "loop.tsx")
    body = f'<tileset firstgid="1" source="{source}"/>' + objects('<object id="1" x="0" y="0" width="4" height="4"/>')
    with pytest.raises(SceneError) as caught:
        import_tmx(map_file(folder, body))
    assert [fault.line for fault in caught.value.faults] == [2]


@pytest.mark.parametrize(
    "text",
    ['<tileset firstgid="1" source="t.tsx"/>', "<map/>", "<tileset/>", '<tileset tilewidth="nan" tileheight="5"/>',
     LAUGHS,
     '<tileset tilewidth="1e9" tileheight="1e9"/>', '<tileset tilewidth="9" tileheight="9"><tile id="x"/></tileset>'],
)  # fmt: skip
def test_damaged_or_recursive_tileset_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "t.tsx").write_text(text)
    body = '<tileset firstgid="1" source="t.tsx"/>' + objects('<object id="1" x="0" y="0" width="4" height="4"/>')
    with pytest.raises(SceneError):
        import_tmx(map_file(tmp_path, body))


@pytest.mark.parametrize("suffix", [".tsj", ".json", ".TSJ"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not well-formed JSON"),
        ("[]", "must be an object"),
        ("{}", "is no tileset"),
        ('{"type": "map", "layers": []}', "is no tileset"),
        ('{"type": "tileset"}', "tilewidth"),
        ('{"type": "tileset", "tilewidth": NaN, "tileheight": 9}', "tilewidth"),
        ('{"type": "tileset", "tilewidth": 1e99, "tileheight": 9}', "tilewidth"),
        ('{"type": "tileset", "tilewidth": [9], "tileheight": 9}', "must be a string"),
        ('{"type": "tileset", "tilewidth": 9, "tileheight": 9, "source": "t.tsx"}', "must not name another file"),
        ('{"type": "tileset", "tilewidth": 9, "tileheight": 9, "tiles": {"0": {}}}', "before version 1.2"),
        ('{"type": "tileset", "tilewidth": 9, "tileheight": 9, "tiles": 3}', "must be an array"),
        ('{"type": "tileset", "tilewidth": 9, "tileheight": 9, "tiles": [{}]}', "has no id"),
        ('{"type": "tileset", "tilewidth": 9, "tileheight": 9, "tiles": [{"id": 0.5}]}', "must be a whole number"),
        ("[" * 5000, "nest"),
        ('{"type": "tileset", "tilewidth": 9, "tileheight": 9, "tiles": [{"id": 0, "objectgroup": {"objects": '
         '[{"id": 1, "polygon": [{"x": 1}]}]}}]}', "tiles[0].objectgroup.objects[0].polygon[0].y"),
    ],
)  # fmt: skip
def test_damaged_json_tileset_is_refused(text: str, message: str, suffix: str, tmp_path: Path) -> None:
    (tmp_path / f"t{suffix}").write_text(text)
    body = f'<tileset firstgid="1" source="t{suffix}"/>' + objects('<object id="1" x="0" y="0" width="4" height="4"/>')
    with pytest.raises(SceneError, match=re.escape(message)):
        import_tmx(map_file(tmp_path, body))


BOMB = base64.b64encode(zlib.compress(bytes(100_000_000))).decode()


@pytest.mark.parametrize(
    "data", ["1,2,3", "1," * 20, ",".join(["9" * 5000] * 12), ",".join(["99"] * 12).replace("99", str(2**33))]
)
def test_damaged_tile_data_are_refused(data: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"layer 'ground'"):
        import_tmx(map_file(tmp_path, tiles(data, f'<tile id="0">{FULL}</tile>')))


@pytest.mark.parametrize(
    ("attributes", "data"),
    [
        ('encoding="base64" compression="zlib"', BOMB), ('encoding="base64" compression="zstd"', "AAAA"),
        ('encoding="base64"', base64.b64encode(struct.pack("<3L", 1, 1, 1)).decode()), ('encoding="rot13"', "1"),
        ("", '<tile gid="1"/>'),
    ],
)  # fmt: skip
def test_tile_data_that_cannot_be_decoded_are_refused(attributes: str, data: str, tmp_path: Path) -> None:
    body = tiles("", "").replace('<data encoding="csv"></data>', f"<data {attributes}>{data}</data>")
    with pytest.raises(SceneError, match=r"layer 'ground'"):
        import_tmx(map_file(tmp_path, body))


@pytest.mark.parametrize(
    "element",
    [
        '<object id="1" x="nan" y="0" width="4" height="4"/>',
        '<object id="1" x="0" y="0" width="-4" height="4"/>',
        '<object id="1" x="0" y="0" width="4" height="4" rotation="x"/>',
        '<object id="1" x="0" y="0"><polygon points="0,0 1,x"/></object>',
        '<object id="1" x="0" y="0"><polygon/></object>',
        '<object id="1" x="0" y="0" gid="5" width="4" height="4"/>',
        '<object id="1" x="0" y="0" type="dynamic"><polyline points="0,0 5,5"/></object>',
    ],
)
def test_invalid_object_is_one_fault_with_its_line(element: str, tmp_path: Path) -> None:
    body = objects('<object id="9" x="0" y="0" width="4" height="4"/>\n' + element)
    with pytest.raises(SceneError) as caught:
        import_tmx(map_file(tmp_path, body))
    assert [fault.line for fault in caught.value.faults] == [3]


def test_attributes_with_the_names_of_python_attributes_are_harmless(tmp_path: Path) -> None:
    body = objects(
        '<object id="9" __class__="x" parse_xml="y" properties="z" parent="" x="0" y="0" width="4" height="4"/>'
    )
    assert len(import_tmx(map_file(tmp_path, body)).scene.boxes) == 1


@pytest.mark.parametrize(
    "text",
    [
        "<map/>", '<map orientation="isometric" width="4" height="3" tilewidth="10" tileheight="10"/>',
        '<map width="100000" height="100000" tilewidth="10" tileheight="10"/>',
        '<map width="4" height="3" tilewidth="0" tileheight="10"/>', "<svg/>", "",
    ],
)  # fmt: skip
def test_invalid_map_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "map.tmx"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        import_tmx(path)
    assert len(caught.value.faults) == 1


@pytest.mark.skipif(os.name == "nt", reason="/proc is Linux's")
def test_nothing_is_written_when_a_level_has_faults(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.svg").write_text(svg('<rect width="x" height="5"/>'))
    target = tmp_path / "a.toml"
    assert call(["import", str(tmp_path / "a.svg"), "--to", str(target)]) == 2
    assert not target.exists()
    assert len(list(tmp_path.iterdir())) == 1
    assert "a.svg:2: rect: " in capfd.readouterr().err
