"""Plans: which runs a command asks for. Scenes, sweeps, seeds and engines multiply."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from sandbox.echo import short_count, short_repr, shorten
from sandbox.games.players import PlayerSpec
from sandbox.games.registry import has_rules
from sandbox.measure.replay import read_session
from sandbox.measure.seeds import same_chances
from sandbox.measure.told import Told
from sandbox.recording import Recording
from sandbox.resource_limits import PLAN_MEMORY, RUNS
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import Override, from_session, load
from sandbox.scene.files.overrides import (
    AddressError,
    combinations,
    parse_assignment,
    parse_path,
    parse_value,
    split_assignment,
)
from sandbox.scene.scene import Scene

MAX_FAILED = 100
"""Runs that cannot be made, after which the check ends with their faults."""
_BYTES_A_SCENE, _BYTES_AN_ELEMENT, _BYTES_A_BODY = 16_000, 4_000, 500
"""What a scene takes at most, as measured: an element is a table of the file, a body one that may be generated."""

USUAL = "pymunk"
"""The engine that runs what nobody has chosen one for."""


@dataclass(frozen=True)
class Job:
    """One run to be made: a scene as it is to be run, and on what."""

    label: str
    """the scene as the user named it"""
    scene: Scene
    engine: str
    actions: tuple[Any, ...] = ()
    point: tuple[tuple[str, Any], ...] = ()
    """the keys that were set or swept, and this run's values"""
    recorded: bool = False
    """It is a session that was played before."""
    state_hash: str | None = None
    """of the end of that session, where this run is to end alike: on its engine, with nothing set"""
    player: PlayerSpec | None = None
    """who plays the game of the scene, where it has one with rules"""
    score: float | None = None
    """of that session, where this run is to end alike"""
    seeds: int = 1
    """for how many seeds, from its own on, it stands: nothing in its scene is random where there are several"""


def plan(
    scenes: Sequence[tuple[str, str]],
    engines: Sequence[str] | None,
    overrides: Sequence[Override] = (),
    sweeps: Sequence[str] = (),
    seeds: int | None = None,
    player: PlayerSpec | None = None,
    told: Told | None = None,
) -> list[Job]:
    """Lay out every run, in order: scene by scene, the last sweep changing fastest, then seeds, then engines.

    Where nothing in a scene is random, all seeds are one run, of the first.

    Args:
        scenes: label and path of each; a `.json` is a recorded session.
        engines: names; none for the usual, which is a session's own.
        overrides: `KEY=VALUE`, set in every run.
        sweeps: `KEY=A,B,C` or `KEY=LOW:HIGH:N[:log]`.
        seeds: how many, from 1 on; without, each scene's own.
        player: who plays where a scene has a game with rules; by default chance, and of a session who played it.
        told: called with how far it is.

    Raises:
        SceneError: scenes have faults, as they stand or with a value set; all of them are told, each once. Or a game
            cannot be played so.
        AddressError: a sweep cannot be understood, or there would be too many runs.
    """
    axes: list[tuple[str, Sequence[Any]]] = [parse_sweep(sweep) for sweep in sweeps]
    keys = [key for key, _ in axes]
    seeding: Sequence[int | None] = [None] if seeds is None else range(1, seeds + 1)
    points = combinations(axes, len(seeding))
    count = len(points) * len(seeding)
    jobs: list[Job] = []
    set_values = [_assignment(override) for override in overrides]
    faults: dict[Fault, None] = {}
    planned = failed = 0
    for label, path in scenes:
        recorded = _is_recording(path)
        known: Recording | None = None
        for point in points:
            found: list[tuple[Recording, PlayerSpec | None, tuple[tuple[str, Any], ...]]] = []
            alike = 1
            for seed in seeding:
                where = (*point, *(() if seed is None else (("world.seed", seed),)))
                try:
                    known = read_session(path) if recorded and known is None else known
                    session = _read(path, known, (*overrides, *where))
                    plays = _player(session, path, player)
                except SceneError as error:
                    faults |= dict.fromkeys(relabelled(fault, keys) for fault in error.faults)
                    failed += 1
                    if failed == MAX_FAILED:
                        raise SceneError(tuple(faults)) from None
                    continue
                if len(found) == 1 and plays is None and same_chances(found[0][0].scene, session.scene):
                    alike = len(seeding)
                    break
                if len(found) < 2:  # by the second it is known that seeds differ
                    before, each = planned, _bytes_of(session.scene)
                    planned += each * (len(seeding) - 1 if found else 1)
                    if planned > PLAN_MEMORY.value:
                        subject = f"{count:,} runs of {len(session.scene.bodies):,} bodies take"
                        reason = PLAN_MEMORY.refusal(subject, max(planned, before + each * count))
                        raise SceneError([Fault(label, None, "", str(reason))])
                found.append((session, plays, where))
            for session, plays, where in found:
                for engine in engines or (session.engine,):
                    played = session if engine == session.engine else session.on(engine)
                    state, score = (None, None) if overrides or where else (played.state_hash, played.score)
                    values = (*set_values, *where)
                    job = Job(label, played.scene, engine, played.actions, values, recorded, state, plays, score, alike)
                    jobs.append(job)
            if told is not None:
                told(f"checking {label}: runs so far: {len(jobs):,}")
    if faults:
        raise SceneError(tuple(faults))
    return jobs


