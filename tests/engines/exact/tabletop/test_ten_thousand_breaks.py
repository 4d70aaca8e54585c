"""Thousands of breaks: none fails, and no ball leaves the table."""

from dataclasses import dataclass

import numpy as np
import pytest

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import COMPILED
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

NAMES = ["billiards/8-ball", "billiards/9-ball", "billiards/snooker", "billiards/three-cushion"]
MAX_OVERLAP = 1e-9  # m: contact tolerance


@dataclass
class Break:
    scene: Scene
    position: FloatArray
    pocket: FloatArray


def play_breaks(name: str, seed: int, count: int) -> Break:
    """Play breaks of one rack with random aim, speed and spin."""
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


def check_final_positions(breaks: Break) -> None:
    """Assert that every ball is in a pocket or on the table, clear of the cushions and of every other ball."""
    scene, radius = breaks.scene, breaks.scene.bodies.radius
    pocketed = breaks.pocket >= 0
    lower, upper = np.asarray(scene.play.area)
    segments = np.asarray(
        [(*a, *b) for wall in scene.walls for a, b in zip(wall.points, wall.points[1:], strict=False)]
    )
    for a, b in zip(segments[:, :2], segments[:, 2:], strict=True):
        along = np.clip(((breaks.position - a) @ (b - a)) / ((b - a) @ (b - a)), 0.0, 1.0)
        gap = np.hypot(*np.moveaxis(breaks.position - a - along[..., None] * (b - a), -1, 0)) - radius
        assert gap[~pocketed].min() >= -MAX_OVERLAP
    for post in scene.posts:
        gap = np.hypot(*np.moveaxis(breaks.position - np.asarray(post.position), -1, 0)) - radius - post.radius
        assert gap[~pocketed].min() >= -MAX_OVERLAP
    on_table = (breaks.position >= lower + radius[:, None] - 0.15) & (breaks.position <= upper - radius[:, None] + 0.15)
    assert on_table.all(axis=2)[~pocketed].all()  # at most in the mouth of a pocket, 0.15 m deep
    for i in range(len(radius)):
        for k in range(i):
            gap = np.hypot(*(breaks.position[:, i] - breaks.position[:, k]).T) - radius[i] - radius[k]
            assert gap[~pocketed[:, i] & ~pocketed[:, k]].min(initial=1.0) >= -MAX_OVERLAP


@pytest.mark.parametrize(
    "name", ["billiards/8-ball", "billiards/9-ball", "billiards/snooker", "billiards/three-cushion"]
)
def test_hundreds_of_breaks_end_on_the_table(name: str) -> None:
    for seed in range(3):
        # uncompiled, a break takes some tenths of a second
        check_final_positions(play_breaks(name, seed, 40 if COMPILED else 4))


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(100))
def test_ten_thousand_breaks_end_on_the_table(seed: int) -> None:
    for name in NAMES:
        check_final_positions(play_breaks(name, seed, 25))
