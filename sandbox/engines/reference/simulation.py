"""ReferenceSimulation: a scene running on the hand-written solvers, one fixed step after the other."""

from collections.abc import Mapping

import numpy as np

from sandbox.action import Action, ActionError, Spawn
from sandbox.engines.account import Cause
from sandbox.engines.acting import perform
from sandbox.engines.contact_log import ContactLog
from sandbox.engines.contract import Divergence, Exhaustion, Observer
from sandbox.engines.kernel import tell_if_slow
from sandbox.engines.limits import BEYOND
from sandbox.engines.reference.detection import DETECTIONS
from sandbox.engines.reference.engine import BALLS_ALONE
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.motion import State
from sandbox.engines.reference.stage import Stage
from sandbox.engines.reference.zoned_roster import ZonedRoster
from sandbox.engines.roster import Roster
from sandbox.engines.running import Running
from sandbox.engines.touching import NOTHING, Touching, joined
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Disc, Scene, Single
from sandbox.scene.settings import Settings
from sandbox.scene.surfaces import bearers_of
from sandbox.trajectory import Contacts, FloatArray, Frame, IntArray

ROUNDING = 1e-12
"""Less than this share of the contact distance is no overlap, less than this share of the speed no kick."""


class ReferenceSimulation(Running):
    """A running scene. A substep reads as the tutorial's: apply forces, advance, detect and resolve.

    Zones look where centres are at its end: how late one notes who comes in depends on the substep, whatever is chosen.
    """

    def __init__(self, scene: Scene, settings: Settings) -> None:
        assert settings.detection is not None
        super().__init__(settings)
        self._zoned = ZonedRoster(scene, settings.h) if scene.zones else None
        self._roster = self._zoned or Roster(scene, settings.h)
        self._stage = Stage(self._roster, settings)
        self._advance = DETECTIONS[settings.detection]
        self._ledger: ContactLog | None = None
        self._observer: Observer | None = None
        self._now = NOTHING  # what touched when last recorded
        self._came: Touching | None = None  # who was in zones when the recording began
        tell_if_slow(len(scene.bodies))

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""
        return self._roster.scene

    @property
    def bodies(self) -> Bodies:
        """The bodies by number, as they started; spawned ones join at the end."""
        return self._roster.bodies

    @property
    def retired(self) -> Mapping[int, float]:
        """When each body that is no longer there was gone: number → s."""
        return self._roster.retired

    @property
    def broken(self) -> Mapping[int, float]:
        """When each joint broke that did: its number in `scene.links` → s."""
        return self._roster.broken

    @property
    def work(self) -> Mapping[str, int]:
        """What was done so far, all that the contract names but events."""
        return {"substeps": self.substeps, **self._stage.finder.work}

    def step(self) -> None:
        """Advance by one dt.

        Raises:
            Divergence: a body is no longer finite, or beyond all bounds. The state can still be read.
            Exhaustion: a substep would have to be cut into too many pieces, or contacts outgrow memory.
        """
        with self._turn, np.errstate(all="ignore"):
            self._check_running()
            for k in range(self._settings.substeps):
                begin = self._steps * self._settings.dt + k * self._settings.h
                self._substep(begin, self._settings.h)
                self._stage.tear(self._settings.h, self._after(k + 1))
                if self._zoned is not None:
                    self._visit(begin + self._settings.h, self._zoned)
            self._steps += 1
            self._settle()

    def finish(self, part: float) -> None:
        """Advance by a last part of dt, 0 < part < 1: whole substeps, then one that is as long as is left.

        Raises:
            Divergence: as `step`.
            ValueError: there is no such part.
        """
        self._check_part(part)
        with self._turn, np.errstate(all="ignore"):
            self._check_running()
            whole, rest = divmod(part * self._settings.substeps, 1.0)
            begin, h = self._steps * self._settings.dt, self._settings.h
            for k in range(int(whole)):
                self._substep(begin + k * h, h)
                self._stage.tear(h, self._after(k + 1))
                if self._zoned is not None:
                    self._visit(begin + k * h + h, self._zoned)
            if rest > 0.0:
                self._substep(begin + whole * h, rest * h)
            self._part = part
            if rest > 0.0:
                self._stage.tear(rest * h, self.time)
                if self._zoned is not None:
                    self._visit(self.time, self._zoned)
            self._settle()
            self._ended = True

    def _substep(self, time: float, h: float) -> None:
        """Advance by h under the forces that apply: advance, detect and resolve, in the chosen detection's way.

        Which forces apply (`Stage.apply_forces`) changes only when an action does something, not from step to step.
        """
        self._stage.time = time
        try:
            self._advance(self._stage, h)
        except Exhaustion:
            self._ended = True
            raise

    def _visit(self, time: float, roster: ZonedRoster) -> None:
        """Let zones do what they do, and note at a time, s, who came in."""
        self._stage.visit(roster)
        came = roster.visiting.told()
        if self._ledger is not None and came is not None:  # else it is nobody's concern
            # What touches has been entered with its impulses: it goes on, beside the notes.
            lasting = self._now._replace(impulse=np.zeros_like(self._now.impulse))
            self._ledger.record(time, joined(lasting, came))

    def _settle(self) -> None:
        """Write the state down, stop what is no longer finite and bounded, retire whose time is up."""
        self._stage.leave()
        beyond = self._roster.beyond()
        if beyond is not None:
            self._ended = True
            raise Divergence(self.time, self.bodies.names[beyond], BEYOND)
        going = self._roster.going(self.time)
        if len(going):
            self._take_out(going)

    def _take_out(self, numbers: IntArray) -> None:
        with self._stage.books.doing(Cause.RETIRED):
            self._roster.take_out(numbers, self.time)
            self._stage.enter()

    def apply(self, action: Action) -> None:
        """Do what an action says, now.

        Raises:
            ActionError: it cannot be done. Nothing has changed then.
        """
        with self._turn:
            self._check_running()
            if isinstance(action, Spawn):
                self._check_shape(action.single)
            with self._stage.books.doing(Cause.ACTIONS):
                leaving = perform(action, self._roster)
                self._stage.enter()
            if leaving is not None:
                self._take_out(np.asarray([leaving]))

    def _check_shape(self, single: Single) -> None:
        """Refuse a body that the chosen detection or response knows nothing of.

        Raises:
            ActionError: it does not.
        """
        if self._settings.detection == "swept" and single.collides != "none" and not isinstance(single, Disc):
            raise ActionError(BALLS_ALONE)
        if self._settings.response == "penalty" and _falls_off(single, self.scene):
            raise ActionError("penalty springs have no restitution that falls with speed; response 'impulse' has")

    def frame(self) -> Frame:
        """Return the present state."""
        r = self._roster
        position, velocity, angle, spin = (a.copy() for a in (r.position, r.velocity, r.angle, r.angular_velocity))
        layer = r.layer.copy() if len(r.scene.layers) > 1 else None
        visits = r.visits.copy() if r.scene.zones else None
        drives = r.drives.copy() if len(r.drives) else None
        present, passing = r.present.copy(), self._stage.passing
        return Frame(self.time, position, velocity, angle, spin, present, None, layer, visits, drives, passing)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        if self._ledger is None:
            self._ledger = ContactLog(len(self._roster.scene.fixed_names), joints=True)
            self._stage.witness = self._witness
            overlaps = self._stage.overlaps(self._stage.x)
            now = _touching(overlaps, np.zeros((overlaps.size, 2)))
            if self._zoned is not None:  # who is in a zone is told now, and with the first substep
                self._came = self._zoned.visiting.told()
            self._ledger.record(self.time, now if self._came is None else joined(now, self._came))
        return self._ledger.take()

    def account(self) -> Mapping[Cause, float]:
        """Return the energy, J, that each cause has brought since the first call."""
        return self._stage.open_account().entries()

    def watch(self, observer: Observer) -> None:
        """Have an observer called after every substep, and at every impact within one; this records contacts too."""
        if self._ledger is None:
            self.contacts()
        self._observer = observer

    def _witness(
        self, start: float, end: float, before: State, after: State, contacts: Manifolds, impulse: FloatArray
    ) -> None:
        assert self._ledger is not None
        self._now = now = _touching(*_real(contacts, impulse, after[1], self._roster.inverse_mass))
        came, self._came = self._came, None
        self._ledger.record(end, now if came is None else joined(now, came))
        if self._observer is not None:
            # The observer may keep what it is given: these arrays are never written to again.
            centres = self._stage.centres
            self._observer(start, centres(before), centres(after), self._ledger.pairs())


