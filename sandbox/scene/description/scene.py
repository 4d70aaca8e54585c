"""SceneDescription: the contents of a scene file as frozen values. SI units, y up, radians.

Generators are not expanded, and coefficients of pairs are not mixed: see `sandbox.scene.compile`.
"""

import copy
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, StringConstraints

from sandbox.scene.description.actions import Event, Spawn
from sandbox.scene.description.base import GROUND, BodySource, Collider, HasMaterial, Items, Part, default
from sandbox.scene.description.bodies import Box, Capsule, Compound, Polygon
from sandbox.scene.description.discs import Ball, Emitter, Grid, Scatter
from sandbox.scene.description.fixed import Plane, Post, Sensor, Wall, Zone
from sandbox.scene.description.forces import AnyDrive, Attraction, Thrust, Tyre
from sandbox.scene.description.game_tables import with_game_tables
from sandbox.scene.description.generators import Cloth, Ragdoll, Rope, Stack
from sandbox.scene.description.joints import Joint
from sandbox.scene.description.play import Play
from sandbox.scene.description.surface import ContactModels, Floor, Pocket, Shot
from sandbox.scene.description.world import Material, Pair, Settings, World

if TYPE_CHECKING:
    from sandbox.arrays import BoolArray, IntArray


MAX_EVENTS = 10_000
"""Largest number of events of a scene"""


@with_game_tables()
class _Header(Part):
    """First fields of a scene, in the order of a file; the tables of games come next."""

    title: Annotated[str, StringConstraints(max_length=200)] = ""
    """Title of the scene."""
    about: Annotated[str, StringConstraints(max_length=2000)] = ""
    """What to observe."""
    world: World = Field(default_factory=World)
    solver: Settings = Field(default_factory=Settings)
    play: Play = Field(default_factory=Play)


