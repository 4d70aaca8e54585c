"""`Table.with_balls`: shots from moved balls; a ball placed in a pocket collides with nothing."""

import numpy as np

from sandbox.engines.exact.tabletop.shots import Table
from sandbox.scene.description.surface import Stroke
from sandbox.scene.files.load import loads

SCENE = loads(
    """
    [surface]
    sliding_friction = 0.2
    rolling_friction = 0.01
    [[pocket]]
    name = "hole"
    position = [1.0, 0.0]
    radius = 0.06
    [[ball]]
    name = "cue"
    position = [0.0, 0.0]
    radius = 0.03
    restitution = 1.0
    [[ball]]
    name = "a"
    position = [0.5, 0.0]
    radius = 0.03
    restitution = 1.0
    """
)
SHOT = Stroke(aim=0.0, speed=1.0)


def test_shot_starts_from_the_moved_balls() -> None:
    table = Table(SCENE)
    moved = table.with_balls({"a": (0.5, 0.2)})
    assert next(event.kind for event in table.shoot(SHOT).events if event.kind in ("ball", "pocket")) == "ball"
    assert moved.shoot(SHOT).pocketed == {"cue": "hole"}
    assert np.array_equal(table.position, [[0.0, 0.0], [0.5, 0.0]])  # the original table is unchanged


def test_ball_placed_in_a_pocket_is_pocketed() -> None:
    table = Table(SCENE).with_balls({"a": (1.0, 0.0)})
    outcome = table.shoot(SHOT)
    assert outcome.pocketed == {"cue": "hole"}
    assert not [event for event in outcome.events if event.kind == "ball"]
    assert table.fan([SHOT]).pocket.tolist() == [[0, 0]]
    restored = table.with_balls({"a": (0.5, 0.0)})
    assert next(event.kind for event in restored.shoot(SHOT).events if event.kind in ("ball", "pocket")) == "ball"
