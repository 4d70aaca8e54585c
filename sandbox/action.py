"""Actions: everything that a player or a script does, as timed values applied between steps.

A session is a scene and its actions; so it can be stored, replayed, and replayed on another engine.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError

from sandbox.scene.model import Ball
from sandbox.scene.part import MAX_SPEED, Name, Part, Point, Velocity

Amount = Annotated[float, Field(ge=-1e42, le=1e42)]
"""Of an impulse or force: no more than the greatest mass at the greatest speed takes."""


Value = float | int | bool | str | None
"""Of a setting."""


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
    """Add a ball; it gets the next number."""

    kind: Literal["spawn"] = "spawn"
    ball: Ball


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
    """Start the balls of a grid, scatter or emitter anew, laid out with another seed."""

    kind: Literal["launch"] = "launch"
    generator: Name
    seed: Annotated[int, Field(ge=0, lt=2**63)]


class Switch(Timed):
    """Go on with another engine, or with other settings, from the state as it is."""

    kind: Literal["switch"] = "switch"
    engine: Name | None = None
    """none goes on with the same"""
    settings: dict[str, Value] = Field(default_factory=dict)
    """what changes of `[solver]`"""


Action = Annotated[
    Impulse | Force | Move | Spawn | Remove | SetParameter | Pull | Launch | Switch, Field(discriminator="kind")
]

_ACTIONS: TypeAdapter[tuple[Action, ...]] = TypeAdapter(tuple[Action, ...])

SETTABLE = "world.gravity, world.wind, world.linear_drag, world.quadratic_drag, and any restitution or friction"


def is_settable(path: str) -> bool:
    """Tell whether a running scene's value may be changed."""
    world = {f"world.{key}" for key in ("gravity", "wind", "linear_drag", "quadratic_drag")}
    return path in world or path.rpartition(".")[2] in ("restitution", "friction")


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


def in_order(actions: tuple[Action, ...]) -> tuple[Action, ...]:
    """Return actions by time; those of one time stay in the order in which they were given."""
    return tuple(sorted(actions, key=lambda action: action.time))


def speed_limit(speed: float, what: str) -> None:
    """Refuse a velocity that no body may have.

    Raises:
        ActionError: it is beyond `MAX_SPEED` or not a number.
    """
    if not speed <= MAX_SPEED:
        raise ActionError(f"{what}: a speed of {speed:g} m/s is out of range; at most {MAX_SPEED:g}")
