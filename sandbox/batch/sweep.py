"""Sweeps: the grammar of `--sweep`, and conflicts between the keys of `--set`, `--sweep` and `--seeds`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from sandbox.echo import short_count, short_repr, shorten
from sandbox.resource_limits import RUNS
from sandbox.scene.errors import Fault
from sandbox.scene.files.overrides import AddressError, parse_assignment, parse_path, parse_value, split_assignment


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
    is_swept = fault.path == "--set" and any(fault.message.startswith((f"{key}:", f"{key!r}")) for key in keys)
    return replace(fault, path="--sweep") if is_swept else fault
