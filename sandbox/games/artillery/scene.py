"""Tables `[terrain]` and `[artillery]` of scene files, and their expansion to elements.

`[terrain]` expands to a wall, named `terrain`, whose points are a height field of columns of equal width: given
heights, or random hills by midpoint displacement. Each player of `[artillery]` expands to a box on levelled ground.
Lengths are in m; heights are measured from the base of the terrain, y = 0.
"""

from __future__ import annotations  # numpy is imported only for random landscapes

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Colour, Friction, HasMaterial, Mass, Name, Part, Point
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.fixed import Wall
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.errors import Location
from sandbox.scene.files.presets import Preset, stated

if TYPE_CHECKING:
    import numpy as np

MAX_COLUMNS = 5_000

TerrainHeight = Annotated[float, Field(ge=0, le=1e6)]
"""Height above the base of the terrain, m."""

Edges = Literal["open", "rubber", "wrap"]
"""Behaviour of a shell at the left and right end of the terrain: it leaves, rebounds, or reappears at the other end."""


class Terrain(HasMaterial):
    """Ground from 0 to `width`, made of columns of equal width: a wall through the centres of their tops.

    Without `heights`, midpoint displacement makes random hills from the seed of the scene.
    """

    width: Annotated[float, Field(gt=0, le=1e6)]
    """m"""
    columns: Annotated[int, Field(ge=2, le=MAX_COLUMNS)] = 300
    """number of columns of the ground"""
    base: TerrainHeight = 10.0
    """height of the lowest column, m"""
    height: TerrainHeight = 40.0
    """height of the highest column above the lowest, m"""
    roughness: Annotated[float, Field(ge=0, le=1)] = 0.3
    """0 for smooth hills to 1 for jagged ones: each octave has 2^(roughness − 1) times the amplitude of the one
    before"""
    heights: Annotated[tuple[TerrainHeight, ...], Field(min_length=2, max_length=MAX_COLUMNS)] | None = None
    """height of each column, m; replaces columns, base, height and roughness"""
    laid: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    """seed from which the wall `terrain` was generated, in expanded scenes only; setting another seed generates new
    hills"""


class Player(Part):
    """A player with a tank."""

    name: Name
    """name of the player, and of the box that represents the tank"""
    position: Annotated[float, Field(ge=-1e6, le=1e6)]
    """position of the tank along the ground, m; the ground under it is levelled"""
    bot: Annotated[float, Field(ge=0, le=1)] | None = None
    """skill of a computer player, 1 for perfect aim; without it, a person plays"""
    colour: Colour | None = None
    """colour of the tank, `#rrggbb`"""


class Artillery(Part):
    """Players on a terrain who take turns to shoot at each other.

    The ground is the wall `terrain`; the tanks are boxes with the names of the players. Boxes with these names that the
    scene already has are kept.
    """

    players: Annotated[tuple[Player, ...], Field(min_length=2, max_length=10, alias="player")]
    """players in the order of their turns"""
    edges: Edges = "open"
    """behaviour of a shell at the left and right end of the ground: `open`, it flies on; `rubber`, it rebounds; `wrap`,
    it reappears at the other end"""
    wind: Annotated[float, Field(ge=0, le=100)] = 0.0
    """largest wind, m/s: each turn has a new random wind between −wind and wind; 0 keeps the wind of [world]"""
    speed: Annotated[float, Field(gt=0, le=1e4)] = 60.0
    """m/s, of a shell at full power"""
    rounds: Annotated[int, Field(ge=1, le=1000)] = 20
    """largest number of turns of each player"""
    money: Annotated[int, Field(ge=0, le=10**9)] = 1000
    """money of each player at the start"""
    tank: tuple[Annotated[float, Field(gt=0, le=1e3)], Annotated[float, Field(gt=0, le=1e3)]] = (3.0, 1.5)
    """width and height of a tank, m"""
    mass: Mass = 1000.0
    """mass of a tank, kg"""
    friction: Friction = 1.0
    """friction of a tank"""
    tracer: bool = False
    """show the predicted path of a shot"""


QUANTUM = 2.0**-20
"""m, 0.95 µm, unit of heights. Heights up to 8 million metres, and sums of 5,000 of them, are exact in double
precision."""


COLUMN_TOLERANCE = 1e-9
"""tolerance of the position of a column, as a fraction of the width of the terrain: rounding"""


def settled(height: float) -> float:
    """Return a height, m, rounded to a multiple of `QUANTUM`, at least 0."""
    return max(round(height / QUANTUM), 0) * QUANTUM


def course_of(heights: Sequence[float], width: float) -> tuple[Point, ...]:
    """Return the points of the wall over columns: through the centres of their tops, and level to both ends."""
    each = width / len(heights)
    tops = [((k + 0.5) * each, height) for k, height in enumerate(heights)]
    return ((0.0, heights[0]), *tops, (width, heights[-1]))


def columns_of(points: Sequence[Point]) -> tuple[tuple[float, ...], float] | None:
    """Return heights and total width, m, of the columns that a wall represents; None if it represents none.

    Inverse of `course_of`.
    """
    if len(points) < 4 or points[0][0] != 0.0:
        return None
    width, heights = points[-1][0], tuple(y for _, y in points[1:-1])
    if width <= 0.0 or points[0][1] != heights[0] or points[-1][1] != heights[-1] or min(heights) < 0.0:
        return None
    for (x, _), (even_x, _) in zip(points, course_of(heights, width), strict=True):
        if abs(x - even_x) > COLUMN_TOLERANCE * width:
            return None
    return heights, width


