"""Launch: the bodies of a generator put back to where they start, laid out with another seed."""

from dataclasses import replace

import numpy as np

from sandbox.action import ActionError, Launch
from sandbox.scene.bodies import Bodies
from sandbox.scene.claimed import generators
from sandbox.scene.generators import GeneratorError
from sandbox.scene.layouts import count_of, layout_of
from sandbox.scene.model import Mover, Scene
from sandbox.scene.zone import AWAY
from sandbox.trajectory import BoolArray, Frame


def launched(action: Launch, scene: Scene, bodies: Bodies, frame: Frame) -> tuple[Frame, Bodies, BoolArray]:
    """Return the state with a generator's bodies at their start, all bodies, and which were launched, (N,).

    Those gone are back; their lives, if not for ever, begin anew.

    Raises:
        ActionError: there is no such generator, or its bodies do not fit.
    """
    found = next(((place, mover) for name, place, mover in generators(scene) if name == action.generator), None)
    if found is None:
        raise ActionError(f"no generator is named {action.generator!r}")
    place, generator = found
    try:
        layout = layout_of(generator, action.seed, place, scene.world.gravity)
    except GeneratorError as error:
        raise ActionError(str(error)) from None
    first = _first(scene, generator)
    those = np.zeros(len(bodies), np.bool_)
    those[first : first + len(layout)] = True
    columns = {}
    for key in ("position", "velocity", "angle", "angular_velocity"):
        columns[key] = getattr(frame, key).copy()
        columns[key][those] = getattr(layout, key)
    if layout.lifetime is not None:
        born, lifetime = bodies.born.copy(), bodies.lifetime.copy()
        born[those], lifetime[those] = frame.time, layout.lifetime
        bodies = replace(bodies, born=born, lifetime=lifetime)
    roll = frame.roll
    if roll is not None:  # what a generator makes does not roll yet
        roll = np.where(those[:, None], 0.0, roll)
    layer, visits = frame.layer, frame.visits
    if layer is not None:
        layer = np.where(those, scene.layers.index(generator.layer), layer)
    if visits is not None:
        visits = np.where(those[:, None], AWAY, visits)
    laid = Frame(frame.time, present=frame.present | those, roll=roll, layer=layer, visits=visits, **columns)
    passing = frame.passing
    if passing is not None:
        passing = passing[~those[passing[:, 0]]]
    return replace(laid, drives=frame.drives, passing=passing), bodies, those


def _first(scene: Scene, generator: Mover) -> int:
    """Return the number of a generator's first body."""
    movers = scene.movers
    return sum(count_of(each) for each in movers[: next(k for k, each in enumerate(movers) if each is generator)])
