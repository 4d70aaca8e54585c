"""Desk: everything that is drawn, from the picture of the scene to the panel, and who takes which event first."""

from dataclasses import replace
from pathlib import Path

import pygame

from sandbox.games.artillery.view import add_artillery
from sandbox.games.billiards.view.hud import BilliardsHud
from sandbox.games.billiards.view.table_game import PLAYERS
from sandbox.window.app_state import AppState, scenes_to_pick
from sandbox.window.camera import Camera
from sandbox.window.input.bindings import KeyBindings, key_bindings
from sandbox.window.input.body_tools import describe_loss
from sandbox.window.messages import MAX_MESSAGES
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.parameters import Parameter, SessionParameters
from sandbox.window.playback.recorded import RecordedView
from sandbox.window.playback.snapshot import OVERLAYS, HudStatus
from sandbox.window.render.palette import BACKGROUND, INK
from sandbox.window.render.renderer import InsetRenderer, Renderer
from sandbox.window.render.text import draw_box, draw_text, text_size
from sandbox.window.sound import Sounds
from sandbox.window.ui import hud
from sandbox.window.ui.energy_plot import EnergyGraph
from sandbox.window.ui.help import HelpOverlay
from sandbox.window.ui.high_score_dialog import HighScoreDialog
from sandbox.window.ui.hud import hud_width
from sandbox.window.ui.panel import SidePanel
from sandbox.window.ui.scene_browser import SceneBrowser
from sandbox.window.ui.score_panel import covered_area, draw_score, layout_score
from sandbox.window.ui.status import hud_status, settings_text
from sandbox.window.ui.timeline import HEIGHT, Timeline

GRAPH_SIZE = (300, 130)
"""px at unit 1"""


