"""Headless games of pinball on an engine, on a plain table of walls and posts."""

from typing import Any

import pytest

from sandbox.engines.switching import start
from sandbox.games.contract import StepInfo, UnsuitableSceneError
from sandbox.games.pinball.bot import PinballBot
from sandbox.games.players import PlayerSpec
from sandbox.games.registry import required_rules, rules_of
from sandbox.measure.run.runner import run
from sandbox.recording import Press
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Contacts, Trajectory

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def plain(duration: float = 60.0, seed: int = 1, ball: bool = True) -> Scene:
    """Return a table of walls and posts: a cabinet with a lane, two bumpers, a standup target and a drain."""

    def wall(name: str, *points: tuple[float, float], **more: float) -> dict[str, Any]:
        return {"name": name, "points": points, "thickness": 0.005, **more}

    bumper = {"radius": 0.0243, "restitution": 0.9, "kick": {"speed": 0.81, "threshold": 0.054}}
    cabinet = ((0.0, 0.0), (0.0, 0.9), (0.1, 1.0), (0.4, 1.0), (0.5, 0.9), (0.5, 0.0))
    roles = {"ball": "ball", "a": "bumper", "b": "bumper", "c": "standup", "outlet": "drain"}
    served = {"name": "ball", "position": [0.475, 0.0961], "radius": 0.0135, "mass": 0.08, "restitution": 0.9}
    return from_document(
        {
            "title": "Plain",
            "world": {"gravity": [0.0, -0.8], "duration": duration, "seed": seed},
            "solver": {"dt": 0.01, "substeps": 10},
            "wall": [
                wall("cabinet", *cabinet, thickness=0.01, restitution=0.3),
                wall("lane", (0.45, 0.0), (0.45, 0.7), restitution=0.3),
                wall("foot", (0.45, 0.08), (0.5, 0.08)),
                wall("outlet", (0.0, 0.05), (0.45, 0.05)),
            ],
            "post": [
                {"name": "a", "position": [0.03, 0.6], **bumper},
                {"name": "b", "position": [0.16, 0.6], **bumper},
                {"name": "c", "position": [0.1, 0.4], "radius": 0.01, "restitution": 0.5},
            ],
            "ball": [served] if ball else [],
            "play": {
                "game": "pinball",
                "part": [{"name": n, "role": role} for n, role in roles.items() if ball or n != "ball"],
            },
        }
    )


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


def test_random_player_depends_only_on_the_seed() -> None:
    one, two, other = (play(plain(20.0, seed), PlayerSpec()) for seed in (1, 1, 2))
    assert one.info["state_hash"] == two.info["state_hash"]
    assert other.info["state_hash"] != one.info["state_hash"]


def test_table_without_a_ball_is_refused() -> None:
    with pytest.raises(UnsuitableSceneError, match="needs a ball"):
        rules_of(plain(ball=False))


def test_bot_refuses_other_games_and_invalid_skill() -> None:
    other, frame = required_rules(load(find("landing"))), start(plain(), "pymunk").frame()
    with pytest.raises(UnsuitableSceneError, match="only plays pinball"):
        PinballBot(1).decide(StepInfo(0.0, frame, Contacts.none(), ()), other)
    with pytest.raises(ValueError, match="0 to 1"):
        PinballBot(1, 1.5)
