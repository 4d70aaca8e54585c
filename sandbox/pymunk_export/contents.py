"""Static colliders, bodies and joints of a scene as blocks of statements, in the engine's order."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from sandbox.arrays import BoolArray, IntArray
from sandbox.engines.common.colliders import wall_segments
from sandbox.engines.common.collision_bits import (
    COLLIDES_ALL,
    COLLIDES_FIXED,
    STATIC,
    bits_of_body,
    bits_of_sensor,
    bits_of_static,
)
from sandbox.engines.common.pair_factors import factors, wrong_pairs
from sandbox.engines.pymunk_adapter.colliders import half_plane_ends, reach_of, shuffled
from sandbox.engines.pymunk_adapter.contact_names import is_captured
from sandbox.engines.pymunk_adapter.joints import anchor_across_axis
from sandbox.engines.sensors import sensor_names
from sandbox.pymunk_export.loops import Block, comment
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.joint_arrays import WORLD, JointArrays, JointKind
from sandbox.scene.compile.paths import PathMotion
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BACKING, Point
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.description.world import Settings
from sandbox.scene.geometry.shapes import geometry_of, pieces_of


def literal(value: object) -> str:
    """Return the source of a number, text, or tuple of these. `repr` of a float is exact; `INFINITY` is a constant."""
    if isinstance(value, tuple | list):
        inner = ", ".join(map(literal, value))
        return f"({inner},)" if len(value) == 1 else f"({inner})"
    if isinstance(value, float) and math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    if isinstance(value, str) and '"' not in value and "'" not in value:
        return f'"{repr(value)[1:-1]}"'  # double quotes, as formatters write them
    return repr(value)


@dataclass(frozen=True)
class PairRule:
    """Coefficients of a pair of surfaces that the factors of its shapes cannot express."""

    types: tuple[int, int]
    """collision types of the shapes"""
    restitution: float
    friction: float
    slip: float
    """m/s, as in `PairTable.slip_target`"""


class Surfaces:
    """Elasticity, friction and surface velocity of shapes, and the pairs that need a callback."""

    def __init__(self, setup: Setup) -> None:
        matrix = contact_matrix(setup)
        table, touching = matrix.surfaces, matrix.touching
        self.of_shape, self.of_fixed = table.of_shape, table.of_fixed
        elasticity = factors(table.restitution, touching, [each.restitution for each in table.surfaces])
        friction = factors(table.friction, touching, [each.friction for each in table.surfaces])
        slips = np.triu(touching & (table.slip_target != 0.0) & (table.friction > 0.0))
        special = {
            *wrong_pairs(table.restitution, touching, elasticity),
            *wrong_pairs(table.friction, touching, friction),
            *((a, b) for a, b in np.argwhere(slips).tolist()),
        }
        self.rules = [
            PairRule(
                (a + 1, b + 1), *(float(each[a, b]) for each in (table.restitution, table.friction, table.slip_target))
            )
            for a, b in sorted(special)
        ]
        """pairs that need a callback"""
        typed = {surface for pair in special for surface in pair}
        velocities = [each.velocity for each in table.surfaces]
        self.has_velocities = any(map(any, velocities))
        """whether shapes have surface velocities"""
        self._values = [
            (
                elasticity[k],
                friction[k],
                *((velocities[k],) if self.has_velocities else ()),
                *((k + 1 if k in typed else 0,) if special else ()),
            )
            for k in range(len(elasticity))
        ]
        self._names: dict[tuple[float | Point, ...], str] = {}
        self._users: dict[str, dict[str, None]] = {}

    def name(self, surface: int, user: str) -> str:
        """Return the name of the constant for a surface of an object."""
        name = self._names.setdefault(self._values[surface], f"MATERIAL_{len(self._names) + 1}")
        self._users.setdefault(name, {})[user] = None
        return name

    @property
    def attributes(self) -> list[str]:
        """Attributes of a shape that a constant sets."""
        velocity = ["surface_velocity"] if self.has_velocities else []
        return ["elasticity", "friction", *velocity, *(["collision_type"] if self.rules else [])]

    @property
    def constants(self) -> list[str]:
        """Definitions of the constants that are used."""
        lines = []
        for values, name in self._names.items():
            first, *more = self._users[name]
            lines += [*comment(f"{first} and {len(more):,} more" if more else first), f"{name} = {literal(values)}"]
        return lines


FILTER_NAMES = {
    (STATIC, COLLIDES_ALL | COLLIDES_FIXED): "FIXED",
    (COLLIDES_ALL, STATIC | COLLIDES_ALL): "MOVING",
    (COLLIDES_FIXED, STATIC): "MOVING_AMONG_FIXED",
}
"""Names of the filters of scenes with one collision layer and no categories, by categories and mask."""


@dataclass
class Filters:
    """Collision filters that are used, by their names."""

    _names: dict[tuple[int, int, int], str] = field(default_factory=dict)

    def name(self, categories: int, mask: int, group: int = 0) -> str:
        """Return the name of the constant for a filter."""
        known = FILTER_NAMES.get((categories, mask)) if group == 0 else None
        return self._names.setdefault((group, categories, mask), known or f"FILTER_{len(self._names) + 1}")

    @property
    def constants(self) -> list[str]:
        """Definitions of the constants that are used."""
        lines = []
        for (group, categories, mask), name in self._names.items():
            first = f"group={group}, " if group else ""
            lines.append(f"{name} = pymunk.ShapeFilter({first}categories=0b{categories:b}, mask=0b{mask:b})")
        return lines


class Contents:
    """Blocks of a scene. The names of surfaces and filters are collected while blocks are made."""

    def __init__(self, setup: Setup, settings: Settings) -> None:
        self.setup, self.has_sleep = setup, bool(settings.sleeping)
        self.surfaces, self.filters = Surfaces(setup), Filters()
        self._matrix = contact_matrix(setup)
        bodies = setup.bodies
        self._thrusts = _thrusts_by_body(setup)
        pushed = np.asarray([name in self._thrusts for name in bodies.names], np.bool_)
        in_space = ~self._matrix.free | pushed | bodies.kinematic | bodies.limited | self.has_sleep
        self._is_in_space: BoolArray = np.asarray(in_space)
        collides = np.asarray([each.collides != "none" for each in bodies.elements], np.bool_)[bodies.element]
        self._has_shapes: BoolArray = self._is_in_space & (self._matrix.touches | (bodies.fixed & collides))
        self.hidden: IntArray = np.flatnonzero(~self._has_shapes)
        """bodies whose shapes are outside the space, because nothing can touch them"""

    @property
    def has_thrusts(self) -> bool:
        """Whether a thrust acts on a body."""
        return bool(self._thrusts)

    @property
    def has_paths(self) -> bool:
        """Whether a body moves along a path."""
        return bool(self.setup.bodies.paths)

    @property
    def scales_gravity(self) -> bool:
        """Whether gravity acts on a body by another factor than 1."""
        return self.setup.bodies.scales_gravity

    @property
    def has_limits(self) -> bool:
        """Whether the speed of a body is limited."""
        return bool(self.setup.bodies.limited.any())

    @property
    def static_order(self) -> list[int] | None:
        """Order in which the engine adds static shapes; None if it is theirs."""
        fixed = self.setup.scene.fixed
        count = sum(len(wall_segments(each)) if isinstance(each, Wall) else 1 for each in fixed)
        order = shuffled(count)
        return None if order == list(range(count)) else order

    def colliders(self) -> Iterator[Block]:
        """Yield the static colliders: each is a static body of its own, so that contacts identify it."""
        setup, scene = self.setup, self.setup.scene
        centre, reach = reach_of(setup.bodies.position[~setup.bodies.fixed])
        add = "space.add" if self.static_order is None else "static_shapes.append"
        static = ("body = pymunk.Body(body_type=pymunk.Body.STATIC)", "space.add(body)")
        surfaces = self.surfaces.of_fixed.tolist()
        for collider, name, surface in zip(scene.fixed, scene.fixed_names, surfaces, strict=False):
            title, chosen = literal(name), self.filters.name(*bits_of_static(scene, collider))
            added = f"{add}(with_surface(shape, {self.surfaces.name(surface, title)}, {chosen}))"
            match collider:
                case Plane():
                    a, b = half_plane_ends(collider, centre, reach)
                    values = {"a": literal(a), "b": literal(b), "radius": literal(BACKING)}
                    yield Block("half-planes", title, (*static, SEGMENT, added), values)
                case Wall():
                    yield from _wall_blocks(collider, title, static, added)
                case Post():
                    values = {"position": literal(collider.position), "radius": literal(collider.radius)}
                    circle = "shape = pymunk.Circle(body, {radius}, {position})"
                    yield Block("posts", title, (*static, circle, added), values)

    def bodies(self) -> Iterator[Block]:
        """Yield the bodies in the order in which the engine adds them; those outside its space come last."""
        inside, outside = np.flatnonzero(self._is_in_space), np.flatnonzero(~self._is_in_space)
        order, indices = shuffled(len(inside)), list(range(len(self.setup.bodies)))
        if order != list(range(len(inside))):
            indices = [*inside[order].tolist(), *outside.tolist()]
        for index in indices:
            yield self._body(index)

    def _body(self, index: int) -> Block:
        bodies, name = self.setup.bodies, self.setup.bodies.names[index]
        values = {
            "name": literal(name),
            "position": literal(tuple(bodies.position[index].tolist())),
            "angle": literal(float(bodies.angle[index])),
        }
        state = ["body.position = {position}", "body.angle = {angle}"]
        kind = "balls" if bodies.round[index] else "bodies"
        if bodies.fixed[index]:
            kind = f"fixed {kind}"
            new = "body = pymunk.Body(body_type=pymunk.Body.STATIC)"
        elif bodies.kinematic[index]:
            kind = f"kinematic {kind}"
            new = "body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)"
        else:
            new = "body = pymunk.Body({mass}, {moment})"
            moment = float(bodies.moment[index])
            is_turnable = self._matrix.turnable[index] or self.has_sleep
            values |= {
                "mass": literal(float(bodies.mass[index])),
                "moment": literal(moment if is_turnable else math.inf),
            }
        if not bodies.fixed[index]:
            values |= {
                "velocity": literal(tuple(bodies.velocity[index].tolist())),
                "angular_velocity": literal(float(bodies.angular_velocity[index])),
            }
            state += ["body.velocity = {velocity}", "body.angular_velocity = {angular_velocity}"]
        if index in bodies.paths:
            values["path"] = literal(_path_values(bodies.paths[index]))
            state += ["body.path = {path}", f"body.pose = pose_on_path(body.path, {literal(self.setup.time)})"]
        if name in self._thrusts:
            values["thrust"] = literal(self._thrusts[name])
            state.append("body.thrust = {thrust}")
        if bodies.gravity_scale[index] != 1.0:
            kind = f"{kind} with a gravity scale"
            values["gravity_scale"] = literal(float(bodies.gravity_scale[index]))
            own = (
                "velocity_func = gravity_times({gravity_scale})"
                if self.has_sleep
                else "gravity_scale = {gravity_scale}"
            )
            state.append(f"body.{own}")
        if bodies.limited[index]:
            kind = f"{kind} with speed limits"
            values["limits"] = literal((float(bodies.max_speed[index]), float(bodies.max_angular_velocity[index])))
            state.append("body.limits = {limits}")
        shapes, columns = self._shapes(index)
        lines = (new, *state, "space.add(body)", *shapes, "bodies[{name}] = body")
        return Block(kind, literal(name), lines, values | columns)

    def _shapes(self, index: int) -> tuple[list[str], dict[str, str]]:
        """Return the statements that create a body's shapes, and their columns."""
        bodies = self.setup.bodies
        if bodies.all_round:
            circle = self._shape("pymunk.Circle(body, {radius})", index, index)
            return circle, {"radius": literal(float(bodies.radius[index]))}
        pieces = bodies.shapes
        first, last = np.searchsorted(pieces.body, (index, index + 1)).tolist()
        lines: list[str] = []
        values: dict[str, str] = {}
        for number, piece in enumerate(range(first, last), start=1):
            corners = [tuple(each) for each in pieces.corner[pieces.first[piece] : pieces.first[piece + 1]].tolist()]
            shape, columns = _shape_of(corners, float(pieces.radius[piece]), "" if last - first == 1 else f"_{number}")
            created = self._shape(shape, index, piece)
            element = bodies.elements[bodies.element[index]]
            if is_captured(element) and len(created) == 2 and len(corners) > 2:
                (outline,) = (name for name in columns if name.startswith("corners"))
                created.insert(1, f"shape.unsafe_set_vertices({{{outline}}})  # starts at their first corner")
            lines += created
            values |= columns
        return lines, values

    def _shape(self, shape: str, index: int, piece: int) -> list[str]:
        """Return the statements that create one shape, and add it if its body can touch something."""
        if not self._has_shapes[index]:  # outside the space it costs no time
            return [f"{shape}  # only drawn"]
        bodies = self.setup.bodies
        bits = bits_of_body(self.setup.scene, bodies, index, int(bodies.layer[index]))
        chosen = self.filters.name(*bits, int(bodies.group[index]))
        material = self.surfaces.name(int(self.surfaces.of_shape[piece]), literal(bodies.names[index]))
        return [f"shape = {shape}", f"space.add(with_surface(shape, {material}, {chosen}))"]

    def sensors(self) -> Iterator[str]:
        """Yield the statements that create the shapes of the sensors."""
        scene, bodies = self.setup.scene, self.setup.bodies
        for sensor, name in zip(scene.sensors, sensor_names(scene), strict=True):
            body, (x, y), moves = "space.static_body", (0.0, 0.0), False
            if sensor.body is not None:
                index = bodies.number_of[sensor.body]
                body, moves = f"bodies[{literal(sensor.body)}]", not bodies.fixed[index]
                x, y = geometry_of(bodies.elements[bodies.element[index]]).centre
            chosen = self.filters.name(*bits_of_sensor(scene, sensor.detects, static=moves))
            yield f"body = {body}"
            yield f"sensors[{literal(name)}] = ["
            for piece in pieces_of(sensor):
                expression, values = _shape_of([(a - x, b - y) for a, b in piece.corners], piece.radius, "")
                yield f"    as_sensor({expression.format(**values)}, {chosen}),"
            yield "]"

    def joints(self) -> Iterator[Block]:
        """Yield the joints."""
        joints = self.setup.joints
        for k in range(len(joints)):
            kind = JointKind(int(joints.kind[k]))
            values = _joint_values(joints, k, self.setup.bodies.names)
            first = "space.static_body" if int(joints.a[k]) == WORLD else "bodies[{a}]"
            is_on_axis = kind == JointKind.GROOVE and joints.is_compound[k]
            own = AXIS_LINES if is_on_axis else JOINT_LINES[kind]
            lines = [line.replace("<a>", first).replace("<b>", "bodies[{b}]") for line in own]
            limits = {"max_force": joints.max_force[k], "max_bias": joints.max_bias[k], "error_bias": joints.bias[k]}
            if kind == JointKind.LINEAR_MOTOR:
                limits |= {"max_bias": abs(joints.figures[k, 2]), "error_bias": 0.0}
            columns = {key: literal(float(value)) for key, value in limits.items() if math.isfinite(value)}
            if joints.pulls_only[k]:
                lines += ["joint.damping = 0.0", "joint.force_func = pull({rest_length}, {stiffness}, {damping})"]
            stated = "".join(f", {key}={{{key}}}" for key in limits if key in columns)
            added = f"add_joint(space, joint, collide_bodies={bool(joints.collide[k])}{stated})"
            lines.append(added)
            if is_on_axis:
                lines += [AXIS_ENDS.replace("<a>", first).replace("<b>", "bodies[{b}]"), added]
            columns |= {name: value for name, value in values.items() if any(f"{{{name}}}" in line for line in lines)}
            title = literal(joints.names[k]) if joints.names[k] else f"joint {k + 1}"
            yield Block(f"{kind.name.lower().replace('_', ' ')} joints", title, tuple(lines), columns)


