"""Source of a standalone pymunk program: settings with their reasons, `make_space`, `step`, and a window."""

import math
from collections.abc import Iterator, Sequence
from importlib.metadata import version

import numpy as np

from sandbox.echo import printable, shorten
from sandbox.engines.pymunk_adapter.colliders import reach_of
from sandbox.engines.pymunk_adapter.contact_names import numbers_to_skip
from sandbox.engines.pymunk_adapter.engine import PERSISTENCE, PymunkEngine
from sandbox.pymunk_export.contents import Contents, literal
from sandbox.pymunk_export.loops import Loops, comment
from sandbox.pymunk_export.obstacles import ProgramError, obstacles
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import Point
from sandbox.scene.description.world import Settings

WINDOW = 960, 600
"""px"""
MARGIN = 0.9
"""Part of the window that the scene fills."""
MAX_SCALE = 1e5
"""px/m: pygame takes coordinates up to 2³¹, and a half-plane is at least 20 km long."""
MAX_TITLE = 200
"""Characters of a title."""

ViewExtent = tuple[Point, Point]
"""Lower left and upper right corner, m."""


def program_text(
    start: Scene | Setup,
    settings: Settings | None = None,
    *,
    view: ViewExtent | None = None,
    step_reason: str = "",
    warnings: Sequence[str] = (),
    note: str = "",
) -> str:
    """Return the source of a program that computes the states of a scene on the pymunk engine, bit for bit.

    It imports only pymunk, and pygame for its window. The states of half-planes are the same as long as no body moves
    farther away than they reach at first, 5 km or twice the extent of the scene: then the engine extends them.

    Args:
        start: scene or setup.
        settings: default: those of the scene.
        view: box that the window shows; default: the bodies and static colliders.
        step_reason: comment on the step.
        warnings: comments on the settings.
        note: comment on the states of the program, below its first lines.

    Raises:
        ProgramError: a program cannot express the scene.
    """
    setup = Setup.of(start)
    settings = setup.scene.solver if settings is None else settings
    found = obstacles(setup, settings)
    if found:
        raise ProgramError(found)
    contents, loops = Contents(setup, settings), Loops()
    static = loops.write(list(contents.colliders()))
    bodies = loops.write(list(contents.bodies()))
    joints = loops.write(list(contents.joints()))
    sensors = list(contents.sensors())
    parts = [
        *_settings(setup, PymunkEngine().resolve(setup, settings), step_reason, warnings),
        *_view(setup, view),
        *_constants(contents),
        *loops.tables,
        *_helpers(contents),
        *_make_space(contents, static, bodies, joints),
        *_sensors(sensors),
        *_step(contents),
        *_main(contents),
    ]
    text = "\n".join(parts)
    header = _header(setup.scene, note, has_infinity="INFINITY" in text, has_math="math." in text)
    return "\n".join([*header, text]) + "\n"


def _header(scene: Scene, note: str, *, has_infinity: bool, has_math: bool) -> Iterator[str]:
    yield from (
        '"""A scene as a program for pymunk, written by `sandbox export`.',
        "",
        "Run it to see it in a window; that needs pygame. A game imports `make_space` and `step`. The states are those",
        f"of `sandbox run` on the engine pymunk, bit for bit, with pymunk {version('pymunk')}.",
        '"""',
        "",
        *(("import math", "") if has_math else ()),
        "import pymunk",
        "",
    )
    if note:
        yield from (*comment(note), "")
    if has_infinity:
        yield from ('INFINITY = float("inf")', "")
    yield f"TITLE = {literal(shorten(printable(scene.title), MAX_TITLE))}"
    if scene.about:
        yield from comment(scene.about)
    yield ""


