"""GUI: draws the scene and all widgets in z-order, and routes events to the topmost widget first."""

from dataclasses import replace
from operator import is_
from pathlib import Path
from typing import NamedTuple

import pygame

from sandbox.game_names import spec_of
from sandbox.games.contract import HasViewState
from sandbox.window.app_state import AppState, scenes_to_pick
from sandbox.window.camera import Camera
from sandbox.window.game_host import GameDisplay, GameHost, ScoreDisplay
from sandbox.window.input.body_tools import describe_loss
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.parameters import Parameter, SessionParameters
from sandbox.window.playback.recorded import RecordedView
from sandbox.window.playback.snapshot import OVERLAYS, HudStatus
from sandbox.window.render.accents import AccentNumbers
from sandbox.window.render.grid import scale_rect
from sandbox.window.render.palette import BACKGROUND, INK
from sandbox.window.render.renderer import InsetRenderer, Renderer
from sandbox.window.render.text import draw_box, draw_text, text_size
from sandbox.window.sound import Sounds
from sandbox.window.ui import hud
from sandbox.window.ui.energy_plot import EnergyGraph
from sandbox.window.ui.help import HelpOverlay
from sandbox.window.ui.high_score_dialog import HighScoreDialog
from sandbox.window.ui.hud import MAX_SHOWN_MESSAGES, hud_width
from sandbox.window.ui.panel import BUTTONS, SidePanel
from sandbox.window.ui.scene_browser import SceneBrowser
from sandbox.window.ui.score_panel import ScoreLayout, draw_score, layout_score
from sandbox.window.ui.status import hud_status, settings_text
from sandbox.window.ui.timeline import TIMELINE_HEIGHT, Timeline
from sandbox.window.view_bounds import field_rect, has_field

GRAPH_SIZE = (300, 130)
"""px at UI scale 1"""
TIME_STEPS = 100
"""Number of times that the seek bar distinguishes in the duration of a scene, at least"""


class GuiFrame(NamedTuple):
    """Values that a picture shows."""

    status: HudStatus
    display: GameDisplay | None
    """of the game, if any"""


