"""Parameters of a session that the panel can change, their slider scales, and the actions that set them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

from sandbox.action import Action, SetParameter, Switch, heading_of
from sandbox.engines.registry import ENGINES
from sandbox.formatting import format_percent, format_si
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySource, HasMaterial
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.description.world import DetectionName, IntegratorName, Settings
from sandbox.window.playback.live import LiveView

ParameterValue = float | str


@dataclass(frozen=True)
class Parameter:
    """Value, range and scale of one parameter. Immutable: a widget reports a change and does not apply it."""

    key: str
    """key that is passed to `on_change`"""
    label: str
    low: float = 0.0
    high: float = 1.0
    value: ParameterValue = 0.0
    """present value; one of `choices` if there are any"""
    log: bool = False
    """whether the scale is logarithmic; requires `low` > 0"""
    step: float = 0.01
    """increment per notch of the wheel, and grid of the values; on a logarithmic scale, in decades"""
    unit: str = ""
    """unit; with `%`, fractions are shown as percentages"""
    choices: tuple[str, ...] = ()
    enabled: bool = True
    why: str = ""
    """reason why the parameter is disabled"""
    default: ParameterValue | None = None
    """value in the scene file, restored by a double click"""

    @property
    def whole(self) -> bool:
        """Whether the parameter takes integers only."""
        return not self.log and self.step >= 1 and self.step == int(self.step)

    def at(self, fraction: float) -> float:
        """Return the value at a fraction of the range from `low` to `high`, snapped to the grid; the ends are exact."""
        if fraction <= 0 or self.high <= self.low:
            return self.low
        if fraction >= 1:
            return self.high
        if self.log:
            return self._snapped(self.low * (self.high / self.low) ** fraction)
        return self._snapped(self.low + fraction * (self.high - self.low))

    def fraction(self, value: ParameterValue) -> float:
        """Return the position of a value on the scale, 0 at `low` to 1 at `high`, clamped."""
        if isinstance(value, str) or not math.isfinite(value) or self.high <= self.low:
            return 0.0
        inside = min(max(value, self.low), self.high)
        if self.log:
            return math.log(inside / self.low) / math.log(self.high / self.low)
        return (inside - self.low) / (self.high - self.low)

    def stepped(self, value: ParameterValue, notches: int) -> ParameterValue:
        """Return the value after a number of notches of the wheel; choices are cyclic."""
        if self.choices:
            present = self.choices.index(str(value)) if value in self.choices else -1 if notches > 0 else 0
            return self.choices[(present + notches) % len(self.choices)]
        if isinstance(value, str) or not math.isfinite(value):
            return self.low
        if self.log:
            return self._snapped(value * 10.0 ** (self.step * notches))
        return self._snapped(value + self.step * notches)

    def _snapped(self, value: float) -> float:
        if self.log:
            digits = 1 if self.step >= 0.05 else 2 if self.step >= 0.005 else 12  # keeps each notch
            value = float(f"{value:.{digits}e}")
        elif self.step > 0:
            decimals = max(0, 2 - math.floor(math.log10(self.step)))  # avoids 0.30000000000000004 for multiples of 0.1
            value = round(round(value / self.step) * self.step, decimals)
        return min(max(value, self.low), self.high)

    def text(self, value: ParameterValue) -> str:
        """Return a value formatted for display."""
        if isinstance(value, str):
            return value.replace("_", " ")
        if self.unit == "%":
            return format_percent(value)
        if self.whole and math.isfinite(value):
            tail = f" {self.unit}" if self.unit else ""
            return f"{value:.0f}{tail}".replace("-", "−")
        return format_si(value, self.unit)


SETTING_KINDS = ("ball", "grid", "scatter", "emitter")


class SessionParameters:
    """Parameters of a session. The capabilities of the engine are cached by scene and settings."""

    def __init__(self) -> None:
        self._cached_for: tuple[Scene, str, Settings] | None = None
        self._supported: dict[str, tuple[str, ...]] = {}

    def of(self, live: LiveView, file: Scene, picked: int | None) -> tuple[Parameter, ...]:
        """Return the parameters with their present values.

        Args:
            live: the session.
            file: its scene as read from the file, the source of default values.
            picked: index of the body whose restitution and friction are shown; None for all bodies.
        """
        scene, settings = live.scene, live.settings
        if picked is not None and picked >= len(live.bodies):  # in the future, as after a step back
            picked = None
        return (
            Parameter(
                "gravity",
                "gravity",
                -30.0,
                30.0,
                scene.world.gravity[1],
                step=0.1,
                unit="m/s²",
                default=file.world.gravity[1],
            ),
            _surface(live, file, picked, "restitution", 1.0),
            _surface(live, file, picked, "friction", 2.0),
            Parameter("engine", "engine", value=live.engine, choices=tuple(ENGINES)),
            Parameter("dt", "dt", 1e-4, 0.1, settings.dt, log=True, step=0.1, unit="s", default=file.solver.dt),
            *_counts(live, file),
            self._choice(live, "integrator", get_args(IntegratorName)),
            self._choice(live, "detection", get_args(DetectionName)),
        )

    def _choice(self, live: LiveView, key: str, names: tuple[str, ...]) -> Parameter:
        """Return a choice parameter with the options that the engine supports."""
        now = live.scene, live.engine, live.session.simulation.wanted
        if self._cached_for is None or any(a is not b for a, b in zip(self._cached_for, now, strict=True)):
            self._cached_for, self._supported = now, {}
        if key not in self._supported:
            engine, simulation = ENGINES[live.engine], live.session.simulation
            self._supported[key] = tuple(
                name for name in names if not engine.missing(simulation.setup, simulation.wanted.replace(**{key: name}))
            )
        supported, value = self._supported[key], getattr(live.settings, key)
        if len(supported) < 2:
            reason = f"{live.engine} offers no other" if supported else f"not used by {live.engine}"
            return Parameter(key, key, value=value or "none", choices=(value or "none",), enabled=False, why=reason)
        return Parameter(key, key, value=value, choices=supported)


def _counts(live: LiveView, file: Scene) -> tuple[Parameter, ...]:
    has_steps = live.settings.integrator is not None
    reason = "" if has_steps else f"{live.engine} has no time step"
    settings, defaults = live.settings, file.solver
    return (
        Parameter(
            "substeps",
            "substeps",
            1,
            32,
            settings.substeps,
            step=1,
            enabled=has_steps,
            why=reason,
            default=defaults.substeps,
        ),
        Parameter(
            "iterations",
            "iterations",
            1,
            100,
            settings.iterations,
            step=1,
            enabled=has_steps,
            why=reason,
            default=defaults.iterations,
        ),
    )


def _surface(live: LiveView, file: Scene, picked: int | None, key: str, high: float) -> Parameter:
    """Return the parameter for restitution or friction.

    Material pairs that define the property take precedence over bodies, so their value is shown and set.
    """
    scene = live.scene
    index = _source_index(live, picked)
    if index >= len(scene.body_sources) and picked is None:
        return Parameter(key, key, 0.0, high, 0.0, enabled=False, why="the scene has no body")
    disc = (
        live.bodies.elements[live.bodies.element[picked or 0]]
        if index >= len(scene.body_sources)
        else scene.body_sources[index]
    )
    name = disc.name if picked is None or index < len(scene.body_sources) else live.bodies.names[picked]
    label = key if picked is None else f"{key} of {name or 'this body'}"
    default = None
    pairs = _pairs(scene, disc if picked is not None else None)
    if pairs:
        value = getattr(scene.pairs[pairs[0]], key) or 0.0
        if pairs[0] < len(file.pairs):
            default = getattr(file.pairs[pairs[0]], key) or 0.0
        if picked is not None:
            label = f"{key} of {disc.material}"
        return Parameter(key, label, 0.0, high, value, default=default)
    if index < len(file.body_sources):
        default = _stated(file, file.body_sources[index], key)
    return Parameter(key, label, 0.0, high, acting_coefficient(scene, disc, key), default=default)


def _source_index(live: LiveView, picked: int | None) -> int:
    """Return the index of the picked body's element among the scene's body sources; without a body, 0."""
    return 0 if picked is None else live.scene.source_index(int(live.bodies.element[picked]))


def _pairs(scene: Scene, disc: BodySource | None) -> list[int]:
    """Return the indices of the material pairs with a body's material; without a body, of all pairs."""
    return [n for n, pair in enumerate(scene.pairs) if disc is None or disc.material in pair.between]


