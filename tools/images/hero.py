"""The first picture of the README: balls fall through pegs on three engines, above a chart of the error of each."""

from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pygame
from PIL import Image

import sandbox
from sandbox.window.camera import Camera
from sandbox.window.capture.image_files import offscreen
from sandbox.window.playback.recorded import RecordedRun
from sandbox.window.render.palette import BACKGROUND, FAINT, GREEN, LINE, ORANGE, PANEL, SKY, RgbColour, mix_colours
from sandbox.window.render.renderer import Renderer
from sandbox.window.render.text import draw_text

from .files import image_of, save_gif

SIZE = (800, 470)
SUPERSAMPLING = 2
"""The picture is drawn larger by this factor, and averaged."""
FPS, HOLD = 25.0, 2.0
"""Frames per second, and duration of the last frame, s."""
STEP = 1.0 / 60.0
"""s; time step of pymunk and reference."""
TRAIL = 0.4
"""Fraction of the colour of a ball in its trail."""
LOWEST, HIGHEST = 1e-10, 10.0
"""m; range of the error axis."""
TICKS = ((1e-9, "1 nm"), (1e-6, "1 µm"), (1e-3, "1 mm"), (1.0, "1 m"))
GAP, HEAD, CHART = 10, 48, 128
"""px between the panels, above them for titles, and height of the chart below."""
LEFT, RIGHT = 62, 112
"""px beside the axes of the chart for their labels."""

WIDTH, HEIGHT, SEED = 5.0, 6.0, 14
ROWS, FIRST_ROW, ROW_HEIGHT = 4, 1.9, 0.95


class Run(NamedTuple):
    """The run of one engine, with label and colour."""

    engine: str
    about: str
    colour: RgbColour
    film: RecordedRun
    error: np.ndarray[tuple[int], np.dtype[np.float64]]
    """largest distance of a ball from the exact one in each frame, m; empty for the exact engine itself"""


def scene(colour: str) -> str:
    """Return the scene: three balls, eighteen pegs, five bins."""
    random = np.random.default_rng(SEED)
    walls = [("frame", [[0.0, HEIGHT + 2.0], [0.0, 0.0], [WIDTH, 0.0], [WIDTH, HEIGHT + 2.0]], 0.06)]
    walls += [(f"divider {k}", [[float(k), 0.0], [float(k), 0.8]], 0.06) for k in range(1, int(WIDTH))]
    lines = ['title = "Pegs"', "[world]", "gravity = [0.0, -9.81]", "duration = 5.0", "[solver]", f"dt = {STEP!r}"]
    lines += ["[[material]]", 'name = "steel"', "[[pair]]", 'between = ["steel", "steel"]', "restitution = 0.7"]
    for name, points, thickness in walls:
        lines += [
            "[[wall]]",
            f'name = "{name}"',
            f"points = {points}",
            f"thickness = {thickness}",
            'material = "steel"',
        ]
    for row in range(ROWS):
        for column in range(5 - row % 2):
            position = [0.5 + 0.5 * (row % 2) + column, FIRST_ROW + ROW_HEIGHT * row]
            lines += ["[[post]]", f"position = {position}", "radius = 0.12", 'material = "steel"']
    for number in range(3):
        x = round(1.5 + number + random.uniform(-0.3, 0.3), 3)
        lines += ["[[ball]]", f'name = "{number}"', f"position = [{x}, 5.6]", "radius = 0.16", 'material = "steel"']
        lines += [f'colour = "{colour}"']
    return "\n".join(lines)


def make(path: Path) -> None:
    """Make the film."""
    runs = _runs()
    end = runs[0].film.duration
    frames = [_frame(runs, k / FPS) for k in range(round(end * FPS) + 1)]
    save_gif(frames, path, FPS, 128, HOLD)


def _runs() -> list[Run]:
    """Run the scene on each engine."""
    variants: tuple[tuple[str, str, tuple[int, int, int], dict[str, Any]], ...] = (
        ("pymunk", "dt 1/60 s", ORANGE, {}),
        ("reference", "RK4, bisection, dt 1/60 s", SKY, {"integrator": "rk4", "detection": "bisect"}),
        ("exact", "event by event, no time step: the truth", GREEN, {}),
    )
    exact = sandbox.run(sandbox.loads(scene("#ffffff")), engine="exact")
    found = []
    for engine, about, colour, settings in variants:
        trajectory = sandbox.run(sandbox.loads(scene("#{:02x}{:02x}{:02x}".format(*colour))), engine=engine, **settings)
        error = np.linalg.norm(trajectory.position - exact.position, axis=2).max(axis=1)
        found.append(Run(engine, about, colour, RecordedRun(trajectory), error if engine != "exact" else error[:0]))
    return found


