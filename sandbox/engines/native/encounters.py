"""Encounters: who touches whom in a pymunk space, with impulses that add up."""

import pymunk

from sandbox.engines.native.laws import Laws
from sandbox.engines.native.memory import RememberedImpulses, without
from sandbox.engines.native.points import PointReader, Points
from sandbox.engines.native.reader import Reader
from sandbox.engines.native.revived import Revived
from sandbox.engines.touching import ComplexArray, Touching


class Encounters:
    """What a space tells of contacts. Until it is asked, nothing is looked at."""

    def __init__(self, space: pymunk.Space, reader: Reader, laws: Laws, things: int) -> None:
        self._space, self._reader, self._laws, self._things = space, reader, laws, things
        self._remembered: RememberedImpulses | None = None
        self._revived: Revived | None = None
        self._points: PointReader | None = None

    def touching(self, polygons: bool, single: bool, steady: bool) -> Touching | ComplexArray:
        """Return who touches whom now, and how; from the first call on, all impulses add up.

        Args:
            polygons: whether there are some, which may touch in two points.
            single: whether two touch in one place at most.
            steady: where it is who touched at the last call, in the same order, their impulses alone will do.
        """
        same = self._reader.look(polygons)
        if single and self._alone():
            if same and steady and self._revived is not None:
                return self._reader.impulses()
            found = self._reader.touching()
            if self._revived is None:
                self._revived = Revived(self._reader, self._things)
            elif same:
                return found
            return self._revived.correct(found)
        remembered = self._remembered or self._remember()
        if same and steady and remembered.pairs and not remembered.found:
            return self._reader.impulses()
        remembered.pairs = True
        found = self._reader.touching()
        ids, impulses = remembered.take()
        return without(found, self._reader.numbers(ids), impulses) if len(ids) else found

    def _alone(self) -> bool:
        """Tell whether listings tell all: nobody was remembered before the first, and pymunk is not asked already."""
        if self._remembered is not None and self._remembered.pairs:
            return False
        return self._revived is not None or not len(self._reader.cached())

    def _remember(self) -> RememberedImpulses:
        if self._remembered is None:
            self._remembered = RememberedImpulses(self._space)
        return self._remembered

    def points(self) -> Points:
        """Return the contact points of the last substep; from the first call on, their impulses add up."""
        if self._points is None:
            self._points = PointReader(self._space, self._remember(), self._laws)
        return self._points.read(self._reader.records)
