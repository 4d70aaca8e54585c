"""What a scene's `[play]` names must be there."""

from collections.abc import Iterator

from sandbox.scene.bodies import Bodies
from sandbox.scene.faults import Location
from sandbox.scene.model import Scene, default_name


def claimed(scene: Scene, bodies: Bodies) -> Iterator[tuple[Location, str]]:
    """Yield the faults of a scene's `[play]`."""
    arrows, relaunch = scene.play.arrows, scene.play.relaunch
    if arrows is not None and arrows not in bodies.names:
        yield ("play", "arrows"), f"no body is named {arrows!r}; there are {_some(bodies.names)}"
    names = generator_names(scene)
    if relaunch is not None and relaunch not in names:
        yield ("play", "relaunch"), f"no generator is named {relaunch!r}; there are {_some(names)}"


def generator_names(scene: Scene) -> tuple[str, ...]:
    """Return a name for each grid, scatter and emitter, in scene order."""
    kinds = (("grid", scene.grids), ("scatter", scene.scatters), ("emitter", scene.emitters))
    return tuple(each.name or default_name(kind, k) for kind, those in kinds for k, each in enumerate(those))


def _some(names: tuple[str, ...]) -> str:
    return ", ".join(map(repr, names[:5])) + (" …" if len(names) > 5 else "") if names else "none"