def _frame(runs: list[Run], time: float) -> Image.Image:
    """Return one picture."""
    surface = offscreen((SIZE[0] * SUPERSAMPLING, SIZE[1] * SUPERSAMPLING))
    surface.fill(BACKGROUND)
    truth = runs[-1].film.frame(time)
    width = (SIZE[0] - 4 * GAP) // len(runs)
    height = SIZE[1] - HEAD - CHART
    for k, run in enumerate(runs):
        left = GAP + k * (width + GAP)
        panel = pygame.Rect(left * SUPERSAMPLING, HEAD * SUPERSAMPLING, width * SUPERSAMPLING, height * SUPERSAMPLING)
        draw_text(surface, run.engine, (panel.left, 7 * SUPERSAMPLING), 16 * SUPERSAMPLING, run.colour, bold=True)
        draw_text(surface, run.about, (panel.left, 27 * SUPERSAMPLING), 12 * SUPERSAMPLING, FAINT)
        _draw_panel(surface.subsurface(panel), run, time, None if run.engine == "exact" else truth)
    _draw_chart(
        surface,
        pygame.Rect(0, (HEAD + height) * SUPERSAMPLING, SIZE[0] * SUPERSAMPLING, CHART * SUPERSAMPLING),
        runs,
        time,
    )
    return image_of(surface).reduce(SUPERSAMPLING)


def _draw_panel(surface: pygame.Surface, run: Run, time: float, truth: "sandbox.Frame | None") -> None:
    """Draw a run at a time, with the balls of the exact solution as rings."""
    camera = Camera.fitting(((-0.03, -0.03), (WIDTH + 0.03, HEIGHT)), surface.get_size(), margin=0.0)
    panel = offscreen(surface.get_size())
    snapshot = run.film.snapshot(time, frozenset({"shapes"}), ghost=truth)
    _RENDERERS.setdefault(run.engine, Renderer()).draw(
        panel, camera, snapshot, ui_scale=float(SUPERSAMPLING), scale=False
    )
    _draw_trails(panel, camera, run, time)
    surface.blit(panel, (0, 0))


_RENDERERS: dict[str, Renderer] = {}


def _draw_trails(surface: pygame.Surface, camera: Camera, run: Run, time: float) -> None:
    """Draw the paths of the balls up to their rims. They do not fade, so that only new pieces add to the gif."""
    times = np.arange(0.0, time, STEP)
    now = run.film.frame(time).position
    past = np.asarray([run.film.frame(past_time).position for past_time in times.tolist()]).reshape(-1, *now.shape)
    shade = mix_colours(BACKGROUND, run.colour, TRAIL)
    for ball, radius in enumerate(run.film.bodies.radius.tolist()):
        points = camera.to_screen(past[:, ball]).tolist()
        for k, (begin, finish) in enumerate(pairwise(points)):
            if np.hypot(*(past[k : k + 2, ball] - now[ball]).T).min() > radius:
                pygame.draw.line(surface, shade, begin, finish, 2 * SUPERSAMPLING)


def _draw_chart(surface: pygame.Surface, area: pygame.Rect, runs: list[Run], time: float) -> None:
    """Draw the chart of errors up to a time."""
    axes = pygame.Rect(area.left + LEFT * SUPERSAMPLING, area.top + 30 * SUPERSAMPLING, 0, 0)
    axes.width, axes.height = area.width - (LEFT + RIGHT) * SUPERSAMPLING, area.height - 42 * SUPERSAMPLING
    title = "error: largest distance of a ball from the exact solution (rings)"
    draw_text(surface, title, (GAP * SUPERSAMPLING, area.top + 9 * SUPERSAMPLING), 12 * SUPERSAMPLING, FAINT)
    end = runs[0].film.duration

    def point_of(at_time: float, error: float) -> tuple[float, float]:
        fraction = np.log(min(max(error, LOWEST), HIGHEST) / LOWEST) / np.log(HIGHEST / LOWEST)
        return axes.left + axes.width * at_time / end, axes.bottom - axes.height * float(fraction)

    for value, text in TICKS:
        y = point_of(0.0, value)[1]
        pygame.draw.line(surface, PANEL, (axes.left, y), (axes.right, y), SUPERSAMPLING)
        draw_text(surface, text, (axes.left - 8 * SUPERSAMPLING, y), 11 * SUPERSAMPLING, FAINT, "midright")
    pygame.draw.line(surface, LINE, axes.bottomleft, axes.bottomright, SUPERSAMPLING)
    seconds = f"{time:.1f} s"
    draw_text(
        surface,
        seconds,
        (area.right - GAP * SUPERSAMPLING, area.top + 9 * SUPERSAMPLING),
        12 * SUPERSAMPLING,
        FAINT,
        "topright",
        mono=True,
    )
    for run in runs:
        if not len(run.error):
            continue
        times = run.film.trajectory.time
        until = int(np.searchsorted(times, time, side="right"))
        points = [point_of(t, e) for t, e in zip(times[:until].tolist(), run.error[:until].tolist(), strict=True)][1:]
        if not points:
            continue
        if len(points) > 1:
            _draw_line(surface, points, run.colour)
        x, y = points[-1]
        pygame.draw.circle(surface, run.colour, (x, y), 4 * SUPERSAMPLING)
        draw_text(
            surface,
            _length(run.error[until - 1]),
            (x + 10 * SUPERSAMPLING, y),
            13 * SUPERSAMPLING,
            run.colour,
            "midleft",
            bold=True,
        )


def _draw_line(surface: pygame.Surface, points: list[tuple[float, float]], colour: RgbColour) -> None:
    pygame.draw.lines(surface, colour, False, points, 2 * SUPERSAMPLING)


def _length(metres: float) -> str:
    for size, unit in ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm")):
        if metres >= size:
            return f"{metres / size:.1f} {unit}" if metres < 10.0 * size else f"{metres / size:.0f} {unit}"
    return "< 1 nm"
