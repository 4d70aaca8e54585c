"""Seeds: the same scene with other chances."""

import numpy as np
import pytest

from sandbox.measure.seeds import is_random, same_random_state, with_seed
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import loads

PLAIN = "[world]\nseed = 3\n[[ball]]\nname = 'a'\nposition = [0, 0]\nradius = 1\n"
HEADS = {
    "velocity": "[[grid]]\norigin = [0, 0]\ncolumns = 2\nrows = 2\nspacing = [1, 1]\nradius = 0.1\n"
    "velocity_jitter = 1.0\n",
    "place": "[[scatter]]\nlower = [0, 0]\nupper = [9, 9]\ncount = 3\nradius = 0.1\n",
    "row": "[[stack]]\nbase = [0, 0]\nsize = [1, 1]\ncolumns = 1\nrows = 3\njitter = 0.1\n",
}


def test_scene_without_chances_is_none() -> None:
    assert not is_random(loads(PLAIN))
    calm = HEADS["velocity"].replace("velocity_jitter = 1.0\n", "")
    assert not is_random(loads(calm))


@pytest.mark.parametrize("kind", HEADS)
def test_scene_with_chances_is_random_and_its_seeds_differ(kind: str) -> None:
    scene = loads(HEADS[kind])
    other = with_seed(scene, 7)
    assert is_random(scene)
    assert other.world.seed == 7
    assert not same_random_state(scene, other)
    assert same_random_state(scene, with_seed(other, scene.world.seed))
    assert np.array_equal(scene.bodies.mass, other.bodies.mass)


def test_only_the_seed_is_another() -> None:
    scene = loads("[world]\nduration = 2.0\n" + HEADS["place"])
    mine, its = to_document(scene), to_document(with_seed(scene, 5))
    assert its.pop("world") == {**mine.pop("world"), "seed": 5}
    assert mine == its


def test_seed_at_the_end_of_its_range_is_no_trap() -> None:
    assert is_random(loads(HEADS["place"] + f"[world]\nseed = {2**63 - 1}\n"))


def test_seed_out_of_range_is_a_fault() -> None:
    with pytest.raises(SceneError, match="seed"):
        with_seed(loads(PLAIN), -1)
