"""Scenes of pymunk spaces: bodies, shapes and joints of a running game as the elements of a scene file.

The scene states everything that pymunk computes with: mass and moment of each body, coefficients of each shape, and the
settings of the space. Elements are in the order in which the space has its shapes and joints, because contacts and
joints are solved in that order. So the engine `pymunk` continues a captured scene to the same bits as the space
itself, unless `CapturedSpace` has remarks.

What a scene cannot state is a remark and never left out silently: `omitted` changes the motion, `inexact` only its
rounding.
"""

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pymunk

from sandbox.engines.common.solver_settings import BIAS
from sandbox.engines.pymunk_adapter.contact_names import clashing_pairs
from sandbox.engines.pymunk_adapter.engine import PERSISTENCE, SLEEP_TIME
from sandbox.pymunk_capture.joint_capture import MIN_RADIUS, KeyValues, joint_values, point_of
from sandbox.pymunk_capture.shape_filters import MAX_CATEGORIES, FilterKind, SceneFilters
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import MAX_SPEED
from sandbox.scene.description.world import MAX_SLEEP_TIME
from sandbox.scene.editing.elements import unique_name
from sandbox.scene.errors import SceneError, quoted
from sandbox.scene.files.load import from_document
from sandbox.scene.geometry.shapes import UNTURNABLE

NOT_TURNED = "bodies that nothing can turn: the engine keeps their rotation free of rounding"
"""Remark on the motion of bodies without friction"""


class CaptureError(ValueError):
    """A space that cannot be a scene; `str()` has all reasons, one a line."""


@dataclass(frozen=True)
class CapturedSpace:
    """Scene of a space, and what it lacks."""

    scene: Scene
    omitted: tuple[str, ...]
    """what the scene cannot state, and its motion therefore lacks"""
    inexact: tuple[str, ...]
    """reasons for which the motion may differ from that of the space by rounding"""


def capture_space(
    space: pymunk.Space,
    *,
    dt: float = 1.0 / 60.0,
    duration: float = 10.0,
    title: str = "",
    names: Mapping[pymunk.Body, str] | None = None,
) -> CapturedSpace:
    """Return the scene of a space, from its present state on.

    Args:
        space: the space, between two steps. It is not changed.
        dt: the argument of the game's `space.step`, s.
        duration: of a run of the scene, s.
        title: of the scene.
        names: names of bodies; others are called `body-1`, `body-2` and so on in the order of the space.

    Raises:
        CaptureError: a body or a value is out of the range of scenes.
    """
    return scene_of(SpaceElements(space, {} if names is None else names), dt, duration, title)


def scene_of(capture: "SpaceElements", dt: float, duration: float, title: str) -> CapturedSpace:
    """Return the scene of the elements of a space, as `capture_space` does.

    Raises:
        CaptureError: as `capture_space`.
    """
    space = capture.space
    document: KeyValues = {
        "title": title,
        "world": {"gravity": point_of(space.gravity), "duration": duration} | damping_of(space),
        "solver": {
            "dt": dt,
            "iterations": int(space.iterations),
            "slop": float(space.collision_slop),
        },
    }
    # The engine's own defaults are left out, so that engines without these settings can run the scene.
    if space.collision_bias != BIAS:
        document["solver"]["bias"] = float(space.collision_bias)
    if space.collision_persistence != PERSISTENCE:
        document["solver"]["persistence"] = int(space.collision_persistence)
    document["solver"] |= sleep_settings_of(space)
    capture.note_space()
    document |= capture.elements()
    try:
        scene = from_document(document, "<pymunk space>")
    except SceneError as error:
        raise CaptureError(str(error)) from error
    setup = Setup.of(scene)
    moves = ~setup.bodies.fixed & (setup.bodies.moment < UNTURNABLE)
    if (moves & ~contact_matrix(setup).turnable & ~contact_matrix(setup).free).any():
        capture.inexact.append(NOT_TURNED)
    touches = contact_matrix(setup).touches
    untouched = ~touches & ~setup.bodies.fixed & touches.any()
    shaped = {capture.names[body] for body in capture.names if any(not shape.sensor for shape in body.shapes)}
    for name in sorted(shaped & {setup.bodies.names[k] for k in np.flatnonzero(untouched).tolist()}):
        capture.inexact.append(f"{name} can touch nothing, and the engine computes it without its shapes")
    return CapturedSpace(scene, tuple(dict.fromkeys(capture.omitted)), tuple(dict.fromkeys(capture.inexact)))


