"""Notes: facts about a scene that are useful but no problems."""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.engines.box2d_adapter.engine import Box2DEngine
from sandbox.engines.box2d_adapter.limits import FARTHEST_LENGTHS, MAX_TURN, scale_for
from sandbox.engines.pymunk_adapter.contact_names import confused_elements
from sandbox.engines.pymunk_adapter.engine import SPACE_DEFAULTS, PymunkEngine, is_space_default, space_attributes
from sandbox.formatting import format_fraction
from sandbox.measure.preflight.diagnostic import Details, Diagnostic
from sandbox.measure.preflight.initial_contacts import is_supported
from sandbox.measure.preflight.likely_mistakes import likely_mistakes
from sandbox.measure.preflight.predictability import break_notes, horizon_notes
from sandbox.measure.preflight.seams import seam_notes
from sandbox.measure.preflight.speed_bound import tether_reach, top_speeds
from sandbox.measure.run.run_warnings import wasted_integrator
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySource
from sandbox.scene.description.bodies import Compound, Polygon, PolygonPart
from sandbox.scene.geometry.shapes import geometry_of

MAX_OUTLINES = 20
"""Largest number of outlines that get a note each."""


def notes(scene: Scene, engine: str | None = None) -> list[Diagnostic]:
    """Return notes: names of settings, likely mistakes of units, concave outlines, limits of the audit and others.

    Args:
        scene: the scene.
        engine: with "box2d", its 32-bit numbers and lengths for this scene too; with "pymunk", its settings by their
            names in pymunk.
    """
    return [
        *(_box2d(scene) if engine == "box2d" else ()),
        *(_box2d_bounces(scene) if engine == "box2d" else ()),
        *(_box2d_rolling(scene) if engine == "box2d" else ()),
        *_pymunk(scene, engine),
        *(_pymunk_dampers(scene) if engine == "pymunk" else ()),
        *(_contact_names(scene) if engine in (None, "pymunk") else ()),
        *likely_mistakes(scene),
        *_flight(scene),
        *(_joint_order(scene) if engine in (None, "reference") else ()),
        *_outlines(scene),
        *(seam_notes(scene, engine) if engine != "exact" else ()),
        *_audit(scene),
        *horizon_notes(scene),
        *break_notes(scene),
    ]


FIRST_ORDER = (None, "explicit_euler", "semi_implicit_euler")
"""Integrators whose flight under gravity has an error of g·h·t/2; None is explicit Euler."""


MAX_STANDING = 200
"""Largest number of bodies that are examined for a support before the note on flights is given up."""


