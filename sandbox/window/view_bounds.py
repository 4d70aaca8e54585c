"""View bounds: the initial view box of a scene before it runs, or of a stored run."""

import math

import numpy as np
import pygame

from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import UnknownEngineError, start
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.window.camera import Camera, ViewBox

RAIL_WIDTH = 0.115
"""width of the rails around a playing area, from the inner edge of the cushion, as a fraction of its shorter side"""
MAX_STEPS, MAX_BODY_STEPS = 12_000, 30_000
"""Limits of `predict_bounds`: steps, and steps times moving bodies; about half a second on pymunk."""
FLIGHT_SAMPLES = 17
"""Number of times at which positions in free flight are evaluated."""
MAX_ROLLING_TIME = 1.2
"""s of free flight considered on a surface, where friction and collisions end it"""
SURFACE_MARGIN = 0.12
"""Margin around bodies on a surface, relative to the size of their box."""
OUTLIER_PERCENT = 0.5
"""Percentage of positions ignored at each side if there are more than `OUTLIER_COUNT`."""
OUTLIER_COUNT = 1000
ANCHORED_KINDS = (JointKind.ROD, JointKind.PIVOT, JointKind.SLIDE, JointKind.GROOVE, JointKind.SPRING)
"""Joints with anchor points."""
MAX_VIEW = 1e15
"""m; larger coordinates are ignored"""
NEAR_DISTANCE = 0.1
"""Largest distance of visible static geometry from the bodies' box, relative to the size of the box."""
MAX_EXTENT = 20.0
"""Limit of static geometry and flights, as a multiple of the size of the initial box."""


def shorter_side(area: ViewBox) -> float:
    """Return the shorter side of an area, m."""
    (left, bottom), (right, top) = area
    return min(right - left, top - bottom)


def area_bounds(area: ViewBox) -> ViewBox:
    """Return the box of a playing area with the rails around it, m."""
    rail = RAIL_WIDTH * shorter_side(area)
    (left, bottom), (right, top) = area
    return (left - rail, bottom - rail), (right + rail, top + rail)


def has_field(scene: Scene) -> bool:
    """Return whether a scene has a field that must stay uncovered: a table, a game, or an explicit view."""
    return scene.play.area is not None or scene.play.view is not None or scene.play.game is not None


def field_rect(scene: Scene, camera: Camera) -> pygame.Rect:
    """Return the rectangle of `view_bounds` in the window, px."""
    corners = camera.to_screen(np.asarray(view_bounds(scene)))
    (left, top), (right, bottom) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return pygame.Rect(math.ceil(left), math.ceil(top), int(right - left), int(bottom - top))


def view_bounds(scene: Scene, reach: ViewBox | None = None) -> ViewBox:
    """Return the box around the bodies of a scene, their free flights, and nearby static geometry, m.

    For a table it is the box of the table. An explicit view of the scene takes precedence.

    Args:
        scene: the scene.
        reach: box of the positions that the bodies reach, m, from `predict_bounds` or a stored run.
    """
    if scene.play.view is not None:
        return scene.play.view
    if scene.play.area is not None:
        return area_bounds(scene.play.area)
    bodies = scene.bodies
    static_corners = [corners for corners in _wall_and_post_corners(scene) if (np.abs(corners) < MAX_VIEW).all()]
    discs = bodies.round | ~bodies.fixed  # a moving body may rotate within its circle; a static one does not
    circles = bounding_box(bodies.position[discs], bodies.radius[discs])
    static_boxes = [(corners.min(axis=0), corners.max(axis=0)) for corners in _static_body_corners(bodies)]
    if circles is None and not static_boxes:
        static_boxes = [(corners.min(axis=0), corners.max(axis=0)) for corners in static_corners] or [
            (-UNIT_BOX, UNIT_BOX)
        ]
    start = _union([*static_boxes, *([] if circles is None else [circles])])
    start = _union([start, *_swing_boxes(scene, bodies, start)])
    flights = _union(
        [start, *(_orbit_boxes(scene, bodies, start) if scene.attractions else _flight_boxes(scene, bodies))]
    )
    static = [(corners.min(axis=0), corners.max(axis=0)) for corners in static_corners]
    if reach is not None:
        start = _union([start, (np.asarray(reach[0]), np.asarray(reach[1]))])
        flights = _union([start, flights])
    margin = NEAR_DISTANCE * float((flights[1] - flights[0]).max())
    static = [
        each for each in static if (each[0] <= flights[1] + margin).all() and (each[1] >= flights[0] - margin).all()
    ]
    low, high = _union([start, *static]) if static else flights
    if scene.surface is not None:  # space for rolling
        low, high = low - SURFACE_MARGIN * (high - low).max(), high + SURFACE_MARGIN * (high - low).max()
    if scene.play.arrows is not None:  # space for moving the body
        low, high = low - 2.0 * scene.play.arrow_step, high + 2.0 * scene.play.arrow_step
    if not (high - low).max() > 0.0:
        low, high = low - UNIT_BOX, high + UNIT_BOX
    for plane in scene.planes:  # the closest point of the plane, if it is not far
        normal = np.asarray(plane.normal) / np.hypot(*plane.normal)
        middle = (low + high) / 2.0
        nearest = middle - ((middle - np.asarray(plane.point)) @ normal) * normal
        if np.abs(nearest - middle).max() <= MAX_EXTENT * float((high - low).max()):
            low, high = np.minimum(low, nearest), np.maximum(high, nearest)
    return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))


