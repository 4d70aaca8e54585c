"""Game views: drawing specific to a game. The renderer looks up the view of a scene and depends on no game.

A view is named in the `GameSpec` of its game and imported when a scene of that game is first drawn. A renderer keeps
one view per game, which may cache sprites and the rolling orientation of balls between frames.
"""

from typing import Protocol, runtime_checkable

from sandbox.arrays import IntArray
from sandbox.game_names import GAMES, game_specs, spec_of
from sandbox.game_spec import GameSpec, import_part
from sandbox.scene.compile.scene import Scene
from sandbox.window.render.draw_context import DrawContext


class GameView(Protocol):
    """Draws the parts of a frame that are specific to a game. `ctx.snapshot.game` is `Rules.view_state`, or None."""

    def background(self, ctx: DrawContext) -> bool:
        """Draw ground and static bodies on an empty surface; return False to use the default drawing.

        The surface is cached until the scene or the camera changes. `ctx` contains no bodies.
        """

    def below(self, ctx: DrawContext) -> None:
        """Draw the layer below the bodies."""

    def bodies(self, ctx: DrawContext) -> IntArray:
        """Draw some bodies; return their indices, which the renderer then skips."""

    def above(self, ctx: DrawContext) -> None:
        """Draw the layer above the bodies."""


@runtime_checkable
class HasHud(Protocol):
    """View that also draws text or icons over the frame, in the window only."""

    def hud(self, ctx: DrawContext) -> None:
        """Draw over all other content of the frame."""


class GameViews:
    """Views by game, created on first use."""

    def __init__(self) -> None:
        self._views: dict[str, GameView] = {}
        self._last: tuple[Scene, GameView | None] | None = None

    def view_of(self, scene: Scene) -> GameView | None:
        """Return the view that draws a scene; None if no game has one for it."""
        if self._last is None or self._last[0] is not scene:
            path = view_path(scene)
            if path is not None and path not in self._views:
                self._views[path] = import_part(path)()
            self._last = scene, None if path is None else self._views[path]
        return self._last[1]


def view_path(scene: Scene) -> str | None:
    """Return the import string of the view that draws a scene; None if there is none.

    The game named by the scene takes precedence over games whose `presents` accepts the scene.
    """
    specs = game_specs()
    if scene.play.game is not None:
        named = _named_spec(scene.play.game)
        specs = specs if named is None else (named, *(spec for spec in specs if spec is not named))
    return next((spec.view for spec in specs if spec.view is not None and _presents(spec, scene)), None)


def _named_spec(game: str) -> GameSpec | None:
    try:
        return spec_of(game)
    except (ImportError, AttributeError, ValueError):
        assert game not in GAMES
        return None  # an installed game that fails to import: starting the game reports the error


def _presents(spec: GameSpec, scene: Scene) -> bool:
    if spec.presents is None:
        return scene.play.game in spec.names
    return bool(import_part(spec.presents)(scene))
