"""Keys of the editor: a table, from which the help page follows."""

from collections.abc import Callable
from typing import NamedTuple

import pygame

from sandbox.scene.editing.transforms import AlignmentSide
from sandbox.window.editor.edit_view import TYPED, EditView
from sandbox.window.editor.toolbar import TOOLS, EditTool
from sandbox.window.input.bindings import ARROWS
from sandbox.window.input.keymap import Command, latin_key
from sandbox.window.ui.help import HelpGroup

ALIGNMENTS: dict[int, tuple[AlignmentSide, AlignmentSide]] = {
    pygame.K_LEFT: ("left", "centre"),
    pygame.K_RIGHT: ("right", "centre"),
    pygame.K_UP: ("top", "middle"),
    pygame.K_DOWN: ("bottom", "middle"),
}
"""Sides, and middles with Shift"""


class EditKey(NamedTuple):
    """Keys of the editor with one action, or use of the mouse, as a line of the help page."""

    label: str
    about: str
    action: Callable[[EditView, int, bool], bool | None] | None = None
    """receives the key and whether Shift is held; returns False if the window is to process the key"""
    plain: tuple[int, ...] = ()
    """keys that act without Ctrl; with Shift as well"""
    control: tuple[int, ...] = ()
    """keys that act with Ctrl; with Shift as well, unless another row has them"""
    control_shift: tuple[int, ...] = ()
    is_global: bool = False
    """whether it acts on file or window: once while it is held, and also in a field, whose value it applies first"""


def _nudge(view: EditView, key: int, shift: bool) -> None:
    step = view.view_scale.grid * (10.0 if shift else 1.0)
    x, y = ARROWS[key]
    view.editor.nudge((x * step, y * step))


def _delete(view: EditView, key: int, _: bool) -> None:
    if not (key == pygame.K_BACKSPACE and view.editor.take_back()):
        view.editor.delete()


def _use_clipboard(view: EditView, key: int, _: bool) -> None:
    if key == pygame.K_v:
        view.editor.paste(view.view_scale)
    else:
        (view.editor.cut if key == pygame.K_x else view.editor.copy)()


def _command(command: Command) -> EditKey:
    """Return the row of a command that the editor shares with the rest of the window."""
    plain, control = (command.keys if command.modifiers == each else () for each in (0, pygame.KMOD_CTRL))
    return EditKey(command.label, command.about, lambda view, *_: view.run(command), plain, control, is_global=True)