def predict_bounds(scene: Scene, engine: str, settings: Settings | None = None) -> ViewBox | None:
    """Return the box that the moving bodies stay in during a run without actions, by simulating it.

    Work is limited by counts, so that the result is machine-independent: `MAX_STEPS` steps and `MAX_BODY_STEPS` steps
    times bodies. The run ends early at the duration of the scene, or if the box exceeds `MAX_EXTENT` times the initial
    view. Returns None if nothing moves, the scene sets its view, or the engine cannot run the scene.
    """
    bodies, world, solver = scene.bodies, scene.world, scene.solver if settings is None else settings
    moving = np.flatnonzero(~bodies.fixed)
    if scene.play.view is not None or scene.play.area is not None or not len(moving):
        return None
    steps = min(round(world.duration / solver.dt), MAX_STEPS, MAX_BODY_STEPS // len(moving))
    try:
        simulation = start(scene, engine, settings)
    except (Refusal, UnknownEngineError):
        return None
    box = present_box = bounding_box(bodies.position[moving], bodies.radius[moving])
    (left, bottom), (right, top) = view_bounds(scene)
    farthest = MAX_EXTENT * max(right - left, top - bottom)
    try:
        for _ in range(steps):
            simulation.step()
            frame = simulation.frame()
            present = moving[frame.present[moving]]
            present_box = bounding_box(frame.position[present], bodies.radius[present])
            if present_box is None or box is None:
                continue
            union = _union([box, present_box])
            if not float((union[1] - union[0]).max()) <= farthest:
                break
            box = union
    except (Divergence, Exhaustion):
        pass
    finally:
        simulation.close()
    if box is None:
        return None
    low, high = box
    return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))


def should_rotate(scene: Scene, size: tuple[int, int]) -> bool:
    """Return whether a scene is a table that appears larger, in a view of a size in px, with the camera rotated."""
    if scene.play.area is None or scene.planes:
        return False
    (left, bottom), (right, top) = scene.play.area
    return (top - bottom > right - left) == (size[0] > size[1])


UNIT_BOX = np.ones(2)
Corners = tuple[FloatArray, FloatArray]
"""Lower left and upper right corner, (2,) m each."""


def _union(boxes: list[Corners]) -> Corners:
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def bounding_box(position: FloatArray, radius: FloatArray) -> Corners | None:
    """Return the box around circles at (M, 2) m, of many circles without outliers; None without circles."""
    is_counted = (np.abs(position) < MAX_VIEW).all(axis=1)
    position, radius = position[is_counted], radius[is_counted]
    if not len(position):
        return None
    if len(position) > OUTLIER_COUNT:
        size = float(np.median(radius))
        low, high = np.percentile(position, (OUTLIER_PERCENT, 100.0 - OUTLIER_PERCENT), axis=0)
        return low - size, high + size
    return (position - radius[:, None]).min(axis=0), (position + radius[:, None]).max(axis=0)


