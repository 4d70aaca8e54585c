"""Energy graph: kinetic, potential and total energy over the last seconds of a session or of a stored run."""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import pygame

from sandbox.formatting import format_si
from sandbox.measure.metrics.energy import Energies, energies
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Trajectory
from sandbox.window.render.palette import FAINT, INK, LINE, PURPLE, SKY, RgbColour
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_size

TIME_SPAN = 10.0
"""s of simulated time that are plotted"""
MAX_SAMPLES = 4096
"""number of samples above which every other one is dropped"""
MIN_SCALE_USE = 0.4
"""fraction of the axis range that the curves must use; below it the range shrinks"""

CURVES: tuple[tuple[str, RgbColour], ...] = (("kinetic", SKY), ("potential", PURPLE), ("total", INK))

EnergySample = tuple[float, float, float, float]
Limits = tuple[float, float]


class EnergyGraph:
    """Chart of the latest samples. Adding a sample at an earlier time removes those after it."""

    def __init__(self, span: float = TIME_SPAN) -> None:
        self.span = span
        self.samples: list[EnergySample] = []
        """(time s, kinetic, potential, total J), oldest first"""
        self.limits: Limits = (0.0, 1.0)
        """axis limits, J"""

    def clear(self) -> None:
        """Remove all samples."""
        self.samples.clear()
        self.limits = (0.0, 1.0)

    def add(self, time: float, kinetic: float, potential: float, total: float) -> None:
        """Add a sample; a non-finite energy leaves a gap in its curve.

        Args:
            time: s; a sample at the same time is replaced, a non-finite time is ignored.
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

    def _visible_samples(self) -> list[EnergySample]:
        oldest = self.samples[-1][0] - self.span if self.samples else 0.0
        return [sample for sample in self.samples if sample[0] >= oldest]

    def fit_limits(self, samples: Sequence[EnergySample]) -> Limits:
        """Return axis limits that include all curves and zero; the present limits if they fit closely enough."""
        values = np.asarray(samples, np.float64).reshape(-1, 4)[:, 1:]
        values = values[np.isfinite(values)]
        low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
        need = high / 2 - low / 2  # halved, as the difference of two floats may overflow
        if not 0 < need < 1e307:
            return self.limits if need == 0 else (-1e308, 1e308)
        bottom, top = self.limits
        if bottom <= low and high <= top and need >= MIN_SCALE_USE * (top / 2 - bottom / 2):
            return self.limits
        grain = _round_up(need / 2)
        return (math.floor(low / grain - 0.05) * grain if low < 0 else 0.0), math.ceil(high / grain + 0.05) * grain

    def draw(self, surface: pygame.Surface, rect: pygame.Rect, ui_scale: float = 1.0) -> None:
        """Draw the chart in a rectangle; a small chart has no labels."""
        size = 11.5 * ui_scale
        pad = round(0.8 * size)
        draw_box(surface, rect, 6 * ui_scale)
        label_width = max(text_size(f"{name} −0.000 mJ", size)[0] for name, _ in CURVES)
        has_labels = rect.width > 2.2 * label_width and rect.height > 6.5 * size
        top_margin = round(1.3 * size) if has_labels else 0
        bottom_margin = round(1.2 * size) if has_labels else 0
        right_margin = label_width + pad if has_labels else 0
        chart = pygame.Rect(
            rect.left + pad,
            rect.top + pad + top_margin,
            rect.width - 2 * pad - right_margin,
            rect.height - 2 * pad - top_margin - bottom_margin,
        )
        if chart.width < 4 or chart.height < 4:
            return
        samples = self._visible_samples()
        self.limits = self.fit_limits(samples)
        self._draw_frame(surface, chart, ui_scale)
        self._draw_curves(surface, chart, samples, ui_scale)
        if has_labels:
            draw_text(surface, "Energy", (chart.left, rect.top + pad), size, INK, bold=True)
            self._draw_labels(surface, chart, rect.right - pad - label_width, samples, size)

    def _draw_frame(self, surface: pygame.Surface, chart: pygame.Rect, ui_scale: float) -> None:
        """Draw grid lines at the limits and the quarters, and an emphasised one at zero."""
        bottom, top = self.limits
        thin = max(round(ui_scale), 1)
        for fraction in (0.0, 0.25, 0.5, 0.75, 1.0):
            y = chart.top + round(fraction * chart.height)
            pygame.draw.line(surface, LINE, (chart.left, y), (chart.right, y), thin)
        zero = chart.bottom + round(bottom / (top - bottom) * chart.height) if math.isfinite(top - bottom) else None
        if zero is not None:
            pygame.draw.line(surface, FAINT, (chart.left, zero), (chart.right, zero), thin)

    def _y_of(self, value: float, chart: pygame.Rect) -> float:
        bottom, top = self.limits
        fraction = (value / 2 - bottom / 2) / (top / 2 - bottom / 2)
        return float(chart.bottom - min(max(fraction, 0.0), 1.0) * chart.height)

    def _draw_curves(
        self, surface: pygame.Surface, chart: pygame.Rect, samples: Sequence[EnergySample], ui_scale: float
    ) -> None:
        if len(samples) < 2:
            return
        stride = max(len(samples) // chart.width, 1)
        kept = np.asarray([*samples[:-1:stride], samples[-1]])
        first, last = samples[0][0], samples[-1][0]
        across = (chart.left + (kept[:, 0] - first) / (last - first) * chart.width).tolist()
        bottom, top = self.limits
        with np.errstate(all="ignore"):  # non-finite values are skipped below
            fractions = np.clip((kept[:, 1:] / 2 - bottom / 2) / (top / 2 - bottom / 2), 0.0, 1.0)
        finite = np.isfinite(kept[:, 1:])
        heights = (chart.bottom - fractions * chart.height).tolist()
        thickness = max(round(1.6 * ui_scale), 1)
        for index, (_, colour) in enumerate(CURVES):
            points = [(x, row[index]) for x, row in zip(across, heights, strict=True)]
            start = 0
            for gap in [*np.flatnonzero(~finite[:, index]).tolist(), len(points)]:
                _draw_curve_piece(surface, points[start:gap], colour, thickness)
                start = gap + 1

    def _draw_labels(
        self, surface: pygame.Surface, chart: pygame.Rect, left: int, samples: Sequence[EnergySample], size: float
    ) -> None:
        """Draw the name and value of each curve next to its end, and the axis ranges."""
        small = 0.9 * size
        bottom, top = self.limits
        draw_text(surface, format_si(top, "J"), (chart.right, chart.top - 0.1 * size), small, FAINT, "bottomright")
        if bottom < 0:
            draw_text(
                surface, format_si(bottom, "J"), (chart.right, chart.bottom + 0.1 * size), small, FAINT, "topright"
            )
        if not samples:
            return
        first, last = samples[0][0], samples[-1][0]
        length = self.span if last - first > 0.98 * self.span else last - first
        text = ellipsis(f"last {length:.2g} s", small, chart.width)
        draw_text(surface, text, (chart.left, chart.bottom + 0.1 * size), small, FAINT)
        wanted = [self._y_of(value, chart) if math.isfinite(value) else chart.centery for value in samples[-1][1:]]
        label_y = spread_labels(wanted, 1.3 * size, chart.top, chart.bottom)
        for (name, colour), value, y in zip(CURVES, samples[-1][1:], label_y, strict=True):
            draw_text(surface, f"{name} {format_si(value, 'J')}", (left, y), size, colour, "midleft")


def _draw_curve_piece(
    surface: pygame.Surface, points: Sequence[tuple[float, float]], colour: RgbColour, thickness: int
) -> None:
    if len(points) < 2:
        return
    for k in range(thickness):
        offset = k - (thickness - 1) / 2
        pygame.draw.aalines(surface, colour, False, [(x, y + offset) for x, y in points])


def _round_up(value: float) -> float:
    """Return the smallest of 1, 2, 2.5, 5 times a power of ten that is at least `value`, which must be positive."""
    power = 10.0 ** math.floor(math.log10(value))
    if not power > 0:  # underflow for subnormal values
        return value
    return next((part * power for part in (1.0, 2.0, 2.5, 5.0) if part * power >= value), 10.0 * power)


def spread_labels(targets: Sequence[float], gap: float, low: float, high: float) -> tuple[float, ...]:
    """Return positions close to those wanted, in the same order, at least `gap` apart and within bounds if possible."""
    order = sorted(range(len(targets)), key=lambda k: targets[k])
    placed: list[float] = []
    for k in order:
        placed.append(max(targets[k], low if not placed else placed[-1] + gap))
    limit = high
    for n in reversed(range(len(placed))):
        placed[n] = min(placed[n], limit)
        limit = placed[n] - gap
    found = [0.0] * len(targets)
    for n, k in enumerate(order):
        found[k] = placed[n]
    return tuple(found)


MAX_DRAWN_SAMPLES = 500
"""number of samples in the plotted time span"""
FIGURE_WIDTH, FIGURE_HEIGHT, FIGURE_MARGIN = 330.0, 130.0, 12.0
"""px at UI scale 1"""


class RunGraph:
    """Energy graph of a stored run."""

    def __init__(self, trajectory: Trajectory, scene: Scene, bodies: Bodies) -> None:
        self._run, self._scene, self._bodies = trajectory, scene, bodies
        self._graph = EnergyGraph()

    @cached_property
    def _energies(self) -> Energies:
        return energies(self._run, self._scene, bodies=self._bodies)

    def draw(self, surface: pygame.Surface, time: float, ui_scale: float) -> None:
        """Draw the energies of the last seconds before a time, s, in the lower right corner."""
        first, last = np.searchsorted(self._run.time, (time - TIME_SPAN, time), side="right")
        stride = max(1, round(TIME_SPAN / MAX_DRAWN_SAMPLES / _step(self._run)))
        first = -(-first // stride) * stride  # a fixed grid of frames, so that the curves do not jitter
        self._graph.samples.clear()
        for row in [*range(first, last - 1, stride), last - 1]:
            self._graph.add(float(self._run.time[row]), *(float(each[row]) for each in self._energies))
        width, height = surface.get_size()
        rect = pygame.Rect(
            0, 0, round(min(FIGURE_WIDTH * ui_scale, width / 2)), round(min(FIGURE_HEIGHT * ui_scale, height / 2))
        )
        rect.bottomright = width - round(FIGURE_MARGIN * ui_scale), height - round(FIGURE_MARGIN * ui_scale)
        self._graph.draw(surface, rect, ui_scale)


def _step(run: Trajectory) -> float:
    """Return the median time between frames, s."""
    return max(float(np.median(np.diff(run.time))), 1e-12) if len(run.time) > 1 else 1.0
