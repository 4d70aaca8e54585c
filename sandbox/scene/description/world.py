"""`[world]`, `[solver]`, materials, pairs of materials, and kicks."""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self, TypedDict

from pydantic import Field, ValidationError, ValidatorFunctionWrapHandler, WrapValidator

from sandbox.scene.description.base import (
    Acceleration,
    Accepts,
    Coordinates,
    Falloff,
    Friction,
    Name,
    Part,
    Point,
    Restitution,
    RollingResistance,
    VelocityField,
    default,
)
from sandbox.scene.errors import Fault, SettingsError, explain_arguments, path_of

Drag = Annotated[float, Field(ge=0, le=1e9)]


class World(Part):
    """Gravity, air, duration, random seed, and the bounds outside which bodies are removed."""

    gravity: Accepts[tuple[Acceleration, Acceleration], Sequence[float]] = default((0.0, 0.0))
    """acceleration of free fall, m/s²"""
    duration: Annotated[float, Field(gt=0, le=1e9)] = 10.0
    """duration of a run without a window, s; pymunk and box2d end it with a whole step of dt"""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """Seed of all random numbers of the scene."""
    linear_drag: Drag = 0.0
    """k, 1/s: a = −k (v − wind)"""
    quadratic_drag: Drag = 0.0
    """c, 1/m: a = −c |v − wind| (v − wind)"""
    damping: Annotated[float, Field(gt=0, le=1)] = 1.0
    """d, pymunk's `space.damping`: fraction of velocity and angular velocity that remains after one second"""
    wind: VelocityField = default((0.0, 0.0))
    """velocity of the air, m/s"""
    bounds: Accepts[tuple[Point, Point] | None, Coordinates | None] = default(None)
    """Lower left and upper right corner, m. A body whose centre leaves the box is removed."""

    @property
    def damping_rate(self) -> float:
        """λ = −ln d, 1/s: damping is the acceleration −λ v and the angular acceleration −λ ω."""
        return 0.0 - math.log(self.damping)

    @property
    def has_drag(self) -> bool:
        """Whether there is drag."""
        return self.linear_drag > 0.0 or self.quadratic_drag > 0.0

    @property
    def has_damping(self) -> bool:
        """Whether there is damping."""
        return self.damping < 1.0


IntegratorName = Literal["explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"]
ADDED_INTEGRATORS: set[str] = set()
"""Integrators that `sandbox.add_integrator` has added in this process; settings accept them too."""


def _known_integrator(value: object, check: ValidatorFunctionWrapHandler) -> object:
    return value if isinstance(value, str) and value in ADDED_INTEGRATORS else check(value)


DetectionName = Literal["discrete", "bisect", "swept", "shrink"]
Response = Literal["impulse", "penalty"]
ImpactLaw = Literal["newton", "dissipative"]
Joints = Literal["impulses", "relaxation", "xpbd", "rattle"]
BroadPhaseName = Literal["all_pairs", "circles", "sweep", "grid", "oriented"]


COMMON = ("dt", "substeps", "iterations", "record_every")
"""Settings that every engine supports; the others are choices that some engines have."""


MAX_SLOP = 1e9
"""m"""
MAX_STIFFNESS = 1e30
"""N/m"""
MAX_SLEEP_TIME = 1e6
"""s"""


class SettingsChanges(TypedDict, total=False):
    """Changes to `Settings`, as keyword arguments; the keys and their types are those of its fields."""

    dt: float
    substeps: int
    iterations: int
    slop: float | None
    bias: float | None
    persistence: int | None
    stiffness: float | None
    damping: float | None
    half_kick: bool
    integrator: IntegratorName | None
    detection: DetectionName | None
    response: Response | None
    impact: ImpactLaw | None
    broad_phase: BroadPhaseName | None
    joints: Joints | None
    stretch: float | None
    continuous: bool | None
    sleeping: bool | None
    sleep_time: float | None
    idle_speed: float | None
    workers: int | None
    record_every: int


