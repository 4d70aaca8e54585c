"""Bot that plays by key presses: without error it hits, and a script of its presses replays the game."""

import math

import pytest

from sandbox.games.artillery.battlefield import WEAPONS
from sandbox.games.artillery.bot import ArtilleryBot
from sandbox.games.artillery.rules import ArtilleryRules
from sandbox.games.contract import Policy
from sandbox.games.players import POLICIES, ScriptedInput
from sandbox.games.registry import rules_of
from sandbox.games.session import HeadlessGame
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import loads
from tests.games.artillery.dueling import two_tanks

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

FIELD = two_tanks("duration = 12.0", "money = 0", blue="bot = 0.0")


def play(policy: Policy) -> tuple[ArtilleryRules, HeadlessGame, str]:
    scene = loads(FIELD)
    rules = rules_of(scene)
    assert isinstance(rules, ArtilleryRules)
    bout = HeadlessGame(rules, policy, "hand")
    trajectory = run(scene, "reference", bout=bout, integrator="rk4", audit=False)
    return rules, bout, trajectory.info["state_hash"]


def test_full_skill_hits_by_key_presses() -> None:
    rules, bout, state = play(ArtilleryBot(1, skill=1.0))
    shots = [shot for shot in rules.shots if shot.shooter == "Red"]
    assert shots
    first, blue = shots[0], loads(FIELD).bodies.position[1].tolist()
    assert first.position is not None
    assert math.dist(first.position, blue) <= WEAPONS[0].radius
    assert rules.score > 0
    replayed, replayed_bout, replayed_state = play(ScriptedInput(bout.presses))
    assert (replayed.score, replayed_bout.presses, replayed_state) == (rules.score, bout.presses, state)


def test_skill_outside_0_to_1_is_refused_and_the_bot_is_the_skilled_player() -> None:
    with pytest.raises(ValueError, match="0 to 1"):
        ArtilleryBot(1, skill=1.5)
    assert isinstance(POLICIES["skilled"](loads(FIELD)), ArtilleryBot)
