"""GameView: what a game draws itself. The renderer asks the view of a scene's game, and knows no game.

A view is found through the `GameSpec` of its game, and imported when a scene of the game is drawn. A renderer has one
view per game, which may keep sprites, and how balls have rolled, from one picture to the next.
"""

from typing import Protocol, runtime_checkable

from sandbox.arrays import IntArray
from sandbox.games.names import GAMES, game_specs, spec_of
from sandbox.games.spec import GameSpec, import_part
from sandbox.scene.scene import Scene
from sandbox.window.render.draw_context import DrawContext


class GameView(Protocol):
    """Draws the parts of a picture that are special to a game. `ctx.snapshot.game` is `Rules.view_state`, or None."""

    def background(self, ctx: DrawContext) -> bool:
        """Draw ground and static bodies on an empty surface; return False to have them drawn as in other scenes.

        The picture is cached until scene or camera change. `ctx` has no bodies.
        """

    def below(self, ctx: DrawContext) -> None:
        """Draw what lies below the bodies."""

    def bodies(self, ctx: DrawContext) -> IntArray:
        """Draw some bodies; return their indices, which are then not drawn as shapes."""

    def above(self, ctx: DrawContext) -> None:
        """Draw what lies above the bodies."""


@runtime_checkable
class HasHud(Protocol):
    """View that also draws text or signs over the picture, in the window only."""

    def hud(self, ctx: DrawContext) -> None:
        """Draw over everything else in the picture."""


class GameViews:
    """Views by game; each is created when it is first needed."""

    def __init__(self) -> None:
        self._views: dict[str, GameView] = {}
        self._last: tuple[Scene, GameView | None] | None = None

    def view_of(self, scene: Scene) -> GameView | None:
        """Return the view that draws a scene; None if no game does."""
        if self._last is None or self._last[0] is not scene:
            path = view_path(scene)
            if path is not None and path not in self._views:
                self._views[path] = import_part(path)()
            self._last = scene, None if path is None else self._views[path]
        return self._last[1]


def view_path(scene: Scene) -> str | None:
    """Return the import string of the view that draws a scene; None if no game does.

    The game that the scene names comes first, then those that draw such a scene without being named.
    """
    specs = game_specs()
    if scene.play.game is not None:
        named = _named_spec(scene.play.game)
        specs = specs if named is None else (named, *(spec for spec in specs if spec is not named))
    return next((spec.view for spec in specs if spec.view is not None and _presents(spec, scene)), None)


def _named_spec(game: str) -> GameSpec | None:
    try:
        return spec_of(game)
    except (ImportError, AttributeError):
        assert game not in GAMES
        return None  # a game of another package that is broken: the start of the game reports it


def _presents(spec: GameSpec, scene: Scene) -> bool:
    if spec.presents is None:
        return scene.play.game in spec.names
    return bool(import_part(spec.presents)(scene))
