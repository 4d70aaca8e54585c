"""Values in the files of Tiled: numbers, colours, roles and keys in custom properties, checked elements for pytmx."""

import re
import zlib
from base64 import b64decode
from binascii import Error as Base64Error
from collections.abc import Mapping
from xml.etree import ElementTree

from sandbox.echo import short_repr
from sandbox.levels.builder import ROLES, role_of_words
from sandbox.levels.safe_xml import XmlNode

MAX_TILE_SIZE = 1e6
"""Pixels of a tile along each side."""

NUMBER = re.compile(r"\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?\s*", re.ASCII)
_INTEGER = re.compile(r"\s*-?\d{1,12}\s*", re.ASCII)
_POINT = re.compile(r"([^,\s]+),([^,\s]+)")
_OBJECT = ("id", "x", "y", "width", "height", "rotation", "points")
"""Attributes of an object that pytmx gets; it stores each as an attribute of a Python object."""
_ROLE_KEYS = frozenset({"dynamic", "static", "zone", "sensor", "body", "solid", "radius", "thickness"})
"""Properties that are no keys of a scene's table."""


class TiledError(Exception):
    """A part of a map that cannot be imported; `str()` is the reason."""


def number_of(node: XmlNode, key: str, default: float = 0.0) -> float:
    """Return a number of an element.

    Raises:
        TiledError: it is not a number, or beyond 1e16.
    """
    text = node.attributes.get(key)
    if text is None:
        return default
    if not NUMBER.fullmatch(text[:100]) or not abs(float(text)) <= 1e16:
        raise TiledError(f"{key} must be a number, is {short_repr(text)}")
    return float(text)


def integer_of(node: XmlNode, key: str) -> int:
    """Return a whole number of an element.

    Raises:
        TiledError: it is missing, or not a whole number.
    """
    text = node.attributes.get(key, "")
    if not _INTEGER.fullmatch(text):
        raise TiledError(f"{key} must be a whole number, is {short_repr(text)}" if text else f"has no {key}")
    return int(text)


def tile_size_of(node: XmlNode) -> tuple[float, float]:
    """Return the size of the tiles of a map or tileset, pixels."""
    width, height = number_of(node, "tilewidth"), number_of(node, "tileheight")
    if not (0.0 < width <= MAX_TILE_SIZE and 0.0 < height <= MAX_TILE_SIZE):
        raise TiledError(f"tilewidth and tileheight must be greater than 0 and at most {MAX_TILE_SIZE:g}")
    return width, height


def colour_of(text: str | None) -> str | None:
    """Return a colour of Tiled, `#aarrggbb` or `#rrggbb`, as `#rrggbb`; None if it is none."""
    match = re.fullmatch(r"#?(?:[0-9a-fA-F]{2})?([0-9a-fA-F]{6})", text or "")
    return None if match is None else f"#{match[1].lower()}"


def is_true(text: str | None, default: bool) -> bool:
    """Return the value of a property true or false."""
    return default if text is None else text.strip().lower() in ("true", "1", "yes")


def stated_role(properties: Mapping[str, str]) -> str | None:
    """Return the role that the properties `body`, `dynamic`, `static`, `zone` or `sensor` state, or None.

    Raises:
        TiledError: `body` is no role.
    """
    if "body" in properties:
        role = role_of_words(properties["body"])
        if role is None or role == "compound":
            raise TiledError(f"body must be one of {', '.join(ROLES)}; is {short_repr(properties['body'])}")
        return role
    for key, role in (("zone", "zone"), ("sensor", "zone"), ("dynamic", "dynamic"), ("static", "static")):
        if is_true(properties.get(key), False):
            return role
    if is_true(properties.get("dynamic"), True) and is_true(properties.get("static"), True):
        return None
    return "static" if "dynamic" in properties else "dynamic"  # dynamic = false, static = false


def keys_in(properties: Mapping[str, str]) -> dict[str, str]:
    """Return the properties that are keys of a scene's table."""
    return {key: text for key, text in properties.items() if key not in _ROLE_KEYS}


def object_for_pytmx(node: XmlNode) -> ElementTree.Element:
    """Return an object of a map for pytmx, without properties, after checks of its numbers.

    Raises:
        TiledError: a number or a point is not valid.
    """
    for key in ("x", "y", "width", "height", "rotation"):
        number_of(node, key)
    if min(number_of(node, "width"), number_of(node, "height")) < 0.0:
        raise TiledError("width and height must not be negative")
    given = {key: node.attributes[key] for key in _OBJECT if key in node.attributes}
    tree = ElementTree.Element("object", {"id": "0", "name": "", **given})
    tree.attrib.pop("points", None)
    tree.set("id", "0")
    for child in node.children:
        if child.tag in ("polygon", "polyline"):
            text = child.attributes.get("points", "")
            words = [_POINT.fullmatch(word) for word in text.split()]
            if len(words) < 2:
                raise TiledError("must have two or more points")
            for word, pair in zip(text.split(), words, strict=True):
                if pair is None or not all(
                    NUMBER.fullmatch(each) and abs(float(each)) <= 1e16 for each in pair.groups()
                ):
                    raise TiledError(f"the point {short_repr(word)} must be two numbers, such as 16,32")
            ElementTree.SubElement(tree, child.tag, {"points": text})
    return tree


def check_tile_data(text: str, data: XmlNode, count: int) -> None:
    """Refuse data of a tile layer that do not hold `count` tiles, without decompressing more than that.

    Raises:
        TiledError: they do not, or have an encoding that pytmx does not support.
    """
    encoding, compression = data.attributes.get("encoding"), data.attributes.get("compression", "")
    if encoding == "csv":
        words = text.split(",")
        if len(words) != count or not all(_INTEGER.fullmatch(word) and int(word) >= 0 for word in words):
            raise TiledError(f"its data are not {count:,} tiles")
        return
    if encoding != "base64":
        raise TiledError("XML tiles are not supported; set the tile layer format of the map to CSV or Base64")
    if compression not in ("", "zlib", "gzip"):
        raise TiledError(f"the compression {short_repr(compression)} is not supported; use zlib, gzip or none")
    try:
        content = b64decode(text)
        if compression:
            inflater = zlib.decompressobj(wbits=47)  # finds out whether it is zlib or gzip
            content = inflater.decompress(content, 4 * count + 1)
            if not inflater.eof:
                content += b"\0"  # longer than the tiles, or cut off
    except (Base64Error, ValueError, zlib.error):
        raise TiledError("its data cannot be decoded; save the map again") from None
    if len(content) != 4 * count:
        raise TiledError(f"its data are not {count:,} tiles")