def _settings(setup: Setup, settings: Settings, step_reason: str, warnings: Sequence[str]) -> Iterator[str]:
    """Yield the constants of the solver, each with its reason."""
    assert settings.slop is not None and settings.bias is not None and settings.persistence is not None
    scene = setup.scene
    stated = scene.solver
    yield "# Units are m, kg, s and rad; y points up."
    yield f"GRAVITY = {literal(scene.world.gravity)}"
    yield from comment(
        "A frame of the game, and the steps of the solver in a frame. The step is fixed: with another one the "
        "bodies move along other paths. Contacts are found at the end of a step only, so that a body passes a thin "
        f"collider if it moves farther in a step than its radius and half the thickness. {step_reason}"
    )
    yield f"DT = {literal(settings.dt)}"
    yield f"SUBSTEPS = {settings.substeps}"
    yield from comment("Iterations of the contact solver in each step: more for taller stacks and larger mass ratios.")
    yield f"ITERATIONS = {settings.iterations}"
    reason = "as the scene states"
    if stated.slop is None:
        reason = "1 % of the thinnest body's radius or half width. With pymunk's 0.1, small bodies sink into each other"
    yield from comment(f"Overlap that is not corrected, m: {reason}.")
    yield f"COLLISION_SLOP = {literal(settings.slop)}"
    reason = "as the scene states" if stated.bias is not None else "pymunk's default, a tenth corrected in 1/60 s"
    yield from comment(f"Part of an overlap, or of a joint's error, that is left after one second: {reason}.")
    yield f"COLLISION_BIAS = {literal(settings.bias)}"
    reason = "pymunk's default" if settings.persistence == PERSISTENCE else "as the scene states"
    yield from comment(f"Steps for which the impulses of a separated contact are kept for a warm start: {reason}.")
    yield f"COLLISION_PERSISTENCE = {settings.persistence}"
    if settings.sleeping:
        text = "Bodies that touch each other fall asleep if all are slower than the idle speed for so long, s and m/s"
        yield from comment(f"{text}. An idle speed of 0 stands for the speed that gravity adds in a step.")
        yield f"SLEEP_TIME_THRESHOLD = {literal(settings.sleep_time)}"
        yield f"IDLE_SPEED_THRESHOLD = {literal(settings.idle_speed)}"
    if scene.world.bounds is not None:
        yield from comment("Bodies whose centre leaves this box, m, are removed after a frame.")
        yield f"BOUNDS = {literal(scene.world.bounds)}"
    if warnings:
        yield from comment("Warnings of `sandbox check` at these settings:")
        for warning in warnings:
            yield from comment(f"- {warning}")
    yield ""


def _view(setup: Setup, view: ViewExtent | None) -> Iterator[str]:
    (left, bottom), (right, top) = _extent(setup) if view is None else view
    size = max((right - left) / WINDOW[0], (top - bottom) / WINDOW[1])
    scale = min(MARGIN / size, MAX_SCALE) if size > 0.0 and math.isfinite(size) else 1.0
    scale = float(f"{scale:.4g}")
    offset = (
        round(WINDOW[0] / 2 - scale * (left + right) / 2, 1),
        round(WINDOW[1] / 2 - scale * (bottom + top) / 2, 1),
    )
    yield "# Camera: pixels per metre, and the pixel of the origin, counted from the lower left corner of the window."
    yield f"WINDOW = {literal(WINDOW)}"
    yield f"SCALE = {literal(scale)}"
    yield f"OFFSET = {literal(offset)}"
    yield ""


def _extent(setup: Setup) -> ViewExtent:
    """Return the box around bodies, walls, posts and the ends of joints."""
    bodies, scene = setup.bodies, setup.scene
    radius = bodies.radius[:, None]
    corners = [bodies.position - radius, bodies.position + radius]
    corners += [np.asarray(each.points) for each in scene.walls]
    for post in scene.posts:
        corners += [np.asarray([post.position]) - post.radius, np.asarray([post.position]) + post.radius]
    corners += setup.joints.ends(bodies.position, bodies.angle) if len(setup.joints) else ()
    rows = np.concatenate(corners)
    if not len(rows):
        return (-1.0, -1.0), (1.0, 1.0)
    (left, bottom), (right, top) = rows.min(axis=0).tolist(), rows.max(axis=0).tolist()
    return (left, bottom), (right, top)


