"""Picker: all scenes as cards to choose from, with a picture of each.

Thumbnail: a small picture of a scene at its start, with a faint look at where its bodies are a moment later.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygame

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import able, start
from sandbox.scene.compile.generators import GeneratorError
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import load
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame
from sandbox.window.camera import Box, Camera
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.palette import BACKGROUND, FAINT, INK, LINE, PANEL, PANEL_RAISED, SKY, WARNING
from sandbox.window.render.renderer import Renderer
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_size, wrap_text
from sandbox.window.view_bounds import should_rotate, view_bounds

FEW = 40
"""Bodies up to which a look ahead can still be read."""
WORK = 4000
"""bodies times solver steps that a look ahead may take"""
AHEAD = 0.12
"""share of a scene's duration that is looked ahead, at most half a second"""
BURST = 0.02
"""Where all begin within this share of what is framed, they are shown in flight instead."""
FLOWN = 0.5
"""share of a scene's duration for which they then have flown"""


@dataclass(frozen=True, eq=False)
class SceneThumbnail:
    """What a file holds: a scene, or what is wrong with it."""

    scene: Scene | None = None
    fault: str = ""


def read_scene(path: Path) -> SceneThumbnail:
    """Read a scene, with its bodies laid out, or the first of its faults."""
    try:
        scene = load(path)
        _ = scene.bodies
    except SceneError as error:
        first = str(error.faults[0]).removeprefix(f"{path}:").strip()
        return SceneThumbnail(fault=f"line {first}" if first[:1].isdigit() else first)
    except GeneratorError as error:
        return SceneThumbnail(fault=str(error))
    return SceneThumbnail(scene)


def draw_thumbnail(scene: Scene, size: tuple[int, int], picture: Renderer, unit: float) -> pygame.Surface:
    """Return a picture of a scene, size px wide and high."""
    made = pygame.Surface(size)
    box = view_bounds(scene)
    flown = _bursts(scene, box)
    tells = not flown and scene.play.area is None  # at a table nothing happens until somebody strikes
    later = _later(scene) if tells and 0 < len(scene.bodies) <= FEW else None
    frame = frame_in_flight(scene, FLOWN * scene.world.duration if flown else 0.0)
    camera = Camera.fitting(box, size, margin=0.08, turned=should_rotate(scene, size))
    picture.draw(made, camera, Snapshot(scene, scene.bodies, frame, ghost=later), unit=unit)
    return made


def _bursts(scene: Scene, box: Box) -> bool:
    """Tell whether many bodies that meet nothing begin at about one place."""
    bodies = scene.bodies
    if len(bodies) < 2 or any(element.collides != "none" for element in bodies.elements):
        return False
    (left, bottom), (right, top) = box
    extent = float(np.ptp(bodies.position, axis=0).max())
    return extent < BURST * max(right - left, top - bottom)


def frame_in_flight(scene: Scene, time: float = 0.0) -> Frame:
    """Return where the bodies are after a time in which they meet nothing, in still air without drag."""
    bodies = scene.bodies
    gravity = np.where(bodies.fixed[:, None], 0.0, np.asarray(scene.world.gravity))
    return Frame(
        time,
        bodies.position + bodies.velocity * time + 0.5 * gravity * time**2,
        bodies.velocity + gravity * time,
        bodies.angle + bodies.angular_velocity * time,
        bodies.angular_velocity.copy(),
        np.ones(len(bodies), np.bool_),
    )


def _later(scene: Scene) -> Frame | None:
    """Return the bodies a moment later, or None where no engine tells that cheaply."""
    settings = scene.solver
    most = WORK // (len(scene.bodies) * settings.substeps)
    steps = min(round(min(AHEAD * scene.world.duration, 0.5) / settings.dt), most)
    if steps < 1 or "pymunk" not in able(scene):
        return None
    simulation = start(scene, "pymunk")
    try:
        for _ in range(steps):
            simulation.step()
        return simulation.frame()
    except (Divergence, Exhaustion):
        return None
    finally:
        simulation.close()


