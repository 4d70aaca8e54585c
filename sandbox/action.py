"""Actions: their JSON, and functions on them; the actions themselves are in `scene.description.actions`.

A session is a scene and its actions. It can be stored, and replayed on the same or another engine.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from sandbox.echo import MAX_NAMED, short_repr, shorten
from sandbox.scene.description.actions import SETTABLE as SETTABLE
from sandbox.scene.description.actions import SPAWNED as SPAWNED
from sandbox.scene.description.actions import Action as Action
from sandbox.scene.description.actions import Actuate as Actuate
from sandbox.scene.description.actions import Amount as Amount
from sandbox.scene.description.actions import Drive as Drive
from sandbox.scene.description.actions import Explosion as Explosion
from sandbox.scene.description.actions import Force as Force
from sandbox.scene.description.actions import Impulse as Impulse
from sandbox.scene.description.actions import Join as Join
from sandbox.scene.description.actions import Launch as Launch
from sandbox.scene.description.actions import Level as Level
from sandbox.scene.description.actions import Move as Move
from sandbox.scene.description.actions import Pull as Pull
from sandbox.scene.description.actions import Remove as Remove
from sandbox.scene.description.actions import Reshape as Reshape
from sandbox.scene.description.actions import SetParameter as SetParameter
from sandbox.scene.description.actions import Spawn as Spawn
from sandbox.scene.description.actions import Steer as Steer
from sandbox.scene.description.actions import Strike as Strike
from sandbox.scene.description.actions import Switch as Switch
from sandbox.scene.description.actions import Throttle as Throttle
from sandbox.scene.description.actions import Timed as Timed
from sandbox.scene.description.actions import Toggle as Toggle
from sandbox.scene.description.actions import Unjoin as Unjoin
from sandbox.scene.description.actions import Value as Value
from sandbox.scene.description.actions import is_settable as is_settable
from sandbox.scene.description.base import MAX_SPEED
from sandbox.scene.description.bodies import Box, Capsule, Compound, Polygon
from sandbox.scene.description.discs import Ball


class ActionError(ValueError):
    """An action cannot be applied; `str()` gives the reason. The simulation is left unchanged."""


@cache
def _actions() -> TypeAdapter[tuple[Action, ...]]:
    """Return the validator of actions; building it takes longer than importing this module."""
    return TypeAdapter(tuple[Action, ...])


def actions_from_json(text: str) -> tuple[Action, ...]:
    """Read a JSON array of actions.

    Raises:
        ActionError: an action is invalid; the message has one line for each fault.
    """
    try:
        return _actions().validate_json(text, strict=True)
    except ValidationError as error:
        lines = [f"{'.'.join(map(str, e['loc']))}: {shorten(e['msg'], MAX_NAMED)}" for e in error.errors()]
        raise ActionError("\n".join(lines)) from None


def actions_to_json(actions: tuple[Action, ...]) -> Any:
    """Return actions as JSON values, the inverse of `actions_from_json`."""
    return _actions().dump_python(actions, mode="json") if actions else []


def heading_of(element: Any) -> str:
    """Return the table heading, in a scene file or a `Spawn`, of an element that can be spawned."""
    kinds: dict[type, str] = {Ball: "ball", Box: "box", Capsule: "capsule", Polygon: "polygon", Compound: "body"}
    return kinds.get(type(element), "")


def in_order(actions: tuple[Action, ...]) -> tuple[Action, ...]:
    """Return actions sorted by time; actions of equal time keep their order."""
    return tuple(sorted(actions, key=lambda action: action.time))


def index_of_name(names: Sequence[str], name: str, kind: str) -> int:
    """Return the index of a name among those of a kind.

    Raises:
        ActionError: no element of the kind has that name.
    """
    if name not in names:
        raise ActionError(f"no {kind} is named {short_repr(name)}; known names: {', '.join(names) or 'none'}")
    return names.index(name)


def check_speed(speed: float, subject: str) -> None:
    """Check a speed against `MAX_SPEED`.

    Raises:
        ActionError: the speed is above `MAX_SPEED` or not a number.
    """
    if not speed <= MAX_SPEED:
        raise ActionError(f"{subject}: a speed of {speed:g} m/s is out of range; the limit is {MAX_SPEED:g}")


def dt_changes(actions: Iterable[Action]) -> Iterator[tuple[float, float]]:
    """Yield time and new value of each change of dt, s."""
    for action in actions:
        if isinstance(action, Switch):
            dt = action.settings.get("dt")
            if isinstance(dt, (int, float)) and dt > 0:  # else the action will be refused
                yield action.time, float(dt)
