"""What a scene's `[play]` names must be there."""

from collections.abc import Iterator

from sandbox.scene.bodies import Bodies
from sandbox.scene.faults import Location
from sandbox.scene.marking import unclear
from sandbox.scene.model import Mover, Scene, Single, default_name


def claimed(scene: Scene, bodies: Bodies) -> Iterator[tuple[Location, str]]:
    """Yield the faults of a scene's `[play]`."""
    arrows, relaunch = scene.play.arrows, scene.play.relaunch
    if arrows is not None and arrows not in bodies.names:
        yield ("play", "arrows"), f"no body is named {arrows!r}; there are {_some(bodies.names)}"
    names = generator_names(scene)
    if relaunch is not None and relaunch not in names:
        yield ("play", "relaunch"), f"no generator is named {relaunch!r}; there are {_some(names)}"
    spots = [spot.name for spot in scene.play.spots]
    for key, box in (("area", scene.play.area), ("view", scene.play.view), ("inset", scene.play.inset)):
        if box is not None and not all(low < high for low, high in zip(*box, strict=True)):
            yield ("play", key), "encloses nothing; give the lower left and then the upper right corner"
    for k, marking in enumerate(scene.play.markings):
        why = unclear(marking)
        if why is not None:
            yield ("play", "marking", k), why
    for k, name in enumerate(spots):
        if name in spots[:k]:
            yield ("play", "spot", k, "name"), f"a second spot is called {name!r}; names are unique"
    yield from _parts(scene, bodies)


def _parts(scene: Scene, bodies: Bodies) -> Iterator[tuple[Location, str]]:
    """Check that parts are of things that there are, each once."""
    there, seen = {*bodies.names, *scene.fixed_names}, set[str]()
    for k, part in enumerate(scene.play.parts):
        if part.name not in there:
            yield ("play", "part", k, "name"), f"no body, fixed thing or zone is named {part.name!r}"
        if part.name in seen:
            yield ("play", "part", k, "name"), f"{part.name!r} plays a part already; state it once"
        seen.add(part.name)


def generator_names(scene: Scene) -> tuple[str, ...]:
    """Return a name for each generator, in scene order."""
    return tuple(name for name, _, _ in generators(scene))


def generators(scene: Scene) -> Iterator[tuple[str, int, Mover]]:
    """Yield the name of each generator, its place among its kind, and itself, in scene order."""
    for kind, movers in scene.kinds.items():
        for k, mover in enumerate(movers):
            if not isinstance(mover, Single):
                yield mover.name or default_name(kind, k), k, mover


def _some(names: tuple[str, ...]) -> str:
    return ", ".join(map(repr, names[:5])) + (" …" if len(names) > 5 else "") if names else "none"
