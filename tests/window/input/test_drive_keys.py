"""Keys of the drives of a scene: a held key sets level 1, and thrust and drive may share a key."""

import pygame
import pytest

from sandbox.action import Drive, Throttle
from sandbox.scene.description.forces import DriveKey, ThrustKey
from sandbox.scene.files.load import from_document
from sandbox.window.input.bindings import KEYS, key_bindings, thrust_and_drive_keys
from sandbox.window.input.body_tools import BodyTools

BOX = {"name": "rod", "position": [0.0, 0.0], "size": [1.0, 1.0]}
PLUNGER = {"kind": "plunger", "body": "rod", "direction": [0.0, 1.0], "travel": 1.0, "speed": 1.0}


class RecordingSession:
    """Fake session that records the applied actions."""

    def __init__(self, scene):
        self.scene, self.actions = scene, []

    def apply(self, action):
        self.actions.append(action)


def test_every_key_of_the_scene_format_is_a_key_of_the_window():
    assert {*DriveKey.__args__} == {*KEYS} >= {*ThrustKey.__args__}


@pytest.mark.parametrize("key", KEYS)
def test_held_key_sets_level_1(key):
    scene = from_document({"box": [BOX], "drive": [{**PLUNGER, "key": key}]})
    live = RecordingSession(scene)
    bindings = key_bindings(live, BodyTools())
    bindings.pressed[KEYS[key]]()
    bindings.released[KEYS[key]]()
    assert live.actions == [Drive(time=0.0, drive="drive-1", level=level) for level in (1.0, 0.0)]
    assert KEYS[key] not in bindings.repeated  # a key that repeats is still held
    assert bindings.help_rows == ((key.capitalize(), "drive drive-1"),)


def test_thrust_and_drive_with_the_same_key_both_act():
    ship = {"name": "ship", "position": [5.0, 0.0], "size": [1.0, 1.0]}
    thrust = {"name": "main", "body": "ship", "force": [1.0, 0.0], "key": "up"}
    scene = from_document({"box": [BOX, ship], "thrust": [thrust], "drive": [{**PLUNGER, "key": "up"}]})
    live = RecordingSession(scene)
    key_bindings(live, BodyTools()).pressed[pygame.K_UP]()
    assert [type(action) for action in live.actions] == [Throttle, Drive]
    assert len([*thrust_and_drive_keys(scene)]) == 2
