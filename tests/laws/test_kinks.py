"""A box that slides down over the kink of a wall keeps its speed until its centre is beyond the kink."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.measure.run.runner import run
from sandbox.scene.files.load import from_document

EDGE = 5.0
"""m, where the wall bends"""
SLOP = 0.005
"""m; 1 m is then one of Box2D's lengths"""


@pytest.mark.fail_slow(60)  # two runs each of 100 examples
@pytest.mark.parametrize("engine", ["reference", "pymunk", "box2d"])
def test_box_keeps_its_speed_until_its_centre_is_beyond_the_kink(engine: str) -> None:
    """Without friction nothing acts along the level part, on which the box rests until it tips."""

    @given(
        kink=st.floats(0.1, 80.0),
        height=st.floats(0.05, 0.6),
        slenderness=st.floats(1.0, 8.0),
        speed=st.floats(0.5, 10.0),
        phase=st.floats(0.0, 1.0),
        sink=st.floats(0.0, 1.0),
        reverse=st.booleans(),
        below=st.booleans(),
        thickness=st.sampled_from([0.0] if engine == "box2d" else [0.0, 0.1]),  # see docs/theory/filtering.md
    )
    @example(
        45.0, 0.5, 2.0, 2.0, 0.97, 0.6, False, False, 0.0
    )  # the leading face is nearer to the slope than its own face
    def check(
        kink: float,
        height: float,
        slenderness: float,
        speed: float,
        phase: float,
        sink: float,
        reverse: bool,
        below: bool,
        thickness: float,
    ) -> None:
        up = -1.0 if below else 1.0
        points = [[-5.0, 0.0], [EDGE, 0.0], [EDGE + 10.0, -up * 10.0 * math.tan(math.radians(kink))]]
        width, dt = height * slenderness, 1.0 / 60.0
        start = EDGE - 0.5 * width - speed * dt * (2.0 + phase)
        scene = from_document(
            {
                "world": {"gravity": [0.0, -up * 9.81], "duration": (EDGE - start) / speed},
                "solver": {"dt": dt, "slop": SLOP},
                "wall": [{"points": points[::-1] if reverse else points, "thickness": thickness}],
                "box": [
                    {
                        "position": [start, up * (0.5 * (height + thickness) - sink * SLOP)],
                        "size": [width, height],
                        "velocity": [speed, 0.0],
                    }
                ],
            }
        )
        sliding = run(scene, engine)
        before = sliding.position[:, 0, 0] < EDGE - speed * dt
        assert sliding.velocity[before, 0, 0] == pytest.approx(np.full(before.sum(), speed), rel=0.01, abs=0.01)

    check()
