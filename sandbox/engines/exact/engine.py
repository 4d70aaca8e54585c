"""ExactEngine: the demands that the event-driven engine supports, and its start. Only `start` imports kernels."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sandbox.engines.exact.common.requirements import CAPABILITIES, unsupported
from sandbox.scene.compile.demands import Demand, on_floor
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings

if TYPE_CHECKING:
    from sandbox.engines.exact.simulation import ExactSimulation
    from sandbox.engines.exact.tabletop.simulation import TabletopSimulation


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
    capabilities: frozenset[Demand] = CAPABILITIES
    knows_impulses: bool = True
    epsilon: float = 2.0**-52

    def missing(self, start: Scene | Setup, settings: Settings) -> tuple[str, ...]:
        """Return each demand and setting that this engine does not support."""
        return unsupported(Setup.of(start), settings)

    def resolve(self, start: Scene | Setup, settings: Settings) -> Settings:  # noqa: ARG002, part of the protocol
        """Return the settings unchanged: this engine has no defaults to fill in."""
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