CARD = 236
"""px at unit 1, how wide a card is at least"""
MOST_COLUMNS = 5
SCROLL = 80
"""px at unit 1, a notch of the wheel"""
LONGEST_FILTER = 60

_MOVES = {pygame.K_LEFT: -1, pygame.K_RIGHT: 1}
_LEAPS = {pygame.K_UP: -1, pygame.K_DOWN: 1, pygame.K_PAGEUP: -3, pygame.K_PAGEDOWN: 3}


class SceneCard:
    """A scene's file, and what is known of it so far."""

    def __init__(self, name: str, path: Path) -> None:
        self.name, self.path = name, path
        self.found: SceneThumbnail | None = None
        self.picture: pygame.Surface | None = None

    @property
    def title(self) -> str:
        """The scene's title, or the file's name until it was read."""
        scene = self.found.scene if self.found else None
        return scene.title if scene is not None and scene.title else self.name.rpartition("/")[2]

    @property
    def folder(self) -> str:
        """Where it lies."""
        return self.name.rpartition("/")[0]

    @property
    def about(self) -> str:
        """What to look for."""
        scene = self.found.scene if self.found else None
        return scene.about if scene is not None else ""

    def is_called(self, text: str) -> bool:
        """Tell whether a text is its name, with or without its folder, or its title."""
        return text.casefold() in (self.name.casefold(), self.name.rpartition("/")[2].casefold(), self.title.casefold())

    def fits(self, words: Sequence[str]) -> bool:
        """Tell whether all words are found in what it says."""
        text = f"{self.name} {self.title} {self.about}".casefold()
        return all(word in text for word in words)


