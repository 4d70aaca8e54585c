"""Markup: HTML that is put together so that a text can never become part of it."""

import html
import json
import re
from typing import Any

VOID = frozenset(
    {"br", "circle", "col", "hr", "img", "input", "line", "link", "meta", "path", "polyline", "rect", "use"}
)
"""Elements without a content: those of HTML that have none, and shapes of SVG where there is nothing to put in."""
_UNPRINTED = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ufffe\uffff]")


class Markup(str):
    """What is HTML already; every other text is escaped where it is put in."""

    __slots__ = ()


Child = str | Markup | None
Attribute = str | float | bool | None


def escaped(text: str) -> Markup:
    """Return a text as HTML that shows it, in content and in attributes alike.

    Control characters, which HTML cannot hold, and halves of surrogate pairs become a replacement character.
    """
    if isinstance(text, Markup):
        return text
    sound = text.encode("utf-8", "replace").decode("utf-8")
    return Markup(html.escape(_UNPRINTED.sub("\N{REPLACEMENT CHARACTER}", sound), quote=True))


def tag(name: str, *children: Child, **attributes: Attribute) -> Markup:
    """Return an element.

    Args:
        name: of the element.
        children: texts, which are escaped, and markup, which is not; None is left out.
        attributes: `class_` is `class`, other underscores are hyphens; True is a bare attribute, False and None none.
    """
    parts = [name]
    for key, value in attributes.items():
        if value is None or value is False:
            continue
        written = key.rstrip("_").replace("_", "-")
        if value is True:
            parts.append(written)
        else:
            text = f"{value:.6g}" if isinstance(value, float) else str(value)
            parts.append(f'{written}="{escaped(text)}"')
    opening = " ".join(parts)
    if not children and name in VOID:
        return (
            Markup(f"<{opening}/>")
            if name not in {"br", "hr", "img", "input", "link", "meta"}
            else Markup(f"<{opening}>")
        )
    return Markup(f"<{opening}>{joined(*children)}</{name}>")


def joined(*children: Child) -> Markup:
    """Return texts and markup one after the other."""
    return Markup("".join(escaped(child) for child in children if child is not None))


def named(text: str) -> Markup:
    """Return a text of the user's, isolated: one that is written from right to left turns nothing around it."""
    return tag("bdi", text)


def data(document: Any, **attributes: Attribute) -> Markup:
    """Return a JSON document as an element that scripts can read and that nothing in it can end.

    Raises:
        ValueError: a number is not finite.
    """
    text = json.dumps(document, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return tag("script", Markup(text), type="application/json", **attributes)
