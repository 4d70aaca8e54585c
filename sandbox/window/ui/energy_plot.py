"""Energy graph: kinetic, potential and total energy over the last seconds.

Run graph: the energies of a stored run up to a moment, in a corner of its picture.
"""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import pygame

from sandbox.formatting import format_si
from sandbox.measure.energy import Energies, energies
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory
from sandbox.window.render.palette import FAINT, INK, LINE, PURPLE, SKY, Colour
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_size

SPAN = 10.0
"""s of simulated time that are shown"""
MAX_SAMPLES = 4096
"""samples that are kept; beyond, every other one goes"""
LOOSE = 0.4
"""The scale shrinks once the lines need less than this share of it."""

LINES: tuple[tuple[str, Colour], ...] = (("kinetic", SKY), ("potential", PURPLE), ("total", INK))

Sample = tuple[float, float, float, float]
Limits = tuple[float, float]


class EnergyGraph:
    """A small chart that is fed as the scene goes on. Times that go back cut what lies after them."""

    def __init__(self, span: float = SPAN) -> None:
        self.span = span
        self.samples: list[Sample] = []
        """(time s, kinetic, potential, total J), oldest first"""
        self.limits: Limits = (0.0, 1.0)
        """of the scale, J"""

    def clear(self) -> None:
        """Forget everything."""
        self.samples.clear()
        self.limits = (0.0, 1.0)

    def add(self, time: float, kinetic: float, potential: float, total: float) -> None:
        """Add the energies at a time; what is not finite leaves a gap.

        Args:
            time: s; at the last one again it replaces that sample, and nan is passed over.
            kinetic: J.
            potential: J.
            total: J.
        """
        if not math.isfinite(time):
            return
        while self.samples and self.samples[-1][0] >= time:
            self.samples.pop()
        self.samples.append((time, kinetic, potential, total))
        if len(self.samples) > MAX_SAMPLES:
            oldest = time - self.span
            self.samples = [sample for sample in self.samples if sample[0] >= oldest]
            if len(self.samples) > MAX_SAMPLES // 2:
                self.samples = self.samples[:-1][::2] + self.samples[-1:]

    def _shown(self) -> list[Sample]:
        oldest = self.samples[-1][0] - self.span if self.samples else 0.0
        return [sample for sample in self.samples if sample[0] >= oldest]

    def rescaled(self, shown: Sequence[Sample]) -> Limits:
        """Return limits that hold all lines and zero: the present ones while they fit and are not far too wide."""
        values = np.asarray(shown, np.float64).reshape(-1, 4)[:, 1:]
        values = values[np.isfinite(values)]
        low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
        need = high / 2 - low / 2  # halves, as the difference of two floats may overflow
        if not 0 < need < 1e307:
            return self.limits if need == 0 else (-1e308, 1e308)
        bottom, top = self.limits
        if bottom <= low and high <= top and need >= LOOSE * (top / 2 - bottom / 2):
            return self.limits
        grain = _round_up(need / 2)
        return (math.floor(low / grain - 0.05) * grain if low < 0 else 0.0), math.ceil(high / grain + 0.05) * grain

    def draw(self, surface: pygame.Surface, rect: pygame.Rect, unit: float = 1.0) -> None:
        """Draw the chart within a rectangle; in a tiny one, without its words."""
        size = 11.5 * unit
        pad = round(0.8 * size)
        draw_box(surface, rect, 6 * unit)
        words = max(text_size(f"{name} −0.000 mJ", size)[0] for name, _ in LINES)
        roomy = rect.width > 2.2 * words and rect.height > 6.5 * size
        head = round(1.3 * size) if roomy else 0
        foot = round(1.2 * size) if roomy else 0
        right = words + pad if roomy else 0
        chart = pygame.Rect(
            rect.left + pad, rect.top + pad + head, rect.width - 2 * pad - right, rect.height - 2 * pad - head - foot
        )
        if chart.width < 4 or chart.height < 4:
            return
        shown = self._shown()
        self.limits = self.rescaled(shown)
        self._draw_frame(surface, chart, unit)
        self._draw_lines(surface, chart, shown, unit)
        if roomy:
            draw_text(surface, "Energy", (chart.left, rect.top + pad), size, INK, bold=True)
            self._draw_words(surface, chart, rect.right - pad - words, shown, size)

    def _draw_frame(self, surface: pygame.Surface, chart: pygame.Rect, unit: float) -> None:
        """Draw grid lines at the limits and the middle, and a stronger one at zero."""
        bottom, top = self.limits
        thin = max(round(unit), 1)
        for share in (0.0, 0.25, 0.5, 0.75, 1.0):
            y = chart.top + round(share * chart.height)
            pygame.draw.line(surface, LINE, (chart.left, y), (chart.right, y), thin)
        zero = chart.bottom + round(bottom / (top - bottom) * chart.height) if math.isfinite(top - bottom) else None
        if zero is not None:
            pygame.draw.line(surface, FAINT, (chart.left, zero), (chart.right, zero), thin)

    def _height(self, value: float, chart: pygame.Rect) -> float:
        bottom, top = self.limits
        share = (value / 2 - bottom / 2) / (top / 2 - bottom / 2)
        return float(chart.bottom - min(max(share, 0.0), 1.0) * chart.height)

    def _draw_lines(self, surface: pygame.Surface, chart: pygame.Rect, shown: Sequence[Sample], unit: float) -> None:
        if len(shown) < 2:
            return
        every = max(len(shown) // chart.width, 1)
        kept = np.asarray([*shown[:-1:every], shown[-1]])
        first, last = shown[0][0], shown[-1][0]
        across = (chart.left + (kept[:, 0] - first) / (last - first) * chart.width).tolist()
        bottom, top = self.limits
        with np.errstate(all="ignore"):  # what is not finite is left out below
            shares = np.clip((kept[:, 1:] / 2 - bottom / 2) / (top / 2 - bottom / 2), 0.0, 1.0)
        finite = np.isfinite(kept[:, 1:])
        heights = (chart.bottom - shares * chart.height).tolist()
        thickness = max(round(1.6 * unit), 1)
        for index, (_, colour) in enumerate(LINES):
            points = [(x, row[index]) for x, row in zip(across, heights, strict=True)]
            start = 0
            for gap in [*np.flatnonzero(~finite[:, index]).tolist(), len(points)]:
                _draw_piece(surface, points[start:gap], colour, thickness)
                start = gap + 1

    def _draw_words(
        self, surface: pygame.Surface, chart: pygame.Rect, left: int, shown: Sequence[Sample], size: float
    ) -> None:
        """Write what each line is and where it stands, beside its end, and what the axes span."""
        small = 0.9 * size
        bottom, top = self.limits
        draw_text(surface, format_si(top, "J"), (chart.right, chart.top - 0.1 * size), small, FAINT, "bottomright")
        if bottom < 0:
            draw_text(
                surface, format_si(bottom, "J"), (chart.right, chart.bottom + 0.1 * size), small, FAINT, "topright"
            )
        if not shown:
            return
        first, last = shown[0][0], shown[-1][0]
        length = self.span if last - first > 0.98 * self.span else last - first
        text = ellipsis(f"last {length:.2g} s", small, chart.width)
        draw_text(surface, text, (chart.left, chart.bottom + 0.1 * size), small, FAINT)
        wanted = [self._height(value, chart) if math.isfinite(value) else chart.centery for value in shown[-1][1:]]
        places = value_limits(wanted, 1.3 * size, chart.top, chart.bottom)
        for (name, colour), value, y in zip(LINES, shown[-1][1:], places, strict=True):
            draw_text(surface, f"{name} {format_si(value, 'J')}", (left, y), size, colour, "midleft")


def _draw_piece(surface: pygame.Surface, piece: Sequence[tuple[float, float]], colour: Colour, thickness: int) -> None:
    if len(piece) < 2:
        return
    for k in range(thickness):
        by = k - (thickness - 1) / 2
        pygame.draw.aalines(surface, colour, False, [(x, y + by) for x, y in piece])


def _round_up(value: float) -> float:
    """Return the least of 1, 2, 2.5, 5 times a power of ten that is no less than a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    if not power > 0:  # a subnormal value's power of ten may be 0
        return value
    return next((part * power for part in (1.0, 2.0, 2.5, 5.0) if part * power >= value), 10.0 * power)


def value_limits(wanted: Sequence[float], gap: float, low: float, high: float) -> tuple[float, ...]:
    """Return places near those wanted, in their order and a gap apart, within bounds as far as there is room."""
    order = sorted(range(len(wanted)), key=lambda k: wanted[k])
    placed: list[float] = []
    for k in order:
        placed.append(max(wanted[k], low if not placed else placed[-1] + gap))
    limit = high
    for n in reversed(range(len(placed))):
        placed[n] = min(placed[n], limit)
        limit = placed[n] - gap
    found = [0.0] * len(wanted)
    for n, k in enumerate(order):
        found[k] = placed[n]
    return tuple(found)


SAMPLES = 500
"""of the span that is shown"""
WIDTH, HEIGHT, MARGIN = 330.0, 130.0, 12.0
"""px at unit 1"""


class RunGraph:
    """The energy graph of the window, fed by a stored run."""

    def __init__(self, trajectory: Trajectory, scene: Scene, bodies: Bodies) -> None:
        self._run, self._scene, self._bodies = trajectory, scene, bodies
        self._graph = EnergyGraph()

    @cached_property
    def _energies(self) -> Energies:
        return energies(self._run, self._scene, bodies=self._bodies)

    def draw(self, surface: pygame.Surface, time: float, unit: float) -> None:
        """Draw the energies of the last seconds before a time, s, into the lower right corner."""
        first, last = np.searchsorted(self._run.time, (time - SPAN, time), side="right")
        every = max(1, round(SPAN / SAMPLES / _step(self._run)))
        first = -(-first // every) * every  # always the same frames, so that the lines do not tremble
        self._graph.samples.clear()
        for row in [*range(first, last - 1, every), last - 1]:
            self._graph.add(float(self._run.time[row]), *(float(each[row]) for each in self._energies))
        wide, high = surface.get_size()
        rect = pygame.Rect(0, 0, round(min(WIDTH * unit, wide / 2)), round(min(HEIGHT * unit, high / 2)))
        rect.bottomright = wide - round(MARGIN * unit), high - round(MARGIN * unit)
        self._graph.draw(surface, rect, unit)


def _step(run: Trajectory) -> float:
    """Return the usual time between frames, s."""
    return max(float(np.median(np.diff(run.time))), 1e-12) if len(run.time) > 1 else 1.0
