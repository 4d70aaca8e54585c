"""Tilesets of Tiled, in the map or in files beside it, and their tiles with collision shapes.

A file is XML (.tsx) or JSON (.tsj, .json), which is converted to the elements that Tiled saves of the same tileset as
XML. Source: Tiled Documentation, "JSON Map Format": Tileset, Tile, Object, Property.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from sandbox.levels.level_files import read_text
from sandbox.levels.merging import TileRectangle
from sandbox.levels.outlines import Affine
from sandbox.levels.safe_json import JsonNode, read_json
from sandbox.levels.safe_xml import MAX_XML_ELEMENTS, XmlNode, parse_xml
from sandbox.levels.tiled_values import TiledError, integer_of, number_of, tile_size_of
from sandbox.scene.description.base import Point

FLIPPED_X, FLIPPED_Y, FLIPPED_DIAGONALLY = 1 << 31, 1 << 30, 1 << 29
"""Flags of a global tile id: flipped horizontally, vertically, and about the diagonal, which comes first."""
GID_MASK = (1 << 28) - 1
"""Bits of a global tile id without its flags."""

_ALIGNMENTS = {"top": (0.5, 0.0), "left": (0.0, 0.5), "center": (0.5, 0.5), "right": (1.0, 0.5), "bottom": (0.5, 1.0)}
_ALIGNMENTS |= {"topleft": (0.0, 0.0), "topright": (1.0, 0.0), "bottomright": (1.0, 1.0)}


@dataclass
class Tileset:
    """A tileset of a map."""

    file: str
    """file that it was read from"""
    first_gid: int
    """global id of its first tile"""
    size: tuple[float, float]
    """of a tile, pixels"""
    anchor: Point
    """position of a tile object in its rectangle, as fractions of width and height from the upper left"""
    tiles: dict[int, XmlNode] = field(default_factory=dict)
    """tiles with properties or collision shapes, by their id"""


class Tile(NamedTuple):
    """A tile as a map uses it."""

    tileset: Tileset
    node: XmlNode | None
    """None if it has neither properties nor collision shapes"""
    flips: int
    """flags of its global id"""

    @property
    def path(self) -> str:
        """The tile, as messages name it."""
        return "tile" if self.node is None else f"tile#{self.node.attributes['id']}"

    def colliders(self) -> list[XmlNode]:
        """Return its collision shapes."""
        if self.node is None:
            return []
        return [each for group in self.node.find_all("objectgroup") for each in group.find_all("object")]

    def flip(self) -> Affine:
        """Return the map of its pixels, (0, 0) at the upper left, to those of the flipped tile.

        Source: TMX Map Format, "Tile flipping": first about the diagonal, then horizontally, then vertically.
        """
        width, height = self.tileset.size
        found = Affine()
        if self.flips & FLIPPED_DIAGONALLY:
            found = Affine(0.0, 1.0, 1.0, 0.0)
            width, height = height, width
        if self.flips & FLIPPED_X:
            found = Affine(-1.0, 0.0, 0.0, 1.0, width, 0.0).after(found)
        if self.flips & FLIPPED_Y:
            found = Affine(1.0, 0.0, 0.0, -1.0, 0.0, height).after(found)
        return found

    def rectangles(self) -> list[TileRectangle] | None:
        """Return its collision shapes after flips, in pixels, or None if not all of them are upright rectangles."""
        flip, found = self.flip(), []
        for node in self.colliders():
            x, y, width, height = (number_of(node, key) for key in ("x", "y", "width", "height"))
            is_rectangle = all(child.tag == "properties" and not child.children for child in node.children)
            if not is_rectangle or number_of(node, "rotation") != 0.0 or min(width, height) <= 0.0:
                return None
            (ax, ay), (bx, by) = flip.apply(x, y), flip.apply(x + width, y + height)
            found.append(TileRectangle(min(ax, bx), min(ay, by), abs(bx - ax), abs(by - ay)))
        return found


def read_tileset(node: XmlNode, map_file: str) -> Tileset:
    """Return a tileset of a map, from the map or from the file that it names.

    Args:
        node: the element `tileset` of the map.
        map_file: path of the map.

    Raises:
        SceneError: the file cannot be read.
        TiledError: it is not valid, or lies outside of the folder of the map.
    """
    first, file = integer_of(node, "firstgid"), map_file
    if not 0 < first <= GID_MASK:
        raise TiledError(f"firstgid must be between 1 and {GID_MASK}, is {first}")
    if "source" in node.attributes:
        file, node = _tileset_file(node.attributes["source"], Path(map_file))
    anchor = _ALIGNMENTS.get(node.attributes.get("objectalignment", ""), (0.0, 1.0))
    tiles = {integer_of(tile, "id"): tile for tile in node.find_all("tile")}
    return Tileset(file, first, tile_size_of(node), anchor, tiles)


def _tileset_file(source: str, map_path: Path) -> tuple[str, XmlNode]:
    """Return the name and the root element of the file of a tileset."""
    if "\0" in source or re.match(r"[a-zA-Z]:|[\\/]|[a-zA-Z]+://", source):
        raise TiledError("the path of a tileset must be relative to the map")
    folder = map_path.absolute().parent
    try:
        path = (folder / source.replace("\\", "/")).resolve()
        if not path.is_relative_to(folder.resolve()):
            raise TiledError("a tileset must lie in the folder of the map, or in a folder in it; copy it there")
        if not path.is_file():
            raise TiledError("the file of the tileset does not exist")
    except (OSError, RuntimeError):  # the name is too long, or a loop of links
        raise TiledError("the file of the tileset cannot be read") from None
    file = str(map_path.parent / source)
    is_json = path.suffix.lower() in JSON_SUFFIXES
    node = _json_tileset(read_json(path, file)) if is_json else parse_xml(read_text(path, file), file)
    if node.tag != "tileset":
        raise TiledError(f"the root element of its file is <{node.tag}>, not <tileset>; save it as .tsx or .tsj")
    if "source" in node.attributes:
        raise TiledError("the file of a tileset must not name another file")
    return file, node


JSON_SUFFIXES = (".tsj", ".json")

_MARKS = ("ellipse", "point", "capsule")
"""Kinds of objects that are an element without attributes, and a key with the value true"""
_OUTLINES = ("polygon", "polyline")


def _json_tileset(root: JsonNode) -> XmlNode:
    """Return the element `tileset` of a JSON document, with the parts that give collision shapes and properties.

    Args:
        root: the document.

    Raises:
        SceneError: it is no tileset of Tiled 1.2 or later, or a part of it has another type.
    """
    kind = root.find("type")
    if kind is None or kind.text() != "tileset":
        root.refuse('is no tileset of Tiled: its `type` is not "tileset"')
    tileset = XmlNode("tileset", _attributes(root, ("tilewidth", "tileheight", "objectalignment", "source")), None)
    tiles = root.find("tiles")
    if tiles is not None:
        if isinstance(tiles.value, dict):
            tiles.refuse("is an object, as Tiled saved it before version 1.2; save the tileset again")
        tileset.children = [_json_tile(tile) for tile in tiles.elements()]
    count = sum(1 for _ in _walk(tileset))
    if count > MAX_XML_ELEMENTS:
        root.refuse(f"has {count:,} tiles, objects and properties; the limit is {MAX_XML_ELEMENTS:,}")
    return tileset


def _json_tile(node: JsonNode) -> XmlNode:
    children = _json_properties(node)
    group = node.find("objectgroup")
    if group is not None:
        found = group.find("objects")
        objects = [] if found is None else [_json_object(each) for each in found.elements()]
        children.append(XmlNode("objectgroup", {}, None, objects))
    return XmlNode("tile", _attributes(node, ("id", "type", "class")), None, children)


def _json_object(node: JsonNode) -> XmlNode:
    """Return a collision shape."""
    keys = ("id", "name", "type", "class", "x", "y", "width", "height", "rotation", "visible", "gid", "template")
    children = _json_properties(node)
    children += [XmlNode(key, {}, None) for key in _MARKS if _is_set(node, key)]
    for key in _OUTLINES:
        points = node.find(key)
        if points is not None:
            pairs = (f"{_text(each['x'])},{_text(each['y'])}" for each in points.elements())
            children.append(XmlNode(key, {"points": " ".join(pairs)}, None))
    if node.find("text") is not None:
        children.append(XmlNode("text", {}, None))
    attributes = _attributes(node, keys)
    if attributes.get("visible") == "false":
        attributes["visible"] = "0"
    return XmlNode("object", attributes, None, children)


def _is_set(node: JsonNode, key: str) -> bool:
    found = node.find(key)
    return found is not None and found.value is True


def _json_properties(node: JsonNode) -> list[XmlNode]:
    """Return the element `properties` of a part, if it has properties."""
    found = node.find("properties")
    if found is None:
        return []
    return [XmlNode("properties", {}, None, [_json_property(each) for each in found.elements()])]


def _json_property(node: JsonNode) -> XmlNode:
    value, attributes = node.find("value"), _attributes(node, ("name", "type"))
    if value is not None and not isinstance(value.value, Mapping | list):  # these are of the type class or list
        attributes["value"] = _text(value)
    return XmlNode("property", attributes, None)


def _attributes(node: JsonNode, keys: tuple[str, ...]) -> dict[str, str]:
    """Return members of an object as attributes, without those that are missing."""
    found = ((key, node.find(key)) for key in keys)
    return {key: _text(each) for key, each in found if each is not None}


def _text(node: JsonNode) -> str:
    """Return a value as text, as Tiled writes it in XML."""
    value: Any = node.value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    return node.text()


def _walk(node: XmlNode) -> Iterator[XmlNode]:
    yield node
    for child in node.children:
        yield from _walk(child)
