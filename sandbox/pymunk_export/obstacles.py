"""Parts of a scene that a standalone pymunk program cannot express with the states of the engine, bit for bit.

Bent walls are such parts; divided at their corners they are not.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from sandbox.echo import short_repr
from sandbox.engines.common.colliders import wall_segments
from sandbox.engines.pymunk_adapter.colliders import jointed_surfaces
from sandbox.engines.pymunk_adapter.engine import PymunkEngine
from sandbox.engines.sensors import SceneSensors
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import Demand, demands, on_floor
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Wall
from sandbox.scene.description.world import Settings

MAX_LISTED = 3
"""Largest number of names in a message."""


class Obstacle(NamedTuple):
    """A part of a scene that a program cannot express."""

    path: str
    """key of the scene, such as `world.linear_drag`; empty if the message concerns the whole scene"""
    message: str


class ProgramError(ValueError):
    """A scene cannot be written as a program. `obstacles` has all reasons."""

    def __init__(self, obstacles: Sequence[Obstacle]) -> None:
        super().__init__("\n".join(": ".join(filter(None, each)) for each in obstacles))
        self.obstacles = tuple(obstacles)


def obstacles(start: Scene | Setup, settings: Settings | None = None, *, divides_walls: bool = False) -> list[Obstacle]:
    """Return every part of a scene that a program cannot express; empty if there is none.

    Args:
        start: scene or setup.
        settings: default: those of the scene.
        divides_walls: whether bent walls are no obstacle, as `with_divided_walls` divides them.
    """
    setup = Setup.of(start)
    settings = setup.scene.solver if settings is None else settings
    found = [Obstacle("", f"pymunk cannot run it: {each}") for each in PymunkEngine().missing(setup, settings)]
    found += [*_world(setup, settings), *_forces(setup), *_objects(setup), *_contacts(setup)]
    return [*found, *(() if divides_walls else _bent_walls(setup))]


def _world(setup: Setup, settings: Settings) -> Iterator[Obstacle]:
    scene = setup.scene
    if settings.half_kick:
        yield Obstacle("solver.half_kick", "velocities are half a kick ahead, and a game would read them so")
    if on_floor(setup):
        yield Obstacle(
            "surface", "balls and pucks on a floor are not moved by pymunk, but by an integrator of their own"
        )
    for key in ("linear_drag", "quadratic_drag"):
        if getattr(scene.world, key):
            message = "pymunk has no drag with wind (space.damping slows spins too); set it to 0"
            yield Obstacle(f"world.{key}", message)
    if Demand.LIFT in demands(setup):
        yield Obstacle("", "pymunk has no lift of spinning bodies; set it to 0")
    if Demand.BODY_DAMPING in demands(setup):
        message = (
            "linear_damping and angular_damping follow the velocity of a body in every step; a velocity_func that "
            "multiplies body.velocity by exp(-k·dt) does nearly the same in a game; set them to 0"
        )
        yield Obstacle("", message)


def _forces(setup: Setup) -> Iterator[Obstacle]:
    scene = setup.scene
    if scene.attractions:
        yield Obstacle("attraction", "attraction needs a velocity function of each body")
    if scene.drives:
        yield Obstacle("drive", f"flippers and plungers are not part of pymunk: {_names(scene.drives)}")
    if scene.tyres:
        yield Obstacle("tyre", f"pymunk has no friction with a rolling direction: {_names(scene.tyres)}")
    keyed = [each for each in scene.thrusts if each.key is not None]
    if keyed:
        yield Obstacle("thrust", f"a thrust that follows a key is an input of the game: {_names(keyed)}")
    timed = [each for each in scene.thrusts if each.key is None and (each.begin > 0.0 or each.end is not None)]
    if timed:
        yield Obstacle("thrust", f"a thrust that begins or ends needs a clock: {_names(timed)}")


def _undetectable(setup: Setup) -> list[str]:
    """Return the bodies that a sensor can detect, and whose shapes a program leaves out of the space."""
    if not setup.scene.sensors:
        return []
    sensors = SceneSensors(setup.scene, setup.bodies)
    detectable = np.logical_or.reduce([sensors.detectable(k) for k in range(len(setup.scene.sensors))])
    found = detectable & ~contact_matrix(setup).touches & ~setup.bodies.fixed
    return [setup.bodies.names[k] for k in np.flatnonzero(found).tolist()]


def _objects(setup: Setup) -> Iterator[Obstacle]:
    scene, joints = setup.scene, setup.joints
    if scene.zones:
        yield Obstacle("zone", f"zones are not part of pymunk: {_names(scene.zones)}")
    hidden = _undetectable(setup)
    if hidden:
        yield Obstacle("sensor", f"no query finds bodies with which nothing collides: {_listed(hidden)}")
    one_way = [name for name, wall in zip(_wall_names(scene), scene.walls, strict=True) if wall.one_way]
    if one_way:
        yield Obstacle("wall", f"one-way walls need callbacks with a memory: {_listed(one_way)}")
    bodies = setup.bodies
    if bodies.one_way:
        names = _listed([bodies.names[index] for index in bodies.one_way])
        yield Obstacle("", f"one-way bodies need callbacks with a memory: {names}")
    if scene.events:
        yield Obstacle("event", "events need a clock and actions: apply them between two calls of step() in the game")
    if np.isfinite(setup.bodies.lifetime).any():
        yield Obstacle("emitter", "bodies with a lifetime are removed by a clock")
    breakable = [joints.names[k] or f"number {k + 1}" for k in np.flatnonzero(np.isfinite(joints.strength)).tolist()]
    if breakable:
        yield Obstacle("joint", f"breakable joints need the load of each after every substep: {_listed(breakable)}")


def _contacts(setup: Setup) -> Iterator[Obstacle]:
    """Yield the contacts whose coefficients or normals depend on more than two constants."""
    scene, matrix = setup.scene, contact_matrix(setup)
    surfaces, touching = matrix.surfaces, matrix.touching
    kicks = touching & (surfaces.kicks | surfaces.kicks[:, None])
    if kicks.any():
        names = [scene.fixed_names[k] for k in range(len(scene.fixed)) if kicks[surfaces.of_fixed[k]].any()]
        path = "wall" if any(wall.kick is not None for wall in scene.walls) else "post"
        yield Obstacle(path, f"walls and posts that kick have no counterpart in pymunk: {_listed(names)}")
    if (touching & ~kicks & (surfaces.falloff != 0.0)).any():
        yield Obstacle("material", "restitution_falloff makes restitution depend on speed, unlike shape.elasticity")
    if Demand.ROLLING in demands(setup):
        yield Obstacle("material", "rolling_resistance needs a motor for each contact of a ball; set it to 0")


def _bent_walls(setup: Setup) -> Iterator[Obstacle]:
    names = [setup.scene.fixed_names[k] for k in _corrected_walls(setup)]
    if names:
        message = (
            "where its segments join, the engine corrects the contact normals of boxes, polygons and capsules; "
            f"divide it into walls of two points each: {_listed(names)}"
        )
        yield Obstacle("wall", message)


def _corrected_walls(setup: Setup) -> list[int]:
    """Return the indices, among the static colliders, of bent walls that bodies other than balls can touch."""
    scene, matrix = setup.scene, contact_matrix(setup)
    of_fixed, touching, solid = matrix.surfaces.of_fixed, matrix.touching, matrix.solid
    jointed = jointed_surfaces(scene, of_fixed)
    first = len(scene.planes)
    return [
        k
        for k in range(first, first + len(scene.walls))
        if (surface := int(of_fixed[k])) in jointed and (touching[surface] & solid).any()
    ]


def _wall_names(scene: Scene) -> tuple[str, ...]:
    return scene.fixed_names[len(scene.planes) : len(scene.planes) + len(scene.walls)]


def _names(parts: Sequence[object]) -> str:
    return _listed([getattr(each, "name", None) or f"number {k}" for k, each in enumerate(parts, start=1)])


def _listed(names: Sequence[str]) -> str:
    """Return the first names, quoted, and the number of further ones."""
    more = f" and {len(names) - MAX_LISTED:,} more" if len(names) > MAX_LISTED else ""
    return ", ".join(map(short_repr, names[:MAX_LISTED])) + more


def with_divided_walls(scene: Scene) -> tuple[Scene, tuple[str, ...]]:
    """Return a scene with a wall of two points for each segment of the walls that `obstacles` names; and their names.

    The segments are those of the engine, in the same order, and all walls have names. Only contacts differ from those
    of the scene, and only where segments join: there, nothing corrects the normals of contacts.
    """
    divided = {k - len(scene.planes) for k in _corrected_walls(Setup.of(scene))}
    if not divided:
        return scene, ()
    walls, names, taken = list[Wall](), list[str](), set(scene.fixed_names)
    for index, wall in enumerate(scene.walls):
        name = scene.fixed_names[len(scene.planes) + index]
        if index not in divided:
            walls.append(wall.model_copy(update={"name": name}))
            continue
        names.append(name)
        for number, part in enumerate(wall_segments(wall), start=1):
            own = f"{name} {number}"
            while own in taken:
                own += "'"
            taken.add(own)
            walls.append(wall.model_copy(update={"name": own, "points": (part.a, part.b), "closed": False}))
    return scene.model_copy(update={"walls": tuple(walls)}), tuple(names)
