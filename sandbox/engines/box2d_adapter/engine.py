"""Box2DEngine: the demands that Box2D supports, and its defaults of settings. Only `start` imports the binding."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sandbox.engines.box2d_adapter.limits import SLOP_LENGTHS
from sandbox.engines.box2d_adapter.materials import FILTER_BITS, mixing_faults
from sandbox.engines.box2d_adapter.requirements import joint_faults, rolling_faults, size_faults
from sandbox.engines.common.collision_bits import too_many_categories
from sandbox.engines.common.solver_settings import setting_faults, slop_of
from sandbox.engines.common.workload import overload
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import BALLS, Demand, unmodelled
from sandbox.scene.compile.drives import names_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings

if TYPE_CHECKING:
    from sandbox.engines.box2d_adapter.simulation import Box2DSimulation

FIXED_METHODS = {
    "integrator": "semi_implicit_euler",
    "detection": "discrete",
    "response": "impulse",
    "impact": "newton",
    "joints": "impulses",
}
"""Settings that describe Box2D's methods, each with its only supported value"""

ABSENT = {
    "bias": "Box2D corrects overlaps by soft contacts",
    "persistence": "Box2D keeps the impulses of contacts that touch",
    "stiffness": "it has no penalty springs",
    "damping": "it has no penalty springs",
    "stretch": "it has no joints = 'relaxation'",
    "broad_phase": "it always uses its own tree",
    "sleep_time": "bodies of Box2D fall asleep after 0.5 s",
    "idle_speed": "bodies of Box2D are idle below 0.05 of its length units in a second",
}
"""Settings that Box2D does not have, with the reason"""

OWN = frozenset(
    {
        Demand.DAMPING,
        Demand.LIFT,
        Demand.BODY_DAMPING,
        Demand.GRAVITY_SCALE,
        Demand.SPEED_LIMITS,
        Demand.ROLLING,
        Demand.POLYGONS,
        Demand.PASSABLE,
        Demand.SURFACE_SPEED,
        Demand.RODS,
        Demand.PIVOTS,
        Demand.SLIDES,
        Demand.GROOVES,
        Demand.ROTARY_LIMITS,
        Demand.MOTORS,
        Demand.SPRINGS,
        Demand.ROTARY_SPRINGS,
        Demand.BANDS,
        Demand.WELDS,
        Demand.PRISMATICS,
        Demand.WHEELS,
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
    }
)


MAX_FAULTS = 3
"""Faults of a kind that are listed; of the others the number is stated"""


def _first(faults: Iterable[str]) -> list[str]:
    """Return the first faults, and the number of the others."""
    found = list(faults)
    more = len(found) - MAX_FAULTS
    return (
        found if more <= 0 else [*found[:MAX_FAULTS], f"and {more:,} more fault{'s' if more > 1 else ''} of this kind"]
    )


@dataclass(frozen=True)
class Box2DEngine:
    """Box2D v3: fixed step, soft contacts solved in substeps, continuous collision with static colliders; 32-bit.

    A step finds contacts once, then advances by its substeps: velocities by gravity and forces, constraints with
    overlap correction, positions by the new velocities (semi-implicit Euler), constraints again without the
    correction; restitution follows at the end. Springs, thrusts, attraction, quadratic drag, wind, liquids, tyres and
    the gravity of zones are forces that are constant during a substep; with these, zones or drives, each substep is a
    step of Box2D.

    Lengths are scaled so that Box2D's fixed slop, 0.005 of its units, is `slop`. `iterations` has no effect: Box2D
    solves its constraints once in each substep.
    """

    name: str = "box2d"
    about: str = (
        "Box2D v3: fixed step, substeps with soft contacts, continuous collision, 32-bit numbers; "
        "elastic bounces lose height"
    )
    capabilities: frozenset[Demand] = BALLS | OWN
    knows_impulses: bool = False
    epsilon: float = 2.0**-23

    def missing(self, start: Scene | Setup, settings: Settings) -> tuple[str, ...]:
        """Return each demand and setting that Box2D does not support."""
        setup = Setup.of(start)
        missing = [*unmodelled(setup, self.capabilities), *too_many_categories(setup.scene, FILTER_BITS)]
        missing += setting_faults(settings, self.name, FIXED_METHODS, ABSENT)
        missing += [
            f"{name}: a drive by torque needs a hinge that contacts can turn back; strokes and plungers are supported"
            for drive, name in zip(setup.scene.drives, names_of(setup.scene), strict=True)
            if drive.kind == "torque"
        ]
        missing += _first(joint_faults(setup.joints))
        matrix = contact_matrix(setup)
        missing += _first(mixing_faults(setup.scene, matrix))
        missing += _first(rolling_faults(setup))
        missing += _first(size_faults(setup, self.resolve(setup, settings)))
        return (*missing, *overload(setup, settings))

    def resolve(self, start: Scene | Setup, settings: Settings) -> Settings:
        """Return the settings with defaults for the slop and the values that describe Box2D.

        The default slop is nearest to that of other engines among those for which lengths are scaled exactly, by a
        power of 2.
        """
        setup = Setup.of(start)
        exponent = round(math.log2(SLOP_LENGTHS / slop_of(setup)))
        defaults: dict[str, object] = {"slop": SLOP_LENGTHS * 2.0**-exponent, **FIXED_METHODS}
        defaults |= {"continuous": True, "sleeping": False, "workers": 1}
        if not len(setup.joints):
            del defaults["joints"]
        return settings.replace(**{k: v for k, v in defaults.items() if getattr(settings, k) is None})

    def start(self, start: Scene | Setup, settings: Settings | None = None) -> "Box2DSimulation":
        """Create a Box2D world with the bodies of a scene.

        Raises:
            Refusal: Box2D does not support something that the scene or a setting needs, or too many worlds exist.
        """
        from sandbox.engines.contract import Refusal

        setup = Setup.of(start)
        settings = setup.scene.solver if settings is None else settings
        missing = self.missing(setup, settings)
        if missing:
            raise Refusal(self.name, missing, ())
        from sandbox.engines.box2d_adapter.simulation import Box2DSimulation
        from sandbox.engines.box2d_adapter.world import TooManyWorldsError

        try:
            return Box2DSimulation(setup, self.resolve(setup, settings))
        except TooManyWorldsError as error:
            raise Refusal(self.name, (str(error),), ()) from None
