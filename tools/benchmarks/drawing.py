"""Workloads that draw pictures of the window, and peers that draw the same. No display is opened."""

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
"""Number of pictures drawn for one timing."""


def snapshot_after(which: Scene, steps: int) -> Snapshot:
    """Return the snapshot of a scene after a number of steps."""
    simulation = start(which, "pymunk")
    for _ in range(steps):
        simulation.step()
    return Snapshot(which, simulation.bodies, simulation.frame())


def fitting(snapshot: Snapshot) -> Camera:
    """Return a camera that shows all bodies."""
    low, high = snapshot.frame.position.min(0), snapshot.frame.position.max(0)
    return Camera.fitting(((float(low[0]), float(low[1])), (float(high[0]), float(high[1]))), SIZE)


def _each(draw: Callable[[], object]) -> float:
    """Return the seconds for one picture: the median of several, because the machine may be busy."""
    draw()
    return statistics.median(timed(draw) for _ in range(PICTURES))


def drawing(which: Scene, steps: int, antialias: bool) -> Callable[[], float]:
    """Return a workload that draws a scene after a number of steps; it returns seconds per picture."""

    def work() -> float:
        snapshot, surface, picture = snapshot_after(which, steps), pygame.Surface(SIZE), Renderer()
        camera = fitting(snapshot)
        return _each(lambda: picture.draw(surface, camera, snapshot, antialias=antialias))

    return work


def debug_drawing(which: Scene, steps: int) -> Callable[[], float]:
    """Return a workload of pymunk's debug drawing of the same balls, at the same positions and sizes in px."""
    return lambda: _each(_debug_draw(which, steps)[1])


def debug_picture_of(which: Scene, steps: int) -> np.ndarray:
    """Return pymunk's debug drawing of a scene after a number of steps, colours (W, H, 3)."""
    surface, draw = _debug_draw(which, steps)
    draw()
    return pygame.surfarray.array3d(surface)


def picture_of(which: Scene, steps: int, antialias: bool, bodies: bool = True) -> np.ndarray:
    """Return the picture of a scene after a number of steps, colours (W, H, 3), with its bodies or without."""
    snapshot, surface = snapshot_after(which, steps), pygame.Surface(SIZE)
    if not bodies:
        snapshot = replace(snapshot, frame=replace(snapshot.frame, present=np.zeros_like(snapshot.frame.present)))
    Renderer().draw(surface, fitting(snapshot), snapshot, antialias=antialias)
    return pygame.surfarray.array3d(surface)


def _debug_draw(which: Scene, steps: int) -> tuple[pygame.Surface, Callable[[], None]]:
    """Return a surface and a function that draws a scene on it with pymunk's debug drawing."""
    snapshot, surface, space = snapshot_after(which, steps), pygame.Surface(SIZE), pymunk.Space()
    camera = fitting(snapshot)
    for (x, y), angle, radius in zip(
        camera.to_screen(snapshot.frame.position).tolist(),
        snapshot.frame.angle.tolist(),
        (snapshot.bodies.radius * camera.scale).tolist(),
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
    """Return a workload that draws the end of a game by a random player, 50 frames per second; frames per second.

    Args:
        which: the scene of the game; its duration is the length of the game.
        kept: keep one renderer, as the window does, which draws static elements once.
    """
    pictures = PICTURES if kept else 1  # without the cache a picture takes about a second
    actions = deque(sandbox.play_out(which, "random").recording.actions)
    simulation, snapshots = sandbox.start(which), list[Snapshot]()
    while simulation.time < which.world.duration - which.solver.dt:
        while actions and actions[0].time <= simulation.time + which.solver.dt / 2.0:
            simulation.apply(actions.popleft())
        simulation.step()
        if round(simulation.time / which.solver.dt) % 2:
            snapshots.append(Snapshot(simulation.scene, simulation.bodies, simulation.frame()))
    camera, surface, picture = Camera.fitting(view_bounds(which), SIZE), pygame.Surface(SIZE), Renderer()

    def draw() -> None:
        for snapshot in snapshots[-pictures:]:
            (picture if kept else Renderer()).draw(surface, camera, snapshot, antialias=True)

    return lambda: pictures / timed(draw)


def particles(which: Scene, steps: int) -> Callable[[], float]:
    """Return a workload that draws a scene after a number of steps; it returns pictures per second."""
    seconds_per_picture = drawing(which, steps, antialias=True)
    return lambda: 1.0 / seconds_per_picture()


def particles_by_array(which: Scene, steps: int) -> Callable[[], float]:
    """Return the peer of `particles`: straightforward numpy that sets `pixels3d` at all positions in the picture."""

    def work() -> float:
        snapshot, surface = snapshot_after(which, steps), pygame.Surface(SIZE)
        camera, colours = fitting(snapshot), colour_of(snapshot.bodies)

        def draw() -> None:
            surface.fill(BACKGROUND)
            pixel = np.floor(camera.to_screen(snapshot.frame.position)).astype(int)
            inside = ((pixel >= 0) & (pixel < SIZE)).all(axis=1)
            pygame.surfarray.pixels3d(surface)[pixel[inside, 0], pixel[inside, 1]] = colours[inside]

        return 1.0 / _each(draw)

    return work
