"""Launch: the balls of a generator put back to where they start, laid out with another seed."""

import numpy as np

from sandbox.action import ActionError, Launch
from sandbox.scene.bodies import Bodies
from sandbox.scene.claimed import generator_names
from sandbox.scene.generators import GeneratorError, expand
from sandbox.scene.model import Generator, Scene
from sandbox.trajectory import BoolArray, Frame


def launched(action: Launch, scene: Scene, bodies: Bodies, frame: Frame) -> tuple[Frame, BoolArray]:
    """Return the state with a generator's balls at their start, and which they are, (N,); those gone are back.

    Raises:
        ActionError: there is no such generator, or its balls do not fit.
    """
    names = generator_names(scene)
    if action.generator not in names:
        raise ActionError(f"no generator is named {action.generator!r}")
    kinds: tuple[tuple[Generator, ...], ...] = (scene.grids, scene.scatters, scene.emitters)
    every = [(generator, place) for kind in kinds for place, generator in enumerate(kind)]
    which = names.index(action.generator)
    generator, place = every[which]
    try:
        position, velocity = expand(generator, action.seed, place)
    except GeneratorError as error:
        raise ActionError(str(error)) from None
    those = bodies.element == len(scene.balls) + which
    positions, velocities = frame.position.copy(), frame.velocity.copy()
    positions[those], velocities[those] = position, velocity
    state = Frame(
        frame.time,
        positions,
        velocities,
        np.where(those, generator.angle, frame.angle),
        np.where(those, generator.angular_velocity, frame.angular_velocity),
        frame.present | those,
    )
    return state, those
