"""Settings: how a scene is solved. One frozen value, the `[solver]` table of a scene file."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field

from sandbox.scene.part import Part

Integrator = Literal["explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"]
Detection = Literal["discrete", "bisect", "swept", "shrink"]
Response = Literal["impulse", "penalty"]
Impact = Literal["newton", "dissipative"]
Joints = Literal["impulses", "relaxation", "xpbd", "rattle"]
BroadPhase = Literal["all_pairs", "circles", "sweep", "grid", "oriented"]


COMMON = ("dt", "substeps", "iterations", "record_every")
"""What every engine takes; all else is a choice that only some have."""


class Settings(Part):
    """Every choice a solver is given. `None` leaves a choice to the engine, which then states its own.

    An engine that cannot honour a stated choice refuses it.
    """

    dt: Annotated[float, Field(ge=1e-9, le=10)] = 0.01
    """The frame step, s. Frames lie at k·dt."""
    substeps: Annotated[int, Field(ge=1, le=1000)] = 1
    """Solver steps a frame; each advances h = dt / substeps."""
    iterations: Annotated[int, Field(ge=1, le=10_000)] = 10
    """Passes of an iterative contact solver in each substep."""
    slop: Annotated[float, Field(ge=0, le=1e9)] | None = None
    """Overlap that is left uncorrected, m."""
    bias: Annotated[float, Field(ge=0, le=1)] | None = None
    """The share of an overlap that still remains one second later."""
    persistence: Annotated[int, Field(ge=1, le=1000)] | None = None
    """Substeps for which a parted contact's impulses are remembered, to warm-start the next touch."""
    stiffness: Annotated[float, Field(gt=0, le=1e30)] | None = None
    """Of penalty springs, N/m."""
    damping: Annotated[float, Field(ge=0, le=10)] | None = None
    """Of penalty springs, as a part of the critical; else each pair's follows from its restitution."""
    half_kick: bool = False
    """Start half a kick ahead (v + g·h/2), so that uniformly accelerated free motion is exact."""
    integrator: Integrator | None = None
    """How free motion is integrated; pymunk has explicit_euler alone."""
    detection: Detection | None = None
    """How contacts are found: at the end of a step, by bisection, by a time of impact, or with shorter steps."""
    response: Response | None = None
    """How contacts are resolved: by impulses, or by penalty springs."""
    impact: Impact | None = None
    """How impacts rebound: by Newton's law, e times the approach, or by that law cut where it would create energy with
    friction."""
    broad_phase: BroadPhase | None = None
    """How candidate pairs are found; the result is the same, the cost is not."""
    joints: Joints | None = None
    """How joints are held: velocities put right by impulses, or positions, by relaxation or with compliance (XPBD),
    or both (RATTLE)."""
    stretch: Annotated[float, Field(ge=0, le=1e3)] | None = None
    """The most that springs stretch, as a part of their rest length, where joints are held by relaxation."""
    record_every: Annotated[int, Field(ge=1, le=1_000_000_000)] = 1
    """Keep every n-th frame, and always the last."""

    @property
    def h(self) -> float:
        """The substep, s."""
        return self.dt / self.substeps

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some choices changed, checked as strictly as a scene file.

        Raises:
            pydantic.ValidationError: a name or a value is wrong.
        """
        return type(self).model_validate({**self.model_dump(), **changes})

    def common(self) -> Self:
        """Return settings with only what every engine takes."""
        return type(self)(**{key: getattr(self, key) for key in COMMON})
