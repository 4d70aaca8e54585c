"""Environments to learn in: they keep the interface of gymnasium, and are the same games as everywhere else."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from toy_game import TOY, Toy

from sandbox.games import registry
from sandbox.games.registry import RULES
from sandbox.games.rules import Control, UnfitError
from sandbox.gym import GAMES, STATE, SandboxEnv
from sandbox.measure.replay import rerun
from sandbox.scene.file import load, loads
from sandbox.scene.shipped import shipped


def played(env: SandboxEnv, seed: int | None, chances: int = 1) -> list[tuple[bytes, float, bool, bool]]:
    observation, _ = env.reset(seed=seed)
    found = [(observation.tobytes(), 0.0, False, False)]
    env.action_space.seed(chances)
    while not (found[-1][2] or found[-1][3]):
        observation, reward, over, late, _ = env.step(env.action_space.sample())
        found.append((observation.tobytes(), reward, over, late))
    return found


@pytest.mark.parametrize("name", GAMES)
def test_shipped_games_keep_the_interface(name: str) -> None:
    # pytest turns warnings into errors, those of the checker among them
    check_env(gymnasium.make(f"sandbox/{name}-v0").unwrapped)


def test_every_shipped_game_has_an_id() -> None:
    games = {scene.name for scene in shipped() if load(scene.path).play.game in RULES}
    assert {scene for scene, _ in GAMES.values()} == games


def test_episodes_of_a_seed_are_the_same() -> None:
    env = SandboxEnv("landing", every=10)
    assert played(env, 5) == played(SandboxEnv("landing", every=10), 5)
    assert played(env, 5) != played(env, 6)


def test_first_episode_has_the_scenes_seed_and_later_ones_others() -> None:
    env = SandboxEnv("landing")
    seeds = [env.reset()[1]["seed"] for _ in range(3)]
    assert seeds[0] == env.scene.world.seed
    assert len(set(seeds)) == 3
    assert seeds == [env.reset()[1]["seed"] for env in [SandboxEnv("landing")] for _ in range(3)]


def test_episode_is_a_session_that_replays() -> None:
    env = SandboxEnv("landing", every=5)
    told = played(env, 3)
    recording = env.recording()
    run = rerun(recording, audit=False)
    assert run.info["state_hash"] == recording.state_hash
    assert run.info["game"]["score"] == recording.score == sum(reward for _, reward, _, _ in told)
    assert run.info["game"]["otherwise"] is None


def test_agent_sees_the_bodies_the_time_and_the_score() -> None:
    env = SandboxEnv("landing", every=2)
    first, _ = env.reset()
    observation, _, _, _, info = env.step([0.0, 0.0, 0.0])
    assert observation.shape == (STATE + 2,)
    dt, gravity = env.scene.solver.dt, env.scene.world.gravity[1]
    assert observation[-2] == pytest.approx(2 * dt)  # s
    assert observation[-1] == info["score"] == 0
    assert observation[2] == first[2]  # nothing pushes aside
    assert observation[3] == pytest.approx(2 * dt * gravity, rel=1e-5)  # free fall; float32
    assert observation[6] == 1.0  # it is there


def test_engine_fires_as_far_as_an_action_says() -> None:
    env = SandboxEnv("landing", every=50)
    env.reset()
    half, mass = 0.5, 1.0
    observation, *_ = env.step([half, 0.0, 0.0])
    rise = half * 5.0 / mass - 1.62  # m/s², the scene's engine and gravity
    assert observation[3] == pytest.approx(rise * 50 * 0.01, rel=1e-5)  # float32
    assert [press.value for press in env.recording().presses] == [half]


def test_duration_truncates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(registry.RULES, "landing", Toy)
    env = SandboxEnv(loads(TOY), every=30)
    told = played(env, None)
    assert told[-1][2:] == (False, True)
    assert len(told) == 1 + 7  # 200 steps of 0.01 s


class Digital(Toy):
    controls = (Control("kick", "up", ("up",)),)


def test_controls_without_shades_are_0_or_1(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(registry.RULES, "landing", Digital)
    env = SandboxEnv(loads(TOY), every=10)
    check_env(env, skip_render_check=True)  # which would make it anew from an id
    assert env.action_space == gymnasium.spaces.MultiDiscrete([2])
    env.reset()
    _, reward, *_ = env.step(np.array([1]))
    assert reward == 0.5
    assert env.step(np.array([1]))[1] == 0.0  # it is held: it was pressed once


def test_pictures_are_of_the_scene() -> None:
    env = SandboxEnv("landing", render_mode="rgb_array")
    env.reset()
    picture = env.render()
    assert picture.shape == (480, 640, 3)
    assert picture.dtype == np.uint8
    ship = np.abs(picture.astype(int) - (0xE6, 0x9F, 0x00)).sum(axis=2) < 30
    assert ship.sum() > 50
    for _ in range(60):
        env.step([1.0, 0.0, 0.0])
    assert (env.render() != picture).any()


def test_what_cannot_be_played_is_told() -> None:
    with pytest.raises(UnfitError, match="has no game with rules"):
        SandboxEnv("bounce")
    with pytest.raises(ValueError, match="no body is named 'shop'; there are ship"):
        SandboxEnv("landing", bodies=["shop"])
    with pytest.raises(ValueError, match="no render mode 'human'"):
        SandboxEnv("landing", render_mode="human")
    with pytest.raises(ValueError, match="1 or more steps"):
        SandboxEnv("landing", every=0)
    with pytest.raises(gymnasium.error.ResetNeeded):
        SandboxEnv("landing").step([0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="knows no options"):
        SandboxEnv("landing").reset(options={"wind": 1})


def test_gymnasium_is_imported_only_when_asked_for() -> None:
    code = "import sandbox, sandbox.measure.run, sys; assert 'gymnasium' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
    code = "import sys; sys.modules['gymnasium'] = None\ntry:\n import sandbox.gym\nexcept ImportError as e: print(e)"
    told = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert told == "sandbox.gym needs gymnasium: pip install 'sandbox2d[gym]'\n"
