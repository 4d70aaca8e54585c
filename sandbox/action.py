"""Actions: everything that a player or a script does, as timed values applied between steps.

A session is a scene and its actions; so it can be stored, replayed, and replayed on another engine.
"""

from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from sandbox.scene.cue import Stroke
from sandbox.scene.model import Ball, Box, Capsule, Compound, Course, Polygon, Single
from sandbox.scene.part import MAX_SPEED, Name, Part, Point, Velocity

Amount = Annotated[float, Field(ge=-1e42, le=1e42)]
"""Of an impulse or force: no more than the greatest mass at the greatest speed takes."""

Level = Annotated[float, Field(ge=0, le=1)]
"""How far a thrust is opened, or what a drive is asked for."""

Value = float | int | bool | str | None
"""Of a setting."""


SPAWNED = ("ball", "box", "capsule", "polygon", "body")
"""What can be added to a running scene, by the headings of its tables."""


class ActionError(ValueError):
    """An action that cannot be applied; `str()` says why. The simulation is left as it was."""


class Timed(Part):
    """An action takes effect before the first step that starts at `time` or later."""

    time: Annotated[float, Field(ge=0, le=1e9)]
    """s"""


class Impulse(Timed):
    """Kick a body: its velocity changes by impulse / mass, its spin by angular / moment."""

    kind: Literal["impulse"] = "impulse"
    body: Name
    impulse: tuple[Amount, Amount]
    """N·s, at the centre"""
    angular: Amount = 0.0
    """N·m·s"""


class Force(Timed):
    """Push a body steadily from now on; a zero force ends it."""

    kind: Literal["force"] = "force"
    body: Name
    force: tuple[Amount, Amount]
    """N, at the centre"""
    torque: Amount = 0.0
    """N·m"""


class Move(Timed):
    """Put a body somewhere else, and give it a velocity where one is stated."""

    kind: Literal["move"] = "move"
    body: Name
    position: Point
    velocity: Velocity | None = None


class Spawn(Timed):
    """Add a body; it gets the next number. Exactly one of the shapes is stated, as in a scene file."""

    kind: Literal["spawn"] = "spawn"
    ball: Ball | None = None
    box: Box | None = None
    capsule: Capsule | None = None
    polygon: Polygon | None = None
    body: Compound | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if sum(each is not None for each in self._shapes) != 1:
            raise ValueError(f"state exactly one of {', '.join(SPAWNED)}")
        return self

    @property
    def _shapes(self) -> tuple[Single | None, ...]:
        return tuple(getattr(self, key) for key in SPAWNED)

    @property
    def single(self) -> Single:
        """What is added."""
        return next(each for each in self._shapes if each is not None)

    def named(self, name: str) -> Self:
        """Return the same with a name for the body."""
        key = next(key for key in SPAWNED if getattr(self, key) is not None)
        return self.model_copy(update={key: self.single.model_copy(update={"name": name})})


class Remove(Timed):
    """Take a body out. It keeps its number, and stays where it was, without velocity."""

    kind: Literal["remove"] = "remove"
    body: Name


class SetParameter(Timed):
    """Change a value of the scene: the air, gravity, a restitution or a friction, by its path."""

    kind: Literal["set"] = "set"
    path: Name
    value: float | int | bool | str | list[float] | None


class Pull(Timed):
    """Pull a body by a damped spring from now on, as a hand does; without a target, let it go.

    The spring is 7.5 Hz, critically damped, its force at most 100 times the body's weight; it is a soft constraint,
    stable at any dt. Where it holds is told in the body's own frame, so that it turns with the body.
    """

    kind: Literal["pull"] = "pull"
    body: Name
    grip: Point = (0.0, 0.0)
    """from the centre of the body, in its own frame, m"""
    target: Point | None = None
    """where the hand is, m"""


class Launch(Timed):
    """Start the bodies of a generator anew, laid out with another seed."""

    kind: Literal["launch"] = "launch"
    generator: Name
    seed: Annotated[int, Field(ge=0, lt=2**63)]


