"""Keys that edit the text of a field change that text, and the scene only once it is applied."""

from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from sandbox.scene.editing.elements import ElementKey, all_elements
from sandbox.scene.editing.fields import format_value
from sandbox.window.editor.property_rows import PropertyRow, RowId, is_typed
from sandbox.window.input.clipboard import copy_text, pasted_text
from tests.window.editor.everything import ATTRACTED, EVERYTHING, TABLE
from tests.window.editor.hand import BALL, CTRL, SHIFT, SIZE, Hand, OpenOn
from tests.window.pressing import key, key_up, press, release

pytestmark = pytest.mark.fail_slow(60)  # hundreds of frames

RUSSIAN = dict(zip("axcvzyd", "фчсмянв", strict=True))
SCENE_KEYS = [(letter, mod) for letter in "axcvzyd" for mod in (CTRL, CTRL | SHIFT)]
"""Keys that change the scene, its selection or its clipboard while no field is edited"""


def send(hand: Hand, *events: pygame.event.Event) -> None:
    """Pass events to the window without drawing a picture."""
    for event in events:
        hand.window.handle_event(event)


def visit_fields(hand: Hand) -> Iterator[tuple[RowId, PropertyRow]]:
    """Edit each field of the property panel as text, one after the other by Tab, and yield it."""
    panel, view = hand.view.panel, hand.view
    view._show_panel(SIZE)
    panel._is_open = dict.fromkeys(panel._is_open, True)
    panel._lay_out()
    typed = [item for item in panel._items if item.row is not None and is_typed(item.row)]
    panel._start_editing(typed[0])
    for item in typed:
        assert panel.focused == item.row_id and item.row is not None
        yield item.row_id, item.row
        send(hand, key(pygame.K_TAB), key_up(pygame.K_TAB))


def edit_field(hand: Hand, row: RowId) -> None:
    box = hand.in_view(lambda: hand.view.panel.box_of(*row))
    hand.frame(press(*box.center), release(*box.center))
    assert hand.view.panel.focused == row


def text_of(hand: Hand) -> str:
    editing = hand.view.panel._editing
    assert editing is not None
    return editing.edit.text


@pytest.mark.parametrize("text", [EVERYTHING, ATTRACTED, TABLE])
def test_keys_of_a_text_leave_the_scene_unchanged_in_every_field(open_on: OpenOn, text: str) -> None:
    hand, seen = open_on(text), set[tuple[str, str]]()
    draft, editor = hand.view.draft, hand.editor
    selections = [[each] for each, _ in all_elements(draft.scene) if each.index == 0]
    for selection in ([], *selections):
        editor.selection = list[ElementKey](selection)
        for row, shown in visit_fields(hand):
            value = format_value(shown.spec, shown.value)
            seen.add((row.section.rstrip("0123456789:"), row.field))
            for letter, mod in SCENE_KEYS:
                for code in (letter, RUSSIAN[letter]):
                    send(hand, key(ord(code), mod, scancode=pygame.KSCAN_A + ord(letter) - ord("a")))
            assert (draft.text, draft.undo_label, editor.selection) == (text, None, selection), row
            while text_of(hand) != value:
                send(hand, key(pygame.K_z, CTRL))
            send(hand, key(pygame.K_a, CTRL), key(pygame.K_x, CTRL))
            assert text_of(hand) == "" and (not value or pasted_text() == value), row
            send(hand, key(pygame.K_z, CTRL))
            assert text_of(hand) == value, row
        send(hand, key(pygame.K_ESCAPE))
        assert draft.text == text
    assert len(seen) > (150 if text == EVERYTHING else 40)


def test_value_is_copied_from_field_to_field(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.click((0.0, 2.0))
    edit_field(hand, RowId("selection:ball", "radius"))
    hand.key(pygame.K_c, CTRL)
    edit_field(hand, RowId("selection:ball", "mass"))
    hand.key(pygame.K_v, CTRL)
    hand.key(pygame.K_RETURN)
    assert hand.scene.balls[0].mass == 0.5 and len(hand.scene.balls) == 2
    edit_field(hand, RowId("selection:ball", "mass"))
    hand.key(pygame.K_s, CTRL)  # still saves
    assert "mass = 0.5" in hand.path.read_text()
    hand.click((2.0, 2.0))
    hand.key(pygame.K_x, CTRL)  # without a field, the element
    assert len(hand.scene.balls) == 1


def test_undone_text_of_different_values_is_not_applied(open_on: OpenOn) -> None:
    hand = open_on(BALL)
    hand.key(pygame.K_a, CTRL)
    before = hand.view.draft.text
    edit_field(hand, RowId("selection:ball", "name"))
    hand.frame(pygame.event.Event(pygame.TEXTINPUT, text="x"))
    hand.key(pygame.K_z, CTRL)
    hand.key(pygame.K_RETURN)
    assert hand.view.draft.text == before


def test_path_is_pasted(open_on: OpenOn, tmp_path: Path) -> None:
    hand = open_on(BALL)
    target = tmp_path / "pasted.toml"
    copy_text(f"{target}\n")
    hand.key(pygame.K_s, CTRL | SHIFT)
    hand.key(pygame.K_a, CTRL)
    hand.key(pygame.K_v, CTRL)
    hand.key(pygame.K_RETURN)
    assert target.read_text() == BALL and hand.view.draft.text == BALL


def test_message_says_so_if_there_is_no_clipboard(open_on: OpenOn, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise pygame.error("no owner")

    hand = open_on(BALL)
    hand.click((0.0, 2.0))
    edit_field(hand, RowId("selection:ball", "radius"))
    monkeypatch.setattr(pygame.scrap, "put", refuse)
    hand.key(pygame.K_x, CTRL)
    assert text_of(hand) == "0.5" and "no owner" in hand.messages() and len(hand.scene.balls) == 2
