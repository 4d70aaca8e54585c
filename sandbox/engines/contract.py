"""The contract between a scene and whatever computes it.

    ENGINES[name].start(scene, settings) -> Simulation
    simulation.step() … frame() … contacts() … close()

Adding an engine is one folder that honours these two protocols, and one line in the registry.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Protocol, TypeAlias

if TYPE_CHECKING:  # a contract is for reading; engines that only refuse should not pay for its nouns
    from sandbox.action import Action
    from sandbox.engines.account import Cause
    from sandbox.scene.bodies import Bodies
    from sandbox.scene.demands import Demand
    from sandbox.scene.model import Scene
    from sandbox.scene.settings import Settings
    from sandbox.trajectory import Contacts, FloatArray, Frame, IntArray


class Refusal(Exception):  # noqa: N818, an engine refuses; that is no error of its own
    """An engine lacks what a scene or a setting asks for. `reasons` names each thing, `able` who could."""

    def __init__(self, engine: str, reasons: tuple[str, ...], able: tuple[str, ...]) -> None:
        others = f"these could: {', '.join(able)}" if able else "no engine here could"
        super().__init__(f"{engine} refuses: {'; '.join(reasons)}; {others}")
        self.engine = engine
        self.reasons = reasons
        self.able = able


class Divergence(Exception):  # noqa: N818, a result of the physics asked for, not an error of the program
    """A simulation left what is finite and bounded. It can be read, not stepped further."""

    def __init__(self, time: float, body: str, what: str) -> None:
        super().__init__(f"at {time:g} s: {body!r} {what}")
        self.time = time
        self.body = body
        self.what = what


class Exhaustion(Exception):  # noqa: N818, as above
    """A simulation needs more memory or work than is reasonable. What it has can be read, but not stepped further."""


Observer: TypeAlias = "Callable[[float, FloatArray, FloatArray, IntArray], None]"
"""Called after each substep with its starting time (s), the centres (N, 2) at its start and end, and the pairs
(K, 2) that the engine found in contact at its end, numbered as in `Contacts`."""


class Simulation(Protocol):
    """A running scene. Everything that changes lives in here; all that comes out is a value."""

    patience: float | None
    """s that a step may take, where the engine can tell while it works; beyond, it is an `Exhaustion`. None: any"""

    @property
    def time(self) -> float:
        """Simulated time, s: k·dt."""

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""

    @property
    def settings(self) -> Settings:
        """The settings, with every choice filled in."""

    @property
    def bodies(self) -> Bodies:
        """The bodies by number, as they started; spawned ones join at the end."""

    @property
    def retired(self) -> Mapping[int, float]:
        """When each body that was removed, left world.bounds or had lived its time was gone: number → s."""

    @property
    def broken(self) -> Mapping[int, float]:
        """When each joint broke that did: its number in `scene.links` → s."""

    @property
    def work(self) -> Mapping[str, int]:
        """What was done so far, counted and not timed: the same on every machine, at every repeat.

        Of these, what the engine has and can tell:

        - `substeps`: solver steps, one that is cut short at the end included;
        - `broad_tests`: tests of the broad phase, whether two may be near;
        - `pair_tests`: tests of two for contact, or for when they will touch;
        - `contacts`: contacts found in them, one that lasts at every look anew;
        - `contact_iterations`, `joint_iterations`: contacts and joints that the solver visited, over all its passes;
        - `events`, `predictions`: of an event-driven engine, what happened, and how often it looked ahead.
        """

    def step(self) -> None:
        """Advance by one dt.

        Raises:
            Divergence: the state is not finite, or beyond all bounds.
            Exhaustion: the step asks for more than can be had.
        """

    def finish(self, part: float) -> None:
        """Advance by a last part of dt, 0 < part < 1, where a run's duration is no multiple of dt.

        No step can follow.

        Raises:
            Divergence: as `step`.
            ValueError: there is no such part.
        """

    def apply(self, action: Action) -> None:
        """Do what an action says, now; its time is the caller's affair.

        Raises:
            ActionError: it cannot be done. Nothing has changed then.
        """

    def frame(self) -> Frame:
        """Return the present state."""

    def contacts(self) -> Contacts:
        """Return the contacts that were open since the last call, with the impulse exchanged since then.

        One that lasts keeps the time of its first touch, so a caller knows it again. Recording starts with
        the first call, which returns those that touch now: who never asks pays nothing.
        """

    def account(self) -> Mapping[Cause, float]:
        """Return the energy, J, that each cause has brought since the first call; negative where it took some.

        The first call opens the account, which is empty then: who never asks pays nothing. It changes no state. The
        causes' sum is what the energy of `engines.energy.energy_of` changed by, but for a residual that is rounding
        in the engines written by hand.
        """

    def watch(self, observer: Observer) -> None:
        """Have an observer called after every substep. Engines without steps never call it."""

    def state_hash(self) -> str:
        """Return a hash of time and every body's state, bit for bit."""

    def close(self) -> None:
        """Release what the engine holds."""


class Engine(Protocol):
    """A way to compute scenes. Light to import: what is heavy is imported by `start`."""

    @property
    def name(self) -> str:
        """What `--engine` calls it."""

    @property
    def about(self) -> str:
        """One line."""

    @property
    def capabilities(self) -> frozenset[Demand]:
        """The demands that it models."""

    def missing(self, scene: Scene, settings: Settings) -> tuple[str, ...]:
        """Return what scene and settings ask for that this engine lacks; none means that it can run them."""

    def resolve(self, scene: Scene, settings: Settings) -> Settings:
        """Return the settings with every choice that was left to the engine filled in."""

    def start(self, scene: Scene, settings: Settings | None = None) -> Simulation:
        """Set a scene up; without settings, by its own `[solver]`.

        Raises:
            Refusal: the engine lacks something that is asked for.
        """
