"""Mouse: what it does to the picture and the bodies in it."""

import pygame

from sandbox.play.seat import Seat

NOTCH = 1.15
"""by which the wheel brings things closer"""
REACH = 6.0
"""px at unit 1 beside a body that still point at it"""


class Mouse:
    """Zooms, pans, picks, pulls and moves."""

    def __init__(self, seat: Seat) -> None:
        self._seat = seat
        self._panning = False
        self.place: tuple[int, int] | None = None
        """where it is, px; None before it was over the picture"""

    def take(self, event: pygame.event.Event) -> None:
        """Take an event in that nobody else wanted."""
        seat = self._seat
        if event.type == pygame.MOUSEWHEEL:
            notches = getattr(event, "precise_y", 0.0) or float(event.y)
            seat.camera = seat.camera.zoomed(NOTCH**notches, pygame.mouse.get_pos())
            seat.at_home = False
        elif event.type == pygame.MOUSEBUTTONDOWN:
            self.place = event.pos
            if event.button in (2, 3):
                self._panning = True
            elif event.button == 1:
                reach = REACH * seat.desk.unit / seat.camera.scale
                seat.stage.grasp(seat.camera.to_world(event.pos), reach)
        elif event.type == pygame.MOUSEMOTION:
            self._move(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            if event.button in (2, 3):
                self._panning = False
            elif event.button == 1:
                self._let_go()
        elif event.type == pygame.WINDOWFOCUSLOST:  # the release goes elsewhere
            self._panning = False
            self._let_go()

    def _move(self, event: pygame.event.Event) -> None:
        seat = self._seat
        self.place = event.pos
        if self._panning:
            seat.camera = seat.camera.panned(event.rel)
            seat.at_home = False
        elif seat.stage.hands.holding:
            place = seat.camera.to_world(event.pos)
            if not seat.stage.act(lambda live: seat.stage.hands.drag(live, place)):
                seat.stage.hands.drop()

    def _let_go(self) -> None:
        stage = self._seat.stage
        if stage.hands.holding and not stage.act(stage.hands.let_go):
            stage.hands.drop()

    def world(self) -> tuple[float, float]:
        """Return the place that it points at, m; before it points at any, the middle of the picture."""
        camera = self._seat.camera
        return camera.centre if self.place is None else camera.to_world(self.place)
