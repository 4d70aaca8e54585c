"""Replay of the full table: flippers, zones, layers and toggles lead to the same score and state."""

import json
from pathlib import Path

from sandbox.action import actions_from_json
from sandbox.games.players import PlayerSpec
from sandbox.measure.run.runner import run
from sandbox.recording import Press, Recording
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import load

FULL = Path(__file__).parents[3] / "scenes" / "pinball" / "full.toml"


def test_session_of_the_full_table_replays_to_the_same_score_and_state() -> None:
    scene = load(FULL)
    scene = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 12.0})})
    first = run(scene, "pymunk", audit=False, bout=PlayerSpec("skilled").start_game(scene))
    info = first.info
    assert {"drive", "move"} <= {action["kind"] for action in info["actions"]}
    session = Recording(
        scene,
        "pymunk",
        Settings.model_validate(info["settings"]),
        actions_from_json(json.dumps(info["actions"])),
        float(first.time[-1]),
        info["state_hash"],
        presses=tuple(Press(*press) for press in info["game"]["presses"]),
    )
    session = Recording.from_json(session.to_json())
    bout = PlayerSpec.from_recording(session).start_game(session.scene)
    replayed = run(session.whole_scene, "pymunk", actions=session.actions, audit=False, bout=bout)
    assert replayed.info["state_hash"] == info["state_hash"]
    assert replayed.info["game"]["score"] == info["game"]["score"] > 0
    assert replayed.info["game"]["otherwise"] is None
