"""Text of one line: caret, selection, clipboard and undo, on any keyboard layout."""

from collections.abc import Iterator

import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.window.input import clipboard
from sandbox.window.input.clipboard import ClipboardError, copy_text, pasted_text
from sandbox.window.ui.text_edit import SHORTCUTS, TextEdit, is_text_shortcut
from tests.window.pressing import key

CTRL, SHIFT = pygame.KMOD_CTRL, pygame.KMOD_SHIFT


@pytest.fixture(scope="module", autouse=True)
def _screen() -> Iterator[None]:
    """Open a window, as SDL's clipboard needs one."""
    pygame.display.init()
    pygame.display.set_mode((64, 64))
    yield
    pygame.display.quit()


def pressed(edit: TextEdit, *codes: int, mod: int = 0) -> list[bool]:
    return [edit.press(key(code, mod)) for code in codes]


def test_caret_and_selection_of_a_text() -> None:
    edit = TextEdit("abc")
    edit.select_all()
    pressed(edit, pygame.K_LEFT)
    assert (edit.caret, edit.selection) == (0, (0, 0))
    pressed(edit, pygame.K_RIGHT)
    pressed(edit, pygame.K_END, mod=SHIFT)
    assert edit.selection == (1, 3)
    edit.insert("x\n\x00")
    assert (edit.text, edit.caret) == ("ax", 2)
    pressed(edit, pygame.K_DELETE, pygame.K_BACKSPACE, pygame.K_HOME, pygame.K_BACKSPACE)
    assert (edit.text, edit.caret) == ("a", 0)
    pressed(edit, pygame.K_DELETE)
    assert edit.text == ""
    assert pressed(edit, *SHORTCUTS) == [False] * len(SHORTCUTS)


@pytest.mark.parametrize("text", ["0.5", "[1, -2]", "Größe", "мяч", "日本", "🎱 8"])
def test_text_goes_through_the_clipboard(text: str) -> None:
    source, target = TextEdit(f"<{text}>", 1, 1 + len(text)), TextEdit("old")
    assert pressed(source, pygame.K_c, mod=CTRL) == [True]
    assert source.text == f"<{text}>"
    pressed(target, pygame.K_a, pygame.K_v, mod=CTRL)
    assert (target.text, target.selected_text, target.caret) == (text, "", len(text))
    pressed(source, pygame.K_x, mod=CTRL)
    assert source.text == "<>" and pasted_text() == text
    pressed(source, pygame.K_x, pygame.K_c, mod=CTRL)  # nothing is selected
    assert source.text == "<>" and pasted_text() == text


@pytest.mark.parametrize(
    ("copied", "pasted"), [("1.5\n", "1.5"), ("a\tb", "a b"), ("1\r\n2", "1 2"), ("\x1b[1m", "[1m"), ("", "")]
)
def test_pasted_text_is_one_printable_line(copied: str, pasted: str) -> None:
    edit = TextEdit("")
    copy_text(copied)
    pressed(edit, pygame.K_v, mod=CTRL)
    assert edit.text == pasted


def test_text_that_is_not_copied_is_not_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise pygame.error("no owner")

    monkeypatch.setattr(clipboard.pygame.scrap, "put", refuse)
    monkeypatch.setattr(clipboard.pygame.scrap, "get", refuse)
    edit = TextEdit("abc", 3, 0)
    for code in (pygame.K_x, pygame.K_v):
        with pytest.raises(ClipboardError, match="no owner"):
            pressed(edit, code, mod=CTRL)
        assert (edit.text, edit.selection) == ("abc", (0, 3))


def test_typed_letters_are_undone_together_and_other_changes_one_by_one() -> None:
    edit, texts = TextEdit("12", 2, 2), list[str]()
    for letter in "345":
        edit.insert(letter)
    pressed(edit, pygame.K_BACKSPACE, pygame.K_BACKSPACE, pygame.K_HOME)
    edit.insert("0")
    while edit.can_undo:
        texts.append(edit.text)
        pressed(edit, pygame.K_z, mod=CTRL)
    assert (texts, edit.text) == (["0123", "123", "12345"], "12")
    pressed(edit, pygame.K_z, mod=CTRL)
    assert edit.text == "12"
    pressed(edit, pygame.K_z, mod=CTRL | SHIFT)
    pressed(edit, pygame.K_y, pygame.K_y, pygame.K_y, mod=CTRL)
    assert edit.text == "0123"
    pressed(edit, pygame.K_z, mod=CTRL)
    edit.insert("7")
    pressed(edit, pygame.K_y, mod=CTRL)
    assert edit.text == "7123"


CODES = (*SHORTCUTS, pygame.K_LEFT, pygame.K_RIGHT, pygame.K_HOME, pygame.K_END, pygame.K_BACKSPACE, pygame.K_DELETE)
STEPS = st.one_of(
    st.text(max_size=3), st.tuples(st.sampled_from(CODES), st.sampled_from((0, CTRL, SHIFT, CTRL | SHIFT)))
)


@given(st.text("abc", max_size=5), st.lists(STEPS, max_size=25), st.sampled_from((None, 6)))
def test_undo_restores_each_text_and_redo_the_last(
    text: str, steps: list[str | tuple[int, int]], most: int | None
) -> None:
    edit = TextEdit(text, max_length=most)
    for step in steps:
        if isinstance(step, str):
            edit.insert(step)
        else:
            edit.press(key(*step))
        assert 0 <= edit.selection[0] <= edit.selection[1] <= len(edit.text) <= (most or 1000)
    pressed(edit, *[pygame.K_y] * 30, mod=CTRL)
    last = edit.text
    pressed(edit, *[pygame.K_z] * 60, mod=CTRL)
    assert (edit.text, edit.can_undo) == (text, False)
    pressed(edit, *[pygame.K_y] * 60, mod=CTRL)
    assert edit.text == last


@pytest.mark.parametrize("code", SHORTCUTS)
def test_shortcut_is_found_by_its_place_on_a_russian_keyboard_and_not_with_altgr(code: int) -> None:
    letter = "фчсмяня"["axcvzyz".index(chr(code))]
    scancode = pygame.KSCAN_A + code - pygame.K_a
    for mod in (pygame.KMOD_LCTRL, pygame.KMOD_RCTRL | pygame.KMOD_CAPS, pygame.KMOD_LMETA):
        assert is_text_shortcut(key(code, mod))
        assert is_text_shortcut(key(ord(letter), mod, scancode=scancode))
    for mod in (0, SHIFT, pygame.KMOD_LALT, pygame.KMOD_MODE, pygame.KMOD_LCTRL | pygame.KMOD_RALT):
        assert not is_text_shortcut(key(code, mod))
