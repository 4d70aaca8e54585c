"""`Table.with_balls`: shots from moved balls; a ball placed in a pocket collides with nothing."""

import numpy as np

from sandbox.engines.exact.tabletop.shots import Table
from sandbox.scene.description.surface import Stroke
from tests.engines.exact.tabletop.small_tables import ball, table

SCENE = table(
    ball("cue", 0.0, 0.0), ball("a", 0.5, 0.0), cushions=False,
    pocket=[{"name": "hole", "position": [1.0, 0.0], "radius": 0.06}],
)  # fmt: skip
SHOT = Stroke(aim=0.0, speed=1.0)


def test_shot_starts_from_the_moved_balls() -> None:
    played_table = Table(SCENE)
    moved = played_table.with_balls({"a": (0.5, 0.2)})
    assert next(event.kind for event in played_table.shoot(SHOT).events if event.kind in ("ball", "pocket")) == "ball"
    assert moved.shoot(SHOT).pocketed == {"cue": "hole"}
    assert np.array_equal(played_table.position, [[0.0, 0.0], [0.5, 0.0]])  # the original table is unchanged


def test_ball_placed_in_a_pocket_is_pocketed() -> None:
    played_table = Table(SCENE).with_balls({"a": (1.0, 0.0)})
    outcome = played_table.shoot(SHOT)
    assert outcome.pocketed == {"cue": "hole"}
    assert not [event for event in outcome.events if event.kind == "ball"]
    assert played_table.fan([SHOT]).pocket.tolist() == [[0, 0]]
    restored = played_table.with_balls({"a": (0.5, 0.0)})
    assert next(event.kind for event in restored.shoot(SHOT).events if event.kind in ("ball", "pocket")) == "ball"
