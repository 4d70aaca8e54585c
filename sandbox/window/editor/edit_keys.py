"""Keys of the editor, and their list for the help page."""

import pygame

from sandbox.scene.editing.transforms import AlignmentSide
from sandbox.window.editor.toolbar import TOOLS
from sandbox.window.input.keymap import Command
from sandbox.window.ui.help import HelpGroup

ARROWS = {pygame.K_LEFT: (-1, 0), pygame.K_RIGHT: (1, 0), pygame.K_UP: (0, 1), pygame.K_DOWN: (0, -1)}
ALIGNMENTS: dict[int, AlignmentSide] = {
    pygame.K_LEFT: "left",
    pygame.K_RIGHT: "right",
    pygame.K_UP: "top",
    pygame.K_DOWN: "bottom",
}
TYPED = "0123456789.,-x "
"""Characters that are typed into the dimensions of a gesture"""
DELEGATED = {
    pygame.K_HOME: Command.HOME,
    pygame.K_TAB: Command.PANEL,
    pygame.K_F1: Command.HELP,
    pygame.K_h: Command.HELP,
    pygame.K_F11: Command.FULL_SCREEN,
}
DELEGATED_WITH_CONTROL = {
    pygame.K_p: Command.SCREENSHOT,
    pygame.K_r: Command.RECORD,
    pygame.K_o: Command.PICKER,
}
KEPT_IN_FIELDS = frozenset({pygame.K_e, pygame.K_s, *DELEGATED_WITH_CONTROL})
"""keys that act with Ctrl while a field is edited, whose value they apply first; others would change the scene"""
HELP_GROUPS = (
    HelpGroup("Tools", tuple((tool.key.upper(), tool.about) for tool in TOOLS)),
    HelpGroup(
        "Selection",
        (
            ("Click", "select; again: the element below"),
            ("Shift+click", "add to the selection, or remove from it"),
            ("Drag", "move; on empty ground: select all inside"),
            ("Ctrl+drag", "without snapping"),
            ("Digits", "while dragging: dimensions; Enter applies"),
            ("Arrows", "move by the grid; with Shift: ten steps"),
            ("M or Shift+M", "mirror left and right, up and down"),
            ("Ctrl+arrows", "align sides; with Shift: middles"),
            ("PageUp or PageDown", "later or earlier in the file: above or below"),
            ("Delete", "delete"),
            ("Ctrl+A", "select all"),
            ("Ctrl+X, Ctrl+C, Ctrl+V", "cut, copy, paste; in a field: its text"),
            ("Ctrl+D", "duplicate"),
        ),
    ),
    HelpGroup(
        "Scene",
        (
            ("Space or Ctrl+E", "run the scene; Ctrl+E returns"),
            ("Ctrl+Z", "undo; in a field: in its text"),
            ("Ctrl+Shift+Z", "redo"),
            ("Ctrl+S", "save"),
            ("Ctrl+Shift+S", "save as"),
            ("Ctrl+Shift+X", "take a preset or generators apart; divide walls at their corners"),
            ("Ctrl+O", "open a scene"),
            ("Ctrl+P", "screenshot"),
            ("Esc", "cancel; select nothing; quit"),
        ),
    ),
    HelpGroup(
        "View",
        (
            ("Wheel", "zoom at the cursor"),
            ("Right-drag", "pan"),
            ("Home", "fit the scene"),
            ("Tab", "show or hide the panel"),
            ("F11", "full screen"),
            ("F1 or H", "this help"),
        ),
    ),
)
"""Keys of edit mode, for the help page."""
