"""Games of artillery: turns, weapons, damage and the end, on the engines, recorded and replayed."""

import copy
import json
import math
from typing import Any

import numpy as np
import pytest

from sandbox.action import Action, SetParameter, actions_from_json
from sandbox.engines.switching import start
from sandbox.games.artillery.battlefield import PER_KILL, WEAPONS, Battlefield, Weapon
from sandbox.games.artillery.bot_planner import turn_generator
from sandbox.games.artillery.rules import ArtilleryRules
from sandbox.games.artillery.shells import ArtilleryShot
from sandbox.games.contract import Press, UnsuitableSceneError
from sandbox.games.players import NoInput, ScriptedInput
from sandbox.games.registry import rules_of
from sandbox.games.session import GameSession, HeadlessGame
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts, Trajectory
from tests.games.artillery.dueling import two_tanks

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

WORLD, GAME = "linear_drag = 0.03\nduration = 14.0\nseed = 2", "speed = 60.0\nwind = 6.0"
TEXT, BOTS = two_tanks(WORLD, GAME), two_tanks(WORLD, GAME, red="bot = 1.0", blue="bot = 0.9")
RK4: dict[str, Any] = {"integrator": "rk4"}


def play(
    scene: Scene, presses: tuple[Press, ...] = (), engine: str = "pymunk", **settings: Any
) -> tuple[ArtilleryRules, Trajectory, HeadlessGame]:
    rules = rules_of(scene)
    assert isinstance(rules, ArtilleryRules)
    bout = HeadlessGame(rules, ScriptedInput(presses) if presses else NoInput(), "script")
    trajectory = run(scene, engine, bout=bout, **settings)
    assert trajectory.status == "ok", trajectory.reason
    return rules, trajectory, bout


def taps(*names: str, begin: float = 0.1) -> tuple[Press, ...]:
    """Return presses and releases of controls, one after the other."""
    each = ((begin + 0.02 * k, name) for k, name in enumerate(names))
    return tuple(press for time, name in each for press in (Press(time, name, 1.0), Press(time + 0.01, name, 0.0)))


@pytest.mark.nightly
@pytest.mark.fail_slow(120)  # two minutes of a game
@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_game_of_bots_ends_and_its_recording_replays(engine: str) -> None:
    scene = loads(BOTS, overrides=["world.duration=120"])
    rules, trajectory, bout = play(scene, engine=engine)
    assert rules.game_over is not None
    assert "wins" in rules.game_over
    assert len(rules.field.tanks.alive) == 1
    assert trajectory.missed_contacts == 0
    shots = rules.shots
    assert len(shots) >= 2
    assert {shot.shooter for shot in shots} == {"Red", "Blue"}

    actions = actions_from_json(json.dumps(trajectory.info["actions"]))
    end = trajectory.time[-1], trajectory.info["state_hash"]
    recording = Recording(scene, engine, scene.solver, actions, *end, bout.presses)
    again = rerun(Recording.from_json(recording.to_json()))
    assert again.info["state_hash"] == trajectory.info["state_hash"]
    assert again.info["game"]["score"] == rules.score == trajectory.info["game"]["score"]
    assert again.info["game"]["otherwise"] is None


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (1, 2))])
def test_a_perfect_bot_hits_with_its_first_shot(seed: int) -> None:
    scene = loads(BOTS, overrides=[f"world.seed={seed}", "world.duration=12"])
    rules = play(scene, engine="reference", **RK4)[0]
    first = rules.shots[0]
    x, y = 190.0, float(scene.bodies.position[1, 1])
    assert first.position is not None
    assert math.dist(first.position, (x, y)) <= WEAPONS[0].radius
    assert first.off is not None
    assert first.off < 1e-5  # errors of Runge–Kutta and of the cubic interpolation at 20 ms
    assert rules.field.tanks.every[1].health < 100.0


def test_error_of_a_shot_is_reported_for_each_axis() -> None:
    shot = ArtilleryShot("Red", "shell", (172.07, 3.06), (171.94, 3.131), 6.0)
    assert shot.description == "landed at 172.07 m, exact solution 171.94 m (Δx 130 mm, Δy 71.0 mm)"
    level = ArtilleryShot("Red", "shell", (172.07, 3.0), (171.94, 3.0), 6.0)
    assert level.description == "landed at 172.07 m, exact solution 171.94 m (Δx 130 mm)"