class Throttle(Timed):
    """Open a thrust of the scene, or close it."""

    kind: Literal["throttle"] = "throttle"
    thrust: Name
    level: Level
    """share of its force, from now on"""


class Reshape(Timed):
    """Change the course of a wall from now on: ground that is dug away or heaped up. Who stands in it is parted."""

    kind: Literal["reshape"] = "reshape"
    thing: Name
    """a wall"""
    points: Course
    """m, in place of those that it had"""


class Drive(Timed):
    """Ask a drive of the scene for a level from now on."""

    kind: Literal["drive"] = "drive"
    drive: Name
    level: Level
    """0 is at rest; of a torque the part of it, of a pull how far, of a stroke anything above 0 all the way"""


class Toggle(Timed):
    """Let a wall or post be met from now on, or let everything pass it: a drop target, a diverter."""

    kind: Literal["toggle"] = "toggle"
    thing: Name
    solid: bool


class Strike(Timed, Stroke):
    """Strike a ball on a floor with a cue: it has the velocity and the spin of the stroke, whatever it had before."""

    kind: Literal["strike"] = "strike"
    ball: Name


class Switch(Timed):
    """Go on with another engine, or with other settings, from the state as it is."""

    kind: Literal["switch"] = "switch"
    engine: Name | None = None
    """none goes on with the same"""
    settings: dict[str, Value] = Field(default_factory=dict)
    """what changes of `[solver]`"""


Action = Annotated[
    Impulse
    | Force
    | Move
    | Spawn
    | Remove
    | SetParameter
    | Pull
    | Launch
    | Throttle
    | Reshape
    | Drive
    | Toggle
    | Strike
    | Switch,
    Field(discriminator="kind"),
]

_ACTIONS: TypeAdapter[tuple[Action, ...]] = TypeAdapter(tuple[Action, ...])

_SETTABLE = (
    "world.gravity",
    "world.wind",
    "world.linear_drag",
    "world.quadratic_drag",
    "surface.sliding_friction",
    "surface.curl",
)

SETTABLE = f"{', '.join(_SETTABLE)}, and any restitution or friction"
"""What of a running scene may be changed, in words."""


def is_settable(path: str) -> bool:
    """Tell whether a running scene's value may be changed."""
    return path in _SETTABLE or path.rpartition(".")[2] in ("restitution", "friction")


def actions_from_json(text: str) -> tuple[Action, ...]:
    """Read a JSON array of actions.

    Raises:
        ActionError: one line for everything that is wrong.
    """
    try:
        return _ACTIONS.validate_json(text, strict=True)
    except ValidationError as error:
        lines = [f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors()]
        raise ActionError("\n".join(lines)) from None


def actions_to_json(actions: tuple[Action, ...]) -> Any:
    """Return actions as JSON values, the inverse of `actions_from_json`."""
    return _ACTIONS.dump_python(actions, mode="json")


def heading_of(element: Any) -> str:
    """Return the heading under which a scene file, or a `Spawn`, states an element that can be spawned."""
    kinds: dict[type, str] = {Ball: "ball", Box: "box", Capsule: "capsule", Polygon: "polygon", Compound: "body"}
    return kinds.get(type(element), "")


def in_order(actions: tuple[Action, ...]) -> tuple[Action, ...]:
    """Return actions by time; those of one time stay in the order in which they were given."""
    return tuple(sorted(actions, key=lambda action: action.time))


def number_among(names: Sequence[str], name: str, kind: str) -> int:
    """Return the place of a name among those of a kind.

    Raises:
        ActionError: it is none of them.
    """
    if name not in names:
        raise ActionError(f"no {kind} is named {name!r}; there are {', '.join(names) or 'none'}")
    return names.index(name)


def speed_limit(speed: float, what: str) -> None:
    """Refuse a velocity that no body may have.

    Raises:
        ActionError: it is beyond `MAX_SPEED` or not a number.
    """
    if not speed <= MAX_SPEED:
        raise ActionError(f"{what}: a speed of {speed:g} m/s is out of range; at most {MAX_SPEED:g}")
