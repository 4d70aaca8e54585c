"""Scene: what a scene file says, as frozen values. SI units, y up, radians.

The model holds the file as it was written: generators are not expanded, mixing rules not applied.
`bodies.py` numbers what moves, `demands.py` derives the physics that is needed.
"""

from collections.abc import Collection, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

from pydantic import Field, StringConstraints

from sandbox.scene.artillery.described import Artillery, Terrain
from sandbox.scene.billiards.described import Billiards
from sandbox.scene.cue import Shot
from sandbox.scene.discs import Ball, Disc, Emitter, Generator, Grid, Scatter
from sandbox.scene.drives import Drive
from sandbox.scene.floor import ContactModels, Floor, Pocket
from sandbox.scene.forces import Attraction, Thrust
from sandbox.scene.joints import Joint
from sandbox.scene.kick import Kick
from sandbox.scene.materials import Material, Pair
from sandbox.scene.part import Part
from sandbox.scene.parts import PlayPart
from sandbox.scene.pinball.described import Pinball
from sandbox.scene.play import Play
from sandbox.scene.ragdoll import Ragdoll
from sandbox.scene.settings import Settings
from sandbox.scene.solids import Box, Capsule, Compound, Polygon
from sandbox.scene.stacks import Stack
from sandbox.scene.standing import Course, Passing, Plane, Post, Wall
from sandbox.scene.surfaced import Collides, Mover, Single, Surfaced
from sandbox.scene.weaves import Cloth, Rope
from sandbox.scene.world import World
from sandbox.scene.zone import Zone

if TYPE_CHECKING:
    from sandbox.scene.bodies import Bodies
    from sandbox.scene.links import Links
    from sandbox.scene.near import FloatArray

__all__ = [
    "Attraction", "Ball", "Billiards", "Box", "Capsule", "Cloth", "Collides", "Compound", "ContactModels", "Course",
    "Disc", "Drive", "Emitter", "Floor", "Generator", "Grid", "Joint", "Kick", "Material", "Mover", "Pair",
    "Plane", "Play", "PlayPart", "Pocket", "Polygon", "Post", "Ragdoll", "Rope", "Scatter", "Scene", "Shot", "Single",
    "Stack", "Surfaced", "Thrust", "Wall", "World", "Zone", "default_name",
]  # fmt: skip