def damping_of(space: pymunk.Space) -> KeyValues:
    """Return the damping of a space as a key of `[world]`; empty if it has none, or one that a scene cannot have."""
    return {"damping": float(space.damping)} if 0.0 < space.damping < 1.0 else {}


def sleep_settings_of(space: pymunk.Space) -> KeyValues:
    """Return the sleep settings of a space as keys of `[solver]`; empty if no body falls asleep."""
    if space.sleep_time_threshold > MAX_SLEEP_TIME:
        return {}
    values: KeyValues = {"sleeping": True}
    if space.sleep_time_threshold != SLEEP_TIME:
        values["sleep_time"] = max(float(space.sleep_time_threshold), 0.0)
    if space.idle_speed_threshold:
        values["idle_speed"] = float(space.idle_speed_threshold)
    return values


class CaptureWarning(UserWarning):
    """Something in a pymunk space that the scene made from it does not have."""


def from_pymunk(
    space: pymunk.Space,
    *,
    dt: float = 1.0 / 60.0,
    duration: float = 10.0,
    title: str = "",
    names: Mapping[pymunk.Body, str] | None = None,
    strict: bool = False,
) -> Scene:
    """Return the scene of a pymunk space, from its present state on, as `capture_space` does.

    A `CaptureWarning` states each thing that the scene cannot have, such as collision callbacks. `capture_space`
    returns them instead, with the reasons for differences by rounding.

    Args:
        space: the space, between two steps. It is not changed.
        dt: the argument of the game's `space.step`, s.
        duration: of a run of the scene, s.
        title: of the scene.
        names: names of bodies; others are called `body-1`, `body-2` and so on in the order of the space.
        strict: raise an error in place of warnings.

    Raises:
        CaptureError: a body or a value is out of the range of scenes, or `strict` is set and something is left out.

    Example:
        >>> import pymunk
        >>> space = pymunk.Space()
        >>> space.gravity = 0, -9.81
        >>> ball = pymunk.Body(1.0, 0.1)
        >>> ball.position = 0, 5
        >>> space.add(ball, pymunk.Circle(ball, 0.5))
        >>> scene = sandbox.from_pymunk(space, dt=1 / 60, duration=1.0)
        >>> scene.balls[0].position
        (0.0, 5.0)
    """
    captured = capture_space(space, dt=dt, duration=duration, title=title, names=names)
    if strict and captured.omitted:
        raise CaptureError("a scene cannot have:\n" + "\n".join(captured.omitted))
    for each in captured.omitted:
        warnings.warn(f"left out of the scene: {each}", CaptureWarning, stacklevel=2)
    return captured.scene


