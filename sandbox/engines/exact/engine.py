"""ExactEngine: what the event-driven engine supports, and its start. Imports no kernels until a scene is started."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.tabletop.requirements import unsupported_on_surface
from sandbox.scene.compile.demands import BALLS, FLOOR, SURFACES, Demand, on_floor, unmodelled
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

if TYPE_CHECKING:
    from sandbox.engines.exact.simulation import ExactSimulation
    from sandbox.engines.exact.tabletop.simulation import TabletopSimulation


STEPS = ("integrator", "detection", "response", "impact", "broad_phase", "joints", "stretch")
"""Settings of solvers with time steps."""

OVERLAP = ("slop", "bias", "persistence")
"""Settings of solvers that detect overlaps and correct them."""

SPRINGS = ("stiffness", "damping")
"""Settings of penalty springs."""


@dataclass(frozen=True)
class ExactEngine:
    """Event-driven engine: closed-form motion from event to event, each of which is a root of a polynomial.

    dt is the interval of frames only; substeps and iterations have no effect. Balls rest on planes and on the sides of
    walls; on other balls and on round colliders they bounce 1e-8 m high instead. Simultaneous collisions are processed
    one after another: by the index of the lower ball, then by kind (lines, vertices, balls), then by the index of the
    partner.
    """

    name: str = "exact"
    about: str = "event-driven: closed-form motion between events, next events from stable roots"
    capabilities: frozenset[Demand] = BALLS - {Demand.DRAG} | FLOOR | SURFACES - {Demand.ONE_WAY}

    def missing(self, start: Scene | Setup, settings: Settings) -> tuple[str, ...]:
        """Return what scene and settings require and this engine does not support."""
        setup = Setup.of(start)
        lacks = unmodelled(setup, self.capabilities)
        for key in STEPS + OVERLAP + SPRINGS:
            stated = getattr(settings, key)
            if stated is not None:
                why = "uses no time steps" if key in STEPS else "allows no overlap"
                lacks.append(f"{key} {stated!r} is not supported (it {why}; remove it)")
        if settings.half_kick:
            lacks.append("half_kick is not supported (it uses no time steps; remove it)")
        if on_floor(setup):
            lacks += unsupported_on_surface(setup)
        overload = too_many_pairs(setup)
        if overload is not None:
            return (*lacks, overload)
        overlap = overlap_of(setup, setup.bodies.position)
        return (*lacks, overlap) if overlap else tuple(lacks)

    def resolve(self, start: Scene | Setup, settings: Settings) -> Settings:  # noqa: ARG002, part of the protocol
        """Return the settings unchanged: this engine has no choices to fill in."""
        return settings

    def start(self, start: Scene | Setup, settings: Settings | None = None) -> "ExactSimulation | TabletopSimulation":
        """Start a scene.

        Raises:
            Refusal: the engine does not support something that the scene or a setting needs.
        """
        from sandbox.engines.contract import Refusal
        from sandbox.engines.exact.simulation import ExactSimulation

        setup = Setup.of(start)
        settings = setup.scene.solver if settings is None else settings
        missing = self.missing(setup, settings)
        if missing:
            raise Refusal(self.name, missing, ())
        if on_floor(setup):
            from sandbox.engines.exact.tabletop.simulation import TabletopSimulation

            return TabletopSimulation(setup, settings)
        return ExactSimulation(setup, settings)


def too_many_pairs(setup: Setup) -> str | None:
    """Return why a scene has too many balls, or None: all pairs of balls and colliders are tested."""
    from sandbox.resource_limits import MEMORY, PAIRS

    scene, bodies = setup.scene, setup.bodies
    touching = np.asarray([element.collides != "none" for element in bodies.elements], np.bool_)[bodies.element]
    balls, moving = int(touching.sum()), int((touching & ~bodies.fixed).sum())
    if on_floor(setup):  # the table of pairs has a row for every ball
        refusal = MEMORY.refusal(f"the table of pairs of {len(bodies):,} balls takes", 8 * len(bodies) ** 2)
        if refusal is not None:
            return refusal
    fixed = sum(2 * len(wall.points) for wall in scene.walls) + len(scene.planes) + len(scene.posts)
    pairs = moving * (balls + fixed + len(scene.pockets))
    return PAIRS.refusal(
        f"the number of pairs of {moving:,} moving balls with {balls + fixed:,} balls and surfaces is", pairs
    )


def overlap_of(start: Scene | Setup, position: FloatArray) -> str | None:
    """Return a message naming two overlapping objects with the bodies at positions (N, 2), m; None without overlap."""
    from sandbox.engines.common.colliders import static_colliders
    from sandbox.engines.exact.start_overlaps import overlap_message, overlapping_balls, overlapping_collider
    from sandbox.engines.tabletop.requirements import pockets_at

    setup = Setup.of(start)
    scene, bodies = setup.scene, setup.bodies
    if not bodies.round.any():
        return None
    kinds = np.asarray([element.collides for element in bodies.elements])[bodies.element]
    in_play = bodies.round & (pockets_at(scene, position) < 0)  # captured balls do not collide
    to_all, to_fixed = (kinds == "all") & in_play, (kinds == "fixed") & in_play
    pair = overlapping_balls(position, bodies.radius, to_all, to_fixed, bodies.fixed)
    if pair is not None:
        return overlap_message(bodies.names[pair[0]], bodies.names[pair[1]], pair[2])
    candidates = np.flatnonzero((to_all | to_fixed) & ~bodies.fixed)
    found = overlapping_collider(position[candidates], bodies.radius[candidates], static_colliders(scene))
    if found is not None:
        return overlap_message(bodies.names[candidates[found[0]]], scene.fixed_names[found[1]], found[2])
    return None