SEGMENT = "shape = pymunk.Segment(body, {a}, {b}, {radius})"


def _wall_blocks(wall: Wall, title: str, static: tuple[str, ...], added: str) -> Iterator[Block]:
    """Yield the body of a wall and its segments; a wall of one segment is one block."""
    parts, radius = wall_segments(wall), literal(wall.thickness / 2.0)
    if len(parts) == 1:
        values = {"a": literal(parts[0].a), "b": literal(parts[0].b), "radius": radius}
        yield Block("walls", title, (*static, SEGMENT, added), values)
        return
    yield Block("polylines", f"{title}: neighbours make its joints smooth, so that balls do not bump there", static)
    for number, part in enumerate(parts, start=1):
        ends = {"a": part.a, "b": part.b, "before": part.before or part.a, "after": part.after or part.b}
        values = {key: literal(end) for key, end in ends.items()} | {"radius": radius}
        yield Block("segments", str(number), (SEGMENT, "shape.set_neighbors({before}, {after})", added), values)


def _shape_of(corners: list[tuple[float, ...]], radius: float, ending: str) -> tuple[str, dict[str, str]]:
    """Return the expression of a convex piece and its columns, whose names get an ending."""
    values = {f"radius{ending}": literal(radius)}
    rounding = f"{{radius{ending}}}"
    match corners:
        case [centre]:
            if literal(centre) == "(0.0, 0.0)":  # pymunk's default
                return f"pymunk.Circle(body, {rounding})", values
            values[f"offset{ending}"] = literal(centre)
            return f"pymunk.Circle(body, {rounding}, {{offset{ending}}})", values
        case [a, b]:
            values |= {f"a{ending}": literal(a), f"b{ending}": literal(b)}
            return f"pymunk.Segment(body, {{a{ending}}}, {{b{ending}}}, {rounding})", values
        case _:
            values[f"corners{ending}"] = literal(corners)
            return f"pymunk.Poly(body, {{corners{ending}}}, radius={rounding})", values


