"""Small scenes of things that may touch, and what they have in common, worked out thing by thing.

An oracle for surfaces, meetings and demands: written from what the scene file means, one pair at a time.
"""

from typing import Any

from hypothesis import strategies as st

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import HasMaterial
from sandbox.scene.description.discs import Ball, Disc
from sandbox.scene.files.load import from_document

FIGURES = [0.0, 0.25, 0.5, 1.0]


@st.composite
def touching_scenes(draw: st.DrawFn) -> Scene:
    """Scenes whose things differ in material, figures, what they collide with, and whether they move."""
    figures = {key: st.sampled_from(FIGURES) for key in ("restitution", "friction")}
    names = ["a", "b", "c"][: draw(st.integers(0, 3))]
    materials = [{"name": name, **draw(st.fixed_dictionaries({}, optional=figures))} for name in names]
    pairs = []
    for k, first in enumerate(names):
        for second in names[k:]:
            if draw(st.booleans()):
                between = draw(st.permutations([first, second]))
                pairs.append({"between": list(between), **draw(st.fixed_dictionaries({}, optional=figures))})

    surface = figures | ({"material": st.sampled_from(names)} if names else {})
    collides = {"collides": st.sampled_from(["all", "fixed", "none"])}

    def some(required: dict[str, Any], optional: dict[str, Any], most: int) -> list[dict[str, Any]]:
        fixed = {key: st.just(value) for key, value in required.items()}
        return draw(st.lists(st.fixed_dictionaries(fixed, optional={**surface, **optional}), max_size=most))

    at = {"position": [0.0, 0.0], "radius": 1.0}
    return from_document(
        {
            "material": materials,
            "pair": pairs,
            "plane": some({"point": [0.0, 0.0], "normal": [0.0, 1.0]}, {}, 1),
            "wall": some({"points": [[0.0, 0.0], [1.0, 0.0]]}, {}, 1),
            "post": some(at, {}, 1),
            "ball": some(at, {**collides, "fixed": st.booleans()}, 5),
            "grid": some({"origin": [0.0, 0.0], "columns": 2, "spacing": [0.0, 0.0], "radius": 1.0}, collides, 1),
        }
    )


def elements(scene: Scene) -> list[Disc]:
    """Return the element behind each body, in scene order."""
    return [*scene.balls, *(grid for grid in scene.grids for _ in range(grid.columns * grid.rows))]


def is_fixed(disc: Disc) -> bool:
    return isinstance(disc, Ball) and disc.fixed


def balls_meet(a: Disc, b: Disc) -> bool:
    """Tell whether two balls can touch: one of them moves, and each lets the other."""
    if is_fixed(a) and is_fixed(b):
        return False
    return all(
        one.collides == "all" or (one.collides == "fixed" and is_fixed(other)) for one, other in ((a, b), (b, a))
    )


def meets_fixed_things(disc: Disc) -> bool:
    return not is_fixed(disc) and disc.collides != "none"


def coefficient(scene: Scene, a: HasMaterial, b: HasMaterial, key: str) -> float:
    """Return restitution or friction of a contact."""
    for pair in scene.pairs:
        stated = getattr(pair, key)
        if sorted(pair.between) == sorted((str(a.material), str(b.material))) and stated is not None:
            return float(stated)
    sides = []
    for thing in (a, b):
        figure = getattr(thing, key)
        for material in scene.materials:
            if figure is None and material.name == thing.material:
                figure = getattr(material, key)
        if figure is not None:
            sides.append(figure)
    if not sides:
        return 0.0
    return float(sides[0] if len(sides) == 1 else sides[0] * sides[1])
