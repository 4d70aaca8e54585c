"""ReferenceEngine: what the reference can model, and how its choices are filled in. Imports no solver until started."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sandbox.engines.overlap import BIAS, slop_of
from sandbox.engines.reference.driven.lacks import drives_lack
from sandbox.scene.demands import BALLS, Demand, demands, unmodelled
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings

if TYPE_CHECKING:
    from sandbox.engines.reference.simulation import ReferenceSimulation

WORDS = {"integrator": "explicit_euler", "detection": "discrete", "response": "impulse"}
"""What is chosen where nothing is stated: what pymunk does, and the tutorial."""

SUITED = {"relaxation": "semi_implicit_euler", "xpbd": "semi_implicit_euler", "rattle": "velocity_verlet"}
"""What goes with ways to hold joints by their positions: kicks come before positions are put right."""

BALLS_ALONE = "detection 'swept' knows times of impact of balls alone, not of polygons; 'bisect' does"

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
    about: str = "by hand, fixed step: integrators, broad phases, times of impact, impulses or penalty springs"
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

    def missing(self, scene: Scene, settings: Settings) -> tuple[str, ...]:
        """Return what scene and settings ask for that the reference lacks."""
        wanted = demands(scene)
        lacks = unmodelled(scene, self.capabilities)
        lacks += self._detection_lacks(wanted, settings)
        if Demand.DRIVES in wanted:
            lacks += drives_lack(scene, wanted, settings)
        if settings.broad_phase == "oriented" and Demand.POLYGONS not in wanted:
            lacks.append("broad_phase 'oriented' is for polygons, of which the scene has none; 'grid' or 'sweep' do")
        if settings.stretch is not None and settings.joints != "relaxation":
            lacks.append("stretch is for joints held by relaxation; solver.joints is not 'relaxation'")
        if settings.half_kick:
            lacks.append("half_kick is a remedy for pymunk's scheme; integrator 'velocity_verlet' has it built in")
        if settings.impact == "dissipative" and (wanted & HELD or Demand.DRIVES in wanted):
            lacks.append(
                "impact 'dissipative' weighs the energy of contacts alone, without joints and drives; 'newton' works"
            )
        if settings.persistence not in (None, 1):
            lacks.append(f"persistence {settings.persistence}: it remembers contacts for 1 substep")
        if settings.response == "penalty":
            lacks += self._penalty_lacks(scene, settings)
            if settings.impact is not None:
                lacks.append("impact is a law of impulses; solver.response is not 'impulse'")
            for demand in (Demand.FALLOFF, Demand.KICKS):
                if demand in wanted:
                    lacks.append(
                        f"response 'penalty' does not model {demand}: its springs part what meets; 'impulse' does"
                    )
        else:
            lacks += [
                f"{key} is a figure of penalty springs; solver.response is not 'penalty'"
                for key in ("stiffness", "damping")
                if getattr(settings, key) is not None
            ]
        return tuple(lacks)

    def _detection_lacks(self, wanted: frozenset[Demand], settings: Settings) -> list[str]:
        """Say what a detection of impacts in time cannot do."""
        lacks = []
        if settings.detection == "swept" and Demand.POLYGONS in wanted:
            lacks.append(BALLS_ALONE)
        if settings.detection in ("bisect", "swept") and wanted & HELD:
            lacks.append(
                f"detection {settings.detection!r} resolves impacts one by one, apart from joints; 'shrink' does not"
            )
        return lacks

    def _penalty_lacks(self, scene: Scene, settings: Settings) -> list[str]:
        from sandbox.engines.reference.stability import unstable

        lacks = [
            f"{key} corrects overlap by impulses; penalty springs need theirs"
            for key in ("slop", "bias", "persistence")
            if getattr(settings, key) is not None
        ]
        if settings.detection in ("bisect", "swept"):
            lacks.append(f"detection {settings.detection!r} leaves no overlap, which penalty springs act by")
        reason = unstable(scene, self.resolve(scene, settings), settings.stiffness is not None)
        return lacks if reason is None else [*lacks, reason]

    def resolve(self, scene: Scene, settings: Settings) -> Settings:
        """Return the settings with every choice filled in."""
        own: dict[str, object] = {**WORDS, "slop": slop_of(scene), "bias": BIAS, "persistence": 1}
        if len(scene.links):
            own["joints"] = "impulses"
        if demands(scene) & {Demand.SPRINGS, Demand.ROTARY_SPRINGS, Demand.ATTRACTION}:
            own["integrator"] = "semi_implicit_euler"  # explicit Euler makes what swings gain energy
        own["integrator"] = SUITED.get(settings.joints or "impulses", own["integrator"])
        if settings.response == "penalty":
            from sandbox.engines.reference.stability import suited

            own["integrator"] = "semi_implicit_euler"  # explicit Euler makes springs gain energy
            own["stiffness"] = suited(scene, settings)
        else:
            own["impact"] = "newton"
        own["broad_phase"] = _suitable(scene)
        return settings.replace(**{k: v for k, v in own.items() if getattr(settings, k) is None})

    def start(self, scene: Scene, settings: Settings | None = None) -> "ReferenceSimulation":
        """Set a scene up.

        Raises:
            Refusal: the reference lacks something that is asked for.
        """
        from sandbox.engines.contract import Refusal
        from sandbox.engines.reference.simulation import ReferenceSimulation

        settings = scene.solver if settings is None else settings
        missing = self.missing(scene, settings)
        if missing:
            raise Refusal(self.name, missing, ())
        return ReferenceSimulation(scene, self.resolve(scene, settings))


def _suitable(scene: Scene) -> str:
    """Return the broad phase that suits a scene's balls."""
    bodies = scene.bodies
    radius = bodies.radius[meetings(scene).touches | bodies.fixed]
    if len(radius) <= FEW:
        return "all_pairs"
    return "grid" if radius.max() <= ONE_SIZE * radius.min() else "sweep"
