"""Kicks: the impulses on bodies in a substep that are not of contacts or joints, by cause."""

from typing import NamedTuple

import numpy as np

from sandbox.engines.native.drag import acceleration, is_dragged
from sandbox.engines.native.population import Population
from sandbox.trajectory import BoolArray, FloatArray


class Kicks(NamedTuple):
    """What N bodies were given, N·s."""

    weight: FloatArray
    """(N, 2) by gravity, and what attracts"""
    driven: FloatArray
    """(N, 2) by steady forces and thrusts"""
    twisted: FloatArray
    """(N,) by steady torques and thrusts, N·m·s"""
    dragged: FloatArray
    """(N, 2) by the air, and what it keeps other forces from giving"""


def kicks_of(
    population: Population, before: FloatArray, counts: BoolArray, springs: FloatArray | None, h: float
) -> Kicks:
    """Return the kicks of the last substep.

    Args:
        population: as it is after it.
        before: velocities at its beginning, (N, 2) m/s.
        counts: (N,) whose kicks are wanted; those of others are 0.
        springs: (N, 2) N, which drag makes act by less; None is none.
        h: how much of the substep there was, s.
    """
    bodies, world = population.bodies, population.scene.world
    mass = np.where(counts, bodies.mass, 0.0)[:, None]
    pushed, torque = _steady(population)
    pull, thrust, twist = _field(population)
    dragged = np.zeros_like(before)
    if is_dragged(world):
        push = (pushed + thrust + (0.0 if springs is None else springs)) / bodies.mass[:, None] + pull
        given = acceleration(world, before, push, population.h) - np.asarray(world.gravity) - push
        dragged = mass * given * h
    driven = np.where(counts[:, None], pushed + thrust, 0.0)
    twisted = np.where(counts, torque + twist, 0.0)
    return Kicks(mass * (np.asarray(world.gravity) + pull) * h, driven * h, twisted * h, dragged)


def _steady(population: Population) -> tuple[FloatArray, FloatArray]:
    """Return steady forces (N, 2), N, and torques (N,), N·m."""
    force, torque = np.zeros_like(population.position), np.zeros(len(population.position))
    for steady in (population.free.pushes, population.meeting.steady):
        for number, (push, twist) in steady.items():
            force[number], torque[number] = push, twist
    return force, torque


def _field(population: Population) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the pull (N, 2), m/s², on all bodies, and the thrusts, (N, 2) N and (N,) N·m."""
    field, free, names = population.meeting.field, population.free.numbers, population.bodies.names
    pull, thrust = np.zeros_like(population.position), np.zeros_like(population.position)
    twist = np.zeros(len(pull))
    if field.attracts:
        pull[free] = field.at(population.position[free])
    if field.told:
        number = {name: k for k, name in enumerate(names)}
        rows = [number[name] for name in field.told]
        told = np.asarray(list(field.told.values()))
        pull[rows], thrust[rows], twist[rows] = told[:, 0:2], told[:, 2:4], told[:, 4]
    return pull, thrust, twist
