"""LunarLander and BipedalWalker: agreement with Gymnasium's environments on Box2D, interface, copies and recordings."""

import copy
import importlib
import math
import pickle
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import sandbox
import sandbox.gym
from sandbox.gym import CLASSICS, BipedalWalker, LunarLander
from sandbox.measure.run.sessions import rerun
from sandbox.queries import SceneQueries
from sandbox.recording import Recording

pytestmark = pytest.mark.fail_slow(60)  # episodes on two engines


def peer(name: str, **options: Any) -> gymnasium.Env[Any, Any]:
    """Return Gymnasium's own environment."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of SWIG's types, when Box2D is imported
        importlib.import_module("Box2D")
    return gymnasium.make(name, disable_env_checker=True, **options).unwrapped


def own(name: str, **options: Any) -> Any:
    """Return the environment of the sandbox, without its limit of steps."""
    return gymnasium.make(f"sandbox/{name}", disable_env_checker=True, **options).unwrapped


def states(env: gymnasium.Env[Any, Any], seed: int, actions: list[Any]) -> list[tuple[bytes, float, bool]]:
    """Return all that an episode shows."""
    seen = [(env.reset(seed=seed)[0].tobytes(), 0.0, False)]
    for action in actions:
        observation, reward, terminated, _, _ = env.step(action)
        seen.append((observation.tobytes(), float(reward), terminated))
        if terminated:
            break
    return seen


def sampled(env: gymnasium.Env[Any, Any], count: int, seed: int = 1) -> list[Any]:
    """Return random actions."""
    env.action_space.seed(seed)
    return [env.action_space.sample() for _ in range(count)]


@pytest.mark.parametrize("name", CLASSICS)
def test_environments_pass_gymnasiums_checker(name: str) -> None:
    check_env(gymnasium.make(f"sandbox/{name}").unwrapped)


@pytest.mark.parametrize("name", CLASSICS)
def test_spaces_limits_and_thresholds_are_those_of_gymnasium(name: str) -> None:
    peer(name)  # imports Box2D
    ours, theirs = gymnasium.make(f"sandbox/{name}"), gymnasium.make(name, disable_env_checker=True)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.spec is not None
    assert theirs.spec is not None
    assert ours.spec.max_episode_steps == theirs.spec.max_episode_steps
    assert ours.spec.reward_threshold == theirs.spec.reward_threshold
    assert len(ours.get_wrapper_attr("observed")) == len(set(ours.get_wrapper_attr("observed")))


@pytest.mark.parametrize("continuous", [False, True])
@pytest.mark.parametrize("enable_wind", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_flight_of_the_lander_is_that_of_box2d(seed: int, continuous: bool, enable_wind: bool) -> None:
    theirs = peer("LunarLander-v3", continuous=continuous, enable_wind=enable_wind)
    ours = own("LunarLander-v3", continuous=continuous, enable_wind=enable_wind)
    first, second = theirs.reset(seed=seed)[0], ours.reset(seed=seed)[0]
    for k, action in enumerate(sampled(ours, 60, seed)):
        assert not second[6:].any()
        # pymunk and Box2D pass impulses on to the legs differently, above all those that turn the lander.
        assert first[:2] == pytest.approx(second[:2], abs=3e-3), k
        assert first[2:5] == pytest.approx(second[2:5], abs=0.02), k
        assert first[5] == pytest.approx(second[5], abs=0.04), k
        first, reward, *_ = theirs.step(action)
        second, other_reward, *_ = ours.step(action)
        assert other_reward == pytest.approx(float(reward), abs=1.5)  # 100 points per unit of speed and angle


def test_corners_of_the_lunar_ground_are_those_of_gymnasium() -> None:
    theirs, ours = peer("LunarLander-v3"), own("LunarLander-v3")
    for seed in range(20):
        theirs.reset(seed=seed)
        ours.reset(seed=seed)
        expected = [(edge[0], edge[1]) for edge in theirs.sky_polys]  # type: ignore[attr-defined]
        found = [wall.points for wall in ours.recording().scene.walls]
        np.testing.assert_allclose(
            np.asarray([edge[:2] for edge in found]), np.asarray(expected), atol=1e-12
        )  # rounding


@pytest.mark.parametrize("hardcore", [False, True])
def test_ground_of_the_walker_is_that_of_gymnasium(hardcore: bool) -> None:
    theirs, ours = peer("BipedalWalker-v3", hardcore=hardcore), own("BipedalWalker-v3", hardcore=hardcore)
    for seed in range(6):
        theirs.reset(seed=seed)
        ours.reset(seed=seed)
        scene = ours.recording().scene
        corners = [wall.points[0] for wall in scene.walls] + [scene.walls[-1].points[1]]
        expected = np.column_stack((theirs.terrain_x, theirs.terrain_y))  # type: ignore[attr-defined]
        np.testing.assert_allclose(np.asarray(corners), expected, atol=1e-9)  # sums of 200 steps
        boxes = sorted(polygon.points for polygon in scene.polygons if polygon.fixed)
        fixtures = [body.fixtures[0].shape for body in theirs.terrain]  # type: ignore[attr-defined]
        outlines = [shape.vertices for shape in fixtures if len(shape.vertices) == 4]
        assert len(boxes) == len(outlines)
        assert bool(boxes) == hardcore
        centres = sorted(np.mean(outline, axis=0).tolist() for outline in outlines)
        np.testing.assert_allclose([np.mean(box, axis=0) for box in boxes], centres, atol=1e-5)  # Box2D has floats


@pytest.mark.parametrize("hardcore", [False, True])
def test_range_finders_agree_with_rays_cast_in_the_scene(hardcore: bool) -> None:
    env = own("BipedalWalker-v3", hardcore=hardcore)
    rng = np.random.default_rng(1)
    for seed in range(3):
        env.reset(seed=seed)
        scene = env.recording().scene
        thin = scene.model_copy(
            update={"walls": tuple(wall.model_copy(update={"thickness": 0.0}) for wall in scene.walls)}
        )
        simulation = sandbox.start(thin.model_copy(update={"boxes": (), "polygons": scene.polygons[1:], "joints": ()}))
        queries = SceneQueries(simulation.setup, simulation.frame())
        for x in rng.uniform(5.0, 80.0, 20).tolist():
            y = 7.0
            angles = 0.15 * np.arange(10)
            ends = np.asarray((x, y)) + 160.0 / 30.0 * np.stack((np.sin(angles), -np.cos(angles)), axis=1)
            expected = np.minimum(queries.cast_rays(np.tile((x, y), (10, 1)), ends).fraction, 1.0)
            assert env._distances(x, y) == pytest.approx(expected.tolist(), abs=1e-9)


def test_walker_stands_where_gymnasiums_stands_and_falls_with_it() -> None:
    theirs, ours = peer("BipedalWalker-v3"), own("BipedalWalker-v3")
    first, second = theirs.reset(seed=1)[0], ours.reset(seed=1)[0]
    for _ in range(8):  # Box2D has pulled the joints together after its second step
        first, *_ = theirs.step(np.zeros(4))
        second, *_ = ours.step(np.zeros(4))
    angles = [0, 4, 6, 9, 11]
    assert second[angles] == pytest.approx(first[angles], abs=0.1)  # rad
    assert second[14:] == pytest.approx(first[14:], abs=0.02)  # of 5.3 m
    assert second[3] == pytest.approx(first[3], abs=0.1)


@pytest.mark.parametrize("name", CLASSICS)
def test_episodes_of_a_seed_are_equal_bit_for_bit_and_those_of_others_differ(name: str) -> None:
    env, actions = own(name), sampled(own(name), 120)
    first = states(env, 3, actions)
    assert states(env, 4, actions) != first
    assert states(own(name), 3, actions) == first


@pytest.mark.parametrize("name", CLASSICS)
@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_copies_and_pickles_of_a_running_episode_continue_alike(name: str, engine: str) -> None:
    env = own(name, engine=engine)
    before, after = sampled(env, 20), sampled(env, 20, seed=2)
    states(env, 3, before)
    others = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    expected = [env.step(action)[0].tobytes() for action in after]
    for other in others:
        assert [other.step(action)[0].tobytes() for action in after] == expected


@pytest.mark.parametrize("name", CLASSICS)
def test_recording_of_an_episode_replays_bit_for_bit(name: str) -> None:
    env = own(name)
    states(env, 5, sampled(env, 60))
    recording = env.recording()
    assert rerun(recording).info["state_hash"] == recording.state_hash
    assert rerun(recording, "reference").status == "ok"


def test_recording_of_an_episode_with_arguments_of_numpy_can_be_saved(tmp_path: Path) -> None:
    env = own("LunarLander-v3", gravity=np.float32(-3.71), enable_wind=True, wind_power=np.float32(20.0))
    states(env, 5, sampled(env, 20))
    env.recording().save(tmp_path / "flight.json")
    recording = Recording.load(tmp_path / "flight.json")
    assert rerun(recording).info["state_hash"] == env.recording().state_hash


def test_lander_that_comes_to_rest_gets_100_points_and_one_that_crashes_loses_as_many() -> None:
    env = own("LunarLander-v3", gravity=-1.0)
    env.reset(seed=0)
    rewards = []
    terminated = False
    while not terminated:
        _, reward, terminated, _, _ = env.step(0)
        rewards.append(reward)
    assert rewards[-1] == -100.0
    env = own("LunarLander-v3")
    observation, _ = env.reset(seed=1)
    terminated, total = False, 0.0
    while not terminated:  # a controller of tilt and rate of descent
        x, y, vx, vy, angle, spin, *legs = observation.tolist()
        turn = (min(max(0.5 * x + vx, -0.4), 0.4) - angle) * 0.5 - spin
        lift = (0.55 * abs(x) - y) * 0.5 - 0.5 * vy
        if any(legs):
            turn, lift = 0.0, -0.5 * vy
        action = 2 if lift > max(abs(turn), 0.05) else 3 if turn < -0.05 else 1 if turn > 0.05 else 0
        observation, reward, terminated, _, _ = env.step(action)
        total += reward
    assert reward == 100.0
    assert total > 200.0


def test_invalid_actions_raise_and_leave_the_environment_unchanged() -> None:
    for name, actions in {
        "LunarLander-v3": [4, -1, 0.5, None],
        "LunarLanderContinuous-v3": [[0.0], [math.nan, 0.0], "up"],
        "BipedalWalker-v3": [[0.0] * 3, [math.inf] * 4],
    }.items():
        env, other = own(name), own(name)
        env.reset(seed=1)
        other.reset(seed=1)
        for action in actions:
            with pytest.raises(ValueError, match=r"action|could not convert"):
                env.step(action)
        valid = sampled(env, 1)[0]
        assert env.step(valid)[0].tobytes() == other.step(valid)[0].tobytes()


def test_invalid_arguments_are_refused() -> None:
    with pytest.raises(ValueError, match="between -12 and 0"):
        LunarLander(gravity=-13.0)
    with pytest.raises(ValueError, match="use pymunk or reference"):
        LunarLander(engine="box2d")
    with pytest.raises(sandbox.Refusal, match="polygons"):
        BipedalWalker(engine="exact")
    with pytest.raises(ValueError, match="render mode"):
        BipedalWalker(render_mode="human")
    with pytest.raises(ValueError, match="options"):
        LunarLander().reset(options={"start": 1})
    with pytest.raises(gymnasium.error.ResetNeeded):
        LunarLander().step(0)


@pytest.mark.parametrize("name", ["LunarLander-v3", "BipedalWalkerHardcore-v3"])
def test_rendered_picture_changes_with_the_episode(name: str) -> None:
    env = own(name, render_mode="rgb_array")
    env.reset(seed=1)
    first = env.render()
    assert first.shape == (400, 600, 3)
    for action in sampled(env, 20):
        env.step(action)
    assert (env.render() != first).any()
    env.close()
