"""Minimising: what is left shows the disagreement, and nothing in it is idle."""

import math
from functools import cache

import pytest

from sandbox.measure.compare import reduce as module
from sandbox.measure.compare.reduce import DivergencePoint, DivergenceTest, ReducedScene, initial_overlaps, minimise
from sandbox.measure.compare.reductions import expand_generators
from sandbox.measure.metrics.perturbation import TOUCH_TOLERANCE
from sandbox.progress import Progress
from sandbox.scene.compile.bodies import COLUMNS
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, from_document, load, loads
from sandbox.scene.files.shipped_scenes import shipped

pytestmark = pytest.mark.full  # long runs and sweeps

TUNNEL = """
title = "Tunnel"
[world]
duration = 0.2
[solver]
dt = 0.001
[[material]]
name = "steel"
restitution = 0.9
[[plane]]
name = "far"
point = [0.0, -50.0]
normal = [0.0, 1.0]
[[wall]]
name = "thin"
points = [[1.0, -1.0], [1.0, 0.3], [1.0, 1.0], [1.2, 3.0]]
thickness = 0.02
[[grid]]
name = "innocent"
origin = [-5.0, 4.0]
columns = 6
rows = 2
spacing = [0.5, 0.5]
radius = 0.1
velocity = [0.1, 0.0]
material = "steel"
[[ball]]
name = "bullet"
position = [0.0512345, 0.0]
velocity = [100.0, 0.0]
radius = 0.01
mass = 0.01
"""
"""100 m/s is 10 cm a step, and the wall 2 cm thick: between two steps the bullet is through."""

PASSING = """
[world]
duration = 0.1
[solver]
dt = 0.001
[[ball]]
name = "left"
position = [-0.52, 0.0]
velocity = [100.0, 0.0]
radius = 0.01
[[ball]]
name = "right"
position = [0.53, 0.001]
velocity = [-100.0, 0.0]
radius = 0.01
[[scatter]]
count = 9
lower = [-9.0, 3.0]
upper = [9.0, 9.0]
radius = 0.1
"""
"""At 200 m/s of 2 cm they pass through each other, and see it in no step."""

SPRINGS = """
[world]
duration = 0.5
[[ball]]
name = "bob"
position = [1.0, 0.0]
radius = 0.1
[[ball]]
name = "a"
position = [5.0, 0.0]
radius = 0.1
[[ball]]
name = "b"
position = [6.0, 0.0]
radius = 0.1
[[joint]]
kind = "rod"
between = ["a", "b"]
[[joint]]
kind = "spring"
between = ["bob"]
rest_length = 0.5
stiffness = 100.0
[[thrust]]
body = "b"
force = [0.0, 0.0]
"""
"""A spring lets a bob go, the rod and its two balls stay at rest."""

ROLLING = """
[world]
gravity = [0.0, -10.0]
duration = 1.0
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[wall]]
name = "thin"
points = [[5.0, -1.0], [5.0, 3.0]]
[[ball]]
name = "resting"
position = [-9.0, 0.5]
radius = 0.5
[[ball]]
name = "rolling"
position = [-1.05, 0.01]
velocity = [20.0, 0.0]
radius = 0.01
"""
"""A ball rolls over a floor, 20 cm a step, and is through a wall at 0.31 s."""

BOTH = DivergenceTest(["pymunk", "exact"], 1e-4)


@cache
def least_of(text: str, asked: DivergenceTest = BOTH, **bounds: float) -> ReducedScene:
    """Minimise a scene's text."""
    return minimise(loads(text), asked, **bounds)


def shows(scene: Scene, asked: DivergenceTest = BOTH) -> bool:
    """Tell whether a scene, as it would be read from a file, shows a disagreement."""
    return asked.of(loads(dumps(scene))) is not None


