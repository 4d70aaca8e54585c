"""Scene browser: a grid of cards with thumbnails of scenes.

A thumbnail shows the initial state of a scene, with a ghost of its bodies a moment later.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygame

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import able, start
from sandbox.scene.compile.generators import GeneratorError
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import load
from sandbox.trajectory import Frame
from sandbox.window.camera import Camera, ViewBox
from sandbox.window.input.keymap import latin_key
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.palette import BACKGROUND, FAINT, INK, LINE, PANEL, PANEL_RAISED, SKY, WARNING
from sandbox.window.render.renderer import Renderer
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_size, wrap_text
from sandbox.window.ui.text_edit import TextEdit, draw_text_edit, is_text_shortcut
from sandbox.window.view_bounds import should_rotate, view_bounds

MAX_PREVIEW_BODIES = 40
"""number of bodies above which a thumbnail has no ghost, as it would be illegible"""
MAX_PREVIEW_BODY_STEPS = 4000
"""limit of bodies times solver steps simulated for a ghost"""
PREVIEW_FRACTION = 0.12
"""time of the ghost as a fraction of the scene's duration, at most 0.5 s"""
BURST_EXTENT_FRACTION = 0.02
"""extent of the initial positions, as a fraction of the view, below which bodies are shown in flight"""
BURST_TIME_FRACTION = 0.5
"""time of that flight as a fraction of the scene's duration"""


@dataclass(frozen=True, eq=False)
class SceneThumbnail:
    """Content of a scene file: a scene, or its first fault."""

    scene: Scene | None = None
    fault: str = ""


def read_scene(path: Path) -> SceneThumbnail:
    """Read a scene file and generate its bodies; return the scene or its first fault."""
    try:
        scene = load(path)
        _ = scene.bodies
    except SceneError as error:
        first = str(error.faults[0]).removeprefix(f"{path}:").strip()
        return SceneThumbnail(fault=f"line {first}" if first[:1].isdigit() else first)
    except GeneratorError as error:
        return SceneThumbnail(fault=str(error))
    return SceneThumbnail(scene)


def draw_thumbnail(scene: Scene, size: tuple[int, int], renderer: Renderer, ui_scale: float) -> pygame.Surface:
    """Return a thumbnail of a scene; `size` is its width and height, px."""
    surface = pygame.Surface(size)
    box = view_bounds(scene)
    is_burst = _is_burst(scene, box)
    has_motion = not is_burst and scene.play.area is None  # at a table nothing moves before the first shot
    ghost = _preview_frame(scene) if has_motion and 0 < len(scene.bodies) <= MAX_PREVIEW_BODIES else None
    frame = frame_in_flight(scene, BURST_TIME_FRACTION * scene.world.duration if is_burst else 0.0)
    camera = Camera.fitting(box, size, margin=0.08, turned=should_rotate(scene, size))
    renderer.draw(surface, camera, Snapshot(scene, scene.bodies, frame, ghost=ghost), ui_scale=ui_scale)
    return surface


def _is_burst(scene: Scene, box: ViewBox) -> bool:
    """Return whether all bodies start close to one point and collide with nothing."""
    bodies = scene.bodies
    if len(bodies) < 2 or any(element.collides != "none" for element in bodies.elements):
        return False
    (left, bottom), (right, top) = box
    extent = float(np.ptp(bodies.position, axis=0).max())
    return extent < BURST_EXTENT_FRACTION * max(right - left, top - bottom)


def frame_in_flight(scene: Scene, time: float = 0.0) -> Frame:
    """Return the state of the bodies after a time, s, of free flight without drag or collisions."""
    bodies = scene.bodies
    gravity = np.where(bodies.fixed[:, None], 0.0, bodies.gravity_scale[:, None] * np.asarray(scene.world.gravity))
    return Frame(
        time,
        bodies.position + bodies.velocity * time + 0.5 * gravity * time**2,
        bodies.velocity + gravity * time,
        bodies.angle + bodies.angular_velocity * time,
        bodies.angular_velocity.copy(),
        np.ones(len(bodies), np.bool_),
    )


