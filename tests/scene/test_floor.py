"""Surfaces: `[surface]`, spin, cushion heights, pockets and shots of a scene file."""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.scene.description.surface import Stroke, struck
from sandbox.scene.files.load import dumps, from_document, loads
from tests.scene.faults import faults_of

MASS, RADIUS = 0.170097, 0.028575
BALL: dict[str, Any] = {"name": "cue", "position": [0, 0], "radius": RADIUS, "mass": MASS}
POCKET, SHOT = {"position": [1, 1], "radius": 0.1}, {"aim": 0, "speed": 1}
CUSHION = {"points": [[1, -1], [1, 1]], "height": 0.037}
TABLE: dict[str, Any] = {"surface": {"sliding_friction": 0.2}, "ball": [BALL], "wall": [CUSHION]}


def test_balls_on_a_surface_have_the_moment_of_a_sphere() -> None:
    with_surface, without = (from_document({**more, "ball": [BALL]}) for more in ({"surface": {}}, {}))
    # ⅖ m r² against ½ m r²; 1e-15: the last digit may be rounded differently
    assert with_surface.bodies.moment[0] == pytest.approx(0.4 * MASS * RADIUS**2, rel=1e-15)
    assert without.bodies.moment[0] == pytest.approx(0.5 * MASS * RADIUS**2, rel=1e-15)


def test_spin_is_read_into_the_bodies_and_round_trips() -> None:
    scene = from_document({**TABLE, "ball": [{**BALL, "spin": [1.0, 2.0, 3.0]}]})
    assert scene.bodies.roll.tolist() == [[1.0, 2.0]]
    assert scene.bodies.angular_velocity.tolist() == [3.0]
    assert loads(dumps(scene)) == scene


def test_pockets_are_numbered_after_the_fixed_elements() -> None:
    scene = from_document({**TABLE, "pocket": [POCKET, {**POCKET, "name": "left"}], "post": [POCKET]})
    assert scene.fixed_names == ("wall-1", "post-1", "pocket-1", "left")
    assert len(scene.fixed) == 2


@pytest.mark.parametrize(
    ("document", "path", "words"),
    [
        ({"ball": [{**BALL, "spin": [1, 0, 0]}]}, "ball.cue.spin", "[surface]"),
        ({**TABLE, "ball": [{**BALL, "spin": [1, 0, 0], "angular_velocity": 1}]}, "angular_velocity", "`spin`"),
        ({**TABLE, "ball": [{**BALL, "spin": [1, 0, 0], "fixed": True}]}, "spin", "cannot move"),
        ({"ball": [BALL], "contact_models": {"cushion": "simple"}}, "contact_models.cushion", "[surface]"),
        ({"ball": [BALL], "wall": [CUSHION]}, "height", "[surface]"),
        ({**TABLE, "wall": [{**CUSHION, "height": 0.06}]}, "height", "less than 0.05715"),
        ({**TABLE, "contact_models": {"cushion": "han2005"}, "post": [{**POCKET, "name": "p"}]}, "post", "nose"),
        ({**TABLE, "pocket": [{**POCKET, "position": [0.01, 0]}], "shot": [SHOT]}, "shot[0].ball", "is in a pocket"),
        ({**TABLE, "pocket": [{**POCKET, "radius": -1}], "shot": [SHOT]}, "pocket[0].radius", "-1"),
        ({"ball": [BALL], "shot": [SHOT]}, "shot", "[surface]"),
        ({**TABLE, "shot": [{**SHOT, "ball": "eight"}]}, "ball", "no body is named 'eight'"),
        ({**TABLE, "shot": [SHOT, {"aim": 1, "speed": 1}]}, "ball", "another shot"),
        ({**TABLE, "shot": [{**SHOT, "side": 0.4, "height": -0.4}]}, "side", "slips"),
        ({**TABLE, "shot": [{**SHOT, "side": 0.6}]}, "side", "0.5"),
        ({**TABLE, "pocket": [{**POCKET, "name": "cue"}]}, "pocket", "unique"),
    ],
)
def test_faults_of_keys_that_need_a_surface_are_reported(document: dict[str, Any], path: str, words: str) -> None:
    assert any(path in fault.path and words in fault.message for fault in faults_of(document))


def test_shot_gives_the_ball_velocity_and_spin() -> None:
    scene = from_document({**TABLE, "shot": [{"aim": 0.5 * math.pi, "speed": 2.0, "height": 0.3}]})
    velocity, spin = scene.bodies.velocity[0], scene.bodies.roll[0]
    assert velocity[1] > 0.0
    assert abs(velocity[0]) < 1e-15 * velocity[1]  # cos(π/2) in doubles
    assert spin[0] < 0.0  # follow, as natural roll: ω = (−v_y, v_x) / R


@pytest.mark.parametrize(("side", "height"), [(0.0, 0.0), (-0.4, 0.28), (0.25, -0.3)])
def test_stroke_conserves_energy_and_momentum_of_ball_and_cue(side: float, height: float) -> None:
    """The tip is elastic and does not slip: cue and ball conserve both, except for the added squirt."""
    cue_mass, speed = 0.55, 3.0
    velocity, spin = struck(Stroke(aim=0.3, speed=speed, side=side, height=height, cue_mass=cue_mass), MASS, RADIUS)
    ball_speed = math.hypot(*velocity)
    cue_speed = speed - MASS * ball_speed / cue_mass
    ball_energy = 0.5 * MASS * ball_speed**2 + 0.2 * MASS * RADIUS**2 * float(np.dot(spin, spin))
    total_energy = ball_energy + 0.5 * cue_mass * cue_speed**2
    assert total_energy == pytest.approx(0.5 * cue_mass * speed**2, rel=1e-12)  # rounding


def test_side_makes_the_ball_squirt_and_spin() -> None:
    right, left = (struck(Stroke(aim=0.0, speed=1.0, side=a), MASS, RADIUS) for a in (0.3, -0.3))
    assert right[0][1] > 0.0 > left[0][1]  # struck on its right side, the ball squirts to the left
    assert right[1][2] > 0.0 > left[1][2]  # and turns counter-clockwise
    assert right[0] == pytest.approx((left[0][0], -left[0][1]))
