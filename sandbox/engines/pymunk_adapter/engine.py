"""PymunkEngine: the demands that pymunk supports, and its defaults of settings. Only `start` imports pymunk."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sandbox.engines.common.collision_bits import too_many_categories
from sandbox.engines.common.solver_settings import BIAS, setting_faults, slop_of
from sandbox.engines.common.workload import overload
from sandbox.engines.pymunk_adapter.requirements import combination_faults, size_faults
from sandbox.engines.tabletop.requirements import on_floor, unsupported_by_steppers
from sandbox.scene.compile.demands import BALLS, FLOOR, JOINT_LIMITS, JOINTS, SURFACES, Demand, demands, unmodelled
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings

if TYPE_CHECKING:
    from sandbox.engines.pymunk_adapter.simulation import PymunkSimulation
    from sandbox.engines.tabletop.simulation import SteppedTabletopSimulation


FIXED_METHODS = {"integrator": "explicit_euler", "detection": "discrete", "response": "impulse", "impact": "newton"}
"""Settings that describe pymunk's methods, each with its only supported value"""

ABSENT = {
    "stiffness": "it has no penalty springs",
    "damping": "it has no penalty springs",
    "broad_phase": "it always uses its own tree",
    "stretch": "it has no joints = 'relaxation'",
}
"""Settings that pymunk does not have, with the reason"""

OWN = frozenset(
    {
        *JOINTS - {Demand.PULLEYS},
        *JOINT_LIMITS,
        Demand.DAMPING,
        Demand.LIFT,
        Demand.BODY_DAMPING,
        Demand.GRAVITY_SCALE,
        Demand.SPEED_LIMITS,
        Demand.ROLLING,
        Demand.POLYGONS,
        Demand.ATTRACTION,
        Demand.THRUST,
        Demand.TYRES,
        Demand.BUOYANCY,
        Demand.LAYERS,
        Demand.CATEGORIES,
        Demand.GROUPS,
        Demand.ZONES,
        Demand.DRIVES,
        Demand.KINEMATIC,
        Demand.PATHS,
        Demand.ONE_WAY_BODIES,
    }
)

SPACE_ATTRIBUTES = {
    "iterations": "iterations",
    "slop": "collision_slop",
    "bias": "collision_bias",
    "persistence": "collision_persistence",
    "sleep_time": "sleep_time_threshold",
    "idle_speed": "idle_speed_threshold",
}
"""Attribute of `pymunk.Space` for each setting"""

SPACE_DEFAULTS = {
    "iterations": 10,
    "collision_slop": 0.1,
    "collision_bias": (1.0 - 0.1) ** 60,
    "collision_persistence": 3,
    "sleep_time_threshold": math.inf,
    "idle_speed_threshold": 0.0,
}
"""Values of these attributes in a new space (pymunk 7.3.1)"""


def is_space_default(attribute: str, value: float) -> bool:
    """Return whether an attribute of a `pymunk.Space` has its default, which pymunk rounds to 32 bits."""
    return math.isclose(value, SPACE_DEFAULTS[attribute], rel_tol=1e-5)


def space_attributes(settings: Settings) -> dict[str, float]:
    """Return the values of the attributes of a `pymunk.Space` for resolved settings, by attribute.

    Attributes of sleep are left out if no body falls asleep, which is pymunk's default.
    """
    values = {name: getattr(settings, key) for key, name in SPACE_ATTRIBUTES.items()}
    return {name: value for name, value in values.items() if value is not None}


FILTER_BITS = 32
"""Bits of pymunk's collision filters"""

SLEEP_TIME = 0.5
"""s, default of `sleep_time`, as in Box2D; pymunk's own default is that no body falls asleep"""

PERSISTENCE = 3
"""pymunk's default, substeps"""


@dataclass(frozen=True)
class PymunkEngine:
    """pymunk (Munk2D): fixed step, discrete detection, sequential impulses with warm starting.

    A substep of length h, in pymunk's order: positions move by the *old* velocity, overlaps are found, forces and
    gravity change velocities, contacts are solved. For free motion that is explicit Euler, drift–kick.

    Detection is discrete: a body tunnels through a thin wall when v·h > r + half its thickness.
    """

    name: str = "pymunk"
    about: str = "pymunk (Munk2D): fixed step, discrete contacts, sequential impulses"
    capabilities: frozenset[Demand] = BALLS | FLOOR | SURFACES | OWN | {Demand.CURL}
    knows_impulses: bool = True
    epsilon: float = 2.0**-52

    def missing(self, start: Scene | Setup, settings: Settings) -> tuple[str, ...]:
        """Return each demand and setting that pymunk does not support."""
        setup = Setup.of(start)
        scene = setup.scene
        missing = [*unmodelled(setup, self.capabilities), *too_many_categories(scene, FILTER_BITS)]
        missing += setting_faults(settings, self.name, {**FIXED_METHODS, "joints": "impulses"}, ABSENT)
        if not settings.sleeping:
            missing += [
                f"{key} applies to sleeping = true only"
                for key in ("sleep_time", "idle_speed")
                if getattr(settings, key) is not None
            ]
        missing += combination_faults(scene, settings, demands(setup))
        if on_floor(setup):
            missing += unsupported_by_steppers(setup)
        return (*missing, *overload(setup, settings), *size_faults(setup))

    def resolve(self, start: Scene | Setup, settings: Settings) -> Settings:
        """Return the settings with defaults for slop, bias, persistence, sleeping, and values that describe pymunk."""
        setup = Setup.of(start)
        defaults: dict[str, object] = {
            "slop": slop_of(setup),
            "bias": BIAS,
            "persistence": PERSISTENCE,
            **FIXED_METHODS,
        }
        if len(setup.joints):
            defaults["joints"] = "impulses"
        if settings.sleeping:
            defaults |= {"sleep_time": SLEEP_TIME, "idle_speed": 0.0}
        return settings.replace(**{k: v for k, v in defaults.items() if getattr(settings, k) is None})

    def start(
        self, start: Scene | Setup, settings: Settings | None = None
    ) -> "PymunkSimulation | SteppedTabletopSimulation":
        """Create a pymunk space with the bodies of a scene.

        Raises:
            Refusal: pymunk does not support something that the scene or a setting needs.
        """
        from sandbox.engines.contract import Refusal

        setup = Setup.of(start)
        settings = setup.scene.solver if settings is None else settings
        missing = self.missing(setup, settings)
        if missing:
            raise Refusal(self.name, missing, ())
        resolved = self.resolve(setup, settings)
        if on_floor(setup):
            from sandbox.engines.pymunk_adapter.table_pairs import SpacePairFinder
            from sandbox.engines.tabletop.simulation import SteppedTabletopSimulation

            return SteppedTabletopSimulation(setup, resolved, SpacePairFinder)
        from sandbox.engines.pymunk_adapter.simulation import PymunkSimulation

        return PymunkSimulation(setup, resolved)
