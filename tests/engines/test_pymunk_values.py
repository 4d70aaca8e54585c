"""Values of pymunk: coefficients of any mixture of materials, frames that later steps do not change, and scenes."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Impulse, Move, Remove
from sandbox.engines.registry import start
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.engines.stepping import advance
from tests.strategies import numbers

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples


MATERIALS = ("a", "b", "c", "d")
PAIRS = list(itertools.combinations_with_replacement(MATERIALS, 2))
COEFFICIENTS = st.none() | numbers(0, 1)


@given(
    st.lists(st.tuples(COEFFICIENTS, COEFFICIENTS), min_size=4, max_size=4),
    st.lists(st.tuples(st.booleans(), COEFFICIENTS, COEFFICIENTS), min_size=10, max_size=10),
    st.lists(COEFFICIENTS, min_size=8, max_size=8),
)
def test_every_mixture_of_materials_uses_its_own_coefficients(
    stated: list[tuple[float | None, float | None]],
    paired: list[tuple[bool, float | None, float | None]],
    own_coefficients: list[float | None],
) -> None:
    """Materials, pairs and shapes with optional coefficients, which no set of factors can represent.

    A ball of each kind hits a wall of each kind once with slip: v' = e·v, and it loses μ·(1 + e)·v along the wall. The
    slip starts at 10 v and loses three times as much, so it does not stop.
    """

    def coefficients(restitution: float | None, friction: float | None) -> dict[str, float]:
        values = {"restitution": restitution, "friction": friction}
        return {key: value for key, value in values.items() if value is not None}

    def kind(material: int, restitution: float | None, friction: float | None) -> dict[str, Any]:
        return {"material": MATERIALS[material], **coefficients(restitution, friction)}

    # Four kinds without and four with their own coefficients.
    kinds = [kind(k, None, None) for k in range(4)]
    kinds += [kind(k, own_coefficients[k], own_coefficients[k + 4]) for k in range(4)]
    table = {frozenset(two): coefficients(e, mu) for two, (listed, e, mu) in zip(PAIRS, paired, strict=True) if listed}
    document: dict[str, Any] = {
        "solver": {"dt": 0.01},
        "material": [{"name": name, **coefficients(*each)} for name, each in zip(MATERIALS, stated, strict=True)],
        "pair": [{"between": [*two] * (2 if len(two) == 1 else 1), **each} for two, each in table.items()],
        "ball": [],
        "wall": [],
    }
    for row, column in itertools.product(range(8), repeat=2):
        y = 4.0 * (8 * row + column)
        document["wall"].append({"points": [[-3, y], [3, y]], **kinds[row]})
        document["ball"].append(
            {"position": [0, y + 1.005], "velocity": [10, -1], "radius": 1, "collides": "fixed", **kinds[column]}
        )

    simulation = start(from_document(document))
    advance(simulation, 4)
    velocity = simulation.frame().velocity

    def expected(coefficient: str, a: dict[str, Any], b: dict[str, Any]) -> float:
        pair = table.get(frozenset((a["material"], b["material"])), {})
        if coefficient in pair:
            return float(pair[coefficient])
        materials = {material["name"]: material for material in document["material"]}
        sides = [each.get(coefficient, materials[each["material"]].get(coefficient)) for each in (a, b)]
        known = [side for side in sides if side is not None]
        return float(np.prod(known)) if known else 0.0

    for n, (row, column) in enumerate(itertools.product(range(8), repeat=2)):
        e, mu = (expected(coefficient, kinds[row], kinds[column]) for coefficient in ("restitution", "friction"))
        # Rounding of a product of factors, an impulse and a velocity, and the tilt of the normal times 10 m/s.
        assert velocity[n, 1] == pytest.approx(e, rel=1e-12, abs=1e-14)
        assert velocity[n, 0] == pytest.approx(10 - mu * (1 + e), rel=1e-14)  # as above


def test_frames_are_immutable_values() -> None:
    """Later steps do not change a frame, and a frame cannot be written to."""
    particle = {"position": [9, 9], "radius": 1, "velocity": [1, 2], "angular_velocity": 3}
    for free, spin in itertools.product((True, False), repeat=2):
        collides = "none" if free else "all"
        other = {**particle, "position": [-9, 9], "angular_velocity": 3 if spin else 0, "collides": collides}
        scene = make_scene(
            world={"gravity": [0, -9.81]},
            plane=[] if free else [{"point": [0, 0], "normal": [0, 1], "friction": 0.5}],
            ball=[{**other, "position": [9, 9]}, other],
        )
        simulation = start(scene)
        simulation.step()
        frame = simulation.frame()
        arrays = (frame.position, frame.velocity, frame.angle, frame.angular_velocity, frame.present)
        copies = [array.copy() for array in arrays]
        for array in arrays:
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 1
        simulation.apply(Move(time=0, body="ball-2", position=(-20.0, 5.0), velocity=(0.0, 0.0)))
        simulation.apply(Impulse(time=0, body="ball-2", impulse=(1.0, 1.0), angular=4.0))
        advance(simulation, 5)
        simulation.apply(Remove(time=0, body="ball-1"))
        simulation.step()
        assert all(np.array_equal(array, copy) for array, copy in zip(arrays, copies, strict=True))


@pytest.mark.parametrize("array", ["position", "velocity", "angle", "angular_velocity", "radius", "mass", "fixed"])
def test_running_simulation_does_not_change_its_scene(array: str) -> None:
    """A scene is a value: a run must not change the arrays that a later simulation starts from."""
    scene = make_scene(
        world={"gravity": [0, -9.81]},
        grid=[{"origin": [0, 0], "columns": 3, "spacing": [3, 0], "radius": 1, "angular_velocity": 1}],
        ball=[{"position": [0, 5], "radius": 1, "collides": "none"}],
    )
    before = getattr(scene.bodies, array).copy()
    simulation = start(scene)
    simulation.apply(Impulse(time=0, body="ball-1", impulse=(1.0, 1.0), angular=4.0))
    advance(simulation, 5)
    assert np.array_equal(getattr(scene.bodies, array), before)