@pytest.mark.parametrize("edges", ["open", "rubber", "wrap"])
def test_shells_at_the_edges_follow_the_exact_path(edges: str) -> None:
    """Shots that cross an edge: the rules resolve the crossing at the next frame, the exact solution at once."""
    scene = loads(TEXT, overrides=[f"artillery.edges={edges}", "artillery.wind=0", "world.duration=24"])
    presses = taps("fire") + taps("fire", begin=11.0)
    rules = rules_of(scene)
    assert isinstance(rules, ArtilleryRules)
    for tank, angle in zip(rules.field.tanks.every, (120.0, 60.0), strict=True):  # both away from each other
        tank.angle, tank.power = math.radians(angle), 0.8
    run(scene, "reference", bout=HeadlessGame(rules, ScriptedInput(presses), "script"), **RK4)
    assert len(rules.shots) == 2
    for shot in rules.shots:
        assert (shot.position is None) == (shot.exact is None) == (edges == "open")
        if shot.off is not None:
            assert shot.off < 1e-5  # at 20 ms: in still air both cross the edges exactly


def test_crater_is_the_same_in_engine_and_rules() -> None:
    scene = loads(TEXT)
    rules, trajectory, _ = play(scene, taps("fire"))
    reshapes = [action for action in trajectory.info["actions"] if action["kind"] == "reshape"]
    assert len(reshapes) == 1
    assert tuple(map(tuple, reshapes[0]["points"])) == rules.field.ground.points
    before = Battlefield(scene, scene.bodies).ground.heights
    assert rules.field.ground.heights.sum() < before.sum()
    assert rules.turn == 2
    assert rules.shooter.name == "Blue"


def test_wind_depends_on_turn_and_seed() -> None:
    winds = []
    for seed in (2, 3):
        rules, trajectory, _ = play(loads(TEXT, overrides=[f"world.seed={seed}"]), taps("fire"))
        winds.append([a["value"][0] for a in trajectory.info["actions"] if a["kind"] == "set"])
        assert rules.world.wind[0] == winds[-1][-1]
        assert all(abs(wind) <= 6.0 for wind in winds[-1])
    assert len(winds[0]) == 2
    assert winds[0] != winds[1]
    assert winds[0] == [float(turn_generator(2, 2 * turn).uniform(-6.0, 6.0)) for turn in (1, 2)]


@pytest.mark.parametrize(("time", "disturbed"), [(0.05, False), (1.0, True)])
def test_changes_of_gravity_and_drag_apply_to_the_exact_flight(time: float, disturbed: bool) -> None:
    """The shot is at 0.1 s: an earlier change applies to the exact flight too; during the flight there is none."""
    scene = loads(TEXT)
    rules, relay = rules_of(scene), start(scene, "reference", scene.solver.replace(**RK4))
    assert isinstance(rules, ArtilleryRules)
    referee, contacts = GameSession(rules), Contacts.none()
    while not rules.shots:
        for action in referee.on_step(relay.time, relay.frame(), contacts):
            relay.apply(action)
        actions: list[Action] = []
        if abs(relay.time - time) < 0.011:
            actions.append(SetParameter(time=relay.time, path="world.gravity", value=[0.5, -6.0]))
            actions.append(SetParameter(time=relay.time, path="world.linear_drag", value=0.08))
        if abs(relay.time - 0.1) < 0.01:
            actions += referee.record_input(relay.time, "fire", 1.0)
        for action in actions:
            relay.apply(action)
        referee.note_actions(actions)
        relay.step()
        contacts = relay.contacts()
    relay.close()
    (shot,) = rules.shots
    assert shot.disturbed == disturbed
    if disturbed:
        assert (shot.exact, shot.off) == (None, None)
        assert shot.description.endswith("; wind or gravity changed during the flight")
    else:
        assert shot.off == pytest.approx(0.0, abs=1e-5)  # error of rk4 at 20 ms, and rounding


