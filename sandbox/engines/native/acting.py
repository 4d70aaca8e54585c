"""Acting: what each action does to a population. Everything is checked before anything changes."""

import math

import numpy as np

from sandbox.action import (
    SETTABLE,
    Action,
    ActionError,
    Force,
    Impulse,
    Move,
    Remove,
    SetParameter,
    Spawn,
    is_settable,
    speed_limit,
)
from sandbox.engines.native.population import Population
from sandbox.scene.address import AddressError, assign
from sandbox.scene.document import to_document
from sandbox.scene.faults import SceneError
from sandbox.scene.file import from_document


def perform(action: Action, population: Population) -> int | None:
    """Do what an action says; return the number of a body that is to be taken out, if any.

    Raises:
        ActionError: it cannot be done. Nothing has changed then.
    """
    number: int | None = None
    match action:
        case Impulse():
            _kick(action, population)
        case Force():
            _push(action, population)
        case Move():
            _move(action, population)
        case Spawn():
            population.add(action.ball)
        case Remove():
            number = population.number(action.body)
        case SetParameter():
            _set(action, population)
        case _:
            raise ActionError(f"{action!r} is no action")
    population.changed()
    return number


def _kick(action: Impulse, population: Population) -> None:
    number, half = population.mover(action.body)
    population.refresh()
    velocity = population.velocity[number] + np.asarray(action.impulse) / population.bodies.mass[number]
    spin = float(population.angular_velocity[number] + action.angular / population.bodies.moment[number])
    speed_limit(float(np.hypot(*velocity)), f"the impulse on {action.body!r}")
    speed_limit(abs(spin), f"the angular impulse on {action.body!r}")
    half.set_velocity(number, velocity)
    if action.angular:
        half.set_spin(number, spin)


def _push(action: Force, population: Population) -> None:
    number, half = population.mover(action.body)
    mass, moment = float(population.bodies.mass[number]), float(population.bodies.moment[number])
    speed_limit(math.hypot(*action.force) / mass * population.h, f"one step under the force on {action.body!r}")
    speed_limit(abs(action.torque) / moment * population.h, f"one step under the torque on {action.body!r}")
    if action.torque and not math.isfinite(half.moment(number)):
        half.give_moment(number, moment)
    half.push(number, np.asarray(action.force), action.torque)


def _move(action: Move, population: Population) -> None:
    number = population.number(action.body)
    fixed = bool(population.bodies.fixed[number])
    if fixed and action.velocity not in (None, (0.0, 0.0)):
        raise ActionError(f"{action.body!r} is fixed; it can be put elsewhere, but has no velocity")
    element = population.bodies.elements[population.bodies.element[number]]
    population.check_place(action.position, element.radius, element.collides)
    population.refresh()
    population.position[number] = action.position
    half = population.half_of(number)
    if half is None:
        return
    half.set_position(number, np.asarray(action.position))
    if action.velocity is not None and not fixed:
        half.set_velocity(number, np.asarray(action.velocity) + population.ahead)


def _set(action: SetParameter, population: Population) -> None:
    if not is_settable(action.path):
        raise ActionError(f"{action.path!r} cannot be changed while a scene runs; what can: {SETTABLE}")
    try:
        document, _ = assign(to_document(population.scene), action.path, action.value)
        scene = from_document(document)
    except AddressError as error:
        raise ActionError(str(error)) from None
    except SceneError as error:
        raise ActionError("; ".join(f"{f.path}: {f.message}" for f in error.faults)) from None
    population.change(scene)
