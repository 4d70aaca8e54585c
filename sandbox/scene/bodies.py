"""Bodies: everything in a scene that has a number, as arrays in scene order.

Scene order: balls, then the balls of grids, scatters and emitters, each in the order of the file.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sandbox.scene.generators import expand as expand_generator
from sandbox.scene.generators import size
from sandbox.scene.model import Ball, Disc, Generator, Scene, default_name
from sandbox.scene.near import FloatArray, IntArray

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Bodies:
    """The bodies of a scene at its start; N of them, from `elements` of the file."""

    names: tuple[str, ...]
    position: FloatArray
    """(N, 2) m"""
    velocity: FloatArray
    """(N, 2) m/s"""
    angle: FloatArray
    """(N,) rad"""
    angular_velocity: FloatArray
    """(N,) rad/s"""
    radius: FloatArray
    """(N,) m"""
    mass: FloatArray
    """(N,) kg; what a fixed ball would weigh"""
    fixed: BoolArray
    """(N,) never moves"""
    element: IntArray
    """(N,) index into `elements`"""
    elements: tuple[Disc, ...]
    """The balls and generators of the file, in scene order."""

    def __len__(self) -> int:
        return len(self.names)

    def joined_by(self, ball: Ball, name: str) -> "Bodies":
        """Return these bodies and one more, which gets the next number."""
        velocity = (0.0, 0.0) if ball.fixed else ball.velocity
        more = _laid_out([name], [ball], [1], _rows([ball.position]), _rows([velocity]))
        both = {
            key: np.concatenate((getattr(self, key), getattr(more, key)))
            for key in ("position", "velocity", "angle", "angular_velocity", "radius", "mass", "fixed")
        }
        element = np.append(self.element, len(self.elements))
        return Bodies(names=(*self.names, name), element=element, elements=(*self.elements, ball), **both)

    @property
    def moment(self) -> FloatArray:
        """Moments of inertia of uniform discs, ½ m r², (N,) kg·m²."""
        return np.asarray(0.5 * self.mass * self.radius**2)


def mass_of(disc: Disc) -> float:
    """Return a ball's mass in kg: stated, or from its density, or 1."""
    if disc.mass is not None:
        return disc.mass
    return 1.0 if disc.density is None else disc.density * math.pi * disc.radius**2


def expand(scene: Scene) -> Bodies:
    """Number the bodies of a scene and lay out their starting state.

    Raises:
        GeneratorError: a generator's balls do not fit.
    """
    names = [ball.name or default_name("ball", k) for k, ball in enumerate(scene.balls)]
    elements: list[Disc] = list(scene.balls)
    counts = [1] * len(scene.balls)
    position = [_rows([ball.position for ball in scene.balls])]
    velocity = [_rows([(0.0, 0.0) if ball.fixed else ball.velocity for ball in scene.balls])]
    kinds: tuple[tuple[Generator, ...], ...] = (scene.grids, scene.scatters, scene.emitters)
    for kind in kinds:
        for k, generator in enumerate(kind):
            stem = generator.name or default_name(type(generator).__name__.lower(), k)
            names += [f"{stem}-{n}" for n in range(1, size(generator) + 1)]
            elements.append(generator)
            counts.append(size(generator))
            places, speeds = expand_generator(generator, scene.world.seed, k)
            position.append(places)
            velocity.append(speeds)
    return _laid_out(names, elements, counts, np.concatenate(position), np.concatenate(velocity))


def _laid_out(
    names: list[str], elements: list[Disc], counts: list[int], position: FloatArray, velocity: FloatArray
) -> Bodies:
    def each(values: list[float]) -> FloatArray:
        return np.repeat(np.asarray(values, dtype=np.float64), counts)

    fixed = [isinstance(e, Ball) and e.fixed for e in elements]
    return Bodies(
        names=tuple(names),
        position=position,
        velocity=velocity,
        angle=each([e.angle for e in elements]),
        angular_velocity=each([0.0 if still else e.angular_velocity for e, still in zip(elements, fixed, strict=True)]),
        radius=each([e.radius for e in elements]),
        mass=each([mass_of(e) for e in elements]),
        fixed=np.repeat(np.asarray(fixed, dtype=np.bool_), counts),
        element=np.repeat(np.arange(len(elements)), counts),
        elements=tuple(elements),
    )


def _rows(pairs: list[tuple[float, float]]) -> FloatArray:
    return np.asarray(pairs, dtype=np.float64).reshape(-1, 2)
