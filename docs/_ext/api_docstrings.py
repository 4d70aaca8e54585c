"""Sphinx extension: signatures of pydantic models, names of type aliases, and docstrings of attributes as they are.

Napoleon takes what stands before a colon in the docstring of an attribute or property for its type; here it is a part
of the sentence.
"""

import re
from typing import Any

from docutils import nodes
from pydantic import BaseModel
from sphinx import addnodes

ATTRIBUTES = ("attribute", "data", "property")
BEFORE, AFTER = 400, 600
"""priorities, between which the 500 of napoleon and autodoc lies"""
ALIASES = (
    (re.compile(r"~?(numpy\.)?ndarray\[.*?dtype\[~?(numpy\.)?float64\]\]"), "FloatArray"),
    (re.compile(r"~?(numpy\.)?ndarray\[.*?dtype\[~?(numpy\.)?int\d+\]\]"), "IntArray"),
    (re.compile(r"~?(numpy\.)?ndarray\[.*?dtype\[~?(numpy\.)?bool\w*\]\]"), "BoolArray"),
    (re.compile(r"~?(numpy\.)?ndarray\[.*?dtype\[~?(numpy\.)?str_\]\]"), "StrArray"),
    (re.compile(r"^(.*Callable\[.*?\], )\S*_(?:Buffer|typing).*\]$"), r"\1ArrayLike]"),
    (re.compile(r"~?(typing\.)?Union\[~?numpy\._typing.*\]"), "ArrayLike"),
    (re.compile(r"~?(typing\.)?Annotated\[.*discriminator='kind'\)\]"), "Action"),
)
"""Type aliases that Python spells out."""


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    kept: dict[str, list[str]] = {}

    def keep(_: Any, what: str, name: str, __: Any, ___: Any, lines: list[str]) -> None:
        if what in ATTRIBUTES:
            kept[name] = list(lines)

    def restore(_: Any, what: str, name: str, __: Any, ___: Any, lines: list[str]) -> None:
        if what in ATTRIBUTES:
            lines[:] = kept.pop(name)

    app.connect("autodoc-process-docstring", keep, priority=BEFORE)
    app.connect("autodoc-process-docstring", restore, priority=AFTER)
    app.connect("autodoc-process-signature", _signature, priority=BEFORE)
    app.connect("object-description-transform", _name_aliases, priority=BEFORE)
    app.connect("doctree-read", _name_attribute_aliases)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _signature(_: Any, what: str, __: str, value: Any, *___: Any) -> tuple[str, str] | None:
    """Return the signature of a model: its fields stand in a table of their own."""
    is_model = what == "class" and isinstance(value, type) and issubclass(value, BaseModel)
    return ("(**fields)", "") if is_model else None


def _named(text: str) -> str:
    for pattern, name in ALIASES:
        text = pattern.sub(name, text)
    return text


def _name_aliases(app: Any, *_: Any) -> None:
    """Name the aliases in the types of parameters, before autodoc writes these down."""
    for types in app.env.current_document.autodoc_annotations.values():
        for name, text in types.items():
            types[name] = _named(text)


def _name_attribute_aliases(_: Any, doctree: nodes.document) -> None:
    """Name the aliases in the types that stand beside attributes."""
    for node in doctree.findall(addnodes.desc_annotation):
        text = node.astext()
        if _named(text) != text:
            node.children = [nodes.Text(_named(text))]
