"""Headless games of pinball on an engine, on a plain table of walls and posts."""

import json

import numpy as np
import pytest

from sandbox.action import actions_from_json
from sandbox.engines.switching import start
from sandbox.games.contract import StepInfo, UnsuitableSceneError
from sandbox.games.pinball.bot import PinballBot
from sandbox.games.players import PlayerSpec
from sandbox.games.registry import required_rules, rules_of
from sandbox.measure.run.runner import run
from sandbox.recording import Press, Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Contacts, Trajectory

pytestmark = pytest.mark.full  # long runs and sweeps

TABLE = """
title = "Plain"
[world]
gravity = [0.0, -0.8]
duration = {duration}
seed = {seed}
[solver]
dt = 0.01
substeps = 10
[[wall]]
name = "cabinet"
points = [[0.0, 0.0], [0.0, 0.9], [0.1, 1.0], [0.4, 1.0], [0.5, 0.9], [0.5, 0.0]]
thickness = 0.01
restitution = 0.3
[[wall]]
name = "lane"
points = [[0.45, 0.0], [0.45, 0.7]]
thickness = 0.005
restitution = 0.3
[[wall]]
name = "foot"
points = [[0.45, 0.08], [0.5, 0.08]]
thickness = 0.005
[[wall]]
name = "outlet"
points = [[0.0, 0.05], [0.45, 0.05]]
thickness = 0.005
[[post]]
name = "a"
position = [0.03, 0.6]
radius = 0.0243
restitution = 0.9
kick = {{ speed = 0.81, threshold = 0.054 }}
[[post]]
name = "b"
position = [0.16, 0.6]
radius = 0.0243
restitution = 0.9
kick = {{ speed = 0.81, threshold = 0.054 }}
[[post]]
name = "c"
position = [0.1, 0.4]
radius = 0.01
restitution = 0.5
[[ball]]
name = "ball"
position = [0.475, 0.0961]
radius = 0.0135
mass = 0.08
restitution = 0.9
[play]
game = "pinball"
[[play.part]]
name = "ball"
role = "ball"
[[play.part]]
name = "a"
role = "bumper"
[[play.part]]
name = "b"
role = "bumper"
[[play.part]]
name = "c"
role = "standup"
[[play.part]]
name = "outlet"
role = "drain"
"""


def plain(duration: float = 60.0, seed: int = 1) -> Scene:
    return loads(TABLE.format(duration=duration, seed=seed))


SHOOT = tuple(Press(t, "plunger", v) for k in range(20) for t, v in ((3.0 * k + 0.5, 1.0), (3.0 * k + 1.0, 0.0)))


def play(scene: Scene, player: PlayerSpec) -> Trajectory:
    return run(scene, "pymunk", audit=False, bout=player.start_game(scene))


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    return play(plain(), PlayerSpec("shoot", SHOOT))


def test_plain_table_is_played_to_its_end(trajectory: Trajectory) -> None:
    game = trajectory.info["game"]
    assert game["over"] == "game over"
    assert game["score"] > 0
    assert game["score"] == round(game["score"], -1)
    assert trajectory.time[-1] < 60.0


def test_score_is_the_sum_over_the_contacts(trajectory: Trajectory) -> None:
    scene = plain()
    names, score = dict(enumerate(scene.fixed_names)), 0
    values = {"a": (500, 0.9 * 0.9, 0.054), "b": (500, 0.9 * 0.9, 0.054), "c": (2_000 + 100, 0.9 * 0.5, 0.108)}
    speeds = (trajectory.contact_impulse * trajectory.contact_normal).sum(axis=1) / 0.08
    for (_, thing), speed in zip(trajectory.contact_pair.tolist(), speeds.tolist(), strict=True):
        points, restitution, least = values.get(names[-1 - thing], (0, 0.0, 0.0))
        if points and speed > (1.0 + restitution) * least:
            score += points
    assert trajectory.info["game"]["score"] == score  # a standup target adds 100 to a bonus with multiplier one


def test_session_replays_to_the_same_score_and_state(trajectory: Trajectory) -> None:
    scene, info = plain(), trajectory.info
    session = Recording(
        scene,
        "pymunk",
        Settings.model_validate(info["settings"]),
        actions_from_json(json.dumps(info["actions"])),
        float(trajectory.time[-1]),
        info["state_hash"],
        presses=tuple(Press(*press) for press in info["game"]["presses"]),
    )
    replayed = run(
        session.whole_scene,
        "pymunk",
        actions=session.actions,
        audit=False,
        bout=PlayerSpec.from_recording(session).start_game(scene),
    )
    assert replayed.info["state_hash"] == info["state_hash"]
    assert replayed.info["game"]["score"] == info["game"]["score"]
    assert replayed.info["game"]["otherwise"] is None


@pytest.mark.parametrize("seed", [1, 2])
def test_random_player_depends_only_on_the_seed(seed: int) -> None:
    one, two = (play(plain(20.0, seed), PlayerSpec()) for _ in range(2))
    assert one.info["state_hash"] == two.info["state_hash"]
    other = play(plain(20.0, seed + 10), PlayerSpec())
    assert other.info["state_hash"] != one.info["state_hash"]


def test_ball_never_leaves_the_cabinet(trajectory: Trajectory) -> None:
    x, y = trajectory.position[:, 0].T
    assert np.isfinite(trajectory.position).all()
    assert (x > 0.0).all()
    assert (x < 0.5).all()
    assert (y > 0.0).all()
    assert (y < 1.0).all()


def test_table_without_a_ball_is_refused() -> None:
    text = TABLE.format(duration=1.0, seed=1)
    text = text[: text.index("[[ball]]")] + '[play]\ngame = "pinball"\n'
    scene = loads(text)
    with pytest.raises(UnsuitableSceneError, match="needs a ball"):
        rules_of(scene)


def test_bot_refuses_other_games_and_invalid_skill() -> None:
    other, frame = required_rules(load(find("landing"))), start(plain(), "pymunk").frame()
    with pytest.raises(UnsuitableSceneError, match="only plays pinball"):
        PinballBot(1).decide(StepInfo(0.0, frame, Contacts.none(), ()), other)
    with pytest.raises(ValueError, match="0 to 1"):
        PinballBot(1, 1.5)