def _bytes_of(scene: Scene) -> int:
    """Return about how many bytes a scene takes."""
    elements = sum(len(part) for _, part in scene if isinstance(part, tuple))
    return _BYTES_A_SCENE + _BYTES_AN_ELEMENT * elements + _BYTES_A_BODY * len(scene.bodies)


def repeated_keys(overrides: Sequence[str], sweeps: Sequence[str], seeds: int | None = None) -> list[Fault]:
    """Return a fault for each key that `--set`, `--sweep` and `--seeds` give more than one value of a single run.

    Values that cannot be read are left to `parse_sweep` and `load`.
    """
    set_keys, swept = ([key for key in map(_path, texts) if key] for texts in (overrides, sweeps))
    faults: dict[Fault, None] = {}
    for k, (path, key) in enumerate(swept):
        if any(path == other for other, _ in swept[:k]):
            faults[Fault("--sweep", None, key, "is swept twice; give all its values in one --sweep")] = None
        if any(path == other for other, _ in set_keys):
            faults[Fault("--sweep", None, key, "is given by --set too; leave out one of them")] = None
    for option, keys in (("--sweep", swept), ("--set", set_keys)) if seeds is not None else ():
        for path, key in keys:
            if path == ("world", "seed"):
                faults[Fault(option, None, key, "is given by --seeds too; leave out one of them")] = None
    return list(faults)


def _path(assignment: str) -> tuple[tuple[str, ...], str] | None:
    """Return the path of an assignment's key, one for all its spellings, and the key; None if it cannot be read."""
    try:
        key, _ = parse_assignment(assignment)
        return parse_path(key), key
    except AddressError:
        return None


def _assignment(override: Override) -> tuple[str, Any]:
    """Return the key and value of what is set; one that cannot be read is left to `load`, which says why."""
    try:
        return parse_assignment(override) if isinstance(override, str) else override
    except AddressError:
        return str(override), None


def relabelled(fault: Fault, keys: Sequence[str]) -> Fault:
    """Return a fault of an override, named by `--sweep` where the path that leads nowhere is one that is swept."""
    is_swept = fault.path == "--set" and any(fault.message.startswith((f"{key}:", f"{key!r}")) for key in keys)
    return replace(fault, path="--sweep") if is_swept else fault


def _read(path: str, known: Recording | None, overrides: Sequence[Override]) -> Recording:
    """Return a scene as a session without actions, or the session that was read from the file, with values set.

    Raises:
        SceneError: it has faults.
    """
    if known is None:
        scene = load(path, overrides)
        return Recording(scene, USUAL, scene.solver, (), scene.world.duration)
    document = to_document(known.whole_scene)
    document["solver"] = known.settings.model_dump(mode="json", exclude_defaults=True)
    return replace(known, scene=from_session(document, path, overrides))


def _player(session: Recording, path: str, player: PlayerSpec | None) -> PlayerSpec | None:
    """Return who plays; none where there is no game with rules.

    Raises:
        SceneError: the game cannot be played so.
    """
    is_requested = bool(session.presses) if _is_recording(path) else player is not None
    if not has_rules(session.scene, on_request=is_requested):
        return None
    plays = PlayerSpec.from_recording(session) if _is_recording(path) else player or PlayerSpec()
    plays.start_game(session.scene, path)
    return plays


