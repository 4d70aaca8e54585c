"""Leg: one simulation of a relay, and how its numbers and times read in the whole."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from sandbox.action import ActionError, Force, Throttle
from sandbox.engines.checkpoint import cast, passing_in
from sandbox.engines.contract import Observer, Simulation
from sandbox.engines.registry import start as start_engine
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Contacts, FloatArray, Frame, IntArray


@dataclass(eq=False)
class Leg:
    """A simulation that began at some time, with those bodies that were there then.

    In the whole a body keeps its number; here they count anew, without those that were gone.
    """

    simulation: Simulation
    bodies: Bodies
    """all N, by the numbers of the whole"""
    before: Frame | None = None
    """the state in which it began, of the N bodies of that time; none for the first leg"""
    numbers: IntArray | None = None
    """(n,) the number in the whole of each of its bodies; none where they are the same"""
    origin: float = 0.0
    """when its steps begin to count, s"""
    steps: float = 0.0
    """that it has made since then; where a leg is taken up again, also those made before"""
    whole: Scene | None = None
    """what runs, with the bodies and joints of the whole; none for the first leg, which has them itself"""
    _told: tuple[Scene, Scene] | None = field(default=None, init=False)  # the simulation's, and as the whole has it

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since; with all bodies of the whole, as the leg began, and all joints."""
        own = self.simulation.scene
        if self.whole is None:
            return own
        if self._told is None or self._told[0] is not own:
            bodies = replace(self.whole.bodies, elements=own.bodies.elements)
            self._told = own, own.holding(bodies, self.whole.links, self.whole.began)
        return self._told[1]

    @property
    def broken(self) -> Mapping[int, float]:
        """When each joint broke that did in this leg: its number in the whole → s."""
        own = self.simulation.broken
        if self.before is None:
            return own
        number = self.simulation.scene.links.number
        return {int(number[k]): self._began + time for k, time in own.items()}

    @property
    def time(self) -> float:
        """Simulated time, s: counted in steps, so that a leg taken up again has the same times, bit for bit."""
        return self.origin + self.steps * self.simulation.settings.dt

    @property
    def _began(self) -> float:
        return 0.0 if self.before is None else self.before.time

    def joined_by(self, bodies: Bodies) -> None:
        """Take note that the simulation has one more body, the last of `bodies`."""
        if self.numbers is not None:
            self.numbers = np.append(self.numbers, len(bodies) - 1)
        self.bodies = bodies

    def frame(self) -> Frame:
        """Return the present state of all bodies."""
        frame = self.simulation.frame()
        if self.before is None:
            return frame
        if self.numbers is None:
            return replace(frame, time=self.time)
        count, known = len(self.bodies), len(self.before.position)
        position, velocity, angle, spin = np.zeros((count, 2)), np.zeros((count, 2)), np.zeros(count), np.zeros(count)
        present = np.zeros(count, np.bool_)
        position[:known], angle[:known] = self.before.position, self.before.angle  # where those who are gone were last
        for whole, own in (
            (position, frame.position),
            (velocity, frame.velocity),
            (angle, frame.angle),
            (spin, frame.angular_velocity),
        ):
            whole[self.numbers] = own
        present[self.numbers] = frame.present
        roll = None
        if frame.roll is not None:
            roll = np.zeros((count, 2))
            roll[self.numbers] = frame.roll
        layer = self._whole(frame.layer, self.bodies.layer, self.before.layer)
        visits = self._whole(frame.visits, np.zeros_like(self.bodies.visits))
        passing = frame.passing
        if passing is not None:
            passing = np.column_stack((self.numbers[passing[:, 0]], passing[:, 1]))
        return Frame(self.time, position, velocity, angle, spin, present, roll, layer, visits, frame.drives, passing)

    def _whole(self, own: IntArray | None, everyone: IntArray, before: IntArray | None = None) -> IntArray | None:
        """Return an array of the simulation with a row for everyone; who is gone is as before."""
        if own is None:
            return None
        everyone = everyone.copy()
        if before is not None:
            everyone[: len(before)] = before
        everyone[self.numbers] = own
        return everyone

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        found = self.simulation.contacts()
        if self.before is None:
            return found
        return replace(found, time=found.time + self._began, pair=self._numbered(found.pair))

    @property
    def retired(self) -> Mapping[int, float]:
        """When each body was gone that left in this leg: number → s."""
        own = self.simulation.retired
        if self.before is None:
            return own
        return {self._number(n): self._began + time for n, time in own.items()}

    def watched_by(self, observer: Observer) -> None:
        """Have an observer called after every substep."""
        if self.before is None:
            self.simulation.watch(observer)
            return

        def tell(time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
            observer(self._began + time, self._spread(start), self._spread(end), self._numbered(touching))

        self.simulation.watch(tell)

    def _number(self, own: int) -> int:
        return own if self.numbers is None else int(self.numbers[own])

    def _numbered(self, pair: IntArray) -> IntArray:
        """Return pairs (K, 2) as the whole has them; fixed things are called the same in every leg."""
        if self.numbers is None or not len(self.numbers):
            return pair
        return np.asarray(np.where(pair >= 0, self.numbers[np.maximum(pair, 0)], pair))

    def _spread(self, position: FloatArray) -> FloatArray:
        """Return the centres of all bodies, (N, 2); nan for those who are gone."""
        if self.numbers is None:
            return position
        everyone = np.full((len(self.bodies), 2), np.nan)
        everyone[self.numbers[: len(position)]] = position
        return everyone


def begun(
    scene: Scene,
    engine: str,
    wanted: Settings,
    bodies: Bodies,
    frame: Frame,
    lasting: Iterable[Force | Throttle],
    broken: Collection[int] = (),
) -> Leg:
    """Start a leg from a state.

    Args:
        scene: what runs, with the bodies and joints of the whole.
        engine: its name.
        wanted: settings.
        bodies: all, by the numbers of the whole.
        frame: the state.
        lasting: what acts from earlier on: steady forces, thrusts that were opened or closed.
        broken: numbers of the joints that hold no more.

    Raises:
        Refusal: the engine lacks something.
        ActionError: it cannot take over a steady force.
    """
    placed = scene.placed(cast(bodies, frame), frame.time, broken, frame.drives, passing_in(frame))
    simulation = start_engine(placed, engine, wanted)
    for each in lasting:
        try:
            simulation.apply(each)
        except ActionError as error:
            simulation.close()
            what = f"the steady force on {each.body!r}" if isinstance(each, Force) else f"the thrust {each.thrust!r}"
            raise ActionError(f"{engine} cannot go on with {what}: {error}") from None
    numbers = None if frame.present.all() else np.flatnonzero(frame.present)
    columns = ("position", "velocity", "angle", "angular_velocity")
    everyone = replace(bodies, **{column: getattr(frame, column) for column in columns})
    if frame.roll is not None:
        everyone = replace(everyone, roll=frame.roll)
    if frame.layer is not None:
        everyone = replace(everyone, layer=frame.layer)
    if frame.visits is not None:
        everyone = replace(everyone, visits=frame.visits)
    whole = scene.holding(everyone, scene.links, frame.time)
    return Leg(simulation, bodies, frame, numbers, frame.time, whole=whole)