class SceneDescription(_Header):
    """Contents of a scene file."""

    surface: Floor | None = None
    contact_models: ContactModels = Field(default_factory=ContactModels)
    materials: Items[Material] = default((), alias="material")
    pairs: Items[Pair] = default((), alias="pair")
    planes: Items[Plane] = default((), alias="plane")
    walls: Items[Wall] = default((), alias="wall")
    posts: Items[Post] = default((), alias="post")
    pockets: Items[Pocket] = default((), alias="pocket")
    zones: Items[Zone] = default((), alias="zone")
    balls: Items[Ball] = default((), alias="ball")
    grids: Items[Grid] = default((), alias="grid")
    scatters: Items[Scatter] = default((), alias="scatter")
    emitters: Items[Emitter] = default((), alias="emitter")
    boxes: Items[Box] = default((), alias="box")
    capsules: Items[Capsule] = default((), alias="capsule")
    polygons: Items[Polygon] = default((), alias="polygon")
    compounds: Items[Compound] = default((), alias="body")
    stacks: Items[Stack] = default((), alias="stack")
    ropes: Items[Rope] = default((), alias="rope")
    cloths: Items[Cloth] = default((), alias="cloth")
    ragdolls: Items[Ragdoll] = default((), alias="ragdoll")
    joints: Items[Joint] = default((), alias="joint")
    """Joint of one body to the world, or of two bodies: rod, pivot, slide, groove, rotary_limit, motor, gear, spring,
    rotary_spring, pulley, ratchet."""
    attractions: Items[Attraction] = default((), alias="attraction")
    thrusts: Items[Thrust] = default((), alias="thrust")
    tyres: Items[Tyre] = default((), alias="tyre")
    drives: Items[AnyDrive] = default((), alias="drive")
    """Drive that moves a body between two positions: torque, stroke or plunger."""
    sensors: Items[Sensor] = default((), alias="sensor")
    shots: Items[Shot] = default((), alias="shot")
    events: Items[Event] = default((), alias="event", max_length=MAX_EVENTS)
    """Actions that the scene makes itself, each before the first step that starts at its time or later."""

    @property
    def spawned_by_events(self) -> int:
        """Number of bodies that events add."""
        return sum(isinstance(event, Spawn) for event in self.events)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy, with other values for some fields. Derived values are computed again from the fields."""
        if not update:
            return super().model_copy(deep=deep)
        values = {name: getattr(self, name) for name in type(self).model_fields}
        values = {**(copy.deepcopy(values) if deep else values), **update}
        return type(self).model_construct(self.model_fields_set | update.keys(), **values)

    @property
    def kinds(self) -> dict[str, tuple[BodySource, ...]]:
        """Elements with bodies, by table heading, in scene order."""
        return {
            "ball": self.balls,
            "grid": self.grids,
            "scatter": self.scatters,
            "emitter": self.emitters,
            "box": self.boxes,
            "capsule": self.capsules,
            "polygon": self.polygons,
            "body": self.compounds,
            "stack": self.stacks,
            "rope": self.ropes,
            "cloth": self.cloths,
            "ragdoll": self.ragdolls,
        }

    @property
    def body_sources(self) -> tuple[BodySource, ...]:
        """Elements with bodies, in scene order."""
        return tuple(each for sources in self.kinds.values() for each in sources)

    @property
    def fixed(self) -> tuple[Plane | Wall | Post, ...]:
        """Solid fixed objects in the order of their indices: planes, walls, posts. Pockets, zones, sensors follow."""
        return self.planes + self.walls + self.posts

    @cached_property
    def liquids(self) -> tuple[Zone, ...]:
        """Zones with a liquid."""
        return tuple(zone for zone in self.zones if zone.liquid is not None)

    @cached_property
    def layers(self) -> tuple[str, ...]:
        """Names of the collision layers in the order of their indices; the first is `ground`."""
        named: dict[str, None] = {GROUND: None}
        for collider in self.fixed:
            named |= dict.fromkeys(collider.layers or ())
        for zone in self.zones:
            named |= dict.fromkeys(zone.layers)
            if zone.to_layer is not None:
                named[zone.to_layer] = None
        for source in self.body_sources:
            named[source.layer] = None
        return tuple(named)

    @cached_property
    def categories(self) -> tuple[str, ...]:
        """Names of the collision categories in the order in which static colliders, then bodies, name them."""
        colliders: tuple[Collider, ...] = (*self.fixed, *self.body_sources)
        return tuple(
            dict.fromkeys(name for each in colliders for name in (*(each.categories or ()), *(each.mask or ())))
        )

    @cached_property
    def fixed_names(self) -> tuple[str, ...]:
        """Names of the fixed objects, pockets, zones and sensors.

        An object without a name is called by its kind and its position in the file, such as `wall-1`.
        """
        kinds: dict[str, Sequence[HasMaterial | Pocket | Zone | Sensor]] = {
            "plane": self.planes,
            "wall": self.walls,
            "post": self.posts,
            "pocket": self.pockets,
            "zone": self.zones,
            "sensor": self.sensors,
        }
        return tuple(
            each.name or default_name(kind, k) for kind, those in kinds.items() for k, each in enumerate(those)
        )


FIXED_KINDS = ("plane", "wall", "post", "pocket", "zone", "sensor")
"""Tables of the fixed objects, pockets, zones and sensors, in the order of their indices."""


def fixed_names_in(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return `SceneDescription.fixed_names` of the document of a scene."""
    tables = ((kind, k, each) for kind in FIXED_KINDS for k, each in enumerate(document.get(kind, ())))
    return tuple(each.get("name") or default_name(kind, k) for kind, k, each in tables)


def default_name(kind: str, index: int) -> str:
    """Return the name of the index-th (from 0) unnamed element of a kind."""
    return f"{kind}-{index + 1}"


def zone_visits(pair: "IntArray", scene: SceneDescription) -> "BoolArray":
    """Return which contacts, by their pairs (C, 2), are visits of zones or sensors and no collisions, (C,)."""
    found: BoolArray = pair[:, 1] < -len(scene.fixed) - len(scene.pockets)
    return found


def first_sensor(scene: SceneDescription) -> int:
    """Return the index that the first sensor has in pairs of contacts; that of the k-th, from 0, is smaller by k."""
    return -1 - len(scene.fixed) - len(scene.pockets) - len(scene.zones)