def _constants(contents: Contents) -> Iterator[str]:
    """Yield materials and filters. Blocks have been made before, so that only used ones are defined."""
    materials, filters = contents.surfaces.constants, contents.filters.constants
    if materials:
        *columns, last = (attribute.replace("_", " ") for attribute in contents.surfaces.attributes)
        yield from comment(
            f"Materials: {', '.join(columns)} and {last}. pymunk multiplies elasticity and friction of two shapes, so "
            "these are factors: their products are the coefficients of the pairs that can touch."
        )
        yield from materials
        yield ""
    if filters:
        yield from comment(
            "Filters: two shapes collide if the mask of each has a category of the other, unless they are in one group."
        )
        yield from filters
        yield ""
    order = contents.static_order
    if order is not None:
        yield "# Random order of the static shapes: pymunk's tree is slow for shapes added in a sorted line."
        yield from ("STATIC_ORDER = [", *_wrapped(order), "]", "")


def _wrapped(numbers: Sequence[int]) -> Iterator[str]:
    for first in range(0, len(numbers), 20):
        yield "    " + " ".join(f"{each}," for each in numbers[first : first + 20])


def _helpers(contents: Contents) -> Iterator[str]:
    if contents.surfaces.constants:
        columns = ", ".join(f"shape.{attribute}" for attribute in contents.surfaces.attributes)
        yield from (
            "",
            "def with_surface(shape, material, shape_filter):",
            '    """Set material and filter of a shape, and return it."""',
            f"    {columns} = material",
            "    shape.filter = shape_filter",
            "    return shape",
            "",
        )
    if contents.surfaces.rules:
        yield from (
            "",
            "def set_coefficients(arbiter, space, coefficients):",
            '    """Set restitution, friction and slip speed (m/s) of a contact, before it is solved."""',
            "    arbiter.restitution, arbiter.friction, slip = coefficients",
            "    if slip:  # a moving surface: the speed at which two surfaces do not rub, along the contact",
            "        normal, velocity = arbiter.normal, arbiter.surface_velocity",
            "        arbiter.surface_velocity = (velocity.x + slip * normal.y, velocity.y - slip * normal.x)",
            "",
        )
    if contents.scales_gravity and contents.has_sleep:
        yield from (
            "",
            "def gravity_times(scale):",
            '    """Return a velocity function with scaled gravity: a force would keep a body awake."""',
            "",
            "    def update_velocity(body, gravity, damping, dt):",
            "        pymunk.Body.update_velocity(body, (scale * gravity[0], scale * gravity[1]), damping, dt)",
            "",
            "    return update_velocity",
            "",
        )
    if len(contents.setup.joints):
        yield from (
            "",
            "def add_joint(",
            "    space, joint, collide_bodies, max_force=INFINITY, max_bias=INFINITY, error_bias=COLLISION_BIAS",
            "):",
            '    """Add a joint; by default its error is corrected as fast as overlaps are."""',
            "    joint.collide_bodies = collide_bodies",
            "    joint.error_bias = error_bias",
            "    joint.max_bias = max_bias",
            "    joint.max_force = max_force",
            "    space.add(joint)",
            "",
        )
    if contents.setup.joints.pulls_only.any():
        yield from (
            "",
            "def pull(rest, stiffness, damping):",
            '    """Return the force of a spring that only pulls. The damper is part of it: the own one would push."""',
            "",
            "    def force(spring, length):",
            "        if length <= rest:",
            "            return 0.0",
            "        rate = 0.0",
            "        if damping:",
            "            first = spring.a.local_to_world(spring.anchor_a)",
            "            second = spring.b.local_to_world(spring.anchor_b)",
            "            velocity = spring.b.velocity_at_world_point(second) - spring.a.velocity_at_world_point(first)",
            "            rate = velocity.dot(second - first) / length",
            "        return min(stiffness * (rest - length) - damping * rate, 0.0)",
            "",
            "    return force",
            "",
        )


