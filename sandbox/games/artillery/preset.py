"""Expanding: `[terrain]` to a wall, and the players of `[artillery]` to boxes that stand on it."""

from collections.abc import Iterator
from typing import Any

from sandbox.games.artillery.landscape import columns_of, course_of, heights_of, levelled
from sandbox.games.artillery.terrain import Artillery, Terrain
from sandbox.scene.description.base import Point
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.fixed import Wall
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.errors import Location
from sandbox.scene.files.merge import stated
from sandbox.scene.files.presets import Preset
from sandbox.scene.scene import Scene

GROUND = "terrain"
"""What the wall is called."""

FRICTION = 0.8
"""of ground that says nothing of its own"""

DEEP, HIGH = 0.08, 0.5
"""of the ground's width, below and above its lowest column, that the window shows"""

MARGIN = 1.0
"""columns beyond a tank to either side that are level with it"""

COLOURS = ("#e05a4f", "#4f9de0", "#63c26b", "#e0b84f", "#b07be0", "#4fd0c8", "#e07bb0", "#a3b34a", "#d98a4a", "#8b97a8")


def faults_of(scene: Scene) -> Iterator[tuple[Location, str]]:
    """Yield why a scene's `[terrain]` or `[artillery]` stands for nothing."""
    terrain, artillery = table_of(scene, Terrain), table_of(scene, Artillery)
    walls = {wall.name: wall for wall in scene.walls}
    if terrain is not None and GROUND in walls and terrain.laid is None:
        yield ("terrain",), f"makes a wall named {GROUND!r}, which exists already; remove one of the two"
        return
    if terrain is not None and terrain.heights is not None and terrain.model_fields_set & {"base", "height", "columns"}:
        yield ("terrain", "heights"), "cannot be combined with `columns`, `base` and `height`; remove those"
    if artillery is None:
        return
    if artillery.wind and not (scene.world.linear_drag or scene.world.quadratic_drag):
        yield ("artillery", "wind"), "has no effect without world.linear_drag or world.quadratic_drag; add one"
    if terrain is not None:
        width = terrain.width
    elif GROUND not in walls:
        yield ("artillery",), f"needs ground; add a [terrain], or a wall named {GROUND!r}"
        return
    else:
        columns = columns_of(walls[GROUND].points)
        if columns is None:
            message = f"needs a wall {GROUND!r} with columns of equal width; [terrain] makes such a wall"
            yield ("artillery",), message
            return
        width = columns[1]
    names = [player.name for player in artillery.players]
    for k, player in enumerate(artillery.players):
        if player.name in names[:k]:
            yield (
                ("artillery", "player", k, "name"),
                f"another player is also named {player.name!r}; names must be unique",
            )
        half = 0.5 * artillery.tank[0]
        if not half <= player.position <= width - half:
            yield (
                ("artillery", "player", k, "position"),
                f"is off the ground; a tank must be between {half:g} and {width - half:g} m",
            )
            continue
        before = artillery.players[:k]
        close = [each.name for each in before if abs(each.position - player.position) < 2.0 * half]
        if close:
            message = f"is too near {close[0]!r}; tanks must be at least {2.0 * half:g} m apart"
            yield ("artillery", "player", k, "position"), message


def expanded(scene: Scene) -> Scene:
    """Return the scene of walls and boxes that one with a sound `[terrain]` or `[artillery]` stands for."""
    terrain, artillery = table_of(scene, Terrain), table_of(scene, Artillery)
    if terrain is None and artillery is None:
        return scene
    if terrain is not None and terrain.laid is not None:
        scene = _laid_anew(scene, terrain, terrain.laid)
    changes: dict[str, Any] = {"terrain": None}
    walls = scene.walls
    if terrain is not None:
        if not any(wall.name == GROUND for wall in walls):
            walls = (*walls, _wall(terrain, artillery, scene.world.seed))
            changes["walls"] = walls
        if terrain.heights is None:
            changes["terrain"] = terrain.model_copy(update={"laid": scene.world.seed})
    if artillery is not None:
        ground = next(wall for wall in walls if wall.name == GROUND)
        taken = {each.name for movers in scene.kinds.values() for each in movers}
        tanks = tuple(
            _tank(artillery, k, ground) for k, player in enumerate(artillery.players) if player.name not in taken
        )
        changes["boxes"] = (*scene.boxes, *tanks)
        changes["play"] = stated(scene.play, {"game": "artillery", "view": _view(ground)})
    return scene.model_copy(update=changes)


