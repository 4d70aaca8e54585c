"""Start states of runs that differ in the seed and in start values of balls only, made without a scene for each.

Reading a scene takes about a millisecond, most of it for parts that all of these runs share. Here the scene is read
once, and the arrays of the bodies are written for many runs at once. They are those of the scenes, bit for bit; values
that need a check of the whole scene are left to it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.batch.job import Values
from sandbox.engines.contract import Members
from sandbox.scene.compile.generators import GeneratorError, count_of, layout_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BACKING, MAX_POSITION, MAX_SPEED
from sandbox.scene.description.discs import Emitter
from sandbox.scene.files.document import to_document
from sandbox.scene.files.overrides import AddressError, index_of, parse_path
from sandbox.scene.validate.bodies import MAX_OVERLAPS, has_direction, height_above

SEED = "world.seed"
STATE_KEYS = {"position": 2, "velocity": 2, "angle": 0, "angular_velocity": 0}
"""Keys of a ball that are its start state, with the length of an array; 0 for a number"""
MAX_ANGLE_AND_RATE = 1e12
"""rad and rad/s: larger ones are left to the validation of the scene"""
UNSUPPORTED = (
    "emitters", "ropes", "cloths", "ragdolls", "joints", "thrusts", "tyres", "attractions", "drives", "zones", "shots",
    "pockets", "sensors",
)  # fmt: skip
"""Parts that refer to bodies, or that depend on start states or the seed in another way"""


def is_start_key(path: str) -> bool:
    """Return whether a path is the seed, or one of the start state of a ball."""
    if path == SEED:
        return True
    if not path.startswith("ball."):
        return False
    try:
        parts = parse_path(path)
    except AddressError:
        return False
    return len(parts) == 3 and parts[1] != "*" and parts[2] in STATE_KEYS


@dataclass(frozen=True)
class StartStates:
    """Start states of runs of a scene with N bodies.

    Use `of`, which returns None for scenes whose start states depend on more than the arrays of the bodies.
    """

    scene: Scene
    """one of them; the others differ in start values"""
    document: dict[str, Any]
    """of that scene"""
    balls: dict[str, int]
    """index of a ball, by the path of each of its varied keys"""

    @classmethod
    def of(cls, scene: Scene, keys: Sequence[str]) -> Self | None:
        """Return the start states that differ in the values of some keys; None if they need a scene each.

        Args:
            scene: a valid scene, from a file without presets.
            keys: for which `is_start_key` is true.
        """
        if any(getattr(scene, part) for part in UNSUPPORTED) or scene.surface is not None:
            return None
        pieces = len(scene.bodies.shapes.body)
        if pieces * (pieces - 1) // 2 > MAX_OVERLAPS or any(each.collides != "all" for each in scene.elements):
            return None
        names = [{} if ball.name is None else {"name": ball.name} for ball in scene.balls]
        balls = {}
        for key in keys:
            if key == SEED:
                continue
            try:
                balls[key] = index_of(names, parse_path(key)[:2], key)
            except AddressError:
                return None
            ball = scene.balls[balls[key]]
            if ball.fixed or ball.spin is not None:
                return None
        return cls(scene, to_document(scene), balls)

    def members(self, points: Sequence[Values]) -> tuple[Members, BoolArray]:
        """Return the start state of a run for each point, and whether it is that of a valid scene, (M,).

        Args:
            points: the values of all keys for each of the M runs.
        """
        bodies, count = self.scene.bodies, len(points)
        columns = {name: np.repeat(getattr(bodies, name)[None], count, axis=0) for name in STATE_KEYS}
        valid = np.ones(count, np.bool_)
        for m, point in enumerate(points):
            valid[m] = self._write(columns, m, dict(point))
        for array in columns.values():
            array += 0.0  # −0.0 becomes 0.0, as in `Bodies`
        return Members(**columns), valid & self._in_range(columns["position"], columns["velocity"])

    def scene_document(self, point: Values) -> dict[str, Any]:
        """Return the document of the scene with the values of a point, which must be valid."""
        document = {**self.document}
        values = dict(point)
        if SEED in values:
            document["world"] = _with_value(document.get("world", {}), "seed", values[SEED], self.scene.world)
            if not document["world"]:
                del document["world"]
        if self.balls:
            document["ball"] = list(document["ball"])
        for key, index in self.balls.items():
            name = parse_path(key)[2]
            stated = list(map(float, values[key])) if STATE_KEYS[name] else float(values[key])
            document["ball"][index] = _with_value(document["ball"][index], name, stated, self.scene.balls[index])
        return document

    def _write(self, columns: dict[str, FloatArray], m: int, values: dict[str, Any]) -> bool:
        """Write the start state of the m-th run; return False if a value is not valid."""
        if SEED in values and not self._write_generators(columns, m, values[SEED]):
            return False
        for key, index in self.balls.items():
            name = parse_path(key)[2]
            if not _is_state(values[key], STATE_KEYS[name]):
                return False
            columns[name][m, index] = values[key]
        return True

    def _write_generators(self, columns: dict[str, FloatArray], m: int, seed: Any) -> bool:
        """Write the bodies of all generators with a seed; return False if they cannot be placed."""
        if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed < 2**63:
            return False
        for begin, end, kind_index, source in self._generators():
            try:
                layout = layout_of(source, seed, kind_index, self.scene.world.gravity)
            except GeneratorError:
                return False
            for name in STATE_KEYS:
                columns[name][m, begin:end] = getattr(layout, name)
        return True

    def _generators(self) -> Iterator[tuple[int, int, int, Any]]:
        """Yield the first body, the one after the last, the index among its kind, and each generator."""
        begin = 0
        for kind, sources in self.scene.kinds.items():
            for k, source in enumerate(sources):
                end = begin + count_of(source)
                if kind in ("grid", "scatter", "stack"):
                    assert not isinstance(source, Emitter)
                    yield begin, end, k, source
                begin = end

    def _in_range(self, position: FloatArray, velocity: FloatArray) -> BoolArray:
        """Return which runs, (M,), start within the bounds that the validation of scenes checks."""
        fine = (np.abs(position) <= MAX_POSITION).all(axis=(1, 2))
        fine &= (np.hypot(velocity[..., 0], velocity[..., 1]) <= MAX_SPEED).all(axis=1)
        for plane in self.scene.planes:
            if has_direction(plane):
                fine &= (height_above(plane, position) >= -BACKING).all(axis=1)
        if self.scene.world.bounds is not None:
            lower, upper = np.asarray(self.scene.world.bounds)
            fine &= ((position >= lower) & (position <= upper)).all(axis=(1, 2))
        return np.asarray(fine)


def _is_state(value: Any, length: int) -> bool:
    """Return whether a value can be one of a start state: a number, or an array of numbers."""
    if length and not (isinstance(value, list | tuple) and len(value) == length):
        return False
    numbers = value if length else [value]
    is_number = all(isinstance(each, int | float) and not isinstance(each, bool) for each in numbers)
    return is_number and all(abs(each) <= (MAX_POSITION if length else MAX_ANGLE_AND_RATE) for each in numbers)


def _with_value(table: dict[str, Any], key: str, value: Any, part: Any) -> dict[str, Any]:
    """Return a table of a document with one value set; values equal to their default are left out."""
    default = type(part).model_fields[key].default
    is_default = tuple(value) == default if isinstance(value, list) else value == default
    return {name: each for name, each in table.items() if name != key} | ({} if is_default else {key: value})
