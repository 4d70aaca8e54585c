"""The engine `pymunk` behaves as pymunk does for its users: what stands in a bare space stands, by as much."""

from typing import Any

import numpy as np
import pytest

from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.laws.bare_pymunk import displacements

RANGE = 1.5
"""The orders of `displacements` are a sample: another one may move this many times more, or less."""


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


@pytest.mark.parametrize("name", SCENES)
def test_bodies_move_as_far_as_in_a_bare_space(name: str) -> None:
    bare = displacements(SCENES[name])
    result = run(SCENES[name], "pymunk", audit=False)
    moved = float(np.hypot(*(result.position[-1] - result.position[0]).T).max())
    assert min(bare) / RANGE <= moved <= RANGE * max(bare), bare