class Scene(Part):
    """A whole scene file."""

    title: Annotated[str, StringConstraints(max_length=200)] = ""
    """Name of the scene, shown above it."""
    about: Annotated[str, StringConstraints(max_length=2000)] = ""
    """What to look for."""
    world: World = Field(default_factory=World)
    solver: Settings = Field(default_factory=Settings)
    play: Play = Field(default_factory=Play)
    billiards: Billiards | None = None
    """None once the scene was read: by then it is written out"""
    pinball: Pinball | None = None
    """None once the scene was read, likewise"""
    terrain: Terrain | None = None
    """likewise"""
    artillery: Artillery | None = None
    """who plays; their tanks are written out"""
    surface: Floor | None = None
    contact_models: ContactModels = Field(default_factory=ContactModels)
    materials: tuple[Material, ...] = Field((), alias="material")
    pairs: tuple[Pair, ...] = Field((), alias="pair")
    planes: tuple[Plane, ...] = Field((), alias="plane")
    walls: tuple[Wall, ...] = Field((), alias="wall")
    posts: tuple[Post, ...] = Field((), alias="post")
    pockets: tuple[Pocket, ...] = Field((), alias="pocket")
    zones: tuple[Zone, ...] = Field((), alias="zone")
    balls: tuple[Ball, ...] = Field((), alias="ball")
    grids: tuple[Grid, ...] = Field((), alias="grid")
    scatters: tuple[Scatter, ...] = Field((), alias="scatter")
    emitters: tuple[Emitter, ...] = Field((), alias="emitter")
    boxes: tuple[Box, ...] = Field((), alias="box")
    capsules: tuple[Capsule, ...] = Field((), alias="capsule")
    polygons: tuple[Polygon, ...] = Field((), alias="polygon")
    compounds: tuple[Compound, ...] = Field((), alias="body")
    stacks: tuple[Stack, ...] = Field((), alias="stack")
    ropes: tuple[Rope, ...] = Field((), alias="rope")
    cloths: tuple[Cloth, ...] = Field((), alias="cloth")
    ragdolls: tuple[Ragdoll, ...] = Field((), alias="ragdoll")
    joints: tuple[Joint, ...] = Field((), alias="joint")
    """Holds one body to the world, or two together: rod, pivot, slide, groove, rotary_limit, motor, gear, spring,
    rotary_spring."""
    attractions: tuple[Attraction, ...] = Field((), alias="attraction")
    thrusts: tuple[Thrust, ...] = Field((), alias="thrust")
    drives: tuple[Drive, ...] = Field((), alias="drive")
    """Moves a body to and fro: torque, stroke or plunger."""
    shots: tuple[Shot, ...] = Field((), alias="shot")

    @cached_property
    def bodies(self) -> "Bodies":
        """What moves, numbered: arrays in scene order, generators expanded."""
        from sandbox.scene.bodies import expand  # needs numpy, which reading a file does not

        return expand(self)

    @cached_property
    def links(self) -> "Links":
        """The joints, by the numbers of `bodies`."""
        from sandbox.scene.linking import links_of

        return links_of(self)

    @property
    def kinds(self) -> dict[str, tuple[Mover, ...]]:
        """The elements with bodies by the headings of their tables, in scene order."""
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
    def movers(self) -> tuple[Mover, ...]:
        """The elements with bodies, in scene order."""
        return tuple(each for those in self.kinds.values() for each in those)

    @cached_property
    def elements(self) -> tuple[Mover, ...]:
        """What the bodies look like and are made of, in scene order: the movers, or what these stand for."""
        from sandbox.scene.elements import elements_of

        return tuple(element for mover in self.movers for element in elements_of(mover))

    @cached_property
    def driven(self) -> "FloatArray":
        """(D, 3) of each drive, as this state of the scene begins: level, torque or pull, pace."""
        from sandbox.scene.driven import at_rest

        return at_rest(self)

    @cached_property
    def passing(self) -> Passing:
        """Who is being let through which one-way walls, as this state of the scene begins."""
        return ()

    @cached_property
    def began(self) -> float:
        """The time at which this state of the scene begins, s: 0, but of one that goes on (`placed`)."""
        return 0.0

    def placed(
        self,
        bodies: "Bodies",
        time: float = 0.0,
        broken: Collection[int] = (),
        driven: "FloatArray | None" = None,
        passing: Passing = (),
    ) -> "Scene":
        """Return this scene with its bodies as they have come to be by a time, s: elsewhere, fewer, or more.

        Joints go with their bodies, and those that are broken, by their numbers, are left out; drives go on as they
        are, (D, 3), and who passes a one-way wall, by the numbers of these bodies, passes on. Only `bodies`, `links`,
        `driven`, `passing` and `began` differ: the file that it would be written to is the same.
        """
        links = self.links.without(broken).among(bodies.names, self.bodies.names)
        scene = self.holding(bodies, links, time, driven)
        scene.__dict__["passing"] = passing
        return scene

    def holding(
        self, bodies: "Bodies", links: "Links", began: float = 0.0, driven: "FloatArray | None" = None
    ) -> "Scene":
        """Return this scene with bodies, and joints between them, that it does not lay out itself."""
        scene = self.model_copy()
        state = {} if driven is None else {"driven": driven}
        scene.__dict__.update(bodies=bodies, links=links, began=began, **state)  # where cached_property looks first
        return scene

    @property
    def fixed(self) -> tuple[Plane | Wall | Post, ...]:
        """The solid fixed things, in the order of their numbers: planes, walls, posts. Pockets and zones follow."""
        return self.planes + self.walls + self.posts

    @cached_property
    def layers(self) -> tuple[str, ...]:
        """The layers that the scene speaks of, in the order of their numbers: the ground first."""
        from sandbox.scene.zone import layers_of

        return layers_of(self)

    @cached_property
    def fixed_names(self) -> tuple[str, ...]:
        """A name for each fixed thing, then pockets, then zones; without one, it is its kind and place in the file."""
        kinds: dict[str, Sequence[Surfaced | Pocket | Zone]] = {
            "plane": self.planes,
            "wall": self.walls,
            "post": self.posts,
            "pocket": self.pockets,
            "zone": self.zones,
        }
        return tuple(
            thing.name or default_name(kind, k) for kind, things in kinds.items() for k, thing in enumerate(things)
        )


def default_name(kind: str, index: int) -> str:
    """Return what the index-th (from 0) nameless element of a kind is called."""
    return f"{kind}-{index + 1}"
