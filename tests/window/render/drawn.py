"""Small scenes, their snapshots and frames, and queries of their pictures."""

from collections.abc import Sequence

import numpy as np
import pygame

from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Contacts, Frame
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.palette import RgbColour
from sandbox.window.render.renderer import Renderer

SIZE = (200, 120)
CAMERA = Camera((0.0, 0.0), 20.0, SIZE)
"""10 m wide and 6 m high, with the origin at the centre."""


def scene(*, balls: Sequence[dict] = (), **tables: object) -> Scene:
    return from_document({"ball": list(balls), **tables} if balls else dict(tables))


def ball(x: float, y: float, radius: float = 1.0, **more: object) -> dict:
    return {"position": [x, y], "radius": radius, **more}


def frame(model: Scene, **changes: object) -> Frame:
    bodies = model.bodies
    arrays = {
        "time": 0.0,
        "position": bodies.position.copy(),
        "velocity": bodies.velocity.copy(),
        "angle": bodies.angle.copy(),
        "angular_velocity": bodies.angular_velocity.copy(),
        "present": np.ones(len(bodies), np.bool_),
    }
    return Frame(**(arrays | changes))


def snapshot(model: Scene, *overlays: str, shapes: bool = True, **more: object) -> Snapshot:
    shown = {"shapes", *overlays} if shapes else set(overlays)
    return Snapshot(model, **({"bodies": model.bodies, "frame": frame(model), "overlays": frozenset(shown)} | more))


def contact(pair: tuple[int, int], point: tuple, normal: tuple, impulse: tuple = (0.0, 0.0)) -> Contacts:
    return Contacts(
        np.zeros(1), np.asarray([pair]), *(np.asarray([each], dtype=float) for each in (point, normal, impulse))
    )


def render(
    shown: Snapshot, camera: Camera = CAMERA, *, renderer: Renderer | None = None, **options: object
) -> np.ndarray:
    """Return the picture of a snapshot as colours, (W, H, 3)."""
    surface = pygame.Surface(camera.size)
    (renderer or Renderer()).draw(surface, camera, shown, **options)
    return pygame.surfarray.array3d(surface)


def colour_at(picture: np.ndarray, x: float, y: float, camera: Camera = CAMERA) -> RgbColour:
    """Return the colour of the pixel at a point, m."""
    column, row = np.floor(camera.to_screen(np.asarray((x, y)))).astype(int)
    return tuple(int(channel) for channel in picture[column, row])


def changed_pixels(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return which pixels differ, (W, H)."""
    return (a != b).any(axis=2)
