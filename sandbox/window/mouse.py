"""Mouse controller: zoom, pan, selecting and dragging bodies, and the mouse input of games.

A press only selects a body, so that it can be inspected; a drag starts once the mouse has moved farther than a click
allows.
"""

import math
from collections.abc import Callable

import pygame

from sandbox.window.context import WindowContext
from sandbox.window.game_controls import GameControls

ZOOM_PER_NOTCH = 1.15
"""zoom factor of one notch of the wheel"""
MAX_NOTCHES = 100.0
"""limit of the notches used per wheel event; fewer already zoom from one limit to the other"""
PICK_TOLERANCE = 6.0
"""px at UI scale 1, distance beside a body within which a press still selects it"""
CLICK_TOLERANCE = 4.0
"""px at UI scale 1 that the mouse may move between press and release of a click"""


class MouseController:
    """Handles the mouse events that the GUI did not consume."""

    def __init__(self, context: WindowContext) -> None:
        self._context = context
        self._panning = False
        self._pressed: tuple[int, int] | None = None  # px, press on a body that is not dragged yet
        self._began: tuple[int, int] | None = None  # px, press of the left button
        self._drag: tuple[int, int] | None = None  # px, latest target of the dragged body
        self.position: tuple[int, int] | None = None
        """px; None before the first mouse event"""

    @property
    def is_panning(self) -> bool:
        """Whether the view is being dragged."""
        return self._panning

    def handle_event(self, event: pygame.event.Event) -> None:
        """Handle an event."""
        context = self._context
        if event.type == pygame.MOUSEWHEEL:
            notches = getattr(event, "precise_y", 0.0) or float(event.y)
            notches = min(max(notches, -MAX_NOTCHES), MAX_NOTCHES)
            context.camera = context.camera.zoomed(ZOOM_PER_NOTCH**notches, pygame.mouse.get_pos())
            context.is_fitted = False
            if context.following == "all":
                context.following = None
        elif event.type == pygame.MOUSEBUTTONDOWN:
            self.position = event.pos
            if event.button in (2, 3):
                self._panning = True
            elif event.button == 1:
                self._press(event.pos)
        elif event.type == pygame.MOUSEMOTION:
            self._move(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            if event.button in (2, 3):
                self._panning = False
            elif event.button == 1:
                self._release(event.pos)
        elif event.type == pygame.WINDOWFOCUSLOST:  # another window receives the release
            self.release_all()

    def _press(self, pixel: tuple[int, int]) -> None:
        context, app_state = self._context, self._context.app_state
        position = context.camera.to_world(pixel)
        tolerance = PICK_TOLERANCE * context.gui.ui_scale / context.camera.scale
        self._began = pixel
        if self._use_controls(lambda controls: controls.press(position, tolerance)):
            return
        view = app_state.view
        found = view is not None and app_state.body_tools.pick(view, position, tolerance)
        self._pressed = pixel if found else None

    def _use_controls(self, handle: Callable[[GameControls], bool | None]) -> bool:
        """Pass mouse input to the controls of the game, if any; return whether they used or refused it."""
        controls = self._context.app_state.controls
        if controls is None:
            return False
        used: bool | None = True  # remains so for a refused input, which adds a message

        def run() -> None:
            nonlocal used
            used = handle(controls)

        self._context.app_state.run_handler(run)
        return used is not False

    def _release(self, pixel: tuple[int, int]) -> None:
        context, began = self._context, self._began
        moved = began is not None and math.dist(began, pixel) > CLICK_TOLERANCE * context.gui.ui_scale
        self._began = None
        picked = context.app_state.body_tools.picked if self._pressed is not None and not moved else None
        if began is not None:
            self._use_controls(lambda controls: controls.release(context.camera.to_world(pixel), moved, picked))
        self._end_drag()

    def _move(self, event: pygame.event.Event) -> None:
        context, app_state, tools = self._context, self._context.app_state, self._context.app_state.body_tools
        before, self.position = self.position, event.pos
        if not self._panning and not tools.is_holding and self._pressed is None:
            self._move_controls(event.pos if before is None else before, event.pos)
        if self._panning:
            context.camera = context.camera.panned(event.rel)
            context.is_fitted, context.following = False, None
            return
        if self._pressed is not None and math.dist(self._pressed, event.pos) > CLICK_TOLERANCE * context.gui.ui_scale:
            self._pressed = None
            refusal = None if app_state.controls is None else app_state.controls.drag_refusal
            if refusal is not None:
                app_state.messages.add(refusal, "warning")
            else:
                app_state.use_tool(tools.grab, app_state.paused)
        if tools.is_holding:
            self._drag = event.pos

    def _move_controls(self, before: tuple[int, int], now: tuple[int, int]) -> None:
        """Pass a mouse motion between two pixels to the controls of the game."""
        camera, ui_scale = self._context.camera, self._context.gui.ui_scale
        pixels = (now[0] - before[0]) / ui_scale, (now[1] - before[1]) / ui_scale
        fine = bool(pygame.key.get_mods() & pygame.KMOD_SHIFT)
        time = pygame.time.get_ticks() / 1000.0

        points = camera.to_world(before), camera.to_world(now)
        self._use_controls(lambda controls: controls.move(*points, pixels, fine, time))

    def flush(self) -> None:
        """Drag the held body to the latest mouse position: one action per frame, despite many motion events."""
        pixel, self._drag = self._drag, None
        app_state = self._context.app_state
        tools = app_state.body_tools
        if pixel is None or not tools.is_holding:
            return
        if not app_state.use_tool(tools.drag, self._context.camera.to_world(pixel)):
            tools.drop()

    def release_all(self) -> None:
        """End panning and dragging."""
        self._panning = False
        self._end_drag()

    def _end_drag(self) -> None:
        self.flush()
        self._pressed = None
        tools = self._context.app_state.body_tools
        if tools.is_holding and not self._context.app_state.use_tool(tools.release):
            tools.drop()

    def world_position(self) -> tuple[float, float]:
        """Return the position of the pointer, m; before its first event, the centre of the view."""
        camera = self._context.camera
        return camera.centre if self.position is None else camera.to_world(self.position)
