"""Lamp log of a run: it records which lamps the rules lit, at the resolution of a film."""

import json

import pytest

from sandbox.games.session import LAMP_INTERVAL, LampLog, LampRecorder
from tests.toy_game import Toy, toy_scene

STEP = 0.01


class LampToy(Toy):
    """The toy game with lamps that a test sets."""

    lit: frozenset[str] = frozenset()
    polls = 0

    def lit_lamps(self) -> frozenset[str]:
        self.polls += 1
        return self.lit


def test_log_has_the_lamps_lit_at_each_poll() -> None:
    scene = toy_scene()
    rules = LampToy(scene, scene.bodies)
    recorder, expected = LampRecorder(rules), {}
    for k in range(200):
        rules.lit = frozenset({"a", "b"} if k % 40 < 20 else {"c"} if k % 80 < 60 else ())
        recorder.update(k * STEP)
        expected[k * STEP] = rules.lit
    log = LampLog.from_changes(json.loads(json.dumps(recorder.changes())))
    assert all(log.at(time) == lamps for time, lamps in expected.items())  # they change only when the recorder polls
    assert log.at(-1.0) == frozenset()
    assert rules.polls == pytest.approx(200 * STEP / LAMP_INTERVAL, abs=1)
    assert len(recorder.changes()) == 10  # they change every 20 steps, and no entry is written without a change


def test_game_without_lamps_records_no_changes() -> None:
    scene = toy_scene()
    recorder = LampRecorder(Toy(scene, scene.bodies))
    recorder.update(0.0)
    assert recorder.changes() == []


@pytest.mark.parametrize("record", [[1.0], [[1.0]], [["x", []]], 5, [[1.0, 2.0]]])
def test_malformed_lamp_record_is_refused(record: list[object]) -> None:
    with pytest.raises(ValueError, match="invalid lamp record"):
        LampLog.from_changes(record)
