"""Canvas: where and how a picture is drawn."""

from dataclasses import dataclass

import pygame

from sandbox.window.camera import Camera


@dataclass(frozen=True, eq=False)
class Canvas:
    """Target, camera and style of a picture."""

    surface: pygame.Surface
    """of size `camera.size`"""
    camera: Camera
    ui_scale: float = 1.0
    """px, width of a line that is one pixel wide on a 1080p display; line widths and text scale with it"""
    antialias: bool = True
    """whether edges are smooth"""
