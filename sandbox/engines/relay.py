"""Relay: a running scene that can change its engine, its settings and its cast while it runs.

Each leg is a simulation of its own, started from the state in which the last one ended; bodies keep their numbers
and time goes on. What engines remember beyond that state, such as the impulses of contacts that last, begins anew.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Self

from pydantic import ValidationError

from sandbox.action import Action, ActionError, Launch, Pull, SetParameter, Spawn, Switch, Throttle
from sandbox.engines.account import Cause
from sandbox.engines.checkpoint import Checkpoint
from sandbox.engines.contract import Divergence, Exhaustion, Observer, Refusal
from sandbox.engines.lasting import Lasting
from sandbox.engines.launch import launched
from sandbox.engines.leg import Leg, begun
from sandbox.engines.pull import Pulls
from sandbox.engines.registry import UnknownEngineError
from sandbox.engines.registry import start as start_engine
from sandbox.engines.succession import Succession
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Contacts, Frame


def start(scene: Scene, engine: str = "pymunk", settings: Settings | None = None) -> "Relay":
    """Start a scene on an engine, ready for every action.

    Raises:
        UnknownEngineError: no engine has that name.
        Refusal: the engine lacks something, with the engines that do not.
    """
    return Relay(scene, engine, settings)


class Relay:
    """A running scene, with an engine that can be exchanged. It is a `Simulation` like any other."""

    def __init__(self, scene: Scene, engine: str = "pymunk", settings: Settings | None = None) -> None:
        self.engine = engine
        """its name"""
        self.wanted = scene.solver if settings is None else settings
        """the settings as they were asked for; what they leave open is the engine's choice"""
        self._leg = Leg(start_engine(scene, engine, self.wanted), scene.bodies)
        self._retired: dict[int, float] = {}
        self._broken: dict[int, float] = {}
        self._work: Counter[str] = Counter()
        self._pulls = Pulls()
        self._lasting = Lasting()
        self._kept: list[Contacts] | None = None  # of earlier legs, since the last call; none before the first
        self._observer: Observer | None = None
        self._books = Succession()

    def checkpoint(self) -> Checkpoint:
        """Return what `resumed` goes on from."""
        return Checkpoint(
            scene=self.scene,
            engine=self.engine,
            wanted=self.wanted,
            bodies=self.bodies,
            frame=self.frame(),
            origin=self._leg.origin,
            steps=self._leg.steps,
            retired=dict(self.retired),
            broken=dict(self.broken),
            forces=self._acting().forces,
            throttles=self._lasting.throttles,
            pulls=self._pulls.pulls,
        )

    @classmethod
    def resumed(cls, point: Checkpoint) -> Self:
        """Go on from a checkpoint.

        In free flight that leads to the same states as going on without, bit for bit, wherever an engine's rule needs
        no more than the state. In contact it does not: what engines remember of contacts is not in it.

        Raises:
            Refusal: the engine cannot begin from there.
            ActionError: it cannot take over a steady force.
        """
        relay = cls.__new__(cls)
        relay.engine, relay.wanted = point.engine, point.wanted
        relay._lasting = Lasting(point.forces, point.throttles)
        lasting = relay._lasting.actions()
        relay._leg = begun(point.scene, point.engine, point.wanted, point.bodies, point.frame, lasting, point.broken)
        relay._leg.origin, relay._leg.steps = point.origin, point.steps
        relay._retired, relay._broken, relay._work = dict(point.retired), dict(point.broken), Counter()
        relay._kept, relay._observer, relay._books, relay._pulls = None, None, Succession(), Pulls(point.pulls)
        return relay

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._leg.time

    @property
    def patience(self) -> float | None:
        """How long a step may take, s, as far as an engine can tell while it works; `Exhaustion` beyond."""
        return self._leg.simulation.patience

    @patience.setter
    def patience(self, seconds: float | None) -> None:
        self._leg.simulation.patience = seconds

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""
        return self._leg.scene

    @property
    def settings(self) -> Settings:
        """The settings, with every choice filled in."""
        return self._leg.simulation.settings

    @property
    def bodies(self) -> Bodies:
        """The bodies by number, as they started; spawned ones join at the end."""
        return self._leg.bodies

    @property
    def retired(self) -> Mapping[int, float]:
        """When each body that was removed, left world.bounds or had lived its time was gone: number → s."""
        return MappingProxyType({**self._retired, **self._leg.retired})

    @property
    def broken(self) -> Mapping[int, float]:
        """When each joint broke that did: its number in `scene.links` → s."""
        return MappingProxyType({**self._broken, **self._leg.broken}) if self._broken else self._leg.broken

    @property
    def pulls(self) -> Mapping[str, Pull]:
        """The hands that hold bodies, by the bodies' names."""
        return self._pulls.pulls

    @property
    def throttles(self) -> Mapping[str, Throttle]:
        """The throttles that were set, by the names of their thrusts."""
        return self._lasting.throttles

    @property
    def work(self) -> Mapping[str, int]:
        """What was done so far, by all engines that took part."""
        total = Counter(self._work)
        total.update(self._leg.simulation.work)
        return dict(total)

    def step(self) -> None:
        """Advance by one dt.

        Raises:
            Divergence: the state is not finite, or beyond all bounds.
            Exhaustion: the step asks for more than can be had.
        """
        self._advance(1.0, self._leg.simulation.step)

    def finish(self, part: float) -> None:
        """Advance by a last part of dt, 0 < part < 1.

        Raises:
            Divergence: as `step`.
            ValueError: there is no such part.
        """
        self._advance(part, lambda: self._leg.simulation.finish(part))

    def _advance(self, part: float, advance: Callable[[], None]) -> None:
        """Let hands draw bodies, and the engine advance, by a part of a step."""
        simulation = self._leg.simulation
        if self._pulls.any:
            with self._books.hands(simulation):
                self._pulls.act(simulation, self.settings.dt * part)
        self._leg.steps += part
        try:
            advance()
        except Divergence as divergence:
            raise Divergence(self.time, divergence.body, divergence.what) from None
        except Exhaustion:
            self._leg.steps -= part
            raise

    def apply(self, action: Action) -> None:
        """Do what an action says, now; its time is the caller's affair.

        Raises:
            ActionError: it cannot be done. Nothing has changed then.
        """
        match action:
            case Pull():
                self._pulls.hold(action, self._leg.simulation)
            case Switch():
                self._switch(action)
            case Launch():
                frame, bodies, those = launched(action, self.scene, self.bodies, self.frame())
                retired = {n: time for n, time in self.retired.items() if not those[n]}
                self._hand_over(self.engine, self.wanted, bodies, frame, retired)
            case Spawn():
                self._spawn(action)
            case _:
                self._leg.simulation.apply(action)
                self._lasting.note(action)
                if isinstance(action, SetParameter):
                    self._leg.bodies = replace(self._leg.bodies, elements=self._leg.simulation.bodies.elements)

    def _spawn(self, action: Spawn) -> None:
        name = action.single.name or self.bodies.new_name("spawned", self.scene.fixed_names)
        if name in self.bodies.names:
            raise ActionError(f"a body or fixed thing is called {name!r} already")
        named = action.named(name)
        self._leg.simulation.apply(named)
        self._leg.joined_by(self.bodies.joined_by(named.single, name))

    def _switch(self, action: Switch) -> None:
        try:
            wanted = self.wanted.replace(**action.settings)
        except ValidationError as error:
            told = (f"solver.{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())
            raise ActionError("; ".join(told)) from None
        self._hand_over(action.engine or self.engine, wanted, self.bodies, self.frame(), dict(self.retired))

    def _hand_over(
        self, engine: str, wanted: Settings, bodies: Bodies, frame: Frame, retired: dict[int, float]
    ) -> None:
        """Start the next leg from a state.

        Raises:
            ActionError: the engine cannot go on from it. Nothing has changed then.
        """
        try:
            lasting, broken = self._acting().actions(), dict(self.broken)
            leg = begun(self.scene, engine, wanted, bodies, frame, lasting, broken)
        except (Refusal, UnknownEngineError) as refusal:
            raise ActionError(str(refusal)) from None
        with self._books.passing(self, leg.simulation):
            self._take_up(leg, retired, broken)
            self.engine, self.wanted = engine, wanted

    def _take_up(self, leg: Leg, retired: dict[int, float], broken: dict[int, float]) -> None:
        """Go on with a leg, and let the old one go."""
        old = self._leg
        if leg.simulation.settings.dt == old.simulation.settings.dt:  # so that frames go on to lie at k·dt
            leg.origin, leg.steps = old.origin, old.steps
        leg.simulation.patience = old.simulation.patience
        if self._kept is not None:
            self._kept.append(old.contacts())
            leg.simulation.contacts()
        self._work.update(old.simulation.work)
        self._retired, self._broken = retired, broken
        old.simulation.close()
        self._leg = leg
        if self._observer is not None:
            self._leg.watched_by(self._observer)

    def _acting(self) -> Lasting:
        """Return what acts on bodies that are there; on who has left it has ended."""
        if self._lasting.forces:
            present = zip(self.bodies.names, self.frame().present.tolist(), strict=True)
            self._lasting.leave(name for name, there in present if not there)
        return self._lasting

    def frame(self) -> Frame:
        """Return the present state."""
        return self._leg.frame()

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording.

        One that lasts while the engine is exchanged is a new contact after that.
        """
        kept, self._kept = self._kept or [], []
        found = self._leg.contacts()
        return Contacts.joined([*kept, found]) if kept else found

    def account(self) -> Mapping[Cause, float]:
        """Return the energy, J, that each cause has brought since the first call, over all engines that took part."""
        return self._books.entries(self._leg.simulation)

    def watch(self, observer: Observer) -> None:
        """Have an observer called after every substep."""
        self._observer = observer
        self._kept = self._kept or []
        self._leg.watched_by(observer)

    def state_hash(self) -> str:
        """Return a hash of time and every body's state, bit for bit."""
        return self.frame().state_hash()

    def close(self) -> None:
        """Release what the engine holds."""
        self._leg.simulation.close()