def _make_space(contents: Contents, static: list[str], bodies: list[str], joints: list[str]) -> Iterator[str]:
    scene = contents.setup.scene
    yield from (
        "",
        "def make_space():",
        '    """Return the space, and a dict of its bodies by name."""',
        "    space = pymunk.Space()",
        "    space.gravity = GRAVITY",
        f"    space.damping = {literal(scene.world.damping)}",
        "    space.iterations = ITERATIONS",
        "    space.collision_slop = COLLISION_SLOP",
        "    space.collision_bias = COLLISION_BIAS",
        "    space.collision_persistence = COLLISION_PERSISTENCE",
    )
    if contents.has_sleep:
        yield "    space.sleep_time_threshold, space.idle_speed_threshold = SLEEP_TIME_THRESHOLD, IDLE_SPEED_THRESHOLD"
    skipped = numbers_to_skip(contents.setup.bodies)
    if skipped:
        yield f"    for _ in range({skipped}):  # Munk2D confuses contacts of the first shapes of a space"
        yield "        unused = pymunk.Circle(space.static_body, 1.0)"
        yield "        space.add(unused)"
        yield "        space.remove(unused)"
    if contents.has_paths:
        yield "    space.frames = 0  # made so far: the poses of bodies on paths follow from the time"
    yield "    bodies = {}"
    if contents.surfaces.rules:
        yield from _indented(["", *comment("Pairs of materials whose coefficients are no products of factors.")])
        for rule in contents.surfaces.rules:
            a, b = rule.types
            data = literal((rule.restitution, rule.friction, rule.slip))
            yield f"    space.on_collision({a}, {b}, pre_solve=set_coefficients, data={data})"
    if static:
        yield from _indented(
            ["", "# Static colliders: a static body each, so that a contact tells which one it is.", ""]
        )
        if scene.planes:
            _, reach = reach_of(contents.setup.bodies.position[~contents.setup.bodies.fixed])
            text = (
                "A half-plane is a segment so thick that its face is the plane. The thickness keeps a deep body from "
                f"falling out at the other side. Extend it if bodies move farther than {reach:,.0f} m."
            )
            yield from _indented(comment(text))
        if contents.static_order is not None:
            yield "    static_shapes = []"
        yield from _indented(static)
        if contents.static_order is not None:
            yield from ("    for k in STATIC_ORDER:", "        space.add(static_shapes[k])")
    if bodies:
        text = "Bodies. The order matters: pymunk solves contacts in an order that follows from it."
        if "INFINITY" in "".join(bodies):
            text += " A body that nothing can turn has an infinite moment of inertia."
        yield from _indented(["", *comment(text)])
        if len(contents.hidden):
            text = "A shape that is not added to the space is only drawn: nothing can touch its body."
            yield from _indented(comment(text))
        yield from _indented(["", *bodies])
    if joints:
        yield from _indented(["", "# Joints.", "", *joints])
    yield from ("    return space, bodies", "")


SENSED = '''
def as_sensor(shape, shape_filter):
    """Make a shape a sensor, and return it."""
    shape.sensor = True
    shape.filter = shape_filter
    return shape


def sensed(space, shapes):
    """Return the bodies that overlap the shapes of a sensor; static colliders are bodies too."""
    found = {}
    for shape in shapes:
        for hit in space.shape_query(shape):
            overlaps = any(point.distance for point in hit.contact_point_set.points)
            if hit.shape.body is not shape.body and overlaps:
                found[hit.shape.body] = None
    return list(found)
'''


def _sensors(statements: Sequence[str]) -> Iterator[str]:
    if not statements:
        return
    yield SENSED
    yield from (
        "",
        "def make_sensors(space, bodies):",
        '    """Return the shapes of each sensor by its name; they stay outside the space."""',
        "    sensors = {}",
        *_indented(statements),
        "    return sensors",
        "",
    )


