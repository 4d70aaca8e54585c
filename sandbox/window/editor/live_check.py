"""Live check: the diagnostics of a scene while it is edited, the elements that cause them, and remedies.

The diagnostics are those of `sandbox check --no-trial`: formulas, without a run. A remedy is computed from the figures
of its diagnostic. Applied to the scene, it removes the diagnostic; others of the same kind, for other bodies or at a
higher speed, can remain.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from sandbox.engines.registry import ENGINES
from sandbox.measure.metrics.clearance import bounding_clearances
from sandbox.measure.preflight.assessment import run_preflight
from sandbox.measure.preflight.checks import FAILED, MIN_ITERATIONS
from sandbox.measure.preflight.diagnostic import ROUNDING, Diagnostic
from sandbox.measure.preflight.joint_chains import MAX_STRETCH
from sandbox.measure.preflight.tunnelling import ANOTHER, ANOTHER_BODY
from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import MAX_STEPS, BodySpec, Point
from sandbox.scene.description.fixed import Plane, Post, Sensor, Wall
from sandbox.scene.description.joints import Anchored, Rod
from sandbox.scene.editing.elements import (
    STATIC_TABLES,
    ElementKey,
    all_elements,
    bodies_referred_to,
    element_at,
    element_of_body,
    elements_of_table,
)
from sandbox.scene.editing.transforms import Similarity, transform_element
from sandbox.scene.errors import SettingsError
from sandbox.scene.files.toml_changes import Change, RemoveValue, SetValue
from sandbox.window.editor.latest_job import LatestJob

CHECK_DELAY = 0.15
"""s without a change after which a scene is checked"""
MAX_CHECKED_BODIES, MAX_CHECKED_JOINTS = 20_000, 2_000
"""Largest scene that is checked: up to about 1 s, most of it for the modes of joints."""
ROUNDING_GAP = 2e-9
"""m, gap left between bodies that are moved apart, because positions are written with nine decimals. Overlaps with
static elements count from the slop of the engines on.
"""
BODY_DETAILS, STATIC_DETAILS = ("ball", "body", "other", "first", "second"), ("thing", "second")
"""Keys of the details of a diagnostic that name bodies, and static elements."""


@dataclass(frozen=True)
class Remedy:
    """Change of a scene that removes a diagnostic."""

    label: str
    """such as "dt 0.002 s", "4 substeps" or "thickness 0.05 m" """
    changes: tuple[Change, ...]


@dataclass(frozen=True)
class SceneMark:
    """Diagnostic of a scene, with the elements that cause it."""

    kind: str
    """of the diagnostic, such as `tunnelling`"""
    message: str
    """of the diagnostic"""
    elements: tuple[ElementKey, ...]
    """the elements that cause it; empty for the whole scene"""
    remedies: tuple[Remedy, ...]


@dataclass(frozen=True)
class CheckResult:
    """Result of the check of a scene."""

    marks: tuple[SceneMark, ...] = ()
    demands: tuple[str, ...] = ()
    """the physics that the scene needs"""
    engines: tuple[tuple[str, tuple[str, ...]], ...] = ()
    """each engine, and what it lacks for the scene; empty if it can run it"""
    note: str = ""
    """why the scene was not checked, if so"""


def check_scene(scene: Scene) -> CheckResult:
    """Check a scene by formulas, without a trial run. A large scene is not checked, which a note says."""
    needs = demands(scene)
    lacks = tuple((name, tuple(engine.missing(scene, scene.solver))) for name, engine in ENGINES.items())
    names = tuple(str(demand) for demand in Demand if demand in needs)
    bodies, joints = len(scene.bodies), len(scene.joint_arrays)
    if bodies > MAX_CHECKED_BODIES or joints > MAX_CHECKED_JOINTS:
        note = f"{bodies:,} bodies and {joints:,} joints are too many to be checked while editing; use sandbox check"
        return CheckResult((), names, lacks, note)
    found = run_preflight(scene, cover=0.0).warnings
    marks = tuple(
        SceneMark(each.kind, each.message, _elements_of(scene, each), tuple(_remedies(scene, each))) for each in found
    )
    return CheckResult(marks, names, lacks)


# --- Elements --------------------------------------------------------------------------------------------------------


def _elements_of(scene: Scene, diagnostic: Diagnostic) -> tuple[ElementKey, ...]:
    """Return the elements that a diagnostic names."""
    found: list[ElementKey | None] = []
    for key, value in diagnostic.details.items():
        if not isinstance(value, str) or value in (ANOTHER, ANOTHER_BODY):
            continue
        if key == "joint":
            found += _joint_elements(scene, value)
        elif key in BODY_DETAILS or key in STATIC_DETAILS:
            static = _static_element(scene, value) if key in STATIC_DETAILS else None
            found.append(_body_element(scene, value) if static is None else static)
    return tuple(dict.fromkeys(each for each in found if each is not None))


def _body_element(scene: Scene, name: str) -> ElementKey | None:
    body = scene.bodies.number_of.get(name)
    return None if body is None else element_of_body(scene, body)


def _static_element(scene: Scene, name: str) -> ElementKey | None:
    if name not in scene.fixed_names:
        return None
    index = scene.fixed_names.index(name)
    for table in STATIC_TABLES:  # in the order of `fixed_names`
        count = len(elements_of_table(scene, table))
        if index < count:
            return ElementKey(table, index)
        index -= count
    return None


def _joint_elements(scene: Scene, name: str) -> list[ElementKey | None]:
    """Return the joint of a name, or the body element, such as a cloth, that has it."""
    joints = scene.joint_arrays
    if name not in joints.names:
        return []
    index = int(joints.part_of[joints.names.index(name)])
    if index < len(scene.joints):
        return [ElementKey("joint", index)]
    return [element_of_body(scene, int(joints.b[index]))]


# --- Remedies --------------------------------------------------------------------------------------------------------


def _remedies(scene: Scene, diagnostic: Diagnostic) -> Iterator[Remedy]:
    """Yield the remedies of a diagnostic. Kinds without one: `rounding`, `event_rate` and `failed_forecast`."""
    details, solver = diagnostic.details, scene.solver
    match diagnostic.kind:
        case "tunnelling" | "depth" | "entry" | "orbit" | "spring" if "safe_dt" in details:
            is_strict = diagnostic.kind in ("orbit", "spring")
            yield from _step_remedies(scene, float(details["safe_dt"]) / solver.dt, is_strict=is_strict)
            if diagnostic.kind in ("tunnelling", "entry"):
                yield from _thickness(scene, diagnostic)
        case "spring":  # explicit Euler
            yield Remedy("default integrator", (RemoveValue(("solver", "integrator")),))
        case "kick_threshold":
            yield from _kick_remedies(scene, diagnostic)
        case "stack" | "mass_ratio" | "chain":
            yield from _iteration_remedies(scene, diagnostic)
        case "iterations":
            yield from _solver_remedy(scene, "iterations", MIN_ITERATIONS)
        case "duration":
            yield from _solver_remedy(scene, "dt", float(details["duration"]))
            yield Remedy(f"duration {details['dt']:g} s", (SetValue(("world", "duration"), details["dt"]),))
        case "overlap":
            yield from _separation(scene, diagnostic)
        case "anchors" | "joint_start":
            yield from _joint_remedies(scene, diagnostic)


def _step_remedies(scene: Scene, factor: float, *, is_strict: bool = False) -> Iterator[Remedy]:
    """Yield a shorter dt, and more substeps.

    Args:
        scene: the scene.
        factor: of the substep, at most; less than 1.
        is_strict: the substep must be shorter than that, not only as short.
    """
    solver, margin = scene.solver, ROUNDING if is_strict else 0.0
    if not 0.0 < factor < 1.0:
        return
    yield from _solver_remedy(scene, "dt", _rounded(solver.dt * factor * (1.0 - 1e3 * margin), is_up=False))
    yield from _solver_remedy(scene, "substeps", _ceil(solver.substeps / factor * (1.0 + 2.0 * margin)))


def _ceil(value: float) -> int:
    """Return the next integer; a value above one by rounding only counts as that one."""
    return math.ceil(min(value, 1e9) * (1.0 - ROUNDING))


def _rounded(value: float, *, is_up: bool) -> float:
    """Return a value with three digits, rounded up or down; up to rounding, it is on that side."""
    from decimal import ROUND_CEILING, ROUND_FLOOR, Context

    margin = -ROUNDING if is_up else ROUNDING
    context = Context(prec=3, rounding=ROUND_CEILING if is_up else ROUND_FLOOR)
    return float(context.create_decimal(value * (1.0 + margin)))


def _solver_remedy(scene: Scene, name: str, value: float) -> Iterator[Remedy]:
    """Yield the remedy that sets a key of `[solver]`, if its value is allowed."""
    try:
        solver = scene.solver.replace(**{name: value})
    except SettingsError:
        return
    if scene.world.duration / solver.h > MAX_STEPS:
        return
    label = f"dt {value:g} s" if name == "dt" else f"{value:,} {name}"
    yield Remedy(label, (SetValue(("solver", name), value),))


def _iteration_remedies(scene: Scene, diagnostic: Diagnostic) -> Iterator[Remedy]:
    """Yield more iterations, more substeps, and a shorter dt, for joints and stacks."""
    details, solver = diagnostic.details, scene.solver
    if "share" in details:  # stretch of a chain, proportional to h² / iterations
        excess = float(details["share"]) / MAX_STRETCH
        yield from _solver_remedy(scene, "iterations", _ceil(solver.iterations * excess))
        yield from _step_remedies(scene, 1.0 / math.sqrt(excess))
        return
    iterations = details["iterations"] if "iterations" in details else float(details["needed"]) * solver.h
    yield from _solver_remedy(scene, "iterations", _ceil(float(iterations)))
    yield from _step_remedies(scene, float(details["safe_dt"]) / solver.dt)


def _thickness(scene: Scene, diagnostic: Diagnostic) -> Iterator[Remedy]:
    """Yield a larger thickness of a wall, or of a strip that detects bodies, if there is room for it."""
    details = diagnostic.details
    key = _static_element(scene, str(details["thing"]))
    if key is None or details.get("others"):
        return
    element = element_at(scene, key)
    travel = float(details["speed"]) * (scene.solver.dt if isinstance(element, Sensor) else scene.solver.h)
    thickness = getattr(element, "thickness", None)
    points = getattr(element, "points", None)
    if thickness is None or points is None:
        return
    reach = float(details["safe_dt"]) / scene.solver.dt * travel
    added = 2.0 * (travel - reach) if isinstance(element, Wall) else travel - reach
    thicker = _rounded(thickness + added, is_up=True)
    length = sum(math.dist(a, b) for a, b in pairwise(points))
    if thicker >= length or (isinstance(element, Wall) and not _has_room(scene, element, 0.5 * (thicker - thickness))):
        return
    yield Remedy(f"thickness {thicker:g} m", (SetValue((*key.location, "thickness"), thicker),))


def _has_room(scene: Scene, wall: Wall, added: float) -> bool:
    """Return whether no moving body starts within a distance of a wall, m."""
    bodies = scene.bodies
    moving = ~bodies.fixed
    clearances = bounding_clearances(wall, bodies.position[moving], bodies.radius[moving])
    return bool((clearances >= added).all())


def _kick_remedies(scene: Scene, diagnostic: Diagnostic) -> Iterator[Remedy]:
    fall, threshold = float(diagnostic.details["fall"]), float(diagnostic.details["threshold"])
    yield from _step_remedies(scene, threshold / fall * (1.0 - 1e-6))  # below the threshold, not at it
    key = _static_element(scene, str(diagnostic.details["thing"]))
    if key is not None and getattr(element_at(scene, key), "kick", None) is not None:
        higher = _rounded(fall * (1.0 + 1e-6), is_up=True)
        yield Remedy(f"threshold {higher:g} m/s", (SetValue((*key.location, "kick", "threshold"), higher),))


def _joint_remedies(scene: Scene, diagnostic: Diagnostic) -> Iterator[Remedy]:
    """Yield swapped anchors, or the length of a rod as it is at the start."""
    for key in _joint_elements(scene, str(diagnostic.details["joint"])):
        if key is None or key.table != "joint":
            continue
        joint = element_at(scene, key)
        if diagnostic.kind == "joint_start":
            if isinstance(joint, Rod) and joint.length is not None:
                yield Remedy("length as it starts", (RemoveValue((*key.location, "length")),))
        elif isinstance(joint, Anchored):
            first, second = joint.anchors
            yield Remedy("swap the anchors", (SetValue((*key.location, "anchors"), [list(second), list(first)]),))


def _separation(scene: Scene, diagnostic: Diagnostic) -> Iterator[Remedy]:
    """Yield a shift of one of two overlapping elements by the depth of their overlap, if there is room for it.

    Only along the normal of a plane, or the line of centres of balls and posts: other overlaps have no direction.
    """
    details = diagnostic.details
    names = str(details["first"]), str(details["second"])
    static = _static_element(scene, names[1])
    order = (names,) if static is not None else (names, names[::-1])
    for name, other in order:
        key = _body_element(scene, name)
        if key is None or not isinstance(element_at(scene, key), BodySpec) or _is_referred_to(scene, name):
            continue
        normal = _direction_of_separation(scene, name, other, static)
        if normal is None:
            continue
        depth = float(details["depth"]) + (ROUNDING_GAP if static is None else 0.0)
        shift = normal[0] * depth, normal[1] * depth
        if not _is_free_at(scene, name, shift):
            continue
        position = transform_element(element_at(scene, key), Similarity(shift=shift)).get("position")
        if position is not None:
            value: Any = [round(each, 9) for each in position]
            yield Remedy(f"move {name!r} by {depth:.3g} m", (SetValue((*key.location, "position"), value),))
            return


def _is_referred_to(scene: Scene, name: str) -> bool:
    """Return whether a joint, force or drive refers to a body: it is not moved by itself."""
    return any(name in bodies_referred_to(element) for _, element in all_elements(scene))


def _direction_of_separation(scene: Scene, name: str, other: str, static: ElementKey | None) -> Point | None:
    """Return the unit vector along which a body leaves another one or a static element; None if it is unknown."""
    bodies, element = scene.bodies, None if static is None else element_at(scene, static)
    body = bodies.number_of[name]
    if isinstance(element, Plane):
        length = math.hypot(*element.normal)
        return element.normal[0] / length, element.normal[1] / length
    partner = bodies.number_of.get(other)
    if isinstance(element, Post):
        centre = np.asarray(element.position)
    elif element is None and partner is not None and bodies.round[partner]:
        centre = bodies.position[partner]
    else:
        return None
    x, y = (bodies.position[body] - centre).tolist()
    distance = math.hypot(x, y)
    return (x / distance, y / distance) if bodies.round[body] and distance > 0.0 else None


def _is_free_at(scene: Scene, name: str, shift: Point) -> bool:
    """Return whether the bounding disc of a body, moved by a vector in m, overlaps no others and no static elements.

    An element that it already touches, such as the one that it is moved out of, does not count.
    """
    bodies = scene.bodies
    body = bodies.number_of[name]
    before, radius = bodies.position[body], float(bodies.radius[body])
    after = before + np.asarray(shift)
    others = np.arange(len(bodies)) != body
    reach = bodies.radius[others] + radius
    old, new = (np.hypot(*(bodies.position[others] - place).T) - reach for place in (before, after))
    if ((new < 0.0) & (new < old)).any():
        return False
    for thing in scene.fixed:
        old_gap, new_gap = (
            float(bounding_clearances(thing, place[None], np.asarray([radius]))[0]) for place in (before, after)
        )
        if new_gap < 0.0 and new_gap < old_gap:
            return False
    return True


# --- Thread ----------------------------------------------------------------------------------------------------------


class LiveCheck(LatestJob[Scene, CheckResult]):
    """Checks the latest scene in a background thread, a moment after it has last changed.

    Args:
        check: the check; an exception that it raises becomes a mark.
        delay: s without a change after which a scene is checked.
    """

    def __init__(self, check: Callable[[Scene], CheckResult] = check_scene, delay: float = CHECK_DELAY) -> None:
        super().__init__(self._checked, "sandbox check", delay)
        self._check = check

    def _checked(self, scene: Scene) -> CheckResult:
        try:
            return self._check(scene)
        except Exception as error:  # noqa: BLE001, it is shown, and later scenes are checked
            message = f"the check failed with {type(error).__name__}: {error}; please report this scene"
            return CheckResult((SceneMark(FAILED, message, (), ()),))
