"""The style of SVG elements: presentation attributes, `style` attributes and simple selectors of `<style>`."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from sandbox.levels.safe_xml import XmlNode

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
