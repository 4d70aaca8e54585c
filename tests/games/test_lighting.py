"""Lamps that are kept with a run: what is told is what the rules lit, as it can be seen in a film."""

import json

import pytest

from sandbox.games.session import LAMP_INTERVAL, LampLog, LampRecorder
from tests.toy_game import Toy, toy_scene

STEP = 0.01


class Lamped(Toy):
    """The toy with lamps that are lit as a test says."""

    now: frozenset[str] = frozenset()
    asked = 0

    def lit_lamps(self) -> frozenset[str]:
        self.asked += 1
        return self.now


def test_lamps_are_those_that_were_lit_at_each_look() -> None:
    scene = toy_scene()
    rules = Lamped(scene, scene.bodies)
    lighting, lit = LampRecorder(rules), {}
    for k in range(200):
        rules.now = frozenset({"a", "b"} if k % 40 < 20 else {"c"} if k % 80 < 60 else ())
        lighting.update(k * STEP)
        lit[k * STEP] = rules.now
    kept = LampLog.from_changes(json.loads(json.dumps(lighting.changes())))
    assert all(kept.at(time) == those for time, those in lit.items())  # they change only when it looks
    assert kept.at(-1.0) == frozenset()
    assert rules.asked == pytest.approx(200 * STEP / LAMP_INTERVAL, abs=1)
    assert len(lighting.changes()) == 10  # they change every 20 steps, and no line is written where nothing has changed


def test_game_without_lamps_tells_none() -> None:
    scene = toy_scene()
    lighting = LampRecorder(Toy(scene, scene.bodies))
    lighting.update(0.0)
    assert lighting.changes() == []


@pytest.mark.parametrize("told", [[1.0], [[1.0]], [["x", []]], 5, [[1.0, 2.0]]])
def test_what_is_no_lamps_is_refused(told: list[object]) -> None:
    with pytest.raises(ValueError, match="invalid lamp record"):
        LampLog.from_changes(told)
