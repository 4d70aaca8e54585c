"""What pymunk requires of a scene: which parts it combines, and the size of its space. Nothing here imports pymunk."""

from collections.abc import Iterator

import numpy as np

from sandbox.engines.tabletop.requirements import on_floor
from sandbox.resource_limits import SPACE_SIZE
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import AIR, Demand
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings


def combination_faults(scene: Scene, settings: Settings, wanted: frozenset[Demand]) -> list[str]:
    """Return the parts and settings of a scene that pymunk does not support together.

    Args:
        scene: the scene.
        settings: of the run.
        wanted: demands of the scene, and of a body that an action adds.
    """
    half_kick, found, air = settings.half_kick, [], sorted(wanted & AIR)
    has_damping, has_kinematic = Demand.DAMPING in wanted, Demand.KINEMATIC in wanted
    if half_kick:
        found += [f"half_kick does not support {demand}" for demand in air]
    if half_kick and (scene.joints or scene.attractions or scene.thrusts or scene.tyres or scene.drives):
        found.append("half_kick supports gravity only, and the scene has other forces")
    if half_kick and any(zone.moves_bodies for zone in scene.zones):
        found.append("half_kick does not support zones with gravity or a liquid of their own")
    if half_kick:
        of_bodies = sorted(wanted & {Demand.GRAVITY_SCALE, Demand.SPEED_LIMITS})
        found += [f"half_kick does not support {demand}" for demand in of_bodies]
    if half_kick and has_kinematic:
        found.append("half_kick does not support kinematic bodies")
    for first, second, together in (
        *((str(demand), "damping", has_damping) for demand in air if demand is not Demand.DAMPING),
        ("drives", "damping", scene.drives and has_damping),
        ("attraction", "drives", scene.attractions and scene.drives),
        ("attraction", "tyres", scene.attractions and scene.tyres),
        ("attraction", "kinematic bodies", scene.attractions and has_kinematic),
    ):
        if together:
            found.append(f"it does not model {first} and {second} together")
    if settings.sleeping:
        found += [f"sleeping does not support {each}" for each in _unsupported_by_sleep(scene, settings, wanted)]
    return found


def _unsupported_by_sleep(scene: Scene, settings: Settings, wanted: frozenset[Demand]) -> Iterator[str]:
    """Yield the parts and settings that need every body, awake or not, in each substep."""
    for name, has in (
        ("half_kick", settings.half_kick),
        *((str(demand), True) for demand in sorted(wanted & AIR - {Demand.DAMPING})),
        ("attraction", scene.attractions),
        ("thrusts", scene.thrusts),
        ("tyres", scene.tyres),
        ("drives", scene.drives),
        ("zones", scene.zones),
        (str(Demand.ROLLING), Demand.ROLLING in wanted),
        ("one-way walls", any(wall.one_way for wall in scene.walls)),
        ("one-way bodies", Demand.ONE_WAY_BODIES in wanted),
        ("joints that can break", bool(np.isfinite(scene.joint_arrays.strength).any())),
        ("a [surface]", on_floor(scene)),
    ):
        if has:
            yield name


def size_faults(setup: Setup) -> list[str]:
    """Return why it would take too long to create a scene's space."""
    size = len(setup.bodies) + len(setup.joints)
    if size <= SPACE_SIZE.value:  # most scenes: no need to count the bodies in free flight
        return []
    size -= int((contact_matrix(setup).free & ~setup.bodies.fixed).sum())
    refusal = SPACE_SIZE.refusal("the number of bodies and joints in its pymunk space is", size)
    return [] if refusal is None else [refusal]