def _wall(terrain: Terrain, artillery: Artillery | None, seed: int) -> Wall:
    """Return the ground that a seed lays out."""
    heights = heights_of(terrain, seed)
    for at, half in _pads(artillery, terrain.width / len(heights)):
        heights = levelled(heights, terrain.width, at, half)
    own = {key: getattr(terrain, key) for key in ("material", "restitution", "friction", "colour")}
    if own["material"] is None and own["friction"] is None:
        own["friction"] = FRICTION
    return Wall(name=GROUND, points=course_of(heights, terrain.width), **own)


def _laid_anew(scene: Scene, terrain: Terrain, laid: int) -> Scene:
    """Return a scene, whose ground a seed has laid out, as its own seed does, if that is another.

    Ground that has been given another course since stays as it is, and tanks that have been moved stay where they are.
    """
    walls = {wall.name: wall for wall in scene.walls}
    artillery = table_of(scene, Artillery)
    before, after = (_wall(terrain, artillery, seed) for seed in (laid, scene.world.seed))
    if laid == scene.world.seed or GROUND not in walls or walls[GROUND].points != before.points:
        return scene
    changes: dict[str, Any] = {
        "walls": tuple(
            wall.model_copy(update={"points": after.points}) if wall.name == GROUND else wall for wall in scene.walls
        )
    }
    if artillery is not None:
        count = range(len(artillery.players))
        stood, stand = (
            {tank.name: tank for tank in (_tank(artillery, k, ground) for k in count)} for ground in (before, after)
        )
        changes["boxes"] = tuple(
            box.model_copy(update={"position": stand[box.name].position})
            if box.name in stood and box.position == stood[box.name].position
            else box
            for box in scene.boxes
        )
        if scene.play.view == _view(before):
            changes["play"] = scene.play.model_copy(update={"view": _view(after)})
    return scene.model_copy(update=changes)


def _view(ground: Wall) -> tuple[Point, Point]:
    """Return what the window shows: the ground from somewhat below its lowest column up to where shells fly, m."""
    width, low = ground.points[-1][0], min(y for _, y in ground.points)
    return (0.0, low - DEEP * width), (width, low + HIGH * width)


def _pads(artillery: Artillery | None, each: float) -> Iterator[tuple[float, float]]:
    """Yield where tanks stand, m, and how far to either side the ground is level there, m."""
    if artillery is not None:
        for player in artillery.players:
            yield player.position, 0.5 * artillery.tank[0] + MARGIN * each


def _tank(artillery: Artillery, k: int, ground: Wall) -> Box:
    player = artillery.players[k]
    columns = columns_of(ground.points)
    assert columns is not None
    heights, width = columns
    each, half = width / len(heights), 0.5 * artillery.tank[0]
    under = [h for n, h in enumerate(heights) if abs((n + 0.5) * each - player.position) <= half + each]
    return Box(
        name=player.name,
        position=(player.position, max(under) + 0.5 * ground.thickness + 0.5 * artillery.tank[1]),
        size=artillery.tank,
        mass=artillery.mass,
        friction=artillery.friction,
        colour=player.colour or COLOURS[k],
    )


TERRAIN = Preset(
    Terrain,
    "expanded to primitives when the scene is read; None afterwards",
    faults_of=faults_of,
    expanded=expanded,
)
ARTILLERY = Preset(
    Artillery, "players and rules; the tanks are expanded to boxes", faults_of=faults_of, expanded=expanded
)
