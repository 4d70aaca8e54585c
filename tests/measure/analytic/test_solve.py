"""Solutions of whole scenes: independent bodies side by side, and early rejection of scenes without a solution."""

import numpy as np
import pytest

from sandbox.measure.analytic import solution
from sandbox.measure.analytic.solve import BODY_SOLUTIONS, COUPLED_SOLUTIONS
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import scene_of, solution_of

MIXED = (
    "[[plane]]\npoint = [0.0, 0.0]\nnormal = [0.0, 1.0]\nfriction = 0.5\n",
    "[[ball]]\nname = 'dropped'\nposition = [0.0, 3.0]\nradius = 0.5\nrestitution = 0.8\ncollides = 'fixed'\n",
    "[[ball]]\nname = 'rolls'\nposition = [5.0, 0.5]\nradius = 0.5\nvelocity = [1.0, 0.0]\ncollides = 'fixed'\n",
    "[[ball]]\nname = 'flies'\nposition = [9.0, 3.0]\nradius = 0.5\ncollides = 'none'\n",
    "[[ball]]\nname = 'swings'\nposition = [12.0, 3.0]\nradius = 0.1\ncollides = 'none'\n",
    "[[joint]]\nkind = 'rod'\nbetween = ['swings']\nanchors = [[0.0, 0.0], [11.0, 3.0]]\n",
)
WORLD = "gravity = [0.0, -9.81]\nduration = 2.0"


def test_bodies_that_never_collide_have_independent_closed_forms() -> None:
    both = scene_of(*MIXED, world=WORLD)
    form = solution_of(both)
    assert form.about == "free flight, bouncing, rolling on a plane, a pendulum"
    time = np.linspace(0.0, 2.0, 21)
    for index, name in enumerate(both.bodies.names):
        alone = scene_of(
            *(each for each in MIXED if ("[[ball]]" not in each and "swings" not in each) or name in each), world=WORLD
        )
        assert (form.at(time).position[:, index] == solution_of(alone).at(time).position[:, 0]).all()


def test_scene_with_one_unsolvable_body_has_no_solution() -> None:
    extra = "[[ball]]\nname = 'x'\nposition = [20.0, 3.0]\nradius = 0.1\ncollides = 'none'\n"
    assert solution(scene_of(*MIXED, extra, world=WORLD)) is not None
    sliding = extra.replace("'none'\n", "'fixed'\nvelocity = [1.0, 0.0]\n")
    assert solution(scene_of(*MIXED, sliding, world=WORLD)) is None


def test_contacts_are_sorted_by_time_with_the_pair_of_each_body() -> None:
    scene = scene_of(*MIXED, world=WORLD)
    found = solved_run(scene, scene.solver)
    assert (np.diff(found.contact_time) >= 0.0).all()
    assert found.contact_pair[:, 1].tolist() == [-1] * len(found.contact_pair)
    assert sorted(set(found.contact_pair[:, 0].tolist())) == [0, 1]
    assert found.contact_pair[0].tolist() == [1, -1]


CROWD = "columns = 100\nrows = 100\nspacing = [1.0, 1.0]\nradius = 0.4\n"


@pytest.mark.parametrize(
    "scene",
    [
        scene_of(f"[[grid]]\norigin = [0.0, 5.0]\n{CROWD}", world=WORLD),
        scene_of(MIXED[0], f"[[grid]]\norigin = [0.0, 5.0]\nvelocity_jitter = 1.0\ncollides = 'fixed'\n{CROWD}"),
        scene_of(f"[[grid]]\norigin = [0.0, 5.0]\ncollides = 'none'\n{CROWD}[[thrust]]\nbody = 'grid-1-9999'\n"
                 "force = [1.0, 0.0]\n"),
        scene_of(MIXED[0], "[[stack]]\nbase = [0.0, 0.0]\nsize = [1.0, 1.0]\ncolumns = 100\nrows = 30\n", world=WORLD),
    ],
    ids=["all meet", "rubbing", "one is driven", "a wall of 3,000"],
)  # fmt: skip
def test_crowd_is_rejected_after_one_body_is_examined(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Calls of the recognisers are counted, because a test does not assert on time."""
    calls = []

    def counted(recognise):
        return lambda *args: calls.append(1) or recognise(*args)

    monkeypatch.setattr("sandbox.measure.analytic.solve.BODY_SOLUTIONS", tuple(map(counted, BODY_SOLUTIONS)))
    monkeypatch.setattr("sandbox.measure.analytic.solve.COUPLED_SOLUTIONS", tuple(map(counted, COUPLED_SOLUTIONS)))
    assert solution(scene) is None
    assert len(calls) <= len(BODY_SOLUTIONS)
