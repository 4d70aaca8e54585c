"""The memory of Munk2D that the adapter reads, against what pymunk's public calls return."""

from typing import Any

import numpy as np
import pymunk

from sandbox.engines.pymunk_adapter.munk2d_memory import points_of

H = 0.01  # s


def test_contact_points_are_those_of_the_public_interface() -> None:
    """A box slides on the ground; its contact is compared after its impulses have been applied."""
    space = pymunk.Space()
    space.gravity = 0.0, -9.81
    ground = pymunk.Segment(space.static_body, (-5.0, 0.0), (5.0, 0.0), 0.1)
    box = pymunk.Body(2.0, 0.7)
    box.position, box.velocity = (0.0, 0.599), (1.0, 0.0)
    shape = pymunk.Poly.create_box(box, (1.5, 1.0))
    ground.friction = shape.friction = 0.4
    space.add(ground, box, shape)
    found: list[Any] = []

    def read(arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        centres = [shape.body.position for shape in arbiter.shapes if shape.body is not None]
        public = centres, arbiter.contact_point_set.points, arbiter.normal, arbiter.total_impulse
        found.append((points_of(arbiter._arbiter), *public))

    space.on_collision(post_solve=read)
    for _ in range(4):
        space.step(H)
    assert len(found) == 4
    record, centres, points, normal, total = found[-1]
    assert len(record) == len(points) == 2
    for arm, centre, name in (("r1", centres[0], "point_a"), ("r2", centres[1], "point_b")):
        # Arms start at the centres, and end at the points of both shapes; rounding.
        np.testing.assert_allclose(record[arm] + centre, [getattr(point, name) for point in points], atol=1e-12)
    left = np.array([-normal.y, normal.x])
    impulse = np.outer(record["jnAcc"], normal) + np.outer(record["jtAcc"], left)
    np.testing.assert_allclose(np.linalg.norm(impulse.sum(axis=0)), abs(total), rtol=1e-12)  # rounding
    assert abs(total) > 0.5 * 2.0 * 9.81 * H  # more than half of the weight: the contact is loaded
