"""A pinball table without an engine: the test states hits and positions, and `Move` actions are applied."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from sandbox.action import Action, Drive, Move, Toggle
from sandbox.games.contract import StepInfo
from sandbox.games.pinball.rules import PinballRules
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts, Frame
from tests.toml_text import toml

DT = 0.01
MASS = 0.08
SERVE, OPEN = (0.48, 0.1), (0.2, 0.6)
"""m: position of a ball that waits for the plunger, and a position in play"""

PARTS = {
    "bumper a": 'role = "bumper"',
    "sling": 'role = "slingshot"',
    "standup 1": 'role = "standup"\ngroup = "bull"',
    "standup 2": 'role = "standup"\ngroup = "bull"\nstep = 1',
    "drop 1": 'role = "drop"\ngroup = "bank"',
    "drop 2": 'role = "drop"\ngroup = "bank"\nstep = 1',
    "lane 1": 'role = "rollover"\ngroup = "top"',
    "lane 2": 'role = "rollover"\ngroup = "top"\nstep = 1',
    "lane 3": 'role = "rollover"\ngroup = "top"\nstep = 2',
    "outlane": 'role = "rollover"\nscore = 7_000',
    "spinner": 'role = "spinner"',
    "hole": 'role = "kicker"\nout = [0.3, -0.6]',
    "lock": 'role = "kicker"\ngroup = "lock"',
    "ramp in": 'role = "ramp"\ngroup = "left"',
    "ramp out": 'role = "ramp"\ngroup = "left"\nstep = 1',
    "drain": 'role = "drain"',
    "left bat": 'role = "flipper"\ngroup = "left"',
    "right bat": 'role = "flipper"\ngroup = "right"',
    "plunger": f'role = "plunger"\nat = [{SERVE[0]}, {SERVE[1]}]\nout = [0.0, 3.0]',
}
"""Every part except the drop targets is a post: the rules do not depend on the kind of element."""

HEAD = (
    toml("world", gravity=[0.0, -0.8], duration=60.0, seed=5)
    + toml("solver", dt=0.01)
    + toml("wall", name="frame", points=[[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 1.0]], closed=True)
)


def table(*omitted: str, balls: int = 3, players: int = 1, restitution: float = 0.5) -> Scene:
    """Return a table with every part, except some."""
    text = HEAD + f'[play]\ngame = "pinball"\nplayers = {players}\n'
    for k, (name, part) in enumerate(PARTS.items()):
        if name in omitted:
            continue
        text += f'[[play.part]]\nname = "{name}"\n{part}\n'
        if name.startswith("drop"):
            x = 0.2 * int(name[-1])
            text += f'[[wall]]\nname = "{name}"\npoints = [[{x}, 0.5], [{x + 0.1}, 0.5]]\nthickness = 0.005\n'
        else:
            text += f'[[post]]\nname = "{name}"\nposition = [{0.02 * k + 0.02}, 0.9]\nradius = 0.005\n'
        text += f"restitution = {restitution}\n"
    for k in range(balls):
        x, y = SERVE if k == 0 else (0.1 * k, -0.02)
        text += f'[[play.part]]\nname = "ball {k}"\nrole = "ball"\n'
        text += f'[[ball]]\nname = "ball {k}"\nposition = [{x}, {y}]\nradius = 0.0135\nmass = {MASS}\n'
    return loads(text)


@dataclass
class Table:
    """A running game, with a state that the test sets."""

    scene: Scene
    game: PinballRules = field(init=False)
    step: int = 0
    actions: list[Action] = field(default_factory=list)
    """all actions of the rules so far"""
    cues: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.game = PinballRules(self.scene, self.scene.bodies)
        self.position = self.scene.bodies.position.copy()
        self.velocity = np.zeros_like(self.position)
        self.present = np.ones(len(self.position), np.bool_)
        self.advance()

    @property
    def time(self) -> float:
        return self.step * DT

    def advance(self, *hits: tuple[str, float] | tuple[str, float, int]) -> list[Action]:
        """Advance by a step in which balls hit parts at a speed, m/s; return the actions of the rules."""
        time = self.time
        actions = self.game.on_step(StepInfo(time, self.frame(), self._contacts(hits), ()))
        self._apply(actions)
        self.cues += self.game.sounds()
        self.step += 1
        return list(actions)

    def wait(self, seconds: float) -> list[Action]:
        """Advance by a time, s, without hits; return the actions of the rules."""
        return [action for _ in range(round(seconds / DT)) for action in self.advance()]

    def press(self, name: str, value: float = 1.0) -> list[Action]:
        """Set a control; return the actions of the rules."""
        actions = self.game.on_input(name, value)
        self._apply(actions)
        self.cues += self.game.sounds()
        return list(actions)

    def play(self, ball: int = 0) -> None:
        """Move the served ball out of the lane, and wait until the ball save has ended."""
        self.wait(0.05)
        self.put(ball, OPEN)
        self.wait(8.1)

    def put(self, ball: int, position: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.5)) -> None:
        """Set position and velocity of a ball."""
        self.position[ball], self.velocity[ball] = position, velocity

    def frame(self) -> Frame:
        """Return the state."""
        zero = np.zeros(len(self.position))
        return Frame(
            self.time, self.position.copy(), self.velocity.copy(), zero.copy(), zero.copy(), self.present.copy()
        )  # fmt: skip

    def lines(self) -> dict[str, str]:
        """Return the score panel."""
        return dict(self.game.display_lines())

    def _apply(self, actions: Iterable[Action]) -> None:
        for action in actions:
            self.actions.append(action)
            if isinstance(action, Move):
                ball = self.scene.bodies.names.index(action.body)
                self.put(ball, action.position, action.velocity or (0.0, 0.0))

    def _contacts(self, hits: Iterable[tuple[str, float] | tuple[str, float, int]]) -> Contacts:
        """Return a contact for each hit, with the impulse m(1 + e)v of its speed v, for e = 0.5."""
        rows = []
        for name, speed, *ball in hits:
            part = -1 - self.scene.fixed_names.index(name)
            rows.append((self.time, (ball[0] if ball else 0, part), MASS * 1.5 * speed))
        return contacts(rows)


def contacts(rows: Iterable[tuple[float, tuple[int, int], float]]) -> Contacts:
    """Return contacts by time, pair and normal impulse, N·s; normals point up."""
    listed = list(rows)
    return Contacts(
        np.asarray([time for time, _, _ in listed]),
        np.asarray([pair for _, pair, _ in listed], np.int64).reshape(-1, 2),
        np.zeros((len(listed), 2)),
        np.tile([0.0, 1.0], (len(listed), 1)),
        np.asarray([[0.0, impulse] for _, _, impulse in listed]).reshape(-1, 2),
    )


def is_launch(action: Action, velocity: tuple[float, float]) -> bool:
    """Return whether a `Move` gives a ball a velocity, within the variation of coils."""
    if not isinstance(action, Move) or action.velocity is None:
        return False
    factor = np.dot(action.velocity, velocity) / np.dot(velocity, velocity)
    return bool(0.95 <= factor <= 1.0 and np.allclose(action.velocity, np.multiply(factor, velocity), atol=1e-12))


def toggles(actions: Iterable[Action]) -> list[tuple[str, bool]]:
    """Return name and solidity of each `Toggle`."""
    return [(action.thing, action.solid) for action in actions if isinstance(action, Toggle)]


def drives(actions: Iterable[Action]) -> list[tuple[str, float]]:
    """Return name and level of each `Drive`."""
    return [(action.drive, action.level) for action in actions if isinstance(action, Drive)]


def moves(actions: Iterable[Action]) -> list[tuple[str, tuple[float, float]]]:
    """Return body and position of each `Move`."""
    return [(action.body, action.position) for action in actions if isinstance(action, Move)]
