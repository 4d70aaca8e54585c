"""A match of curling that a test plays stone by stone."""

from sandbox.engines.contract import Simulation
from sandbox.engines.registry import start
from sandbox.games.curling.rules import Curling
from sandbox.games.session import GameSession
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find

DT = 0.05
"""s; the motion is exact at any step, and collisions are resolved at their exact times"""


def sheet(*overrides: str) -> Scene:
    """Return the shipped scene with a coarse step and two human players, with overrides."""
    return load(find("games/curling"), [f"solver.dt={DT}", "play.curling.people=2", *overrides])


class Rink:
    """A running match."""

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
            played = self.referee.record_input(simulation.time, control, value)
            self.referee.note_actions(played)
            actions += played
        for action in actions:
            simulation.apply(action)
        simulation.step()

    def position_of(self, name: str) -> Point:
        x, y = self.simulation.frame().position[self.names.index(name)].tolist()
        return x, y

    def until(self, cue: str, most: float = 90.0) -> None:
        """Step until the rules emit a sound cue, for at most `most` seconds."""
        self.cues.clear()
        end = self.simulation.time + most
        while cue not in self.cues:
            assert self.simulation.time < end, f"no {cue!r} within {most:g} s"
            self.step()

    def hold(self, control: str, time: float) -> None:
        """Hold a control for a time, s, rounded to a step."""
        self.step((control, 1.0))
        for _ in range(round(time / DT) - 1):
            self.step()
        self.step((control, 0.0))

    def throw(self, *, aside: float = 0.0, weight: float = 0.0, turn: int = 1) -> None:
        """Deliver a stone with the broom `aside` m to the left and `weight` m beyond the tee; wait for the next."""
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