class SceneBrowser:
    """A grid of cards over the whole window. Files are read, and pictures drawn, one each time it is drawn."""

    def __init__(self, scenes: Sequence[tuple[str, Path]]) -> None:
        """Offer scenes by name, such as `tutorial/bounce`, and file."""
        self.cards = [SceneCard(name, Path(path)) for name, path in scenes]
        self.typed = ""
        """what cards are filtered by"""
        self.chosen = 0
        """of the cards that are shown"""
        self.confirmed: Path | None = None
        """chosen once already, where opening it loses something"""
        self._note = ""
        self.closed = False
        """Somebody wants none of them."""
        self._picture = Renderer()
        self._places: list[tuple[SceneCard, pygame.Rect]] = []
        self._columns = 1
        self._scroll = 0
        self._unit = 1.0
        self._follow = True
        self._pressed: SceneCard | None = None
        self._size = 0, 0

    @property
    def shown(self) -> list[SceneCard]:
        """The cards that fit what was typed; those that are called so come first."""
        words = self.typed.casefold().split()
        fitting = [card for card in self.cards if card.fits(words)]
        return sorted(fitting, key=lambda card: not card.is_called(self.typed))

    def ask(self, path: Path, note: str) -> None:
        """Say what opening a scene would lose; chosen once more, it is opened."""
        self.confirmed, self._note = path, note

    def handle_event(self, event: pygame.event.Event) -> Path | None:
        """Take an event in, and return the file of the scene that it chooses, if it does."""
        if event.type == pygame.KEYDOWN:
            return self._key(event)
        if event.type == pygame.MOUSEWHEEL:
            self._scroll -= round(event.y * SCROLL * self._unit)
        elif event.type == pygame.MOUSEMOTION:
            card = self._card_at(event.pos)
            if card is not None:
                self.chosen = self.shown.index(card)
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self._pressed = self._card_at(event.pos)
        elif event.type == pygame.MOUSEBUTTONUP and event.button == 1:
            pressed, self._pressed = self._pressed, None
            if pressed is not None and pressed is self._card_at(event.pos):
                return pressed.path
        return None

    def _card_at(self, at: tuple[int, int]) -> SceneCard | None:
        """Return the card under the pointer, of those that still fit the filter."""
        shown = self.shown
        return next((card for card, place in self._places if place.collidepoint(at) and card in shown), None)

    def _key(self, event: pygame.event.Event) -> Path | None:
        shown = self.shown
        control = getattr(event, "mod", 0) & pygame.KMOD_CTRL
        letter = str(getattr(event, "unicode", ""))
        self._follow = True
        if event.key == pygame.K_ESCAPE or (control and event.key == pygame.K_o):
            self.closed = True
        elif event.key in (pygame.K_RETURN, pygame.K_KP_ENTER):
            return shown[min(self.chosen, len(shown) - 1)].path if shown else None
        elif event.key in _MOVES or event.key in _LEAPS:
            by = _MOVES.get(event.key, 0) + _LEAPS.get(event.key, 0) * self._columns
            self.chosen = min(max(self.chosen + by, 0), max(len(shown) - 1, 0))
        elif event.key in (pygame.K_HOME, pygame.K_END):
            self.chosen = 0 if event.key == pygame.K_HOME else max(len(shown) - 1, 0)
        elif event.key == pygame.K_BACKSPACE:
            self._filter("" if control else self.typed[:-1])
        elif letter.isprintable() and len(letter) == 1 and not control:
            self._filter((self.typed + letter)[:LONGEST_FILTER].lstrip())
        return None

    def _filter(self, typed: str) -> None:
        self.typed, self.chosen, self._scroll = typed, 0, 0

    def draw(self, surface: pygame.Surface, unit: float) -> None:
        """Draw the cards over the whole picture, and read or picture one more of them."""
        self._unit, self._size = unit, surface.get_size()
        surface.fill(BACKGROUND)
        size = 14 * min(unit, max(surface.get_width() / 460, 0.6 * unit))
        margin = round(1.6 * size)
        head = self._draw_head(surface, size, margin)
        free = pygame.Rect(margin, head, surface.get_width() - 2 * margin, surface.get_height() - head)
        if free.width < size or free.height < size:
            return
        shown = self.shown
        self._lay_out(shown, free, size)
        clip = surface.get_clip()
        surface.set_clip(pygame.Rect(0, head, surface.get_width(), free.height))
        in_sight = [(card, place) for card, place in self._places if place.colliderect(free)]
        for card, place in in_sight:
            self._draw_card(surface, card, place, size, shown.index(card) == self.chosen)
        surface.set_clip(clip)
        if not shown:
            text = f"no scene matches “{self.typed}”" if self.cards else "no scenes found"
            draw_text(surface, ellipsis(text, size, free.width), free.center, size, FAINT, "center")
        self._work(in_sight)

    def _draw_head(self, surface: pygame.Surface, size: float, margin: int) -> int:
        """Draw the title and what was typed, and return where they end."""
        width = surface.get_width() - 2 * margin
        title = ellipsis("Open a scene", 1.5 * size, width, bold=True)
        rect = draw_text(surface, title, (margin, margin), 1.5 * size, INK, bold=True)
        hint = "type to filter · Enter: open · Esc: close"
        box = pygame.Rect(rect.right + 2 * size, rect.top - 0.2 * size, 0, 2.2 * size)
        box.width = min(round(26 * size), surface.get_width() - margin - box.left)
        if box.width > 8 * size:
            draw_box(surface, box, 0.5 * size, PANEL, 255, SKY if self.typed else LINE)
            at = box.left + 0.8 * size, box.centery
            text = ellipsis(self.typed or hint, size, box.width - 1.6 * size)
            word = draw_text(surface, text, at, size, INK if self.typed else FAINT, "midleft")
            if self.typed:
                x = word.right + max(round(0.1 * size), 1)
                pygame.draw.line(surface, SKY, (x, box.top + 0.5 * size), (x, box.bottom - 0.5 * size))
        if self._note:
            note = ellipsis(self._note, size, width)
            rect = draw_text(surface, note, (margin, rect.bottom + 0.6 * size), size, WARNING, bold=True)
        return round(rect.bottom + 1.2 * size)

    def _lay_out(self, shown: Sequence[SceneCard], free: pygame.Rect, size: float) -> None:
        """Place the cards in a grid, scrolled so that the chosen one is in sight."""
        gap = round(1.1 * size)
        least = max(CARD * size / 14, free.width / MOST_COLUMNS - gap)
        self._columns = max(int((free.width + gap) // (least + gap)), 1)
        wide = (free.width - gap * (self._columns - 1)) // self._columns
        high = round(wide * 0.56 + 6.4 * size)
        self.chosen = min(max(self.chosen, 0), max(len(shown) - 1, 0))
        rows = -(-len(shown) // self._columns)
        if self._follow:
            top = self.chosen // self._columns * (high + gap)
            self._scroll = min(max(self._scroll, top + high + gap - free.height), top)
            self._follow = False
        self._scroll = min(max(self._scroll, 0), max(rows * (high + gap) - free.height, 0))
        self._places = []
        for k, card in enumerate(shown):
            row, column = divmod(k, self._columns)
            left, top = free.left + column * (wide + gap), free.top + row * (high + gap) - self._scroll
            self._places.append((card, pygame.Rect(left, top, wide, high)))

    def _draw_card(
        self, surface: pygame.Surface, card: SceneCard, place: pygame.Rect, size: float, chosen: bool
    ) -> None:
        pad, edge = round(0.7 * size), max(round(size / 7), 2)
        look = self._look(place)
        draw_box(surface, place, 0.6 * size, PANEL_RAISED if chosen else PANEL, 255, LINE)
        if card.picture is not None:
            picture = card.picture
            if picture.get_size() != look.size:  # until it is drawn anew
                picture = pygame.transform.smoothscale(picture, look.size)
            surface.blit(picture, look)
        else:
            pygame.draw.rect(surface, BACKGROUND, look)
        room = place.width - 2 * pad
        if card.found is not None and card.found.fault:
            lines = wrap_text(card.found.fault, 0.85 * size, look.width - 2 * pad, 5, mono=True)
            for k, line in enumerate(("faulty", *lines)):
                at = look.left + pad, look.top + pad + (k + 0.5) * 1.25 * size
                draw_text(surface, line, at, (1.0 if k == 0 else 0.85) * size, WARNING, "midleft", k == 0, k > 0)
        y = look.bottom + 0.5 * size
        folder = ellipsis(card.folder, 0.85 * size, room / 2)
        taken = text_size(folder, 0.85 * size)[0] + round(0.6 * size)
        draw_text(
            surface, ellipsis(card.title, size, room - taken, bold=True), (place.left + pad, y), size, INK, bold=True
        )
        draw_text(surface, folder, (place.right - pad, y + 0.1 * size), 0.85 * size, SKY, "topright")
        for k, line in enumerate(wrap_text(card.about, 0.85 * size, room, 3)):
            draw_text(surface, line, (place.left + pad, y + (1.5 + 1.2 * k) * size), 0.85 * size, FAINT)
        if chosen:
            pygame.draw.rect(surface, SKY, place, edge, border_radius=round(0.6 * size))

    @staticmethod
    def _look(place: pygame.Rect) -> pygame.Rect:
        """Return where on a card its picture lies."""
        edge = max(place.width // 60, 2)
        return pygame.Rect(
            place.left + edge, place.top + edge, place.width - 2 * edge, round(0.56 * place.width) - edge
        )

    def _work(self, in_sight: Sequence[tuple[SceneCard, pygame.Rect]]) -> None:
        """Read one file, or draw one picture: of a card in sight, else read one of the others."""
        for card, place in in_sight:
            if card.found is None:
                card.found = read_scene(card.path)
                return
            size = self._look(place).size
            if card.found.scene is not None and (card.picture is None or card.picture.get_size() != size):
                card.picture = draw_thumbnail(card.found.scene, size, self._picture, 0.7 * self._unit)
                return
        unread = next((card for card in self.cards if card.found is None), None)
        if unread is not None:
            unread.found = read_scene(unread.path)