def test_dirt_lifts_the_tank_under_it() -> None:
    scene = loads(TEXT, overrides=["artillery.wind=0"])
    rules = rules_of(scene)
    assert isinstance(rules, ArtilleryRules)
    red = rules.field.tanks.every[0]
    red.weapon, red.angle, red.power = 4, math.radians(90.0), 0.3  # straight up: it lands on its own tank
    assert WEAPONS[red.weapon].kind == "dirt"
    trajectory = run(scene, bout=HeadlessGame(rules, ScriptedInput(taps("fire")), "script"))
    assert trajectory.status == "ok"
    lift = float(rules.field.ground.surface(50.0)) - float(Battlefield(scene, scene.bodies).ground.surface(50.0))
    assert lift == pytest.approx(2.0 * WEAPONS[4].radius, rel=0.1)  # a chord near the middle of the disc
    # the tank may tilt
    assert trajectory.position[-1, 0, 1] == pytest.approx(scene.bodies.position[0, 1] + lift, abs=0.3)
    assert red.health == 100.0


def test_weapons_cost_money_and_damage_earns_it() -> None:
    red, blue = play(loads(TEXT), taps("weapon", "fire"))[0].field.tanks.every
    points = red.points - (0 if blue.alive else PER_KILL)
    assert red.money == 1000 - WEAPONS[1].cost + 5 * max(points, 0)


def test_falling_into_a_pit_costs_health_by_its_depth() -> None:
    scene = loads(TEXT, overrides=["artillery.wind=0"])
    x, y = scene.bodies.position[1].tolist()
    pit = Weapon("pit", "shell", 8.0, 0.0, 0)

    class DiggingRules(ArtilleryRules):
        """Fires no shell, but removes the ground under Blue."""

        def _fire(self) -> list[Action]:
            self.phase = "fly"
            return self.field.blast(self._time, self.shooter, (x, y - 0.75), pit)

    rules = DiggingRules(scene, scene.bodies)
    trajectory = run(scene, bout=HeadlessGame(rules, ScriptedInput(taps("fire")), "script"))
    assert trajectory.status == "ok"
    blue = rules.field.tanks.every[1]
    drop = y - float(trajectory.position[-1, 1, 1])
    assert drop > 5.0
    # 1.5 is half a metre of fall: in the pit the tank still rocks slowly
    assert 100.0 - blue.health == pytest.approx(3.0 * (drop - 1.0), abs=1.5)
    assert rules.field.tanks.every[0].points == round(100.0 - blue.health)


def test_a_cluster_splits_and_conserves_its_mean_velocity() -> None:
    trajectory = play(loads(TEXT), taps("weapon", "weapon", "fire"))[1]
    spawned = [action["ball"] for action in trajectory.info["actions"] if action["kind"] == "spawn"]
    assert len(spawned) == 6
    names = [ball["name"] for ball in spawned]
    number = trajectory.number(names[0])
    velocity = trajectory.velocity[:, number]
    last = velocity[~np.isnan(velocity[:, 0])]
    moving = last[np.hypot(*last.T) > 0.0][-1]
    mean = np.mean([ball["velocity"] for ball in spawned[1:]], axis=0)
    assert mean == pytest.approx(moving, abs=1e-9)
    craters = [action for action in trajectory.info["actions"] if action["kind"] == "reshape"]
    assert len(craters) == 5


def test_a_roller_rolls_before_it_explodes() -> None:
    trajectory = play(loads(TEXT), taps("weapon", "weapon", "weapon", "fire"))[1]
    kinds = [action["kind"] for action in trajectory.info["actions"]]
    assert kinds.count("spawn") == 2
    assert kinds.count("reshape") == 1
    first, second = (action for action in trajectory.info["actions"] if action["kind"] == "spawn")
    assert second["time"] > first["time"] + 1.0
    roller = trajectory.number(second["ball"]["name"])
    path = trajectory.position[:, roller, 0]
    path = path[~np.isnan(path)]
    assert abs(path[-1] - path[0]) > 1.0
    assert (trajectory.contact_pair == [roller, -1]).all(axis=1).any()