def _flight_boxes(scene: Scene, bodies: Bodies) -> list[Corners]:
    """Return the box of the bodies' free flights, which end at planes and world bounds."""
    world = scene.world
    chosen = np.flatnonzero(~_is_tethered(scene, bodies))
    chosen = chosen[:: max(1, len(chosen) // 5000)]  # a sample suffices
    duration = world.duration if scene.surface is None else min(world.duration, MAX_ROLLING_TIME)
    time = np.linspace(0.0, duration, FLIGHT_SAMPLES)[:, None, None]
    start, velocity = bodies.position[chosen], bodies.velocity[chosen]
    with np.errstate(all="ignore"):
        gravity = bodies.gravity_scale[chosen, None] * np.asarray(world.gravity)
        position = start + velocity * time + 0.5 * gravity * time**2
    radius = np.broadcast_to(bodies.radius[chosen], position.shape[:2])
    with np.errstate(all="ignore"):
        is_counted = (np.abs(position) < MAX_VIEW).all(axis=2)
        for plane in scene.planes:
            normal = np.asarray(plane.normal) / np.hypot(*plane.normal)
            is_counted &= (position - np.asarray(plane.point)) @ normal >= -radius
        if world.bounds is not None:
            is_counted &= ((position >= world.bounds[0]) & (position <= world.bounds[1])).all(axis=2)
        is_counted &= ~_has_fallen(scene, bodies, position)
    # A flight ends where it first leaves the allowed region.
    is_counted = np.logical_and.accumulate(is_counted, axis=0)
    found = bounding_box(position[is_counted], radius[is_counted])
    return [] if found is None else [found]


def _orbit_boxes(scene: Scene, bodies: Bodies, start: Corners) -> list[Corners]:
    """Return the boxes around attractors out to the apoapsis of each body's two-body orbit."""
    found, size = [], float((start[1] - start[0]).max())
    for each in scene.attractions:
        if isinstance(each.toward, str):
            body = bodies.names.index(each.toward)
            centre, drift = bodies.position[body], bodies.velocity[body]
        else:
            centre, drift = np.asarray(each.toward), np.zeros(2)
        offset, motion = bodies.position - centre, bodies.velocity - drift
        with np.errstate(all="ignore"):
            distance = np.hypot(*offset.T)
            size = max(size, float(distance.max(initial=0.0)))
            bound = each.strength / distance - 0.5 * (motion * motion).sum(axis=1)  # binding energy, J/kg
            spin = offset[:, 0] * motion[:, 1] - offset[:, 1] * motion[:, 0]
            eccentricity2 = np.maximum(1.0 - 2.0 * bound * (spin / each.strength) ** 2, 0.0)  # squared eccentricity
            farthest = np.where(bound > 0.0, 0.5 * each.strength / bound * (1.0 + np.sqrt(eccentricity2)), np.nan)
        farthest = farthest[~bodies.fixed & (farthest <= MAX_EXTENT * size)]
        if len(farthest):
            reach = float(farthest.max())
            found.append((centre - reach, centre + reach))
    return found


def _has_fallen(scene: Scene, bodies: Bodies, position: FloatArray) -> BoolArray:
    """Return which positions (T, M, 2) are below all static geometry, where the body would have landed, (T, M)."""
    gravity = np.asarray(scene.world.gravity)
    fixed = [*_wall_and_post_corners(scene), *_static_body_corners(bodies)]
    if not fixed or not gravity.any():
        return np.zeros(position.shape[:2], np.bool_)
    down = gravity / np.hypot(*gravity)
    ground = max(float((corners @ down).max()) for corners in fixed)
    with np.errstate(all="ignore"):
        depth = position @ down
    return np.asarray((depth > ground) & (depth[0] <= ground))  # a body that starts below never lands


def _static_body_corners(bodies: Bodies) -> list[FloatArray]:
    """Return corners (P, 2), m, of each piece of the static bodies other than discs."""
    shapes, found = bodies.shapes, []
    for piece in np.flatnonzero((bodies.fixed & ~bodies.round)[shapes.body]).tolist():
        body, radius = int(shapes.body[piece]), float(shapes.radius[piece])
        x, y = shapes.corner[shapes.first[piece] : shapes.first[piece + 1]].T
        cos, sin = np.cos(bodies.angle[body]), np.sin(bodies.angle[body])
        corners = bodies.position[body] + np.column_stack((cos * x - sin * y, sin * x + cos * y))
        if (np.abs(corners) < MAX_VIEW).all():
            found.append(np.concatenate((corners - radius, corners + radius)))
    return found


def _is_tethered(scene: Scene, bodies: Bodies) -> BoolArray:
    """Return which bodies are static or connected by joints to the world or to a static body, (N,)."""
    joints, found = scene.joint_arrays.of(*ANCHORED_KINDS), bodies.fixed.copy()
    found[joints.b[joints.a < 0]] = True
    pulleys = scene.joint_arrays.of(JointKind.PULLEY)
    found[pulleys.a] = found[pulleys.b] = True
    a, b = joints.a[joints.a >= 0], joints.b[joints.a >= 0]
    count = -1
    while (now := int(found.sum())) != count:
        count, either = now, found[a] | found[b]
        found[a[either]] = found[b[either]] = True
    return found


def _swing_boxes(scene: Scene, bodies: Bodies, start: Corners) -> list[Corners]:
    """Return the box of world anchors, and of the swings of bodies suspended from them by rods and strings."""
    joints = scene.joint_arrays
    if not len(joints):
        return []
    anchored = joints.some((joints.a < 0) & np.isin(joints.kind, ANCHORED_KINDS))
    anchor, position = anchored.anchor_a, bodies.position[anchored.b]
    size = float((start[1] - start[0]).max())
    is_near = ((anchor >= start[0] - MAX_EXTENT * size) & (anchor <= start[1] + MAX_EXTENT * size)).all(axis=1)
    points = [anchor[is_near], joints.of(JointKind.PULLEY).wheels.reshape(-1, 2)]
    if scene.world.gravity[0] == 0.0 and scene.world.gravity[1] < 0.0:
        swing = is_near & np.isin(anchored.kind, (JointKind.ROD, JointKind.SLIDE)) & ~bodies.fixed[anchored.b]
        anchor, position, radius = anchor[swing], position[swing], bodies.radius[anchored.b[swing]][:, None]
        length = np.hypot(*(position - anchor).T)
        opposite = np.column_stack((2.0 * anchor[:, 0] - position[:, 0], position[:, 1]))
        lowest = anchor - np.column_stack((np.zeros(len(length)), length))
        points += [each + sign * radius for each in (opposite, lowest) for sign in (-1.0, 1.0)]
    found = np.concatenate(points)
    return [(found.min(axis=0), found.max(axis=0))] if len(found) else []


def _wall_and_post_corners(scene: Scene) -> list[FloatArray]:
    """Return the bounding corners (P, 2), m, of each wall and post."""
    found = []
    for wall in scene.walls:
        points, half = np.asarray(wall.points), wall.thickness / 2.0
        found.append(np.concatenate((points - half, points + half)))
    sides = np.asarray([[-1.0, -1.0], [1.0, 1.0]])
    found += [np.asarray(post.position) + post.radius * sides for post in scene.posts]
    return found


STRAY_DISTANCE = 3.0
"""Distance from the central 80 % of positions up to which a body is shown, relative to their extent."""


def crowd_bounds(position: FloatArray, radius: FloatArray, anchors: FloatArray) -> ViewBox:
    """Return the box of the positions in a run, m, without bodies far from the others.

    Args:
        position: (T, N, 2) m; non-finite positions are ignored.
        radius: (N,) m
        anchors: (K, 2) m, points of static geometry, included if they are not far.
    """
    lower, upper = np.fmin.reduce(position, axis=0), np.fmax.reduce(position, axis=0)
    is_finite = np.isfinite(lower).all(axis=1) & np.isfinite(upper).all(axis=1)
    lower, upper = lower[is_finite] - radius[is_finite, None], upper[is_finite] + radius[is_finite, None]
    if not len(lower) and not len(anchors):
        return (-1.0, -1.0), (1.0, 1.0)
    corners = np.concatenate((lower, upper)) if len(lower) else anchors
    middle = np.percentile(corners, (10.0, 90.0), axis=0)
    with np.errstate(over="ignore"):  # in a diverged run
        reach = STRAY_DISTANCE * max(float((middle[1] - middle[0]).max()), 1e-9)
    points = np.concatenate((corners, anchors))
    kept = points[((points >= middle[0] - reach) & (points <= middle[1] + reach)).all(axis=1)]
    if not len(kept):
        kept = middle
    (left, bottom), (right, top) = kept.min(axis=0).tolist(), kept.max(axis=0).tolist()
    return (left, bottom), (right, top)


def anchor_points(scene: Scene) -> FloatArray:
    """Return points of static geometry, (K, 2) m: wall ends, boxes of posts, world anchors of joints; no planes."""
    points = [point for wall in scene.walls for point in wall.points]
    for post in scene.posts:
        (x, y), r = post.position, post.radius
        points += [(x - r, y - r), (x + r, y + r)]
    joints = scene.joint_arrays.some((scene.joint_arrays.a < 0) & np.isin(scene.joint_arrays.kind, ANCHORED_KINDS))
    points += [(x, y) for x, y in joints.anchor_a.tolist()]
    points += [(x, y) for x, y in scene.joint_arrays.of(JointKind.PULLEY).wheels.reshape(-1, 2).tolist()]
    return np.asarray(points, np.float64).reshape(-1, 2)
