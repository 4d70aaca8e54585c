"""Base classes of a scene's elements, and the ranges of their numbers.

The ranges protect compiled engines from extreme values. They are wide enough for every experiment that double precision
can represent, and narrow enough that no square or cube of a value overflows.
"""

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    StringConstraints,
    ValidationError,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, core_schema

from sandbox.scene.errors import Fault, PartError, explain_arguments, path_of

MAX_POSITION = 1e16  # m
MAX_SPEED = 1e12  # m/s
MAX_BODIES = 1_000_000
MAX_STEPS = 1e9
BACKING = 1000.0  # m: depth of the solid behind a plane; no centre may start deeper


_Stored = TypeVar("_Stored")
_Given = TypeVar("_Given")
_Item = TypeVar("_Item")


class Accepts(Generic[_Stored, _Given]):
    """Annotation of a field that has a value of one type and is set from values of another, such as a list.

    Type checkers take the type of an argument of `__init__` from `__set__`, and that of the attribute from `__get__`.
    """

    if TYPE_CHECKING:

        def __get__(self, instance: object, owner: object) -> _Stored: ...
        def __set__(self, instance: object, value: _Given) -> None: ...

    else:

        def __class_getitem__(cls, types: tuple[Any, Any]) -> Any:
            """Return the type of the stored value, which is what pydantic validates."""
            return types[0]


def default(value: Any, *, alias: str | None = None, max_length: int | None = None) -> Any:
    """Return the default of a field whose annotation is `Accepts`.

    Args:
        value: the default.
        alias: key in a scene file, if it is not the name of the field. The parameter in Python is that name.
        max_length: largest number of items.
    """
    return Field(value, alias=alias, max_length=max_length)


def default_kind(kind: str) -> Any:
    """Return the default of the `kind` of a model in Python. Files must state it, and documents contain it."""
    return Field(default_factory=lambda _: kind)  # a factory that takes the data is not excluded as a default


def is_required(field: FieldInfo) -> bool:
    """Return whether a file must state a field: it has no default, or only that of `default_kind`."""
    return field.is_required() or bool(field.default_factory_takes_validated_data)


class Part(BaseModel):
    """A frozen, strict piece of a scene: no unknown keys, no coercion, no infinities.

    In Python, lists and other ordered iterables are accepted for tuples, and stored as tuples; numpy's scalars are
    accepted for numbers.

    Raises:
        PartError: an argument is invalid; the error has every fault that was found.
    """

    # Validators are built on first use: a command mostly needs only that of a whole scene.
    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, allow_inf_nan=False, validate_by_name=True, defer_build=True
    )

    if not TYPE_CHECKING:  # type checkers derive the arguments from the fields

        def __init__(self, /, **data: Any) -> None:
            try:  # what `BaseModel.__init__` does, without a second call, as games make many actions
                self.__pydantic_validator__.validate_python(data, self_instance=self)
            except ValidationError as error:
                raise self._error_of(error) from None

        __init__.__pydantic_base_init__ = True  # validators do not call it for inner parts

    @classmethod
    def _error_of(cls, error: ValidationError) -> PartError:
        """Return the error for invalid arguments."""
        found = explain_arguments(error.errors(include_url=False), cls.model_fields)
        return PartError([Fault(cls.__name__, None, path_of(location, {}), text) for location, text in found])

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        schema: CoreSchema = _for_python(handler(source))
        return schema


def _for_python(schema: Any) -> Any:
    """Return a core schema whose values can also be set from usual values of Python; reading of JSON is not changed."""
    if isinstance(schema, list):
        return [_for_python(each) for each in schema]
    if not isinstance(schema, dict) or schema.get("type") == "json-or-python":  # that of an inner part
        return schema
    inner = schema.get("choices") if schema.get("type") == "union" else None
    schema = {key: _for_python(value) for key, value in schema.items()}
    if inner is not None:  # the locations of faults have the names of the types as before
        pairs = zip(inner, schema["choices"], strict=True)
        schema["choices"] = [(new, old["type"]) if _is_replaced(old, new) else new for old, new in pairs]
    if schema.get("type") == "tuple":
        lax = core_schema.no_info_before_validator_function(_ordered, {**schema, "strict": False})
    elif schema.get("type") in ("int", "bool"):
        lax = core_schema.no_info_before_validator_function(_plain, schema)
    else:
        return schema
    return core_schema.json_or_python_schema(schema, lax)


def _is_replaced(old: Any, new: Any) -> bool:
    return isinstance(old, dict) and isinstance(new, dict) and old["type"] != new["type"]


def _ordered(value: Any) -> Any:
    """Return the values for a tuple; a text, which no tuple is set from, for values without an order and for a part."""
    if isinstance(value, BaseModel):  # it is an iterable of its fields
        return f"{type(value).__name__}(…)"
    return repr(value) if isinstance(value, AbstractSet | Mapping) else value


