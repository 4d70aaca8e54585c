"""Seeds: the same scene with different random values."""

import numpy as np
import pytest

from sandbox.measure.seeds import is_random, same_random_state, with_seed
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import loads

PLAIN = "[world]\nseed = 3\n[[ball]]\nname = 'a'\nposition = [0, 0]\nradius = 1\n"
RANDOM_PARTS = {
    "velocity": "[[grid]]\norigin = [0, 0]\ncolumns = 2\nrows = 2\nspacing = [1, 1]\nradius = 0.1\n"
    "velocity_jitter = 1.0\n",
    "place": "[[scatter]]\nlower = [0, 0]\nupper = [9, 9]\ncount = 3\nradius = 0.1\n",
    "row": "[[stack]]\nbase = [0, 0]\nsize = [1, 1]\ncolumns = 1\nrows = 3\njitter = 0.1\n",
}


def test_scene_without_random_parts_is_not_random() -> None:
    assert not is_random(loads(PLAIN))
    without_jitter = RANDOM_PARTS["velocity"].replace("velocity_jitter = 1.0\n", "")
    assert not is_random(loads(without_jitter))


@pytest.mark.parametrize("kind", RANDOM_PARTS)
def test_scene_with_random_parts_depends_on_its_seed(kind: str) -> None:
    scene = loads(RANDOM_PARTS[kind])
    other = with_seed(scene, 7)
    assert is_random(scene)
    assert other.world.seed == 7
    assert not same_random_state(scene, other)
    assert same_random_state(scene, with_seed(other, scene.world.seed))
    assert np.array_equal(scene.bodies.mass, other.bodies.mass)


def test_with_seed_changes_only_the_seed() -> None:
    scene = loads("[world]\nduration = 2.0\n" + RANDOM_PARTS["place"])
    mine, its = to_document(scene), to_document(with_seed(scene, 5))
    assert its.pop("world") == {**mine.pop("world"), "seed": 5}
    assert mine == its


def test_largest_seed_is_accepted() -> None:
    assert is_random(loads(RANDOM_PARTS["place"] + f"[world]\nseed = {2**63 - 1}\n"))


def test_seed_out_of_range_raises_scene_error() -> None:
    with pytest.raises(SceneError, match="seed"):
        with_seed(loads(PLAIN), -1)
