"""Plans: which runs a command asks for. Scenes, sweeps, seeds and engines multiply."""

import math
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from sandbox.games.player import Player
from sandbox.games.registry import RULES
from sandbox.measure.seeds import same_chances
from sandbox.recording import Recording
from sandbox.scene.address import AddressError, parse_assignment, parse_value, split_assignment
from sandbox.scene.document import to_document
from sandbox.scene.faults import Fault, SceneError
from sandbox.scene.file import Override, from_document, load
from sandbox.scene.model import Scene

MOST_POINTS = 1_000_000

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
    player: Player | None = None
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
    player: Player | None = None,
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

    Raises:
        SceneError: scenes have faults, as they stand or with a value set; all of them are told, each once. Or a game
            cannot be played so.
        AddressError: a sweep cannot be understood.
    """
    axes: list[list[tuple[str, Any]]] = [[(key, value) for value in values] for key, values in map(parse_sweep, sweeps)]
    seeding: list[tuple[tuple[str, Any], ...]] = [()]
    if seeds is not None:
        seeding = [(("world.seed", seed),) for seed in range(1, seeds + 1)]
    if math.prod(len(axis) for axis in axes) * len(seeding) > MOST_POINTS:
        raise AddressError(f"the sweeps multiply to more than {MOST_POINTS:,} runs")
    jobs: list[Job] = []
    set_values = [_assignment(override) for override in overrides]
    faults: dict[Fault, None] = {}
    for label, path in scenes:
        for point in product(*axes):
            found: list[tuple[Recording, Player | None, tuple[tuple[str, Any], ...]]] = []
            alike = 1
            for seed in seeding:
                try:
                    session = _read(path, (*overrides, *point, *seed))
                    plays = _player(session, path, player)
                except SceneError as error:
                    faults |= dict.fromkeys(error.faults)
                    continue
                if len(found) == 1 and plays is None and same_chances(found[0][0].scene, session.scene):
                    alike = len(seeding)
                    break
                found.append((session, plays, (*point, *seed)))
            for session, plays, where in found:
                for engine in engines or (session.engine,):
                    played = session if engine == session.engine else session.on(engine)
                    same = not (overrides or where)
                    known, score = (played.state_hash, played.score) if same else (None, None)
                    recorded = _is_recording(path)
                    values = (*set_values, *where)
                    job = Job(label, played.scene, engine, played.actions, values, recorded, known, plays, score, alike)
                    jobs.append(job)
    if faults:
        raise SceneError(tuple(faults))
    return jobs


def _assignment(override: Override) -> tuple[str, Any]:
    """Return the key and value of what is set; one that cannot be read is left to `load`, which says why."""
    try:
        return parse_assignment(override) if isinstance(override, str) else override
    except AddressError:
        return str(override), None


def _read(path: str, overrides: Sequence[Override]) -> Recording:
    """Return what a file holds as a session; a scene is one in which nobody does anything.

    Raises:
        SceneError: it has faults.
    """
    if not _is_recording(path):
        scene = load(path, overrides)
        return Recording(scene, USUAL, scene.solver, (), scene.world.duration)
    session = Recording.load(path)
    document = to_document(session.whole_scene)
    document["solver"] = session.settings.model_dump(mode="json", exclude_defaults=True)
    return replace(session, scene=from_document(document, path, overrides))


def _player(session: Recording, path: str, player: Player | None) -> Player | None:
    """Return who plays; none where there is no game with rules.

    Raises:
        SceneError: the game cannot be played so.
    """
    if session.scene.play.game not in RULES:
        return None
    plays = Player.of(session) if _is_recording(path) else player or Player()
    plays.bout(session.scene, path)
    return plays


def _is_recording(path: str) -> bool:
    return path.lower().endswith(".json")


def parse_sweep(text: str) -> tuple[str, list[Any]]:
    """Read `KEY=A,B,C` or `KEY=LOW:HIGH:N[:log]` into the key and its values.

    Between whole ends, what is whole stays an integer: `solver.substeps=1:8:4:log` is 1, 2, 4, 8.

    Raises:
        AddressError: it is neither.
    """
    key, _ = parse_assignment(text)
    values = split_assignment(text)[2].strip()
    parts = values.split(":")
    if len(parts) in (3, 4) and not values.startswith(('"', "'", "[")):
        return key, list(_range(text, parts))
    if len(parts) > 4 and all(_is_number(part) for part in parts[:-1]):
        raise AddressError(f"{text!r}: a range is LOW:HIGH:N or LOW:HIGH:N:log")
    if len(parts) == 2 and all(_is_number(part) for part in parts):
        raise AddressError(f"{text!r}: a range needs a count: {key}={values}:N, such as {key}={values}:10")
    found = [parse_value(value) for value in _split(values)]
    if not values or "" in found:
        raise AddressError(f"{text!r}: a value is missing; KEY=A,B,C or KEY=LOW:HIGH:N or KEY=LOW:HIGH:N:log")
    return key, found


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _range(text: str, parts: list[str]) -> Iterator[float]:
    whole = all(part.strip().removeprefix("-").isdecimal() for part in parts[:2])
    try:
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
    except ValueError:
        raise AddressError(f"{text!r}: a range is LOW:HIGH:N, two numbers and how many values") from None
    log = len(parts) == 4
    if log and parts[3] != "log":
        raise AddressError(f"{text!r}: {parts[3]!r} is unknown; KEY=LOW:HIGH:N:log spaces by equal factors")
    if not (1 <= count <= MOST_POINTS and math.isfinite(high - low)):
        raise AddressError(f"{text!r}: a range has finite ends and 1 to {MOST_POINTS:,} values")
    if log and not (0.0 < low <= high and math.isfinite(high / low)):
        raise AddressError(f"{text!r}: equal factors need 0 < LOW <= HIGH")
    for k in range(count):
        share = k / (count - 1) if count > 1 else 0.0
        value = low * (high / low) ** share if log else low + (high - low) * share
        if k and k == count - 1:
            value = high  # not a rounding beside it
        near = round(value) if whole else 0
        yield near if whole and abs(value - near) <= 1e-12 * abs(value) else value  # powers and sums round


def _split(values: str) -> list[str]:
    """Split at the commas that separate TOML values, not at those within arrays or texts."""
    parts, start = [], 0
    for k, letter in enumerate(values):
        if letter == "," and _is_whole(values[start:k]):
            parts.append(values[start:k].strip())
            start = k + 1
    return [*parts, values[start:].strip()]


def _is_whole(text: str) -> bool:
    if not any(mark in text for mark in "[\"'{"):
        return True
    try:
        tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return False
    return True