def test_a_bullet_that_tunnels_is_left_with_its_wall() -> None:
    found = least_of(TUNNEL)
    assert (found.bodies, found.fixed, found.ended) == ((13, 1), (2, 1), None)
    scene = found.scene
    assert (scene.bodies.names, scene.fixed_names) == (("bullet",), ("thin",))
    assert (scene.materials, scene.grids, len(scene.walls[0].points)) == ((), (), 2)
    assert scene.world.duration < 0.02
    assert scene.solver == loads(TUNNEL).solver
    assert found.divergence is not None
    assert (found.divergence.body, found.divergence.time) == ("bullet", 0.01)  # of the 11 cm to the wall, 10 cm a step
    assert shows(scene)
    assert minimise(scene, BOTH).bodies == (1, 1)


def test_two_that_pass_through_each_other_are_both_kept() -> None:
    found = least_of(PASSING)
    assert found.bodies == (11, 2)
    assert found.scene.bodies.names == ("left", "right")
    assert shows(found.scene)


def test_joints_go_with_their_bodies_and_the_one_that_matters_stays() -> None:
    asked = DivergenceTest(["pymunk", "reference"], 1e-3)
    found = least_of(SPRINGS, asked)
    assert found.scene.bodies.names == ("bob",)
    assert [joint.kind for joint in found.scene.joints] == ["spring"]
    assert found.scene.thrusts == ()
    assert shows(found.scene, asked)


def test_one_engine_is_held_against_the_truth() -> None:
    asked = DivergenceTest(["pymunk"], 1e-4)
    found = least_of(PASSING, asked)
    assert found.bodies == (11, 2)
    assert str(asked) == "pymunk and the truth"
    assert shows(found.scene, asked)


def test_the_same_scene_is_found_every_time() -> None:
    first, second = least_of(TUNNEL), minimise(loads(TUNNEL), BOTH)
    assert (dumps(first.scene), first.runs) == (dumps(second.scene), second.runs)


def test_where_engines_agree_there_is_nothing_to_minimise() -> None:
    text = TUNNEL.replace("velocity = [100.0, 0.0]", "velocity = [1.0, 0.0]")
    found = least_of(text)
    assert (found.divergence, found.scene, found.bodies, found.runs) == (None, loads(text), (13, 13), 1)


def test_what_a_nudge_changes_as_much_is_no_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "agreement_time", lambda *_: 0.005)
    assert BOTH.of(loads(TUNNEL)) is None


NEIGHBOURS = """
[world]
duration = 0.1
[[ball]]
name = "left"
position = [10.02, 0.0312]
velocity = [1.0, 0.0]
radius = 0.0123
[[ball]]
name = "right"
position = [10.06, 0.0234]
radius = 0.0123
[[wall]]
name = "below"
points = [[10.0, 0.01], [10.2, 0.01]]
thickness = 0.001
"""
"""To one digit both balls are at (10, 0.03), and to any digit but the last the left one is in the wall."""


class Found(DivergenceTest):
    """Whatever still has all names of which something hangs, parts."""

    def of(self, scene: Scene, time_limit: float = math.inf) -> DivergencePoint | None:
        names = {*scene.bodies.names, *scene.fixed_names}
        wanted = {"left", "right", "below"} <= names
        return DivergencePoint(0.05, "left", 1.0, frozenset({"left"})) if wanted else None


def test_no_step_lays_two_things_into_each_other() -> None:
    """Law: what overlaps in the smallest scene overlaps in the scene given, and no less deep."""
    for text in (NEIGHBOURS, NEIGHBOURS.replace("10.06", "10.03")):  # apart, and overlapping from the start
        scene = loads(text)
        found = minimise(scene, Found(["pymunk", "reference"], 1e-4))
        before, after = initial_overlaps(scene), initial_overlaps(loads(dumps(found.scene)))
        assert found.runs > 5
        assert found.scene != scene
        for pair, depth in after.items():
            assert depth <= before.get(pair, 0.0) + TOUCH_TOLERANCE


def test_another_body_that_parts_is_another_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = DivergenceTest(["pymunk", "reference"], 1e-4)

    def of(scene: Scene, time_limit: float = math.inf) -> DivergencePoint | None:
        name = "right" if "right" in scene.bodies.names else "left"
        return DivergencePoint(0.05, name, 1.0, frozenset({name}))

    monkeypatch.setattr(asked, "of", of)
    found = minimise(loads(NEIGHBOURS), asked)
    assert found.scene.bodies.names == ("right",)  # the left one alone, which is tried first, would part as well