class SpaceElements:
    """Converts the bodies, shapes and joints of a space.

    Args:
        space: the space.
        names: given names of bodies.
        is_recorded: a recording has what the game does after the scene, such as forces for the next step.
    """

    def __init__(self, space: pymunk.Space, names: Mapping[pymunk.Body, str], *, is_recorded: bool = False) -> None:
        self.space, self._is_recorded = space, is_recorded
        self.omitted: list[str] = []
        self.inexact: list[str] = []
        self._shapes = [shape for shape in space.shapes if shape.body is not None and not shape.sensor]
        self._sensors = [shape for shape in space.shapes if shape.body is not None and shape.sensor]
        used = [shape.body for shape in self._shapes]
        used += [shape.body for shape in self._sensors if self.is_kinematic(_body_of(shape))]
        used += [body for constraint in space.constraints for body in (constraint.a, constraint.b)]
        self._bodies = list(
            dict.fromkeys(
                body
                for body in (*space.bodies, *used)
                if body is not None and (body.body_type == pymunk.Body.DYNAMIC or body in used)
            )
        )
        self._filters = SceneFilters.of({FilterKind.of(shape) for shape in self._shapes})
        self._moving_groups = {each.filter.group for each in self._shapes if not FilterKind.of(each).is_static}
        self.names = self._unique_names(names)
        """name of each body"""
        self._origins: dict[pymunk.Body, None] = {}
        """static bodies at the origin that are second bodies of joints: fixed bodies without shapes"""
        shaped = {shape.body for shape in self._shapes}
        self._solid_worlds = {
            body
            for constraint in space.constraints
            if not constraint.collide_bodies
            for body in (constraint.a, constraint.b)
            if body in shaped and self._is_world(body)
        }
        """static bodies at the origin whose shapes are one body and not walls, because jointed bodies pass them"""
        self.paths: dict[pymunk.Shape, str] = {}
        """path of the table of each shape in the scene, such as `ball.body-1`; filled by `elements`"""
        self.joint_paths: dict[pymunk.Constraint, str] = {}
        """likewise of each joint, such as `joint[0]`"""

    def _unique_names(self, given: Mapping[pymunk.Body, str]) -> dict[pymunk.Body, str]:
        found: dict[pymunk.Body, str] = {}
        taken: set[str] = set()
        for body in (body for body in self._bodies if body in given):
            found[body] = unique_name(given[body], taken)
            taken.add(found[body])
        for k, body in enumerate(self._bodies, 1):
            if body not in given:
                found[body] = unique_name("world" if self._is_world(body) else f"body-{k}", taken)
                taken.add(found[body])
        return found

    def note_space(self) -> None:
        """Note the settings and callbacks of the space that a scene cannot state."""
        space = self.space
        self._note_contact_names()
        if not damping_of(space) and space.damping != 1.0:
            self.omitted.append(f"space.damping = {space.damping:g}; `world.damping` is above 0 and at most 1")
        if space.current_time_step:
            self.inexact.append(
                "the space has been stepped: impulses of its contacts, kept for warm starting, are not captured"
            )
        if space.threaded:
            self.inexact.append("the space is threaded, so that its own steps are not repeatable")
        if getattr(space, "_handlers", None):
            self.omitted.append(callbacks_remark(len(space._handlers)))
        if getattr(space, "_post_step_callbacks", None):
            self.omitted.append("post-step callbacks")

    def _note_contact_names(self) -> None:
        """Note if other pairs of shapes than in the space have contacts that share a name."""
        corners = [_corner_count(each) for each in self._shapes]
        here = clashing_pairs(range(len(corners)), corners)
        for a, b in sorted(here ^ clashing_pairs([each._hashid for each in self._shapes], corners)):
            names = " and ".join(self.names[_body_of(self._shapes[k])] for k in (a, b))
            where = "here" if (a, b) in here else "in the space"
            self.inexact.append(f"contacts of {names} share a name {where} only, as other shapes came before them")

    # Elements

    def elements(self) -> dict[str, list[KeyValues]]:
        """Return the elements by table."""
        tables: dict[str, list[KeyValues]] = {}
        fixed_count = self._leading_static_count()
        for shape in self._shapes[:fixed_count]:
            table, values = self._collider(shape)
            self.paths[shape] = f"{table}[{len(tables.setdefault(table, []))}]"
            tables[table].append(values)
        all_balls, in_order = True, list(self._bodies_in_order(self._shapes[fixed_count:]))
        if sleep_settings_of(self.space):
            self._note_order([body for body, _ in in_order])
        for body, shapes in in_order:
            table, values = self._body(body, shapes, can_be_ball=all_balls)
            all_balls = table == "ball"
            self.paths |= self._paths_of(table, body, shapes)
            tables.setdefault(table, []).append(values)
        joints: list[KeyValues] = []
        for constraint in self.space.constraints:
            joint = self._joint(constraint)
            if joint is not None:
                self.joint_paths[constraint] = f"joint[{len(joints)}]"
                joints.append(joint)
        names = {*self.names.values()}
        for shape in self._sensors:
            values = self._sensor(shape, unique_name(f"sensor-{len(tables.get('sensor', ())) + 1}", names))
            names.add(values["name"])
            tables.setdefault("sensor", []).append(values)
        for body in self._origins:
            origin = {"name": self.names[body], "position": [0.0, 0.0], "radius": MIN_RADIUS, "fixed": True}
            tables.setdefault("ball", []).append(origin | {"collides": "none"})
        return tables | ({"joint": joints} if joints else {})

    def _paths_of(
        self, table: str, body: pymunk.Body, shapes: Sequence[pymunk.Shape]
    ) -> Iterator[tuple[pymunk.Shape, str]]:
        """Yield the path of each shape of a body."""
        path, counts = f"{table}.{quoted(self.names[body])}", dict.fromkeys(_PART_OF.values(), 0)
        for shape in shapes:
            kind = _PART_OF[type(shape)]
            yield shape, path if table == "ball" else f"{path}.{kind}[{counts[kind]}]"
            counts[kind] += 1

    def _note_order(self, bodies: Sequence[pymunk.Body]) -> None:
        """Note if bodies are in another order than in the space: those that wake together have contacts in it."""
        moving = [body for body in bodies if body.body_type != pymunk.Body.STATIC]
        if moving != [body for body in self.space.bodies if body in set(moving)]:
            self.inexact.append("bodies were added in another order than their shapes, in which they wake here")

    def _leading_static_count(self) -> int:
        """Return how many of the first shapes become walls and posts: segments, then circles, at rest at the origin.

        The engine adds walls and posts before all bodies, and walls before posts.
        """
        count, circles = 0, False
        for shape in self._shapes:
            is_circle = isinstance(shape, pymunk.Circle)
            is_wall_or_post = is_circle or (isinstance(shape, pymunk.Segment) and not circles)
            if not self._is_world(_body_of(shape)) or _body_of(shape) in self._solid_worlds or not is_wall_or_post:
                break
            circles, count = is_circle, count + 1
        return count

    def _collider(self, shape: pymunk.Shape) -> tuple[str, KeyValues]:
        """Return the table and the values of a wall or post."""
        values = self._surface(shape) | self._filter_of(shape)
        if shape.filter.group and shape.filter.group in self._moving_groups:
            self.omitted.append("groups of static shapes")
        if isinstance(shape, pymunk.Circle):
            return "post", {"position": point_of(shape.offset), "radius": float(shape.radius)} | values
        assert isinstance(shape, pymunk.Segment)
        points = [point_of(shape.a), point_of(shape.b)]
        return "wall", {"points": points, "thickness": 2.0 * shape.radius} | values

    def _sensor(self, shape: pymunk.Shape, name: str) -> KeyValues:
        """Return the values of a sensor; that of a static body is fixed in the world."""
        body = _body_of(shape)
        values: KeyValues = {"name": name}
        moves = body.body_type != pymunk.Body.STATIC
        if moves:
            values["body"] = self.names[body]

        def placed(point: tuple[float, float]) -> list[float]:
            return point_of(point if moves else body.local_to_world(point))

        match shape:
            case pymunk.Circle():
                values |= {"position": placed(shape.offset), "radius": max(float(shape.radius), MIN_RADIUS)}
            case pymunk.Segment():
                values["points"] = [placed(shape.a), placed(shape.b)]
                values["thickness"] = 2.0 * max(float(shape.radius), _smallest_radius(body))
            case pymunk.Poly():
                values["points"] = [placed(each) for each in shape.get_vertices()]
                if shape.radius:
                    self.inexact.append(f"{name} is without the rounding of its polygon, {shape.radius:g} m")
        detects = self._detected_categories(shape)
        if detects is None:
            self.omitted.append(f"the filter of {name}, which detects what it overlaps")
        elif detects:
            values["detects"] = detects
        return values

    def _detected_categories(self, shape: pymunk.Shape) -> list[str] | None:
        """Return the categories that a sensor shape detects; empty if it detects all, None if none state its filter."""
        kind, known = FilterKind.of(shape), self._filters.values
        group = shape.filter.group
        if group and any(each.filter.group == group and each.body is not shape.body for each in self._shapes):
            return None
        others = {FilterKind.of(each) for each in self._shapes if each.body is not shape.body}
        others = {each for each in others if not (kind.is_static and each.is_static)}  # one of the two has to move
        detected = {each for each in others if kind.meets(each)}
        if any(known[each].get("collides") == "none" for each in detected):
            return None
        if detected == others:
            return []
        ignored = {name for each in others - detected for name in known[each].get("categories", ())}
        found = {name for each in detected for name in known[each].get("categories", ())} - ignored
        is_exact = all(found & {*known[each].get("categories", ())} for each in detected)
        is_exact &= all("categories" in known[each] for each in others - detected)
        return sorted(found) if found and is_exact else None

    def _bodies_in_order(self, shapes: Sequence[pymunk.Shape]) -> Iterator[tuple[pymunk.Body, list[pymunk.Shape]]]:
        """Yield each body with its shapes, in the order of the shapes; bodies without shapes come last."""
        of_body: dict[pymunk.Body, list[pymunk.Shape]] = {}
        before: pymunk.Body | None = None
        for shape in shapes:
            body = _body_of(shape)
            if body in of_body and body is not before:
                self.inexact.append(f"the shapes of {self.names[body]} were not added together")
            of_body.setdefault(body, []).append(shape)
            before = body
        yield from of_body.items()
        colliders = {shape.body for shape in self._shapes}
        yield from ((body, []) for body in self._bodies if body not in colliders and not self._is_world(body))

    def element_of(self, body: pymunk.Body) -> tuple[str, KeyValues]:
        """Return the table and the values of a body with the shapes that it has."""
        return self._body(body, [shape for shape in self._shapes if shape.body is body], can_be_ball=True)

    def _body(self, body: pymunk.Body, shapes: Sequence[pymunk.Shape], *, can_be_ball: bool) -> tuple[str, KeyValues]:
        """Return the table and the values of a body: a ball if it is one and may be one, or a body with parts."""
        ball = self._ball(body, shapes) if can_be_ball else None
        return ("body", self._compound(body, shapes)) if ball is None else ("ball", ball)

    def _ball(self, body: pymunk.Body, shapes: Sequence[pymunk.Shape]) -> KeyValues | None:
        """Return a body that is a single disc about its centre of mass; None for others."""
        if not shapes:
            return self._state(body, shapes) | {"radius": MIN_RADIUS, "collides": "none"}
        (shape, *others) = shapes
        if others or not isinstance(shape, pymunk.Circle) or any(shape.offset) or any(body.center_of_gravity):
            return None
        values = self._state(body, shapes) | {"radius": float(shape.radius)} | self._surface(shape)
        if "moment" in values and values["moment"] == 0.5 * values["mass"] * (shape.radius * shape.radius):
            del values["moment"]  # that of its shape
        return values

    def _compound(self, body: pymunk.Body, shapes: Sequence[pymunk.Shape]) -> KeyValues:
        """Return a body with its shapes as parts."""
        centre = body.center_of_gravity
        if any(centre):
            self.inexact.append(f"{self.names[body]} has a centre of gravity that is not its origin")
        values = self._state(body, shapes) | {"centre_of_mass": point_of(centre)}
        kinds = [_PART_OF[type(shape)] for shape in shapes]
        if kinds != sorted(kinds, key=list(_PART_OF.values()).index):
            self.inexact.append(f"the shapes of {self.names[body]} are not in the order circles, segments, polygons")
        for kind, shape in zip(kinds, shapes, strict=True):
            values.setdefault(kind, []).append(self._part(body, shape))
        if not shapes:
            values["ball"] = [{"radius": MIN_RADIUS}]
            values["collides"] = "none"
        return values

    def _part(self, body: pymunk.Body, shape: pymunk.Shape) -> KeyValues:
        """Return a shape as a part of its body."""
        values = self._surface(shape)
        match shape:
            case pymunk.Circle():
                return {"radius": float(shape.radius), "position": point_of(shape.offset)} | values
            case pymunk.Segment():
                smallest = _smallest_radius(body)
                if shape.radius < smallest:
                    self.inexact.append(f"a segment of {self.names[body]} has no radius; the scene has {smallest:g} m")
                ends = [point_of(shape.a), point_of(shape.b)]
                return {"radius": max(float(shape.radius), smallest), "ends": ends} | values
            case pymunk.Poly():
                rounding = {"radius": float(shape.radius)} if shape.radius else {}
                return {"points": [point_of(each) for each in shape.get_vertices()]} | rounding | values
        raise CaptureError(f"{self.names[body]} has a shape of an unknown type: {type(shape).__name__}")

    def _state(self, body: pymunk.Body, shapes: Sequence[pymunk.Shape]) -> KeyValues:
        """Return name, motion, mass and filter of a body."""
        name, is_kinematic = self.names[body], self.is_kinematic(body)
        values: KeyValues = {"name": name, "position": point_of(body.position)}
        if body.angle:
            values["angle"] = float(body.angle)
        if not (is_kinematic or body.body_type == pymunk.Body.DYNAMIC):
            if any(body.velocity) or body.angular_velocity:
                self.omitted.append(f"the velocity of {name}, which is not in the space")
            return values | {"fixed": True} | self._filter(name, shapes)
        self._note_body(body, name)
        if body.space is not self.space:
            raise CaptureError(f"{name} is a dynamic body of a joint, and not in the space")
        if is_kinematic:
            values["kinematic"] = True
        else:
            values["mass"] = float(body.mass)
            if math.isinf(body.moment):
                values["fixed_rotation"] = True
            else:
                values["moment"] = float(body.moment)
        values["velocity"] = point_of(body.velocity)
        if body.angular_velocity:
            values["angular_velocity"] = float(body.angular_velocity)
        return values | self._filter(name, shapes)

    def is_kinematic(self, body: pymunk.Body) -> bool:
        """Return whether a body moves at its velocity: it is kinematic, and in the space."""
        return body.body_type == pymunk.Body.KINEMATIC and body.space is self.space

    def _note_body(self, body: pymunk.Body, name: str) -> None:
        if getattr(body, "_velocity_func", None) is not None or getattr(body, "_position_func", None) is not None:
            effect = "; the recording sets the motion of the body after each step" if self._is_recorded else ""
            self.omitted.append(f"the velocity or position function of {name}{effect}")
        is_dynamic = body.body_type == pymunk.Body.DYNAMIC
        if not self._is_recorded and is_dynamic and (any(body.force) or body.torque):
            self.omitted.append(f"the force on {name} that was applied for the next step only")
        if body.is_sleeping:
            self.omitted.append(f"{name} sleeps; in the scene it starts awake")
        if math.hypot(*body.velocity) > MAX_SPEED:
            raise CaptureError(f"{name} is faster than {MAX_SPEED:g} m/s")

    def _surface(self, shape: pymunk.Shape) -> KeyValues:
        """Return the coefficients and the colour of a shape."""
        elasticity = float(shape.elasticity)
        if elasticity > 1.0:
            self.omitted.append(f"an elasticity of {elasticity:g}, which adds energy; the scene has a restitution of 1")
        values = coefficients_of(shape)
        if not any(shape.surface_velocity):
            del values["surface_velocity"]
        colour = getattr(shape, "color", None)
        if colour is not None:
            values["colour"] = "#" + "".join(f"{min(max(int(each), 0), 255):02x}" for each in tuple(colour)[:3])
        return values

    def _filter(self, name: str, shapes: Sequence[pymunk.Shape]) -> KeyValues:
        """Return what a body collides with."""
        if not shapes:
            return {}
        filters = [(shape.filter.group, self._filter_of(shape)) for shape in shapes]
        if any(each != filters[0] for each in filters):
            self.omitted.append(f"the different filters of the shapes of {name}")
        group, values = filters[0]
        return values | ({"group": f"group {group}"} if group else {})

    def _filter_of(self, shape: pymunk.Shape) -> KeyValues:
        """Return what a shape collides with."""
        if self._filters.has_too_many_categories:
            self.omitted.append(f"categories and masks of shape filters, of which more than {MAX_CATEGORIES} differ")
        return dict(self._filters.values[FilterKind.of(shape)])

    # Joints

    def _joint(self, constraint: pymunk.Constraint) -> KeyValues | None:
        """Return the joint of a constraint; None if a scene has no such joint."""
        a, b = constraint.a, constraint.b
        kind = type(constraint).__name__
        values = joint_values(constraint, self.space.collision_bias)
        if values is None:
            self.omitted.append(f"a {kind}")
            return None
        self._note_constraint(constraint, kind)
        if isinstance(constraint, pymunk.PinJoint) and values["length"] != constraint.distance:
            self.inexact.append(f"a PinJoint has the length {constraint.distance:g} m; the scene has 0 m")
        between = [self.names[body] for body in (a, b)]
        if self._is_world(b) and b not in self._solid_worlds:
            self._origins[b] = None
        elif self._is_world(a) and a not in self._solid_worlds:  # the scene states the anchor of the body first
            between = between[1:]
            if "anchors" in values:
                values["anchors"].reverse()
        return values | {"between": between, "collide": bool(constraint.collide_bodies)}

    def _is_world(self, body: pymunk.Body) -> bool:
        is_at_origin = not any(body.position) and not body.angle
        return body is self.space.static_body or (body.body_type == pymunk.Body.STATIC and is_at_origin)

    def _note_constraint(self, constraint: pymunk.Constraint, kind: str) -> None:
        if getattr(constraint, "_pre_solve_func", None) or getattr(constraint, "_post_solve_func", None):
            self.omitted.append(f"callbacks of a {kind}")


