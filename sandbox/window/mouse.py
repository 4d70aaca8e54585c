"""Mouse: what it does to the picture and the bodies in it.

A press only picks a body, so that its figures can be read without a touch; who goes on to move the mouse takes hold.
"""

import math
from collections.abc import Callable

import pygame

from sandbox.games.billiards.view.controls import CueControls
from sandbox.window.context import WindowContext
from sandbox.window.playback.live import LiveView

NOTCH = 1.15
"""by which the wheel brings things closer"""
MOST_NOTCHES = 100.0
"""of one event of the wheel: more than these zoom from any end to the other"""
PICK_RADIUS = 6.0
"""px at unit 1 beside a body that still point at it"""
SLACK = 4.0
"""px at unit 1 that the mouse may move between press and release of a click"""


class MouseController:
    """Zooms, pans, picks, pulls and moves."""

    def __init__(self, seat: WindowContext) -> None:
        self._seat = seat
        self._panning = False
        self._pressed: tuple[int, int] | None = None  # on a body that nobody has taken hold of yet
        self._began: tuple[int, int] | None = None  # where the left button came down
        self._drag: tuple[int, int] | None = None  # where what is held is to go
        self.place: tuple[int, int] | None = None
        """where it is, px; None before it was over the picture"""

    def take(self, event: pygame.event.Event) -> None:
        """Take an event in that nobody else wanted."""
        seat = self._seat
        if event.type == pygame.MOUSEWHEEL:
            notches = getattr(event, "precise_y", 0.0) or float(event.y)
            notches = min(max(notches, -MOST_NOTCHES), MOST_NOTCHES)
            seat.camera = seat.camera.zoomed(NOTCH**notches, pygame.mouse.get_pos())
            seat.at_home = False
            if seat.following == "all":
                seat.following = None
        elif event.type == pygame.MOUSEBUTTONDOWN:
            self.place = event.pos
            if event.button in (2, 3):
                self._panning = True
            elif event.button == 1:
                self._look(event.pos)
        elif event.type == pygame.MOUSEMOTION:
            self._move(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            if event.button in (2, 3):
                self._panning = False
            elif event.button == 1:
                self._release(event.pos)
        elif event.type == pygame.WINDOWFOCUSLOST:  # the release goes elsewhere
            self.let_go()

    def _look(self, place: tuple[int, int]) -> None:
        seat, show = self._seat, self._seat.stage.show
        reach = PICK_RADIUS * seat.gui.ui_scale / seat.camera.scale
        self._began = place
        if self._at_table(lambda table: table.press(seat.camera.to_world(place), reach)):
            return
        there = show is not None and seat.stage.hands.look(show, seat.camera.to_world(place), reach)
        self._pressed = place if there else None

    def _at_table(self, deed: Callable[[CueControls], bool]) -> bool:
        """Let the hand do something at the table, where one is on; return whether that was all that was meant."""
        stage, done = self._seat.stage, [False]
        gestures = stage.gestures
        if gestures is None:
            return False

        def do(_: LiveView) -> None:
            done[0] = True  # also where it cannot be done, which is said
            done[0] = deed(gestures)

        stage.act(do)
        return done[0]

    def _release(self, place: tuple[int, int]) -> None:
        seat, began = self._seat, self._began
        moved = began is not None and math.dist(began, place) > SLACK * seat.gui.ui_scale
        self._began = None
        picked = seat.stage.hands.picked if self._pressed is not None and not moved else None
        used = began is not None and self._at_table(lambda table: table.release(seat.camera.to_world(place), moved))
        if picked is not None and not used:
            self._at_table(lambda table: table.name_ball(picked))
        self._open_hand()

    def _move(self, event: pygame.event.Event) -> None:
        seat = self._seat
        before, self.place = self.place, event.pos
        if not self._panning and not seat.stage.hands.holding and self._pressed is None:
            self._aim(event.pos if before is None else before, event.pos)
        if self._panning:
            seat.camera = seat.camera.panned(event.rel)
            seat.at_home, seat.following = False, None
            return
        stage = seat.stage
        if self._pressed is not None and math.dist(self._pressed, event.pos) > SLACK * seat.gui.ui_scale:
            self._pressed = None
            if stage.game is not None and stage.game.match.rules.name != "free":
                stage.messages.tell("in a game, only the cue moves balls", "warning")
            else:
                stage.act(lambda live: stage.hands.hold(live, stage.paused))
        if stage.hands.holding:
            self._drag = event.pos

    def _aim(self, before: tuple[int, int], now: tuple[int, int]) -> None:
        """Let the table know of a motion."""
        camera, unit = self._seat.camera, self._seat.gui.ui_scale
        pixels = (now[0] - before[0]) / unit, (now[1] - before[1]) / unit
        fine = bool(pygame.key.get_mods() & pygame.KMOD_SHIFT)
        time = pygame.time.get_ticks() / 1000.0

        def aim(table: CueControls) -> bool:
            table.motion(camera.to_world(before), camera.to_world(now), pixels, fine, time)
            return True

        self._at_table(aim)

    def settle(self) -> None:
        """Bring what is held to where the mouse is by now: one action, however many motions led there."""
        pixel, self._drag = self._drag, None
        stage = self._seat.stage
        if pixel is None or not stage.hands.holding:
            return
        place = self._seat.camera.to_world(pixel)
        if not stage.act(lambda live: stage.hands.drag(live, place)):
            stage.hands.drop()

    def let_go(self) -> None:
        """Let go of the body that is held, and of the picture."""
        self._panning = False
        self._open_hand()

    def _open_hand(self) -> None:
        self.settle()
        self._pressed = None
        stage = self._seat.stage
        if stage.hands.holding and not stage.act(stage.hands.let_go):
            stage.hands.drop()

    def world(self) -> tuple[float, float]:
        """Return the place that it points at, m; before it points at any, the middle of the picture."""
        camera = self._seat.camera
        return camera.centre if self.place is None else camera.to_world(self.place)
