"""Law of the property panel: setting the shown value of a field again changes nothing, and undo restores the text."""

from collections.abc import Iterator
from typing import Any

import pytest

from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.editing.elements import ElementKey, all_elements
from sandbox.scene.editing.fields import format_value, parse
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.editor.editor import Editor
from sandbox.window.editor.element_properties import location_of, property_sections
from sandbox.window.editor.property_rows import PropertyRow, PropertySection
from tests.samples import each_shipped_scene

pytestmark = pytest.mark.fail_slow(60)  # thousands of changes

ELEMENTS_OF_A_TABLE = 2
"""Elements of each table whose fields are set"""


def select_each(editor: Editor) -> Iterator[None]:
    """Select nothing, which shows the scene, and then each of the first elements of each table."""
    keys = () if editor.is_locked else tuple(key for key, _ in all_elements(editor.draft.scene))
    selections: list[list[ElementKey]] = [[], *([key] for key in keys if key.index < ELEMENTS_OF_A_TABLE)]
    for editor.selection in selections:
        yield


def sections_of(editor: Editor) -> list[PropertySection]:
    return property_sections(editor.draft, editor.selection)


def shown_rows(editor: Editor) -> Iterator[tuple[str, PropertyRow]]:
    """Yield the key of the section and each row with a value that can be edited, of one section of each kind."""
    shown = set[tuple[str, ...]]()
    for section in sections_of(editor):
        kind = tuple(key for key in section.key.split(":") if not key.isdecimal())
        if kind not in shown:
            shown.add(kind)
            yield from ((section.key, row) for row in section.rows if row.value is not None)


def set_value(editor: Editor, section: str, field: str, value: Any) -> str | None:
    """Set a field as the property panel does; return the message of a fault, or None."""
    if section.startswith("selection:"):
        return editor.set_property(editor.selection, field, value)
    return editor.set_value(location_of(section), field, value)


@pytest.mark.parametrize("name", each_shipped_scene())
def test_fields_set_again_cleared_or_removed_are_undone(name: str) -> None:
    messages = list[str]()
    editor = Editor(SceneDraft.read(find(name)), lambda text, _: messages.append(text))
    draft, text, scene = editor.draft, editor.draft.text, editor.draft.scene

    def undo(what: object) -> None:
        assert sections_of(editor), what
        if draft.undo_label is not None:
            editor.undo()
        assert draft.text == text, what

    for _ in select_each(editor):
        for section, row in shown_rows(editor):
            if row.spec.kind != "other":
                value = parse(row.spec, format_value(row.spec, row.value))
                assert set_value(editor, section, row.spec.key, value) is None, (section, row)
                assert draft.scene == scene, (section, row)
                undo((section, row))
            if not row.spec.is_required:
                fault = set_value(editor, section, row.spec.key, None)
                assert fault is None or draft.text == text, (section, row)
                undo((section, row))
        for heading in sections_of(editor):
            messages.clear()
            if heading.button == "remove":
                editor.remove_table(location_of(heading.key))
            elif heading.button == "add":
                editor.add_material() if heading.key == "material" else editor.add_pair()
            assert heading.button == "" or draft.text != text or messages, heading.title
            assert not any("edit it by hand" in message for message in messages), (heading.title, messages)
            undo(heading.title)
