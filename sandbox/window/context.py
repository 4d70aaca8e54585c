"""Window context: the application state, the GUI, the camera, and the state kept between scenes."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.scene.scene import Scene
from sandbox.window.app_state import AppState
from sandbox.window.camera import Box, Camera
from sandbox.window.capture.controller import CaptureController
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.renderer import Renderer
from sandbox.window.render.text import largest_area, renderable
from sandbox.window.ui.gui import Gui
from sandbox.window.ui.scene_browser import frame_in_flight
from sandbox.window.view_bounds import Corners, bounding_box, should_rotate, view_bounds

TITLE = "sandbox"
CLOSER = 1.5
"""A camera that follows all moving bodies is at most so many times as close as at first."""
FIELD_MARGIN = 0.02
"""of what plates leave free, so much is left on each side of a table or the field of a game"""
BESIDE_BODIES = 12.0
"""radii: what the camera shows at least of where bodies are"""


class WindowContext:
    """All that commands and the mouse have to do with. It opens no window."""

    def __init__(
        self, surface: pygame.Surface, unit: float, stage: AppState, folder: Path, film: str, say: Callable[[str], None]
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
        self.taking = CaptureController(folder, film, self.tell)
        self.gui = Gui(surface.get_size(), unit)
        self.camera = Camera((0.0, 0.0), 100.0, surface.get_size())
        self.at_home = True
        """whether the camera is where Home puts it; a new scene is then seen whole"""
        self.following: int | Literal["all"] | None = None
        """number of the body that the camera follows, or all that move"""
        self._window_size: tuple[int, int] | None = None  # before it filled the screen
        self._taken: list[pygame.Rect] = []  # what plates covered as it came home
        self._covered = (0, 0)  # px at the top and bottom that the score panel took as it came home
        self.leaving: int | None = None
        """the exit status, once the window is to close"""

    def tell(self, text: str, level: str = "info") -> None:
        """Say something in the window and on the terminal."""
        self.stage.messages.tell(text, level)
        self._say(text)

    def renew(self, same: bool) -> None:
        """Look at what is on now; the same scene as before is seen from where it was seen."""
        show = self.stage.show
        if not same:
            self.following = None if show is None else _steered(show.scene)
        if self.at_home:
            self.home()
        self.gui.on_scene_changed(same)
        title = "" if show is None else f"{show.scene.title or self.name} - "
        pygame.display.set_caption(renderable(title + TITLE))

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
        free = size[0] - self.gui.panel.width, size[1] - self.gui.bottom_margin
        turned = should_rotate(scene, free)
        camera = Camera.fitting(
            view_bounds(scene), size, inset=self.gui.panel.width, foot=self.gui.bottom_margin, turned=turned
        )
        Renderer().draw(made, camera, Snapshot(scene, scene.bodies, frame_in_flight(scene)), unit=self.gui.ui_scale)
        self.gui.panel.draw(made)
        return made

    def home(self) -> None:
        """Show the scene whole."""
        self.at_home = True
        show = self.stage.show
        if show is not None:
            self._fit(view_bounds(show.scene, self.stage.reach))

    @property
    def loses_sight(self) -> bool:
        """Whether none of the bodies that move is in the picture."""
        show = self.stage.show
        if show is None:
            return False
        frame, bodies = show.drawn, show.bodies
        count = min(len(bodies), len(frame.position))
        moving = frame.present[:count] & ~bodies.fixed[:count]
        seen = moving & self.camera.in_sight(frame.position[:count], bodies.radius[:count])
        return bool((~bodies.fixed).any()) and not seen.any()

    def toggle_follow(self) -> None:
        """Let the camera follow the picked body, or all that move; or let it stay where it is."""
        show, messages = self.stage.show, self.stage.messages
        if show is None:
            return
        if self.following is not None:
            self.following = None
            messages.tell("the camera stays here; Home fits the view")
            return
        picked = self.stage.hands.picked
        self.following, self.at_home = "all" if picked is None else picked, False
        name = "all moving bodies" if picked is None else show.bodies.names[picked]
        messages.tell(f"the camera follows {name} (F: stop)")

    def follow(self, elapsed: float) -> None:
        """Move the camera after what it follows, by so much real time, s."""
        show = self.stage.show
        if show is None or self.following is None:
            return
        frame, bodies = show.drawn, show.bodies
        if self.following == "all":
            count = min(len(bodies), len(frame.position))
            chosen = frame.present[:count] & ~bodies.fixed[:count] & np.isfinite(frame.position[:count]).all(axis=1)
            box = bounding_box(frame.position[:count][chosen], bodies.radius[:count][chosen])
            if box is not None:
                target = self._fitting(_widened(box, bodies.radius[:count][chosen]))
                closest = CLOSER * self._fitting(view_bounds(show.scene, self.stage.reach)).scale
                self.camera = self.camera.eased(target.zoomed_to(min(target.scale, closest)), elapsed)
        elif self.following < len(frame.position) and frame.present[self.following]:
            place = frame.position[self.following]
            if np.isfinite(place).all():
                before, self.camera = self.camera, self.camera.keeping(place, self._free, elapsed)
                self.at_home &= before == self.camera

    @property
    def _free(self) -> tuple[float, float, float, float]:
        """What nothing covers: left, top, right and bottom, px."""
        width, height = self.surface.get_size()
        head, foot = self.gui.score_margins(self.stage)
        return 0.0, float(head), float(width - self.gui.panel.width), float(height - foot - self.gui.bottom_margin)

    def toggle_full_screen(self) -> None:
        """Fill the screen, or go back to the window as it was."""
        if self._window_size is None:
            self._window_size = self.surface.get_size()
            surface = pygame.display.set_mode((0, 0), pygame.FULLSCREEN)
        else:
            surface = pygame.display.set_mode(self._window_size, pygame.RESIZABLE)
            if surface.get_size() != self._window_size:  # some drivers only leave full screen at first
                surface = pygame.display.set_mode(self._window_size, pygame.RESIZABLE)
            self._window_size = None
        self.resize(surface)

    def find(self) -> None:
        """Show the bodies where they are now."""
        show = self.stage.show
        if show is None:
            return
        frame = show.frame
        there = frame.present & np.isfinite(frame.position).all(axis=1)
        box = bounding_box(frame.position[there], show.bodies.radius[: len(there)][there])
        if box is not None:
            self._fit(_widened(box, show.bodies.radius[: len(there)][there]))
            self.at_home = False

    def _fit(self, box: Box) -> None:
        """Show a box whole, beside what the panels and the timeline cover."""
        self.camera = self._fitting(box)

    def _fitting(self, box: Box) -> Camera:
        """Return the camera that shows a box whole."""
        size, room, show = self.surface.get_size(), self.gui.area, self.stage.show
        self._covered = head, foot = self.gui.score_margins(self.stage)
        lies = show is not None and should_rotate(show.scene, room.size)
        if self._has_field:  # every part of it counts: plates lie beside it
            (left, bottom), (right, top) = box
            shape = max(right - left, 1e-9), max(top - bottom, 1e-9)
            room = largest_area(shape[::-1] if lies else shape, room, self.gui.permanent_plates(self.stage))
            camera = replace(Camera.fitting(box, room.size, FIELD_MARGIN, turned=lies), size=size)
            return camera.panned((room.centerx - size[0] / 2.0, room.centery - size[1] / 2.0))
        inset = self.gui.panel.width
        return Camera.fitting(box, size, inset=inset, foot=foot + self.gui.bottom_margin, turned=lies, head=head)

    @property
    def _has_field(self) -> bool:
        """Whether all of what is seen counts: a table, the field of a game, or a view that the scene states."""
        show = self.stage.show
        if show is None:
            return False
        play = show.scene.play
        return play.area is not None or play.view is not None or play.game is not None

    def make_room(self) -> None:
        """Come home again where a plate has grown, with another row or with how the game ended."""
        if not self.at_home or self.following is not None:
            return
        covered, show = self.gui.score_margins(self.stage), self.stage.show
        grown = any(now > then for now, then in zip(covered, self._covered, strict=True))
        if self._has_field and show is not None:
            taken = self.gui.permanent_plates(self.stage)
            if taken != self._taken:
                corners = self.camera.to_screen(np.asarray(view_bounds(show.scene)))
                (left, top), (right, bottom) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
                field = pygame.Rect(math.ceil(left), math.ceil(top), int(right - left), int(bottom - top))
                grown, self._taken = field.collidelist(taken) >= 0, taken
        if grown:
            self.home()

    def resize(self, surface: pygame.Surface) -> None:
        """Go on with a surface of another size."""
        self.surface = surface
        self.gui.resize(surface.get_size())
        self.camera = self.camera.resized(surface.get_size())
        if self.at_home:
            self.home()


def _steered(scene: Scene) -> int | None:
    """Return the number of the body that thrusts on keys move, where the scene states no view: it may go anywhere."""
    names = [thrust.body for thrust in scene.thrusts if thrust.key is not None]
    return scene.bodies.names.index(names[0]) if names and scene.play.view is None else None


def _widened(box: Corners, radius: FloatArray) -> Box:
    """Return a box that is at least some bodies wide: of one body, its surroundings are seen too."""
    low, high = box
    least = BESIDE_BODIES * float(np.median(radius)) if len(radius) else 1.0
    grown = np.maximum(least - (high - low), 0.0) / 2.0
    low, high = low - grown, high + grown
    return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))
