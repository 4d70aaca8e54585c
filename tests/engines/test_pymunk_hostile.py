"""The pymunk engine under any scene, any action and any mixture of materials."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.contract import Divergence, Simulation
from sandbox.engines.registry import able, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from tests.strategies import Document, documents, numbers

pytestmark = pytest.mark.full  # property tests with many examples


@st.composite
def runnable(draw: st.DrawFn) -> Scene:
    """Sound scenes without the words that only other engines know, and with work for a fraction of a second."""
    document: Document = draw(documents(most=2))
    solver = document.get("solver", {})
    for word in ("integrator", "detection", "response", "broad_phase"):
        solver.pop(word, None)
    for key, most in (("substeps", 3), ("iterations", 20)):
        if key in solver:
            solver[key] = min(solver[key], most)
    scene = from_document(document)
    assume(able(scene))  # but for half a kick in drag
    return scene


def outcome(simulation: Simulation, steps: int) -> tuple[str | None, str]:
    """Step; return the divergence, if there is one, and the hash of the state at the end."""
    diverged = None
    try:
        for _ in range(steps):
            simulation.step()
            assert finite(simulation)
    except Divergence as divergence:
        diverged = str(divergence)
    return diverged, simulation.state_hash()


def finite(simulation: Simulation) -> bool:
    frame = simulation.frame()
    state = (frame.position, frame.velocity, frame.angle, frame.angular_velocity)
    return all(bool(np.isfinite(each).all()) for each in state)


@given(runnable())
@settings(max_examples=80)
def test_any_scene_runs_finite_or_diverges_and_does_so_again(scene: Scene) -> None:
    first, again = start(scene), start(scene)
    first.contacts()  # recording contacts must not matter
    assert outcome(first, 20) == outcome(again, 20)
    assert np.isfinite(first.contacts().time).all()


@st.composite
def deeds(draw: st.DrawFn, known: tuple[str, ...]) -> Action:
    """Actions on the bodies of a scene, some of which are not there."""
    body = st.sampled_from([*known, "spawned-1", "zzz"])
    amount = numbers(-1e42, 1e42) | numbers(-10, 10)
    place = numbers(-1e16, 1e16) | numbers(-100, 100)
    speed = numbers(-7e11, 7e11) | numbers(-10, 10)
    ball = st.builds(
        Ball,
        position=st.tuples(place, place),
        velocity=st.tuples(speed, speed),
        radius=numbers(1e-9, 1e9) | numbers(0.01, 1),
        mass=st.none() | numbers(1e-15, 1e30),
        density=st.none() | numbers(1e-30, 1e30),
        restitution=st.none() | numbers(0, 1),
        friction=st.none() | numbers(0, 1000),
        fixed=st.booleans(),
        collides=st.sampled_from(["all", "fixed", "none"]),
        name=st.none() | st.sampled_from([*known, "new"]),
    )
    path = st.sampled_from(
        ["world.gravity", "world.wind", "world.linear_drag", "world.quadratic_drag", "ball.0.friction",
         "material.0.restitution", "plane.0.friction", "wall.0.restitution", "pair.0.friction", "solver.dt", "x"]
    )  # fmt: skip
    value: st.SearchStrategy[Any] = numbers(-1, 1000) | st.lists(numbers(-100, 100), max_size=3) | st.none()
    kinds: list[st.SearchStrategy[Action]] = [
        st.builds(Impulse, time=st.just(0.0), body=body, impulse=st.tuples(amount, amount), angular=amount),
        st.builds(Force, time=st.just(0.0), body=body, force=st.tuples(amount, amount), torque=amount),
        st.builds(
            Move,
            time=st.just(0.0),
            body=body,
            position=st.tuples(place, place),
            velocity=st.none() | st.tuples(speed, speed),
        ),
        st.builds(Spawn, time=st.just(0.0), ball=ball),
        st.builds(Remove, time=st.just(0.0), body=body),
        st.builds(SetParameter, time=st.just(0.0), path=path, value=value),
    ]
    return draw(st.one_of(kinds))


@given(st.data())
@settings(max_examples=80)
def test_any_action_is_done_or_refused_with_nothing_changed(data: st.DataObject) -> None:
    scene = data.draw(runnable())
    every = data.draw(st.lists(deeds(scene.bodies.names), min_size=1, max_size=8))

    def played() -> tuple[str | None, str]:
        simulation = start(scene)
        simulation.contacts()
        diverged = None
        for action in every:
            before = simulation.state_hash()
            try:
                simulation.apply(action)
            except ActionError as error:
                assert str(error)
                assert simulation.state_hash() == before
            assert finite(simulation)
            diverged, after = outcome(simulation, 2)
            if diverged is not None:
                return diverged, after
        return outcome(simulation, 10)

    assert played() == played()


MATERIALS = ("a", "b", "c", "d")
PAIRS = list(itertools.combinations_with_replacement(MATERIALS, 2))
COEFFICIENTS = st.none() | numbers(0, 1)


@given(
    st.lists(st.tuples(COEFFICIENTS, COEFFICIENTS), min_size=4, max_size=4),
    st.lists(st.tuples(st.booleans(), COEFFICIENTS, COEFFICIENTS), min_size=10, max_size=10),
    st.lists(COEFFICIENTS, min_size=8, max_size=8),
)
def test_every_mixture_in_one_scene_rebounds_and_rubs_by_its_own_figures(
    stated: list[tuple[float | None, float | None]],
    paired: list[tuple[bool, float | None, float | None]],
    own: list[float | None],
) -> None:
    """Four materials with figures of their own or none, pairs in any number, figures on shapes: no factors serve all.

    A ball of each kind falls on a wall of each kind with slip, once: v' = e·v, and it loses μ·(1 + e)·v along the wall,
    as long as that does not stop the slip, which starts at 10 v and loses thrice as much.
    """

    def figures(restitution: float | None, friction: float | None) -> dict[str, float]:
        both = {"restitution": restitution, "friction": friction}
        return {key: value for key, value in both.items() if value is not None}

    def kind(material: int, restitution: float | None, friction: float | None) -> dict[str, Any]:
        return {"material": MATERIALS[material], **figures(restitution, friction)}

    # Four plain kinds, and four with figures of their own.
    kinds = [kind(k, None, None) for k in range(4)]
    kinds += [kind(k, own[k], own[k + 4]) for k in range(4)]
    table = {frozenset(two): figures(e, mu) for two, (listed, e, mu) in zip(PAIRS, paired, strict=True) if listed}
    document: dict[str, Any] = {
        "solver": {"dt": 0.01},
        "material": [{"name": name, **figures(*each)} for name, each in zip(MATERIALS, stated, strict=True)],
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
    for _ in range(4):
        simulation.step()
    velocity = simulation.frame().velocity

    def wanted(figure: str, a: dict[str, Any], b: dict[str, Any]) -> float:
        pair = table.get(frozenset((a["material"], b["material"])), {})
        if figure in pair:
            return float(pair[figure])
        materials = {material["name"]: material for material in document["material"]}
        sides = [each.get(figure, materials[each["material"]].get(figure)) for each in (a, b)]
        known = [side for side in sides if side is not None]
        return float(np.prod(known)) if known else 0.0

    for n, (row, column) in enumerate(itertools.product(range(8), repeat=2)):
        e, mu = (wanted(figure, kinds[row], kinds[column]) for figure in ("restitution", "friction"))
        # A few roundings, of a product of factors, an impulse and a velocity; and of the normal's tilt, times 10 m/s.
        assert velocity[n, 1] == pytest.approx(e, rel=1e-12, abs=1e-14)
        assert velocity[n, 0] == pytest.approx(10 - mu * (1 + e), rel=1e-14)  # as above


def test_frames_are_values_that_nothing_reaches_through() -> None:
    """Neither does the engine's going on change a frame, nor can a frame be written to."""
    particle = {"position": [9, 9], "radius": 1, "velocity": [1, 2], "angular_velocity": 3}
    for free, spin in itertools.product((True, False), repeat=2):
        collides = "none" if free else "all"
        other = {**particle, "position": [-9, 9], "angular_velocity": 3 if spin else 0, "collides": collides}
        scene = from_document(
            {
                "world": {"gravity": [0, -9.81]},
                "plane": [] if free else [{"point": [0, 0], "normal": [0, 1], "friction": 0.5}],
                "ball": [{**other, "position": [9, 9]}, other],
            }
        )
        simulation = start(scene)
        simulation.step()
        frame = simulation.frame()
        arrays = (frame.position, frame.velocity, frame.angle, frame.angular_velocity, frame.present)
        kept = [array.copy() for array in arrays]
        for array in arrays:
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 1
        simulation.apply(Move(time=0, body="ball-2", position=(-20.0, 5.0), velocity=(0.0, 0.0)))
        simulation.apply(Impulse(time=0, body="ball-2", impulse=(1.0, 1.0), angular=4.0))
        for _ in range(5):
            simulation.step()
        simulation.apply(Remove(time=0, body="ball-1"))
        simulation.step()
        assert all(np.array_equal(array, copy) for array, copy in zip(arrays, kept, strict=True))


@pytest.mark.parametrize("array", ["position", "velocity", "angle", "angular_velocity", "radius", "mass", "fixed"])
def test_running_simulation_does_not_see_what_becomes_of_its_description(array: str) -> None:
    """A scene is a value: two simulations of it, one started after the other ran, are the same."""
    scene = from_document(
        {
            "world": {"gravity": [0, -9.81]},
            "grid": [{"origin": [0, 0], "columns": 3, "spacing": [3, 0], "radius": 1, "angular_velocity": 1}],
            "ball": [{"position": [0, 5], "radius": 1, "collides": "none"}],
        }
    )
    before = getattr(scene.bodies, array).copy()
    simulation = start(scene)
    simulation.apply(Impulse(time=0, body="ball-1", impulse=(1.0, 1.0), angular=4.0))
    for _ in range(5):
        simulation.step()
    assert np.array_equal(getattr(scene.bodies, array), before)
