"""Window context: application state, GUI, camera, and state that outlives a scene."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.scene.compile.scene import Scene
from sandbox.window.app_state import AppState
from sandbox.window.camera import Camera, ViewBox
from sandbox.window.capture.controller import CaptureController
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.renderer import Renderer
from sandbox.window.render.text import largest_area, renderable
from sandbox.window.ui.gui import Gui
from sandbox.window.ui.scene_browser import frame_in_flight
from sandbox.window.view_bounds import Corners, bounding_box, field_rect, has_field, should_rotate, view_bounds

TITLE = "sandbox"
MAX_FOLLOW_ZOOM = 1.5
"""largest zoom of a camera that follows all moving bodies, relative to the fitted scene"""
FIELD_MARGIN = 0.02
"""margin on each side of a table or playing field, as a fraction of the free area"""
MIN_VIEW_RADII = 12.0
"""smallest extent of a view fitted to bodies, in median body radii"""


class WindowContext:
    """Surface, camera and title of the window, shared by commands and the mouse. It does not open the window."""

    def __init__(
        self,
        surface: pygame.Surface,
        ui_scale: float,
        app_state: AppState,
        folder: Path,
        film: str,
        say: Callable[[str], None],
    ) -> None:
        """Create the GUI and the camera of a window.

        Args:
            surface: surface of the window.
            ui_scale: UI scale, 1 on a display of 1080 lines.
            app_state: the open scene and its operations.
            folder: folder for screenshots, films and sessions.
            film: format of films, `.gif` or `.mp4`.
            say: prints a line on the terminal.
        """
        self.surface, self.app_state, self._print_line = surface, app_state, say
        self.capture = CaptureController(folder, film, self.notify)
        self.gui = Gui(surface.get_size(), ui_scale)
        self.camera = Camera((0.0, 0.0), 100.0, surface.get_size())
        self.is_fitted = True
        """whether the camera shows the whole scene; if so, it is fitted again to a new scene or window size"""
        self.following: int | Literal["all"] | None = None
        """index of the body that the camera follows, "all" for all moving bodies, or None"""
        self._window_size: tuple[int, int] | None = None  # before full screen
        self._plates: list[pygame.Rect] = []  # rectangles of plates when the camera was fitted
        self._covered = (0, 0)  # px covered by the score panel at the top and bottom when the camera was fitted
        self.exit_status: int | None = None
        """set when the window is to be closed"""

    def notify(self, text: str, level: str = "info") -> None:
        """Show a message in the window and print it on the terminal."""
        self.app_state.messages.add(text, level)
        self._print_line(text)

    def on_scene_changed(self, same: bool) -> None:
        """Update camera, GUI and title for another view; with `same`, a view of the same scene, the camera stays."""
        show = self.app_state.view
        if not same:
            self.following = None if show is None else _thrust_body(show.scene)
        if self.is_fitted:
            self.fit_scene()
        self.gui.on_scene_changed(same)
        title = "" if show is None else f"{show.scene.title or self.name} - "
        pygame.display.set_caption(renderable(title + TITLE))

    @property
    def name(self) -> str:
        """Base name of saved files: that of the scene file, else the title of the scene."""
        if self.app_state.path is not None:
            return self.app_state.path.stem
        show = self.app_state.view
        return (show.scene.title if show is not None else "") or "scene"

    def render_preview(self) -> pygame.Surface | None:
        """Return an image of the initial state of the scene being opened; None if no scene is being opened."""
        scene = self.app_state.opening
        if scene is None or (self.app_state.view is not None and self.app_state.view.scene is scene):
            return None
        size = self.surface.get_size()
        image = pygame.Surface(size, 0, self.surface)
        free = size[0] - self.gui.panel.width, size[1] - self.gui.bottom_margin
        turned = should_rotate(scene, free)
        camera = Camera.fitting(
            view_bounds(scene), size, inset=self.gui.panel.width, foot=self.gui.bottom_margin, turned=turned
        )
        Renderer(self.gui.accents if self.app_state.opens_same else None).draw(
            image, camera, Snapshot(scene, scene.bodies, frame_in_flight(scene)), ui_scale=self.gui.ui_scale
        )
        self.gui.panel.draw(image)
        return image

    def fit_scene(self) -> None:
        """Fit the camera to the whole scene."""
        self.is_fitted = True
        show = self.app_state.view
        if show is not None:
            self._fit(view_bounds(show.scene, self.app_state.reach))

    @property
    def is_out_of_view(self) -> bool:
        """Whether all moving bodies are outside the view."""
        show = self.app_state.view
        if show is None:
            return False
        frame, bodies = show.displayed_frame, show.bodies
        count = min(len(bodies), len(frame.position))
        moving = frame.present[:count] & ~bodies.fixed[:count]
        visible = moving & self.camera.in_sight(frame.position[:count], bodies.radius[:count])
        return bool((~bodies.fixed).any()) and not visible.any()

    def toggle_follow(self) -> None:
        """Follow the selected body, or all moving bodies, with the camera; or stop following."""
        show, messages = self.app_state.view, self.app_state.messages
        if show is None:
            return
        if self.following is not None:
            self.following = None
            messages.add("the camera stays here; Home fits the view")
            return
        picked = self.app_state.body_tools.picked
        self.following, self.is_fitted = "all" if picked is None else picked, False
        name = "all moving bodies" if picked is None else show.bodies.names[picked]
        messages.add(f"the camera follows {name} (F: stop)")

    def update_camera(self, elapsed: float) -> None:
        """Move the camera towards the followed bodies; `elapsed` is real time, s."""
        show = self.app_state.view
        if show is None or self.following is None:
            return
        frame, bodies = show.displayed_frame, show.bodies
        if self.following == "all":
            count = min(len(bodies), len(frame.position))
            chosen = frame.present[:count] & ~bodies.fixed[:count] & np.isfinite(frame.position[:count]).all(axis=1)
            box = bounding_box(frame.position[:count][chosen], bodies.radius[:count][chosen])
            if box is not None:
                target = self._fitted_camera(_enlarge_box(box, bodies.radius[:count][chosen]))
                closest = MAX_FOLLOW_ZOOM * self._fitted_camera(view_bounds(show.scene, self.app_state.reach)).scale
                self.camera = self.camera.eased(target.zoomed_to(min(target.scale, closest)), elapsed)
        elif self.following < len(frame.position) and frame.present[self.following]:
            position = frame.position[self.following]
            if np.isfinite(position).all():
                before, self.camera = self.camera, self.camera.keeping(position, self._free_area, elapsed)
                self.is_fitted &= before == self.camera

    @property
    def _free_area(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of the area not covered by the GUI, px."""
        width, height = self.surface.get_size()
        head, foot = self.gui.score_margins(self.app_state)
        return 0.0, float(head), float(width - self.gui.panel.width), float(height - foot - self.gui.bottom_margin)

    def toggle_full_screen(self) -> None:
        """Toggle full screen; leaving it restores the previous window size."""
        if self._window_size is None:
            self._window_size = self.surface.get_size()
            surface = pygame.display.set_mode((0, 0), pygame.FULLSCREEN)
        else:
            surface = pygame.display.set_mode(self._window_size, pygame.RESIZABLE)
            if surface.get_size() != self._window_size:  # with some drivers the first call only leaves full screen
                surface = pygame.display.set_mode(self._window_size, pygame.RESIZABLE)
            self._window_size = None
        self.resize(surface)

    def fit_bodies(self) -> None:
        """Fit the camera to the present positions of the bodies."""
        show = self.app_state.view
        if show is None:
            return
        frame = show.frame
        is_valid = frame.present & np.isfinite(frame.position).all(axis=1)
        box = bounding_box(frame.position[is_valid], show.bodies.radius[: len(is_valid)][is_valid])
        if box is not None:
            self._fit(_enlarge_box(box, show.bodies.radius[: len(is_valid)][is_valid]))
            self.is_fitted = False

    def show_box(self, box: ViewBox) -> None:
        """Show a box of the world, m."""
        self._fit(box)
        self.is_fitted = False

    def _fit(self, box: ViewBox) -> None:
        """Fit the camera to a box, m."""
        self.camera = self._fitted_camera(box)

    def _fitted_camera(self, box: ViewBox) -> Camera:
        """Return a camera that shows a box, m, in the area not covered by panels and timeline."""
        size, area, show = self.surface.get_size(), self.gui.area, self.app_state.view
        self._covered = head, foot = self.gui.score_margins(self.app_state)
        is_rotated = show is not None and should_rotate(show.scene, area.size)
        if show is not None and has_field(show.scene):  # plates must not cover any part of the field
            (left, bottom), (right, top) = box
            shape = max(right - left, 1e-9), max(top - bottom, 1e-9)
            area = largest_area(shape[::-1] if is_rotated else shape, area, self.gui.permanent_plates(self.app_state))
            camera = replace(Camera.fitting(box, area.size, FIELD_MARGIN, turned=is_rotated), size=size)
            return camera.panned((area.centerx - size[0] / 2.0, area.centery - size[1] / 2.0))
        inset = self.gui.panel.width
        return Camera.fitting(box, size, inset=inset, foot=foot + self.gui.bottom_margin, turned=is_rotated, head=head)

    def refit_if_covered(self) -> None:
        """Fit the scene again if a plate has grown over it, for example by a new row or the result of a game."""
        if not self.is_fitted or self.following is not None:
            return
        covered, show = self.gui.score_margins(self.app_state), self.app_state.view
        grown = any(now > before for now, before in zip(covered, self._covered, strict=True))
        if show is not None and has_field(show.scene):
            plates = self.gui.permanent_plates(self.app_state)
            if plates != self._plates:
                grown, self._plates = field_rect(show.scene, self.camera).collidelist(plates) >= 0, plates
        if grown:
            self.fit_scene()

    def resize(self, surface: pygame.Surface) -> None:
        """Switch to a surface of another size."""
        self.surface = surface
        self.gui.resize(surface.get_size())
        self.camera = self.camera.resized(surface.get_size())
        if self.is_fitted:
            self.fit_scene()


def _thrust_body(scene: Scene) -> int | None:
    """Return the body moved by keys of thrusts or tyres; None without such a body or if the scene sets its view."""
    names = [thrust.body for thrust in scene.thrusts if thrust.key is not None]
    names += [tyre.body for tyre in scene.tyres if tyre.keys]
    return scene.bodies.names.index(names[0]) if names and scene.play.view is None else None


def _enlarge_box(box: Corners, radius: FloatArray) -> ViewBox:
    """Return a box, m, enlarged to at least `MIN_VIEW_RADII` median radii in width and height."""
    low, high = box
    min_size = MIN_VIEW_RADII * float(np.median(radius)) if len(radius) else 1.0
    grown = np.maximum(min_size - (high - low), 0.0) / 2.0
    low, high = low - grown, high + grown
    return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))
