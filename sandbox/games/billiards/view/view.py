"""View of billiards: table, rolling balls, and the aim of the next stroke."""

import numpy as np

from sandbox.arrays import IntArray
from sandbox.games.billiards.view.aim import draw_aim, draw_paths
from sandbox.games.billiards.view.balls import BallRenderer
from sandbox.games.billiards.view.prediction import CueAim
from sandbox.games.billiards.view.table import draw_table
from sandbox.window.render.draw_context import DrawContext


class BilliardsView:
    """Draws billiard tables, and balls on any surface on which they roll."""

    def __init__(self) -> None:
        self._balls = BallRenderer()

    def background(self, ctx: DrawContext) -> bool:
        """Draw the table; return False for a surface without one, which is drawn as the ground of other scenes."""
        scene = ctx.snapshot.scene
        if scene.play.area is None:
            return False
        draw_table(ctx, scene, scene.play.area)
        return True

    def below(self, ctx: DrawContext) -> None:
        """Draw the predicted paths."""
        if isinstance(ctx.snapshot.game, CueAim):
            draw_paths(ctx, ctx.snapshot.game, ctx.body_colours)

    def bodies(self, ctx: DrawContext) -> IntArray:
        """Draw the balls, unless they are drawn as points; return the indices of the drawn bodies."""
        if ctx.snapshot.scene.surface is None or ctx.has_points:
            return np.empty(0, np.int64)
        self._balls.draw(ctx)
        return ctx.shown

    def above(self, ctx: DrawContext) -> None:
        """Draw the cue and the markers above the balls."""
        if isinstance(ctx.snapshot.game, CueAim):
            draw_aim(ctx, ctx.snapshot.game)