_SELECTION = (
    EditKey("Click", "select; again: the element below"),
    EditKey("Shift+click", "add to the selection, or remove from it"),
    EditKey("Drag", "move; on empty ground: select all inside"),
    EditKey("Ctrl+drag", "without snapping"),
    EditKey(
        "Digits",
        "while dragging: dimensions; Enter applies",
        lambda view, *_: view.editor.confirm(),
        (pygame.K_RETURN, pygame.K_KP_ENTER),
    ),
    EditKey("Arrows", "move by the grid; with Shift: ten steps", _nudge, tuple(ARROWS)),
    EditKey(
        "M or Shift+M",
        "mirror left and right, up and down",
        lambda view, _, shift: view.editor.mirror(is_vertical=shift),
        (pygame.K_m,),
    ),
    EditKey(
        "Ctrl+arrows",
        "align sides; with Shift: middles",
        lambda view, key, shift: view.editor.align(ALIGNMENTS[key][shift]),
        control=tuple(ALIGNMENTS),
    ),
    EditKey(
        "PageUp or PageDown",
        "later or earlier in the file: above or below",
        lambda view, key, _: view.editor.reorder(1 if key == pygame.K_PAGEUP else -1),
        (pygame.K_PAGEUP, pygame.K_PAGEDOWN),
    ),
    EditKey("Delete", "delete", _delete, (pygame.K_DELETE, pygame.K_BACKSPACE)),
    EditKey("Ctrl+A", "select all", lambda view, *_: view.editor.select_all(), control=(pygame.K_a,)),
    EditKey(
        "Ctrl+X, Ctrl+C, Ctrl+V",
        "cut, copy, paste; in a field: its text",
        _use_clipboard,
        control=(pygame.K_x, pygame.K_c, pygame.K_v),
    ),
    EditKey("Ctrl+D", "duplicate", lambda view, *_: view.editor.duplicate(view.view_scale), control=(pygame.K_d,)),
)
_SCENE = (
    EditKey(
        "Space or Ctrl+E",
        "run the scene; Ctrl+E returns",
        lambda view, *_: view.leave(),
        (pygame.K_SPACE, pygame.K_p),
        control=(pygame.K_e,),
        is_global=True,
    ),
    EditKey("Ctrl+Z", "undo; in a field: in its text", lambda view, *_: view.editor.undo(), control=(pygame.K_z,)),
    EditKey(
        "Ctrl+Shift+Z",
        "redo",
        lambda view, *_: view.editor.redo(),
        control=(pygame.K_y,),
        control_shift=(pygame.K_z,),
    ),
    EditKey("Ctrl+S", "save", lambda view, *_: view.save(), control=(pygame.K_s,), is_global=True),
    EditKey("Ctrl+Shift+S", "save as", lambda view, *_: view.save(True), control_shift=(pygame.K_s,), is_global=True),
    EditKey(
        "Ctrl+Shift+X",
        "take a preset or generators apart; divide walls at their corners",
        lambda view, *_: view.editor.take_apart(),
        control_shift=(pygame.K_x,),
    ),
    *map(_command, (Command.PICKER, Command.SCREENSHOT, Command.RECORD)),
    EditKey(
        "Esc",
        "cancel; select nothing; quit",
        lambda view, *_: view.editor.cancel(),  # otherwise the window asks whether to quit
        (pygame.K_ESCAPE,),
        is_global=True,
    ),
)
_VIEW = (
    EditKey("Wheel", "zoom at the cursor"),
    EditKey("Right-drag", "pan"),
    _command(Command.HOME)._replace(about="fit the scene", is_global=False),
    *map(_command, (Command.PANEL, Command.FULL_SCREEN, Command.HELP)),
)


def _tool_key(tool: EditTool) -> EditKey:
    return EditKey(tool.key.upper(), tool.about, lambda view, *_: view.editor.choose_tool(tool.name), (ord(tool.key),))


_GROUPS = {"Tools": tuple(map(_tool_key, TOOLS)), "Selection": _SELECTION, "Scene": _SCENE, "View": _VIEW}
HELP_GROUPS = tuple(HelpGroup(title, tuple((row.label, row.about) for row in rows)) for title, rows in _GROUPS.items())
"""Keys of the editor, for the help page."""
_BY_KEY = {
    (key, modifiers): row
    for rows in _GROUPS.values()
    for row in rows
    for modifiers, keys in (
        (0, row.plain),
        (pygame.KMOD_CTRL, row.control),
        (pygame.KMOD_CTRL | pygame.KMOD_SHIFT, row.control_shift),
    )
    for key in keys
}
GLOBAL_KEYS = frozenset(key for (key, _), row in _BY_KEY.items() if row.is_global)
"""keys that act only once while they are held; a held Esc must not clear the selection and then quit"""


def press_key(view: EditView, event: pygame.event.Event) -> bool:
    """Process a key press in the editor; return whether it was consumed."""
    if event.mod & (pygame.KMOD_ALT | pygame.KMOD_META | pygame.KMOD_MODE):
        return True  # Ctrl+Alt may be AltGr, which types characters
    key, shift = latin_key(event), bool(event.mod & pygame.KMOD_SHIFT)
    control = pygame.KMOD_CTRL if event.mod & pygame.KMOD_CTRL else 0
    row = (_BY_KEY.get((key, control | pygame.KMOD_SHIFT)) if shift else None) or _BY_KEY.get((key, control))
    if control:
        if view.panel.has_focus and (row is None or not row.is_global):
            return True
        view.panel.commit()
    elif view.editor.gesture is not None and key in map(ord, TYPED):
        return True  # comes as text, too
    is_used = row is None or row.action is None or row.action(view, key, shift) is not False
    view.note_unsaved()
    return is_used