def _falls_off(single: Single, scene: Scene) -> bool:
    """Tell whether restitution falls with speed at some contact of a body that is to be added."""
    own = {bearer.material for bearer in bearers_of((single,))}
    figures = [bearer.restitution_falloff for bearer in bearers_of((single,))]
    figures += [material.restitution_falloff for material in scene.materials if material.name in own]
    figures += [pair.restitution_falloff for pair in scene.pairs if own.intersection(pair.between)]
    return any(figures)


def _real(
    contacts: Manifolds, impulse: FloatArray, rates: FloatArray, inverse_mass: FloatArray
) -> tuple[Manifolds, FloatArray]:
    """Leave out what overlaps and pushes by rounding alone: two that go side by side after an impact."""
    if not contacts.size:
        return contacts, impulse
    first, second = contacts.first, contacts.second
    speed = np.hypot(rates[:, 0], rates[:, 1])
    # What is fixed has no speed and no inverse mass of its own: the first of the pair stands in, and changes nothing.
    other = np.where(second >= 0, second, first)
    kick = np.hypot(impulse[:, 0], impulse[:, 1]) * np.maximum(inverse_mass[first], inverse_mass[other])
    real = contacts.separation < -ROUNDING * contacts.arm.sum(axis=1)
    real |= kick > ROUNDING * (speed[first] + speed[other])
    return (contacts, impulse) if real.all() else (contacts.of(real), impulse[real])


def _touching(contacts: Manifolds, impulse: FloatArray) -> Touching:
    """Return contacts as the ledger takes them: complex numbers, the impulse on the first."""
    if not contacts.size:
        return NOTHING
    normal = contacts.normal[:, 0] + 1j * contacts.normal[:, 1]
    point = contacts.point[:, 0] + 1j * contacts.point[:, 1]
    given = normal * (impulse[:, 0] + 1j * impulse[:, 1])
    return Touching(contacts.first.copy(), contacts.second.copy(), -given, normal, point)
