"""Plans: the runs that a command makes. Scenes, sweeps, samples, seeds and engines multiply.

A plan is expanded while it is run: it holds the axes and the text of each scene, and a run is made from its number, so
that a plan of 10⁷ runs takes no more memory than one of ten. Before the first run, every value of every axis is
checked, and up to `MAX_CHECKED` scenes completely.
"""

import hashlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from sandbox.batch.job import Job, RunOptions, Values
from sandbox.batch.member_runs import Member, MemberTask
from sandbox.batch.start_states import is_start_key
from sandbox.batch.stored_run import hash_of
from sandbox.batch.sweep import SweepAxis, relabelled
from sandbox.echo import short_count
from sandbox.engines.registry import USUAL
from sandbox.games.players import PlayerSpec
from sandbox.games.registry import has_rules
from sandbox.measure.run.sessions import read_session
from sandbox.measure.seeds import same_random_state
from sandbox.progress import Progress, ProgressCallback
from sandbox.provenance import versions
from sandbox.recording import Recording
from sandbox.resource_limits import PLAN_MEMORY, RUNS
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.game_tables import has_preset
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import Override, SceneText, from_session
from sandbox.scene.files.overrides import AddressError, parse_assignment

MAX_FAILED = 100
"""Runs with faults after which planning stops and reports them: further ones would repeat the same faults."""
MAX_CHECKED = 10_000
"""Scenes that are checked before the first run, 0.5 ms each. In a larger plan, only those of one axis at a time are."""
MAX_FAMILY_CHECKED = 100
"""Likewise where runs may be members of one task, which takes a fraction of that time each"""
MAX_AXIS_CHECKED = 1_000
"""Values of an axis that are then checked, the first ones."""
_BYTES_A_SCENE, _BYTES_AN_ELEMENT, _BYTES_A_BODY = 16_000, 4_000, 500
"""Upper bounds of the memory of a scene, measured: an element is a table of the file, a body may be generated."""


@dataclass
class PlannedRun:
    """A run of a plan, whose scene is read when it is needed."""

    label: str
    """the scene as the user named it"""
    engine: str
    values: Values
    """the keys that are set, swept or sampled, with their values in this run"""
    plan_key: str | None
    """hash of the scene file, the engine, the values and the versions; None if they do not determine the run"""
    _variant: "_Variant"
    _seeds: int
    family: str | None = None
    """runs of one family differ in start values only, so that they may be members of one task; None for others"""

    def job(self) -> Job:
        """Return the job.

        Raises:
            SceneError: the scene has faults with these values, or its game cannot be played.
        """
        variant, plan = self._variant, self._variant.plan
        session, player = variant.session, variant.player
        played = session if self.engine == session.engine else session.on(self.engine)
        is_changed = bool(plan.overrides or variant.where)
        return Job(
            self.label,
            played.scene,
            self.engine,
            played.actions,
            self.values,
            _is_recording(variant.path),
            None if is_changed else played.state_hash,
            player,
            None if is_changed else played.score,
            self._seeds,
            self.plan_key,
        )

    def member(self) -> Member:
        """Return the run as a member of a task."""
        assert self.plan_key is not None
        return Member(self._variant.where, self.values, self.plan_key)


@dataclass
class _Variant:
    """A scene or session with the values of one point of the axes and one seed; read when it is needed."""

    plan: "Plan"
    label: str
    path: str
    where: Values
    """swept and sampled values, and the seed"""

    def read(self) -> Recording:
        """Return the scene as a session without actions, or the recorded session, with values set.

        Raises:
            SceneError: it has faults.
        """
        return self.session

    @property
    def is_read(self) -> bool:
        """Whether the scene has been read."""
        return "session" in vars(self)

    @cached_property
    def session(self) -> Recording:
        """The session, which `read` returns."""
        return self.plan.read(self.path, self.where)

    @cached_property
    def player(self) -> PlayerSpec | None:
        """The player; None if no game is played.

        Raises:
            SceneError: the game cannot be played by that player, or the scene has faults.
        """
        return _player(self.session, self.path, self.plan.player)