def _path_values(motion: PathMotion) -> tuple[object, ...]:
    """Return the values of a path of which the program computes poses, as its `pose_on_path` takes them."""
    legs = tuple((leg.begin, leg.duration, tuple(leg.tail), tuple(leg.head)) for leg in motion.legs)
    cycle = None if motion.path.repeat == "once" else motion.cycle
    frame = motion.centre, motion.pivot, motion.lever, motion.angle
    return motion.path.start, cycle, motion.is_smooth, frame, legs


def _thrusts_by_body(setup: Setup) -> dict[str, tuple[float, float, float]]:
    """Return the sum of the thrusts on each body: force (x, y), N, in the body's frame, and torque, N·m."""
    bodies, loads = setup.bodies, dict[str, tuple[float, float, float]]()
    for thrust in setup.scene.thrusts:
        centre = geometry_of(bodies.elements[bodies.element[bodies.number_of[thrust.body]]]).centre
        arm = thrust.point[0] - centre[0], thrust.point[1] - centre[1]
        x, y, torque = loads.get(thrust.body, (0.0, 0.0, 0.0))
        fx, fy = thrust.force
        loads[thrust.body] = x + fx, y + fy, torque + arm[0] * fy - arm[1] * fx
    return loads


JOINT_LINES: dict[JointKind, tuple[str, ...]] = {
    JointKind.ROD: (
        "joint = pymunk.PinJoint(<a>, <b>, {anchor_a}, {anchor_b})",
        "joint.distance = {length}",
    ),
    JointKind.PIVOT: ("joint = pymunk.PivotJoint(<a>, <b>, {anchor_a}, {anchor_b})",),
    JointKind.SLIDE: ("joint = pymunk.SlideJoint(<a>, <b>, {anchor_a}, {anchor_b}, {least}, {most})",),
    JointKind.GROOVE: ("joint = pymunk.GrooveJoint(<a>, <b>, {anchor_a}, {far_end}, {anchor_b})",),
    JointKind.ROTARY_LIMIT: ("joint = pymunk.RotaryLimitJoint(<a>, <b>, {least}, {most})",),
    JointKind.MOTOR: ("joint = pymunk.SimpleMotor(<a>, <b>, {rate})",),
    JointKind.RATCHET: (
        "joint = pymunk.RatchetJoint(<a>, <b>, {offset}, {ratchet})",
        "joint.angle = {click}",
    ),
    JointKind.GEAR: ("joint = pymunk.GearJoint(<a>, <b>, {phase}, {ratio})",),
    JointKind.SPRING: (
        "joint = pymunk.DampedSpring(<a>, <b>, {anchor_a}, {anchor_b}, {rest_length}, {stiffness}, {damping})",
    ),
    JointKind.ROTARY_SPRING: ("joint = pymunk.DampedRotarySpring(<a>, <b>, {rest_angle}, {stiffness}, {damping})",),
    JointKind.LINEAR_MOTOR: (
        "# a motor along an axis: a rod that gets its length at the end of the travel, at the speed of the motor",
        "joint = pymunk.PinJoint(<a>, <b>, {before_axis}, {anchor_b})",
        "joint.distance = {end}",
    ),
}
"""Statements that create each kind of joint; <a> and <b> stand for its bodies."""