@pytest.mark.parametrize("after", [1, 4, 9])
def test_interrupted_it_keeps_the_smallest_so_far(after: int) -> None:
    count = 0

    def told(_: Progress) -> None:
        nonlocal count
        count += 1
        if count > after:
            raise KeyboardInterrupt

    found = minimise(loads(TUNNEL), BOTH, on_progress=told)
    assert found.ended == "interrupted"
    assert found.runs == after + 2  # the scene given, and the one that was about to be tried
    assert shows(found.scene)
    assert found.bodies[1] < 13 or after == 1


def test_it_ends_at_its_bounds_with_what_it_has() -> None:
    found = least_of(TUNNEL, max_scenes=5)
    assert (found.ended, found.runs) == ("5 scenes have been tried", 5)
    assert shows(found.scene)


def test_an_answer_that_is_not_found_again_leaves_the_scene_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = DivergenceTest(BOTH.engines, BOTH.tolerance)
    honest = asked.of

    def fickle(scene: Scene, time_limit: float = math.inf) -> DivergencePoint | None:
        return None if time_limit == math.inf else honest(scene, time_limit)  # only the last try has all the time

    monkeypatch.setattr(asked, "of", fickle)
    found = minimise(loads(TUNNEL), asked, max_scenes=5)
    assert (found.scene, found.bodies) == (loads(TUNNEL), (13, 13))
    assert found.ended == "the result of an engine is not reproducible, so nothing was removed"


def test_a_scene_that_parts_sooner_parts_for_another_reason() -> None:
    # Without its floor the ball would fall, and in 0.1 s Euler's fall is g·h·T/2 = 5 mm behind.
    asked = DivergenceTest(["pymunk", "exact"], 0.005)
    found = least_of(ROLLING, asked)
    assert (found.scene.bodies.names, found.scene.fixed_names) == (("rolling",), ("thin",))
    assert found.scene.world.gravity == (0.0, 0.0)  # so the floor could go after all
    assert found.divergence is not None
    assert found.divergence.time >= 0.8 * 0.31
    assert shows(found.scene, asked)


def test_three_engines_are_no_disagreement() -> None:
    with pytest.raises(ValueError, match="two engines, not 3"):
        DivergenceTest(["pymunk", "exact", "reference"], 1e-3)


@pytest.mark.parametrize("name", ["benchmark/pyramid", "benchmark/pile", "joints/bridge", "tutorial/spaceship"])
@pytest.mark.parametrize("whole", [False, True])
def test_a_scene_spelled_out_has_the_same_bodies(name: str, whole: bool) -> None:
    scene = load(next(each.path for each in shipped() if each.name == name))
    found = from_document(expand_generators(scene, whole).document)
    assert found.bodies.names == scene.bodies.names
    for column in COLUMNS:
        assert getattr(found.bodies, column).tolist() == getattr(scene.bodies, column).tolist(), column
    assert found.fixed_names == scene.fixed_names
    assert len(found.links) == len(scene.links)


def test_what_is_left_out_takes_along_who_speaks_of_it() -> None:
    text = SPRINGS + '[[attraction]]\ntoward = "b"\nstrength = 1.0\n'
    text += '[[rope]]\nstart = [5.0, 0.0]\nend = [8.0, 0.0]\nlinks = 4\ntie = { start = "a", end = "b" }\n'
    text = text.replace("end = [8.0, 0.0]", "end = [6.0, 0.0]")
    whole = expand_generators(loads(text))
    left = whole.without([("ball", 2)]).document
    assert [ball["name"] for ball in left["ball"]] == ["bob", "a"]
    assert [joint["kind"] for joint in left["joint"]] == ["spring"]
    assert "attraction" not in left
    assert "thrust" not in left
    assert left["rope"][0]["tie"] == {"start": "a"}
    assert from_document(left).bodies.names[:2] == ("bob", "a")
