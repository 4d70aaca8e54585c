"""Vector environment: the same episodes as environments one after the other, bit for bit; its interface."""

from collections import Counter
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import COMPILED
from sandbox.games.landing.rules import LANDED, LOST, OUTSIDE_PAD, TIPPED_OVER
from sandbox.gym import CompiledOnlyError, SandboxEnv, SandboxVectorEnv, make_vector_env
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load, loads
from tests.toml_text import toml

pytestmark = pytest.mark.fail_slow(60)  # many episodes one after the other

COUNT = 12

Policy = Callable[[np.random.Generator, FloatArray], FloatArray]


def at_random(rng: np.random.Generator, observation: FloatArray) -> FloatArray:
    return rng.random((len(observation), 3)).astype(np.float32)


def no_thrust(_: np.random.Generator, observation: FloatArray) -> FloatArray:
    return np.zeros((len(observation), 3), np.float32)


def at_full_thrust(_: np.random.Generator, observation: FloatArray) -> FloatArray:
    return np.tile(np.float32([1.0, 0.0, 0.0]), (len(observation), 1))


def pilot(_: np.random.Generator, observation: FloatArray) -> FloatArray:
    """Steer towards the pad, whose centre is at (20, 3.2) m, and descend there; the gains land some."""
    x, y, vx, vy, angle, spin = observation[:, :6].T
    aside, height = np.clip(0.0625 * (20.0 - x) - 0.4 * vx, -0.8, 0.8), y - 5.2
    descent = np.where(np.abs(20.0 - x) < 2.0 + 0.5 * height, np.clip(0.25 * height, 0.4, 5.0), 0.0)
    engine = np.clip((1.62 - 2.0 * (descent + vy)) / 5.0, 0.0, 1.0)
    turn = 1.6 * (-0.37 * aside - angle) - 1.8 * spin
    return np.stack([engine, np.clip(turn, 0.0, 1.0), np.clip(-turn, 0.0, 1.0)], axis=1).astype(np.float32)


def assert_equal_infos(a: dict[str, Any], b: dict[str, Any]) -> None:
    assert a.keys() == b.keys()
    for key in a:
        assert a[key].tolist() == b[key].tolist(), key


def compare(scene: Scene | str, policy: Policy, seed: int, every: int, steps: int) -> Counter[str]:
    """Compare a vector environment with environments one after the other; return why episodes ended."""
    observe = "time", "score"
    many = SandboxVectorEnv(scene, COUNT, every=every, observe=observe)
    singles = SyncVectorEnv([lambda: SandboxEnv(scene, "reference", every=every, observe=observe)] * COUNT)
    rng, ends = np.random.default_rng(seed), Counter[str]()
    observation, info = many.reset(seed=seed)
    expected, expected_info = singles.reset(seed=seed)
    assert observation.tobytes() == expected.tobytes()
    assert_equal_infos(info, expected_info)
    for _ in range(steps):
        actions = policy(rng, observation)
        found, expected_step = many.step(actions), singles.step(actions)
        for own, other in zip(found[:4], expected_step[:4], strict=True):
            assert own.tobytes() == other.tobytes()
            assert own.dtype == other.dtype
        assert_equal_infos(found[4], expected_step[4])
        observation, _, over, late, info = found
        assert many.observation_space.contains(observation)
        ends.update(str(reason).split(":")[0] for reason in info["over"][over])
        ends["late"] += int(late.sum())
        ends["failed"] += int(info["_failed"].sum()) if "failed" in info else 0
    many.close()
    singles.close()
    return ends


@pytest.mark.parametrize(
    ("policy", "seed", "every", "steps", "reasons"),
    [
        (at_random, 1, 5, 250, {LOST}),
        (pilot, 2, 20, 300, {LANDED, OUTSIDE_PAD, "crashed"}),
        (pilot, 3, 100, 60, {LANDED, OUTSIDE_PAD}),
        (no_thrust, 4, 1, 900, {OUTSIDE_PAD}),
        (at_full_thrust, 5, 7, 300, {LOST}),  # until the tank is empty
    ],
)
def test_episodes_are_those_of_single_environments(
    policy: Policy, seed: int, every: int, steps: int, reasons: set[str]
) -> None:
    ends = compare("landing", policy, seed, every, steps)
    assert reasons <= ends.keys()


def plain(duration: float = 30.0, height: float = 2.3, force: float = 5.0, more: str = "") -> Scene:
    ship = {"position": [0.0, height], "velocity": [0.0, 0.0], "size": [1.0, 4.0], "mass": 2.0, "friction": 1.0}
    return loads(
        toml("play", game="landing")
        + toml("world", gravity=[0.0, -1.62], duration=duration)
        + toml("solver", dt=0.01)
        + toml("plane", name="pad", point=[0.0, 0.0], normal=[0.0, 1.0], friction=1.0)
        + toml("box", name="ship", **ship)
        + toml("thrust", name="engine", body="ship", force=[0.0, force], key="up")
        + toml("thrust", name="left", body="ship", force=[-0.5, 0.0], point=[0.0, 1.6], key="left")
        + toml("thrust", name="right", body="ship", force=[0.5, 0.0], point=[0.0, 1.6], key="right")
        + more
    )


def test_tall_ship_that_tips_over_ends_alike() -> None:
    def push(_: np.random.Generator, observation: FloatArray) -> FloatArray:
        return np.tile(np.float32([0.0, 1.0, 0.0]), (len(observation), 1))

    assert compare(plain(), push, 6, 10, 60)[TIPPED_OVER] > 0