def _indented(lines: Sequence[str]) -> Iterator[str]:
    return (f"    {line}" if line else "" for line in lines)


PATHS = '''
def pose_on_path(path, time):
    """Return x, y, m, and the angle, rad, of a body on its path at a time, s."""
    start, cycle, is_smooth, (centre, pivot, lever, angle), legs = path
    elapsed = time - start
    if elapsed > 0.0 and cycle is not None:
        elapsed = math.fmod(elapsed, cycle)
    # Each leg has its begin and duration, s, and displacement, m, and turn, rad, at both ends.
    begin, duration, tail, head = next((leg for leg in reversed(legs) if leg[0] <= elapsed), legs[0])
    if elapsed <= 0.0:
        x, y, turn = tail
    elif elapsed - begin >= duration:  # it waits at the end of the leg
        x, y, turn = head
    else:
        s = (elapsed - begin) / duration
        if is_smooth:  # at rest at both ends
            s = s * s * s * (s * (s * 6.0 - 15.0) + 10.0)
        x, y, turn = ((1.0 - s) * a + s * b for a, b in zip(tail, head))
    if not turn:
        return centre[0] + x, centre[1] + y, angle
    angle += turn
    cos, sin = math.cos(angle), math.sin(angle)
    dx, dy = cos * lever[0] - sin * lever[1], sin * lever[0] + cos * lever[1]
    return pivot[0] + x + dx, pivot[1] + y + dy, angle


def follow_paths(space, time, h):
    """Give the bodies on paths the velocity that leads to their pose after a step of h, s, from a time, s."""
    for body in space.bodies:
        path = getattr(body, "path", None)
        if path is not None:
            (x, y, angle), (end_x, end_y, end_angle) = body.pose, pose_on_path(path, time + h)
            body.position, body.angle = (x, y), angle  # without the rounding of the last step
            body.velocity = (end_x - x) / h, (end_y - y) / h
            body.angular_velocity = (end_angle - angle) / h
            body.pose = end_x, end_y, end_angle
'''


def _step(contents: Contents) -> Iterator[str]:
    if contents.has_paths:
        yield PATHS
    if contents.has_thrusts:
        yield from (
            "",
            "def apply_thrust(body, h):",
            '    """Set the thrust of a body, which turns with it: pymunk resets forces after each step."""',
            '    thrust = getattr(body, "thrust", None)',
            "    if thrust is not None:",
            "        x, y, torque = thrust",
            "        angle = body.angle + body.angular_velocity * h  # to which the step turns it",
            "        body.force = pymunk.Vec2d(x, y).rotated(angle)",
            "        body.torque = torque",
            "",
        )
    if contents.scales_gravity and not contents.has_sleep:
        yield from (
            "",
            "def scale_gravity(body):",
            '    """Add the force by which the gravity on a body differs: pymunk resets forces after each step."""',
            '    scale = getattr(body, "gravity_scale", 1.0)',
            "    if scale != 1.0:",
            "        x, y = GRAVITY",
            "        body.force += ((scale * x - x) * body.mass, (scale * y - y) * body.mass)",
            "",
        )
    if contents.has_limits:
        yield from (
            "",
            "def limit_speed(body):",
            '    """Reduce velocity and angular velocity of a body to its limits."""',
            "    speed, spin = body.limits",
            "    x, y = body.velocity",
            "    fast = math.hypot(x, y)",
            "    if fast > speed:",
            "        change = speed / fast - 1.0",
            "        body.velocity = x + change * x, y + change * y",
            "    if abs(body.angular_velocity) > spin:",
            "        body.angular_velocity = math.copysign(spin, body.angular_velocity)",
            "",
        )
    yield from (
        "",
        "def step(space):",
        '    """Advance by one frame, DT."""',
        "    h = DT / SUBSTEPS",
    )
    if contents.has_paths:
        began = contents.setup.time
        time = f"{literal(began)} + (space.frames * DT + k * h)" if began else "space.frames * DT + k * h"
        yield from ("    for k in range(SUBSTEPS):", f"        follow_paths(space, {time}, h)")
    else:
        yield "    for _ in range(SUBSTEPS):"
    if contents.has_thrusts:
        yield from ("        for body in space.bodies:", "            apply_thrust(body, h)")
    if contents.scales_gravity and not contents.has_sleep:
        yield from ("        for body in space.bodies:", "            scale_gravity(body)")
    yield "        space.step(h)"
    if contents.has_limits:
        yield from (
            "        for body in space.bodies:",
            '            if hasattr(body, "limits"):',
            "                limit_speed(body)",
        )
    if contents.has_paths:
        yield "    space.frames += 1"
    if contents.setup.scene.world.bounds is not None:
        yield from (
            "    (left, bottom), (right, top) = BOUNDS",
            "    for body in list(space.bodies):",
            "        x, y = body.position",
            "        is_inside = left <= x <= right and bottom <= y <= top",
            "        if body.body_type == pymunk.Body.DYNAMIC and not is_inside:",
            "            shapes = [shape for shape in body.shapes if shape.space is not None]",
            "            space.remove(*body.constraints, *shapes, body)",
        )
    yield ""


