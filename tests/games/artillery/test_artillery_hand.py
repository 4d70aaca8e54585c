"""The player at the keys: without error it hits as a bot does, and what it pressed is all that a script needs."""

import math

import pytest

from sandbox.games.artillery.battlefield import WEAPONS
from sandbox.games.artillery.bot import ArtilleryBot
from sandbox.games.artillery.rules import ArtilleryRules
from sandbox.games.contract import Policy, UnsuitableSceneError
from sandbox.games.players import POLICIES, ScriptedInput
from sandbox.games.registry import rules_of
from sandbox.games.session import HeadlessGame
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from tests.games.artillery.dueling import two_tanks

pytestmark = pytest.mark.full  # long runs and sweeps

FIELD = two_tanks("duration = 12.0", "money = 0", blue="bot = 0.0")


def played(policy: Policy) -> tuple[ArtilleryRules, HeadlessGame, str]:
    scene = loads(FIELD)
    rules = rules_of(scene)
    assert isinstance(rules, ArtilleryRules)
    bout = HeadlessGame(rules, policy, "hand")
    trajectory = run(scene, "reference", bout=bout, integrator="rk4", audit=False)
    return rules, bout, trajectory.info["state_hash"]


def test_full_skill_hits_by_keys_alone() -> None:
    rules, bout, state = played(ArtilleryBot(1, skill=1.0))
    own = [shot for shot in rules.shots if shot.shooter == "Red"]
    assert own
    first, blue = own[0], loads(FIELD).bodies.position[1].tolist()
    assert first.place is not None
    assert math.dist(first.place, blue) <= WEAPONS[0].radius
    assert rules.score > 0
    again, seen, same = played(ScriptedInput(bout.presses))
    assert (again.score, seen.presses, same) == (rules.score, bout.presses, state)


def test_skill_is_a_share_and_the_game_has_to_be_artillery() -> None:
    with pytest.raises(ValueError, match="0 to 1"):
        ArtilleryBot(1, skill=1.5)
    assert isinstance(POLICIES["skilled"](loads(FIELD)), ArtilleryBot)
    with pytest.raises(UnsuitableSceneError, match="not landing"):
        POLICIES["skilled"](load(find("landing")))