def test_landing_counts_the_time_at_rest_alike() -> None:
    assert compare(plain(height=2.05), no_thrust, 7, 3, 160)[LANDED] > 0


def test_episodes_are_truncated_alike() -> None:
    assert compare(plain(duration=0.735, height=50.0), at_random, 8, 4, 60)["late"] > COUNT


def test_failed_physics_ends_alike() -> None:
    ends = compare(plain(height=50.0, force=1e16), at_random, 9, 5, 6)
    assert ends["failed"] == ends["late"] > COUNT


def test_digital_values_beyond_the_bounds_are_clipped_and_invalid_actions_change_nothing() -> None:
    env = SandboxVectorEnv("landing", 2, every=5)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros((2, 3)))
    first, _ = env.reset(seed=1)
    for invalid in (np.zeros(3), np.zeros((3, 3)), [[0.0, 0.0, np.nan]] * 2, "up", None):
        with pytest.raises(ValueError, match="2 × 3 numbers, 0 to 1, for engine, turn left, turn right"):
            env.step(invalid)
    clipped, *_ = env.step([[7.0, -3.0, 0.0]] * 2)
    env.reset(seed=1)
    assert env.step([[1.0, 0.0, 0.0]] * 2)[0].tobytes() == clipped.tobytes()
    assert first.tobytes() != clipped.tobytes()


def test_reset_takes_seeds_and_a_mask() -> None:
    env, alone = SandboxVectorEnv("landing", 3, every=5), SandboxEnv("landing", "reference", every=5)
    with pytest.raises(ValueError, match="first reset"):
        env.reset(options={"reset_mask": np.asarray([True, False, True])})
    assert env.reset()[1]["seed"].tolist() == [env.scene.world.seed + k for k in range(3)]
    observation, info = env.reset(seed=[4, 9, None])
    assert info["seed"][:2].tolist() == [4, 9]
    assert observation[1].tobytes() == alone.reset(seed=9)[0].tobytes()
    moved, *_ = env.step(np.ones((3, 3)))
    mask = np.asarray([True, False, False])
    observation, info = env.reset(seed=4, options={"reset_mask": mask})
    assert info["_seed"].tolist() == mask.tolist()
    assert observation[1:].tobytes() == moved[1:].tobytes()
    assert observation[0].tobytes() == alone.reset(seed=4)[0].tobytes()
    for options in ({"reset_mask": [True]}, {"reset_mask": np.ones(3)}, {"low": 1}):
        with pytest.raises(ValueError, match=r"reset_mask|low"):
            env.reset(options=options)
    for seed in (-1, 2**63, [1, 2]):
        with pytest.raises(ValueError, match="seed"):
            env.reset(seed=seed)


def test_spaces_and_metadata() -> None:
    env = SandboxVectorEnv("landing", 4, bodies=["ship"])
    assert env.action_space.shape == (4, 3)
    assert env.observation_space.shape == (4, 8)
    assert env.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    assert env.unwrapped is env


@pytest.mark.parametrize(
    ("scene", "engine"),
    [
        (load("landing"), "pymunk"),
        (load("curling"), "reference"),
        (plain(more="[[ball]]\nposition = [9.0, 9.0]\nradius = 1.0"), "reference"),  # the ship can touch it
        (plain(more="[[sensor]]\nposition = [9.0, 9.0]\nradius = 1.0"), "reference"),  # detects after every step
    ],
)
def test_what_cannot_be_compiled_is_refused(scene: Scene, engine: str) -> None:
    with pytest.raises(CompiledOnlyError, match="vectorization_mode='sync'"):
        SandboxVectorEnv(scene, 2, engine)
    assert isinstance(make_vector_env(2, scene=scene, engine=engine), SyncVectorEnv)


@pytest.mark.parametrize("observe", [(), ("score",), ("score", "time")])
def test_observed_numbers_are_those_of_a_single_environment(observe: tuple[str, ...]) -> None:
    env, alone = (make(observe) for make in (lambda o: SandboxVectorEnv("landing", 2, observe=o), single))
    assert env.observed == alone.observed
    assert env.observed_ranges == alone.observed_ranges
    env.reset(seed=4)
    alone.reset(seed=4)
    found = env.step(np.zeros((2, 3)))[0][0]
    assert found.tobytes() == alone.step([0.0, 0.0, 0.0])[0].tobytes()


def single(observe: tuple[str, ...]) -> SandboxEnv:
    return SandboxEnv("landing", "reference", observe=observe)


def test_number_of_episodes_is_checked() -> None:
    with pytest.raises(ValueError, match="num_envs"):
        SandboxVectorEnv("landing", 0)


def test_make_vec_chooses_the_compiled_environment_where_it_can() -> None:
    fast = gymnasium.make_vec("sandbox/Landing-v1", num_envs=2, engine="reference")
    assert isinstance(fast, SandboxVectorEnv if COMPILED else SyncVectorEnv)
    assert isinstance(gymnasium.make_vec("sandbox/Landing-v1", num_envs=2), SyncVectorEnv)
    assert isinstance(gymnasium.make_vec("sandbox/Curling-v1", num_envs=2), SyncVectorEnv)
    shown = gymnasium.make_vec("sandbox/Landing-v1", num_envs=2, engine="reference", render_mode="rgb_array")
    assert isinstance(shown, SyncVectorEnv)
