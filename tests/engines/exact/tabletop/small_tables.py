"""Small tables for the tests of balls on a surface."""

from typing import Any

from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

G, SLIDING, ROLLING, SPINNING = 9.81, 0.2, 0.01, 0.0127
MASS, R = 0.170097, 0.028575
WIDTH, LENGTH = 0.9906, 1.9812

Document = dict[str, Any]


def ball(name: str, x: float, y: float, **more: Any) -> Document:
    return {"name": name, "position": [x, y], "radius": R, "mass": MASS, "material": "phenolic", **more}


def table(
    *balls: Document, friction: bool = True, cushions: bool = True, e: float = 0.95, dt: float = 0.01, **more: Any
) -> Scene:
    """Return a 7 ft table without pockets, its lower left corner at the origin, or a surface without cushions."""
    document: Document = {
        "world": {"duration": 20.0},
        "solver": {"dt": dt},
        "surface": {"sliding_friction": SLIDING, "rolling_friction": ROLLING, "spinning_friction": SPINNING},
        "contact_models": {"ball_ball": "frictional", "cushion": "han2005"} if friction else {},
        "material": [{"name": "phenolic"}, {"name": "rubber"}],
        "pair": [
            {"between": ["phenolic", "phenolic"], "restitution": e},
            {"between": ["phenolic", "rubber"], "restitution": 0.85, "friction": 0.2},
        ],
        "ball": list(balls),
    }
    if cushions:
        corners = [[0.0, 0.0], [WIDTH, 0.0], [WIDTH, LENGTH], [0.0, LENGTH]]
        document["wall"] = [
            {"name": "rail", "points": corners, "closed": True, "height": 0.64 * 2.0 * R, "material": "rubber"}
        ]
    return from_document({**document, **more})


def rack(rows: int, x: float, y: float, gap: float = 0.0) -> list[Document]:
    """Return a triangle of balls with its apex at the bottom; `gap` is the distance between neighbours, m."""
    pitch = 2.0 * R + gap
    positions = [(x + (c - r / 2.0) * pitch, y + r * pitch * 0.75**0.5) for r in range(rows) for c in range(r + 1)]
    return [ball(str(k + 1), *position) for k, position in enumerate(positions)]
