"""Values of SVG attributes and styles: lengths, numbers, transforms, colours, and the properties of CSS.

Texts that are not valid are errors. A style has presentation attributes, rules of `<style>` and `style` attributes.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from sandbox.echo import short_repr
from sandbox.levels.outlines import Affine
from sandbox.levels.safe_xml import XmlNode

_UNITS = {"": 1.0, "px": 1.0, "pt": 4.0 / 3.0, "pc": 16.0, "in": 96.0, "mm": 96.0 / 25.4, "cm": 96.0 / 2.54}
"""User units, at CSS's 96 to the inch."""
_NUMBER_TEXT = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_LENGTH = re.compile(rf"\s*({_NUMBER_TEXT})\s*([a-zA-Z%]*)\s*", re.ASCII)
_WORDS = re.compile(rf"{_NUMBER_TEXT}(?=[\s,+\-.]|\Z)|[^\s,]+", re.ASCII)
_TRANSFORM = re.compile(r"[\s,]*(matrix|translate|scale|rotate|skewX|skewY)\s*\(([^()]*)\)", re.ASCII)
_ARGUMENTS = {"matrix": (6,), "translate": (1, 2), "scale": (1, 2), "rotate": (1, 3), "skewX": (1,), "skewY": (1,)}
_HAS_COLOUR = re.compile(r"black|#[0-9a-f]{3,8}\Z|(?:rgb|hsl)a?\(", re.IGNORECASE)
"""Texts for which black is the colour that they name, and not the library's answer to an unknown one."""


class ElementError(Exception):
    """An element that cannot be imported; `str()` is the reason."""


class EmptyElementError(Exception):
    """An element that draws nothing; `str()` is the reason."""


def parse_length(text: str, key: str) -> float:
    """Return a length in user units.

    Raises:
        ElementError: the text is no length, or has a unit that depends on the page or the font.
    """
    match = _LENGTH.fullmatch(text[:100])
    if match is None:
        raise ElementError(f"{key} must be a number, is {short_repr(text)}")
    unit = match[2].lower()
    if unit not in _UNITS:
        raise ElementError(f"{key}: the unit {short_repr(match[2])} is not supported; use px, mm, cm, in, pt or pc")
    value = float(match[1]) * _UNITS[unit]
    if not math.isfinite(value):
        raise ElementError(f"{key} is too large: {short_repr(text)}")
    return value


def parse_numbers(text: str, counts: tuple[int, ...] = ()) -> tuple[float, ...]:
    """Return numbers that are separated by blanks or commas.

    Args:
        text: the numbers.
        counts: valid numbers of them; default: any.

    Raises:
        ElementError: a word is not a finite number, or their number is not valid.
    """
    values = []
    for word in _WORDS.findall(text):
        match = _LENGTH.fullmatch(word)
        value = float(match[1]) if match is not None and not match[2] else math.nan
        if not math.isfinite(value):
            raise ElementError(f"{short_repr(word)} is not a number, or too large")
        values.append(value)
    if counts and len(values) not in counts:
        raise ElementError(f"{short_repr(text)} must have {' or '.join(map(str, counts))} numbers, has {len(values)}")
    return tuple(values)


def length_of(node: XmlNode, key: str, default: float) -> float:
    """Return a length of an element in user units."""
    text = node.attributes.get(key)
    return default if text is None else parse_length(text, key)


def size_of(node: XmlNode, key: str) -> float:
    """Return a length of an element that must not be negative, 0 if it is left out."""
    length = length_of(node, key, 0.0)
    if length < 0.0:
        raise ElementError(f"{key} must not be negative, is {length:g}")
    return length


def transform_of(node: XmlNode) -> Affine:
    """Return the `transform` of an element.

    Raises:
        ElementError: it is not valid SVG 1.1.
    """
    text = node.attributes.get("transform", "").strip()
    if not text or text == "none":
        return Affine()
    from svgelements import Matrix

    position = 0
    for part in _TRANSFORM.finditer(text):
        if part.start() != position:
            break
        position = part.end()
        parse_numbers(part[2], _ARGUMENTS[part[1]])
    if text[position:].strip(" ,\t\r\n"):
        raise ElementError(
            f"transform {short_repr(text)} is not supported; use matrix, translate, scale, rotate, skewX, skewY"
        )
    matrix = Matrix(text)
    return Affine(*(float(getattr(matrix, key)) for key in "abcdef"))


