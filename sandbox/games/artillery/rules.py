"""Artillery's rules: turns of aiming, flying and settling, until one tank is left."""

import math
from collections.abc import Sequence

import numpy as np

from sandbox.action import Action, Move, Remove, Reshape, SetParameter, Spawn
from sandbox.games.artillery.aim import Aim
from sandbox.games.artillery.bot import aimed, chances, choose
from sandbox.games.artillery.flight import landing
from sandbox.games.artillery.ground import Crater, Ground, Loose
from sandbox.games.artillery.gunner import CONTROLS, Gunner
from sandbox.games.artillery.shells import MASS, RADIUS, Shell, Step, returned
from sandbox.games.artillery.shot import Shot
from sandbox.games.artillery.tanks import PER_METRE, SAFE_FALL, Tank, Tanks
from sandbox.games.artillery.weapons import FRAGMENTS, SPREAD, WEAPONS, Weapon
from sandbox.games.rules import Control, Seen
from sandbox.scene.artillery.columns import columns_of
from sandbox.scene.artillery.expanding import GROUND
from sandbox.scene.bodies import Bodies
from sandbox.scene.discs import Ball
from sandbox.scene.model import Scene
from sandbox.scene.part import Point
from sandbox.trajectory import FloatArray

STILL = 0.1
"""m/s: slower, tanks count as at rest"""
PATIENCE = 8.0
"""s that tanks are given to come to rest, and what rolls to stop"""
PAUSE = 0.5
"""s between turns, at least"""
LIFT = 0.01
"""m above the ground: who was under it is put there"""
ROLLER = 0.5
"""m, the radius of what rolls"""
HARDLY = 0.5
"""m/s: what rolls more slowly for as many seconds goes off"""


