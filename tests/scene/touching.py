"""Small scenes of elements that may touch, and a brute-force oracle of their possible contacts.

The oracle is for surfaces, contact matrices and demands. It follows the definition of the scene file, pair by pair.
"""

from typing import Any

from hypothesis import strategies as st

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import HasMaterial
from sandbox.scene.description.discs import Ball, Disc
from sandbox.scene.files.load import from_document

COEFFICIENTS = [0.0, 0.25, 0.5, 1.0]


@st.composite
def touching_scenes(draw: st.DrawFn) -> Scene:
    """Scenes whose elements differ in material, coefficients, `collides` and `fixed`."""
    coefficients = {key: st.sampled_from(COEFFICIENTS) for key in ("restitution", "friction")}
    names = ["a", "b", "c"][: draw(st.integers(0, 3))]
    materials = [{"name": name, **draw(st.fixed_dictionaries({}, optional=coefficients))} for name in names]
    pairs = []
    for k, first in enumerate(names):
        for second in names[k:]:
            if draw(st.booleans()):
                between = draw(st.permutations([first, second]))
                pairs.append({"between": list(between), **draw(st.fixed_dictionaries({}, optional=coefficients))})

    surface = coefficients | ({"material": st.sampled_from(names)} if names else {})
    collides = {"collides": st.sampled_from(["all", "fixed", "none"])}

    def elements_of(required: dict[str, Any], optional: dict[str, Any], most: int) -> list[dict[str, Any]]:
        fixed = {key: st.just(value) for key, value in required.items()}
        return draw(st.lists(st.fixed_dictionaries(fixed, optional={**surface, **optional}), max_size=most))

    disc = {"position": [0.0, 0.0], "radius": 1.0}
    return from_document(
        {
            "material": materials,
            "pair": pairs,
            "plane": elements_of({"point": [0.0, 0.0], "normal": [0.0, 1.0]}, {}, 1),
            "wall": elements_of({"points": [[0.0, 0.0], [1.0, 0.0]]}, {}, 1),
            "post": elements_of(disc, {}, 1),
            "ball": elements_of(disc, {**collides, "fixed": st.booleans()}, 5),
            "grid": elements_of(
                {"origin": [0.0, 0.0], "columns": 2, "spacing": [0.0, 0.0], "radius": 1.0}, collides, 1
            ),
        }
    )


def elements(scene: Scene) -> list[Disc]:
    """Return the element behind each body, in scene order."""
    return [*scene.balls, *(grid for grid in scene.grids for _ in range(grid.columns * grid.rows))]


def is_fixed(disc: Disc) -> bool:
    return isinstance(disc, Ball) and disc.fixed


def balls_can_collide(a: Disc, b: Disc) -> bool:
    """Return whether two balls can collide: one of them moves, and `collides` of each allows the other."""
    if is_fixed(a) and is_fixed(b):
        return False
    return all(
        first.collides == "all" or (first.collides == "fixed" and is_fixed(second))
        for first, second in ((a, b), (b, a))
    )


def collides_with_fixed(disc: Disc) -> bool:
    return not is_fixed(disc) and disc.collides != "none"


def coefficient(scene: Scene, a: HasMaterial, b: HasMaterial, key: str) -> float:
    """Return the restitution or friction of a contact: that of the pair, else the product of the two sides."""
    for pair in scene.pairs:
        of_pair = getattr(pair, key)
        if sorted(pair.between) == sorted((str(a.material), str(b.material))) and of_pair is not None:
            return float(of_pair)
    values = []
    for element in (a, b):
        value = getattr(element, key)
        for material in scene.materials:
            if value is None and material.name == element.material:
                value = getattr(material, key)
        if value is not None:
            values.append(value)
    if not values:
        return 0.0
    return float(values[0] if len(values) == 1 else values[0] * values[1])
