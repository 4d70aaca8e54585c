"""Seat: what a player has before him: the stage, the desk, the camera, and what is kept of them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pygame

from sandbox.play.camera import Box, Camera
from sandbox.play.desk import Desk
from sandbox.play.drawing.picture import Picture
from sandbox.play.footage.taking import Taking
from sandbox.play.framing import around, framing, lies_down
from sandbox.play.instruments.thumbnail import frame_in_flight
from sandbox.play.sight import Sight
from sandbox.play.stage import Stage

TITLE = "sandbox"


class Seat:
    """All that commands and the mouse have to do with. It opens no window."""

    def __init__(
        self, surface: pygame.Surface, unit: float, stage: Stage, folder: Path, film: str, say: Callable[[str], None]
    ) -> None:
        """Take place.

        Args:
            surface: what is drawn on.
            unit: by how much things are larger than on a display of 1080 lines.
            stage: what is played.
            folder: where screenshots, films and sessions go.
            film: what Ctrl+R records, `.gif` or `.mp4`.
            say: who prints a line on the terminal.
        """
        self.surface, self.stage, self._say = surface, stage, say
        self.taking = Taking(folder, film, self.tell)
        self.desk = Desk(surface.get_size(), unit)
        self.camera = Camera((0.0, 0.0), 100.0, surface.get_size())
        self.at_home = True
        """whether the camera is where Home puts it; a new scene is then seen whole"""
        self._covered = (0, 0)  # px at the top and bottom that the score panel took as it came home
        self.leaving: int | None = None
        """the exit status, once the window is to close"""

    def tell(self, text: str, level: str = "info") -> None:
        """Say something in the window and on the terminal."""
        self.stage.messages.tell(text, level)
        self._say(text)

    def renew(self, same: bool) -> None:
        """Look at what is on now; the same scene as before is seen from where it was seen."""
        if self.at_home:
            self.home()
        self.desk.renew(same)
        show = self.stage.show
        pygame.display.set_caption(f"{show.scene.title or self.name} - {TITLE}" if show is not None else TITLE)

    @property
    def name(self) -> str:
        """What files of this scene are called by: its file, or where it has none, its title."""
        if self.stage.path is not None:
            return self.stage.path.stem
        show = self.stage.show
        return (show.scene.title if show is not None else "") or "scene"

    def preview(self) -> pygame.Surface | None:
        """Return a picture of the scene that is being opened, as it will begin; None where none is."""
        scene = self.stage.opening
        if scene is None or (self.stage.show is not None and self.stage.show.scene is scene):
            return None
        size = self.surface.get_size()
        made = pygame.Surface(size, 0, self.surface)
        free = size[0] - self.desk.panel.width, size[1] - self.desk.foot
        turned = lies_down(scene, free)
        camera = Camera.fitting(framing(scene), size, inset=self.desk.panel.width, foot=self.desk.foot, turned=turned)
        Picture().draw(made, camera, Sight(scene, scene.bodies, frame_in_flight(scene)), unit=self.desk.unit)
        return made

    def home(self) -> None:
        """Show the scene whole."""
        self.at_home = True
        show = self.stage.show
        if show is not None:
            self._fit(framing(show.scene))

    def find(self) -> None:
        """Show the bodies where they are now."""
        show = self.stage.show
        if show is None:
            return
        frame = show.frame
        there = frame.present & np.isfinite(frame.position).all(axis=1)
        box = around(frame.position[there], show.bodies.radius[: len(there)][there])
        if box is not None:
            low, high = ((float(corner[0]), float(corner[1])) for corner in box)
            self._fit((low, high))
            self.at_home = False

    def _fit(self, box: Box) -> None:
        """Show a box whole, beside what the panels and the timeline cover."""
        size, inset = self.surface.get_size(), self.desk.panel.width
        self._covered = head, foot = self.desk.covered(self.stage)
        foot += self.desk.foot
        show = self.stage.show
        lies = show is not None and lies_down(show.scene, (size[0] - inset, size[1] - foot))
        self.camera = Camera.fitting(box, size, inset=inset, foot=foot, turned=lies, head=head)

    def make_room(self) -> None:
        """Come home again where the score panel has grown, with another row or with how the game ended."""
        covered = self.desk.covered(self.stage)
        if self.at_home and any(now > then for now, then in zip(covered, self._covered, strict=True)):
            self.home()

    def resize(self, surface: pygame.Surface) -> None:
        """Go on with a surface of another size."""
        self.surface = surface
        self.desk.resize(surface.get_size())
        self.camera = self.camera.resized(surface.get_size())
        if self.at_home:
            self.home()
