"""Tunnelling: bodies that may pass through a thin object or a zone within one substep.

A discrete engine tests for overlap once a substep. A ball whose centre crosses the middle of a thin object within one
substep is not stopped: it tunnels. With a random phase the odds are 1 − reach/(v·h), where the reach is the ball's
radius and half the thickness of the object, or both radii for two balls with their relative speed. For any other body,
half its smallest width counts as the radius.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.sensors import SceneSensors, sensor_names
from sandbox.measure.preflight.diagnostic import ROUNDING, Diagnostic, floor_3_digits
from sandbox.measure.preflight.speed_bound import SpeedBounds, top_speeds
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.filters import filter_table, reachable_layers
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BACKING
from sandbox.scene.description.fixed import Plane, Post, Wall, mask_of
from sandbox.scene.description.world import Settings
from sandbox.scene.geometry.shapes import width_of

ANOTHER = "another ball"
ANOTHER_BODY = "another body"


@dataclass(frozen=True)
class TunnellingRisk:
    """Body that can tunnel through an object, and the longest substep at which it cannot."""

    ball: str
    thing: str
    speed: float
    """m/s, largest closing speed"""
    reach: float
    """m, displacement in a substep that is safe"""
    others: int = 0
    """number of other bodies that need about as short a substep"""
    struck: bool = False
    """whether the body reaches the speed only by impacts of others"""

    @property
    def safe_h(self) -> float:
        """Longest safe substep, s."""
        return self.reach / self.speed if self.speed > 0 else math.inf

    def odds(self, h: float) -> float:
        """Return the probability of a missed contact with a substep h, s, and a random phase."""
        displacement = self.speed * h
        return 1.0 - self.reach / displacement if displacement > self.reach else 0.0


CONTINUOUS = frozenset({"box2d"})
"""Engines with continuous collision of moving bodies with static ones, by the setting `continuous`."""
ONE_DETECTION_PER_STEP = frozenset({"box2d"})
"""Engines that find contacts once in each step, before its substeps; others find them in each substep."""


def is_continuous(settings: Settings, engine: str | None) -> bool:
    """Return whether an engine stops bodies at static objects, however fast they are."""
    return engine in CONTINUOUS and settings.continuous is not False


def intervals(settings: Settings, engine: str | None) -> int:
    """Return into how many intervals, at whose ends contacts are found, an engine divides a step."""
    return 1 if engine in ONE_DETECTION_PER_STEP else settings.substeps


def largest_safe_dt(scene: Scene, settings: Settings | None = None, engine: str | None = None) -> float | None:
    """Return the largest dt at which no body of the scene can tunnel, s, at its number of substeps.

    It is infinite if no body can tunnel at any dt, and None if bodies can collide and are accelerated by an amount that
    no formula bounds, as by kicks. Bodies that collide count with the speed that one would have with the energy of all:
    a light ball between a heavy one and a wall becomes faster with each impact.

    Args:
        scene: the scene.
        settings: settings of the run; default: those of the scene.
        engine: name of the engine; default: one that detects contacts at the end of a step.
    """
    settings = scene.solver if settings is None else settings
    matrix = contact_matrix(scene)
    found, times = tunnelling_risks(scene, matrix), detection_factor(settings)
    if is_continuous(settings, engine):
        found = [passage for passage in found if passage.thing in (ANOTHER, ANOTHER_BODY)]
    speeds = SpeedBounds(scene, matrix)
    if found and math.isfinite(times) and (speeds.unknown or (matrix.mutual and matrix.surfaces.kicks.any())):
        return None
    limits = [_safe_h_after_impacts(scene, speeds, is_continuous(settings, engine)), *(p.safe_h for p in found)]
    return min(limits) * intervals(settings, engine) * times


def _safe_h_after_impacts(scene: Scene, speeds: SpeedBounds, is_continuous: bool) -> float:
    """Return the longest substep, s, that is safe for bodies with the energy of all that collide; inf without impacts.

    Two bodies alone can collide once only, so that `SpeedBounds.struck` holds.
    """
    bodies, matrix = scene.bodies, speeds.matrix
    movers = np.flatnonzero(matrix.touches & ~bodies.immovable & (bodies.thin > 0.0))
    immovable = bool((bodies.immovable & matrix.touches).any())
    if not matrix.mutual or len(movers) + (bool(scene.fixed) or immovable) < 3:
        return math.inf
    mass, thin = bodies.mass[movers], bodies.thin[movers]
    limits = [math.inf]
    if (scene.walls or scene.posts or immovable) and not is_continuous:  # planes have no other side
        limits.append(_quotient(float((thin * np.sqrt(mass)).min()), math.sqrt(2.0 * speeds.energy)))
    if len(movers) > 1:
        # Largest speed at which two bodies with this energy approach each other
        closing = math.sqrt(2.0 * speeds.energy * float((1.0 / np.sort(mass)[:2]).sum()))
        limits.append(_quotient(float(np.sort(thin)[:2].sum()), closing))
    return min(limits)


def _quotient(length: float, speed: float) -> float:
    return length / speed if speed > 0.0 else math.inf


def detection_factor(settings: Settings) -> float:
    """Return the factor by which a detection method extends the safe displacement in a substep: 1 or inf.

    `swept` tests the whole path, and `shrink` divides it into short pieces. `bisect` only tests the end of a substep,
    and misses a body that is already past the middle. Measured with a bullet at a wall (`sandbox extremes --axes
    speed`): it passes from v·h of 1.00 times r + w/2 on, also with `bisect`; with the other two it does not pass at 100
    times.
    """
    return math.inf if settings.detection in ("swept", "shrink") else 1.0


MAX_PER_OBJECT = 5
"""Largest number of risks of one object: those that need the shortest substeps."""
SAME_RISK_RATIO = 1.1
"""Ratio of the safe substeps of two bodies up to which they are one risk."""


def tunnelling_risks(scene: Scene, matrix: ContactMatrix | None = None) -> list[TunnellingRisk]:
    """Return which bodies can tunnel through each object, and through each other, each at its own speed.

    Bodies with about the same safe substep are one risk with the values of the worst of them. If impacts by
    others can make a body faster than its own fall and forces, the worst such risk is added.
    """
    matrix = contact_matrix(scene) if matrix is None else matrix
    bodies = scene.bodies
    movers = np.flatnonzero(matrix.touches & ~bodies.fixed)
    if not len(movers):
        return []
    speeds = SpeedBounds(scene, matrix)
    half, struck, pushable = bodies.thin[movers], speeds.struck[movers], ~bodies.kinematic[movers]
    found: list[TunnellingRisk] = []

    def add(able: BoolArray, reach: FloatArray, speed: FloatArray, thing: str) -> None:
        rows = np.flatnonzero(able)
        if not len(rows):
            return
        groups = _groups(bodies.names, movers[rows], reach[rows], speed[rows], thing)
        found.extend(groups)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # bodies at rest never tunnel
            worst = rows[int(np.argmin(reach[rows] / struck[rows]))]
        fastest = TunnellingRisk(
            bodies.names[movers[worst]], thing, float(struck[worst]), float(reach[worst]), struck=True
        )
        if fastest.safe_h < groups[0].safe_h * (1.0 - ROUNDING):
            found.append(fastest)

    filters = filter_table(scene, bodies)
    for k, (thing, name) in enumerate(zip(scene.fixed, scene.fixed_names, strict=False)):
        if isinstance(thing, Plane) or thing.solid:
            add(
                pushable & filters.meets_fixed(k)[movers], half + _half_depth(thing), speeds.toward(thing)[movers], name
            )
    fixed = np.flatnonzero(bodies.fixed & matrix.touches)
    if matrix.mutual and len(fixed):
        thinnest = fixed[bodies.thin[fixed].argmin()]
        add(
            pushable,
            half + float(bodies.thin[thinnest]),
            speeds.own[movers],
            bodies.names[thinnest],
        )
    colliding = np.flatnonzero(collide_with_all(bodies)[movers])
    if matrix.mutual and len(colliding) > 1:
        found.extend(_mutual(scene, speeds, movers[colliding]))
    return found


def _groups(
    names: tuple[str, ...], number: IntArray, reach: FloatArray, speed: FloatArray, thing: str
) -> list[TunnellingRisk]:
    """Return a risk for each group of similar bodies, the shortest safe substep first, at most `MAX_PER_OBJECT`."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        safe = np.where(speed > 0.0, reach / speed, np.inf)  # bodies at rest never tunnel
    order = np.argsort(safe, kind="stable")
    safe = safe[order]
    never = int(np.searchsorted(safe, np.inf))
    found: list[TunnellingRisk] = []
    first = 0
    while first < len(order) and len(found) < MAX_PER_OBJECT and (first < never or not found):
        beyond = int(np.searchsorted(safe, SAME_RISK_RATIO * safe[first], side="right"))
        beyond = len(order) if beyond == never else beyond  # bodies that never tunnel belong to the last group
        k = order[first]
        risk = TunnellingRisk(names[number[k]], thing, float(speed[k]), float(reach[k]), others=beyond - first - 1)
        found.append(risk)
        first = beyond
    return found


