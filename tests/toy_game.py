"""A toy game for tests of game hosts: it draws random numbers, acts, spawns bodies, counts presses, and ends."""

import math
import random
from collections.abc import Sequence

from sandbox.action import Action, Impulse, Spawn
from sandbox.games.contract import Control, StepInfo
from sandbox.games.session import GameSession
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import loads

TOY = """
title = "Toy"
[play]
game = "landing"   # whose rules tests put in the place of the real ones
[world]
gravity = [0.0, -9.81]
duration = 2.0
seed = 7
[solver]
dt = 0.01
[[plane]]
name = "floor"
point = [0.0, 0.0]
normal = [0.0, 1.0]
restitution = 0.8
[[ball]]
name = "a"
position = [0.0, 1.0]
radius = 0.2
restitution = 0.9
"""


class Toy:
    """One point per bounce, 0.5 per impulse; each bounce kicks the ball aside at random, every third spawns a ball."""

    controls = (
        Control("kick", "up", ("up",), "a"),
        Control("aim", "how far kicks go", ("left",), "-leftx", analogue=True),
    )

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        assert bodies.names[0] == "a"
        self._random = random.Random(scene.world.seed)  # own state, so that a copy of the game has it too
        self.score = 0.0
        self.game_over: str | None = None
        self._aim, self._bounces, self._last = 0.5, 0, -1.0
        self._cues: list[str] = []
        self.ends_at = math.inf

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        if control == "aim":  # affects only later kicks
            self._aim = value
            return ()
        return (Impulse(time=99.0, body="a", impulse=(0.0, 3.0 * self._aim)),) if value else ()

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        self.score += sum(0.5 for action in info.actions if isinstance(action, Impulse))
        acts: list[Action] = []
        if info.time == 0.0:
            acts.append(Impulse(time=0.0, body="a", impulse=(self._random.uniform(-0.1, 0.1), 0.0)))
        for contact in info.contacts:
            if contact.pair == (0, -1) and contact.time > self._last:
                self._last, self._bounces = contact.time, self._bounces + 1
                self.score += 1
                self._cues.append("bounce")
                acts.append(Impulse(time=0.0, body="a", impulse=(self._random.uniform(-0.1, 0.1), 0.0)))
                if self._bounces % 3 == 0:
                    acts.append(Spawn(time=0.0, ball=Ball(position=(5.0 + self._bounces, 3.0), radius=0.1)))
        if self.score >= self.ends_at:
            self.game_over = "enough"
        return acts

    def display_lines(self) -> Sequence[tuple[str, str]]:
        return (("bounces", str(self._bounces)), ("aim", f"{self._aim:.2f}"))

    def sounds(self) -> Sequence[str]:
        cues, self._cues = self._cues, []
        return cues


def toy_scene(**world: float) -> Scene:
    return loads(TOY, overrides=[(f"world.{key}", value) for key, value in world.items()])


def toy_game(scene: Scene) -> GameSession:
    return GameSession(Toy(scene, scene.bodies))
