"""Expansion of the `[billiards]` table of a scene to surface, walls, posts, pockets, balls and spots."""

import math
from collections.abc import Iterator
from typing import Any

from sandbox.games.billiards.tables import (
    BALLS,
    CUSHION_MATERIAL,
    NOSE_HEIGHT,
    RACK_BALLS,
    RACK_SPOTS,
    TABLES,
    BallSet,
    Billiards,
    RackName,
    TableGame,
    static_colliders,
)
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.description.play import Spot
from sandbox.scene.description.surface import Floor
from sandbox.scene.description.world import Material, Pair
from sandbox.scene.errors import Location
from sandbox.scene.files.presets import Preset, added, paired, stated

BALL_MATERIAL = "phenolic"
"""material of the balls"""

RACKS: dict[TableGame, RackName] = {
    "8-ball": "8-ball",
    "9-ball": "9-ball",
    "three-cushion": "carom",
    "straight-rail": "carom",
    "snooker": "snooker",
    "free": "none",
}
"""rack of each game"""

DURATION = 20.0
"""s: after a hard break the balls roll for 10 to 15 s"""
SUBSTEPS = 10
"""for stepping engines: at 1 kHz, even a ball at 18 m/s moves by less than its radius in a substep"""


def faults_of(scene: Scene) -> Iterator[tuple[Location, str]]:
    """Yield the faults of the `[billiards]` table of a scene."""
    billiards = table_of(scene, Billiards)
    if billiards is None:
        return
    rack, spots = _rack(billiards), _spots(scene, billiards)
    missing = [name for name in RACK_SPOTS[rack] if name not in spots]
    key = "rack" if billiards.rack is not None else "game"
    if missing and billiards.table is None:
        yield (
            ("billiards", key),
            f"{rack} needs spots to place its balls; add a `table`, or a [[play.spot]] for {_quoted_list(missing)}",
        )
    elif missing:
        yield (
            ("billiards", key),
            f"{rack} cannot be racked on {billiards.table}, which has no spots {_quoted_list(missing)}",
        )
    elif rack in ("8-ball", "9-ball", "carom") and math.dist(spots["head"], spots["foot"]) < 1e-9:
        yield ("billiards", key), "the spots 'head' and 'foot' are at the same point; the rack needs a direction"
    known = _ball_set(billiards).colours
    for name in billiards.place:
        if name not in known:
            yield ("billiards", "place", name), f"is not a ball of the set; balls: {_quoted_list(list(known))}"


def expanded(scene: Scene) -> Scene:
    """Return a scene with its valid `[billiards]` expanded to primitives; without `[billiards]`, the scene itself.

    Elements that the scene states come first in each list, and take precedence over elements of the same name.
    """
    billiards = table_of(scene, Billiards)
    if billiards is None:
        return scene
    balls, rack, spots = _ball_set(billiards), _rack(billiards), _spots(scene, billiards)
    radius = balls.radius if billiards.ball_radius is None else billiards.ball_radius
    floor = {
        "sliding_friction": balls.sliding,
        "rolling_friction": balls.rolling,
        "spinning_friction": balls.spinning * radius,
    }
    changes: dict[str, Any] = {
        "billiards": None,
        "surface": stated(scene.surface or Floor(), floor),
        "contact_models": stated(scene.contact_models, {"ball_ball": "frictional", "cushion": "han2005"}),
        "world": stated(scene.world, {"duration": DURATION}),
        "solver": stated(scene.solver, {"substeps": SUBSTEPS}),
        "materials": added(scene.materials, (Material(name=BALL_MATERIAL), Material(name=CUSHION_MATERIAL))),
        "pairs": paired(scene.pairs, _pairs(billiards)),
        "balls": added(scene.balls, _balls(billiards, balls, rack, spots, radius, scene.world.seed)),
    }
    play: dict[str, Any] = {"game": billiards.game}
    if billiards.table is not None:
        table = TABLES[billiards.table]
        nose = next(each for each in (billiards.nose, balls.nose, 2.0 * NOSE_HEIGHT * radius) if each is not None)
        static = static_colliders(table, nose)
        changes["walls"] = added(scene.walls, static.walls)
        changes["posts"] = added(scene.posts, static.posts)
        changes["pockets"] = added(scene.pockets, static.pockets)
        play["area"] = ((0.0, 0.0), (table.width, table.length))
    named = tuple(Spot(name=name, position=at) for name, at in spots.items())
    changes["play"] = stated(scene.play, play).model_copy(update={"spots": named})
    return scene.model_copy(update=changes)


def _balls(
    billiards: Billiards, balls: BallSet, rack: RackName, spots: dict[str, Point], radius: float, seed: int
) -> list[Ball]:
    """Return the balls on the table, in the order of their set."""
    from sandbox.games.billiards.tables import rack_positions  # imports numpy, which the JSON schema must not

    positions = {**rack_positions(rack, spots, radius, billiards.gap, seed), **billiards.place}
    mass = balls.mass if billiards.ball_mass is None else billiards.ball_mass
    return [
        Ball(name=name, position=positions[name], radius=radius, mass=mass, material=BALL_MATERIAL, colour=colour)
        for name, colour in balls.colours.items()
        if name in positions
    ]


def _rack(billiards: Billiards) -> RackName:
    return RACKS[billiards.game] if billiards.rack is None else billiards.rack


def _ball_set(billiards: Billiards) -> BallSet:
    """Return the ball set of the rack, else of the table, else of pool."""
    name = RACK_BALLS.get(_rack(billiards))
    if name is None:
        name = "pool" if billiards.table is None else TABLES[billiards.table].balls
    return BALLS[name]


def _spots(scene: Scene, billiards: Billiards) -> dict[str, Point]:
    """Return the spots of the scene and of its table, by name; those of the scene take precedence."""
    scene_spots = {spot.name: spot.position for spot in scene.play.spots}
    table_spots = {} if billiards.table is None else TABLES[billiards.table].spots
    return scene_spots | {name: at for name, at in table_spots.items() if name not in scene_spots}


def _pairs(billiards: Billiards) -> tuple[Pair, ...]:
    return (
        Pair(between=(BALL_MATERIAL, BALL_MATERIAL), restitution=billiards.ball_restitution),
        Pair(
            between=(BALL_MATERIAL, CUSHION_MATERIAL),
            restitution=billiards.cushion_restitution,
            friction=billiards.cushion_friction,
        ),
    )


def _quoted_list(names: list[str]) -> str:
    return ", ".join(map(repr, names))


BILLIARDS = Preset(
    Billiards,
    "expanded to primitives when the scene is read; None afterwards",
    is_kept=False,
    faults_of=faults_of,
    expanded=expanded,
)


def presents(scene: Scene) -> bool:
    """Return whether a scene is drawn as billiards: it has a table, or a surface on which balls roll."""
    return scene.play.area is not None or (scene.surface is not None and scene.surface.bodies != "pucks")
