"""Sections of the property panel: the fields of the selected elements, or of the scene."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, cast

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySpec, Part
from sandbox.scene.description.play import Play
from sandbox.scene.description.surface import Floor, Shot
from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.editing.elements import ElementKey, body_names, element_at, elements_of_table, name_of, table_values
from sandbox.scene.editing.fields import fields_of
from sandbox.scene.errors import Location
from sandbox.window.editor.property_rows import PropertyRow, PropertySection

ATTACHED_TABLES = ("drive", "shot", "sensor")
"""Elements without a place of their own, which are shown with their body"""


def property_sections(draft: SceneDraft, selection: Sequence[ElementKey]) -> list[PropertySection]:
    """Return a section for the selected elements of each table; without a selection, those of the scene.

    The key of a section is `selection:TABLE`, `scene`, or the location of a table, such as `world` or `material:3`.
    Tables within tables, such as the parts of a rigid body, have sections of their own.

    Args:
        draft: the scene and its file.
        selection: the selected elements.
    """
    if selection:
        return list(_sections_of_selection(draft.scene, selection))
    preset = draft.preset_table
    if preset is not None:
        return list(_sections_of_preset(draft, *preset))
    return list(_sections_of_scene(draft.scene))


def location_of(section: str) -> Location:
    """Return the location of the table that a section shows; empty for the scene itself."""
    return tuple(int(key) if key.isdecimal() else key for key in section.split(":") if section != "scene")


def _sections_of_selection(scene: Scene, selection: Sequence[ElementKey]) -> Iterator[PropertySection]:
    for table in dict.fromkeys(key.table for key in selection):
        keys = [key for key in selection if key.table == table]
        title = f"{table} {name_of(scene, keys[0])}" if len(keys) == 1 else f"{len(keys)} × {table}"
        elements = [element_at(scene, key) for key in keys]
        yield PropertySection(title, f"selection:{table}", _rows(type(elements[0]), elements))
    if len(selection) != 1:
        return
    (key,) = selection
    yield from _sections_within(key.location, element_at(scene, key), is_open=True)
    names = body_names(scene, key)
    for table in ATTACHED_TABLES:
        for index, element in enumerate(elements_of_table(scene, table)):
            if getattr(element, "body", None) in names or getattr(element, "ball", None) in names:
                other = ElementKey(table, index)
                yield _section(other.location, f"{table} {name_of(scene, other)}", element, True, is_removable=True)


def _sections_of_preset(draft: SceneDraft, heading: str, table: Part) -> Iterator[PropertySection]:
    """Yield the sections of a scene that a preset makes: the tables of its file, whose values take precedence."""
    scene, document = draft.scene, draft.document
    yield PropertySection("scene", "scene", _rows(type(scene), [scene], ("title", "about")))
    yield _section((heading,), heading, table, True)
    yield from _sections_within((heading,), table)
    for key, part in (("world", scene.world), ("solver", scene.solver)):
        stated = document.get(key, {})
        rows = [
            PropertyRow(replace(row.spec, default=getattr(part, row.spec.key)), stated.get(row.spec.key))
            for row in _rows(type(part), [part])
        ]
        yield PropertySection(key, key, tuple(rows))
    if "play" in document:
        play = Play.model_validate_json(json.dumps(document["play"]), by_alias=True)
        yield _section(("play",), "play", play, False)
        yield from _sections_within(("play",), play)
    for k, each in enumerate(document.get("shot", ())):
        shot = Shot.model_validate_json(json.dumps(each), by_alias=True)
        yield _section(("shot", k), f"shot {shot.name or k + 1}", shot, False)


def _sections_of_scene(scene: Scene) -> Iterator[PropertySection]:
    yield PropertySection("scene", "scene", _rows(type(scene), [scene], ("title", "about")))
    yield _section(("world",), "world", scene.world, True)
    yield _section(("solver",), "solver", scene.solver, True)
    if scene.surface is None:
        yield PropertySection("surface (none)", "surface", _rows(Floor, []), False)
    else:
        yield _section(("surface",), "surface", scene.surface, False, is_removable=True)
        yield _section(("contact_models",), "contact models", scene.contact_models, False)
    yield _section(("play",), "play", scene.play, False)
    yield from _sections_within(("play",), scene.play)
    yield PropertySection("materials", "material", (), button="add")
    for k, material in enumerate(scene.materials):
        yield _section(("material", k), f"material {material.name}", material, False, is_removable=True)
    if scene.materials:
        yield PropertySection("pairs of materials", "pair", (), button="add")
    for k, pair in enumerate(scene.pairs):
        yield _section(("pair", k), " and ".join(pair.between), pair, False, is_removable=True)


def _section(
    location: Location, title: str, part: Part, is_open: bool, *, is_removable: bool = False
) -> PropertySection:
    """Return the section of a single table."""
    key, rows = ":".join(map(str, location)), _rows(type(part), [part])
    return PropertySection(title, key, rows, is_open, "remove" if is_removable else "")


def _sections_within(location: Location, part: Part, is_open: bool = False) -> Iterator[PropertySection]:
    """Yield the sections of the tables within a table that are in lists, or of a game."""
    for name, field in type(part).model_fields.items():
        key, value = field.alias or name, getattr(part, name)
        if isinstance(value, tuple) and value and isinstance(value[0], Part):
            for k, each in enumerate(cast("tuple[Part, ...]", value)):
                title = f"{key} {getattr(each, 'name', None) or k + 1}"
                yield _section((*location, key, k), title, each, is_open, is_removable=True)
        elif isinstance(value, Part) and not any(spec.key.startswith(f"{key}.") for spec in fields_of(type(part))):
            yield _section((*location, key), key, value, is_open, is_removable=True)


def _rows(model: type[Part], parts: Sequence[Part], only: tuple[str, ...] = ()) -> tuple[PropertyRow, ...]:
    """Return the rows of the fields that all parts have; of the model without parts. Lists of tables have none."""
    values = [table_values(part) for part in parts]
    rows = []
    for spec in fields_of(model):
        is_list = spec.kind == "other" and not spec.default and not isinstance(spec.default, dict)
        if is_list or (only and spec.key not in only) or not all(_applies(spec.key, part) for part in parts):
            continue
        if all(any(spec.key == other.key for other in fields_of(type(part))) for part in parts):
            found = [_value_of(each, spec.key) for each in values]
            is_mixed = any(value != found[0] for value in found)
            rows.append(PropertyRow(spec, None if is_mixed or not found else found[0], is_mixed))
    return tuple(rows)


def _applies(key: str, part: Part) -> bool:
    """Return whether a field can have a value: bodies that others push have no path and are not one-way."""
    if not isinstance(part, BodySpec):
        return True
    if key.startswith("path."):
        return part.kinematic
    return key != "one_way" or part.kinematic or part.fixed


def _value_of(values: dict[str, Any], key: str) -> Any:
    """Return the value of a field, which may be in a table within the table; None if it is left out."""
    outer, _, inner = key.partition(".")
    value = values.get(outer)
    return value if not inner else value.get(inner) if isinstance(value, dict) else None