def _stated(scene: Scene, element: HasMaterial, key: str) -> float | None:
    """Return the restitution or friction of an element or else of its material; None if neither defines it."""
    own: float | None = getattr(element, key)
    if own is None and element.material is not None:
        own = next((getattr(each, key) for each in scene.materials if each.name == element.material), None)
    return own


def acting_coefficient(scene: Scene, body: BodySource, key: str) -> float:
    """Return the restitution or friction of a body that its contacts with static objects have.

    Where neither the body nor its material states one, it is that of the other side: the largest of planes, walls and
    posts; 0 if they state none either.
    """
    own = _stated(scene, body, key)
    if own is not None:
        return own
    return max(
        (_stated(scene, each, key) or 0.0 for each in scene.fixed if isinstance(each, Plane | Wall | Post)), default=0.0
    )


def parameter_actions(live: LiveView, key: str, value: ParameterValue, picked: int | None) -> list[Action]:
    """Return the actions that set a parameter; switching the engine is handled by `AppState.switch_engine`."""
    if key == "gravity":
        return [SetParameter(time=0.0, path="world.gravity", value=[live.scene.world.gravity[0], float(value)])]
    if key in ("restitution", "friction"):
        return [SetParameter(time=0.0, path=path, value=float(value)) for path in _paths(live, key, picked)]
    if key in ("substeps", "iterations"):
        return [Switch(time=0.0, settings={key: round(float(value))})]
    return [Switch(time=0.0, settings={key: value})]


