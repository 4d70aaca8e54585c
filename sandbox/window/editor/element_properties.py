"""Sections of the property panel: the fields of the selected elements, or of the scene."""

from collections.abc import Sequence

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Part
from sandbox.scene.editing.elements import ElementKey, element_at, name_of, table_values
from sandbox.scene.editing.fields import fields_of
from sandbox.window.editor.property_panel import PropertyRow, PropertySection


def property_sections(scene: Scene, selection: Sequence[ElementKey]) -> list[PropertySection]:
    """Return a section for the selected elements of each table; without a selection, those of the scene.

    The key of a section is `selection:TABLE`, `scene`, the heading of a single table, `material:INDEX` or
    `pair:INDEX`.
    """
    if selection:
        tables = dict.fromkeys(key.table for key in selection)
        return [_section_of(scene, table, [key for key in selection if key.table == table]) for table in tables]
    sections = [
        PropertySection("scene", "scene", _rows(type(scene), [scene], ("title", "about"))),
        PropertySection("world", "world", _rows(type(scene.world), [scene.world])),
        PropertySection("solver", "solver", _rows(type(scene.solver), [scene.solver])),
    ]
    for k, material in enumerate(scene.materials):
        rows = _rows(type(material), [material])
        sections.append(PropertySection(f"material {material.name}", f"material:{k}", rows, False, is_removable=True))
    for k, pair in enumerate(scene.pairs):
        title = " and ".join(pair.between)
        sections.append(PropertySection(title, f"pair:{k}", _rows(type(pair), [pair]), False, is_removable=True))
    return sections


def _section_of(scene: Scene, table: str, keys: Sequence[ElementKey]) -> PropertySection:
    """Return the section of the selected elements of a table."""
    title = f"{table} {name_of(scene, keys[0])}" if len(keys) == 1 else f"{len(keys)} × {table}"
    elements = [element_at(scene, key) for key in keys]
    return PropertySection(title, f"selection:{table}", _rows(type(elements[0]), elements))


def _rows(model: type[Part], parts: Sequence[Part], only: tuple[str, ...] = ()) -> tuple[PropertyRow, ...]:
    """Return the rows of the fields that all parts have."""
    values = [table_values(part) for part in parts]
    common = set.intersection(*({spec.key for spec in fields_of(type(part))} for part in parts))
    rows = []
    for spec in fields_of(model):
        if spec.key not in common or (only and spec.key not in only):
            continue
        found = [each.get(spec.key) for each in values]
        is_mixed = any(value != found[0] for value in found)
        rows.append(PropertyRow(spec, None if is_mixed else found[0], is_mixed))
    return tuple(rows)
