"""Interface of the input of a game in the window, where keys that set controls do not suffice.

`GameSpec.window` names an implementation. It acts on the game through its `GameHost`.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

import pygame

from sandbox.window.playback.snapshot import Snapshot


class ControlBindings(NamedTuple):
    """Keys that a game binds in the window."""

    pressed: Mapping[int, Callable[[], object]]
    """handlers of presses by pygame key code; they may raise `ActionError`"""
    released: Mapping[int, Callable[[], object]]
    """handlers of releases by pygame key code"""
    help_rows: tuple[tuple[str, str], ...]
    """(keys, action) for the help page"""


class GameParameter(NamedTuple):
    """Choice in the side panel that restarts the game."""

    key: str
    label: str
    value: str
    choices: tuple[str, ...]


class GameHud(Protocol):
    """Head-up display of a game in place of the score panel. Lengths are in px."""

    def draw(self, surface: pygame.Surface, free: pygame.Rect, left: int, ui_scale: float) -> None:
        """Draw it.

        Args:
            surface: target.
            free: free area.
            left: right edge of the status plate at the upper left.
            ui_scale: UI scale, 1 on a display of 1080 lines.
        """

    def reserved(self, free: pygame.Rect, left: int, ui_scale: float) -> list[pygame.Rect]:
        """Return the rectangles of its plates, also of those that are hidden now; arguments as for `draw`."""

    def plates(self, free: pygame.Rect, ui_scale: float) -> dict[str, pygame.Rect]:
        """Return the rectangles of its plates as last drawn, by name."""

    def handle_event(self, event: pygame.event.Event, run: Callable[[Callable[[], object]], bool]) -> bool:
        """Handle a mouse event; return whether it was used. `run` calls a handler that may raise `ActionError`."""


class GameControls(Protocol):
    """Input of a game in the window, for games that need more than the keys of `Rules.controls`.

    Positions are in m. The mouse handlers may raise `ActionError`, whose text is shown as a warning.
    """

    @property
    def hint(self) -> str:
        """Message at the start: how to play."""

    @property
    def hud(self) -> GameHud:
        """Its head-up display."""

    @property
    def drag_refusal(self) -> str | None:
        """Reason why the mouse may not drag bodies now; None if it may."""

    @property
    def is_own_score(self) -> bool:
        """Whether the final score is that of a player at the window, and may enter the high scores."""

    def bindings(self) -> ControlBindings:
        """Return the key bindings; called once."""

    def press(self, position: tuple[float, float], tolerance: float) -> bool:
        """Handle a press of the left button; return whether it is used. `tolerance` for hits is in m."""

    def move(
        self,
        before: tuple[float, float],
        now: tuple[float, float],
        pixels: tuple[float, float],
        fine: bool,
        time: float,
    ) -> None:
        """Handle a movement of the mouse.

        Args:
            before: previous position.
            now: present position.
            pixels: movement to the right and downwards, px at UI scale 1.
            fine: whether Shift is held.
            time: s, of the event.
        """

    def release(self, position: tuple[float, float], moved: bool, picked: int | None) -> None:
        """Handle a release of the left button; `moved` if it was no click, `picked` is the index of a clicked body."""

    def update(self, elapsed: float) -> None:
        """Advance animations and bots by an interval of real time, s; it may raise `ActionError`."""

    def messages(self) -> list[tuple[str, str]]:
        """Return (level, text) of the messages since the last call."""

    def parameters(self) -> tuple[GameParameter, ...]:
        """Return the choices for the side panel. A changed one is among the options of the restarted game."""

    def annotate(self, snapshot: Snapshot) -> Snapshot:
        """Return a `Snapshot` with the values that the view of the game draws."""

    def close(self) -> None:
        """Release resources, such as threads."""
