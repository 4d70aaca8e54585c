"""The engines `pymunk` and `box2d` behave as these libraries do for their users: bodies move as far."""

from typing import Any

import numpy as np
import pymunk
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.action import Spawn
from sandbox.engines.pymunk_adapter.colliders import skip_numbers
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Polygon
from sandbox.scene.files.load import from_document
from tests.laws.bare_libraries import displacements

RANGE = 1.5
"""The ways of `displacements` are a sample: in another one bodies may move this many times as far."""
ROUNDING = 5e-4
"""m; a crate on a slope creeps by 0.25 or 0.69 mm, as the ends of its ground are rounded"""


def scene(tables: dict[str, Any], substeps: int = 1, duration: float = 10.0, friction: float = 0.6) -> Scene:
    wood = {"material": "wood"}
    placed = {kind: [{**each, **wood} for each in elements] for kind, elements in tables.items() if kind != "joint"}
    ground = {"name": "ground", "point": [0.0, 0.0], "normal": [0.0, 1.0], **wood}
    return from_document(
        {
            "world": {"gravity": [0.0, -9.81], "duration": duration},
            "solver": {"dt": 1 / 60, "substeps": substeps},
            "material": [{"name": "wood"}],
            "pair": [{"between": ["wood", "wood"], "friction": friction}],
            **placed,
            "plane": [ground, *placed.get("plane", [])],
            "joint": tables.get("joint", []),
        }
    )


def tower(rows: int) -> dict[str, Any]:
    return {"stack": [{"name": "box", "base": [0.0, 0.0], "size": [0.5, 0.5], "columns": 1, "rows": rows}]}


def pyramid(rows: int) -> dict[str, Any]:
    size = {"size": [0.4, 0.4], "columns": rows, "rows": rows, "fewer": 1, "gap": 0.0}
    return {"stack": [{"name": "box", "base": [0.0, 0.0], **size}]}


def two_weights(ratio: float) -> dict[str, Any]:
    boxes = [(0.25, 1.0), (0.75, 1.0), (1.25, ratio)]
    return {
        "box": [
            {"name": f"box{k}", "position": [0.0, y], "size": [0.5, 0.5], "mass": mass}
            for k, (y, mass) in enumerate(boxes)
        ]
    }


def hanging_chain(links: int) -> dict[str, Any]:
    balls = [{"name": f"b{k}", "position": [0.3 * (k + 1), 6.0], "radius": 0.1, "mass": 1.0} for k in range(links)]
    joints = [{"kind": "rod", "between": [f"b{k}", f"b{k + 1}"]} for k in range(links - 1)]
    first = {"kind": "rod", "between": ["b0"], "anchors": [[0.0, 6.0], [0.0, 0.0]]}
    return {"ball": balls, "joint": [first, *joints]}


SLOPE = {
    "plane": [{"name": "slope", "point": [0.0, 5.0], "normal": [-0.28, 0.96]}],
    "box": [{"name": "crate", "position": [-0.07, 5.24], "angle": float(np.arctan2(0.28, 0.96)), "size": [0.5, 0.5]}],
}
SCENES = {
    "three boxes": scene(tower(3)),
    "five boxes": scene(tower(5)),
    "five boxes, 4 substeps": scene(tower(5), 4),
    "ten boxes, 8 substeps": scene(tower(10), 8, duration=20.0),
    "30 kg on 1 kg, 8 substeps": scene(two_weights(30.0), 8),
    "pyramid": scene(pyramid(5), 2),
    "crate on a slope that holds it": scene(SLOPE, 2, duration=3.0),
    "crate on a slope that it slides down": scene(SLOPE, 2, duration=1.0, friction=0.1),
    "hanging chain": scene(hanging_chain(5), 4, duration=0.5),
}


SHIPPED = {
    **dict.fromkeys(("benchmark/tower", "benchmark/pyramid", "benchmark/far_pyramid"), 2.0),
    **dict.fromkeys(("benchmark/box_slides", "benchmark/box_sticks", "benchmark/friction_ramp"), 1.0),
    **dict.fromkeys(("benchmark/heavy_on_light", "benchmark/newtons_cradle", "benchmark/restitution_row"), 5.0),
    **dict.fromkeys(("benchmark/double_pendulum", "benchmark/chain_of_20", "benchmark/oblique", "joints/bridge"), 2.0),
    **dict.fromkeys(("benchmark/slide_to_roll", "benchmark/rest_depth", "tutorial/bounce"), 1.0),
}
"""duration, s"""


