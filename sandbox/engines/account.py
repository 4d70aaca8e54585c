"""Account: where the energy of a running scene went, by cause.

    start + sum over all causes = end + residual

A simulation keeps an account from the first time that it is asked for one; who never asks pays nothing. Each cause's
entry is the energy that it has brought since, J, negative where it took some. Entries are computed from what each cause
did (impulses times velocities, forces along ways), never as what is left over, so that the residual is a true check;
only INTEGRATOR is a remainder, of free motion alone: what its energy changed by, less the work of the forces that act.

All that acts within a substep acts at once. An impulse's work is the impulse times the mean of the velocities at the
substep's two ends, so that what rests has no entries, though each substep kicks it down and its support kicks it back.
"""

from collections.abc import Mapping
from enum import StrEnum


class Cause(StrEnum):
    """What can change the energy of a scene."""

    RESTITUTION = "restitution"
    """Impulses along the normals of contacts, as far as they take"""
    FRICTION = "friction"
    """Impulses along the surfaces of contacts, as far as they take"""
    DRAG = "drag"
    """Air, and wind, which may bring some"""
    DAMPING = "damping"
    """Dampers of springs"""
    JOINTS = "joints"
    """What holds joints, as far as it takes: ideally nothing"""
    KICKS = "kicks"
    """What surfaces that kick add to a rebound: bumpers, slingshots"""
    DRIVES = "drives"
    """Thrusts, motors, steady forces, hands; zones: whom they stop, and what their gravity gives beyond the world's"""
    CORRECTION = "position correction"
    """Positions that are shifted to undo overlaps, or what is off in joints"""
    INTEGRATOR = "integrator"
    """Motion in steps: what the energy changed by, less the work of drag, dampers and drives; with how positions follow
    what contacts and joints do to velocities within a step"""
    PHANTOM = "phantom"
    """Energy given at once by what can only take: contacts, all together, or joints. Newton's restitution with friction
    gives some at the corners of polygons; so do iterations that end unconverged"""
    PARTED = "parted"
    """Stored in springs that broke"""
    ACTIONS = "actions"
    """Bodies added, moved or kicked, knobs turned, while the scene ran"""
    RETIRED = "retired"
    """Bodies that were removed, left the bounds, or had lived their time, with all they had"""


TAKES = frozenset({Cause.RESTITUTION, Cause.FRICTION, Cause.JOINTS})
"""Causes that can only take; whatever one of them gives at once is phantom energy."""


class Account:
    """Energy by cause since the account was opened, J."""

    def __init__(self) -> None:
        self._entries = dict.fromkeys(Cause, 0.0)

    def enter(self, cause: Cause, energy: float) -> None:
        """Book what a cause brought at once: one substep's sum, or one impact's."""
        self._entries[Cause.PHANTOM if energy > 0.0 and cause in TAKES else cause] += energy

    def touch(self, along: float, across: float) -> None:
        """Book what contacts brought at once, along their normals, kicks apart, and along their surfaces.

        Only both together can be said to take: an impulse along the normal of a corner changes how fast it slides.
        Where one of the two gives, that is set against what the other takes; phantom is what they give together.
        """
        both = along + across
        if both > 0.0:
            self.enter(Cause.PHANTOM, both)
        elif along > 0.0 or across > 0.0:
            self.enter(Cause.FRICTION if along > 0.0 else Cause.RESTITUTION, both)
        else:
            self.enter(Cause.RESTITUTION, along)
            self.enter(Cause.FRICTION, across)

    def add(self, cause: Cause, energy: float) -> None:
        """Book without asking who may give: the sum of another account, or what a cause has lent or gets back."""
        self._entries[cause] += energy

    def entries(self) -> Mapping[Cause, float]:
        """Return what each cause has brought so far, J, in the order of `Cause`."""
        return dict(self._entries)