def _plain(value: Any) -> Any:
    """Return a scalar of numpy as the value of Python that it stands for."""
    is_scalar = hasattr(value, "dtype") and getattr(value, "ndim", None) == 0
    return value.item() if is_scalar else value


def _speed_in_range(vector: tuple[float, float]) -> tuple[float, float]:
    speed = math.hypot(*vector)
    if speed > MAX_SPEED:
        raise ValueError(f"a speed of {speed:g} m/s is out of range; the limit is {MAX_SPEED:g}")
    return vector


@dataclass(frozen=True)
class Wording:
    """Annotation of a field: the words for its values in the message for an array with too few of them."""

    text: str
    """follows their number: "must be 3 <text>; has 2"; plural"""


Coordinate = Annotated[float, Field(ge=-MAX_POSITION, le=MAX_POSITION)]
Point = tuple[Coordinate, Coordinate]
"""A position, m."""

Coordinates = Sequence[Sequence[float]]
"""Accepted for several points."""

Vector = tuple[float, float]

Velocity = Annotated[Vector, AfterValidator(_speed_in_range)]
"""A velocity, m/s."""

PointField = Accepts[Point, Sequence[float]]
OptionalPoint = Accepts[Point | None, Sequence[float] | None]
VelocityField = Accepts[Velocity, Sequence[float]]
Items = Accepts[tuple[_Item, ...], Sequence[_Item]]
"""Types of fields that are set from tuples or lists."""

Angle = Annotated[float, Field(ge=-1e12, le=1e12)]
"""An angle, rad, counter-clockwise."""

AngularVelocity = Annotated[float, Field(ge=-1e12, le=1e12)]
Radius = Annotated[float, Field(ge=1e-9, le=1e9)]
Acceleration = Annotated[float, Field(ge=-1e9, le=1e9)]
Mass = Annotated[float, Field(ge=1e-15, le=1e30)]
Moment = Annotated[float, Field(ge=1e-40, le=1e30)]
"""A moment of inertia, kg·m²."""
Lift = Annotated[float, Field(ge=-1e6, le=1e6)]
"""Lift coefficient of a spinning body."""
GravityScale = Annotated[float, Field(ge=-1e6, le=1e6)]
"""Factor of gravity."""
DampingRate = Annotated[float, Field(ge=0, le=1e6)]
"""Rate at which damping reduces a velocity, 1/s."""
SpeedLimit = Annotated[float, Field(gt=0, le=MAX_SPEED)]
"""Largest speed, m/s, or angular speed, rad/s."""
Density = Annotated[float, Field(ge=1e-30, le=1e30)]
Restitution = Annotated[float, Field(ge=0, le=1)]
Friction = Annotated[float, Field(ge=0, le=1000)]
RollingResistance = Annotated[float, Field(ge=0, le=1000)]
"""Coefficient of rolling resistance: torque / (radius · normal force)."""
SurfaceSpeed = Annotated[float, Field(ge=-1e6, le=1e6)]
SurfaceVelocity = tuple[SurfaceSpeed, SurfaceSpeed]
Falloff = Annotated[float, Field(ge=0, le=1e6)]
"""Decrease of restitution with speed, s/m: e(v) = e / (1 + f·v), v the speed of approach."""

Name = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]*$")]
"""Name of a body or material: any text without control characters."""

Colour = Annotated[str, StringConstraints(pattern=r"^#[0-9a-fA-F]{6}$")]
"""An sRGB colour, `#rrggbb`."""


GROUND = "ground"
"""Default collision layer."""

Collides = Literal["all", "fixed", "none"]
"""Objects that a body collides with: all, only planes, walls, posts and fixed bodies, or none."""