class Gui:
    """Scene view, surrounding widgets, and the set of enabled overlays."""

    def __init__(self, size: tuple[int, int], ui_scale: float) -> None:
        self.ui_scale = ui_scale
        self.overlays: set[str] = {"shapes"}
        """enabled ones of `OVERLAYS`"""
        self.antialias = True
        self.has_gamepad = False
        """whether a gamepad is connected, whose buttons the help overlay lists then"""
        self.panel = SidePanel(size, ui_scale)
        self.help = HelpOverlay()
        self.scene_browser: SceneBrowser | None = None
        """None while closed"""
        self._high_scores = HighScoreDialog()
        self._film: pygame.Surface | None = None  # picture for films, of the size of the window
        self._timeline = Timeline()
        self._graph = EnergyGraph()
        self.accents = AccentNumbers()
        """colours of the bodies of the open scene, also while it is edited"""
        self._renderer, self._inset = Renderer(self.accents), InsetRenderer(self.accents)
        self._sounds = Sounds()
        self._parameters = SessionParameters()
        self._size = size
        self._announces_keys = False  # whether the keys of a new scene are still to be announced
        self._frame: GuiFrame | None = None  # from `update` to the end of `draw`
        self._score: tuple[object, ScoreLayout] | None = None  # arguments of the last layout, and the layout
        self._panel_inputs: tuple[object, ...] = ()  # values shown by the panel at its last update
        self._heard: object = None  # contacts that were last passed to the sounds
        self.bodies_out_of_view = False
        """whether all moving bodies are outside the view"""
        self._plates: dict[str, pygame.Rect] = {}

    def on_scene_changed(self, same: bool) -> None:
        """Reset the state that belongs to the previous scene; `same` if the new view is of the same scene."""
        self._graph.clear()
        self._panel_inputs = ()
        if not same:
            self.accents.clear()
            self._announces_keys = True

    def announce_keys(self, app_state: AppState) -> None:
        """Add messages that list the keys of a new scene.

        To be called after its first picture, which may compile kernels for longer than a message is shown.
        """
        if not self._announces_keys:
            return
        self._announces_keys = False
        help_lines = app_state.key_bindings.help_rows
        if app_state.controls is not None:
            app_state.messages.add(app_state.controls.hint)
            return
        spec = None if app_state.host is None or app_state.view is None else spec_of(app_state.view.scene.play.game)
        if spec is not None and spec.hint:
            app_state.messages.add(spec.hint)
            return
        if len(help_lines) > MAX_SHOWN_MESSAGES:
            help_lines = (*help_lines[: MAX_SHOWN_MESSAGES - 1], ("F1", "all keys"))
        for keys, about in help_lines:
            app_state.messages.add(f"{keys}: {about}")

    def resize(self, size: tuple[int, int]) -> None:
        """Lay out all widgets for a window of another size, px."""
        self._size = size
        self._panel_inputs = ()
        self.panel.resize(size, self.ui_scale)

    @property
    def bottom_margin(self) -> int:
        """Height of the timeline at the bottom of the window, px."""
        return round(TIMELINE_HEIGHT * self.ui_scale) if self.panel.visible else 0

    @property
    def area(self) -> pygame.Rect:
        """Area of the window not covered by the panel or the timeline, px."""
        return pygame.Rect(0, 0, self._size[0] - self.panel.width, self._size[1] - self.bottom_margin)

    @property
    def _timeline_rect(self) -> pygame.Rect:
        margin = self.bottom_margin
        return pygame.Rect(0, self._size[1] - margin, self._size[0] - self.panel.width, margin)

    @property
    def plates(self) -> dict[str, pygame.Rect]:
        """Rectangles of the plates as last drawn, px, by name."""
        return {name: rect for name, rect in self._plates.items() if rect.width and rect.height}

    def permanent_plates(self, app_state: AppState) -> list[pygame.Rect]:
        """Return the rectangles of the plates that are always shown for the open scene, px; messages are excluded.

        The status plate is measured with its pause line, so that pausing does not move anything.
        """
        show, area = app_state.view, self.area
        if show is None:
            return []
        keys = app_state.key_bindings.help_rows
        if self._frame is None:
            status = hud_status(app_state, keys, 0.0, None, self.panel.visible)
        else:
            status = self._frame.status
        longest = replace(status, paused=True, waits_for_start=False, frames_per_second=0.0, recording=None)
        rows = hud.layout_rows(longest, area, self.ui_scale)
        found = [rows.rect]
        if app_state.controls is not None:
            found += app_state.controls.hud.reserved(area, self._hud_width(show), self.ui_scale)
        elif app_state.host is not None:
            found.append(self._layout_score(self._display_of(app_state.host).board, show).rect)
        return found

    def score_margins(self, app_state: AppState) -> tuple[int, int]:
        """Return the heights of the score panel at the top and at the bottom of the area, px."""
        if app_state.host is None or app_state.controls is not None or app_state.view is None:
            return 0, 0
        return self._layout_score(self._display_of(app_state.host).board, app_state.view).margins(self.area)

    def _scale_foot(self, app_state: AppState) -> float:
        """Return the height at the lower edge of the window that the scale bar leaves free, px."""
        return float(self.bottom_margin + self.score_margins(app_state)[1])

    def _display_of(self, host: GameHost) -> GameDisplay:
        return host.shown() if self._frame is None or self._frame.display is None else self._frame.display

    def _layout_score(self, display: ScoreDisplay, show: LiveView | RecordedView) -> ScoreLayout:
        """Return the layout of the score panel, cached for the last arguments."""
        display = display._replace(can_restart=not self._high_scores.is_typing)
        arguments = display, self.area, self._hud_width(show), self.ui_scale
        if self._score is None or self._score[0] != arguments:
            self._score = arguments, layout_score(*arguments)
        return self._score[1]

    def _hud_width(self, show: LiveView | RecordedView) -> int:
        """Return the right edge of the status plate, px."""
        return hud_width(f"{show.engine}  ·  {settings_text(show.settings, not self.panel.visible)}", self.ui_scale)

    @property
    def covers_scene(self) -> bool:
        """Whether help or the scene browser covers the scene."""
        return self.scene_browser is not None or self.help.open

    def open_scene_browser(self, path: Path | None) -> None:
        """Open the scene browser."""
        self.scene_browser = SceneBrowser(scenes_to_pick(path))
        self.panel.release()

    def toggle_help(self) -> None:
        """Open or close help."""
        self.help.open = not self.help.open

    def toggle_sound(self) -> tuple[str, str]:
        """Switch sound on or off; return the text and the level of a message about it."""
        if self._sounds.enabled:
            self._sounds.disable()
            return "sound off", "info"
        return ("sound on", "info") if self._sounds.enable() else (self._sounds.why, "warning")

    def handle_event(self, event: pygame.event.Event, app_state: AppState) -> bool:
        """Pass an event to the topmost widget; return whether it was consumed.

        Events that end a drag are never consumed, as they also end drags elsewhere.
        """
        ends_drag = event.type in (pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST)
        return self._route(event, app_state) and not ends_drag

    def _route(self, event: pygame.event.Event, app_state: AppState) -> bool:
        if self.scene_browser is not None and event.type != pygame.QUIT:
            self._browse(self.scene_browser, event, app_state)
            return True
        if app_state.host is not None and self._high_scores.entry is not None and self._high_scores.handle_event(event):
            return True
        if (self.help.open and self.help.handle_event(event)) or self._close_faults(event, app_state):
            return True
        if event.type in (pygame.KEYDOWN, pygame.KEYUP):  # panel, HUD and timeline use the mouse only
            return self._timeline.held
        if self.panel.handle_event(event):
            return True
        show = app_state.view
        if app_state.controls is not None and app_state.controls.hud.handle_event(event, app_state.run_handler):
            return True
        if show is not None and self._timeline_rect.height:
            held = self._timeline.held
            time = self._timeline.handle_event(event, self._timeline_rect)
            if time is not None:
                app_state.paused = True
                show.scrub(time)
            if held and not self._timeline.held:
                app_state.compute(show.commit_scrub)
            return held or self._timeline.held
        return False

    def _browse(self, browser: SceneBrowser, event: pygame.event.Event, app_state: AppState) -> None:
        """Pass an event to the scene browser, and open a chosen scene."""
        path = browser.handle_event(event)
        unsaved, again = app_state.count_unsaved(), "choose it again to open it anyway"
        if path is not None and (unsaved or app_state.has_unsaved_draft) and browser.confirmed != path:
            draft = f"the edited scene is not saved: {again}"
            browser.ask(path, draft if app_state.has_unsaved_draft else describe_loss(unsaved, again))
            return
        if path is not None:
            app_state.open_other(path)
        if path is not None or browser.closed:
            self.scene_browser = None

    def _close_faults(self, event: pygame.event.Event, app_state: AppState) -> bool:
        escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
        click = event.type == pygame.MOUSEBUTTONDOWN and event.button <= 3
        box = self._plates.get("faults")
        if not app_state.faults or not (escape or (click and box is not None and box.collidepoint(event.pos))):
            return False
        app_state.faults = ()
        return True

    def update(self, app_state: AppState, frame_rate: float, recording: str | None) -> GuiFrame:
        """Update the high-score dialog, and return the values that the next picture shows.

        Args:
            app_state: the application state.
            frame_rate: frames per second.
            recording: length and format of the film being recorded, if any.
        """
        host, controls = app_state.host, app_state.controls
        display = None if host is None else host.shown()
        if host is not None and not self.help.open and (controls is None or controls.is_own_score):
            for note in self._high_scores.update(host):
                app_state.messages.add(note, "warning")
        rows = app_state.key_bindings.help_rows
        self._frame = GuiFrame(hud_status(app_state, rows, frame_rate, recording, self.panel.visible), display)
        return self._frame

    def draw(self, surface: pygame.Surface, camera: Camera, app_state: AppState, frame: GuiFrame) -> None:
        """Draw the scene and all widgets.

        Args:
            surface: the window.
            camera: its camera.
            app_state: the application state.
            frame: result of `update`.
        """
        if self.scene_browser is not None:
            self.scene_browser.draw(surface, self.ui_scale)
        else:
            self._draw(surface, camera, app_state, *frame)
        self._frame = None  # outdated by the next event

    def _draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        app_state: AppState,
        status: HudStatus,
        display: GameDisplay | None,
    ) -> None:
        show, plates, scale_bar, field = app_state.view, dict[str, pygame.Rect](), None, None
        if show is None:
            surface.fill(BACKGROUND)
        else:
            self._draw_scene(surface, camera, app_state, show, display, plates)
            self._play_sounds(app_state, show)
            if not self.help.open:
                self._draw_game(surface, app_state, show, display, plates)
            if "energy" in self.overlays:
                self._draw_graph(surface, app_state, show, plates)
            scale_bar = scale_rect(camera, self.ui_scale, self._scale_foot(app_state))
            field = field_rect(show.scene, camera) if has_field(show.scene) else None
        status = replace(status, out_of_sight=self.describe_out_of_view(app_state))
        taken = [rect for rect in plates.values() if rect.width and rect.height]
        plates |= hud.draw_hud(surface, status, self.area, self.ui_scale, taken, scale_bar, field)
        if show is not None:
            if self._high_scores.entry is not None and not self.help.open:
                self._high_scores.draw(surface, self.area, self.ui_scale)
            if self.bottom_margin:
                plates["timeline"] = rect = self._timeline_rect
                times = show.start_time, show.frame.time, show.end_time
                step = show.scene.world.duration / TIME_STEPS
                self._timeline.draw(surface, rect, *times, show.keyframe_times, self.ui_scale, step)
        self._plates = plates
        if self.panel.visible:
            plates["panel"] = pygame.Rect(self._size[0] - self.panel.width, 0, self.panel.width, self._size[1])
            self._update_panel(app_state, status.recording is not None)
            self.panel.draw(surface)
        if self.help.open:
            self.help.draw(
                surface,
                self.ui_scale,
                app_state.key_bindings.help_rows,
                app_state.key_bindings.gamepad_rows if self.has_gamepad else (),
            )

    def film_picture(self, camera: Camera, app_state: AppState) -> pygame.Surface | None:
        """Return a picture for films: scene and score, without panel, messages and state; None if no scene is visible.

        Args:
            camera: camera of the window.
            app_state: the application state.
        """
        show = app_state.view
        if show is None or self.scene_browser is not None:
            return None
        if self._film is None or self._film.get_size() != self._size:
            self._film = pygame.Surface(self._size)
        display = None if app_state.host is None else self._display_of(app_state.host)
        self._draw_scene(self._film, camera, app_state, show, display, {})
        self._draw_game(self._film, app_state, show, display, {})
        return self._film.subsurface(self.area)

    def _draw_scene(
        self,
        surface: pygame.Surface,
        camera: Camera,
        app_state: AppState,
        show: LiveView | RecordedView,
        display: GameDisplay | None,
        plates: dict[str, pygame.Rect],
    ) -> None:
        """Draw the scene and its inset, if any."""
        pull = None
        if isinstance(show, LiveView) and app_state.body_tools.held is not None:
            pull = app_state.body_tools.spring_line(show)
        snapshot = show.snapshot(frozenset(self.overlays), app_state.body_tools.picked, pull)
        if app_state.host is not None and display is not None:
            snapshot = replace(snapshot, lit=display.lit)
            rules = app_state.host.rules
            if isinstance(rules, HasViewState):
                snapshot = replace(snapshot, game=rules.view_state(snapshot.frame.time))
        if app_state.controls is not None:
            snapshot = app_state.controls.annotate(snapshot)
        status_plate = self._plates.get("state")
        if status_plate is not None:
            snapshot = replace(snapshot, below=float(status_plate.bottom))
        top, bottom = self.score_margins(app_state)
        antialias, ui_scale = self.antialias, self.ui_scale
        foot = self._scale_foot(app_state)
        self._renderer.draw(surface, camera, snapshot, antialias=antialias, ui_scale=ui_scale, foot=foot)
        area = self.area
        area = pygame.Rect(area.left, area.top + top, area.width, max(area.height - top - bottom, 0))
        aside = round(GRAPH_SIZE[0] * ui_scale) if "energy" in self.overlays else 0
        inset = self._inset.draw(surface, camera, snapshot, area, antialias=antialias, ui_scale=ui_scale, aside=aside)
        if inset is not None:
            plates["inset"] = inset

    def _play_sounds(self, app_state: AppState, show: LiveView | RecordedView) -> None:
        """Play the sounds of new contacts and of game events."""
        if show.contacts is not self._heard:
            self._heard = show.contacts
            if self._sounds.enabled:
                self._sounds.hits(show.contacts, show.bodies)
        for cue in app_state.host.cues() if app_state.host is not None else ():
            self._sounds.cue(cue)

    def describe_out_of_view(self, app_state: AppState) -> str | None:
        """Return the notice for a view without moving bodies; None if any is visible."""
        show = app_state.view
        if show is None or not self.bodies_out_of_view:
            return None
        moving = show.frame.present[: len(show.bodies)] & ~show.bodies.fixed[: len(show.frame.present)]
        words = ["All bodies are out of view: Home fits the view, F follows" if moving.any() else "No bodies are left"]
        launched = show.scene.play.relaunch
        if launched is not None and app_state.live is not None:
            words.append(f"Space relaunches {launched}")
        return " · ".join(words)

    def _draw_game(
        self,
        surface: pygame.Surface,
        app_state: AppState,
        show: LiveView | RecordedView,
        display: GameDisplay | None,
        plates: dict[str, pygame.Rect],
    ) -> None:
        """Draw the score panel, or the HUD of a game that has its own."""
        if app_state.controls is not None:
            app_state.controls.hud.draw(surface, self.area, self._hud_width(show), self.ui_scale)
            plates |= app_state.controls.hud.plates(self.area, self.ui_scale)
        elif display is not None:
            layout = self._layout_score(display.board, show)
            draw_score(surface, layout)
            plates["score"] = layout.rect

    def draw_wait(self, surface: pygame.Surface, text: str) -> None:
        """Draw a progress notice in the centre of the surface, which may be locked by an interrupted drawing call."""
        size = 15 * self.ui_scale
        width, height = text_size(text, size)
        note = pygame.Surface((round(width + 3 * size), round(height + 2 * size)), 0, surface)
        area = note.get_rect()
        note.fill(BACKGROUND)
        draw_box(note, area, round(0.5 * size))
        draw_text(note, text, area.center, size, INK, "center")
        place = note.get_rect(center=surface.get_rect().center)
        if not surface.get_locked():
            surface.blit(note, place)
            return
        # A locked surface does not accept blits, but its pixels can be written.
        seen = place.clip(surface.get_rect())
        area = seen.move(-place.x, -place.y)
        pixels = pygame.surfarray.array3d(note)[area.left : area.right, area.top : area.bottom]
        pygame.surfarray.pixels3d(surface)[seen.left : seen.right, seen.top : seen.bottom] = pixels

    def _draw_graph(
        self,
        surface: pygame.Surface,
        app_state: AppState,
        show: LiveView | RecordedView,
        plates: dict[str, pygame.Rect],
    ) -> None:
        """Draw the energy graph at the lower right, above other plates; smaller if there is little space."""
        self._graph.add(show.frame.time, *show.energy())
        area, margin = self.area, round(10 * self.ui_scale)
        taken = [*self.permanent_plates(app_state), *plates.values()]
        bottoms = sorted({area.bottom, *(rect.top for rect in taken if rect.height)}, reverse=True)
        for scale in (1.0, 0.8, 0.6, 0.45):
            rect = pygame.Rect(
                0, 0, round(scale * GRAPH_SIZE[0] * self.ui_scale), round(scale * GRAPH_SIZE[1] * self.ui_scale)
            )
            for bottom in bottoms:
                rect.bottomright = area.right - margin, bottom - margin
                if area.contains(rect) and rect.collidelist(taken) < 0:
                    plates["graph"] = rect
                    self._graph.draw(surface, rect, self.ui_scale)
                    return

    def _update_panel(self, app_state: AppState, recording: bool) -> None:
        """Update the panel if any value that it shows has changed or a widget has been used."""
        live, controls = app_state.live, app_state.controls
        toggles = {name: name in self.overlays for name in OVERLAYS}
        if live is not None:
            toggles |= {"ghost": live.diagnostics.has_ghost, "trust": live.diagnostics.divergence is not None}
        toggles |= {"sound": self._sounds.enabled, "antialias": self.antialias}
        hidden = {"pause" if app_state.paused else "play", "record" if recording else "stop"}
        buttons = tuple(name for name in BUTTONS if name not in hidden)
        session = (
            ()
            if live is None
            else (live.session, live.scene, live.settings, live.session.simulation.wanted, live.bodies)
        )
        choices = () if controls is None else controls.parameters()
        inputs = (
            *session,
            controls,
            *(each.value for each in choices),
            app_state.file,
            app_state.body_tools.picked,
            *toggles.values(),
            *buttons,
        )
        same = len(inputs) == len(self._panel_inputs) and all(map(is_, inputs, self._panel_inputs))
        if same and not self.panel.used:
            return
        self._panel_inputs, self.panel.used = inputs, False
        parameters: tuple[Parameter, ...] = ()
        if live is not None and app_state.file is not None:
            parameters = self._parameters.of(live, app_state.file, app_state.body_tools.picked)
        parameters += tuple(Parameter(key, label, value=value, choices=each) for key, label, value, each in choices)
        self.panel.show(parameters, toggles, buttons)

    def close(self) -> None:
        """Stop all sound."""
        self._sounds.disable()
