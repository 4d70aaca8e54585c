"""Form: what a closed form gives, of one body or of all of them at once."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from sandbox.arrays import FloatArray
from sandbox.measure.closed_form.given import Given
from sandbox.trajectory import ContactEvent


class Motion(NamedTuple):
    """Where a body is at T times, or N bodies are."""

    position: FloatArray
    """(T, 2) or (T, N, 2) m"""
    velocity: FloatArray
    """of the same shape, m/s; at the instant of an impact, that after it"""
    angle: FloatArray
    """(T,) or (T, N) rad"""
    spin: FloatArray
    """of the same shape, rad/s"""


class Form(Protocol):
    """What one body does, whatever the others do: nothing that moves can meet it or is joined to it."""

    @property
    def name(self) -> str:
        """The motion, in a word or two."""

    def at(self, time: FloatArray) -> Motion:
        """Return its motion at T times."""

    def contacts(self, until: float, shortest: float, /) -> list[ContactEvent]:
        """Return its contacts up to a time, s.

        Args:
            until: to when impulses add up.
            shortest: s; from the one on after which a flight would be shorter, contacts are one row that lasts.
        """


class Together(Protocol):
    """What all bodies do that meet each other."""

    @property
    def name(self) -> str:
        """The motion, in a word or two."""

    def at(self, time: FloatArray) -> Motion:
        """Return the motion of all N bodies at T times."""

    def contacts(self, until: float, /) -> list[ContactEvent]:
        """Return the contacts up to a time, s, to which impulses add up."""


Recogniser = Callable[[Given, int], Form | None]
"""Returns a body's form where the scene alone guarantees it from start to end, else None."""
Assembler = Callable[[Given], Together | None]
"""Returns the form of all bodies where the scene alone guarantees it from the start, else None."""
