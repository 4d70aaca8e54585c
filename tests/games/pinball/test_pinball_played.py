"""Games of pinball on an engine, headless: what a plain table of walls and posts is enough for."""

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
def played() -> Trajectory:
    return play(plain(), PlayerSpec("shoot", SHOOT))


def test_plain_table_is_played_to_its_end(played: Trajectory) -> None:
    game = played.info["game"]
    assert game["over"] == "game over"
    assert game["score"] > 0
    assert game["score"] == round(game["score"], -1)
    assert played.time[-1] < 60.0


def test_score_is_what_the_contacts_are_worth(played: Trajectory) -> None:
    scene = plain()
    names, score = dict(enumerate(scene.fixed_names)), 0
    worth = {"a": (500, 0.9 * 0.9, 0.054), "b": (500, 0.9 * 0.9, 0.054), "c": (2_000 + 100, 0.9 * 0.5, 0.108)}
    along = (played.contact_impulse * played.contact_normal).sum(axis=1) / 0.08
    for (_, thing), speed in zip(played.contact_pair.tolist(), along.tolist(), strict=True):
        points, restitution, least = worth.get(names[-1 - thing], (0, 0.0, 0.0))
        if points and speed > (1.0 + restitution) * least:
            score += points
    assert played.info["game"]["score"] == score  # a standing target adds 100 to a bonus that counts once


def test_session_replays_to_the_same_score_and_state(played: Trajectory) -> None:
    scene, info = plain(), played.info
    session = Recording(
        scene,
        "pymunk",
        Settings.model_validate(info["settings"]),
        actions_from_json(json.dumps(info["actions"])),
        float(played.time[-1]),
        info["state_hash"],
        presses=tuple(Press(*press) for press in info["game"]["presses"]),
    )
    again = run(
        session.whole_scene,
        "pymunk",
        actions=session.actions,
        audit=False,
        bout=PlayerSpec.from_recording(session).start_game(scene),
    )
    assert again.info["state_hash"] == info["state_hash"]
    assert again.info["game"]["score"] == info["game"]["score"]
    assert again.info["game"]["otherwise"] is None


@pytest.mark.parametrize("seed", [1, 2])
def test_random_player_plays_alike_by_the_seed_alone(seed: int) -> None:
    one, two = (play(plain(20.0, seed), PlayerSpec()) for _ in range(2))
    assert one.info["state_hash"] == two.info["state_hash"]
    other = play(plain(20.0, seed + 10), PlayerSpec())
    assert other.info["state_hash"] != one.info["state_hash"]


def test_ball_never_leaves_what_encloses_it(played: Trajectory) -> None:
    x, y = played.position[:, 0].T
    assert np.isfinite(played.position).all()
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


def test_hand_plays_pinball_alone() -> None:
    other, frame = required_rules(load(find("landing"))), start(plain(), "pymunk").frame()
    with pytest.raises(UnsuitableSceneError, match="only plays pinball"):
        PinballBot(1).decide(StepInfo(0.0, frame, Contacts.none(), ()), other)
    with pytest.raises(ValueError, match="0 to 1"):
        PinballBot(1, 1.5)