def _preview_frame(scene: Scene) -> Frame | None:
    """Return the state of the bodies a moment later; None if the simulation would be slow or is impossible."""
    settings = scene.solver
    max_steps = MAX_PREVIEW_BODY_STEPS // (len(scene.bodies) * settings.substeps)
    steps = min(round(min(PREVIEW_FRACTION * scene.world.duration, 0.5) / settings.dt), max_steps)
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


MIN_CARD_WIDTH = 236
"""px at UI scale 1"""
MAX_COLUMNS = 5
SCROLL_STEP = 80
"""px at UI scale 1 per notch of the wheel"""
MAX_FILTER_LENGTH = 60

_MOVES = {pygame.K_LEFT: -1, pygame.K_RIGHT: 1}
_ROW_MOVES = {pygame.K_UP: -1, pygame.K_DOWN: 1, pygame.K_PAGEUP: -3, pygame.K_PAGEDOWN: 3}


class SceneCard:
    """A scene file, and its thumbnail once loaded."""

    def __init__(self, name: str, path: Path) -> None:
        self.name, self.path = name, path
        self.thumbnail: SceneThumbnail | None = None
        self.image: pygame.Surface | None = None

    @property
    def title(self) -> str:
        """Title of the scene; until the file is read, its name."""
        scene = self.thumbnail.scene if self.thumbnail else None
        return scene.title if scene is not None and scene.title else self.name.rpartition("/")[2]

    @property
    def folder(self) -> str:
        """Folder of the file."""
        return self.name.rpartition("/")[0]

    @property
    def about(self) -> str:
        """Description of the scene; empty until the file is read."""
        scene = self.thumbnail.scene if self.thumbnail else None
        return scene.about if scene is not None else ""

    def is_called(self, text: str) -> bool:
        """Return whether a text equals the title or the name, with or without its folder."""
        return text.casefold() in (self.name.casefold(), self.name.rpartition("/")[2].casefold(), self.title.casefold())

    def matches(self, words: Sequence[str]) -> bool:
        """Return whether the name, title or description contains all words."""
        text = f"{self.name} {self.title} {self.about}".casefold()
        return all(word in text for word in words)


