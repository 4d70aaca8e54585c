"""Plans: the list of runs that a command makes. Scenes, sweeps, seeds and engines multiply."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from sandbox.batch.sweep import parse_sweep, relabelled
from sandbox.engines.registry import USUAL
from sandbox.games.players import PlayerSpec
from sandbox.games.registry import has_rules
from sandbox.measure.run.sessions import read_session
from sandbox.measure.seeds import same_random_state
from sandbox.progress import Progress, ProgressCallback
from sandbox.recording import Recording
from sandbox.resource_limits import PLAN_MEMORY
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import Override, from_session, load
from sandbox.scene.files.overrides import AddressError, combinations, parse_assignment

MAX_FAILED = 100
"""Runs with faults after which planning stops and reports them: further ones would repeat the same faults."""
_BYTES_A_SCENE, _BYTES_AN_ELEMENT, _BYTES_A_BODY = 16_000, 4_000, 500
"""Upper bounds of the memory of a scene, measured: an element is a table of the file, a body may be generated."""

Values = tuple[tuple[str, Any], ...]
"""Keys of a scene and the values that they are set to."""


@dataclass(frozen=True)
class Job:
    """One run to be made: a scene with all values set, and an engine. Picklable."""

    label: str
    """the scene as the user named it"""
    scene: Scene
    engine: str
    actions: tuple[Any, ...] = ()
    point: Values = ()
    """the keys that are set or swept, with their values in this run"""
    recorded: bool = False
    """the job replays a recorded session"""
    state_hash: str | None = None
    """of the end of that session, if the run must reproduce it: same engine, nothing set"""
    player: PlayerSpec | None = None
    """player of the game; None if no game is played"""
    score: float | None = None
    """of that session, if the run must reproduce it"""
    seeds: int = 1
    """number of seeds that the job stands for: more than 1 if nothing in its scene is random"""


def plan(
    scenes: Sequence[tuple[str, str]],
    engines: Sequence[str] | None,
    overrides: Sequence[Override] = (),
    sweeps: Sequence[str] = (),
    seeds: int | None = None,
    player: PlayerSpec | None = None,
    progress: ProgressCallback | None = None,
) -> list[Job]:
    """Return all runs, in order: scene by scene, the last sweep changing fastest, then seeds, then engines.

    If nothing in a scene is random, all seeds are one run, with the first seed.

    Args:
        scenes: label and path of each; a `.json` is a recorded session.
        engines: names; None for the default: pymunk, or the engine of the session.
        overrides: `KEY=VALUE`, set in every run.
        sweeps: `KEY=A,B,C` or `KEY=LOW:HIGH:N[:log]`.
        seeds: run the seeds 1 to this; None for the seed of each scene.
        player: player of scenes whose game has rules; default: random, or the player of the session.
        progress: called with the progress.

    Raises:
        SceneError: scenes have faults, with or without the values set (each fault once), or a game cannot be played.
        AddressError: a sweep is malformed, or there would be too many runs.
    """
    axes: list[tuple[str, Sequence[Any]]] = [parse_sweep(sweep) for sweep in sweeps]
    seeding: Sequence[int | None] = [None] if seeds is None else range(1, seeds + 1)
    points = combinations(axes, len(seeding))
    planner = _Planner(overrides, [key for key, _ in axes], seeding, len(points) * len(seeding), player)
    set_values = [_assignment(override) for override in overrides]
    jobs: list[Job] = []
    for label, path in scenes:
        for point in points:
            variants, alike = planner.variants(label, path, point)
            for session, plays, where in variants:
                for engine in engines or (session.engine,):
                    played = session if engine == session.engine else session.on(engine)
                    state, score = (None, None) if overrides or where else (played.state_hash, played.score)
                    values = (*set_values, *where)
                    recorded = _is_recording(path)
                    job = Job(label, played.scene, engine, played.actions, values, recorded, state, plays, score, alike)
                    jobs.append(job)
            if progress is not None:
                progress(Progress(f"checking {label}: runs so far: {len(jobs):,}"))
    if planner.faults:
        raise SceneError(tuple(planner.faults))
    return jobs


class _Variant(NamedTuple):
    """A scene or session with the values of one point of the sweep and one seed."""

    session: Recording
    player: PlayerSpec | None
    where: Values
    """the swept values and the seed"""


class _Planner:
    """Loads each variant of the scenes, collects the faults, and bounds the memory of the plan."""

    def __init__(
        self,
        overrides: Sequence[Override],
        swept: Sequence[str],
        seeding: Sequence[int | None],
        count: int,
        player: PlayerSpec | None,
    ) -> None:
        self.faults: dict[Fault, None] = {}
        self._overrides, self._swept, self._seeding, self._player = overrides, swept, seeding, player
        self._count = count
        """number of variants of each scene"""
        self._failed = 0
        self._bytes = 0
        """memory of all scenes planned so far"""
        self._recordings: dict[str, Recording] = {}
        """recorded sessions by their path"""

    def variants(self, label: str, path: str, point: Values) -> tuple[list[_Variant], int]:
        """Return a scene with the values of a point, once per seed, and the number of seeds that each stands for.

        Raises:
            SceneError: `MAX_FAILED` variants have faults, or the plan takes too much memory.
        """
        found: list[_Variant] = []
        for seed in self._seeding:
            where = (*point, *(() if seed is None else (("world.seed", seed),)))
            try:
                session = self._load(path, where)
                plays = _player(session, path, self._player)
            except SceneError as error:
                self._add_faults(error)
                continue
            if len(found) == 1 and plays is None and same_random_state(found[0].session.scene, session.scene):
                return found, len(self._seeding)
            if len(found) < 2:  # the second shows that the seeds differ, so all others are planned with it
                self._reserve(label, session.scene, len(self._seeding) - 1 if found else 1)
            found.append(_Variant(session, plays, where))
        return found, 1

    def _load(self, path: str, where: Values) -> Recording:
        """Return a scene as a session without actions, or a recorded session, with values set.

        Raises:
            SceneError: it has faults.
        """
        overrides = (*self._overrides, *where)
        if not _is_recording(path):
            scene = load(path, overrides)
            return Recording(scene, USUAL, scene.solver, (), scene.world.duration)
        if path not in self._recordings:
            self._recordings[path] = read_session(path)
        recording = self._recordings[path]
        document = to_document(recording.whole_scene)
        document["solver"] = recording.settings.model_dump(mode="json", exclude_defaults=True)
        return replace(recording, scene=from_session(document, path, overrides))

    def _add_faults(self, error: SceneError) -> None:
        self.faults |= dict.fromkeys(relabelled(fault, self._swept) for fault in error.faults)
        self._failed += 1
        if self._failed == MAX_FAILED:
            raise SceneError(tuple(self.faults)) from None

    def _reserve(self, label: str, scene: Scene, copies: int) -> None:
        """Count the memory of a scene and its copies.

        Raises:
            SceneError: the plan takes too much.
        """
        before, each = self._bytes, _bytes_of(scene)
        self._bytes += each * copies
        if self._bytes > PLAN_MEMORY.value:
            subject = f"{self._count:,} runs of {len(scene.bodies):,} bodies take"
            reason = PLAN_MEMORY.refusal(subject, max(self._bytes, before + each * self._count))
            raise SceneError([Fault(label, None, "", str(reason))])


def _bytes_of(scene: Scene) -> int:
    """Return an upper bound of the memory of a scene, bytes."""
    elements = sum(len(part) for _, part in scene if isinstance(part, tuple))
    return _BYTES_A_SCENE + _BYTES_AN_ELEMENT * elements + _BYTES_A_BODY * len(scene.bodies)


def _assignment(override: Override) -> tuple[str, Any]:
    """Return the key and value of an override; `load` reports a malformed one."""
    try:
        return parse_assignment(override) if isinstance(override, str) else override
    except AddressError:
        return str(override), None


def _player(session: Recording, path: str, player: PlayerSpec | None) -> PlayerSpec | None:
    """Return the player; None if the scene has no game with rules.

    Raises:
        SceneError: the game cannot be played by that player.
    """
    is_requested = session.has_game if _is_recording(path) else player is not None
    if not has_rules(session.scene, on_request=is_requested):
        return None
    plays = PlayerSpec.from_recording(session) if _is_recording(path) else player or PlayerSpec()
    plays.start_game(session.scene, path)
    return plays


def _is_recording(path: str) -> bool:
    return path.lower().endswith(".json")
