"""ExactEngine: what event-driven simulation can model. Light until started."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sandbox.engines.floor.level import unlevel
from sandbox.scene.demands import BALLS, FLOOR, SURFACES, Demand, on_floor, unmodelled
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import FloatArray

if TYPE_CHECKING:
    from sandbox.engines.exact.rolling.simulation import RollingSimulation
    from sandbox.engines.exact.simulation import ExactSimulation

STEPS = ("integrator", "detection", "response", "impact", "broad_phase", "joints", "stretch")
"""Choices of solvers that step."""

OVERLAP = ("slop", "bias", "persistence")
"""Choices of solvers that find overlaps and part them."""

SPRINGS = ("stiffness", "damping")
"""Choices of solvers that let springs part what overlaps."""


@dataclass(frozen=True)
class ExactEngine:
    """Event-driven: closed-form motion from event to event, each found as a root.

    dt only says where frames lie; substeps and iterations mean nothing here. Balls rest on planes and on the sides of
    walls; on each other and on anything round they hop by some 1e-8 m instead. Simultaneous hits are worked one after
    another: those of the lowest ball first, then by kind (flats, ends and posts, balls) and number.
    """

    name: str = "exact"
    about: str = "event-driven: closed-form motion between events, next events from stable roots"
    capabilities: frozenset[Demand] = BALLS - {Demand.DRAG} | FLOOR | SURFACES - {Demand.ONE_WAY}

    def missing(self, scene: Scene, settings: Settings) -> tuple[str, ...]:
        """Return what scene and settings ask for that it lacks."""
        lacks = unmodelled(scene, self.capabilities)
        for key in STEPS + OVERLAP + SPRINGS:
            stated = getattr(settings, key)
            if stated is not None:
                why = "takes no steps" if key in STEPS else "lets nothing overlap"
                lacks.append(f"{key} {stated!r} is not a choice it has (it {why}; leave it out)")
        if settings.half_kick:
            lacks.append("half_kick is not a choice it has (it takes no steps; leave it out)")
        if on_floor(scene):
            lacks += unlevel(scene, scene.bodies)
        overlap = overlap_of(scene, scene.bodies.position)
        return (*lacks, overlap) if overlap else tuple(lacks)

    def resolve(self, scene: Scene, settings: Settings) -> Settings:  # noqa: ARG002, all engines are asked alike
        """Return the settings: it has no choices to fill in."""
        return settings

    def start(self, scene: Scene, settings: Settings | None = None) -> "ExactSimulation | RollingSimulation":
        """Set a scene up.

        Raises:
            Refusal: the engine lacks something that is asked for.
        """
        from sandbox.engines.contract import Refusal
        from sandbox.engines.exact.simulation import ExactSimulation

        settings = scene.solver if settings is None else settings
        missing = self.missing(scene, settings)
        if missing:
            raise Refusal(self.name, missing, ())
        if on_floor(scene):
            from sandbox.engines.exact.rolling.simulation import RollingSimulation

            return RollingSimulation(scene, settings)
        return ExactSimulation(scene, settings)


def overlap_of(scene: Scene, position: FloatArray) -> str | None:
    """Say which two of a scene's overlap with its bodies at some places (N, 2), m, or None."""
    from sandbox.engines.exact.overlap import overlapping_balls, overlapping_things, told
    from sandbox.engines.fixtures import fixtures_of
    from sandbox.engines.floor.pockets import caught

    bodies = scene.bodies
    if not bodies.round.any():
        return None
    kinds = np.asarray([element.collides for element in bodies.elements])[bodies.element]
    there = bodies.round & (caught(scene, position) < 0)  # what lies in a pocket meets nothing
    to_all, to_fixed = (kinds == "all") & there, (kinds == "fixed") & there
    pair = overlapping_balls(position, bodies.radius, to_all, to_fixed, bodies.fixed)
    if pair is not None:
        return told(bodies.names[pair[0]], bodies.names[pair[1]], pair[2])
    meets = np.flatnonzero((to_all | to_fixed) & ~bodies.fixed)
    found = overlapping_things(position[meets], bodies.radius[meets], fixtures_of(scene))
    if found is not None:
        return told(bodies.names[meets[found[0]]], scene.fixed_names[found[1]], found[2])
    return None
