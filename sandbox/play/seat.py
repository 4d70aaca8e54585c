"""Seat: what a player has before him: the stage, the desk, the camera, and what is kept of them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pygame

from sandbox.play.camera import Box, Camera
from sandbox.play.desk import Desk
from sandbox.play.footage.taking import Taking
from sandbox.play.framing import around, framing, lies_down
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
        """Show a box whole, beside what the panel and the timeline cover."""
        size, covered = self.surface.get_size(), self.desk.panel.width
        show = self.stage.show
        lies = show is not None and lies_down(show.scene, (size[0] - covered, size[1] - self.desk.foot))
        self.camera = Camera.fitting(box, size, inset=covered, foot=self.desk.foot, turned=lies)

    def resize(self, surface: pygame.Surface) -> None:
        """Go on with a surface of another size."""
        self.surface = surface
        self.desk.resize(surface.get_size())
        self.camera = self.camera.resized(surface.get_size())
        if self.at_home:
            self.home()