class Plan:
    """The runs of a command, in order: scene by scene, the last axis changing fastest, then seeds, then engines.

    If nothing in a scene is random, all seeds are one run, with the first seed.

    Args:
        scenes: label and path of each; a `.json` is a recorded session.
        engines: names; None for the default: pymunk, or the engine of the session.
        overrides: `KEY=VALUE`, set in every run.
        axes: swept and sampled keys.
        seeds: run the seeds 1 to this; None for the seed of each scene.
        player: player of scenes whose game has rules; default: random, or the player of the session.
        keeps_ends: only the ends of runs are kept, so that many of them may be computed in one call.

    Raises:
        AddressError: there would be too many runs.
    """

    def __init__(
        self,
        scenes: Sequence[tuple[str, str]],
        engines: Sequence[str] | None = None,
        overrides: Sequence[Override] = (),
        axes: Sequence[SweepAxis] = (),
        seeds: int | None = None,
        player: PlayerSpec | None = None,
        keeps_ends: bool = False,
    ) -> None:
        self.scenes, self.engines, self.overrides, self.axes = tuple(scenes), engines, tuple(overrides), tuple(axes)
        self.seeds, self.player, self.keeps_ends = seeds, player, keeps_ends
        self.chosen: dict[str, str] = {}
        """engine by the label of a scene, where the default cannot run it"""
        self.has_player = False
        """whether the player plays in one of the scenes that were checked"""
        self._seeds_of: dict[tuple[str, int], int] = {}
        """number of seeds to run, by label and number of a checked point"""
        self._points = math.prod(len(axis.points) for axis in axes)
        self._texts: dict[str, tuple[SceneText | Recording, str]] = {}
        """parsed scene files and recorded sessions, with the digest of the file, by path"""
        self._keyed: dict[str, bool] = {}
        """whether runs have keys, by path"""
        self._kept: dict[tuple[str, str], Recording] = {}
        """checked scenes that have not run yet, within `PLAN_MEMORY`"""
        self._kept_bytes = 0
        count = self._points * (seeds or 1)
        if count > RUNS.value:
            factors = "sweeps and seeds multiply" if seeds else "sweeps multiply"
            raise AddressError(f"{factors} to {short_count(count)} runs; {RUNS.remedy(count)}")

    def __len__(self) -> int:
        """Return the number of runs; an upper bound where seeds of points that were not checked may give one run."""
        total = 0
        for label, _ in self.scenes:
            known = [seeds for (name, _), seeds in self._seeds_of.items() if name == label]
            total += sum(known) + (self._points - len(known)) * self._seed_count
        return total * len(self.engines or (1,))

    def alike_points(self, label: str) -> tuple[int, int]:
        """Return the number of checked points of a scene at which all seeds give one run, and that of all of them."""
        found = [seeds for (name, _), seeds in self._seeds_of.items() if name == label]
        return sum(seeds < self._seed_count for seeds in found), len(found)

    def __iter__(self) -> Iterator[PlannedRun]:
        """Yield the runs.

        Raises:
            SceneError: a scene that was not checked has faults, and whether it is random must be known.
        """
        for label, path in self.scenes:
            for k in range(self._points):
                seeds = self._seeds_of_point(label, path, k)
                for seed in range(seeds):
                    variant = self._variant(label, path, self._point(k), seed)
                    yield from self._runs(variant, self._seed_count // seeds if seeds == 1 else 1)

    def representatives(self) -> Iterator[PlannedRun]:
        """Yield runs that have every value of every axis, with the first values of the others."""
        for label, path in self.scenes:
            for point in self._axis_points():
                variant = self._variant(label, path, self._point(point), 0)
                yield from self._runs(variant, 1)
                if variant.is_read:
                    self._keep(variant)

    def last_of_axes(self) -> Iterator[PlannedRun]:
        """Yield runs that have the last value of one axis, and the first ones of the others."""
        for label, path in self.scenes:
            weight = self._points
            for axis in self.axes:
                weight //= len(axis.points)
                yield from self._runs(self._variant(label, path, self._point(weight * (len(axis.points) - 1)), 0), 1)

    def has_useless_seeds(self, label: str) -> bool:
        """Return whether several seeds are swept by their key, and the first two give one run.

        Raises:
            SceneError: the scene has faults.
        """
        path = next(path for name, path in self.scenes if name == label)
        weight = self._points
        for axis in self.axes:
            weight //= len(axis.points)
            if "world.seed" in axis.keys and len(axis.points) > 1:
                first, second = (self._variant(label, path, self._point(k * weight), 0) for k in (0, 1))
                return _are_alike(first, second)
        return False

    def scene_of(self, label: str) -> Scene:
        """Return a scene with the first values of all axes.

        Raises:
            SceneError: it has faults.
        """
        path = next(path for name, path in self.scenes if name == label)
        return self._variant(label, path, self._point(0), 0).session.scene

    def check(
        self,
        is_stored: Callable[[str], bool] = lambda _: False,
        visit: Callable[[Job], None] = lambda _: None,
        progress: ProgressCallback | None = None,
    ) -> None:
        """Check the scenes before the first run: all of them, or those of one axis at a time in a large plan.

        Args:
            is_stored: returns whether the run of a plan key is stored; its scene has been checked then.
            visit: called with the job of each scene that is checked, for further checks.
            progress: called with the progress.

        Raises:
            SceneError: scenes have faults, each of which is reported once, or a game cannot be played.
        """
        faults: dict[Fault, None] = {}
        failed = done = 0
        for label, path in self.scenes:
            for k in range(self._points) if self._is_small else self._axis_points():
                try:
                    self._check_point(label, path, k, is_stored, visit)
                except SceneError as error:
                    faults |= dict.fromkeys(relabelled(fault, self._swept) for fault in error.faults)
                    failed += 1
                    if failed == MAX_FAILED:
                        raise SceneError(tuple(faults)) from None
                done += 1
                if progress is not None and done % 100 == 0:
                    progress(Progress(f"checking {label}: {done:,} scenes so far"))
        if faults:
            raise SceneError(tuple(faults))

    def read(self, path: str, where: Values) -> Recording:
        """Return a scene as a session without actions, or a recorded session, with values set.

        Raises:
            SceneError: it has faults.
        """
        key = (path, repr(where))
        kept = self._kept.pop(key, None)
        if kept is not None:
            self._kept_bytes -= _bytes_of(kept.scene)
            return kept
        overrides = (*self.overrides, *where)
        source, _ = self._source(path)
        if isinstance(source, SceneText):
            scene = source.scene(overrides)
            return Recording(scene, USUAL, scene.solver, (), scene.world.duration)
        document = to_document(source.whole_scene)
        document["solver"] = source.settings.model_dump(mode="json", exclude_defaults=True)
        return replace(source, scene=from_session(document, path, overrides))

    def _keep(self, variant: _Variant) -> None:
        """Keep the scene of a variant until it runs, if that fits into the memory of plans."""
        key, size = (variant.path, repr(variant.where)), _bytes_of(variant.session.scene)
        if key not in self._kept and (not self._kept or self._kept_bytes + size <= PLAN_MEMORY.value):
            self._kept[key] = variant.session
            self._kept_bytes += size

    @cached_property
    def _swept(self) -> list[str]:
        return [key for axis in self.axes for key in axis.keys]

    @cached_property
    def _set_values(self) -> Values:
        return tuple(_assignment(override) for override in self.overrides)

    def _point(self, number: int) -> Values:
        """Return the values of the point with a number; the last axis changes fastest."""
        values: list[tuple[str, Any]] = []
        for axis in reversed(self.axes):
            number, k = divmod(number, len(axis.points))
            values[:0] = zip(axis.keys, axis.points[k], strict=True)
        return tuple(values)

    @property
    def _is_small(self) -> bool:
        """Whether all scenes are checked before the first run."""
        has_families = self.keeps_ends and bool(self._start_keys)
        return self._points * self._seed_count <= (MAX_FAMILY_CHECKED if has_families else MAX_CHECKED)

    @property
    def _seed_count(self) -> int:
        return self.seeds or 1

    def _axis_points(self) -> Iterator[int]:
        """Yield the numbers of the points with every value of one axis, and the first of all others."""
        weight = self._points
        yield 0
        for axis in self.axes:
            weight //= len(axis.points)
            yield from (k * weight for k in range(1, min(len(axis.points), MAX_AXIS_CHECKED)))

    def _check_point(
        self, label: str, path: str, number: int, is_stored: Callable[[str], bool], visit: Callable[[Job], None]
    ) -> None:
        """Check the scenes of a point.

        Raises:
            SceneError: a scene has faults.
        """
        point, faults = self._point(number), list[Fault]()
        first: _Variant | None = None
        seeds = self._seed_count
        # In a large plan, the second seed shows whether the seeds differ, and the others are not read.
        for seed in range(seeds if self._is_small else min(seeds, 2)):
            variant = self._variant(label, path, point, seed)
            planned = list(self._runs(variant, 1))
            if all(run.plan_key is not None and is_stored(run.plan_key) for run in planned):
                continue
            try:
                variant.read()  # also with an engine that is not known
                self.has_player |= self.player is not None and variant.player == self.player
                for run in planned:
                    visit(run.job())
            except SceneError as error:
                faults += error.faults
                continue
            if seed == 0:
                first = variant
            elif seed == 1 and first is not None and _are_alike(first, variant):
                seeds = 1
                break
            self._keep(variant)
        if faults:
            raise SceneError(faults)
        self._seeds_of[label, number] = seeds

    def _seeds_of_point(self, label: str, path: str, number: int) -> int:
        """Return the number of seeds to run at a point: 1 if all give the run of the first one.

        Raises:
            SceneError: the scene of one of the first two seeds has faults.
        """
        known = self._seeds_of.get((label, number))
        if known is not None or self._seed_count == 1:
            return known or 1
        first, second = (self._variant(label, path, self._point(number), seed) for seed in (0, 1))
        return 1 if _are_alike(first, second) else self._seed_count

    def _variant(self, label: str, path: str, point: Values, seed: int) -> _Variant:
        """Return the scene of a point with one of the seeds, counted from 0."""
        seeding: Values = () if self.seeds is None else (("world.seed", seed + 1),)
        return _Variant(self, label, path, (*point, *seeding))

    def _runs(self, variant: _Variant, seeds: int) -> Iterator[PlannedRun]:
        for engine in self._engines_of(variant.label, variant.path):
            values = (*self._set_values, *variant.where)
            key = self._plan_key(variant, engine, values)
            family = self._family(variant, engine) if key is not None and self.keeps_ends else None
            yield PlannedRun(variant.label, engine, values, key, variant, seeds, family)

    def member_task(self, runs: Sequence[PlannedRun], options: RunOptions) -> MemberTask:
        """Return the task of runs of one family."""
        label, engine = runs[0].label, runs[0].engine
        source, _ = self._source(next(path for name, path in self.scenes if name == label))
        assert isinstance(source, SceneText)
        members = tuple(run.member() for run in runs)
        return MemberTask(label, source, engine, self.overrides, self._start_keys, members, options, dict(versions()))

    @cached_property
    def _start_keys(self) -> tuple[str, ...]:
        """Varied keys that are start values."""
        return tuple(filter(is_start_key, [*self._swept, *(["world.seed"] if self.seeds else [])]))

    def _family(self, variant: _Variant, engine: str) -> str | None:
        """Return the family of a run; None if it has to be an ordinary one."""
        source, _ = self._source(variant.path)
        paths = [key for key, _ in (*self._set_values, *variant.where)]
        is_suitable = isinstance(source, SceneText) and not has_preset(source.document, paths)
        if not (self._start_keys and is_suitable) or any(path.endswith("name") for path in paths):
            return None
        shared = [(key, value) for key, value in variant.where if key not in self._start_keys]
        return repr((variant.label, engine, shared))

    def _engines_of(self, label: str, path: str) -> Sequence[str]:
        if self.engines is not None:
            return self.engines
        if label in self.chosen:
            return (self.chosen[label],)
        try:
            source, _ = self._source(path)
        except SceneError:  # reported when its scenes are checked
            return (USUAL,)
        return (source.engine if isinstance(source, Recording) else USUAL,)

    def _plan_key(self, variant: _Variant, engine: str, values: Values) -> str | None:
        """Return the key of a run; None for games, whose players may come from other files."""
        if not self._has_keys(variant.label, variant.path):
            return None
        _, digest = self._source(variant.path)
        return hash_of([digest, engine, values, dict(versions(engine))])

    def _has_keys(self, label: str, path: str) -> bool:
        """Return whether the file of a scene and its values determine a run: they do unless a game is played."""
        if path not in self._keyed:
            changes_game = any(key.startswith("play") for key in (*self._swept, *(key for key, _ in self._set_values)))
            try:
                first = self._variant(label, path, self._point(0), 0)
                self._keyed[path] = not (_is_recording(path) or changes_game) and first.player is None
                self._keep(first)
            except SceneError:  # reported when its scenes are checked
                self._keyed[path] = False
        return self._keyed[path]

    def recordings(self) -> Iterator[tuple[str, Recording]]:
        """Yield the recorded sessions of the plan, with their labels.

        Raises:
            SceneError: one cannot be read.
        """
        for label, path in self.scenes:
            if _is_recording(path):
                source, _ = self._source(path)
                assert isinstance(source, Recording)
                yield label, source

    def _source(self, path: str) -> tuple[SceneText | Recording, str]:
        """Return a parsed scene file or a recorded session, and the digest of the file.

        Raises:
            SceneError: it cannot be read.
        """
        if path not in self._texts:
            if _is_recording(path):
                self._texts[path] = read_session(path), ""
            else:
                source = SceneText.read(path)
                self._texts[path] = source, hashlib.sha256(source.text.encode("utf-8")).hexdigest()
        return self._texts[path]


def _are_alike(first: _Variant, second: _Variant) -> bool:
    """Return whether two seeds give one run: nothing is random; a game and its player are.

    Raises:
        SceneError: one of the scenes has faults.
    """
    return second.player is None and same_random_state(first.session.scene, second.session.scene)


def _bytes_of(scene: Scene) -> int:
    """Return an upper bound of the memory of a scene, bytes."""
    elements = sum(len(part) for _, part in scene if isinstance(part, tuple))
    return _BYTES_A_SCENE + _BYTES_AN_ELEMENT * elements + _BYTES_A_BODY * len(scene.bodies)


def _assignment(override: Override) -> tuple[str, Any]:
    """Return the key and value of an override; reading the scene reports a malformed one."""
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
    return Path(path).suffix.lower() == ".json"
