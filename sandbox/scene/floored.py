"""Checks of what a floor brings with it: spins, noses of cushions, shots; and of what pucks have not."""

import math
from collections.abc import Iterator, Sequence

from sandbox.scene.bodies import Bodies
from sandbox.scene.cue import MISCUE, Shot, miscues
from sandbox.scene.faults import Location
from sandbox.scene.floor import Floor
from sandbox.scene.model import Ball, Post, Scene, Wall, default_name

Found = tuple[Location, str]

OR_SPHERES = 'Leave this out, or state bodies = "spheres" of the [surface]'
"""What would be right where a floor has pucks."""

NEEDS_FLOOR = "is of a ball on a floor; give the scene a [surface]"


def floored(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    """Yield the faults of what only a scene with a `[surface]` can have."""
    if scene.surface is not None:
        yield from _of_kind(scene, scene.surface)
    for k, ball in enumerate(scene.balls):
        if ball.spin is None:
            continue
        if scene.surface is None:
            yield ("ball", k, "spin"), f"{NEEDS_FLOOR}, or state `angular_velocity`"
        if ball.angular_velocity:
            yield ("ball", k, "angular_velocity"), "and `spin` are both stated; its third component is the same"
        if ball.fixed and any(ball.spin):
            yield ("ball", k, "spin"), "a fixed body never moves; leave this out, or fixed"
    if scene.surface is None:
        for key in sorted(scene.contact_models.model_fields_set):
            yield ("contact_models", key), NEEDS_FLOOR
    yield from _noses(scene)
    names: set[str] = set()
    for k, shot in enumerate(scene.shots):
        name = shot.name or default_name("shot", k)
        if name in names:
            yield ("shot", k, "name"), f"a second shot is called {name!r}; names are unique"
        names.add(name)
        yield from _shot(scene, bodies, k, shot)


def _of_kind(scene: Scene, floor: Floor) -> Iterator[Found]:
    """Check that nothing is stated of spheres where a floor has pucks, nor the other way round."""
    if floor.bodies == "spheres":
        if floor.curl:
            yield ("surface", "curl"), 'bends the ways of pucks alone; state bodies = "pucks", or leave this out'
        return
    if floor.rolling_friction:
        yield ("surface", "rolling_friction"), "pucks never roll; leave this out"
    for key in sorted(scene.contact_models.model_fields_set):
        yield ("contact_models", key), f"is of spheres; pucks meet by restitution and friction. {OR_SPHERES}"
    for k, ball in enumerate(scene.balls):
        if ball.spin is not None:
            yield ("ball", k, "spin"), "is of a sphere; a puck turns about z alone: state `angular_velocity`"
    noses: dict[str, Sequence[Wall | Post]] = {"wall": scene.walls, "post": scene.posts}
    for kind, things in noses.items():
        for k, thing in enumerate(things):
            if thing.height is not None:
                yield (kind, k, "height"), f"is of a nose that spheres meet; pucks have upright sides. {OR_SPHERES}"
    for k in range(len(scene.shots)):
        yield ("shot", k), f"a cue strikes spheres; give the puck a velocity. {OR_SPHERES}"


def _noses(scene: Scene) -> Iterator[Found]:
    """Check the heights of cushions: a nose must touch balls, and a model that counts on one must know it."""
    model = scene.contact_models.cushion
    radii = sorted({ball.radius for ball in scene.balls if not ball.fixed and ball.collides != "none"})
    noses: dict[str, Sequence[Wall | Post]] = {"wall": scene.walls, "post": scene.posts}
    for kind, things in noses.items():
        for k, thing in enumerate(things):
            if thing.height is None:
                if model != "simple" and scene.surface is not None:
                    message = f"the cushion model {model!r} counts on the height of the nose; state `height`, m"
                    yield (kind, k), message
            elif scene.surface is None:
                yield (kind, k, "height"), "is of a nose above a floor; give the scene a [surface]"
            elif radii and not thing.height < 2.0 * radii[0]:
                message = f"passes over a ball of radius {radii[0]:g} m; less than {2.0 * radii[0]:g} touches it"
                yield (kind, k, "height"), message


def _shot(scene: Scene, bodies: Bodies, k: int, shot: Shot) -> Iterator[Found]:
    if miscues(shot):
        off = math.hypot(shot.side, shot.height)
        yield ("shot", k, "side"), f"with `height` is {off:g} of the radius off; beyond {MISCUE:g} the tip slips"
    if scene.surface is None:
        yield ("shot", k), "a shot is played on a floor; give the scene a [surface]"
    if shot.ball not in bodies.names:
        yield ("shot", k, "ball"), f"no body is named {shot.ball!r}"
        return
    number = bodies.names.index(shot.ball)
    if not isinstance(bodies.elements[bodies.element[number]], Ball):
        yield ("shot", k, "ball"), f"{shot.ball!r} is not a single ball"
    elif bodies.fixed[number]:
        yield ("shot", k, "ball"), f"{shot.ball!r} is fixed; nothing can move it"
    elif any(math.dist(bodies.position[number], pocket.position) < pocket.radius for pocket in scene.pockets):
        yield ("shot", k, "ball"), f"{shot.ball!r} lies in a pocket, where nothing can strike it"
    if any(each.ball == shot.ball for each in scene.shots[:k]):
        yield ("shot", k, "ball"), f"a second shot at {shot.ball!r}; a scene starts with one a ball"