class HasMaterial(Part):
    """Object that bodies can touch. Its own coefficients take precedence over those of its material."""

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file"""
    material: Name | None = None
    """name of a [[material]], whose values apply where this table has none"""
    restitution: Restitution | None = None
    """e: speed of separation / speed of approach, 0 to 1; if both sides of a contact have a value, they are
    multiplied"""
    restitution_falloff: Falloff | None = None
    """f, s/m: decrease of restitution with the speed of approach, e(v) = e / (1 + f·v); the values of both sides are
    added"""
    friction: Friction | None = None
    """Coulomb friction μ; if both sides of a contact have a value, they are multiplied"""
    rolling_resistance: RollingResistance | None = None
    """c of contacts of balls: a torque up to c·r·N resists rolling, N being the normal force and r the larger radius of
    the balls; the larger value of the two sides applies"""
    surface_speed: SurfaceSpeed = 0.0
    """speed of the surface, m/s, as of a conveyor belt or a drum: to the right of the outward normal, clockwise around
    the object"""
    surface_velocity: Accepts[SurfaceVelocity, Sequence[float]] = default((0.0, 0.0))
    """velocity of the surface relative to the object, m/s, on all its sides and however it is turned; adds to
    `surface_speed`"""
    colour: Colour | None = None
    """colour in the window, `#rrggbb`"""


Categories = Annotated[tuple[Name, ...], Field(max_length=32)]
"""Collision categories, by name."""


class Collider(HasMaterial):
    """Object that can collide: a body, or a static collider."""

    categories: Accepts[Categories | None, Sequence[str] | None] = default(None)
    """collision categories that it belongs to; default: all. Two objects collide only if the mask of each has a
    category of the other."""
    mask: Accepts[Categories | None, Sequence[str] | None] = default(None)
    """collision categories that it collides with; default: all"""


class BodySource(Collider):
    """Element with bodies: a single body, or a generator of many."""

    mass: Mass | None = None
    """mass, kg; default 1 if neither mass nor density is given"""
    density: Density | None = None
    """density, kg/m²"""
    angle: Angle = 0.0
    """initial angle, rad, counter-clockwise"""
    angular_velocity: AngularVelocity = 0.0
    """initial angular velocity, rad/s"""
    gravity_scale: GravityScale = 1.0
    """factor of the gravity that acts on it, of the world or of a zone; 0: none, negative: it rises"""
    linear_damping: DampingRate = 0.0
    """k, 1/s: deceleration −k v, in addition to drag and damping of the world"""
    angular_damping: DampingRate = 0.0
    """k, 1/s: angular deceleration −k ω, in addition to damping of the world"""
    max_speed: SpeedLimit | None = None
    """largest speed, m/s: a higher one is reduced to it at the end of each substep; default: unlimited"""
    max_angular_velocity: SpeedLimit | None = None
    """largest angular speed, rad/s: likewise"""
    collides: Collides = "all"
    """bodies that it collides with: `all`, `fixed` (only planes, walls, posts and fixed bodies) or `none`"""
    layer: Name = GROUND
    """initial collision layer: bodies collide only with objects in the same layer"""


PathPoints = Annotated[tuple[Point, ...], Field(max_length=1000)]
PathAngles = Annotated[tuple[Angle, ...], Field(max_length=1000)]


class BodyPath(Part):
    """Motion of a kinematic body over time: from point to point, and at the angle of each."""

    points: Accepts[PathPoints, Coordinates] = default(())
    """positions that it goes to, from the body's `position`, m; default: it stays at its place, and only turns"""
    angles: Accepts[PathAngles, Sequence[float]] = default(())
    """angle at each point, from the body's `angle`, rad; default: it does not turn"""
    pivot: PointField = default((0.0, 0.0))
    """point of the body, in its frame, about which it turns and which goes to the points, m; default: its origin"""
    speed: Annotated[float, Field(ge=1e-9, le=MAX_SPEED)] | None = None
    """mean speed from each point to the next, m/s; default: by `period`, or 1 m/s (1 rad/s if the body only turns)"""
    period: Annotated[float, Field(ge=1e-9, le=1e12)] | None = None
    """duration of a cycle with its pauses, s, in place of `speed`: there and back, once around, or once to the end"""
    repeat: Literal["there_and_back", "loop", "once"] = "there_and_back"
    """after the last point: back through all points, on to the first point and around, or stay"""
    easing: Literal["linear", "smooth"] = "linear"
    """between two points: at constant speed, or from rest to rest along a fifth-order polynomial (minimum jerk)"""
    pause: Annotated[float, Field(ge=0, le=1e12)] = 0.0
    """time for which it waits at each point that it arrives at, s"""
    start: Annotated[float, Field(ge=-1e9, le=1e9)] = 0.0
    """time at which it leaves the first point, s, where it waits until then; below 0, it is on its way at 0"""


class BodySpec(BodySource):
    """One body."""

    position: PointField
    """position of the origin of the body frame, m: for balls, boxes and capsules the centre"""
    velocity: VelocityField = default((0.0, 0.0))
    """velocity of the centre of mass, m/s"""
    fixed: bool = False
    """Never moves, as if infinitely heavy."""
    kinematic: bool = False
    """Moves at its velocity and angular velocity, which no collision or force changes, as if infinitely heavy."""
    path: BodyPath | None = None
    """motion of a kinematic body over time, instead of constant velocities"""
    one_way: Accepts[Vector | None, Sequence[float] | None] = default(None)
    """direction in the frame of a fixed or kinematic body from which it is solid, such as [0, 1] for a platform; bodies
    that come from elsewhere pass"""
    moment: Moment | None = None
    """moment of inertia about the centre of mass, kg·m²; default: from the shape and the mass"""
    fixed_rotation: bool = False
    """Never turns, as if its moment of inertia were infinite."""
    lift: Lift = 0.0
    """s of the Magnus effect: spin ω turns the velocity through the air at the rate s·ω; above 0, backspin lifts"""
    group: Name | None = None
    """name of a group of bodies that do not collide with each other"""
