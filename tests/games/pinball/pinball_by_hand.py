"""A table without an engine: hits and places are said by the test, and `Move`s are obeyed."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from sandbox.action import Action, Drive, Move, Toggle
from sandbox.games.contract import StepInfo
from sandbox.games.pinball.rules import PinballRules
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts, Frame

DT = 0.01
MASS = 0.08
SERVE, OPEN = (0.48, 0.1), (0.2, 0.6)
"""where balls wait for the plunger, and somewhere on the table"""

THINGS = {
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
"""Every part but the drops is a post; whether a real table has a zone or a drive there is all one to the rules."""

HEAD = """
[world]
gravity = [0.0, -0.8]
duration = 60.0
seed = 5
[solver]
dt = 0.01
[[wall]]
name = "frame"
points = [[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 1.0]]
closed = true
"""


def table(*leave_out: str, balls: int = 3, players: int = 1, restitution: float = 0.5) -> Scene:
    """Return a table with everything, but for some things."""
    text = HEAD + f'[play]\ngame = "pinball"\nplayers = {players}\n'
    for k, (name, part) in enumerate(THINGS.items()):
        if name in leave_out:
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
    """A game in progress, and the world that a test says there is."""

    scene: Scene
    game: PinballRules = field(init=False)
    step: int = 0
    actions: list[Action] = field(default_factory=list)
    """all that the rules did so far"""
    cues: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.game = PinballRules(self.scene, self.scene.bodies)
        self.position = self.scene.bodies.position.copy()
        self.velocity = np.zeros_like(self.position)
        self.present = np.ones(len(self.position), np.bool_)
        self.look()

    @property
    def time(self) -> float:
        return self.step * DT

    def look(self, *hits: tuple[str, float] | tuple[str, float, int]) -> list[Action]:
        """Pass a step in which balls hit things at a speed, m/s; return what the rules do."""
        time = self.time
        now = self.game.on_step(StepInfo(time, self.frame(), self._contacts(hits), ()))
        self._obey(now)
        self.cues += self.game.sounds()
        self.step += 1
        return list(now)

    def wait(self, seconds: float) -> list[Action]:
        """Pass time in which nothing is hit."""
        return [action for _ in range(round(seconds / DT)) for action in self.look()]

    def press(self, name: str, value: float = 1.0) -> list[Action]:
        """Set a control."""
        now = self.game.on_input(name, value)
        self._obey(now)
        self.cues += self.game.sounds()
        return list(now)

    def play(self, ball: int = 0) -> None:
        """Let the served ball leave the lane, and the save run out."""
        self.wait(0.05)
        self.put(ball, OPEN)
        self.wait(8.1)

    def put(self, ball: int, where: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.5)) -> None:
        """Have a ball somewhere, moving."""
        self.position[ball], self.velocity[ball] = where, velocity

    def frame(self) -> Frame:
        """Return the state."""
        zero = np.zeros(len(self.position))
        return Frame(
            self.time, self.position.copy(), self.velocity.copy(), zero.copy(), zero.copy(), self.present.copy()
        )  # fmt: skip

    def lines(self) -> dict[str, str]:
        """Return the score panel."""
        return dict(self.game.display_lines())

    def _obey(self, actions: Iterable[Action]) -> None:
        for action in actions:
            self.actions.append(action)
            if isinstance(action, Move):
                ball = self.scene.bodies.names.index(action.body)
                self.put(ball, action.position, action.velocity or (0.0, 0.0))

    def _contacts(self, hits: Iterable[tuple[str, float] | tuple[str, float, int]]) -> Contacts:
        """Return a contact for each hit, with the impulse m(1 + e)v that such a speed gives, e being .5."""
        rows = []
        for name, speed, *who in hits:
            thing = -1 - self.scene.fixed_names.index(name)
            rows.append((self.time, (who[0] if who else 0, thing), MASS * 1.5 * speed))
        return contacts(rows)


def contacts(rows: Iterable[tuple[float, tuple[int, int], float]]) -> Contacts:
    """Return contacts by time, pair and normal impulse, N·s; normals point up."""
    those = list(rows)
    return Contacts(
        np.asarray([time for time, _, _ in those]),
        np.asarray([pair for _, pair, _ in those], np.int64).reshape(-1, 2),
        np.zeros((len(those), 2)),
        np.tile([0.0, 1.0], (len(those), 1)),
        np.asarray([[0.0, impulse] for _, _, impulse in those]).reshape(-1, 2),
    )


def thrown(action: Action, velocity: tuple[float, float]) -> bool:
    """Tell whether a ball gets a velocity, as nearly as coils throw."""
    if not isinstance(action, Move) or action.velocity is None:
        return False
    share = np.dot(action.velocity, velocity) / np.dot(velocity, velocity)
    return bool(0.95 <= share <= 1.0 and np.allclose(action.velocity, np.multiply(share, velocity), atol=1e-12))


def toggles(actions: Iterable[Action]) -> list[tuple[str, bool]]:
    """Return what was made solid, or not."""
    return [(action.thing, action.solid) for action in actions if isinstance(action, Toggle)]


def drives(actions: Iterable[Action]) -> list[tuple[str, float]]:
    """Return what was driven, and how far."""
    return [(action.drive, action.level) for action in actions if isinstance(action, Drive)]


def moves(actions: Iterable[Action]) -> list[tuple[str, tuple[float, float]]]:
    """Return which bodies were put where."""
    return [(action.body, action.position) for action in actions if isinstance(action, Move)]