SLOPE = [40.0 - 0.2 * k for k in range(100)]
HILL = [*SLOPE[:49:-1], *SLOPE[50:]]


@pytest.mark.parametrize(
    ("edges", "heights", "interval"),
    [("open", SLOPE, None), ("rubber", SLOPE, (60.0, 98.0)), ("wrap", SLOPE, (0.0, 1.0)), ("wrap", HILL, (5.0, 40.0))],
)
def test_rollers_cross_the_edges_as_shells_do(
    edges: str, heights: list[float], interval: tuple[float, float] | None
) -> None:
    """A roller reaches the right edge: it leaves, bounces back, hits the cliff of the other side, or rolls on there."""
    text = TEXT.replace("width = 240.0\ncolumns = 240\nheight = 20.0", f"width = 100.0\nheights = {heights}")
    text = text.replace("position = 50.0", "position = 30.0").replace("position = 190.0", "position = 45.0")
    scene = loads(text.replace("speed = 60.0", f'edges = "{edges}"\nspeed = 30.0'))
    rules, trajectory, _ = play(scene, taps("weapon", "weapon", "weapon", "fire"))
    assert rules.shots[0].weapon == "roller"
    path = trajectory.position[:, trajectory.number("shell 2"), 0]
    assert 100.0 < np.nanmax(path) < 100.5  # a step of 20 ms beyond the edge
    if interval is None:
        assert not rules.field.blasts
    else:
        (blast,) = rules.field.blasts
        assert interval[0] < blast.position[0] < interval[1]


def test_keys_move_only_the_gun_of_the_player_in_turn() -> None:
    rules = rules_of(loads(TEXT))
    assert isinstance(rules, ArtilleryRules)
    red, blue = rules.field.tanks.every
    before = red.angle, red.power
    held = (Press(0.1, "left", 1.0), Press(0.6, "left", 0.0), Press(1.0, "up", 1.0), Press(2.0, "up", 0.0))
    run(loads(TEXT, overrides=["world.duration=3"]), bout=HeadlessGame(rules, ScriptedInput(held), "script"))
    assert math.degrees(red.angle - before[0]) == pytest.approx(0.1 + 0.5 * 5.0, abs=0.06)  # a step of 10 ms
    assert red.power - before[1] == pytest.approx(0.001 + 0.05 * 0.6 + 8 * 0.05 * 0.4, abs=0.01)
    assert (blue.angle, blue.power) == (math.radians(120.0), 0.6)


def test_game_without_a_winner_ends_after_its_rounds() -> None:
    scene = loads(TEXT, overrides=["artillery.rounds=1", "world.duration=26"])
    presses = taps("fire") + taps("fire", begin=12.0)
    rules, _, _ = play(scene, presses)
    assert rules.game_over is not None
    assert rules.game_over.startswith("out of shells")


def test_a_copy_of_the_rules_is_independent() -> None:
    rules = rules_of(loads(BOTS))
    assert isinstance(rules, ArtilleryRules)
    other = copy.deepcopy(rules)
    run(loads(BOTS, overrides=["world.duration=12"]), bout=HeadlessGame(rules, NoInput(), "none"))
    assert other.turn == 0
    assert rules.turn > 0
    assert other.field.ground is not rules.field.ground
    assert other.field is other.barrage._field


def test_panel_and_sounds_of_a_shot() -> None:
    rules, _, _ = play(loads(TEXT), taps("fire"))
    lines = dict(rules.display_lines())
    assert set(lines) >= {"Red", "▸ Blue", "wind", "gun", "weapon", "last shot"}
    assert "exact" in lines["last shot"] or "gone" in lines["last shot"]
    cues = rules.sounds()
    assert list(cues)[:2] == ["turn", "fire"]
    assert "blast" in cues
    assert rules.sounds() == []


def test_a_scene_without_players_is_refused() -> None:
    scene = loads('[play]\ngame = "artillery"\n[[ball]]\nposition = [0.0, 0.0]\nradius = 1.0')
    with pytest.raises(UnsuitableSceneError, match="needs \\[artillery\\]"):
        rules_of(scene)
