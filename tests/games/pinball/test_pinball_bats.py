"""Flippers: outlines against shapely and a closed form; no ball passes through one at 1 kHz."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Point, Polygon, unary_union

from sandbox.action import Drive, Move
from sandbox.engines.switching import start
from sandbox.games.pinball.build import bat
from sandbox.scene.files.load import loads
from sandbox.scene.geometry.polygon import is_convex, signed_area
from tests.games.pinball.passing_watch import TIP, PassageObserver
from tests.toml_text import toml

pytestmark = pytest.mark.fail_slow(60)  # long runs

REST, RAISED = -0.541, 0.349


@pytest.mark.parametrize("drive", ["torque", "stroke"])
def test_no_ball_passes_through_a_flipper(drive: str) -> None:
    random, max_depth, hits = np.random.default_rng(3), 0.0, 0
    for _ in range(40):
        # Aimed at a random point of the flipper at a random angle of its stroke, from above or below.
        angle, fraction, side = random.uniform(REST, RAISED), random.uniform(0.0, 1.0), random.choice([-1.0, 1.0])
        direction = angle + side * (0.5 * math.pi + random.uniform(-0.9, 0.9))
        speed, distance = random.uniform(0.5, 4.0), 0.12  # m/s: speeds of balls on a table
        x = 0.0702 * fraction * math.cos(angle) + distance * math.cos(direction)
        y = 0.0702 * fraction * math.sin(angle) + distance * math.sin(direction)
        simulation = start(
            loads(
                toml("solver", dt=0.001, substeps=1)
                + toml("pinball")
                + toml("pinball.flipper", name="bat", pivot=[0.0, 0.0], side="left", drive=drive)
                + toml("pinball.ball", name="ball", position=[x, y])
            )
        )
        names = simulation.bodies.names
        watch = PassageObserver(simulation.scene, simulation.bodies, (names.index("ball"),))
        simulation.watch(watch)
        velocity = -speed * math.cos(direction), -speed * math.sin(direction)
        simulation.apply(Move(time=0.0, body="ball", position=(x, y), velocity=velocity))
        raised, until = random.uniform(0.0, 2.0 * distance / speed), 2.0 * distance / speed + 0.05
        up = False
        while simulation.time < until:
            if not up and simulation.time >= raised:
                up = True
                simulation.apply(Drive(time=simulation.time, drive="bat", level=1.0))
            simulation.step()
        simulation.close()
        assert watch.passages == [], (x, y, velocity, raised)
        max_depth, hits = max(max_depth, watch.max_depth), hits + (watch.max_depth > 0.0)
    assert hits > 20  # of 40 aimed balls
    # A ball approaches by 4 mm in a substep, and a flipper pushed back onto its stop yields further. The overlap stays
    # below the radius of the tip, the thinnest part, so the centre of the ball does not reach the flipper.
    assert 0.0 < max_depth < TIP


sizes = st.tuples(st.floats(0.03, 0.1), st.floats(0.006, 0.015), st.floats(0.003, 0.015))


def area_of(length: float, base: float, tip: float) -> float:
    """Return the area of the hull of two discs, m².

    It is the sum of two sectors, and of two right trapezoids between the line of centres and a tangent.
    """
    angle = math.acos((base - tip) / length)
    tangent = math.sqrt(length**2 - (base - tip) ** 2)
    return (math.pi - angle) * base**2 + angle * tip**2 + (base + tip) * tangent


@given(sizes)
def test_flipper_outline_is_the_hull_of_its_discs(size: tuple[float, float, float]) -> None:
    length, base, tip = size
    outline = bat(length, base, tip, tolerance=1e-6)
    hull = unary_union([Point(0, 0).buffer(base, 256), Point(length, 0).buffer(tip, 256)]).convex_hull
    off = Polygon(outline).symmetric_difference(hull).area
    assert off < 4e-6 * hull.length  # the tolerance along the outline, and the same again for shapely's discs


@given(sizes)
def test_area_converges_to_the_closed_form_from_below(size: tuple[float, float, float]) -> None:
    exact = area_of(*size)
    rough, fine = (signed_area(bat(*size, tolerance=tolerance)) for tolerance in (5e-5, 5e-7))
    assert rough < exact
    # the area of the omitted segments is proportional to the tolerance
    assert exact - fine < 0.02 * (exact - rough) + 1e-15


@given(sizes)
def test_flipper_outline_is_convex_anticlockwise_and_symmetric(size: tuple[float, float, float]) -> None:
    outline = bat(*size)
    assert is_convex(outline)
    assert signed_area(outline) > 0.0
    flipped = sorted((x, -y) for x, y in outline)
    # by distance: rounding may exchange corners of equal x
    assert all(min(math.dist(a, b) for b in outline) < 1e-12 for a in flipped)


def test_flipper_outline_has_the_extent_of_its_discs() -> None:
    outline = bat(0.0702, 0.0116, 0.007)
    assert max(x for x, _ in outline) == pytest.approx(0.0772, abs=5e-5)  # the tolerance
    assert max(y for _, y in outline) == pytest.approx(0.0116, abs=5e-5)
