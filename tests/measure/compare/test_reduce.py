"""Reduction of scenes: the reduced scene shows the disagreement, and has no unnecessary parts."""

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

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

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
"""100 m/s is 10 cm a step, and the wall is 2 cm thick: the bullet passes it between two steps."""

PASSING = """
world = { duration = 0.1 }
solver = { dt = 0.001 }
ball = [
  { name = "left", position = [-0.52, 0.0], velocity = [100.0, 0.0], radius = 0.01 },
  { name = "right", position = [0.53, 0.001], velocity = [-100.0, 0.0], radius = 0.01 },
]
scatter = [{ count = 9, lower = [-9.0, 3.0], upper = [9.0, 9.0], radius = 0.1 }]
"""
"""At a closing speed of 200 m/s balls of 2 cm pass through each other without an overlap in any step."""

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
"""A stretched spring releases a bob; the rod and its two balls stay at rest."""

ROLLING = """
world = { gravity = [0.0, -10.0], duration = 1.0 }
plane = [{ point = [0.0, 0.0], normal = [0.0, 1.0] }]
wall = [{ name = "thin", points = [[5.0, -1.0], [5.0, 3.0]] }]
ball = [
  { name = "resting", position = [-9.0, 0.5], radius = 0.5 },
  { name = "rolling", position = [-1.05, 0.01], velocity = [20.0, 0.0], radius = 0.01 },
]
"""
"""A ball rolls over a floor, 20 cm a step, and passes a wall at 0.31 s."""

BOTH = DivergenceTest(["pymunk", "exact"], 1e-4)


@cache
def reduced(text: str, test: DivergenceTest = BOTH, **bounds: float) -> ReducedScene:
    """Minimise a scene given as text."""
    return minimise(loads(text), test, **bounds)


def shows_divergence(scene: Scene, test: DivergenceTest = BOTH) -> bool:
    """Return whether a scene, written and read again, shows a disagreement."""
    return test.of(loads(dumps(scene))) is not None


def test_tunnelling_bullet_is_reduced_to_itself_and_its_wall() -> None:
    found = reduced(TUNNEL)
    assert (found.bodies, found.fixed, found.ended) == ((13, 1), (2, 1), None)
    scene = found.scene
    assert (scene.bodies.names, scene.fixed_names) == (("bullet",), ("thin",))
    assert (scene.materials, scene.grids, len(scene.walls[0].points)) == ((), (), 2)
    assert scene.world.duration < 0.02
    assert scene.solver == loads(TUNNEL).solver
    assert (found.divergence.body, found.divergence.time) == ("bullet", 0.01)  # the wall is 11 cm away, a step is 10 cm
    assert shows_divergence(scene)
    assert minimise(scene, BOTH).bodies == (1, 1)


@pytest.mark.parametrize("test", [BOTH, DivergenceTest(["pymunk"], 1e-4)], ids=str)
def test_two_balls_that_pass_through_each_other_are_both_kept(test: DivergenceTest) -> None:
    assert str(test) in ("pymunk and exact", "pymunk and the truth")
    found = reduced(PASSING, test)
    assert found.bodies == (11, 2)
    assert found.scene.bodies.names == ("left", "right")
    assert shows_divergence(found.scene, test)


def test_joints_are_removed_with_their_bodies_except_the_relevant_one() -> None:
    test = DivergenceTest(["pymunk", "reference"], 1e-3)
    found = reduced(SPRINGS, test)
    assert found.scene.bodies.names == ("bob",)
    assert [joint.kind for joint in found.scene.joints] == ["spring"]
    assert found.scene.thrusts == ()
    assert shows_divergence(found.scene, test)


def test_scene_without_disagreement_is_not_reduced() -> None:
    text = TUNNEL.replace("velocity = [100.0, 0.0]", "velocity = [1.0, 0.0]")
    found = reduced(text)
    assert (found.divergence, found.scene, found.bodies, found.runs) == (None, loads(text), (13, 13), 1)


def test_divergence_that_a_perturbation_causes_too_is_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
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
"""With positions rounded to one digit, the balls overlap each other, and the right one overlaps the wall."""


class DivergenceByNames(DivergenceTest):
    """Test that reports a divergence while all the needed names are in the scene."""

    def of(self, scene: Scene, time_limit: float = math.inf) -> DivergencePoint | None:
        names = {*scene.bodies.names, *scene.fixed_names}
        wanted = {"left", "right", "below"} <= names
        return DivergencePoint(0.05, "left", 1.0, frozenset({"left"})) if wanted else None


def test_reduction_creates_no_overlap() -> None:
    """Overlaps of the reduced scene are overlaps of the given scene too, and no deeper than there."""
    for text in (NEIGHBOURS, NEIGHBOURS.replace("10.06", "10.03")):  # apart, and overlapping from the start
        scene = loads(text)
        found = minimise(scene, DivergenceByNames(["pymunk", "reference"], 1e-4))
        before, after = initial_overlaps(scene), initial_overlaps(loads(dumps(found.scene)))
        assert found.runs > 5
        assert found.scene != scene
        for pair, depth in after.items():
            assert depth <= before.get(pair, 0.0) + TOUCH_TOLERANCE