def heights_of(terrain: Terrain, seed: int) -> tuple[float, ...]:
    """Return the height of each column of a terrain, m."""
    if terrain.heights is not None:
        return tuple(settled(height) for height in terrain.heights)
    line = displaced(terrain.columns, 2.0 ** -(1.0 - terrain.roughness), seed)
    low, high = float(line.min()), float(line.max())
    fraction = (line - low) / (high - low)
    return tuple(settled(terrain.base + terrain.height * each) for each in fraction.tolist())


def displaced(count: int, shrink: float, seed: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return `count` ≥ 2 heights of a random line, by midpoint displacement.

    Each octave has `shrink` times the amplitude of the one before.
    """
    import numpy as np

    from sandbox.scene.random_streams import Stream, draws

    random = draws(Stream.LANDSCAPE, seed)
    line, spread = random.standard_normal(3), 1.0
    while len(line) < count:
        spread *= shrink
        finer = np.empty(2 * len(line) - 1)
        finer[::2] = line
        finer[1::2] = 0.5 * (line[1:] + line[:-1]) + spread * random.standard_normal(len(line) - 1)
        line = finer
    indices = np.linspace(0.0, len(line) - 1.0, count)
    return np.interp(indices, np.arange(len(line)), line)


def levelled(heights: tuple[float, ...], width: float, at: float, half: float) -> tuple[float, ...]:
    """Return heights, m, levelled around `at`: columns within `half`, m, get the height of the column at `at`."""
    each = width / len(heights)
    level = heights[min(max(int(at / each), 0), len(heights) - 1)]
    return tuple(level if abs((k + 0.5) * each - at) <= half else height for k, height in enumerate(heights))


GROUND = "terrain"
"""Name of the wall."""

FRICTION = 0.8
"""default friction of the wall"""

VIEW_BELOW, VIEW_ABOVE = 0.08, 0.5
"""extent of the view below and above the lowest column, as fractions of the width of the terrain"""

MARGIN = 1.0
"""columns to either side of a tank that are levelled too"""

COLOURS = ("#e05a4f", "#4f9de0", "#63c26b", "#e0b84f", "#b07be0", "#4fd0c8", "#e07bb0", "#a3b34a", "#d98a4a", "#8b97a8")


def faults_of(scene: Scene) -> Iterator[tuple[Location, str]]:
    """Yield the location and message of each fault of `[terrain]` and `[artillery]` in a scene."""
    terrain, artillery = table_of(scene, Terrain), table_of(scene, Artillery)
    walls = {wall.name: wall for wall in scene.walls}
    if terrain is not None and GROUND in walls and terrain.laid is None:
        yield ("terrain",), f"makes a wall named {GROUND!r}, which exists already; remove one of the two"
        return
    if terrain is not None and terrain.heights is not None and terrain.model_fields_set & {"base", "height", "columns"}:
        yield ("terrain", "heights"), "cannot be combined with `columns`, `base` and `height`; remove those"
    if artillery is None:
        return
    if artillery.wind and not scene.world.has_drag:
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
    """Return a scene with `[terrain]` and `[artillery]`, which have no faults, expanded to walls and boxes."""
    terrain, artillery = table_of(scene, Terrain), table_of(scene, Artillery)
    if terrain is None and artillery is None:
        return scene
    if terrain is not None and terrain.laid is not None:
        scene = _regenerated(scene, terrain, terrain.laid)
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
    """Return the wall of a terrain, generated from a seed, with levelled ground under the tanks."""
    heights = heights_of(terrain, seed)
    for at, half in _pads(artillery, terrain.width / len(heights)):
        heights = levelled(heights, terrain.width, at, half)
    own = {key: getattr(terrain, key) for key in ("material", "restitution", "friction", "colour")}
    if own["material"] is None and own["friction"] is None:
        own["friction"] = FRICTION
    return Wall(name=GROUND, points=course_of(heights, terrain.width), **own)


def _regenerated(scene: Scene, terrain: Terrain, laid: int) -> Scene:
    """Return a scene whose terrain, from the seed `laid`, is generated again if the seed of the scene has changed.

    A wall whose points have been changed since is kept, and so are the positions of tanks that have been moved.
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
        old_tanks, new_tanks = (
            {tank.name: tank for tank in (_tank(artillery, k, ground) for k in count)} for ground in (before, after)
        )
        changes["boxes"] = tuple(
            box.model_copy(update={"position": new_tanks[box.name].position})
            if box.name in old_tanks and box.position == old_tanks[box.name].position
            else box
            for box in scene.boxes
        )
        if scene.play.view == _view(before):
            changes["play"] = scene.play.model_copy(update={"view": _view(after)})
    return scene.model_copy(update=changes)


def _view(ground: Wall) -> tuple[Point, Point]:
    """Return the corners of the view, m: the width of the terrain, and space for the flight of shells above it."""
    width, low = ground.points[-1][0], min(y for _, y in ground.points)
    return (0.0, low - VIEW_BELOW * width), (width, low + VIEW_ABOVE * width)


def _pads(artillery: Artillery | None, each: float) -> Iterator[tuple[float, float]]:
    """Yield, for each tank, its x and the half-width of the levelled ground, m."""
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


def needs_player(scene: Scene) -> str | None:
    """Return why a game does not proceed without input: the first player without a bot has to fire."""
    artillery = table_of(scene, Artillery)
    players = () if artillery is None else artillery.players
    name = next((player.name for player in players if player.bot is None), None)
    if name is None:
        return None
    return f"player 'none' fires no gun, so {name} would never play; use random, skilled or a script"


def presents(scene: Scene) -> bool:
    """Return whether a scene is drawn by the view of artillery: whether it has players."""
    return table_of(scene, Artillery) is not None
