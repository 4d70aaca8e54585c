"""Sliders: numbers of a scene by their address, as in `--set`, with the range and scale of each."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from sandbox.echo import MAX_NAMED, short_repr, shorten
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.files.overrides import EVERY, AddressError, index_of, parse_path, split_assignment

MAX_SLIDERS = 24


@dataclass(frozen=True)
class SliderRange:
    """Range and scale of a slider."""

    low: float
    high: float
    is_log: bool = False
    """whether the scale is logarithmic"""
    is_whole: bool = False
    """whether the values are integers"""


RANGES = {
    "dt": SliderRange(1e-4, 0.1, is_log=True),
    "substeps": SliderRange(1, 32, is_whole=True),
    "iterations": SliderRange(1, 100, is_whole=True),
    "gravity": SliderRange(-30, 30),
    "restitution": SliderRange(0, 1),
    "friction": SliderRange(0, 2),
    "damping": SliderRange(0.01, 1),
}
"""Ranges by the last key of an address; others follow from the present value."""
UNITS = {
    "dt": "s", "gravity": "m/s²", "velocity": "m/s", "radius": "m", "mass": "kg", "density": "kg/m²", "angle": "rad",
    "angular_velocity": "rad/s", "stiffness": "N/m", "position": "m", "rate": "rad/s", "wind": "m/s",
}  # fmt: skip
"""Units by the last key of an address."""


@dataclass(frozen=True)
class SceneSlider:
    """A number of a scene that a slider sets."""

    key: str
    """address, such as `solver.dt` or `ball.*.restitution`"""
    range: SliderRange
    value: float
    """present value"""

    @property
    def unit(self) -> str:
        """Unit of the value; empty if it has none or is unknown."""
        return UNITS.get(_last_key(parse_path(self.key)), "")

    def checked(self, value: float) -> float | int:
        """Return a value to be set, an integer if the slider takes integers only.

        Raises:
            AddressError: it is out of range.
        """
        if not self.range.low <= value <= self.range.high:
            raise AddressError(f"{self.key}: {value:g} is out of range; {self.range.low:g} to {self.range.high:g}")
        return round(value) if self.range.is_whole else value


def parse_sliders(texts: Sequence[str], scene: Scene, settings: Settings) -> dict[str, SceneSlider]:
    """Return sliders by their keys.

    Args:
        texts: each `KEY` or `KEY=LOW:HIGH`, with `:log` for a logarithmic scale.
        scene: the scene.
        settings: its solver settings, with the defaults that the engine has chosen.

    Raises:
        AddressError: an address is not that of a number, or a range is invalid.
    """
    if len(texts) > MAX_SLIDERS:
        raise AddressError(f"{len(texts)} sliders are too many; the limit is {MAX_SLIDERS}")
    found = {}
    for text in texts:
        key, equals, given = (part.strip() for part in split_assignment(text))
        value = read_number(scene, settings, key)
        limits = _parse_range(text, given) if equals else _range_of(key, value)
        is_whole = isinstance(value, int) and not limits.is_log
        limits = SliderRange(limits.low, limits.high, limits.is_log, limits.is_whole or is_whole)
        found[key] = SceneSlider(key, limits, limits.low if value is None else value)
    return found


def default_sliders(scene: Scene, settings: Settings) -> list[str]:
    """Return the addresses of gravity, dt, and the restitution and friction of each kind of bodies that state them."""
    keys = ["world.gravity[1]"] if scene.surface is None else []
    keys += [] if settings.integrator is None else ["solver.dt"]
    for kind, elements in scene.kinds.items():
        for key in ("restitution", "friction"):
            if elements and all(getattr(each, key, None) is not None for each in elements):
                keys.append(f"{kind}.*.{key}")
    return keys[:6]


def read_number(scene: Scene, settings: Settings, key: str) -> float | int | None:
    """Return the number at an address; None for a number that the scene leaves out. Of `*`, it is that of the first.

    Raises:
        AddressError: there is no such number.
    """
    value = _read_value(scene, settings, key)
    if isinstance(value, bool) or not isinstance(value, int | float | None):
        raise AddressError(f"{shorten(key, MAX_NAMED)} is not a number")
    return value


def split_component(key: str) -> tuple[str, int | None]:
    """Return the address of an array and the index of a number in it; None if the address has no index at its end."""
    base, _, index = key.rstrip("]").replace("[", ".").rpartition(".")
    return (base, int(index)) if index.isdecimal() and len(index) < 3 and "." in base else (key, None)


def whole_values(scene: Scene, settings: Settings, values: Mapping[str, float]) -> dict[str, Any]:
    """Return values of sliders as assignments to numbers and to whole arrays.

    A file may leave an array out, and then none of its components can be set alone.
    """
    found: dict[str, Any] = {}
    for key, value in values.items():
        base, component = split_component(key)
        if component is None or EVERY in parse_path(base):  # the arrays of several elements differ
            found[key] = value
            continue
        array = found.get(base)
        if array is None:
            array = found[base] = list(_read_value(scene, settings, base))
        array[component] = value
    return found


def _read_value(scene: Scene, settings: Settings, key: str) -> Any:
    """Return the value at an address.

    Raises:
        AddressError: there is no such value.
    """
    parts = parse_path(key)
    shown = shorten(key, MAX_NAMED)
    value: Any = scene
    for k, part in enumerate(parts):
        if isinstance(value, BaseModel):
            names = {field.alias or name: name for name, field in type(value).model_fields.items()}
            if part not in names:
                raise AddressError(f"{shown}: the scene has no {short_repr('.'.join(parts[: k + 1]))}")
            value = settings if value is scene and part == "solver" else getattr(value, names[part])
        elif isinstance(value, tuple) and value:
            value = value[_index(value, parts[: k + 1], shown)]
        else:
            raise AddressError(f"{shown}: the scene has no {short_repr('.'.join(parts[: k + 1]))}")
    return value


def _index(values: tuple[Any, ...], parts: tuple[str, ...], path: str) -> int:
    """Return the index that the last part of an address gives."""
    if parts[-1] == EVERY and isinstance(values[0], BaseModel):
        return 0
    name_of = [{"name": name} if (name := getattr(each, "name", None)) is not None else {} for each in values]
    return index_of(name_of, parts, path)


def _last_key(parts: Sequence[str]) -> str:
    """Return the last part of an address that is not an index."""
    return next((part for part in reversed(parts) if not part.isdecimal()), "")


def _range_of(key: str, value: float | None) -> SliderRange:
    """Return the range of a number, by its key or else by its present value.

    Raises:
        AddressError: it has no value, and its key no usual range.
    """
    usual = RANGES.get(_last_key(parse_path(key)))
    if usual is not None:
        if value is None or usual.low <= value <= usual.high:
            return usual
        return SliderRange(min(usual.low, 2 * value), max(usual.high, 2 * value), usual.is_log, usual.is_whole)
    if value is None:
        raise AddressError(f"{shorten(key, MAX_NAMED)} has no value; give a range, {shorten(key)}=LOW:HIGH")
    if isinstance(value, int):
        return SliderRange(0 if value >= 0 else 2 * value, max(10, 2 * abs(value)), is_whole=True)
    is_component = parse_path(key)[-1].isdecimal()
    if value > 0.0 and not is_component:
        return SliderRange(value / 10.0, value * 10.0, is_log=True)
    reach = 2.0 * abs(value) or 10.0
    return SliderRange(-reach, reach)


def _parse_range(text: str, given: str) -> SliderRange:
    """Read `LOW:HIGH` or `LOW:HIGH:log`.

    Raises:
        AddressError: it is something else.
    """
    low, _, rest = given.partition(":")
    high, colon, scale = rest.partition(":")
    try:
        limits = SliderRange(float(low), float(high), is_log=bool(colon))
    except ValueError:
        limits = SliderRange(0.0, 0.0)
    is_finite = math.isfinite(limits.low) and math.isfinite(limits.high) and limits.low < limits.high
    if not is_finite or (colon and scale != "log") or (limits.is_log and limits.low <= 0.0):
        raise AddressError(f"{short_repr(text)} is not a slider, such as solver.dt=0.001:0.1 or solver.dt=1e-4:0.1:log")
    return limits