class Gui:
    """What surrounds the picture, and what is switched on."""

    def __init__(self, size: tuple[int, int], unit: float) -> None:
        self.unit = unit
        self.overlays: set[str] = {"shapes"}
        """of `OVERLAYS`"""
        self.antialias = True
        self.panel = SidePanel(size, unit)
        self.manual = HelpOverlay()
        self.picker: SceneBrowser | None = None
        self.tools = BilliardsHud()
        self._high_scores = HighScoreDialog()
        self._timeline = Timeline()
        self._graph = EnergyGraph()
        self._picture, self._inset = Renderer(), InsetRenderer()
        self._sounds = Sounds()
        self._knobs = SessionParameters()
        self._size = size
        self._claims: tuple[object, KeyBindings] | None = None
        self._heard: object = None
        self.out_of_sight = False
        """none of the bodies that move is in the picture"""
        self._untold = False  # the keys that the scene claims
        self._faults = pygame.Rect(0, 0, 0, 0)  # where they are shown
        self._plates: dict[str, pygame.Rect] = {}

    def renew(self, same: bool) -> None:
        """Forget what was of the scene before."""
        self._graph.clear()
        if not same:
            self._claims, self._untold = None, True

    def resize(self, size: tuple[int, int]) -> None:
        """Fit all to a window of another size, px."""
        self._size = size
        self.panel.resize(size, self.unit)

    @property
    def foot(self) -> int:
        """What the timeline covers at the bottom of the window, px."""
        return round(HEIGHT * self.unit) if self.panel.visible else 0

    def taken(self, stage: AppState) -> list[pygame.Rect]:
        """Return what plates cover of the picture for as long as the scene is on, px; messages come and go.

        Of the state of things that is with the line that says that it is paused, so that pausing moves nothing.
        """
        show, free = stage.show, self._free
        if show is None:
            return []
        told = hud.layout_rows(replace(self.account(stage), paused=True, waits_for_start=False), free, self.unit)
        found = [told.rect]
        if stage.gestures is not None:
            found += self.tools.taken(stage.gestures.person, free, self._hud_width(show), self.unit)
        elif stage.host is not None:
            found.append(layout_score(stage.host.shown().board, free, self._hud_width(show), self.unit).rect)
        return found

    @property
    def plates(self) -> dict[str, pygame.Rect]:
        """What each plate covers, px, as it was last drawn."""
        return {name: rect for name, rect in self._plates.items() if rect.width and rect.height}

    def covered(self, stage: AppState) -> tuple[int, int]:
        """Return what the score panel covers at the top and at the bottom of the window, px."""
        if stage.host is None or stage.gestures is not None or stage.show is None:
            return 0, 0
        return covered_area(stage.host.shown().board, self._free, self._hud_width(stage.show), self.unit)

    @property
    def free(self) -> pygame.Rect:
        """What neither the panel nor the timeline covers."""
        return self._free

    @property
    def _free(self) -> pygame.Rect:
        """What neither the panel nor the timeline covers."""
        return pygame.Rect(0, 0, self._size[0] - self.panel.width, self._size[1] - self.foot)

    def _hud_width(self, show: LiveView | RecordedView) -> int:
        """Return how far to the right the state of things reaches, px."""
        return hud_width(f"{show.engine}  ·  {settings_text(show.settings)}", self.unit)

    @property
    def _area(self) -> pygame.Rect:
        """Where the timeline lies."""
        return pygame.Rect(0, self._size[1] - self.foot, self._size[0] - self.panel.width, self.foot)

    def claims(self, stage: AppState) -> KeyBindings:
        """Return the keys that the scene claims."""
        if not isinstance(stage.show, LiveView):
            return KeyBindings({}, (), {})
        key = stage.gestures or stage.host or stage.show.scene.play
        if self._claims is None or self._claims[0] is not key:
            self._claims = key, key_bindings(stage.show.scene, stage.hands, stage.gestures, stage.host)
        return self._claims[1]

    def claimed(self, stage: AppState) -> frozenset[int]:
        """Return the codes of those keys."""
        return frozenset(self.claims(stage).deeds)

    @property
    def covers(self) -> bool:
        """Whether help or the picker lies over the scene."""
        return self.picker is not None or self.manual.open

    def open_picker(self, path: Path | None) -> None:
        """Offer the scenes."""
        self.picker = SceneBrowser(scenes_to_pick(path))
        self.panel.release()

    def toggle_help(self) -> None:
        """Show help, or close it."""
        self.manual.open = not self.manual.open

    def toggle_sound(self) -> tuple[str, str]:
        """Turn sound on or off; return what is to be said of it, and its level."""
        if self._sounds.enabled:
            self._sounds.disable()
            return "sound off", "info"
        return ("sound on", "info") if self._sounds.enable() else (self._sounds.why, "warning")

    def handle(self, event: pygame.event.Event, stage: AppState) -> bool:
        """Let what lies on top take an event in; return whether it was used up.

        What ends a drag never is: whoever else holds something has to learn of it.
        """
        ends = event.type in (pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST)
        return self._use(event, stage) and not ends

    def _use(self, event: pygame.event.Event, stage: AppState) -> bool:
        if self.picker is not None and event.type != pygame.QUIT:
            path = self.picker.handle(event)
            count = stage.count_unsaved()
            if path is not None and count and self.picker.confirmed != path:
                self.picker.ask(path, describe_loss(count, "choose it again to open it anyway"))
                return True
            if path is not None:
                stage.take(path)
            if path is not None or self.picker.closed:
                self.picker = None
            return True
        if stage.host is not None and self._high_scores.handle_event(event):
            return True
        if self.manual.handle(event) or self._close_faults(event, stage) or self.panel.handle(event):
            return True
        show = stage.show
        if stage.gestures is not None and self.tools.handle(event, stage.gestures.person, stage.act):
            return True
        if show is not None and self._area.height:
            held = self._timeline.held
            time = self._timeline.handle(event, self._area)
            if time is not None:
                stage.paused = True
                show.scrub(time)
            if held and not self._timeline.held:
                stage.compute(show.settle)
            return held or self._timeline.held
        return False

    def _close_faults(self, event: pygame.event.Event, stage: AppState) -> bool:
        escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
        click = event.type == pygame.MOUSEBUTTONDOWN and event.button <= 3 and self._faults.collidepoint(event.pos)
        if not stage.faults or not (escape or click):
            return False
        stage.faults = ()
        return True

    def draw(
        self, surface: pygame.Surface, camera: Camera, stage: AppState, rate: float, recording: str | None
    ) -> None:
        """Draw all."""
        show = stage.show
        if self.picker is not None:
            self.picker.draw(surface, self.unit)
            return
        plates: dict[str, pygame.Rect] = {}
        above, below = self.covered(stage)
        foot = self.foot + below
        if show is None:
            surface.fill(BACKGROUND)
        else:
            pull = stage.hands.line(show) if isinstance(show, LiveView) else None
            sight = show.snapshot(frozenset(self.overlays), stage.hands.picked, pull)
            if stage.gestures is not None:
                sight = stage.gestures.seen.over(sight)
            if stage.host is not None:
                lit = replace(sight, lit=stage.host.shown().lit)
                sight = add_artillery(stage.host.rules, lit, present=not stage.host.live.peeking)
            told = self._plates.get("state")
            if told is not None:
                sight = replace(sight, below=float(told.bottom))
            depth = float(foot)
            self._picture.draw(surface, camera, sight, antialias=self.antialias, unit=self.unit, foot=depth)
            free = self._free
            free = pygame.Rect(free.left, free.top + above, free.width, max(free.height - above - below, 0))
            aside = round(GRAPH_SIZE[0] * self.unit) if "energy" in self.overlays else 0
            near = self._inset.draw(surface, camera, sight, free, antialias=self.antialias, unit=self.unit, aside=aside)
            if near is not None:
                plates["inset"] = near
            if show.contacts is not self._heard:
                self._heard = show.contacts
                self._sounds.hits(show.contacts, show.bodies)
            for cue in stage.host.cues() if stage.host is not None else ():
                self._sounds.cue(cue)
        if stage.game is None:
            self.tools.foot = 0
        if show is not None:
            if not self.manual.open:
                self._draw_play(surface, stage, self._hud_width(show), plates)
            self._draw_graph(surface, stage, plates)
        status = replace(self.status(stage, rate, recording), out_of_sight=self._describe_absence(stage))
        self._faults = hud.draw_hud(
            surface,
            status,
            self.unit,
            right=self.panel.width,
            bottom=self.foot,
            taken=[rect for rect in plates.values() if rect.width and rect.height],
            plates=plates,
        )
        if show is not None:
            if stage.host is not None and not self.manual.open:
                self._high_scores.draw(surface, self._free, self.unit)
            if self.foot:
                plates["timeline"] = self._area
                now = show.frame.time
                self._timeline.draw(surface, self._area, show.begin, now, show.end, show.marks, self.unit)
        self._plates = plates
        if self.panel.visible:
            plates["panel"] = pygame.Rect(self._size[0] - self.panel.width, 0, self.panel.width, self._size[1])
            self._show_panel(stage, recording is not None)
            self.panel.draw(surface)
        if self.manual.open:
            self.manual.draw(surface, self.unit, self.claims(stage).told)

    def _describe_absence(self, stage: AppState) -> str | None:
        """Return what can be done where nothing that moves is seen."""
        show = stage.show
        if show is None or not self.out_of_sight:
            return None
        moving = show.frame.present[: len(show.bodies)] & ~show.bodies.fixed[: len(show.frame.present)]
        words = ["All bodies are out of view: Home fits the view, F follows" if moving.any() else "No bodies are left"]
        launched = show.scene.play.relaunch
        if launched is not None and stage.live is not None:
            words.append(f"Space relaunches {launched}")
        return " · ".join(words)

    def _draw_play(self, surface: pygame.Surface, stage: AppState, left: int, plates: dict[str, pygame.Rect]) -> None:
        """Draw how a game stands, and what a player has at hand."""
        host = stage.host
        if stage.gestures is not None:
            self.tools.draw(surface, stage.gestures.person, self._free, left, self.unit)
            plates |= self.tools.plates(self._free, self.unit)
        elif host is not None:
            plates["score"] = draw_score(surface, host.shown().board, self._free, left, self.unit)
            for note in self._high_scores.update(host):
                stage.messages.tell(note, "warning")

    def draw_wait(self, surface: pygame.Surface, what: str) -> None:
        """Say over whatever was drawn what everything waits for; who was drawing may have locked the surface."""
        size = 15 * self.unit
        width, height = text_size(what, size)
        note = pygame.Surface((round(width + 3 * size), round(height + 2 * size)), 0, surface)
        area = note.get_rect()
        note.fill(BACKGROUND)
        draw_box(note, area, round(0.5 * size))
        draw_text(note, what, area.center, size, INK, "center")
        place = note.get_rect(center=surface.get_rect().center)
        if not surface.get_locked():
            surface.blit(note, place)
            return
        # Nothing can be blitted; what locks it writes its pixels directly, and so can this.
        seen = place.clip(surface.get_rect())
        area = seen.move(-place.x, -place.y)
        pixels = pygame.surfarray.array3d(note)[area.left : area.right, area.top : area.bottom]
        pygame.surfarray.pixels3d(surface)[seen.left : seen.right, seen.top : seen.bottom] = pixels

    def _draw_graph(self, surface: pygame.Surface, stage: AppState, plates: dict[str, pygame.Rect]) -> None:
        """Draw the energies at the lower right, above what lies there; smaller where that leaves no room."""
        show = stage.show
        if show is None or "energy" not in self.overlays:
            return
        self._graph.add(show.frame.time, *show.energy())
        margin, free, taken = round(10 * self.unit), self._free, [*self.taken(stage), *plates.values()]
        bottoms = sorted({free.bottom, *(rect.top for rect in taken if rect.height)}, reverse=True)
        for scale in (1.0, 0.8, 0.6, 0.45):
            rect = pygame.Rect(0, 0, round(scale * GRAPH_SIZE[0] * self.unit), round(scale * GRAPH_SIZE[1] * self.unit))
            for bottom in bottoms:
                rect.bottomright = free.right - margin, bottom - margin
                if free.contains(rect) and rect.collidelist(taken) < 0:
                    plates["graph"] = rect
                    self._graph.draw(surface, rect, self.unit)
                    return

    def _show_panel(self, stage: AppState, recording: bool) -> None:
        live = stage.live
        shown = (
            self._knobs.of(live, stage.file, stage.hands.picked) if live is not None and stage.file is not None else ()
        )
        if stage.game is not None:
            shown = (*shown, Parameter("players", "players", value=stage.game.players, choices=PLAYERS))
            if stage.game.match.rules.name == "snooker":
                misses = "on" if stage.game.misses else "off"
                shown = (*shown, Parameter("misses", "foul and a miss", value=misses, choices=("off", "on")))
        toggles = {name: name in self.overlays for name in OVERLAYS}
        if live is not None:
            toggles |= {"ghost": live.company.ghosted, "trust": live.company.trust is not None}
        toggles |= {"sound": self._sounds.enabled, "antialias": self.antialias}
        buttons = (
            "play" if stage.paused else "pause",
            "back",
            "step",
            "restart",
            "camera",
            "stop" if recording else "record",
            "save",
            "picker",
            "help",
        )
        self.panel.show(shown, toggles, buttons)

    def status(self, stage: AppState, rate: float, recording: str | None) -> HudStatus:
        """Return what is told in words."""
        if self._untold:
            self._untold = False
            told = self.claims(stage).told
            if stage.game is not None:
                stage.messages.tell("aim with the mouse, shoot with Space; H lists all keys")
            elif len(told) > MAX_MESSAGES:  # more than are seen at once
                stage.messages.tell(f"keys: {', '.join(keys for keys, _ in told)} (F1: help)")
            else:
                for keys, what in told:
                    stage.messages.tell(f"{keys}: {what}")
        return hud_status(stage, self.claims(stage).told, rate, recording)

    def account(self, stage: AppState) -> HudStatus:
        """Return what is told in words, with no word of what is recorded and how many pictures there are."""
        return hud_status(stage, self.claims(stage).told, 0.0, None)

    def close(self) -> None:
        """Fall silent."""
        self._sounds.disable()
