"""Sweeps: the grammar of `--sweep`, and conflicts between the keys of `--set`, `--sweep` and `--seeds`.

A sweep is an axis of a plan: keys, and the points that they take together. Most axes have one key; the ranges of
`--sample` are one axis of several.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

from sandbox.echo import short_count, short_repr, shorten
from sandbox.resource_limits import RUNS
from sandbox.scene.errors import Fault
from sandbox.scene.files.overrides import AddressError, parse_assignment, parse_path, parse_value, split_assignment


@dataclass(frozen=True)
class SweepAxis:
    """Keys of a scene, and the points that a plan multiplies with those of other axes."""

    keys: tuple[str, ...]
    points: Sequence[tuple[Any, ...]]
    """values of the keys at each point; computed on access where there may be many"""

    @classmethod
    def of(cls, key: str, values: Sequence[Any]) -> Self:
        """Return an axis of one key."""
        return cls((key,), _Singles(values))


class _Singles(Sequence[tuple[Any, ...]]):
    """Values as points of one component each."""

    def __init__(self, values: Sequence[Any]) -> None:
        self._values = values

    def __len__(self) -> int:
        return len(self._values)

    def __getitem__(self, index: Any) -> Any:
        """Return the point at an index."""
        return (self._values[index],)


def parse_sweep(text: str) -> tuple[str, Sequence[Any]]:
    """Parse `KEY=A,B,C` or `KEY=LOW:HIGH:N[:log]`; return the key and its distinct values.

    Whole values of a range with integer ends stay integers: `solver.substeps=1:8:4:log` is 1, 2, 4, 8.

    Raises:
        AddressError: the text has neither form.
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
        raise AddressError(
            f"{short_repr(text)}: a range needs a count: {asked}:N, such as {asked}:10; or --sample N draws from it"
        )
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
class SampledRange:
    """Range of a key from which `--sample` draws: `KEY=LOW:HIGH`, with `:log` for even factors, `:int` for integers."""

    key: str
    low: float
    high: float
    is_log: bool
    is_whole: bool
    """Values are integers; the ends are among them."""

    @classmethod
    def parse(cls, text: str) -> Self | None:
        """Return the range of a sweep; None if the text has another form.

        Raises:
            AddressError: its ends are not finite or not in order, or do not suit `log` or `int`.
        """
        key, _ = parse_assignment(text)
        ends, words = _ends(split_assignment(text)[2])
        if len(ends) != 2 or not set(words) <= {"log", "int"}:
            return None
        (low, high), is_log, is_whole = ends, "log" in words, "int" in words
        if not (low <= high and math.isfinite(high - low)):
            raise AddressError(f"{short_repr(text)}: a range needs finite ends LOW <= HIGH")
        if is_log and not (low > 0.0 and math.isfinite(high / low)):
            raise AddressError(f"{short_repr(text)}: logarithmic spacing needs 0 < LOW <= HIGH")
        if is_whole and not (low.is_integer() and high.is_integer()):
            raise AddressError(f"{short_repr(text)}: a range of integers needs integer ends")
        return cls(key, low, high, is_log, is_whole)

    def value(self, fraction: float) -> float:
        """Return the value at a fraction of the range, from 0 to below 1; each integer has an equal share of it."""
        low, high = self.low, self.high + self.is_whole
        value = low * (high / low) ** fraction if self.is_log else low + (high - low) * fraction
        return min(math.floor(value), int(self.high)) if self.is_whole else value


def _ends(values: str) -> tuple[list[float], list[str]]:
    """Return the leading numbers of a range, and the words after them."""
    parts = [part.strip() for part in values.split(":", 5)]
    count = next((k for k, part in enumerate(parts) if not _is_number(part)), len(parts))
    return [float(part) for part in parts[:count]], parts[count:]


def _is_integer(text: str) -> bool:
    return text.removeprefix("-").isdecimal()


@dataclass(frozen=True)
class _Range(Sequence[float]):
    """Evenly spaced values, computed on access: a range that is too long is refused before it takes memory."""

    low: float
    high: float
    size: int
    is_log: bool
    is_whole: bool
    """Both ends are integers; whole values between them are integers too."""

    def __len__(self) -> int:
        return self.size

    def __getitem__(self, index: Any) -> Any:
        """Return the value at an index; negative indices count from the end."""
        k = range(self.size)[index]
        low, high = self.low, self.high
        fraction = k / (self.size - 1) if self.size > 1 else 0.0
        value = low * (high / low) ** fraction if self.is_log else low + (high - low) * fraction
        if k and k == self.size - 1:
            value = high  # exactly, without rounding
        near = round(value) if self.is_whole else 0
        # 1e-12: rounding errors of powers and sums, about 1e-15, and far below the distance of other values
        return near if self.is_whole and abs(value - near) <= 1e-12 * abs(value) else value


def _range(text: str, parts: list[str]) -> _Range:
    is_whole = all(_is_integer(part.strip()) for part in parts[:2])
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
    """Split at the commas between TOML values, not at commas inside arrays, tables or strings."""
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


def repeated_keys(overrides: Sequence[str], sweeps: Sequence[str], seeds: int | None = None) -> list[Fault]:
    """Return a fault for each key to which `--set`, `--sweep` and `--seeds` give several values in one run.

    Malformed assignments are skipped: `parse_sweep` and `load` report them.
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
    """Return the normalised path of an assignment's key, and the key as written; None for a malformed assignment."""
    try:
        key, _ = parse_assignment(assignment)
        return parse_path(key), key
    except AddressError:
        return None


def relabelled(fault: Fault, keys: Sequence[str]) -> Fault:
    """Return the fault of an override; one of an unknown key that is swept names `--sweep` in place of `--set`."""
    return replace(fault, path="--sweep") if fault.path == "--set" and fault.key in keys else fault