def _paths(live: LiveView, key: str, picked: int | None) -> list[str]:
    """Return the scene paths of a property: of the picked body or its pairs, or of all pairs, bodies and generators."""
    scene = live.scene
    index = _source_index(live, picked)
    if picked is not None and index >= len(scene.body_sources):
        element = live.bodies.elements[int(live.bodies.element[picked])]
        pairs = _pairs(scene, element)
        if pairs:
            return [f"pair.{n}.{key}" for n in pairs]
        return [f"{heading_of(element)}.{_quoted(live.bodies.names[picked])}.{key}"]
    if index < len(scene.body_sources):
        pairs = _pairs(scene, scene.body_sources[index] if picked is not None else None)
        if pairs:
            return [f"pair.{n}.{key}" for n in pairs] if picked is not None else [f"pair.*.{key}"]
    lists: list[tuple[str, Sequence[BodySource]]] = list(scene.kinds.items())
    if picked is None:
        return [f"{kind}.{each}.{key}" for kind, discs in lists if discs for each in _element_paths(discs)]
    for kind, discs in lists:
        if index < len(discs):
            return [f"{kind}.{_element_path(discs, index)}.{key}"]
        index -= len(discs)
    return []


def _element_paths(discs: Sequence[BodySource]) -> list[str]:
    """Return the path parts of all elements of a list: `*`, unless an element has that name."""
    return [_element_path(discs, k) for k in range(len(discs))] if any(disc.name == "*" for disc in discs) else ["*"]


def _element_path(discs: Sequence[BodySource], index: int) -> str:
    """Return the path part of an element of a list: its index, or its name if an element is named like the index."""
    name = discs[index].name
    if name is None or all(disc.name != str(index) for disc in discs):
        return str(index)
    return _quoted(name)


def _quoted(name: str) -> str:
    """Return a name as a path part, quoted if necessary."""
    if "." not in name and name[0] not in "\"'":
        return name
    quote = "'" if '"' in name else '"'
    return f"{quote}{name}{quote}"
