"""Calm: how long nothing has touched in a session, and whether that is long enough for a checkpoint."""

from sandbox.engines.switching import SwitchableSimulation
from sandbox.play.running.rest import at_rest
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame

LEAST = 8
"""Substeps without contact before a checkpoint is made; engines remember parted contacts for 3 by default."""


class Calm:
    """The time since the last contact, in substeps."""

    def __init__(self) -> None:
        self._substeps = 0

    def look(self, contacts: Contacts, settings: Settings) -> None:
        """Take in the contacts of what was last seen."""
        self._substeps = 0 if len(contacts) else self._substeps + settings.substeps

    def lasts(self, relay: SwitchableSimulation, frame: Frame) -> bool:
        """Tell whether from the present state of a relay one can go on as if it had never been left."""
        if self._substeps < max(LEAST, 2 * (relay.settings.persistence or 1)):
            return False
        # A state in mid-roll does not tell when the roll began: the way on differs by roundings.
        return relay.scene.surface is None or at_rest(frame)
