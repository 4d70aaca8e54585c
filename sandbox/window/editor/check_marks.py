"""Marks of the live check: warnings at the elements that cause them, a plate of the whole scene, and remedies."""

from collections.abc import Sequence
from enum import Enum, auto
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.measure.preflight.checks import FAILED
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Plane
from sandbox.scene.editing.elements import ElementKey, bodies_of, element_at, exists, name_of
from sandbox.window.camera import Camera
from sandbox.window.editor.live_check import CheckResult, Remedy, SceneMark
from sandbox.window.editor.picking import bounds_of
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.palette import (
    BACKGROUND,
    FAINT,
    GREEN,
    INK,
    LINE,
    ORANGE,
    PANEL,
    PANEL_RAISED,
    SKY,
    WARNING,
    RgbColour,
    mix_colours,
)
from sandbox.window.render.text import TextPlate, draw_box, draw_text, draw_text_lines, ellipsis, text_size, wrap_text
from sandbox.window.ui.hud import draw_mark

TEXT_SIZE = 12.5
"""px at UI scale 1"""
PLATE_WIDTH, CARD_WIDTH = 300, 340
"""px at UI scale 1, largest widths"""
PLATE_HEIGHT_FRACTION = 0.5
"""largest height of the plate as a fraction of the area"""
MAX_LINES = 5
"""warnings that the plate lists at once"""
MAX_MARKED = 200
"""elements that get a mark"""
MAX_EXACT_BODIES = 50
"""bodies of an element up to which its exact bounds are computed; above, those of their bounding discs"""

CERTAIN_KINDS = frozenset({"overlap", "anchors", "joint_start", "duration", FAILED})
"""Kinds of problems that occur in any case, and not only at some phases or speeds."""
TITLES = {
    "depth": "deep contact",
    "entry": "missed entry",
    "iterations": "few iterations",
    "kick_threshold": "kick at rest",
    "anchors": "swapped anchors",
    "joint_start": "joint error",
    "spring": "stiff spring",
    "orbit": "close orbit",
    "chain": "long chain",
    "stack": "high stack",
    "mass_ratio": "mass ratio",
    "event_rate": "event rate",
    "duration": "long step",
    FAILED: "failed check",
}
"""Short names of diagnostics; others are called by their kind."""


class PlatePart(Enum):
    """Part of the plate or of a card."""

    HEADING = auto()
    MORE = auto()
    """line of the warnings that are not listed"""
    PLATE = auto()
    CARD = auto()


class EngineChip(NamedTuple):
    """Name of an engine on the plate."""

    engine: str
    lacks: tuple[str, ...]
    """features that the scene needs"""


Target = SceneMark | Remedy | EngineChip | PlatePart
"""What is at a position."""


class MarkPlace(NamedTuple):
    """Mark of a diagnostic at an element."""

    mark: SceneMark
    centre: tuple[float, float]
    """px"""


