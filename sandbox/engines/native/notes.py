"""Notes: what a pymunk run tells of contacts and of zones, from when it is first asked."""

from sandbox.engines.contact_log import ContactLog
from sandbox.engines.native.population import Population
from sandbox.engines.touching import Touching, joined
from sandbox.trajectory import Contacts, IntArray


class Notes:
    """Who touched whom, and who came into which zone, since it was last taken."""

    def __init__(self, population: Population, time: float) -> None:
        """Begin with what touches at a time, s; who is in a zone by then is told now, and at the end of the substep."""
        self._population = population
        self._log = ContactLog(len(population.scene.fixed_names), population.meeting.joints)
        self.contacts = 0
        """found so far, one that lasts at every look anew"""
        self.record(time, opening=True)

    def record(self, time: float, opening: bool = False) -> None:
        """Enter what touches at a time, s, and who has come into zones; who did at the opening lasts till the next."""
        felt, visiting, log = self._population.felt, self._population.visiting, self._log
        came = None if visiting is None else visiting.told(again=opening)
        steady = log.steady and came is None
        now = self._population.meeting.touching(steady) if felt is None else felt.told()
        if isinstance(now, Touching):
            log.record(time, now if came is None else joined(now, came))
            self.contacts += len(now.a)
        else:
            log.go_on(now)
            self.contacts += len(now)
        if came is not None:
            log.steady = False  # a note does not last: next time others touch

    def changed(self) -> None:
        """Take note that an action was done: a spawned body may have several pieces."""
        self._log.joints = self._population.meeting.joints

    def pairs(self) -> IntArray:
        """Return the pairs (K, 2) that touched when last recorded."""
        return self._log.pairs()

    def take(self) -> Contacts:
        """Return the contacts since the last call."""
        return self._log.take()
