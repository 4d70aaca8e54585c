"""Matches of curling played by hand, a stone at a time."""

from sandbox.engines.contract import Simulation
from sandbox.engines.registry import start
from sandbox.games.curling.rules import Curling
from sandbox.games.session import GameSession
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find

DT = 0.05
"""s: motion is exact whatever it is, and hits are taken back to when they were"""


def sheet(*changes: str) -> Scene:
    """Return the shipped scene with a coarse step, for two people, changed."""
    return load(find("games/curling"), [f"solver.dt={DT}", "play.curling.people=2", *changes])


class Rink:
    """A match under way."""

    def __init__(self, scene: Scene) -> None:
        self.rules = Curling(scene, scene.bodies)
        self.referee = GameSession(self.rules)
        self.simulation: Simulation = start(scene, "pymunk")
        self.names = scene.bodies.names
        self.cues: list[str] = []

    def step(self, *presses: tuple[str, float]) -> None:
        simulation = self.simulation
        actions = [*self.referee.on_step(simulation.time, simulation.frame(), simulation.contacts())]
        self.cues += self.rules.sounds()
        for control, value in presses:
            played = self.referee.press(simulation.time, control, value)
            self.referee.note_actions(played)
            actions += played
        for action in actions:
            simulation.apply(action)
        simulation.step()

    def place(self, name: str) -> Point:
        x, y = self.simulation.frame().position[self.names.index(name)].tolist()
        return x, y

    def until(self, cue: str, most: float = 90.0) -> None:
        """Go on until a sound is heard."""
        self.cues.clear()
        end = self.simulation.time + most
        while cue not in self.cues:
            assert self.simulation.time < end, f"no {cue!r} within {most:g} s"
            self.step()

    def hold(self, control: str, time: float) -> None:
        """Hold a control for a time, s, to a step."""
        self.step((control, 1.0))
        for _ in range(round(time / DT) - 1):
            self.step()
        self.step((control, 0.0))

    def throw(self, *, aside: float = 0.0, weight: float = 0.0, turn: int = 1) -> None:
        """Deliver a stone with the broom so far to the left, m, and for so far beyond the tee; wait for the next."""
        if turn < 0:
            self.step(("turn", 1.0), ("turn", 0.0))
        if aside:
            self.hold("left" if aside > 0 else "right", abs(aside) / 0.5)
        if weight:
            self.hold("harder" if weight > 0 else "softer", abs(weight) / 2.5)
        self.step(("throw", 1.0), ("throw", 0.0))
        self.until("next")
        if turn < 0:
            self.step(("turn", 1.0), ("turn", 0.0))
