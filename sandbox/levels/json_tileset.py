"""Tilesets that Tiled saves as JSON (.tsj, .json), as the elements that it saves of the same tileset as XML (.tsx).

Source: Tiled Documentation, "JSON Map Format": Tileset, Tile, Object, Property.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from sandbox.levels.safe_json import JsonNode
from sandbox.levels.safe_xml import MAX_XML_ELEMENTS, XmlNode

SUFFIXES = (".tsj", ".json")

_MARKS = ("ellipse", "point", "capsule")
"""Kinds of objects that are an element without attributes, and a key with the value true"""
_OUTLINES = ("polygon", "polyline")


def tileset_element(root: JsonNode) -> XmlNode:
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
        tileset.children = [_tile(tile) for tile in tiles.elements()]
    count = sum(1 for _ in _walk(tileset))
    if count > MAX_XML_ELEMENTS:
        root.refuse(f"has {count:,} tiles, objects and properties; the limit is {MAX_XML_ELEMENTS:,}")
    return tileset


def _tile(node: JsonNode) -> XmlNode:
    children = _properties(node)
    group = node.find("objectgroup")
    if group is not None:
        found = group.find("objects")
        objects = [] if found is None else [_object(each) for each in found.elements()]
        children.append(XmlNode("objectgroup", {}, None, objects))
    return XmlNode("tile", _attributes(node, ("id", "type", "class")), None, children)


def _object(node: JsonNode) -> XmlNode:
    """Return a collision shape."""
    keys = ("id", "name", "type", "class", "x", "y", "width", "height", "rotation", "visible", "gid", "template")
    children = _properties(node)
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


def _properties(node: JsonNode) -> list[XmlNode]:
    """Return the element `properties` of a part, if it has properties."""
    found = node.find("properties")
    if found is None:
        return []
    return [XmlNode("properties", {}, None, [_property(each) for each in found.elements()])]


def _property(node: JsonNode) -> XmlNode:
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
