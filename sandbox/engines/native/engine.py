"""PymunkEngine: what pymunk can model, and how its choices are filled in. Imports no pymunk until started."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sandbox.engines.native.floors import of_floors, on_floor
from sandbox.engines.overlap import BIAS, slop_of
from sandbox.scene.demands import BALLS, FLOOR, JOINTS, SURFACES, Demand, unmodelled
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings

if TYPE_CHECKING:
    from sandbox.engines.native.simulation import NativeSimulation

PYMUNK_WORDS = {"integrator": "explicit_euler", "detection": "discrete", "response": "impulse", "impact": "newton"}
"""The one word of each choice that describes what pymunk does."""

OWN = frozenset({Demand.POLYGONS, Demand.ATTRACTION, Demand.THRUST, Demand.LAYERS, Demand.ZONES, Demand.DRIVES})

PERSISTENCE = 3
"""pymunk's own."""


@dataclass(frozen=True)
class PymunkEngine:
    """pymunk (Munk2D): fixed step, discrete detection, sequential impulses with warm starting.

    A substep of length h, in pymunk's order: positions move by the *old* velocity, overlaps are found,
    velocities get their kick, contacts are solved. For free motion that is explicit Euler, drift–kick.
    Discrete: a thin wall is tunnelled through when v·h > r + half its thickness.
    """

    name: str = "pymunk"
    about: str = "pymunk (Munk2D): fixed step, discrete contacts, sequential impulses"
    capabilities: frozenset[Demand] = BALLS | JOINTS | FLOOR | SURFACES | OWN | {Demand.CURL}

    def missing(self, scene: Scene, settings: Settings) -> tuple[str, ...]:
        """Return what scene and settings ask for that pymunk lacks."""
        lacks = unmodelled(scene, self.capabilities)
        for key, word in PYMUNK_WORDS.items():
            stated = getattr(settings, key)
            if stated not in (None, word):
                lacks.append(f"{key} {stated!r} is not a choice it has (only {word!r})")
        lacks += [
            f"{key} is a figure of penalty springs, which it has not"
            for key in ("stiffness", "damping")
            if getattr(settings, key) is not None
        ]
        if settings.broad_phase is not None:
            lacks.append(f"broad_phase {settings.broad_phase!r} is not a choice it has (it has its own tree)")
        if settings.joints not in (None, "impulses"):
            lacks.append(f"joints {settings.joints!r} is not a choice it has (only 'impulses')")
        if settings.stretch is not None:
            lacks.append("stretch is for joints held by relaxation, which it has not")
        if settings.half_kick and (scene.world.linear_drag or scene.world.quadratic_drag):
            lacks.append("half_kick makes uniformly accelerated motion exact, but the scene has drag")
        if settings.half_kick and (scene.joints or scene.attractions or scene.thrusts or scene.drives):
            lacks.append("half_kick makes uniformly accelerated motion exact, but the scene has other forces")
        if settings.half_kick and any(zone.holds or zone.gravity is not None for zone in scene.zones):
            lacks.append("half_kick makes uniformly accelerated motion exact, but the scene has zones that change it")
        if scene.drives and scene.attractions:
            lacks.append("it does not model attraction and drives together")
        if on_floor(scene):
            lacks += of_floors(scene)
        return tuple(lacks)

    def resolve(self, scene: Scene, settings: Settings) -> Settings:
        """Return the settings with slop, bias, persistence and pymunk's own words filled in."""
        own: dict[str, object] = {"slop": slop_of(scene), "bias": BIAS, "persistence": PERSISTENCE, **PYMUNK_WORDS}
        if len(scene.links):
            own["joints"] = "impulses"
        return settings.replace(**{k: v for k, v in own.items() if getattr(settings, k) is None})

    def start(self, scene: Scene, settings: Settings | None = None) -> "NativeSimulation":
        """Set a scene up in a pymunk space.

        Raises:
            Refusal: pymunk lacks something that is asked for.
        """
        from sandbox.engines.contract import Refusal
        from sandbox.engines.native.simulation import NativeSimulation

        settings = scene.solver if settings is None else settings
        missing = self.missing(scene, settings)
        if missing:
            raise Refusal(self.name, missing, ())
        return NativeSimulation(scene, self.resolve(scene, settings))