class Settings(Part):
    """Settings of the solver. A setting that is left out is chosen by the engine, and reported with the run.

    An engine that does not support a given setting refuses the scene.
    """

    dt: Annotated[float, Field(ge=1e-9, le=10)] = 0.01
    """Time step of a frame, s. Frames are at k·dt."""
    substeps: Annotated[int, Field(ge=1, le=1000)] = 1
    """Number of solver steps per frame; each advances h = dt / substeps."""
    iterations: Annotated[int, Field(ge=1, le=10_000)] = 10
    """Iterations of the contact solver in each substep."""
    slop: Annotated[float, Field(ge=0, le=MAX_SLOP)] | None = None
    """Overlap that is not corrected, m."""
    bias: Annotated[float, Field(ge=0, le=1)] | None = None
    """Fraction of an overlap that remains after one second of correction."""
    persistence: Annotated[int, Field(ge=1, le=1000)] | None = None
    """Substeps for which the impulses of a separated contact are kept for warm starting."""
    stiffness: Annotated[float, Field(gt=0, le=MAX_STIFFNESS)] | None = None
    """Stiffness of penalty springs, N/m."""
    damping: Annotated[float, Field(ge=0, le=10)] | None = None
    """Damping of penalty springs as a fraction of critical damping; default: from the restitution of each pair."""
    half_kick: bool = False
    """Start with the velocity v + g·h/2, which makes uniformly accelerated motion exact."""
    integrator: Annotated[IntegratorName | None, WrapValidator(_known_integrator)] = None
    """Integrator of free motion; pymunk supports explicit_euler only."""
    detection: DetectionName | None = None
    """Contact detection: at the end of each step, by bisection, by time of impact, or by shorter steps."""
    response: Response | None = None
    """Contact response: impulses or penalty springs."""
    impact: ImpactLaw | None = None
    """Impact law: Newton's (separation = e times approach), or Newton's limited so that friction does not create
    energy."""
    broad_phase: BroadPhaseName | None = None
    """Search for candidate pairs; affects the cost and not the result."""
    joints: Joints | None = None
    """Joint solver: impulses on velocities, position relaxation, position with compliance (XPBD), or both positions and
    velocities (RATTLE)."""
    stretch: Annotated[float, Field(ge=0, le=1e3)] | None = None
    """Largest stretch of springs as a fraction of their rest length, with joints = "relaxation"."""
    continuous: bool | None = None
    """Stop bodies at static colliders that they would pass within a step; box2d only, which does so by default."""
    sleeping: bool | None = None
    """Stop computing groups of bodies that have come to rest; pymunk and box2d, default: false."""
    sleep_time: Annotated[float, Field(ge=0, le=MAX_SLEEP_TIME)] | None = None
    """Time for which a group of bodies has to be idle before it falls asleep, s; pymunk only, default: 0.5."""
    idle_speed: Annotated[float, Field(ge=0, le=1e6)] | None = None
    """Speed below which a body is idle, m/s; pymunk only, default: 0, for the speed that gravity adds in a substep."""
    workers: Annotated[int, Field(ge=1, le=64)] | None = None
    """Number of threads of a step; box2d only."""
    record_every: Annotated[int, Field(ge=1, le=1_000_000_000)] = 1
    """Record every n-th frame, and always the last."""

    @property
    def h(self) -> float:
        """Substep, s: dt / substeps."""
        return self.dt / self.substeps

    def replace(self, /, **changes: Any) -> Self:
        """Return a copy with some settings changed, validated as strictly as a scene file.

        Args:
            changes: new values by name.

        Raises:
            SettingsError: a name or a value is invalid.
        """
        return type(self)(**{**self.model_dump(), **changes})

    @classmethod
    def _error_of(cls, error: ValidationError) -> SettingsError:
        details = error.errors(include_url=False)
        found = dict(explain_arguments(details, cls.model_fields))
        found |= {each["loc"]: _hint(name) for each in details if (name := each["loc"][0]) in World.model_fields}
        return SettingsError(
            [Fault("settings", None, path_of(("solver", *loc), {}), text) for loc, text in found.items()]
        )

    def common(self) -> Self:
        """Return the settings with only those that every engine supports; the others get their defaults."""
        return type(self)(**{key: getattr(self, key) for key in COMMON})


class Material(Part):
    """A named set of contact coefficients."""

    name: Name
    """name that shapes and pairs refer to"""
    restitution: Restitution | None = None
    """e: speed of separation / speed of approach, 0 to 1"""
    restitution_falloff: Falloff | None = None
    """f, s/m: decrease of restitution with the speed of approach, e(v) = e / (1 + f·v)"""
    friction: Friction | None = None
    """Coulomb friction μ"""
    rolling_resistance: RollingResistance | None = None
    """c of contacts of balls, which a torque up to c·r·N resists"""


class Pair(Part):
    """Coefficients of the contact of two materials, used in place of their combined values."""

    between: Accepts[tuple[Name, Name], Sequence[str]]
    """names of the two materials"""
    restitution: Restitution | None = None
    """e of this pair, 0 to 1, in place of the product of the two materials' values"""
    restitution_falloff: Falloff | None = None
    """f, s/m: decrease of restitution with the speed of approach, e(v) = e / (1 + f·v)"""
    friction: Friction | None = None
    """μ of this pair, in place of the product of the two materials' values"""
    rolling_resistance: RollingResistance | None = None
    """c of this pair, in place of the larger of the two materials' values"""


MIN_THRESHOLD = 1e-3
"""m/s: at lower speeds of approach engines do not distinguish rest, micro-bounces and pressing."""


class Kick(Part):
    """Adds `speed` along the normal when a body approaches faster than `threshold`."""

    speed: Annotated[float, Field(ge=0, le=1e6)]
    """speed that is added, m/s; with the profile `middle`, the value in the middle"""
    threshold: Annotated[float, Field(ge=MIN_THRESHOLD, le=1e12)] = 0.05
    """smallest speed of approach along the normal, m/s"""
    profile: Literal["even", "middle"] = "even"
    """`even`: the same everywhere; `middle`: times 4 s (1 − s) along the length of a wall, s from 0 to 1"""
    adds_to: Literal["rebound", "approach"] = "rebound"
    """`rebound`: the speed is added after the bounce, as at a bumper; `approach`: the speed is added to the approach
    before the bounce, as at a slingshot"""


def _hint(name: object) -> str:
    """Return the way to set a value of the world, which is no setting."""
    value = "2" if name == "seed" else "…"
    return f"no setting of the solver; give it to the scene: load(…, ['world.{name}={value}'])"
