"""Interface between a scene and the engine that computes it.

    ENGINES[name].start(scene, settings) -> Simulation
    simulation.step() … frame() … contacts() … close()

A new engine is one folder that implements these two protocols, and one line in the registry.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol, TypeAlias, TypeVar, runtime_checkable

if TYPE_CHECKING:  # importing an engine must stay cheap
    from sandbox.action import Action
    from sandbox.arrays import BoolArray, FloatArray, IntArray
    from sandbox.engines.energy_ledger import Cause
    from sandbox.frame_table import FrameTable
    from sandbox.scene.compile.bodies import Bodies
    from sandbox.scene.compile.demands import Demand
    from sandbox.scene.compile.scene import Scene
    from sandbox.scene.compile.setup import Setup
    from sandbox.scene.description.fixed import PlaneReach
    from sandbox.scene.description.world import Settings
    from sandbox.trajectory import Contacts, Frame


class Refusal(Exception):  # noqa: N818, a refusal is an answer, not an error of the engine
    """An engine does not support something that the scene or a setting needs.

    Attributes:
        engine: name of the engine.
        reasons: each unsupported demand or setting.
        able: names of the engines that can run the scene.
    """

    def __init__(self, engine: str, reasons: tuple[str, ...], able: tuple[str, ...]) -> None:
        others = f"engines that can: {', '.join(able)}" if able else "no engine can run the scene with these settings"
        super().__init__(f"{engine} refuses: {'; '.join(reasons)}; {others}")
        self.engine = engine
        self.reasons = reasons
        self.able = able


class Divergence(Exception):  # noqa: N818, a result of the physics, not an error of the program
    """The state is no longer finite, or exceeds the bounds on position and speed.

    The simulation can still be read, but not stepped.

    Attributes:
        time: simulated time, s.
        body: name of the body.
        what: description of its state.
    """

    def __init__(self, time: float, body: str, what: str) -> None:
        super().__init__(f"at {time:g} s: {body!r} {what}")
        self.time = time
        self.body = body
        self.what = what


class Exhaustion(Exception):  # noqa: N818, as above
    """A step needs more memory or work than its limit, or an event of the scene cannot be applied.

    The simulation can still be read, but not stepped.
    """


class SnapshotError(TypeError):
    """The engine cannot copy its state."""


class Timekeeper(Protocol):
    """Has a simulated time."""

    @property
    def time(self) -> float:
        """Simulated time, s."""


Running = TypeVar("Running", bound=Timekeeper)


class StateSnapshot(Generic[Running]):
    """State of a simulation at one time. It does not change, and can be continued any number of times."""

    def __init__(self, simulation: Running) -> None:
        """Copy a simulation.

        Raises:
            SnapshotError: the engine cannot copy its state.
        """
        self._copy = copy.deepcopy(simulation)
        self.time = simulation.time
        """s, simulated time"""

    def __repr__(self) -> str:
        return f"<StateSnapshot at {self.time:g} s of {self._copy!r}>"

    def resumed(self) -> Running:
        """Return a new simulation that continues from the state, without an observer."""
        return copy.deepcopy(self._copy)


Observer: TypeAlias = "Callable[[float, FloatArray, FloatArray, IntArray], None]"
"""Callback after each substep: its start time (s), the centres of mass (N, 2) at its start and end, and the pairs (K,
2) that the engine found in contact at its end, with the indices of `Contacts`."""


PairRuns: TypeAlias = "Sequence[tuple[int, IntArray]]"
"""Pairs (K, 2) in contact at the end of successive substeps. Each entry has the pairs of one or more of them, and the
number of the substep after the last that has them."""


@runtime_checkable
class PathObserver(Protocol):
    """Observer that can also take many substeps at once."""

    def __call__(self, time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
        """Take one substep, as `Observer`."""

    def observe_path(self, times: FloatArray, path: FloatArray, pairs: PairRuns) -> None:
        """Take B substeps, during which no action was applied.

        Args:
            times: (B,) s, start of each.
            path: (B + 1, N, 2) m, centres before the first and after each.
            pairs: pairs in contact at the end of each.
        """


class Members(NamedTuple):
    """States of M independent runs of a scene with N bodies."""

    position: FloatArray
    """(M, N, 2) m, centres of mass"""
    velocity: FloatArray
    """(M, N, 2) m/s"""
    angle: FloatArray
    """(M, N) rad"""
    angular_velocity: FloatArray
    """(M, N) rad/s"""


@runtime_checkable
class MemberRunner(Protocol):
    """Simulation that can run its scene from many starts, faster than one after the other."""

    def run_members(self, members: Members, steps: float, is_stopped: Callable[[], bool]) -> BoolArray:
        """Run the scene from each start, and write the end states in their place. The simulation is not changed.

        It must be at its start. Several threads may call it at once.

        Args:
            members: start states; replaced by those at the end.
            steps: duration in time steps dt; may end with a fraction of one.
            is_stopped: called at intervals; once it is true, the runs that are left are not computed.

        Returns:
            (M,) whether each was computed; of the others, the states are the start states. They need an ordinary run,
            which may also refuse the start or fail.
        """


class WorldStates(NamedTuple):
    """States of M independent worlds of a scene with N bodies and F static elements, as they are after their last step.

    The arrays are those of the worlds, which the next call changes.
    """

    time: FloatArray
    """(M,) s"""
    previous_time: FloatArray
    """(M,) s, before the last step"""
    now: Members
    previous: Members
    """before the last step"""
    present: BoolArray
    """(M, N) whether each body is in the scene"""
    touched: BoolArray
    """(M, N, N + F) whether a body touched another body, or the static element numbered −1 − k in column N + k, in the
    last step; a contact that was open before it counts too, as in `Simulation.contacts`"""
    diverged: BoolArray
    """(M,) whether the last step ended with a body that is not finite or out of bounds"""


class WorldBatch(Protocol):
    """Independent worlds of one scene, which one compiled call advances.

    A world can be advanced until a body is removed or its state diverges. What happens in it is what happens in a
    simulation of its own, bit for bit.
    """

    thrust_level: FloatArray
    """(M, T) level of each thrust of the scene in each world; may be changed between two calls"""
    states: WorldStates

    def restart(self, worlds: IntArray, start: Members) -> None:
        """Set worlds, by their (K,) indices, to time 0 and start states of K members."""

    def advance(self, steps: IntArray) -> IntArray:
        """Advance each world by at most so many steps, (M,); return the numbers made.

        A step with a contact, a removed body or a divergence is the last one of its world.
        """

    def divergence(self, world: int) -> Divergence:
        """Return the description of a diverged state."""


@runtime_checkable
class HasWorldBatch(Protocol):
    """Simulation that can compute many worlds of its scene in one compiled call."""

    def world_batch(self, count: int) -> WorldBatch | None:
        """Return so many worlds, with thrusts at their initial levels; None if the scene needs more than they model.

        Args:
            count: number of worlds, at least 1.
        """


class Simulation(Protocol):
    """Running scene. Its state changes in place; the frames and contacts that it returns do not change."""

    patience: float | None
    """s, largest computing time of a step, after which it raises `Exhaustion`; engines check it where they can. None:
    unlimited"""

    @property
    def time(self) -> float:
        """Simulated time, s: k·dt."""

    @property
    def makes_whole_steps(self) -> bool:
        """Whether no step is shorter than dt, so that a run may end after its duration.

        An engine whose solver starts from the impulses of the last step may have no shorter step without harm.
        """

    @property
    def scene(self) -> Scene:
        """The scene, with all changes that actions have made."""

    @property
    def setup(self) -> Setup:
        """State from which the simulation started, with the changes that actions have made to its scene."""

    @property
    def settings(self) -> Settings:
        """The settings, with every default chosen by the engine filled in."""

    @property
    def bodies(self) -> Bodies:
        """Bodies at their start as arrays; spawned bodies are appended."""

    @property
    def retired(self) -> Mapping[int, float]:
        """Time in s, by body index, at which bodies were removed, left `world.bounds` or ended their lifetime."""

    @property
    def broken(self) -> Mapping[int, float]:
        """Time in s, by index in `setup.joints`, at which joints broke."""

    @property
    def plane_reach(self) -> PlaneReach | None:
        """Present extent of half-planes as (x, y, distance), m; None if they are infinite."""

    @property
    def work(self) -> Mapping[str, int]:
        """Work counters since the start. They are deterministic: equal on every machine and at every repeat.

        An engine has those of the following that apply to it:

        - `substeps`: solver steps, including a shortened last one;
        - `broad_tests`: tests of pairs in the broad phase;
        - `pair_tests`: tests of pairs for contact, or for their time of impact;
        - `contacts`: contacts found in these tests; a lasting contact counts at every test;
        - `contact_iterations`, `joint_iterations`: contacts and joints that the solver visited, over all iterations;
        - `events`, `predictions`: of an event-driven engine, its events and the predictions of the next event.
        """

    def step(self) -> None:
        """Advance by one time step dt.

        Raises:
            Divergence: the state is not finite, or exceeds the bounds.
            Exhaustion: the step needs more memory or work than its limit.
        """

    def advance(self, steps: int, frames: FrameTable, *, until_event: bool = False) -> None:
        """Advance by at most so many time steps dt, and record the frames that are due.

        Frames, contacts and all other results are those of as many calls of `step`, bit for bit. It may return early,
        after at least one step; `frames.steps` has the number of steps made, also after an exception.

        Args:
            steps: largest number of steps, at least 1.
            frames: table with a row for each frame that becomes due, and with columns for all bodies.
            until_event: whether no step but the last may have contacts or remove bodies. An engine that cannot look
                ahead makes one step.

        Raises:
            Divergence, Exhaustion: as `step`; the step that raised is not counted, and has no frame.
        """

    def finish(self, part: float) -> None:
        """Advance by a last fraction of dt, for a duration that is not a multiple of dt. No step can follow.

        With `makes_whole_steps` the step is a whole one, and the time is beyond the duration.

        Args:
            part: fraction of dt, 0 < part < 1.

        Raises:
            Divergence: as `step`.
            ValueError: `part` is out of range.
        """

    def apply(self, action: Action) -> None:
        """Apply an action at once. Its `time` is ignored.

        Args:
            action: the action.

        Raises:
            ActionError: the action cannot be applied. The simulation is left unchanged.
        """

    def frame(self) -> Frame:
        """Return the present state."""

    def contacts(self) -> Contacts:
        """Return the contacts that were open since the last call, with the impulses exchanged since then.

        A lasting contact keeps the time of its first touch, by which it can be identified. Recording starts with the
        first call, which returns the present contacts. It costs nothing before that.
        """

    def account(self) -> Mapping[Cause, float]:
        """Return the energy change, J, by each cause since the first call; negative where energy was removed.

        Energy accounting is off until the first call, which returns zeros, and costs nothing before that. It does not
        change the state. The sum over the causes is the change of the energy of `common.energy_balance.energy_of` up to
        a residual; in the `exact` and `reference` engines that residual is rounding error.
        """

    def watch(self, observer: Observer) -> None:
        """Register an observer that is called after every substep. Engines without steps never call it."""

    def state_hash(self) -> str:
        """Return a hash of the time and of the exact state of every body."""

    def snapshot(self) -> StateSnapshot[Any]:
        """Return a copy of the whole state, also of contacts, contact log and energy account, but not of the observer.

        Raises:
            SnapshotError: the engine cannot copy its state.
        """

    def restore(self, snapshot: StateSnapshot[Any]) -> None:
        """Return to the state of a snapshot, from which the simulation continues as it did then, bit for bit.

        Args:
            snapshot: of this simulation, or of another one of the same engine; it can be restored any number of times.

        Raises:
            ValueError: the snapshot is that of another engine.
        """

    def close(self) -> None:
        """Release the resources of the engine."""


class Engine(Protocol):
    """Method to compute scenes. Importing it is cheap; `start` imports what the engine needs."""

    @property
    def name(self) -> str:
        """Name of the engine, as given to `--engine`."""

    @property
    def about(self) -> str:
        """One-line description."""

    @property
    def capabilities(self) -> frozenset[Demand]:
        """Demands that the engine models."""

    @property
    def knows_impulses(self) -> bool:
        """Whether contacts have impulses; if not, they are nan, and energy accounting is refused."""

    @property
    def epsilon(self) -> float:
        """Relative spacing of the numbers that it computes in: 2⁻⁵² for 64-bit numbers, 2⁻²³ for 32-bit numbers."""

    def missing(self, start: Scene | Setup, settings: Settings) -> tuple[str, ...]:
        """Return each demand and setting that the engine does not support; empty if it can run the scene."""

    def resolve(self, start: Scene | Setup, settings: Settings) -> Settings:
        """Return the settings with the engine's choice for every setting that is None."""

    def start(self, start: Scene | Setup, settings: Settings | None = None) -> Simulation:
        """Start a scene, or continue from a setup.

        Args:
            start: the scene or setup.
            settings: settings of the solver; default: the `[solver]` of the scene.

        Raises:
            Refusal: the engine does not support something that the scene or a setting needs.
        """
