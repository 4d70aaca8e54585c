"""A viewer of a live scene, as a front end talks to it."""

import json
from typing import Any

from sandbox.interactive.live_scene import LiveScene
from sandbox.interactive.viewer import Viewer
from sandbox.scene.files.load import loads

SCENE = """
[world]
gravity = [0.0, -9.81]
duration = 2.0

[play]
speed = 1.0

[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]

[[ball]]
name = "a"
position = [0.0, 2.0]
radius = 0.5
restitution = 0.5

[[box]]
name = "b"
position = [3.0, 0.5]
size = [1.0, 1.0]
"""


class Conversation:
    """A viewer of a scene, with its last reply."""

    def __init__(self, scene: str = SCENE, **options: Any) -> None:
        self.live = LiveScene(loads(scene), **options)
        self.viewer = Viewer(self.live)
        self.reply = self.ask(type="open")

    def ask(self, **given: Any) -> dict[str, Any]:
        """Send one input and return the reply, after a round trip through JSON."""
        return self.ask_all(given)

    def ask_all(self, *inputs: dict[str, Any]) -> dict[str, Any]:
        """Send inputs in one request."""
        self.reply = json.loads(json.dumps(self.viewer.handle(json.dumps(inputs)), allow_nan=False))
        return self.reply

    def play(self, seconds: float, frame: float = 1 / 60) -> None:
        """Play for a time at a frame rate."""
        self.ask(type="play", on=True)
        for _ in range(round(seconds / frame)):
            self.ask(type="advance", elapsed=frame)

    @property
    def state_hash(self) -> str:
        """Hash of the state of the scene."""
        return self.live.simulation.state_hash()