def callbacks_remark(count: int) -> str:
    """Return the remark on collision callbacks, of which a game has some."""
    return (
        f"{count} collision callback{'' if count == 1 else 's'} (space.on_collision). An impulse in a callback is that "
        "of one step, so that more substeps make it smaller: sum the impulses over the frame, or divide the threshold "
        "by the number of substeps"
    )


def coefficients_of(shape: pymunk.Shape) -> KeyValues:
    """Return the coefficients of a shape as keys of its table; a restitution is at most 1."""
    return {
        "restitution": min(float(shape.elasticity), 1.0),
        "friction": float(shape.friction),
        "surface_velocity": point_of(shape.surface_velocity),
    }


def _smallest_radius(body: pymunk.Body) -> float:
    """Return the smallest radius of a capsule that a scene allows, m: it follows from the extent of the body."""
    reach = 0.0
    for shape in body.shapes:
        for corner in shape.get_vertices() if isinstance(shape, pymunk.Poly) else _ends_of(shape):
            reach = max(reach, math.hypot(*corner) + shape.radius)
    return max(MIN_RADIUS, 2.0 * MIN_RADIUS * reach)


def _ends_of(shape: pymunk.Shape) -> tuple[pymunk.Vec2d, ...]:
    """Return the ends of a segment, or the centre of a circle, in the frame of the body."""
    if isinstance(shape, pymunk.Segment):
        return shape.a, shape.b
    assert isinstance(shape, pymunk.Circle)
    return (shape.offset,)


def _corner_count(shape: pymunk.Shape) -> int:
    """Return the number of corners of a shape: 1 of a circle, 2 of a segment."""
    if isinstance(shape, pymunk.Poly):
        return len(shape.get_vertices())
    return 2 if isinstance(shape, pymunk.Segment) else 1


_PART_OF: dict[type[pymunk.Shape], str] = {pymunk.Circle: "ball", pymunk.Segment: "capsule", pymunk.Poly: "polygon"}
"""KeyValues of the part for each type of shape, in the order in which the engine adds parts"""


def _body_of(shape: pymunk.Shape) -> pymunk.Body:
    assert shape.body is not None  # it is in a space
    return shape.body