class SceneBrowser:
    """Grid of cards over the whole window. Each frame reads one file or draws one thumbnail."""

    def __init__(self, scenes: Sequence[tuple[str, Path]]) -> None:
        """Create a browser of scenes, given as (name, file); a name is, for example, `tutorial/bounce`."""
        self.cards = [SceneCard(name, Path(path)) for name, path in scenes]
        self._edit = TextEdit("", max_length=MAX_FILTER_LENGTH)
        self._shift = 0  # px by which the filter is moved to the left
        self.chosen = 0
        """index among the matching cards"""
        self.confirmed: Path | None = None
        """file that was chosen once and must be chosen again, as opening it would lose changes"""
        self._note = ""
        self.closed = False
        """whether the user has closed the browser"""
        self._renderer = Renderer()
        self._rects: list[tuple[SceneCard, pygame.Rect]] = []
        self._columns = 1
        self._scroll = 0
        self._ui_scale = 1.0
        self._follow = True
        self._pressed: SceneCard | None = None
        self._size = 0, 0

    @property
    def typed(self) -> str:
        """Filter text."""
        return self._edit.text

    @property
    def shown(self) -> list[SceneCard]:
        """The cards that match the filter; exact matches of name or title come first."""
        words = self.typed.casefold().split()
        fitting = [card for card in self.cards if card.matches(words)]
        return sorted(fitting, key=lambda card: not card.is_called(self.typed))

    def ask(self, path: Path, note: str) -> None:
        """Show a note on what opening a scene would lose; choosing it again opens it."""
        self.confirmed, self._note = path, note

    def handle_event(self, event: pygame.event.Event) -> Path | None:
        """Process an event; return the file of the scene that it chooses, if any.

        Raises:
            ClipboardError: a text was to be copied or pasted, and the system gives no access to its clipboard.
        """
        if event.type == pygame.KEYDOWN:
            return self._key(event)
        if event.type == pygame.MOUSEWHEEL:
            self._scroll -= round(event.y * SCROLL_STEP * self._ui_scale)
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

    def _card_at(self, position: tuple[int, int]) -> SceneCard | None:
        """Return the matching card at a position, if any."""
        shown = self.shown
        return next(
            (card for card, card_rect in self._rects if card_rect.collidepoint(position) and card in shown), None
        )

    def _key(self, event: pygame.event.Event) -> Path | None:
        shown = self.shown
        control = getattr(event, "mod", 0) & pygame.KMOD_CTRL
        letter = str(getattr(event, "unicode", ""))
        self._follow = True
        typed = self.typed
        if is_text_shortcut(event):
            self._edit.press(event)
        elif event.key == pygame.K_ESCAPE or (control and latin_key(event) == pygame.K_o):
            self.closed = True
        elif event.key in (pygame.K_RETURN, pygame.K_KP_ENTER):
            return shown[min(self.chosen, len(shown) - 1)].path if shown else None
        elif event.key in _MOVES or event.key in _ROW_MOVES:
            offset = _MOVES.get(event.key, 0) + _ROW_MOVES.get(event.key, 0) * self._columns
            self.chosen = min(max(self.chosen + offset, 0), max(len(shown) - 1, 0))
        elif event.key in (pygame.K_HOME, pygame.K_END):
            self.chosen = 0 if event.key == pygame.K_HOME else max(len(shown) - 1, 0)
        elif event.key == pygame.K_BACKSPACE:
            if control:
                self._edit.select_all()
            self._edit.delete(-1)
        elif letter.isprintable() and len(letter) == 1 and not control:
            self._edit.insert(letter if self.typed else letter.lstrip())
        if self.typed != typed:
            self.chosen = self._scroll = 0
        return None

    def draw(self, surface: pygame.Surface, ui_scale: float) -> None:
        """Draw the browser over the whole window, and read one more file or draw one more thumbnail."""
        self._ui_scale, self._size = ui_scale, surface.get_size()
        surface.fill(BACKGROUND)
        size = 14 * min(ui_scale, max(surface.get_width() / 460, 0.6 * ui_scale))
        margin = round(1.6 * size)
        top_margin = self._draw_header(surface, size, margin)
        area = pygame.Rect(margin, top_margin, surface.get_width() - 2 * margin, surface.get_height() - top_margin)
        if area.width < size or area.height < size:
            return
        shown = self.shown
        self._layout_cards(shown, area, size)
        clip = surface.get_clip()
        surface.set_clip(pygame.Rect(0, top_margin, surface.get_width(), area.height))
        in_sight = [(card, card_rect) for card, card_rect in self._rects if card_rect.colliderect(area)]
        for card, card_rect in in_sight:
            self._draw_card(surface, card, card_rect, size, shown.index(card) == self.chosen)
        surface.set_clip(clip)
        if not shown:
            text = f"no scene matches “{self.typed}”" if self.cards else "no scenes found"
            draw_text(surface, ellipsis(text, size, area.width), area.center, size, FAINT, "center")
        self._load_one(in_sight)

    def _draw_header(self, surface: pygame.Surface, size: float, margin: int) -> int:
        """Draw the title and the filter; return the y below them."""
        width = surface.get_width() - 2 * margin
        title = ellipsis("Open a scene", 1.5 * size, width, bold=True)
        rect = draw_text(surface, title, (margin, margin), 1.5 * size, INK, bold=True)
        hint = "type to filter · Enter: open · Esc: close"
        box = pygame.Rect(rect.right + 2 * size, rect.top - 0.2 * size, 0, 2.2 * size)
        box.width = min(round(26 * size), surface.get_width() - margin - box.left)
        if box.width > 8 * size:
            draw_box(surface, box, 0.5 * size, PANEL, 255, SKY if self.typed else LINE)
            if self.typed:
                area = box.inflate(-round(1.6 * size), 0)
                self._shift = draw_text_edit(surface, self._edit, area, size, self._shift)
            else:
                text = ellipsis(hint, size, box.width - 1.6 * size)
                draw_text(surface, text, (box.left + 0.8 * size, box.centery), size, FAINT, "midleft")
        if self._note:
            note = ellipsis(self._note, size, width)
            rect = draw_text(surface, note, (margin, rect.bottom + 0.6 * size), size, WARNING, bold=True)
        return round(rect.bottom + 1.2 * size)

    def _layout_cards(self, shown: Sequence[SceneCard], area: pygame.Rect, size: float) -> None:
        """Lay out the cards in a grid, scrolled to make the chosen card visible."""
        gap = round(1.1 * size)
        min_width = max(MIN_CARD_WIDTH * size / 14, area.width / MAX_COLUMNS - gap)
        self._columns = max(int((area.width + gap) // (min_width + gap)), 1)
        width = (area.width - gap * (self._columns - 1)) // self._columns
        height = round(width * 0.56 + 6.4 * size)
        self.chosen = min(max(self.chosen, 0), max(len(shown) - 1, 0))
        rows = -(-len(shown) // self._columns)
        if self._follow:
            top = self.chosen // self._columns * (height + gap)
            self._scroll = min(max(self._scroll, top + height + gap - area.height), top)
            self._follow = False
        self._scroll = min(max(self._scroll, 0), max(rows * (height + gap) - area.height, 0))
        self._rects = []
        for k, card in enumerate(shown):
            row, column = divmod(k, self._columns)
            left, top = area.left + column * (width + gap), area.top + row * (height + gap) - self._scroll
            self._rects.append((card, pygame.Rect(left, top, width, height)))

    def _draw_card(
        self, surface: pygame.Surface, card: SceneCard, card_rect: pygame.Rect, size: float, chosen: bool
    ) -> None:
        pad, edge = round(0.7 * size), max(round(size / 7), 2)
        image_rect = self._image_rect(card_rect)
        draw_box(surface, card_rect, 0.6 * size, PANEL_RAISED if chosen else PANEL, 255, LINE)
        if card.image is not None:
            picture = card.image
            if picture.get_size() != image_rect.size:  # scaled until it is redrawn at this size
                picture = pygame.transform.smoothscale(picture, image_rect.size)
            surface.blit(picture, image_rect)
        else:
            pygame.draw.rect(surface, BACKGROUND, image_rect)
        max_width = card_rect.width - 2 * pad
        if card.thumbnail is not None and card.thumbnail.fault:
            lines = wrap_text(card.thumbnail.fault, 0.85 * size, image_rect.width - 2 * pad, 5, mono=True)
            for k, line in enumerate(("faulty", *lines)):
                position = image_rect.left + pad, image_rect.top + pad + (k + 0.5) * 1.25 * size
                draw_text(surface, line, position, (1.0 if k == 0 else 0.85) * size, WARNING, "midleft", k == 0, k > 0)
        y = image_rect.bottom + 0.5 * size
        folder = ellipsis(card.folder, 0.85 * size, max_width / 2)
        taken = text_size(folder, 0.85 * size)[0] + round(0.6 * size)
        draw_text(
            surface,
            ellipsis(card.title, size, max_width - taken, bold=True),
            (card_rect.left + pad, y),
            size,
            INK,
            bold=True,
        )
        draw_text(surface, folder, (card_rect.right - pad, y + 0.1 * size), 0.85 * size, SKY, "topright")
        for k, line in enumerate(wrap_text(card.about, 0.85 * size, max_width, 3)):
            draw_text(surface, line, (card_rect.left + pad, y + (1.5 + 1.2 * k) * size), 0.85 * size, FAINT)
        if chosen:
            pygame.draw.rect(surface, SKY, card_rect, edge, border_radius=round(0.6 * size))

    @staticmethod
    def _image_rect(card_rect: pygame.Rect) -> pygame.Rect:
        """Return the rectangle of a card's image."""
        edge = max(card_rect.width // 60, 2)
        return pygame.Rect(
            card_rect.left + edge,
            card_rect.top + edge,
            card_rect.width - 2 * edge,
            round(0.56 * card_rect.width) - edge,
        )

    def _load_one(self, in_sight: Sequence[tuple[SceneCard, pygame.Rect]]) -> None:
        """Read the file or draw the thumbnail of one visible card; if all are done, read the file of another card."""
        for card, card_rect in in_sight:
            if card.thumbnail is None:
                card.thumbnail = read_scene(card.path)
                return
            size = self._image_rect(card_rect).size
            if card.thumbnail.scene is not None and (card.image is None or card.image.get_size() != size):
                card.image = draw_thumbnail(card.thumbnail.scene, size, self._renderer, 0.7 * self._ui_scale)
                return
        unread = next((card for card in self.cards if card.thumbnail is None), None)
        if unread is not None:
            unread.thumbnail = read_scene(unread.path)