MAX_MUTUAL = 200
"""Bodies of which every pair is examined: the fastest and the thinnest."""


def _mutual(scene: Scene, speeds: SpeedBounds, number: IntArray) -> list[TunnellingRisk]:
    """Return the risks of bodies through each other: the worst of each body, and similar ones once."""
    bodies = scene.bodies
    another = ANOTHER if bodies.round[number].all() else ANOTHER_BODY
    if len(number) > MAX_MUTUAL:
        with np.errstate(divide="ignore", over="ignore"):
            order = np.argsort(bodies.thin[number] / speeds.own[number], kind="stable")
        number = number[order[:MAX_MUTUAL]]
    half, unstruck = bodies.thin[number], speeds.own[number]
    struck = np.maximum(unstruck, speeds.struck[number])
    reach = half[:, None] + half
    only_two = len(number) == 2 and not scene.fixed and not bodies.fixed.any()
    closing = unstruck[:, None] + unstruck
    has_forces = scene.attractions or scene.thrusts or scene.tyres or scene.liquids or is_driven(scene, bodies).any()
    if only_two and not len(scene.joint_arrays) and not has_forces:
        velocity = bodies.velocity[number]
        closing = np.full((2, 2), float(np.hypot(*(velocity[0] - velocity[1]))))
    meets = filter_table(scene, bodies).meets(number[:, None], number)
    meets &= ~(bodies.kinematic[number][:, None] & bodies.kinematic[number])
    other, _ = _shortest_safe(reach, np.where(meets, closing, 0.0))
    rows = np.arange(len(number))
    speed = np.where(meets[rows, other], closing[rows, other], 0.0)
    found = _groups(bodies.names, number, reach[rows, other], speed, another)
    found = [replace(found[0], others=0)] if len(number) == 2 else found
    closing = np.where(meets, struck[:, None] + struck, 0.0)
    other, safe = _shortest_safe(reach, closing)
    k = int(safe.argmin())
    last = other[k]
    fastest = TunnellingRisk(
        bodies.names[number[k]], another, float(closing[k, last]), float(reach[k, last]), struck=True
    )
    return [*found, fastest] if not only_two and fastest.safe_h < found[0].safe_h * (1.0 - ROUNDING) else found


