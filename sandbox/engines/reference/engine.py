"""The engine `reference`: its capabilities, refusals and default choices. No solver is imported before the start."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sandbox.engines.common.base import BIAS, slop_of
from sandbox.engines.common.workload import overload
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import BALLS, Demand, demands, unmodelled
from sandbox.scene.compile.drives import names_of
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

if TYPE_CHECKING:
    from sandbox.engines.reference.simulation import ReferenceSimulation


def drives_lack(setup: Setup, wanted: frozenset[Demand], settings: Settings) -> list[str]:
    """Return the demands and settings of a scene with drives that are not supported."""
    lacks = []
    if settings.detection in ("bisect", "swept"):
        lacks.append(f"detection {settings.detection!r} does not support drives; 'discrete' and 'shrink' do")
    if Demand.ATTRACTION in wanted:
        lacks.append("it does not model attraction and drives together")
    held = _fixed_joint_with_drive(setup)
    if held is not None:
        body, drive = held
        lacks.append(f"it does not model a joint to {body!r}, whose motion the drive {drive!r} prescribes")
    return lacks


def _fixed_joint_with_drive(setup: Setup) -> tuple[str, str] | None:
    """Return a driven body that a joint holds as well, and its drive."""
    scene, numbers = setup.scene, setup.bodies.number_of
    joined = setup.links.held(len(setup.bodies))
    for drive, name in zip(scene.drives, names_of(scene), strict=True):
        if drive.body in numbers and joined[numbers[drive.body]]:
            return drive.body, name
    return None


WORDS = {"integrator": "explicit_euler", "detection": "discrete", "response": "impulse"}
"""Default methods: those of pymunk and of the tutorial."""

SUITED = {"relaxation": "semi_implicit_euler", "xpbd": "semi_implicit_euler", "rattle": "velocity_verlet"}
"""Integrators that suit position-based joint methods: kicks come before position correction."""

HELD = {Demand.RODS, Demand.PIVOTS, Demand.SLIDES, Demand.ROTARY_LIMITS}
"""Joints that hold, other than springs, which are forces."""

FEW = 24
"""Bodies up to which testing all pairs is quicker than sorting them."""

ONE_SIZE = 8.0
"""Ratio of radii up to which a uniform grid suits."""


@dataclass(frozen=True)
class ReferenceEngine:
    """Written by hand to be read: fixed step, every axis a table of interchangeable functions.

    Integrator, broad phase, detection and response are chosen by settings. As explicit_euler, discrete and impulse it
    is pymunk's scheme over again, but for drag: that is an exponential step there, here a force like any other.
    """

    name: str = "reference"
    about: str = "hand-written, fixed step: choice of integrator, broad phase, detection and response"
    capabilities: frozenset[Demand] = BALLS | {
        Demand.FALLOFF,
        Demand.KICKS,
        Demand.ONE_WAY,
        Demand.PASSABLE,
        Demand.POLYGONS,
        Demand.RODS,
        Demand.PIVOTS,
        Demand.SLIDES,
        Demand.ROTARY_LIMITS,
        Demand.SPRINGS,
        Demand.ROTARY_SPRINGS,
        Demand.ATTRACTION,
        Demand.THRUST,
        Demand.LAYERS,
        Demand.ZONES,
        Demand.DRIVES,
    }

    def missing(self, start: Scene | Setup, settings: Settings) -> tuple[str, ...]:
        """Return the demands and settings that the engine does not support."""
        setup = Setup.of(start)
        wanted = demands(setup)
        lacks = unmodelled(setup, self.capabilities)
        lacks += self._detection_lacks(wanted, settings)
        if Demand.DRIVES in wanted:
            lacks += drives_lack(setup, wanted, settings)
        if settings.broad_phase == "oriented" and Demand.POLYGONS not in wanted:
            lacks.append("broad_phase 'oriented' needs polygons, and the scene has none; use 'grid' or 'sweep'")
        if settings.stretch is not None and settings.joints != "relaxation":
            lacks.append("stretch applies to joints = 'relaxation' only")
        if settings.half_kick:
            lacks.append("half_kick applies to pymunk only; use integrator 'velocity_verlet'")
        if settings.impact == "dissipative" and (wanted & HELD or Demand.DRIVES in wanted):
            lacks.append("impact 'dissipative' does not support joints and drives; use 'newton'")
        if settings.persistence not in (None, 1):
            lacks.append(f"persistence {settings.persistence} is not supported; it keeps contacts for 1 substep")
        if settings.response == "penalty":
            lacks += self._penalty_lacks(setup, settings)
            if settings.impact is not None:
                lacks.append("impact applies to response 'impulse' only")
            for demand in (Demand.FALLOFF, Demand.KICKS):
                if demand in wanted:
                    lacks.append(f"response 'penalty' does not model {demand}; 'impulse' does")
        else:
            lacks += [
                f"{key} applies to response 'penalty' only"
                for key in ("stiffness", "damping")
                if getattr(settings, key) is not None
            ]
        return (*lacks, *overload(setup, settings))

    def _detection_lacks(self, wanted: frozenset[Demand], settings: Settings) -> list[str]:
        """Yield the demands that detection of impacts within a step does not support."""
        lacks = []
        if settings.detection == "swept" and Demand.POLYGONS in wanted:
            lacks.append("detection 'swept' supports balls only; 'bisect' supports polygons too")
        if settings.detection in ("bisect", "swept") and wanted & HELD:
            lacks.append(f"detection {settings.detection!r} does not support joints; 'shrink' does")
        return lacks

    def _penalty_lacks(self, setup: Setup, settings: Settings) -> list[str]:
        from sandbox.engines.reference.penalty import unstable

        lacks = [
            f"{key} applies to response 'impulse' only"
            for key in ("slop", "bias", "persistence")
            if getattr(settings, key) is not None
        ]
        if settings.detection in ("bisect", "swept"):
            lacks.append(f"detection {settings.detection!r} leaves no overlap, but penalty springs need one")
        reason = unstable(setup, self.resolve(setup, settings), settings.stiffness is not None)
        return lacks if reason is None else [*lacks, reason]

    def resolve(self, start: Scene | Setup, settings: Settings) -> Settings:
        """Return the settings with every choice filled in."""
        setup = Setup.of(start)
        own: dict[str, object] = {**WORDS, "slop": slop_of(setup), "bias": BIAS, "persistence": 1}
        if len(setup.links):
            own["joints"] = "impulses"
        if demands(setup) & {Demand.SPRINGS, Demand.ROTARY_SPRINGS, Demand.ATTRACTION}:
            own["integrator"] = "semi_implicit_euler"  # with explicit Euler, oscillations gain energy
        own["integrator"] = SUITED.get(settings.joints or "impulses", own["integrator"])
        if settings.response == "penalty":
            from sandbox.engines.reference.penalty import suited

            own["integrator"] = "semi_implicit_euler"  # explicit Euler makes springs gain energy
            own["stiffness"] = suited(setup, settings)
        else:
            own["impact"] = "newton"
        own["broad_phase"] = _suitable(setup)
        return settings.replace(**{k: v for k, v in own.items() if getattr(settings, k) is None})

    def start(self, start: Scene | Setup, settings: Settings | None = None) -> "ReferenceSimulation":
        """Set a scene up.

        Raises:
            Refusal: a demand is not supported, or the first collision detection exceeds a resource limit.
        """
        from sandbox.engines.contract import Exhaustion, Refusal
        from sandbox.engines.reference.simulation import ReferenceSimulation

        setup = Setup.of(start)
        settings = setup.scene.solver if settings is None else settings
        missing = self.missing(setup, settings)
        if missing:
            raise Refusal(self.name, missing, ())
        try:
            return ReferenceSimulation(setup, self.resolve(setup, settings))
        except Exhaustion as exhaustion:
            raise Refusal(self.name, (str(exhaustion),), ()) from None


def _suitable(setup: Setup) -> str:
    """Return the broad phase that suits a scene's balls."""
    bodies = setup.bodies
    radius = bodies.radius[contact_matrix(setup).touches | bodies.fixed]
    if len(radius) <= FEW:
        return "all_pairs"
    return "grid" if radius.max() <= ONE_SIZE * radius.min() else "sweep"