def _flight(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if a first-order integrator displaces a body by more than its half width within one flight.

    Bodies that hang on the world, or that stand on something at the start, do not fly.
    """
    bodies, solver, pull = scene.bodies, scene.solver, math.hypot(*scene.world.gravity)
    matrix = contact_matrix(scene)
    moving = np.flatnonzero(matrix.touches & ~bodies.immovable & (bodies.thin > 0.0))
    if pull == 0.0 or not len(moving) or solver.half_kick or solver.integrator not in FIRST_ORDER:
        return
    own_pull = np.maximum(pull * np.abs(bodies.gravity_scale[moving]), np.finfo(np.float64).tiny)
    time = np.minimum(scene.world.duration, top_speeds(scene, matrix)[moving] / own_pull)
    damping = bodies.linear_damping[moving]
    time = np.minimum(time, np.divide(1.0, damping, out=np.full(len(damping), np.inf), where=damping > 0.0))
    error = 0.5 * own_pull * solver.h * time
    down = np.asarray(scene.world.gravity) / pull
    excess = error / bodies.thin[moving]
    excess[np.isfinite(tether_reach(scene, down)[moving])] = 0.0
    for k in np.argsort(-excess, kind="stable")[:MAX_STANDING].tolist():
        number = int(moving[k])
        if excess[k] <= 1.0:
            return
        if not bodies.velocity[number].any() and is_supported(scene, number, down):
            continue
        body, scheme = bodies.names[number], solver.integrator or "explicit_euler"
        message = (
            f"{scheme} displaces {body!r} by g·h·t/2, up to {error[k]:.3g} m within one flight of {time[k]:.3g} s, "
            f"more than its half width, {bodies.thin[number]:.3g} m; solver.half_kick on pymunk, velocity_verlet on "
            "the reference, and `exact` have no such error"
        )
        yield Diagnostic("flight", message, {"body": body, "error": float(error[k])})
        return


def _joint_order(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if joints are less accurate than the stated integrator of `reference`."""
    if text := wasted_integrator(scene, scene.solver.model_dump()):
        yield Diagnostic("joint_order", f"reference: {text}", {"integrator": str(scene.solver.integrator)})


def _outlines(scene: Scene) -> Iterator[Diagnostic]:
    bodies = scene.bodies
    several = [(k, element) for k, element in enumerate(bodies.elements) if isinstance(element, Polygon | Compound)]
    count_of_notes = 0
    for k, element in several:
        name = bodies.names[int(np.flatnonzero(bodies.element == k)[0])]
        for part, count in _pieces(element):
            count_of_notes += 1
            if count_of_notes > MAX_OUTLINES:
                return
            which = f"the outline of {name!r}" if part is None else f"outline {part + 1} of {name!r}"
            message = f"{which} is concave and is decomposed into {count} convex pieces"
            yield Diagnostic("outline", message, {"body": name, "pieces": count})


def _pieces(element: BodySource) -> list[tuple[int | None, int]]:
    """Return which outlines of an element are decomposed, by index among its polygons, and into how many pieces."""
    pieces = geometry_of(element).pieces
    if isinstance(element, Polygon):
        return [(None, len(pieces))] if len(pieces) > 1 else []
    assert isinstance(element, Compound)
    found: list[tuple[int | None, int]] = []
    outlines = 0
    for index, part in enumerate(element.parts):
        if isinstance(part, PolygonPart):
            count = sum(piece.part == index for piece in pieces)
            if count > 1:
                found.append((outlines, count))
            outlines += 1
    return found


def _box2d(scene: Scene) -> Iterator[Diagnostic]:
    """Yield what 32-bit numbers and the lengths for which Box2D is tuned mean for a scene."""
    settings = Box2DEngine().resolve(scene, scene.solver)
    bodies, slop, scale = scene.bodies, settings.slop, scale_for(settings)
    moving = ~bodies.fixed
    if not moving.any() or slop is None:
        return
    farthest = float(np.abs(bodies.position[moving]).max())
    spacing = float(np.spacing(np.float32(farthest)))
    width = 2.0 * float(bodies.thin[moving].min())
    margin = MARGIN_SLOPS * slop
    message = (
        f"box2d: one of its lengths is {1.0 / scale:.3g} m, so that its fixed slop is {slop:.3g} m; contacts act from "
        f"{margin:.3g} m apart, {margin / width:.2g} of the narrowest body's width; positions {farthest:.3g} m from "
        f"the origin are multiples of {spacing:.2g} m, {spacing / slop:.2g} of the slop; no body may get "
        f"{FARTHEST_LENGTHS / scale:.3g} m away or turn faster than {MAX_TURN / settings.h:.3g} rad/s"
    )
    details: Details = {"slop": slop, "margin": margin, "spacing": spacing, "scale": scale}
    yield Diagnostic("box2d", message, details)


def _box2d_bounces(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if bodies with corners bounce: both corners that land get impulses one after the other.

    Measured: boxes of 1 m × 0.5 m that land flat from 1 m, e = 0.8, dt 1 ms, 1 to 16 substeps.
    """
    matrix = contact_matrix(scene)
    cornered = np.flatnonzero(matrix.touches & ~scene.bodies.round & ~scene.bodies.immovable)
    if not len(cornered) or not any(scene.world.gravity):
        return
    rows = np.unique(matrix.surfaces.of_body[cornered])
    if (matrix.surfaces.restitution[rows] * matrix.touching[rows]).max(initial=0.0) > 0.0:
        name = scene.bodies.names[int(cornered[0])]
        message = (
            f"box2d: bodies with corners, such as {name!r}, do not rebound as their restitution says: a box that lands "
            "flat from 1 m with e = 0.8 rises by 0.28 to 0.32 m instead of 0.64, and turns; pymunk and reference are "
            "right there"
        )
        yield Diagnostic("box2d_bounces", message, {"body": name})


ROLLING_FRACTION = 0.3
"""Displacement in a step, as a fraction of the radius, from which on fast discs on box2d get a note."""


def _box2d_rolling(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if a disc is so fast that box2d lets it sink into the ground on which it rolls.

    Measured: a ball of 0.5 m radius at 20 m/s on a wall, 60 Hz, 1, 4 and 16 substeps.
    """
    bodies, matrix = scene.bodies, contact_matrix(scene)
    discs = np.flatnonzero(matrix.touches & bodies.round & ~bodies.immovable & (bodies.radius > 0.0))
    if not len(discs) or not any(scene.world.gravity) or not scene.fixed:
        return
    fraction = np.hypot(*bodies.velocity[discs].T) * scene.solver.dt / bodies.radius[discs]
    k = int(fraction.argmax())
    if fraction[k] > ROLLING_FRACTION:
        name = bodies.names[int(discs[k])]
        message = (
            f"box2d: {name!r} moves by {fraction[k]:.2g} of its radius in a step; a ball that rolls at 0.67 of its "
            "radius a step sinks by 25 mm of 0.5 m into the ground with one substep, 10 mm with four, and loses 0.9 "
            "and 0.3 % of its speed in 5 s"
        )
        yield Diagnostic("box2d_rolling", message, {"body": name, "fraction": float(fraction[k])})


DAMPER_STEP = 0.02
"""c·h/I of a rotary spring from which on its damping on pymunk gets a note."""


def _pymunk_dampers(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if pymunk's damper of a rotary spring acts on a body that a pivot holds.

    It damps the spin as if the body turned about its centre of mass, and the pivot then adds to it. Measured: a rod of
    1 m on a hinge at its end, c·h/I from 0.009 to 0.6: the error at 0.5 s is 0.6 rad times c·h/I.
    """
    bodies, joints = scene.bodies, scene.joint_arrays
    springs = joints.of(JointKind.ROTARY_SPRING)
    pivots = joints.of(JointKind.PIVOT)
    held = np.zeros(len(bodies), np.bool_)
    held[pivots.b[np.hypot(*pivots.anchor_b.T) > 0.0]] = True
    held[pivots.a[(pivots.a >= 0) & (np.hypot(*pivots.anchor_a.T) > 0.0)]] = True
    for k in range(len(springs)):
        ends = [int(each) for each in (springs.a[k], springs.b[k]) if each >= 0 and held[each]]
        if not ends:
            continue
        body = min(ends, key=lambda each: float(bodies.moment[each]))
        ratio = float(springs.figures[k, 2]) * scene.solver.h / float(bodies.moment[body])
        if ratio > DAMPER_STEP:
            message = (
                f"pymunk: the damper of {springs.names[k]!r} slows {bodies.names[body]!r}, which a pivot holds, too "
                f"much, because c·h/I is {ratio:.2g} (a rod on a hinge lags by 0.6 rad times that); the error "
                "falls with the substep, and reference and box2d do not have it"
            )
            yield Diagnostic("pymunk_damper", message, {"joint": springs.names[k], "ratio": ratio})
            return


def _pymunk(scene: Scene, engine: str | None) -> Iterator[Diagnostic]:
    """Yield the attributes of a `pymunk.Space` with the settings of a scene, and its defaults where these differ.

    Without an engine, only a slop that is large for the scene is noted, such as pymunk's own in a scene in metres.
    """
    matrix = contact_matrix(scene)
    moving = matrix.touches & ~scene.bodies.fixed & (scene.bodies.thin > 0.0)
    if engine not in (None, "pymunk") or not moving.any():
        return
    settings = PymunkEngine().resolve(scene, scene.solver)
    half, slop = float(scene.bodies.thin[moving].min()), settings.slop
    assert slop is not None
    if engine is None and slop <= LARGE_SLOP * half:
        return
    values, texts = space_attributes(settings), []
    for name, value in values.items():
        is_default = is_space_default(name, value)
        texts.append(f"space.{name} = {value:.3g}")
        texts[-1] += "" if is_default else f" (pymunk's default: {SPACE_DEFAULTS[name]:.3g})"
    message = (
        f"pymunk: {', '.join(texts)}; bodies may overlap by {format_fraction(slop / half)} of the narrowest half width"
    )
    yield Diagnostic("pymunk", message, {**values, "half_width": half})


def _contact_names(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if pymunk confuses contacts of the first shapes of a game's space."""
    confused = confused_elements(scene)
    if confused:
        first, second = confused[0]
        others = f" and {len(confused) - 1} other pairs" if len(confused) > 1 else ""
        message = (
            f"pymunk can confuse both contacts of {first!r} and {second!r}{others}, because their shapes are the first "
            "of the space, and what stands on them can lean; in the game, unless it does so already, add and remove a "
            "few unused circles before all other shapes"
        )
        yield Diagnostic("contact_names", message, {"body": second, "other": first, "pairs": len(confused)})


LARGE_SLOP = 0.05
"""Fraction of the narrowest half width from which on a slop is noted"""

MARGIN_SLOPS = 4.0
"""Distance, in slops, from which on Box2D counts bodies as touching: `B2_SPECULATIVE_DISTANCE`"""


def _audit(scene: Scene) -> Iterator[Diagnostic]:
    bodies = scene.bodies
    not_round = contact_matrix(scene).touches & ~bodies.round
    count, without = int(not_round.sum()), int((not_round & (bodies.core <= 0.0)).sum())
    if not count:
        return
    who = "the body that is not a ball" if count == 1 else f"the {count:,} bodies that are not balls"
    message = (
        f"missed contacts are a lower bound: of {who}, only passages of the largest inscribed disc about the centre of "
        "mass, and through the axis of slender bodies, are counted"
    )
    if without:
        message += f"; {without:,} have no such disc and are not counted"
    yield Diagnostic("audit", message, {"bodies": count, "without": without})