def _shortest_safe(reach: FloatArray, closing: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the other body with which each has the shortest safe substep, (N,), and that substep, (N,) s."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # bodies at rest never tunnel
        safe = np.where(closing > 0.0, reach / closing, np.inf)
    safe[np.eye(len(safe), dtype=np.bool_)] = np.inf
    other = safe.argmin(axis=1)
    other = np.where(other == np.arange(len(safe)), (other + 1) % len(safe), other)  # where all are inf
    return other, safe.min(axis=1)


def collide_with_all(bodies: Bodies) -> BoolArray:
    """Return which bodies can collide with other bodies, (N,)."""
    return np.asarray([e.collides == "all" for e in bodies.elements], dtype=np.bool_)[bodies.element]


def _half_depth(thing: Plane | Wall | Post) -> float:
    """Return the depth behind its surface up to which an object pushes a centre back, m."""
    match thing:
        case Plane():
            return BACKING
        case Wall():
            return thing.thickness / 2.0
        case Post():
            return thing.radius


def entry_warnings(scene: Scene, settings: Settings, matrix: ContactMatrix) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each zone whose smallest width the fastest body can cross in a substep."""
    noted = np.flatnonzero(matrix.can_enter_zone)
    if not len(noted):
        return
    speeds, layers = top_speeds(scene, matrix)[noted], reachable_layers(scene, scene.bodies)[noted]
    names = scene.fixed_names[len(scene.fixed) + len(scene.pockets) :]
    for zone, name in zip(scene.zones, names, strict=False):  # sensors follow
        able = np.flatnonzero(layers & mask_of(zone.layers, scene.layers))
        if not len(able):
            continue
        k = int(able[np.argmax(speeds[able])])
        body, speed, width = scene.bodies.names[noted[k]], float(speeds[k]), width_of(zone)
        odds = 1.0 - width / (speed * settings.h) if speed > 0.0 else 0.0
        if odds <= ROUNDING:
            continue
        safe = width / speed * settings.substeps
        message = (
            f"{body!r} can reach {speed:.4g} m/s, {speed * settings.h:.3g} m per substep, and pass through the zone "
            f"{name!r}, {width:.3g} m wide at its narrowest, undetected: odds up to {100 * odds:.3g} %; "
            f"dt <= {floor_3_digits(safe)} s is safe"
        )
        yield Diagnostic("entry", message, {"ball": body, "thing": name, "speed": speed, "odds": odds, "safe_dt": safe})


def sensor_warnings(scene: Scene, settings: Settings, matrix: ContactMatrix) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each sensor past which the fastest body can move between the ends of two steps.

    A body overlaps the sensor while its centre moves the width of both at least: the smallest width of the sensor, and
    the diameter of the largest disc about the centre inside the body.
    """
    if not scene.sensors:
        return
    bodies, sensors = scene.bodies, SceneSensors(scene, scene.bodies)
    speeds = top_speeds(scene, matrix)
    for number, (sensor, name) in enumerate(zip(scene.sensors, sensor_names(scene), strict=True)):
        able = np.flatnonzero(sensors.detectable(number) & np.isfinite(speeds))
        if not len(able):
            continue
        own = 0.0 if sensor.body is None else float(speeds[bodies.number_of[sensor.body]])
        speed, width = speeds[able] + own, width_of(sensor) + 2.0 * bodies.core[able]
        k = int(np.argmax(speed / width))
        odds = 1.0 - float(width[k]) / (float(speed[k]) * settings.dt) if speed[k] > 0.0 else 0.0
        if odds <= ROUNDING or not math.isfinite(own):
            continue
        body, safe = bodies.names[able[k]], float(width[k] / speed[k])
        message = (
            f"{body!r} and the sensor {name!r} can approach at {speed[k]:.4g} m/s, {speed[k] * settings.dt:.3g} m per "
            f"step, and pass each other undetected: they overlap over {width[k]:.3g} m, odds up to {100 * odds:.3g} %; "
            f"dt <= {floor_3_digits(safe)} s is safe"
        )
        yield Diagnostic(
            "entry", message, {"ball": body, "thing": name, "speed": float(speed[k]), "odds": odds, "safe_dt": safe}
        )
