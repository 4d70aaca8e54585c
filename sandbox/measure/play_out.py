"""Playing out: a scene's game from start to end without a window, by a policy or a script."""

import json
from dataclasses import dataclass
from typing import Any

from sandbox.action import actions_from_json
from sandbox.games.bout import Bout
from sandbox.games.player import Player
from sandbox.games.registry import required_rules
from sandbox.games.rules import Policy, Press
from sandbox.measure.run import Progress, run
from sandbox.recording import Recording
from sandbox.scene.model import Scene
from sandbox.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Played:
    """A game that was played."""

    score: float
    over: str | None
    """why it ended; None where the scene's duration did"""
    recording: Recording
    """all that was pressed and done; `measure.replay.rerun` leads to the same score and state"""
    trajectory: Trajectory
    """what happened, its contacts among it; its `status` says whether the physics came to the end"""


def play_out(
    scene: Scene,
    player: Policy | str = "random",
    engine: str = "pymunk",
    *,
    audit: bool = False,
    progress: Progress | None = None,
    **settings: Any,
) -> Played:
    """Play a scene's game until it is over, or for the scene's duration.

    Args:
        scene: what is played; its seed decides all chances, a random player's too.
        player: `random`, `none`, the file of a script, or any policy.
        engine: its name in the registry.
        audit: count the contacts that the engine misses.
        progress: who is told how far it is.
        settings: changes to the scene's `[solver]`.

    Raises:
        UnfitError: the scene has no game with rules, or lacks what its game needs.
        SceneError: the script has faults.
        UnknownEngineError: no engine has that name.
        TooLargeError: the frames would not fit into memory.
    """
    rules = required_rules(scene)
    bout = Player.named(player).bout(scene) if isinstance(player, str) else Bout(rules, player, type(player).__name__)
    assert bout is not None
    trajectory = run(scene, engine, audit=audit, progress=progress, bout=bout, **settings)
    return Played(bout.score, bout.over, _recording(scene, engine, trajectory, bout.presses, settings), trajectory)


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
