"""Play a game from start to end without a window, by a policy or a script."""

import json
from dataclasses import dataclass
from typing import Any

from sandbox.action import actions_from_json
from sandbox.games.contract import Policy, Press
from sandbox.games.players import PlayerSpec
from sandbox.games.registry import required_rules
from sandbox.games.session import HeadlessGame
from sandbox.measure.run import Progress, run
from sandbox.recording import Recording
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Played:
    """Result of a game."""

    score: float
    """score at the end"""
    over: str | None
    """reason why the game ended; None if it lasted to the end of the scene's duration"""
    recording: Recording
    """all controls and actions; `measure.replay.rerun` reproduces score and state from it"""
    trajectory: Trajectory
    """recorded run with its contacts; its `status` is `ok` if the physics reached the end"""


def play_out(
    scene: Scene,
    player: Policy | str = "random",
    engine: str = "pymunk",
    *,
    audit: bool = False,
    progress: Progress | None = None,
    **settings: Any,
) -> Played:
    """Play the game of a scene until it is over, or for the scene's duration.

    Args:
        scene: scene with a game; its seed determines all random numbers, also those of the `random` player.
        player: `random`, `none`, the path of a script, or a policy.
        engine: name of the engine.
        audit: count the contacts that the engine misses.
        progress: progress callback, called with the completed fraction, 0 to 1.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Raises:
        UnfitError: the scene has no game with rules, or lacks an element that its game needs.
        SceneError: the script has faults.
        UnknownEngineError: no engine has that name.
        TooLargeError: the frames would not fit into memory.
    """
    rules = required_rules(scene)
    bout = (
        PlayerSpec.parse(player).start_game(scene)
        if isinstance(player, str)
        else HeadlessGame(rules, player, type(player).__name__)
    )
    assert bout is not None
    trajectory = run(scene, engine, audit=audit, progress=progress, bout=bout, **settings)
    return Played(bout.score, bout.game_over, _recording(scene, engine, trajectory, bout.presses, settings), trajectory)


def _recording(
    scene: Scene, engine: str, run: Trajectory, presses: tuple[Press, ...], settings: dict[str, Any]
) -> Recording:
    return Recording(
        scene=scene,
        engine=engine,
        settings=scene.solver.replace(**settings) if settings else scene.solver,
        actions=actions_from_json(json.dumps(run.info["actions"])),
        duration=float(run.time[-1]) if len(run.time) else 0.0,
        state_hash=run.info["state_hash"],
        presses=presses,
        score=run.info["game"]["score"] if "game" in run.info else None,
    )
