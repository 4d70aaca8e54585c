"""Steady: forces and torques that act on bodies in a space until they are taken back; pymunk forgets its own."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.engines.native.drag import acceleration
from sandbox.engines.native.members import Member
from sandbox.engines.native.reader import Reader
from sandbox.scene.model import World
from sandbox.trajectory import FloatArray, IntArray


class Steady:
    """A force (N) and a torque (N·m) by the number of the body."""

    def __init__(self) -> None:
        self._pushes: dict[int, tuple[FloatArray, float]] = {}
        self._lifts: dict[int, FloatArray] = {}
        self._of: dict[int, tuple[FloatArray, float]] = {}  # both together
        self._ready: list[tuple[Any, Any, float]] | None = None  # of each: pymunk's record, force and torque

    @property
    def lifted(self) -> list[int]:
        """The numbers of the bodies that a zone lifts."""
        return list(self._lifts)

    def __iter__(self) -> Iterator[int]:
        return iter(self._of)

    def items(self) -> list[tuple[int, tuple[FloatArray, float]]]:
        """Return number, and force and torque, of each body that has some."""
        return list(self._of.items())

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Let a force and a torque act on a body from now on."""
        if force.any() or torque:
            self._pushes[number] = force, torque
        else:
            self._pushes.pop(number, None)
        self._add_up(number)

    def lift(self, number: int, force: FloatArray | None) -> None:
        """Let a zone's force (2,), N, act on a body from now on, instead of any other zone's; None is none."""
        if force is None and number not in self._lifts:
            return
        if force is None:
            del self._lifts[number]
        else:
            self._lifts[number] = force
        self._add_up(number)

    def _add_up(self, number: int) -> None:
        self._ready = None
        push, lift = self._pushes.get(number), self._lifts.get(number)
        if push is not None:
            self._of[number] = push if lift is None else (push[0] + lift, push[1])
        elif lift is not None:
            self._of[number] = lift, 0.0
        else:
            self._of.pop(number, None)

    def drop(self, number: int) -> None:
        """Let nothing act on a body any more."""
        for each in (self._pushes, self._lifts, self._of):
            each.pop(number, None)
        self._ready = None

    def apply(self, members: Mapping[int, Member]) -> None:
        """Set forces and torques for the next step, where there is no drag."""
        if self._ready is None:
            self._ready = [
                (members[number].body._body, ffi.new("cpVect *", force.tolist())[0], torque)
                for number, (force, torque) in self._of.items()
            ]
        for record, force, torque in self._ready:  # pymunk's own setters take five times as long
            lib.cpBodySetForce(record, force)
            if torque:  # none is what pymunk leaves after each step
                lib.cpBodySetTorque(record, torque)

    def apply_with_drag(
        self,
        members: Mapping[int, Member],
        reader: Reader,
        state: tuple[IntArray, FloatArray],
        springs: FloatArray | None,
        world: World,
        h: float,
    ) -> None:
        """Set forces and torques for the next step of h, s, where all bodies are dragged.

        Args:
            members: by number.
            reader: of the space, which takes forces on all bodies at once.
            state: their numbers (R,), and position, angle, velocity, spin.
            springs: (R, 2) N, which pymunk itself will add in that step, or None. In drag they have to act by less.
            world: gives drag and wind.
            h: of the step.
        """
        numbers, figures = state
        mass = np.asarray([members[n].body.mass for n in numbers.tolist()])[:, None]
        mass[np.isinf(mass)] = 0.0  # of what a drive moves, or a zone holds, whatever acts on it
        push = np.zeros((len(numbers), 2))
        for row, number in enumerate(numbers.tolist()):
            if number in self._of and mass[row]:
                push[row] = self._of[number][0] * (1.0 / mass[row])
        if springs is None:
            reader.push(mass * acceleration(world, figures[:, 3:5], push, h))
        else:
            pull = np.divide(springs, mass, out=np.zeros_like(springs), where=mass > 0.0)
            reader.push(mass * (acceleration(world, figures[:, 3:5], push + pull, h) - pull))
        self._twist(members)

    def _twist(self, members: Mapping[int, Member]) -> None:
        for number, (_, torque) in self._of.items():
            members[number].body.torque = torque