def parse_viewport(node: XmlNode, sized: XmlNode) -> Affine:
    """Return the map of a nested `<svg>`, or of a `<symbol>` that is as large as the `<use>` that copies it.

    Source: SVG 2, section 8.2, for `preserveAspectRatio` at its default, or `none`.

    Args:
        node: the element with the `viewBox`.
        sized: the element with the size.
    """
    shift = Affine(e=length_of(node, "x", 0.0), f=length_of(node, "y", 0.0)) if node is sized else Affine()
    view = node.attributes.get("viewBox")
    if view is None:
        return shift
    x, y, width, height = parse_numbers(view, (4,))
    if min(width, height) <= 0.0:
        raise ElementError("viewBox must have a width and a height greater than 0")
    across = length_of(sized, "width", length_of(node, "width", width))
    up = length_of(sized, "height", length_of(node, "height", height))
    sx, sy = across / width, up / height
    ratio = node.attributes.get("preserveAspectRatio", "xMidYMid").strip()
    if ratio not in ("none", "xMidYMid", "xMidYMid meet"):
        raise ElementError(f"preserveAspectRatio {short_repr(ratio)} is not supported; use xMidYMid or none")
    if ratio != "none":
        sx = sy = min(sx, sy)
    centred = Affine(sx, 0.0, 0.0, sy, 0.5 * (across - width * sx) - x * sx, 0.5 * (up - height * sy) - y * sy)
    return shift.after(centred)


def parse_colour(text: str) -> str | None:
    """Return a colour as `#rrggbb`; None if it is unknown."""
    from svgelements import Color

    try:
        value = Color(text[:100]).value
    except (ValueError, TypeError, IndexError, OverflowError):
        return None
    if value is None:
        return None
    found = f"#{value >> 8 & 0xFFFFFF:06x}"
    return None if found == "#000000" and not _HAS_COLOUR.match(text) else found


INHERITED = ("fill", "stroke", "stroke-width", "fill-rule", "color", "visibility")
"""Properties that elements inherit from the groups around them."""
IGNORED = ("clip-path", "mask", "filter", "marker-start", "marker-mid", "marker-end")
"""Properties that change what is seen, and not the imported shape."""
_PROPERTIES = frozenset((*INHERITED, *IGNORED, "display"))
MAX_CLASSES = 20
"""Classes of an element that count."""
_SELECTOR = re.compile(r"\*|(?P<tag>[\w-]+)?(?P<mark>[.#])?(?P<name>(?<=[.#])[\w-]+)?")
_DEFAULTS = {"fill": "", "stroke": "none", "stroke-width": "1", "fill-rule": "nonzero", "visibility": "visible"}
"""Initial values; an empty `fill` is black, and was not chosen by the author."""


@dataclass
class StyleSheet:
    """Rules of the `<style>` elements of a drawing: declarations by selector."""

    rules: dict[str, dict[str, str]] = field(default_factory=dict)
    unsupported: list[str] = field(default_factory=list)
    """selectors other than `*`, `tag`, `.class`, `tag.class` and `#id`"""

    def add(self, text: str) -> None:
        """Add the rules of a `<style>` element."""
        for block in re.sub(r"/\*.*?(?:\*/|\Z)", "", text, flags=re.DOTALL).split("}"):
            selectors, brace, body = block.partition("{")
            for selector in selectors.split(",") if brace else ():
                name = selector.strip()
                if _SELECTOR.fullmatch(name) and name:
                    self.rules.setdefault(name, {}).update(declarations(body))
                else:
                    self.unsupported.append(name)

    def of(self, node: XmlNode) -> dict[str, str]:
        """Return the properties of an element itself: attributes, then rules, then its `style`, later ones win."""
        found = {key: value.strip() for key, value in node.attributes.items() if key in _PROPERTIES}
        if self.rules:
            classes = node.attributes.get("class", "").split()[:MAX_CLASSES]
            selectors = ["*", node.tag, *(f".{each}" for each in classes), *(f"{node.tag}.{each}" for each in classes)]
            for selector in (*selectors, f"#{node.attributes.get('id', '')}"):
                found |= self.rules.get(selector, {})
        return found | declarations(node.attributes.get("style", ""))


def declarations(text: str) -> dict[str, str]:
    """Return the properties of a text such as `fill: red; stroke: none` that matter here."""
    pairs = (each.partition(":") for each in text.split(";"))
    found = ((key.strip().lower(), value.replace("!important", "").strip()) for key, _, value in pairs)
    return {key: value for key, value in found if key in _PROPERTIES and value}


def inherit(outer: Mapping[str, str], own: Mapping[str, str]) -> dict[str, str]:
    """Return the style of an element: its own properties, and those that it inherits."""
    style = {key: outer[key] for key in INHERITED if key in outer} or dict(_DEFAULTS)
    return style | {key: value for key, value in own.items() if value != "inherit"}
