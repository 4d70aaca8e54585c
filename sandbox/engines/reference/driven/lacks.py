"""Lacks: with what the reference does not model drives. Imports no solver."""

from sandbox.scene.demands import Demand
from sandbox.scene.driven import names_of
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings


def drives_lack(scene: Scene, wanted: frozenset[Demand], settings: Settings) -> list[str]:
    """Return what a scene with drives, which demands this, asks for beyond what can be had."""
    lacks = []
    if settings.detection in ("bisect", "swept"):
        lacks.append(
            f"detection {settings.detection!r} resolves impacts one by one, apart from the stops of drives, "
            "and takes no arcs for ways; 'discrete' and 'shrink' do"
        )
    if Demand.ATTRACTION in wanted:
        lacks.append("attraction in a scene with drives: it acts on centres, and drives hold bodies by their hinges")
    held = _joined(scene)
    if held is not None:
        body, drive = held
        lacks.append(f"a joint to {body!r}, which the drive {drive!r} holds by itself; it does not give way to joints")
    return lacks


def _joined(scene: Scene) -> tuple[str, str] | None:
    """Return a driven body that a joint holds as well, and its drive."""
    joined = scene.links.held(len(scene.bodies))
    for drive, name in zip(scene.drives, names_of(scene), strict=True):
        if drive.body in scene.bodies.names and joined[scene.bodies.names.index(drive.body)]:
            return drive.body, name
    return None
