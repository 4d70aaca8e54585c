"""Energy ledger: changes of the energy of a running scene, by cause.

    start + sum over all causes = end + residual

Accounting starts with the first call of `Simulation.account`; it is off and costs nothing before that. The entry of a
cause is its energy change since then, J, negative where it removed energy. Entries are computed from the effect of each
cause (impulses times velocities, forces along displacements), never as a remainder, so that the residual is a true
check. Only INTEGRATOR is a remainder, of free motion alone: its energy change minus the work of the forces that act.

All causes within a substep act at the same time. The work of an impulse is the impulse times the mean of the velocities
at the two ends of the substep, so that a resting body has no entries, though in each substep gravity accelerates it
down and its support stops it.
"""

from collections.abc import Mapping
from enum import StrEnum


class Cause(StrEnum):
    """A cause of energy changes in a scene."""

    RESTITUTION = "restitution"
    """normal impulses of contacts, as far as they remove energy"""
    FRICTION = "friction"
    """tangential impulses of contacts, and friction of tyres, as far as they remove energy"""
    ROLLING = "rolling resistance"
    """torques that resist rolling"""
    DRAG = "drag"
    """air drag, where wind may add energy, and `world.damping`"""
    LIQUID = "liquid"
    """buoyancy, and the drag of liquids, which may add energy in a current"""
    DAMPING = "damping"
    """dampers of springs"""
    JOINTS = "joints"
    """joint impulses, as far as they remove energy; ideally 0"""
    KICKS = "kicks"
    """kicks of walls and posts, as of bumpers and slingshots"""
    DRIVES = "drives"
    """thrusts, engines of tyres, drives, motors, moving surfaces; forces and pulls by actions; zones that hold a body
    or have gravity"""
    SPEED_LIMITS = "speed limits"
    """speeds and angular speeds reduced to their limits"""
    CORRECTION = "position correction"
    """position changes that correct overlaps and joints"""
    INTEGRATOR = "integrator"
    """error of the time step: energy change of free motion, minus the work of drag, dampers and drives, and of the
    positions that follow from velocities changed within a step"""
    PHANTOM = "phantom"
    """energy added by contacts or joints, which can only remove energy: by Newton's law of restitution with friction at
    corners of polygons, or by iterations that have not converged"""
    PARTED = "parted"
    """energy stored in springs that broke"""
    ACTIONS = "actions"
    """actions that add, move or kick bodies or set parameters"""
    RETIRED = "retired"
    """energy of bodies that were removed, left the bounds or reached the end of their lifetime"""


DISSIPATIVE = frozenset({Cause.RESTITUTION, Cause.FRICTION, Cause.JOINTS})
"""Causes that can only remove energy. Energy that one of them adds at once is phantom energy."""


class EnergyLedger:
    """Energy by cause since accounting was switched on, J."""

    def __init__(self) -> None:
        self._entries = dict.fromkeys(Cause, 0.0)

    def add(self, cause: Cause, energy: float) -> None:
        """Add the energy change by a cause as one sum for a substep or impact; an impossible gain is phantom energy."""
        self._entries[Cause.PHANTOM if energy > 0.0 and cause in DISSIPATIVE else cause] += energy

    def add_contacts(self, normal: float, tangential: float) -> None:
        """Add the normal (without kicks) and tangential energy change by contacts, each as one sum.

        Only the sum of the two is known to be a loss: an impulse along the normal of a corner changes how fast it
        slides. A gain of one is set off against the loss of the other; a gain of the sum is phantom energy.
        """
        both = normal + tangential
        if both > 0.0:
            self.add(Cause.PHANTOM, both)
        elif normal > 0.0 or tangential > 0.0:
            self.add(Cause.FRICTION if normal > 0.0 else Cause.RESTITUTION, both)
        else:
            self.add(Cause.RESTITUTION, normal)
            self.add(Cause.FRICTION, tangential)

    def add_unchecked(self, cause: Cause, energy: float) -> None:
        """Add an energy change without the check for phantom energy: of another ledger, or of stored energy."""
        self._entries[cause] += energy

    def entries(self) -> Mapping[Cause, float]:
        """Return the energy change by each cause so far, J, in the order of `Cause`."""
        return dict(self._entries)