DRAW_HIDDEN = '''
def draw_hidden(space, options):
    """Draw the shapes that are not in the space."""
    for body in space.bodies:
        color = options.shape_static_color if body.body_type == pymunk.Body.STATIC else options.shape_dynamic_color
        outline = options.shape_outline_color
        for shape in body.shapes:
            if shape.space is not None or shape.sensor:
                continue
            radius = shape.radius * SCALE
            if isinstance(shape, pymunk.Circle):
                center = options.transform @ body.local_to_world(shape.offset)
                options.draw_circle(center, body.angle, radius, outline, color)
            elif isinstance(shape, pymunk.Segment):
                a, b = (options.transform @ body.local_to_world(end) for end in (shape.a, shape.b))
                options.draw_fat_segment(a, b, radius, outline, color)
            else:
                corners = [options.transform @ body.local_to_world(corner) for corner in shape.get_vertices()]
                options.draw_polygon(corners, radius, outline, color)
'''

MAIN = '''
def main(frames=None):
    """Show the scene in a window in real time; Esc quits, or the end of a number of frames."""
    import pygame
    import pymunk.pygame_util

    pygame.display.init()
    screen = pygame.display.set_mode(WINDOW)
    pygame.display.set_caption(TITLE)
    pymunk.pygame_util.positive_y_is_up = True
    options = pymunk.pygame_util.DrawOptions(screen)
    options.flags = options.DRAW_SHAPES | options.DRAW_CONSTRAINTS
    options.transform = pymunk.Transform(a=SCALE, d=SCALE, tx=OFFSET[0], ty=OFFSET[1])
    space, _ = make_space()
    clock = pygame.time.Clock()
    behind = 0.0
    drawn = 0
    running = True
    while running and (frames is None or drawn < frames):
        for event in pygame.event.get():
            if event.type == pygame.QUIT or (event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE):
                running = False
        # The step stays fixed, whatever the frame rate. A slow picture slows the game down instead of causing ever
        # more steps.
        behind += min(clock.tick(60) / 1000.0, 0.1)
        while behind >= DT:
            step(space)
            behind -= DT
        screen.fill("white")
        space.debug_draw(options)
        pygame.display.flip()
        drawn += 1
    pygame.display.quit()


if __name__ == "__main__":
    main()'''


def _main(contents: Contents) -> Iterator[str]:
    if not len(contents.hidden):
        yield MAIN
        return
    yield DRAW_HIDDEN
    drawing = "        space.debug_draw(options)\n"
    yield MAIN.replace(drawing, f"{drawing}        draw_hidden(space, options)\n")