class CheckMarks:
    """Marks of the live check on the scene, and its plate at the lower right."""

    def __init__(self) -> None:
        self.is_folded = False
        """whether the plate shows its heading only"""
        self.takes_marks = True
        """whether marks on the scene react to the pointer: not while something is drawn or moved there"""
        self.rect = pygame.Rect(0, 0, 0, 0)
        """px, of the plate as last drawn"""
        self.card = pygame.Rect(0, 0, 0, 0)
        """px, of the message that is shown; empty without one"""
        self._targets: list[tuple[pygame.Rect, Target]] = []
        self._anchor = pygame.Rect(0, 0, 0, 0)
        self._hovered: SceneMark | None = None
        self._pinned: SceneMark | None = None
        self._pressed: Target | None = None
        self._pointer = (-1, -1)
        self._first, self._listed = 0, 0
        self._bounds: dict[ElementKey, tuple[Point, Point] | None] = {}
        self._bounds_of: Scene | None = None

    @property
    def plates(self) -> list[pygame.Rect]:
        """Rectangles that are drawn over the scene, px."""
        return [rect for rect in (self.rect, self.card) if rect.width]

    @property
    def shown(self) -> SceneMark | None:
        """The diagnostic whose message is shown."""
        return (self._pinned or self._hovered) if self.takes_marks else None

    def rects_of(self, target: Target) -> list[pygame.Rect]:
        """Return the rectangles at which something can be clicked, px, as last drawn; the topmost first."""
        return [rect for rect, each in reversed(self._targets) if each == target]

    # --- Events --------------------------------------------------------------------------------------------------

    def handle_event(self, event: pygame.event.Event) -> tuple[bool, Remedy | None]:
        """Process an event; return whether it was consumed, and a remedy that was clicked."""
        if event.type == pygame.MOUSEMOTION:
            self._pointer = event.pos
            if not event.buttons[0]:
                self._hover(event.pos)
            return False, None
        if event.type == pygame.MOUSEBUTTONDOWN and event.button <= 3:
            return self._press(event), None
        if event.type == pygame.MOUSEBUTTONUP and event.button == 1 and self._pressed is not None:
            pressed, self._pressed = self._pressed, None
            return True, self._click(pressed) if self._target_at(event.pos) == pressed else None
        if event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE and self._pinned and self.takes_marks:
            self._pinned = self._hovered = None
            return True, None
        return False, None

    def _press(self, event: pygame.event.Event) -> bool:
        self._pointer = event.pos
        target = self._target_at(event.pos)
        self._pressed = target if event.button == 1 else None  # also if the release of a former press was lost
        if target is None:
            self._pinned = self._hovered = None
            return False
        return True

    def _click(self, target: Target) -> Remedy | None:
        """Process a click; return the remedy that was clicked."""
        if isinstance(target, Remedy):
            self._pinned = self._hovered = None
            return target
        if isinstance(target, SceneMark):
            self._pinned = None if target == self._pinned else target
            self._hovered = self._pinned
        elif target is PlatePart.HEADING:
            self.is_folded = not self.is_folded
            self._pinned = self._hovered = None
        elif target is PlatePart.MORE:
            self._first += self._listed
        return None

    def _hover(self, position: tuple[int, int]) -> None:
        target = self._target_at(position)
        if isinstance(target, SceneMark):
            self._hovered = target
        elif not (self.card.width and self.card.union(self._anchor).collidepoint(position)):
            self._hovered = None

    def _target_at(self, position: tuple[int, int]) -> Target | None:
        return next((target for rect, target in reversed(self._targets) if rect.collidepoint(position)), None)

    # --- Drawing -------------------------------------------------------------------------------------------------

    def draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        scene: Scene,
        result: CheckResult | None,
        area: pygame.Rect,
        ui_scale: float,
    ) -> None:
        """Draw the marks, the plate and the message of the mark under the pointer, all within an area.

        Args:
            surface: the window.
            camera: of the scene.
            scene: as it is shown, which may be a preview of a change.
            result: of the check; None before the first one.
            area: px.
            ui_scale: 1 on a display of 1080 lines.
        """
        self._targets, self.rect, self.card = [], pygame.Rect(0, 0, 0, 0), pygame.Rect(0, 0, 0, 0)
        size = TEXT_SIZE * ui_scale
        area = area.clip(surface.get_rect())
        if area.width < 8 * size or area.height < 3 * size:
            return
        result = CheckResult() if result is None else result
        self._keep_marks(result.marks)
        clip = surface.get_clip()
        surface.set_clip(area.clip(clip))
        self._draw_marks(surface, self._places(camera, scene, result.marks, area, ui_scale), area, ui_scale)
        self._draw_plate(surface, scene, result, area, size)
        self._draw_card(surface, area, size)
        self._draw_reasons(surface, area, size)
        surface.set_clip(clip)

    def _keep_marks(self, marks: Sequence[SceneMark]) -> None:
        """Follow the marks under the pointer into a new result, whose figures may differ."""
        self._hovered, self._pinned = (
            each if each is None or each in marks else _same_problem(marks, each)
            for each in (self._hovered, self._pinned)
        )
        self._first = self._first if self._first < len(marks) else 0

    def _places(
        self, camera: Camera, scene: Scene, marks: Sequence[SceneMark], area: pygame.Rect, ui_scale: float
    ) -> list[MarkPlace]:
        """Return where marks are drawn: to the upper right of the elements, several of one element side by side."""
        found: list[MarkPlace] = []
        counts: dict[ElementKey, int] = {}
        radius = 9 * ui_scale
        for mark in marks:
            for key in mark.elements:
                if len(found) == MAX_MARKED or not exists(scene, key):
                    continue
                corner = self._corner(camera, scene, key, area, radius)
                if corner is None:
                    continue
                count = counts.get(key, 0)
                counts[key] = count + 1
                x = min(corner[0] + 2.3 * radius * count, area.right - 1.3 * radius)
                found.append(MarkPlace(mark, (x, corner[1])))
        return found

    def _corner(
        self, camera: Camera, scene: Scene, key: ElementKey, area: pygame.Rect, radius: float
    ) -> tuple[float, float] | None:
        """Return the centre of the first mark of an element, px; None if the element is out of sight."""
        element = element_at(scene, key)
        inner = area.inflate(round(-2.6 * radius), round(-2.6 * radius))
        if isinstance(element, Plane):
            x, y = camera.to_screen(
                np.asarray(_nearest_on(element, camera.to_world((area.left + 0.06 * area.width, area.centery))))
            ).tolist()
            return (x, y) if inner.collidepoint(x, y) else None
        if scene is not self._bounds_of:
            self._bounds, self._bounds_of = {}, scene
        if key not in self._bounds:
            self._bounds[key] = _bounds(scene, key)
        bounds = self._bounds[key]
        if bounds is None:
            return None
        corners = [(x, y) for x in (bounds[0][0], bounds[1][0]) for y in (bounds[0][1], bounds[1][1])]
        pixels = camera.to_screen(np.asarray(corners))
        low, high = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
        if high[0] < area.left or low[0] > area.right or high[1] < area.top or low[1] > area.bottom:
            return None
        x, y = high[0] + 0.6 * radius, low[1] - 0.6 * radius
        return min(max(x, inner.left), inner.right), min(max(y, inner.top), inner.bottom)

    def _draw_marks(
        self, surface: pygame.Surface, places: Sequence[MarkPlace], area: pygame.Rect, ui_scale: float
    ) -> None:
        radius = 7.5 * ui_scale
        for mark, centre in sorted(places, key=lambda each: each.mark == self.shown):
            is_shown = mark == self.shown
            draw_disc(surface, (centre[0], centre[1] + 0.1 * radius), 1.55 * radius, INK if is_shown else BACKGROUND)
            draw_disc(surface, (centre[0], centre[1] + 0.1 * radius), 1.35 * radius, PANEL)
            draw_mark(surface, "triangle", centre, 0.8 * radius, _colour(mark))
            if self.takes_marks:
                rect = pygame.Rect(0, 0, round(3 * radius), round(3 * radius))
                rect.center = round(centre[0]), round(centre[1])
                self._targets.append((rect.clip(area), mark))

    def _draw_plate(
        self, surface: pygame.Surface, scene: Scene, result: CheckResult, area: pygame.Rect, size: float
    ) -> None:
        """Draw the plate from its heading down; parts without space are dropped, the demands first."""
        pad, step = round(0.7 * size), round(1.5 * size)
        width = min(round(PLATE_WIDTH * size / TEXT_SIZE), area.width)
        room = width - 2 * pad
        heading = _heading(result)
        if self.is_folded:
            width = min(text_size(heading, size, bold=True)[0] + round(3.2 * size) + 2 * pad, width)
            room = width - 2 * pad
        rows = 0 if self.is_folded else (min(area.height, round(PLATE_HEIGHT_FRACTION * area.height)) - 2 * pad) // step
        chips = _chip_rows([EngineChip(*each) for each in result.engines], size, room)
        lines = _mark_lines(result.marks, self._first, min(MAX_LINES, max(rows - 1, 0)))
        self._listed = sum(mark is not None for mark in lines)
        rows -= 1 + len(lines)
        chips = chips if rows >= len(chips) else []
        rows -= len(chips)
        needs = f"needs: {', '.join(result.demands)}" if result.demands else ""
        texts = [line for each in (result.note, needs) if each for line in wrap_text(each, 0.92 * size, room, 3)]
        texts = texts[: max(rows, 0)]
        gap = round(0.3 * size)
        height = 2 * pad + step * (1 + len(lines) + len(texts) + len(chips)) + gap * (bool(texts) + bool(chips))
        self.rect = pygame.Rect(area.right - width, area.bottom - height, width, height)
        draw_box(surface, self.rect, 0.5 * size, opacity=235)
        self._targets.append((self.rect, PlatePart.PLATE))
        y = self.rect.top + pad
        row = pygame.Rect(self.rect.left + pad, y, room, step)
        self._draw_heading(surface, result, heading, row, size)
        row = row.move(0, step)
        for mark in lines:
            self._draw_line(surface, scene, result, mark, row, size)
            row = row.move(0, step)
        row = row.move(0, gap if texts else 0)
        for text in texts:
            draw_text(surface, text, row.midleft, 0.92 * size, FAINT, "midleft")
            row = row.move(0, step)
        row = row.move(0, gap if chips else 0)
        for chip_row in chips:
            self._draw_chips(surface, chip_row, row, size)
            row = row.move(0, step)

    def _draw_heading(
        self, surface: pygame.Surface, result: CheckResult, text: str, row: pygame.Rect, size: float
    ) -> None:
        target = row.inflate(round(1.2 * size), round(0.5 * size)).clip(self.rect)
        is_hovered = target.collidepoint(self._pointer)
        at = row.left + 0.5 * size, row.centery
        if result.marks:
            colour = WARNING if any(mark.kind in CERTAIN_KINDS for mark in result.marks) else ORANGE
            draw_mark(surface, "triangle", at, 0.45 * size, colour)
        else:
            draw_mark(surface, "disc" if result.engines and not result.note else "ring", at, 0.36 * size, GREEN)
        text = ellipsis(text, size, row.width - 2.6 * size, bold=True)
        draw_text(surface, text, (row.left + 1.4 * size, row.centery), size, INK, "midleft", bold=True)
        x, y, half = row.right - 0.5 * size, float(row.centery), 0.32 * size
        tip = half if self.is_folded else -half  # it unfolds upwards
        corners = [(x - half, y + 0.5 * tip), (x + half, y + 0.5 * tip), (x, y - 0.7 * tip)]
        pygame.draw.polygon(surface, INK if is_hovered else FAINT, corners)
        self._targets.append((target, PlatePart.HEADING))

    def _draw_line(
        self,
        surface: pygame.Surface,
        scene: Scene,
        result: CheckResult,
        mark: SceneMark | None,
        row: pygame.Rect,
        size: float,
    ) -> None:
        """Draw the line of a warning, or of those that are not listed."""
        target = row.inflate(round(0.8 * size), 0)
        is_shown = mark == self.shown if mark is not None else target.collidepoint(self._pointer)
        if is_shown:
            pygame.draw.rect(surface, LINE, target, border_radius=round(0.3 * size))
        x = row.left + 1.4 * size
        if mark is None:
            text = f"{len(result.marks) - self._listed:,} more …"
            draw_text(surface, text, (x, row.centery), size, FAINT, "midleft")
            self._targets.append((target, PlatePart.MORE))
            return
        draw_mark(surface, "triangle", (row.left + 0.5 * size, row.centery), 0.36 * size, _colour(mark))
        title = TITLES.get(mark.kind, mark.kind.replace("_", " "))
        names = ", ".join(name_of(scene, key) for key in mark.elements if exists(scene, key))
        end = draw_text(surface, title, (x, row.centery), size, INK, "midleft").right
        text = ellipsis(names, size, row.right - end - 0.6 * size)
        draw_text(surface, text, (end + 0.6 * size, row.centery), size, FAINT, "midleft")
        self._targets.append((target, mark))

    def _draw_chips(self, surface: pygame.Surface, chips: Sequence[EngineChip], row: pygame.Rect, size: float) -> None:
        x = row.left
        for chip in chips:
            name, lacks = chip
            rect = pygame.Rect(x, row.top, _chip_width(chip, size), row.height).inflate(0, -round(0.2 * size))
            colour = mix_colours(FAINT, PANEL, 0.3) if lacks else INK
            pygame.draw.rect(surface, PANEL if lacks else PANEL_RAISED, rect, border_radius=rect.height // 2)
            pygame.draw.rect(surface, LINE, rect, max(round(size / 12), 1), border_radius=rect.height // 2)
            draw_text(surface, name, rect.center, 0.92 * size, colour, "center")
            if lacks:  # not by its colour alone
                wide = text_size(name, 0.92 * size)[0] // 2 + 2
                ends = (rect.centerx - wide, rect.centery + 1), (rect.centerx + wide, rect.centery + 1)
                pygame.draw.line(surface, colour, *ends, max(round(size / 12), 1))
            self._targets.append((rect, chip))
            x = rect.right + round(0.5 * size)

    def _draw_reasons(self, surface: pygame.Surface, area: pygame.Rect, size: float) -> None:
        """Draw what the engine under the pointer lacks."""
        target = self._target_at(self._pointer)
        if not isinstance(target, EngineChip) or self.shown is not None:
            return
        name, lacks = target
        text = f"{name} cannot run this scene: {'; '.join(lacks)}" if lacks else f"{name} can run this scene"
        plate = TextPlate(text, size, min(280 * size / TEXT_SIZE, area.width - 1.5 * size), 6)
        plate.rect.midbottom = self._pointer[0], self.rects_of(target)[0].top - round(0.4 * size)
        plate.rect.clamp_ip(area)
        plate.draw(surface, 0.4 * size, 250)

    def _draw_card(self, surface: pygame.Surface, area: pygame.Rect, size: float) -> None:
        """Draw the message of the shown mark, with its remedies."""
        mark = self.shown
        if mark is None:
            return
        pad, step = round(0.8 * size), round(1.4 * size)
        width = min(round(CARD_WIDTH * size / TEXT_SIZE), area.width)
        room = width - 2 * pad
        buttons = _button_rows(mark.remedies, size, room)
        tall = round(1.9 * size)
        most = max((area.height - 2 * pad - tall * len(buttons)) // step - 1, 1)
        lines = wrap_text(mark.message, size, room, min(most, 12))
        title = TITLES.get(mark.kind, mark.kind.replace("_", " "))
        height = 2 * pad + step * (1 + len(lines)) + (round(0.4 * size) + tall * len(buttons) if buttons else 0)
        self._anchor = self._nearest_anchor(mark)
        self.card = self._card_rect((width, height), area, size)
        draw_box(surface, self.card, 0.5 * size, opacity=250, edge=_colour(mark))
        self._targets.append((self.card, PlatePart.CARD))
        left, y = self.card.left + pad, self.card.top + pad
        draw_mark(surface, "triangle", (left + 0.5 * size, y + 0.5 * step), 0.45 * size, _colour(mark))
        draw_text(surface, title, (left + 1.4 * size, y + 0.5 * step), size, INK, "midleft", bold=True)
        draw_text_lines(surface, lines, (left, y + step), step, size)
        y += step * (1 + len(lines)) + round(0.4 * size)
        for row in buttons:
            x = left
            for remedy in row:
                rect = pygame.Rect(x, y, min(_button_width(remedy, size), room), tall).inflate(0, -round(0.3 * size))
                self._draw_button(surface, remedy, rect, size)
                x = rect.right + round(0.5 * size)
            y += tall

    def _nearest_anchor(self, mark: SceneMark) -> pygame.Rect:
        """Return the place of a mark beside which its message is shown: under the pointer, or near the last one."""
        places = self.rects_of(mark)
        for place in places:
            if place.collidepoint(self._pointer):
                return place
        x, y = self._anchor.center
        return min(places, key=lambda each: abs(each.centerx - x) + abs(each.centery - y), default=self._anchor)

    def _draw_button(self, surface: pygame.Surface, remedy: Remedy, rect: pygame.Rect, size: float) -> None:
        is_hovered = rect.collidepoint(self._pointer)
        fill = SKY if is_hovered else PANEL_RAISED
        pygame.draw.rect(surface, fill, rect, border_radius=round(0.4 * size))
        pygame.draw.rect(surface, SKY, rect, max(round(size / 12), 1), border_radius=round(0.4 * size))
        text = ellipsis(remedy.label, size, rect.width - 0.6 * size)
        draw_text(surface, text, rect.center, size, BACKGROUND if is_hovered else INK, "center")
        self._targets.append((rect, remedy))

    def _card_rect(self, size: tuple[int, int], area: pygame.Rect, text: float) -> pygame.Rect:
        """Return the rectangle of the message beside its mark, off the plate if possible."""
        anchor, gap = self._anchor, round(0.3 * text)
        card = pygame.Rect((0, 0), size)
        candidates = []
        if self.rect.contains(anchor.clip(area)):  # a line of the plate: to the left of it, else above
            card.bottomright = self.rect.left - gap, self.rect.bottom
            candidates.append(card.copy())
            card.bottomright = self.rect.right, self.rect.top - gap
            candidates.append(card.copy())
        else:
            for corner, place in (  # below or above first: other marks of the element are beside it
                ("topleft", (anchor.left, anchor.bottom + gap)),
                ("bottomleft", (anchor.left, anchor.top - gap)),
                ("topright", (anchor.left - gap, anchor.top)),
                ("topleft", (anchor.right + gap, anchor.top)),
            ):
                setattr(card, corner, place)
                candidates += [card.copy(), card.clamp(area)]
        taken = [self.rect, anchor]
        fitting = (each for each in candidates if area.contains(each) and each.collidelist(taken) < 0)
        return next(fitting, candidates[0].clamp(area))


def _same_problem(marks: Sequence[SceneMark], former: SceneMark) -> SceneMark | None:
    return next((mark for mark in marks if (mark.kind, mark.elements) == (former.kind, former.elements)), None)


def _colour(mark: SceneMark) -> RgbColour:
    return WARNING if mark.kind in CERTAIN_KINDS else ORANGE


def _heading(result: CheckResult) -> str:
    """Return the number of warnings, and of the engines that can run the scene."""
    if not result.engines and not result.marks:
        return "checking …"
    count, able = len(result.marks), sum(not lacks for _, lacks in result.engines)
    warnings = "not checked" if result.note else f"{count:,} warning{'' if count == 1 else 's'}"
    warnings = "no warnings" if warnings == "0 warnings" else warnings
    return f"{warnings} · {able} engine{'' if able == 1 else 's'}"


def _mark_lines(marks: Sequence[SceneMark], first: int, most: int) -> list[SceneMark | None]:
    """Return the marks that the plate lists, whole scenes first; None is a line for those that are left out."""
    ordered = sorted(marks, key=lambda mark: bool(mark.elements))
    if len(ordered) <= most:
        return list(ordered)
    if most < 2:
        return []
    rotated = [*ordered[first:], *ordered[:first]]
    return [*rotated[: most - 1], None]


def _chip_width(chip: EngineChip, size: float) -> int:
    return text_size(chip.engine, 0.92 * size)[0] + round(1.3 * size)


def _chip_rows(chips: Sequence[EngineChip], size: float, room: int) -> list[list[EngineChip]]:
    return [[chips[k] for k in row] for row in _rows_of([_chip_width(chip, size) for chip in chips], size, room)]


def _button_width(remedy: Remedy, size: float) -> int:
    return text_size(remedy.label, size)[0] + round(1.4 * size)


def _button_rows(remedies: Sequence[Remedy], size: float, room: int) -> list[list[Remedy]]:
    widths = [_button_width(remedy, size) for remedy in remedies]
    return [[remedies[k] for k in row] for row in _rows_of(widths, size, room)]


def _rows_of(widths: Sequence[int], size: float, room: int) -> list[list[int]]:
    """Return the indices of items with widths, px, in rows of a width, px."""
    rows: list[list[int]] = []
    x = room + 1
    for index, width in enumerate(widths):
        if x + width > room:
            rows.append([])
            x = 0
        rows[-1].append(index)
        x += width + round(0.5 * size)
    return rows


def _nearest_on(plane: Plane, point: Point) -> Point:
    """Return the point of the surface of a plane that is nearest to a point, m."""
    normal = np.asarray(plane.normal) / np.hypot(*plane.normal)
    x, y = (np.asarray(point) - normal * float((np.asarray(point) - np.asarray(plane.point)) @ normal)).tolist()
    return x, y


def _bounds(scene: Scene, key: ElementKey) -> tuple[Point, Point] | None:
    """Return the lower left and upper right corner of an element, m; those of discs if it has many bodies."""
    bodies = bodies_of(scene, key)
    if len(bodies) <= MAX_EXACT_BODIES:
        return bounds_of(scene, key)
    rows = slice(bodies.start, bodies.stop)
    position, radius = scene.bodies.position[rows], scene.bodies.radius[rows, None]
    low, high = (position - radius).min(axis=0).tolist(), (position + radius).max(axis=0).tolist()
    return (low[0], low[1]), (high[0], high[1])