class ArtilleryRules:
    """A game of artillery that is being played."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Begin.

        Args:
            scene: has `[artillery]`, and the wall that is its ground.
            bodies: the scene's.
        """
        assert scene.artillery is not None
        wall = next(wall for wall in scene.walls if wall.name == GROUND)
        columns = columns_of(wall.points)
        assert columns is not None
        self.artillery, self.world = scene.artillery, scene.world
        self.ground = Ground(np.asarray(columns[0]), columns[1])
        self.tanks = Tanks(scene.artillery, bodies.names)
        self.gunner = Gunner()
        self.shells: list[Shell] = []
        self.falling: list[tuple[float, tuple[Loose, ...]]] = []
        """(s, dirt): since when it falls; for who draws it"""
        self.shots: list[Shot] = []
        self.turn = 0
        """counted from 1, of all players together"""
        self.phase = "begin"
        """`begin`, `aim`, `fly` or `settle`"""
        self._time, self._since, self._number, self._fired = 0.0, 0.0, 0, 0
        self._aim: Aim | None = None
        self._stood: dict[str, float] = {}  # how high each tank stood when it began to fall, m
        self._cues: list[str] = []
        self._over: str | None = None

    @property
    def controls(self) -> tuple[Control, ...]:
        """What a gunner can do."""
        return CONTROLS

    @property
    def score(self) -> int:
        """Of the first who is a person; where none is, of the best."""
        persons = [tank.points for tank in self.tanks.every if tank.player.bot is None]
        return persons[0] if persons else max(tank.points for tank in self.tanks.every)

    @property
    def over(self) -> str | None:
        """Who has won."""
        return self._over

    @property
    def shooter(self) -> Tank:
        """Whose turn it is."""
        return self.tanks.every[self._number]

    def speed(self, tank: Tank) -> float:
        """Return how fast a shell leaves a tank as it is set, m/s."""
        return tank.power * self.artillery.speed

    def control(self, name: str, value: float) -> Sequence[Action]:
        """Turn the barrel, change the power or the weapon, or fire."""
        fires = self.gunner.press(name, value)
        if self.phase != "aim" or self.shooter.player.bot is not None or value <= 0.0:
            return ()
        if name == "weapon":
            self._cues.append("click")
        self.gunner.touch(name, self.shooter)
        return self._fire() if fires else ()

    def look(self, seen: Seen) -> Sequence[Action]:
        """Go on with the turn: aim as long as keys are held, follow what flies, wait until all is still."""
        passed, self._time = seen.time - self._time, seen.time
        self._know(seen)
        self.tanks.see(seen.frame)
        match self.phase:
            case "begin":
                return self._begin_turn()
            case "aim":
                if self.shooter.player.bot is None:
                    self.gunner.hold(self.shooter, passed)
                    return ()
                return self._bot(passed)
            case "fly":
                return self._follow(seen, passed)
            case _:
                return self._settle(seen)

    def lines(self) -> Sequence[tuple[str, str]]:
        """Return who has what, how the gun is set, and what the last shot came to."""
        told = []
        for tank in self.tanks.every:
            mark = "> " if tank is self.shooter and self._over is None else ""
            state = f"{tank.health:.0f} %, {tank.points} points, {tank.money} $"
            told.append((f"{mark}{tank.name}", state if tank.alive else f"out, {tank.points} points"))
        wind = self.world.wind[0]
        side = "to the right" if wind > 0 else "to the left"
        told.append(("wind", f"{abs(wind):.1f} m/s {side}" if wind else "none"))
        tank, weapon = self.shooter, WEAPONS[self.shooter.weapon]
        told.append(("gun", f"{math.degrees(tank.angle):.1f}°, {tank.power:.1%}, {self.speed(tank):.1f} m/s"))
        told.append(("weapon", f"{weapon.name}, {weapon.cost} $" if weapon.cost else weapon.name))
        if self.shots:
            told.append(("last shot", self.shots[-1].told))
        return told

    def cues(self) -> Sequence[str]:
        """Return the sounds since the last call."""
        cues, self._cues = self._cues, []
        return cues

    def _know(self, seen: Seen) -> None:
        """Find the numbers of the shells that have been spawned since: the last bodies, in the order of the actions."""
        new = [shell for shell in self.shells if shell.number is None]
        if not new:
            return
        names = [shell.name for shell in new]
        others = [
            action.single.name
            for action in seen.actions
            if isinstance(action, Spawn) and action.single.name not in names
        ]
        first = len(seen.frame.position) - len(new) - len(others)
        for k, shell in enumerate(new):  # what the rules spawn stands before what a hand does
            shell.number = first + k

    def _begin_turn(self) -> list[Action]:
        """Let the next who is alive have the gun, in a wind of the turn's own; or end the game."""
        alive = self.tanks.alive
        if len(alive) < 2:
            self._end(f"{alive[0].name} wins" if alive else "nobody is left")
            return []
        if self.turn >= self.artillery.rounds * len(self.tanks.every):
            best = max(self.tanks.every, key=lambda tank: (tank.points, tank.health))
            self._end(f"out of shells; {best.name} wins on points")
            return []
        count = len(self.tanks.every)
        first = self._number + 1 if self.turn else 0
        self._number = next(k % count for k in range(first, first + count) if self.tanks.every[k % count].alive)
        self.turn += 1
        self.phase, self._since, self._aim = "aim", self._time, None
        if WEAPONS[self.shooter.weapon].cost > self.shooter.money:
            self.shooter.weapon = 0
        self._cues.append("turn")
        most = self.artillery.wind
        if not most:
            return []
        wind = (float(chances(self.world.seed, 2 * self.turn).uniform(-most, most)), 0.0)
        self.world = self.world.model_copy(update={"wind": wind})
        return [SetParameter(time=self._time, path="world.wind", value=list(wind))]

    def _end(self, why: str) -> None:
        self._over = why
        self._cues.append("over")

    def _bot(self, passed: float) -> list[Action]:
        """Find the shot, bring the gun there, and fire."""
        tank = self.shooter
        if self._aim is None:
            random = chances(self.world.seed, 2 * self.turn + 1)
            target, tank.weapon = choose(self.tanks, tank, random)
            radius = WEAPONS[tank.weapon].radius
            self._aim = aimed(self.world, self.ground, self.artillery, self.tanks, tank, target, radius, random)
        there = self.gunner.bring(tank, self._aim.angle, self._aim.speed / self.artillery.speed, passed)
        return self._fire() if there and self._time - self._since >= PAUSE else []

    def _fire(self) -> list[Action]:
        tank = self.shooter
        weapon = WEAPONS[tank.weapon]
        tank.money -= weapon.cost
        place = self.tanks.muzzle(tank, np.array([tank.angle]))[0]
        velocity = self.speed(tank) * np.array([math.cos(tank.angle), math.sin(tank.angle)])
        self.phase = "fly"
        self._cues.append("fire")
        action = self._shell(tank, weapon, place, velocity)
        shell = self.shells[-1]
        shell.exact = landing(self.world, place, velocity, self.ground, self.artillery.edges, self.tanks.discs)
        return [action]

    def _shell(self, tank: Tank, weapon: Weapon, place: FloatArray, velocity: FloatArray, rolls: bool = False) -> Spawn:
        self._fired += 1
        shell = Shell(f"shell {self._fired}", tank, weapon, place, velocity, self._time, fired=self._time)
        self.shells.append(shell)
        x, y = place.tolist()
        vx, vy = velocity.tolist()
        ball = Ball(
            name=shell.name, position=(x, y), velocity=(vx, vy), radius=ROLLER if rolls else RADIUS, mass=MASS,
            collides="fixed" if rolls else "none", friction=0.3, restitution=0.2, colour="#f2e6c8",
        )  # fmt: skip
        shell.rolling = self._time if rolls else None
        return Spawn(time=self._time, ball=ball)

    def _follow(self, seen: Seen, passed: float) -> list[Action]:
        """Look where all shells have gone; once none is left, let the ground and tanks settle."""
        actions: list[Action] = []
        for shell in [*self.shells]:
            actions += self._gone_on(shell, seen, passed)
        if not self.shells:
            self.phase, self._since = "settle", self._time
            self._stood = {tank.name: tank.place[1] for tank in self.tanks.alive}
        return actions

    def _gone_on(self, shell: Shell, seen: Seen, passed: float) -> list[Action]:
        """Let a shell go on from the last frame to this."""
        number = shell.number
        if number is None or not seen.frame.present[number]:  # who leaves the world's bounds is retired
            return [] if number is None else self._left(shell, [])
        place, velocity = seen.frame.position[number].copy(), seen.frame.velocity[number].copy()
        before = shell.place, shell.velocity
        shell.place, shell.velocity = place, velocity
        if shell.rolling is not None:
            return self._roll(shell)
        step = Step(before, (place, velocity), passed)
        beyond = returned(place, velocity, self.ground, self.artillery.edges)
        until = 1.0
        if beyond is not None:
            wall = self.ground.width if place[0] > 0.0 else 0.0
            until = min(max(float((wall - before[0][0]) / (place[0] - before[0][0])), 0.0), 1.0)
        found = step.meets(self.ground, self.tanks.discs, until)
        if found is not None:
            return self._come_down(shell, step, found[0], found[1] is not None, passed)
        if shell.weapon.kind == "cluster" and shell.whole and before[1][1] > 0.0 >= velocity[1]:
            return self._split(shell)
        if beyond is not None:
            shell.place, shell.velocity = beyond
            return [self._move(shell.name, beyond[0], beyond[1])]
        if place[1] < -1.0 and not 0.0 <= place[0] <= self.ground.width:
            return self._left(shell, [Remove(time=self._time, body=shell.name)])
        return []

    @staticmethod
    def _move(name: str, place: FloatArray, velocity: FloatArray) -> Move:
        (x, y), (vx, vy) = place.tolist(), velocity.tolist()
        return Move(time=0.0, body=name, position=(x, y), velocity=(vx, vy))

    def _left(self, shell: Shell, actions: list[Action]) -> list[Action]:
        self.shells.remove(shell)
        self._told(shell, None, self._time)
        return actions

    def _told(self, shell: Shell, place: Point | None, time: float) -> None:
        """Note what a shot came to, if it is one that was fired and came down by itself."""
        if shell.whole and shell.rolling is None:
            exact = None if shell.exact is None else shell.exact.place
            self.shots.append(Shot(shell.shooter.name, shell.weapon.name, place, exact, time - shell.fired))

    def _come_down(self, shell: Shell, step: Step, share: float, on_tank: bool, passed: float) -> list[Action]:
        x, y = step.at(share).tolist()
        self._told(shell, (x, y), self._time - (1.0 - share) * passed)
        if shell.weapon.kind == "roller" and not on_tank:
            slope = float(self.ground.surface(x + 0.5) - self.ground.surface(x - 0.5))
            along = np.array([1.0, slope if math.isfinite(slope) else 0.0])
            along /= np.hypot(*along)
            up = np.array([-along[1], along[0]])
            place = np.array([x, y]) + (ROLLER + LIFT) * up
            velocity = float(step.velocity(share) @ along) * along
            self.shells.remove(shell)
            return [Remove(time=0.0, body=shell.name), self._shell(shell.shooter, shell.weapon, place, velocity, True)]
        return self._go_off(shell, (x, y))

    def _roll(self, shell: Shell) -> list[Action]:
        """Let what rolls go off where it meets a tank, comes to rest, or has rolled for too long."""
        assert shell.rolling is not None
        discs = self.tanks.discs
        near = np.hypot(*(discs[:, :2] - shell.place).T) <= discs[:, 2] + ROLLER
        if float(np.hypot(*shell.velocity)) > HARDLY:
            shell.slow = None
        elif shell.slow is None:
            shell.slow = self._time
        still = shell.slow is not None and self._time - shell.slow >= HARDLY
        if near.any() or still or self._time - shell.rolling > PATIENCE:
            x, y = shell.place.tolist()
            return self._go_off(shell, (x, y - ROLLER))
        if not -1.0 <= shell.place[0] <= self.ground.width + 1.0:
            return self._left(shell, [Remove(time=0.0, body=shell.name)])
        return []

    def _split(self, shell: Shell) -> list[Action]:
        """Let a cluster come apart: momentum stays, the fragments fly on beside each other."""
        self.shells.remove(shell)
        actions: list[Action] = [Remove(time=0.0, body=shell.name)]
        for k in range(FRAGMENTS):
            aside = np.array([SPREAD * (k - 0.5 * (FRAGMENTS - 1)), 0.0])
            actions.append(self._shell(shell.shooter, shell.weapon, shell.place, shell.velocity + aside))
            self.shells[-1].whole = False
        self._cues.append("split")
        return actions

    def _go_off(self, shell: Shell, place: Point) -> list[Action]:
        """Let a shell do its work: take ground away or bring some, and hurt who is near."""
        self.shells.remove(shell)
        actions: list[Action] = [Remove(time=0.0, body=shell.name)]
        return actions + self._blast(shell.shooter, place, shell.weapon)

    def _blast(self, shooter: Tank, place: Point, weapon: Weapon) -> list[Action]:
        dirt = weapon.kind == "dirt"
        change = (self.ground.with_heap if dirt else self.ground.without)(place, weapon.radius)
        self._cues.append("dirt" if dirt else "blast")
        actions = self._changed(change)
        dead = [tank for tank, _ in self.tanks.blast(shooter, place, weapon) if not tank.alive]
        return actions + self._out(dead)

    def _out(self, dead: Sequence[Tank]) -> list[Action]:
        """Take tanks out that have no health left; each goes off itself, and may take others with it."""
        actions: list[Action] = []
        for tank in dead:
            actions.append(Remove(time=0.0, body=tank.name))
            actions += self._blast(tank, tank.place, WRECK)
        return actions

    def _changed(self, change: Crater) -> list[Action]:
        """Go on with another ground, and lift who would be under it."""
        self.ground = change.ground
        if change.loose:
            self.falling.append((self._time, change.loose))
        actions: list[Action] = [Reshape(time=0.0, thing=GROUND, points=self.ground.points)]
        for tank in self.tanks.alive:
            actions += self._lifted(tank)
        return actions

    def _lifted(self, tank: Tank) -> list[Action]:
        """Put a tank on the ground that it is in."""
        x, y = tank.place
        if not 0.0 <= x <= self.ground.width or y >= self.ground.surface(x):
            return []
        width, height = self.tanks.size
        tank.place = (x, self.ground.under(x, 0.5 * width) + 0.5 * height + LIFT)
        return [Move(time=0.0, body=tank.name, position=tank.place, velocity=(0.0, 0.0))]

    def _settle(self, seen: Seen) -> list[Action]:
        """Wait until dirt has fallen and tanks stand; hurt who fell, end who left the ground, begin the next turn."""
        actions = [action for tank in self.tanks.alive for action in self._lifted(tank)]
        waited = self._time - self._since
        pull = math.hypot(*self.world.gravity)
        drops = [(since, each.drop) for since, loose in self.falling for each in loose]
        fallen = not pull or all(0.5 * pull * (self._time - since) ** 2 >= drop for since, drop in drops)
        if waited < PAUSE or (waited < PATIENCE and not (fallen and self.tanks.at_rest(seen.frame, STILL))):
            return actions
        self.falling.clear()
        dead = []
        for tank in self.tanks.alive:
            fall = self._stood.get(tank.name, tank.place[1]) - tank.place[1]
            self._stood[tank.name] = tank.place[1]
            beside = not 0.0 <= tank.place[0] <= self.ground.width
            if beside or fall > SAFE_FALL:
                self.tanks.hurt(tank, math.inf if beside else PER_METRE * (fall - SAFE_FALL), self.shooter)
                dead += [] if tank.alive else [tank]
        actions += self._out(dead)
        self._since = self._time
        if not dead:
            self.phase = "begin"
        return actions


WRECK = Weapon("wreck", "shell", 4.0, 30.0, 0)
"""What becomes of a tank that has no health left."""
