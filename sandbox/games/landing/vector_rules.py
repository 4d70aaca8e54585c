"""Rules of many games of landing at once: those of `rules.Landing`, with the fuel of all games as arrays."""

from collections.abc import Sequence

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Members, WorldStates
from sandbox.games.landing.rules import (
    LANDED,
    LOST,
    OUTSIDE_PAD,
    REST_TIME,
    TIPPED_OVER,
    TIPPED_OVER_ANGLE,
    UNLIMITED_STEPS,
    Landing,
    crash_reason,
    is_at_rest,
    tilt,
)
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.scene import default_name


class VectorLanding:
    """Rules and state of M games, as `VectorRules`."""

    def __init__(self, scene: Scene, bodies: Bodies, count: int) -> None:
        """Create the rules of so many games; each has to be started by `restart`.

        Raises:
            UnsuitableSceneError: as `Landing`.
        """
        self._single, self._bodies = Landing(scene, bodies), bodies
        self.controls = self._single.controls
        self.score = np.zeros(count, np.int64)
        self.game_over: list[str | None] = [None] * count
        names = [thrust.name or default_name("thrust", k) for k, thrust in enumerate(scene.thrusts)]
        self._initial_level = np.asarray([0.0 if thrust.key else 1.0 for thrust in scene.thrusts])
        self.thrust_level = np.tile(self._initial_level, (count, 1))
        self._columns = np.asarray([names.index(control.name) for control in self.controls])
        self._forces = list(self._single.forces.values())
        self._pad = len(bodies) - 1 - self._single.pad_index  # column of `WorldStates.touched`
        self._tank = np.full(count, self._single.full_tank)
        self._value, self._level = np.zeros((count, len(self._columns))), np.zeros((count, len(self._columns)))
        self._burn_rate, self._changed, self._tank_then, self._time, self._rest_time = np.zeros((5, count))
        self._touched = np.zeros(count, np.bool_)

    def restart(self, games: IntArray, seeds: Sequence[int]) -> Members:
        """Start games, by their (K,) indices, with K seeds; return the K start states of their bodies."""
        bodies, ship = self._bodies, self._single.ship
        for array in (
            self.score,
            self._value,
            self._level,
            self._burn_rate,
            self._changed,
            self._time,
            self._rest_time,
            self._touched,
        ):
            array[games] = 0
        self.thrust_level[games] = self._initial_level
        self._tank[games] = self._tank_then[games] = self._single.full_tank
        start = Members(
            *(
                np.repeat(array[None], len(games), axis=0)
                for array in (bodies.position, bodies.velocity, bodies.angle, bodies.angular_velocity)
            )
        )
        for row, (game, seed) in enumerate(zip(games.tolist(), seeds, strict=True)):
            self.game_over[game] = None
            moved = self._single.random_start(seed, bodies)
            start.position[row, ship], start.velocity[row, ship] = moved["position"], moved["velocity"]
        return start

    def set_controls(self, games: IntArray, levels: FloatArray) -> None:
        """Set the controls of K games to levels (K, C), from 0 to 1; without effect if their tanks are empty."""
        differs = (levels != self._value[games]).any(axis=1)
        self._value[games] = levels
        changed = games[differs & (self._tank[games] > 0.0)]
        self._set_levels(changed, self._value[changed], self._time[changed])

    def quiet_steps(self, dt: float) -> IntArray:
        """Return the numbers of steps of dt, s, in which the tanks cannot become empty, (M,)."""
        burnt = sum(self._forces) * dt
        if not burnt:
            return np.full(len(self._tank), UNLIMITED_STEPS)
        return np.where(self._tank > 0.0, np.maximum(self._tank // burnt, 1.0), UNLIMITED_STEPS).astype(np.int64)

    def on_step(self, games: IntArray, states: WorldStates) -> None:
        """Update games, by their (K,) indices, after steps; the states are those of all M worlds."""
        ship, time = self._single.ship, states.time[games]
        elapsed, self._time[games] = time - states.previous_time[games], time
        self._burn(games, time)
        touched = states.touched[games, ship]
        on_pad = touched[:, self._pad]
        self._rest_time[games[~on_pad]] = 0.0
        for row in np.flatnonzero(touched.any(axis=1) | ~states.present[games, ship]).tolist():
            game = int(games[row])
            others = touched[row].copy()
            others[self._pad] = False
            if not states.present[game, ship]:
                reason: str | None = LOST
            elif others.any():
                reason = OUTSIDE_PAD
            else:
                reason = self._touch_pad(game, states, float(elapsed[row]))
            if reason is not None:
                self._end(game, states, reason)

    def observation(self) -> FloatArray:
        """Return the fuel as a fraction of a full tank, (M, 1)."""
        return (self._tank / self._single.full_tank)[:, None]

    def _burn(self, games: IntArray, time: FloatArray) -> None:
        """Consume fuel up to the present times, (K,) s; stop the engines of games whose tanks become empty."""
        before = self._tank[games]
        burnt = self._burn_rate[games] * (time - self._changed[games])
        self._tank[games] = after = np.maximum(self._tank_then[games] - burnt, 0.0)
        emptied = (after == 0.0) & (before != 0.0)
        if emptied.any():
            stopped = games[emptied]
            self._set_levels(stopped, np.zeros((len(stopped), len(self._columns))), time[emptied])

    def _set_levels(self, games: IntArray, levels: FloatArray, time: FloatArray) -> None:
        """Set the levels of the thrusts, (K, C), from times, (K,) s, on."""
        self._level[games], self._changed[games], self._tank_then[games] = levels, time, self._tank[games]
        rate = np.zeros(len(games))
        for k, force in enumerate(self._forces):
            rate += levels[:, k] * force
        self._burn_rate[games] = rate
        self.thrust_level[games[:, None], self._columns] = levels

    def _touch_pad(self, game: int, states: WorldStates, elapsed: float) -> str | None:
        """Update a game whose ship touches the pad only; return the reason why it is over, or None."""
        ship, now, previous = self._single.ship, states.now, states.previous
        if not self._touched[game]:
            self._touched[game] = True
            fault = crash_reason(previous.velocity[game, ship], float(previous.angle[game, ship]))
            if fault is not None:
                return fault
        if abs(tilt(float(now.angle[game, ship]))) > TIPPED_OVER_ANGLE:
            return TIPPED_OVER
        is_resting = is_at_rest(now.velocity[game, ship])
        self._rest_time[game] = self._rest_time[game] + elapsed if is_resting else 0.0
        return None if self._rest_time[game] < REST_TIME else LANDED

    def _end(self, game: int, states: WorldStates, reason: str) -> None:
        self.game_over[game] = reason
        if reason == LANDED:
            self.score[game] = self._single.landing_points(float(self._tank[game]))
        else:
            ship, previous = self._single.ship, states.previous
            self.score[game] = self._single.crash_points(previous.position[game, ship], previous.velocity[game, ship])