def _is_recording(path: str) -> bool:
    return path.lower().endswith(".json")


def parse_sweep(text: str) -> tuple[str, Sequence[Any]]:
    """Read `KEY=A,B,C` or `KEY=LOW:HIGH:N[:log]` into the key and its values, each once.

    Between whole ends, what is whole stays an integer: `solver.substeps=1:8:4:log` is 1, 2, 4, 8.

    Raises:
        AddressError: it is neither.
    """
    key, _ = parse_assignment(text)
    values = split_assignment(text)[2].strip()
    parts = values.split(":", 5)
    if len(parts) in (3, 4) and not values.startswith(('"', "'", "[")):
        return key, _range(text, parts)
    if len(parts) > 4 and all(_is_number(part) for part in parts[:-1]):
        raise AddressError(f"{short_repr(text)}: a range is LOW:HIGH:N or LOW:HIGH:N:log")
    if len(parts) == 2 and all(_is_number(part) for part in parts):
        asked = f"{shorten(key)}={shorten(values)}"
        raise AddressError(f"{short_repr(text)}: a range needs a count: {asked}:N, such as {asked}:10")
    found = [parse_value(value) for value in dict.fromkeys(_split(values))]
    if not values or "" in found:
        raise AddressError(
            f"{short_repr(text)}: a value is missing; use KEY=A,B,C or KEY=LOW:HIGH:N or KEY=LOW:HIGH:N:log"
        )
    return key, list({f"{type(value).__name__} {value!r}": value for value in found}.values())  # 1, 1.0 and true differ


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class _Range(Sequence[float]):
    """Evenly spaced values, made one by one: how many there are is known, and may be refused, before there is any."""

    low: float
    high: float
    size: int
    is_log: bool
    is_whole: bool
    """The ends are integers, and what is whole in between is one too."""

    def __len__(self) -> int:
        return self.size

    def __getitem__(self, index: Any) -> Any:
        """Return a value by its index from 0, or from the end."""
        k = range(self.size)[index]
        low, high = self.low, self.high
        fraction = k / (self.size - 1) if self.size > 1 else 0.0
        value = low * (high / low) ** fraction if self.is_log else low + (high - low) * fraction
        if k and k == self.size - 1:
            value = high  # not a rounding beside it
        near = round(value) if self.is_whole else 0
        return near if self.is_whole and abs(value - near) <= 1e-12 * abs(value) else value  # powers and sums round


def _range(text: str, parts: list[str]) -> _Range:
    is_whole = all(part.strip().removeprefix("-").isdecimal() for part in parts[:2])
    try:
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
    except ValueError:
        raise AddressError(f"{short_repr(text)}: a range is LOW:HIGH:N, two numbers and a count") from None
    is_log = len(parts) == 4
    if is_log and parts[3] != "log":
        unknown = short_repr(parts[3])
        raise AddressError(f"{short_repr(text)}: {unknown} is unknown; KEY=LOW:HIGH:N:log gives logarithmic spacing")
    if not (count >= 1 and math.isfinite(high - low)):
        raise AddressError(f"{short_repr(text)}: a range needs finite ends and at least 1 value")
    if count > RUNS.value:
        raise AddressError(f"{short_repr(text)}: a range of {short_count(count)} values; {RUNS.remedy(count)}")
    if is_log and not (0.0 < low <= high and math.isfinite(high / low)):
        raise AddressError(f"{short_repr(text)}: logarithmic spacing needs 0 < LOW <= HIGH")
    return _Range(low, high, count if low != high else 1, is_log, is_whole)


def _split(values: str) -> list[str]:
    """Split at the commas that separate TOML values, not at those within arrays, tables or texts."""
    parts, start, depth, quote, escaped = [], 0, 0, "", False
    for k, letter in enumerate(values):
        if escaped:
            escaped = False
        elif quote:
            escaped = letter == "\\" and quote == '"'
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter in "[{":
            depth += 1
        elif letter in "]}":
            depth -= 1
        elif letter == "," and depth <= 0:
            parts.append(values[start:k].strip())
            start = k + 1
    return [*parts, values[start:].strip()]