AXIS_LINES = (
    "# across the axis: a long rod at a right angle to it; then the ends of the travel",
    "joint = pymunk.PinJoint(<a>, <b>, {across_axis}, {anchor_b})",
    "joint.distance = {across}",
)
AXIS_ENDS = "joint = pymunk.SlideJoint(<a>, <b>, {before_axis}, {anchor_b}, {nearest}, {farthest})"
"""Statements that create the constraints of a wheel or prismatic joint along its axis"""


def _joint_values(joints: JointArrays, k: int, names: Sequence[str]) -> dict[str, str]:
    """Return the expressions of all columns of joint k, by the figures of `JointKind`.

    Rates and angles of pymunk's motors and rotary springs are those of the first body relative to the second, so that
    their signs are opposite.
    """
    x, y, z = map(literal, joints.figures[k].tolist())
    opposite = literal(-float(joints.figures[k, 0]))
    a = int(joints.a[k])
    along = joints.figures[k, :2] - joints.anchor_a[k]
    travel = math.hypot(*along.tolist())
    across, distance = anchor_across_axis(joints, k)
    return {
        "before_axis": literal(tuple((2.0 * joints.anchor_a[k] - joints.figures[k, :2]).tolist())),
        "across_axis": literal(across),
        "across": literal(distance),
        "nearest": literal(travel),
        "farthest": literal(2.0 * travel),
        "end": literal(travel if joints.figures[k, 2] < 0.0 else 2.0 * travel),
        "a": literal("" if a == WORLD else names[a]),
        "b": literal(names[int(joints.b[k])]),
        "anchor_a": literal(tuple(joints.anchor_a[k].tolist())),
        "anchor_b": literal(tuple(joints.anchor_b[k].tolist())),
        "length": x,
        "least": x,
        "most": y,
        "far_end": f"({x}, {y})",
        "rate": opposite,
        "click": x,
        "offset": y,
        "ratchet": z,
        "phase": x,
        "ratio": y,
        "rest_length": x,
        "rest_angle": opposite,
        "stiffness": y,
        "damping": z,
    }
