"""Drawing: what the benches time of the window's pictures, and peers that draw the same. No display is opened."""

import os
import statistics
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

import pygame
import pymunk
import pymunk.pygame_util

import sandbox
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.palette import BACKGROUND, colour_of
from sandbox.window.render.renderer import Renderer
from sandbox.window.view_bounds import view_bounds
from tools.benchmarks.workloads import timed

SIZE = (1280, 720)
PICTURES = 20
"""Drawn for one timing."""


def moment(which: Scene, steps: int) -> Snapshot:
    """Return what a scene looks like after some steps."""
    simulation = start(which, "pymunk")
    for _ in range(steps):
        simulation.step()
    return Snapshot(which, simulation.bodies, simulation.frame())


def fitting(sight: Snapshot) -> Camera:
    """Return a camera that shows all bodies."""
    low, high = sight.frame.position.min(0), sight.frame.position.max(0)
    return Camera.fitting(((float(low[0]), float(low[1])), (float(high[0]), float(high[1]))), SIZE)


def _each(draw: Callable[[], object]) -> float:
    """Return the seconds that one picture takes: the median of some, as others use the machine too."""
    draw()
    return statistics.median(timed(draw) for _ in range(PICTURES))


def drawing(which: Scene, steps: int, antialias: bool) -> Callable[[], float]:
    """Time pictures of a scene after some steps."""

    def work() -> float:
        sight, surface, picture = moment(which, steps), pygame.Surface(SIZE), Renderer()
        camera = fitting(sight)
        return _each(lambda: picture.draw(surface, camera, sight, antialias=antialias))

    return work


def debug_drawing(which: Scene, steps: int) -> Callable[[], float]:
    """Time pymunk's own drawing of the same balls, in the same places and of the same size, in px."""
    return lambda: _each(_debug_draw(which, steps)[1])


def debug_picture_of(which: Scene, steps: int) -> np.ndarray:
    """Return pymunk's own drawing of a scene after some steps, colours (W, H, 3)."""
    surface, draw = _debug_draw(which, steps)
    draw()
    return pygame.surfarray.array3d(surface)


def picture_of(which: Scene, steps: int, antialias: bool, bodies: bool = True) -> np.ndarray:
    """Return the picture of a scene after some steps, colours (W, H, 3), with its bodies or without."""
    sight, surface = moment(which, steps), pygame.Surface(SIZE)
    if not bodies:
        sight = replace(sight, frame=replace(sight.frame, present=np.zeros_like(sight.frame.present)))
    Renderer().draw(surface, fitting(sight), sight, antialias=antialias)
    return pygame.surfarray.array3d(surface)


def _debug_draw(which: Scene, steps: int) -> tuple[pygame.Surface, Callable[[], None]]:
    """Return a surface, and what draws a scene on it by pymunk's debug drawing."""
    sight, surface, space = moment(which, steps), pygame.Surface(SIZE), pymunk.Space()
    camera = fitting(sight)
    for (x, y), angle, radius in zip(
        camera.to_screen(sight.frame.position).tolist(),
        sight.frame.angle.tolist(),
        (sight.bodies.radius * camera.scale).tolist(),
        strict=True,
    ):
        body = pymunk.Body(1.0, 1.0)
        body.position, body.angle = (x, y), angle
        space.add(body, pymunk.Circle(body, radius))
    options = pymunk.pygame_util.DrawOptions(surface)

    def draw() -> None:
        surface.fill(BACKGROUND)
        space.debug_draw(options)

    return surface, draw


def played(which: Scene, kept: bool) -> Callable[[], float]:
    """Return how many pictures a second there are at the end of a game by a random player, 50 a second of the game.

    Args:
        which: the game, as long as it is played.
        kept: the window's way: what does not change is drawn once.
    """
    pictures = PICTURES if kept else 1  # which takes a second
    done = deque(sandbox.play_out(which, "random").recording.actions)
    simulation, sights = sandbox.start(which), list[Snapshot]()
    while simulation.time < which.world.duration - which.solver.dt:
        while done and done[0].time <= simulation.time + which.solver.dt / 2.0:
            simulation.apply(done.popleft())
        simulation.step()
        if round(simulation.time / which.solver.dt) % 2:
            sights.append(Snapshot(simulation.scene, simulation.bodies, simulation.frame()))
    camera, surface, picture = Camera.fitting(view_bounds(which), SIZE), pygame.Surface(SIZE), Renderer()

    def draw() -> None:
        for sight in sights[-pictures:]:
            (picture if kept else Renderer()).draw(surface, camera, sight, antialias=True)

    return lambda: pictures / timed(draw)


def particles(which: Scene, steps: int) -> Callable[[], float]:
    """Return how many pictures a second there are of a scene after some steps."""
    whole = drawing(which, steps, antialias=True)
    return lambda: 1.0 / whole()


def particles_by_array(which: Scene, steps: int) -> Callable[[], float]:
    """Return the same for numpy as one would write it: all places at once, those outside dropped, `pixels3d` set."""

    def work() -> float:
        sight, surface = moment(which, steps), pygame.Surface(SIZE)
        camera, colours = fitting(sight), colour_of(sight.bodies)

        def draw() -> None:
            surface.fill(BACKGROUND)
            pixel = np.floor(camera.to_screen(sight.frame.position)).astype(int)
            inside = ((pixel >= 0) & (pixel < SIZE)).all(axis=1)
            pygame.surfarray.pixels3d(surface)[pixel[inside, 0], pixel[inside, 1]] = colours[inside]

        return 1.0 / _each(draw)

    return work