@pytest.mark.fail_slow(60)  # seven runs each, of up to half a second
@pytest.mark.parametrize("engine", ["pymunk", "box2d"])
@pytest.mark.parametrize("name", [*SCENES, *SHIPPED])
def test_bodies_move_as_far_as_in_a_bare_world(name: str, engine: str) -> None:
    scene = SCENES[name] if name in SCENES else sandbox.load(name)
    world = scene.world.model_copy(update={"duration": min(scene.world.duration, SHIPPED.get(name, 20.0))})
    scene = scene.model_copy(update={"world": world})
    bare = displacements(scene, engine)
    result = run(scene, engine, audit=False)
    moved = float(np.hypot(*(result.position[-1] - result.position[0]).T).max())
    assert min(bare) / RANGE - ROUNDING <= moved <= RANGE * max(bare) + ROUNDING, bare


@pytest.mark.parametrize(("skipped", "stands"), [(0, False), (4, True)])
def test_boxes_from_their_lower_left_corner_fall_in_a_bare_space_unless_numbers_are_skipped(
    skipped: int, stands: bool
) -> None:
    space = pymunk.Space()
    space.gravity, space.collision_slop = (0.0, -9.81), 0.0025
    skip_numbers(space, skipped)
    ground = pymunk.Segment(space.static_body, (-50.0, -1.0), (50.0, -1.0), 1.0)
    boxes = [pymunk.Body(1.0, pymunk.moment_for_box(1.0, (0.5, 0.5))) for _ in range(5)]
    corners = [(-0.25, -0.25), (0.25, -0.25), (0.25, 0.25), (-0.25, 0.25)]
    for k, body in enumerate(boxes):
        body.position = 0.0, 0.25 + 0.5 * k
    for shape in (ground, *(pymunk.Poly(body, corners) for body in boxes)):
        shape.friction = 0.6
        space.add(*([] if shape is ground else [shape.body]), shape)
    for _ in range(600):
        space.step(1.0 / 60.0)
    assert (boxes[4].position.y > 2.2) == stands


@given(st.integers(3, 12), st.integers(2, 12), st.data())
def test_contacts_of_two_edges_have_different_names_after_the_numbers_skipped(
    corners: int, others: int, data: st.DataObject
) -> None:
    def pair(a: int, b: int) -> int:  # CP_HASH_PAIR
        return (a * 3344921057 ^ b * 3344921057) % 2**64

    def names(first: int, second: int, edge: int, opposite: int) -> tuple[int, int]:
        ends = [pair(first, (edge + k) % corners) for k in (0, 1)]
        across = [pair(second, (opposite + k) % others) for k in (0, 1)]
        return pair(ends[0], across[1]), pair(ends[1], across[0])

    assert len(set(names(0, 1, 0, 0))) == 1  # the finding: ground and first box of a space
    first, second = sorted(data.draw(st.sets(st.integers(max(corners, others), 1000), min_size=2, max_size=2)))
    edge, opposite = data.draw(st.integers(0, corners - 1)), data.draw(st.integers(0, others - 1))
    assert len(set(names(first, second, edge, opposite))) == 2


def test_polygons_that_join_later_have_names_of_their_own_too() -> None:
    """Boxes that appear in a scene of a ball move by 2.3 mm; without the numbers that are skipped then, by 20 mm."""
    corners = ((-0.25, -0.25), (0.25, -0.25), (0.25, 0.25), (-0.25, 0.25))
    ground = {"name": "ground", "points": [[-5.0, 0.0], [5.0, 0.0]], "friction": 0.7}
    alone = from_document(
        {
            "world": {"gravity": [0.0, -9.81], "duration": 10.0},
            "solver": {"dt": 1 / 60, "substeps": 1},
            "wall": [ground],
            "ball": [{"name": "far", "position": [4.0, 0.1], "radius": 0.1}],
        }
    )
    stack = [  # every second one upside down, so that corners 2 and 3 meet
        Polygon(name=f"box {k}", position=(0.0, 0.25 + 0.5 * k), angle=np.pi * (k % 2), points=corners, friction=0.7)
        for k in range(3)
    ]
    result = run(alone, "pymunk", actions=[Spawn(time=0.0, polygon=each) for each in stack], audit=False)
    assert np.abs(result.position[-1, 1:] - [each.position for each in stack]).max() < 5e-3