def test_divergence_of_a_different_body_is_a_different_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    test = DivergenceTest(["pymunk", "reference"], 1e-4)

    def of(scene: Scene, time_limit: float = math.inf) -> DivergencePoint | None:
        name = "right" if "right" in scene.bodies.names else "left"
        return DivergencePoint(0.05, name, 1.0, frozenset({name}))

    monkeypatch.setattr(test, "of", of)
    found = minimise(loads(NEIGHBOURS), test)
    assert found.scene.bodies.names == ("right",)  # the left one alone, tried first, would diverge too


@pytest.mark.parametrize("after", [1, 4, 9])
def test_interrupted_reduction_returns_the_smallest_scene_so_far(after: int) -> None:
    count = 0

    def interrupt(_: Progress) -> None:
        nonlocal count
        count += 1
        if count > after:
            raise KeyboardInterrupt

    found = minimise(loads(TUNNEL), BOTH, on_progress=interrupt)
    assert found.ended == "interrupted"
    assert found.runs == after + 2  # the given scene, and the one that was about to be tried
    assert shows_divergence(found.scene)
    assert found.bodies[1] < 13 or after == 1


def test_reduction_ends_at_its_limit_with_a_valid_scene() -> None:
    found = reduced(TUNNEL, max_scenes=5)
    assert (found.ended, found.runs) == ("5 scenes have been tried", 5)
    assert shows_divergence(found.scene)


def test_irreproducible_divergence_leaves_the_scene_unchanged(monkeypatch: pytest.MonkeyPatch) -> None:
    test = DivergenceTest(BOTH.engines, BOTH.tolerance)
    original = test.of

    def irreproducible(scene: Scene, time_limit: float = math.inf) -> DivergencePoint | None:
        # only the final check is not limited in time
        return None if time_limit == math.inf else original(scene, time_limit)

    monkeypatch.setattr(test, "of", irreproducible)
    found = minimise(loads(TUNNEL), test, max_scenes=5)
    assert (found.scene, found.bodies) == (loads(TUNNEL), (13, 13))
    assert found.ended == "the result of an engine is not reproducible, so nothing was removed"


def test_scene_that_diverges_earlier_is_not_accepted() -> None:
    # Without its floor the ball would fall, and within 0.1 s Euler lags the fall by g·h·T/2 = 5 mm.
    test = DivergenceTest(["pymunk", "exact"], 0.005)
    found = reduced(ROLLING, test)
    assert (found.scene.bodies.names, found.scene.fixed_names) == (("rolling",), ("thin",))
    assert found.scene.world.gravity == (0.0, 0.0)  # so that the floor could be removed after all
    assert found.divergence.time >= 0.8 * 0.31
    assert shows_divergence(found.scene, test)


def test_divergence_test_of_three_engines_is_rejected() -> None:
    with pytest.raises(ValueError, match="two engines, not 3"):
        DivergenceTest(["pymunk", "exact", "reference"], 1e-3)


@pytest.mark.parametrize("name", ["benchmark/pyramid", "benchmark/pile", "joints/bridge", "tutorial/spaceship"])
@pytest.mark.parametrize("whole", [False, True])
def test_scene_with_expanded_generators_has_the_same_bodies(name: str, whole: bool) -> None:
    scene = load(next(each.path for each in shipped() if each.name == name))
    found = from_document(expand_generators(scene, whole).document)
    assert found.bodies.names == scene.bodies.names
    for column in COLUMNS:
        assert getattr(found.bodies, column).tolist() == getattr(scene.bodies, column).tolist(), column
    assert found.fixed_names == scene.fixed_names
    assert len(found.joint_arrays) == len(scene.joint_arrays)


def test_removed_body_takes_its_references_along() -> None:
    text = SPRINGS + '[[attraction]]\ntoward = "b"\nstrength = 1.0\n'
    text += '[[rope]]\nstart = [5.0, 0.0]\nend = [8.0, 0.0]\nlinks = 4\ntie = { start = "a", end = "b" }\n'
    text = text.replace("end = [8.0, 0.0]", "end = [6.0, 0.0]")
    whole = expand_generators(loads(text))
    remaining = whole.without([("ball", 2)]).document
    assert [ball["name"] for ball in remaining["ball"]] == ["bob", "a"]
    assert [joint["kind"] for joint in remaining["joint"]] == ["spring"]
    assert "attraction" not in remaining
    assert "thrust" not in remaining
    assert remaining["rope"][0]["tie"] == {"start": "a"}
    assert from_document(remaining).bodies.names[:2] == ("bob", "a")
