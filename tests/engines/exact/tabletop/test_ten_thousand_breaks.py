"""Breaks by the thousand: nothing fails, nothing leaves the table."""

from dataclasses import dataclass

import numpy as np
import pytest

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import COMPILED
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find

pytestmark = pytest.mark.full  # long runs and sweeps

NAMES = ["billiards/8-ball", "billiards/9-ball", "billiards/snooker", "billiards/three-cushion"]
DEEP = 1e-9  # m: what touches may stand so deep


@dataclass
class Break:
    scene: Scene
    position: FloatArray
    pocket: FloatArray


def played(name: str, seed: int, count: int) -> Break:
    """Play breaks of one rack, their aim, strength and spin drawn anew for each."""
    scene = load(find(name), [f"world.seed={seed}", f"billiards.gap={(0.0, 1e-5, 3e-4)[seed % 3]}"])
    shot = scene.shots[0]
    random = np.random.default_rng(seed)
    strokes = [
        shot.model_copy(
            update={
                "aim": shot.aim + float(random.normal(0.0, 0.02)),
                "speed": shot.speed * float(random.uniform(0.3, 1.5)),
                "side": float(random.uniform(-0.3, 0.3)),
                "height": float(random.uniform(-0.3, 0.35)),
            }
        )
        for _ in range(count)
    ]
    fan = Table(scene).fan(strokes, shot.ball)
    assert fan.complete.all()
    return Break(scene, fan.position, fan.pocket)


def check(breaks: Break) -> None:
    """Every ball lies in a pocket, or on the cloth, clear of the cushions and of every other."""
    scene, radius = breaks.scene, breaks.scene.bodies.radius
    fell = breaks.pocket >= 0
    lower, upper = np.asarray(scene.play.area)
    segments = np.asarray(
        [(*a, *b) for wall in scene.walls for a, b in zip(wall.points, wall.points[1:], strict=False)]
    )
    for a, b in zip(segments[:, :2], segments[:, 2:], strict=True):
        along = np.clip(((breaks.position - a) @ (b - a)) / ((b - a) @ (b - a)), 0.0, 1.0)
        gap = np.hypot(*np.moveaxis(breaks.position - a - along[..., None] * (b - a), -1, 0)) - radius
        assert gap[~fell].min() >= -DEEP
    for post in scene.posts:
        gap = np.hypot(*np.moveaxis(breaks.position - np.asarray(post.position), -1, 0)) - radius - post.radius
        assert gap[~fell].min() >= -DEEP
    on = (breaks.position >= lower + radius[:, None] - 0.15) & (breaks.position <= upper - radius[:, None] + 0.15)
    assert on.all(axis=2)[~fell].all()  # in the mouth of a pocket at most, 0.15 m deep
    for i in range(len(radius)):
        for k in range(i):
            apart = np.hypot(*(breaks.position[:, i] - breaks.position[:, k]).T) - radius[i] - radius[k]
            assert apart[~fell[:, i] & ~fell[:, k]].min(initial=1.0) >= -DEEP


@pytest.mark.parametrize(
    "name", ["billiards/8-ball", "billiards/9-ball", "billiards/snooker", "billiards/three-cushion"]
)
def test_hundreds_of_breaks_end_on_the_table(name: str) -> None:
    for seed in range(3):
        check(played(name, seed, 40 if COMPILED else 4))  # as plain Python, a break takes some tenths of a second


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_ten_thousand_breaks_end_on_the_table(seed: int) -> None:
    for name in NAMES:
        check(played(name, seed, 25))
