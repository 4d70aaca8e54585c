"""Canvas: where and how a picture is drawn; draw context: a canvas with the frame being drawn; view of a game."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.description.base import Point
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.circles import CircleStyle
from sandbox.window.render.palette import ColourArray

FARTHEST = 1e6
"""px, largest coordinate of rectangles: SDL has no coordinates beyond 32 bits"""


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

    def pixels(self, points: Sequence[Point] | FloatArray, limit: float = np.inf) -> list[tuple[float, float]]:
        """Return points, m, in pixels; coordinates beyond a limit are moved to it."""
        found = self.camera.to_screen(np.asarray(points))
        if limit < np.inf:
            found = np.clip(np.nan_to_num(found, nan=limit, posinf=limit, neginf=-limit), -limit, limit)
        return [(x, y) for x, y in found.tolist()]


@dataclass(frozen=True, eq=False, kw_only=True)
class DrawContext(Canvas):
    """A canvas with the snapshot of the frame being drawn and its visible bodies, passed to all drawing functions."""

    snapshot: Snapshot
    shown: IntArray
    """(K,) indices of the bodies that are present and visible"""
    centre: FloatArray
    """(K, 2) px, of the visible bodies"""
    radius: FloatArray
    """(K,) px"""
    colours: ColourArray
    """(K, 3)"""
    body_colours: ColourArray
    """(N, 3) colours of all bodies, by index"""
    has_points: bool = False
    """whether the smallest bodies are drawn as points, below everything else"""

    def first(self, most: int) -> "DrawContext":
        """Return this context with at most `most` bodies, sampled evenly from all of them."""
        if len(self.shown) <= most:
            return self
        kept = np.linspace(0, len(self.shown) - 1, most).astype(np.intp)
        return replace(
            self,
            shown=self.shown[kept],
            centre=self.centre[kept],
            radius=self.radius[kept],
            colours=self.colours[kept],
        )

    def inside(self, pixels: FloatArray, margin: float = 0.0) -> IntArray:
        """Return the indices of the points (K, 2) px on the surface or within a margin of it; nan counts as outside."""
        x, y = pixels[:, 0], pixels[:, 1]
        width, height = self.camera.size
        return np.flatnonzero((x >= -margin) & (x < width + margin) & (y >= -margin) & (y < height + margin))

    def style(self, line: float = 1.5) -> CircleStyle:
        """Return the style of discs with a rim of `line` px at a UI scale of 1."""
        return CircleStyle(line * self.ui_scale, antialias=self.antialias)


class GameView:
    """Draws the parts of a frame that are specific to a game. `ctx.snapshot.game` is `Rules.view_state`, or None.

    A view is named in the `GameSpec` of its game and imported when a scene of that game is first drawn. A renderer
    keeps one view per game, which may cache sprites and the rolling orientation of balls between frames. A class with
    these methods that does not derive from this one is a view too; it may lack `hud`.
    """

    def background(self, ctx: DrawContext) -> bool:  # noqa: ARG002, views that draw it use it
        """Draw ground and static bodies on an empty surface; return False to use the default drawing.

        The surface is cached until the scene or the camera changes. `ctx` contains no bodies.
        """
        return False

    def below(self, ctx: DrawContext) -> None:
        """Draw the layer below the bodies."""

    def bodies(self, ctx: DrawContext) -> IntArray:  # noqa: ARG002, views that draw some use it
        """Draw some bodies; return their indices, which the renderer then skips."""
        return np.empty(0, np.int64)

    def above(self, ctx: DrawContext) -> None:
        """Draw the layer above the bodies."""

    def hud(self, ctx: DrawContext) -> None:
        """Draw text or icons over all other content of the frame, in the window only."""
