"""Gymnasium environments: interface, observations, actions, seeds, and agreement with recorded sessions."""

import copy
import pickle
import subprocess
import sys
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

from sandbox.engines.contract import Refusal, SnapshotError
from sandbox.game_names import games_with_rules
from sandbox.games.contract import Control, UnsuitableSceneError
from sandbox.games.landing import rules as landing
from sandbox.games.registry import required_rules
from sandbox.gym import GAMES, STATES, SandboxEnv
from sandbox.measure.run.sessions import rerun
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import shipped
from tests.toy_game import TOY, Toy

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def play_episode(env: SandboxEnv, seed: int | None, action_seed: int = 1) -> list[tuple[bytes, float, bool, bool]]:
    observation, _ = env.reset(seed=seed)
    transitions = [(observation.tobytes(), 0.0, False, False)]
    env.action_space.seed(action_seed)
    while not (transitions[-1][2] or transitions[-1][3]):
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        transitions.append((observation.tobytes(), reward, terminated, truncated))
    return transitions


@pytest.mark.parametrize("name", GAMES)
def test_shipped_games_pass_gymnasiums_checker(name: str) -> None:
    check(gymnasium.make(f"sandbox/{name}-v1").unwrapped, skip_render_check=False)


def check(env: Any, skip_render_check: bool = True) -> None:
    """Check an environment; the render check needs one made from an id.

    pytest turns warnings into errors, those of the checker among them, except that unbounded numbers are unusual.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*Box observation space m(in|ax)imum value is -?infinity")
        check_env(env, skip_render_check=skip_render_check)


@pytest.mark.parametrize("name", GAMES)
def test_random_episode_ends_within_its_limit_and_all_numbers_are_in_their_ranges(name: str) -> None:
    """The ranges hold without clipping, except for the last position of a body that has left the bounds."""
    env = gymnasium.make(f"sandbox/{name}-v1", observe=("time", "score")).unwrapped
    assert isinstance(env, SandboxEnv)
    assert len(set(env.observed)) == len(env.observed) == len(env.observed_ranges)
    assert required_rules(env.scene).observation_ranges().keys() <= {*env.observed}  # type: ignore[attr-defined]
    env.bounds = np.array([[-np.inf], [np.inf]])
    low, high = (np.array([each[k] for each in env.observed_ranges]) for k in (0, 1))
    assert (low < high).all()
    env.action_space.seed(2)
    observation, _ = env.reset(seed=1)
    count, over, late = 0, False, False
    while not (over or late):
        rounding = 1e-6 * np.abs(observation)  # float32
        inside = (low - rounding <= observation) & (observation <= high + rounding)
        assert inside.all(), [env.observed[k] for k in np.flatnonzero(~inside)]
        if count % 7 == 0:  # held for some steps, as a player does
            action = env.action_space.sample()
        count += 1
        observation, _, over, late, _ = env.step(action)
    assert over


@pytest.mark.parametrize("name", GAMES)
def test_observations_are_in_the_space_at_the_end_of_an_episode_too(name: str) -> None:
    env = gymnasium.make(f"sandbox/{name}-v1", duration=3.0, observe="time").unwrapped
    env.action_space.seed(2)
    for seed in (1, 2):
        observation, _ = env.reset(seed=seed)
        ended = False
        while not ended:
            assert env.observation_space.contains(observation)
            observation, _, over, late, _ = env.step(env.action_space.sample())
            ended = over or late
        assert env.observation_space.contains(observation)


def test_body_that_leaves_the_bounds_is_observed_at_the_bounds() -> None:
    env = SandboxEnv("landing", every=100)
    env.reset(seed=9)
    over = False
    while not over:
        observation, _, over, _, info = env.step([0.6, 0.0, 0.2])
    assert info["over"] == "lost in space"
    assert env.observation_space.contains(observation)
    (x0, y0), (x1, y1) = env.scene.world.bounds or ((0.0, 0.0), (0.0, 0.0))
    assert observation[0] in (x0, x1) or observation[1] in (y0, y1)


def test_positions_and_velocities_are_bounded_where_the_scene_bounds_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", Toy)
    limits = TOY.replace("radius = 0.2", "radius = 0.2\nmax_speed = 3.0\nmax_angular_velocity = 5.0")
    bounds = limits.replace("duration = 2.0", "duration = 2.0\nbounds = [[-4.0, -1.0], [4.0, 9.0]]")
    free, fast, boxed = (SandboxEnv(loads(text)) for text in (TOY, limits, bounds))
    inf = np.inf
    assert free.observation_space.high.tolist() == [inf, inf, inf, inf, inf, inf, 1.0]  # type: ignore[attr-defined]
    assert fast.observation_space.high.tolist() == [inf, inf, 3.0, 3.0, inf, 5.0, 1.0]  # type: ignore[attr-defined]
    assert boxed.observation_space.low.tolist() == [-4.0, -1.0, -3.0, -3.0, -inf, -5.0, 0.0]  # type: ignore[attr-defined]
    assert [each.unit for each in free.observed_ranges] == ["m", "m", "m/s", "m/s", "rad", "rad/s", ""]


def test_every_shipped_game_has_an_id() -> None:
    games = {scene.name for scene in shipped() if load(scene.path).play.game in games_with_rules()}
    on_request = {"billiards/8-ball", "billiards/9-ball"}  # scenes whose rules start only on request
    assert {scene for scene, _ in GAMES.values()} == games | on_request


def test_episodes_with_the_same_seed_are_equal() -> None:
    env = SandboxEnv("landing", every=10)
    assert play_episode(env, 5) == play_episode(SandboxEnv("landing", every=10), 5)
    assert play_episode(env, 5) != play_episode(env, 6)


@pytest.mark.parametrize("name", ["EightBall", "NineBall", "ArtilleryDuel", "Landing"])
def test_episodes_with_other_seeds_start_otherwise(name: str) -> None:
    env = gymnasium.make(f"sandbox/{name}-v1")
    starts = [env.reset(seed=seed)[0].tobytes() for seed in (1, 2, 1)]
    assert starts[0] != starts[1]
    assert starts[0] == starts[2]


def test_first_episode_has_the_seed_of_the_scene_and_later_ones_others() -> None:
    env = SandboxEnv("landing")
    seeds = [env.reset()[1]["seed"] for _ in range(3)]
    assert seeds[0] == env.scene.world.seed
    assert len(set(seeds)) == 3
    assert seeds == [env.reset()[1]["seed"] for env in [SandboxEnv("landing")] for _ in range(3)]


def test_recording_of_an_episode_replays_with_equal_hash_and_score() -> None:
    env = SandboxEnv("landing", every=5)
    episode = play_episode(env, 3)
    recording = env.recording()
    run = rerun(recording, audit=False)
    assert run.info["state_hash"] == recording.state_hash
    assert run.info["game"]["score"] == recording.score == sum(reward for _, reward, _, _ in episode)
    assert run.info["game"]["otherwise"] is None


def test_observation_has_bodies_gauges_and_on_request_time_and_score() -> None:
    plain = (*(f"ship {state}" for state in STATES), "fuel")
    assert SandboxEnv("landing").observed == plain
    assert SandboxEnv("landing", observe="time").observed == (*plain, "time")
    env = SandboxEnv("landing", every=2, observe=["time", "score"])
    first, _ = env.reset()
    observation, _, _, _, info = env.step([0.0, 0.0, 0.0])
    assert env.observed == (*plain, "time", "score")
    assert observation.shape == (len(env.observed),)
    dt, gravity = env.scene.solver.dt, env.scene.world.gravity[1]
    assert observation[-2] == pytest.approx(2 * dt)  # s
    assert observation[-1] == info["score"] == 0
    assert observation[2] == first[2]  # no horizontal force
    assert observation[3] == pytest.approx(2 * dt * gravity, rel=1e-5)  # free fall; float32
    assert observation[6] == 1.0  # the body exists


def test_analogue_action_sets_the_thrust() -> None:
    env = SandboxEnv("landing", every=50)
    env.reset()
    half, mass = 0.5, 1.0
    observation, *_ = env.step([half, 0.0, 0.0])
    rise = half * 5.0 / mass - 1.62  # m/s², the scene's engine and gravity
    assert observation[3] == pytest.approx(rise * 50 * 0.01, rel=1e-5)  # float32
    assert [press.value for press in env.recording().presses] == [half]


def test_episode_is_truncated_at_the_duration(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", Toy)
    env = SandboxEnv(loads(TOY), every=30)
    episode = play_episode(env, None)
    assert episode[-1][2:] == (False, True)
    assert len(episode) == 1 + 7  # 200 steps of 0.01 s


class Digital(Toy):
    controls = (Control("kick", "up", ("up",)),)


def test_digital_controls_have_a_discrete_action_space(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", Digital)
    env = SandboxEnv(loads(TOY), every=10)
    check(env)
    assert env.action_space == gymnasium.spaces.MultiDiscrete([2])
    env.reset()
    _, reward, *_ = env.step(np.array([1]))
    assert reward == 0.5
    assert env.step(np.array([1]))[1] == 0.0  # still held: one press gives one reward


def test_rendered_picture_shows_the_ship_and_changes() -> None:
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


def test_rendered_picture_shows_overlays_of_the_rules() -> None:
    """The barrel and the flame of an engine are drawn by the rules, not by bodies."""
    duel = SandboxEnv("duel", every=60, render_mode="rgb_array")
    duel.reset()
    before = duel.render()
    duel.step([0, 1, 0, 0, 0, 0])
    assert duel.render().shape == before.shape
    assert (duel.render() != before).any()
    ship = SandboxEnv("landing", render_mode="rgb_array")
    off, on = (render_after_step(ship, level) for level in (0.0, 1.0))
    changed = (off != on).any(axis=2)
    assert 10 < changed.sum() < 2000  # the flame, not the ship, which one step moves by 0.2 mm


def render_after_step(env: SandboxEnv, engine: float) -> np.ndarray:
    env.reset(seed=1)
    env.step([engine, 0.0, 0.0])
    return np.asarray(env.render())


@pytest.mark.parametrize(
    "action",
    [[np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0], [0.0, 0.0], [0.0] * 4, [[0.0] * 3], 0.5, "up", None, [0.0, 0.0, "up"]],
)
def test_invalid_action_raises_and_leaves_the_environment_unchanged(action: object) -> None:
    env = SandboxEnv("landing")
    env.reset(seed=1)
    with pytest.raises(ValueError, match="3 numbers, 0 to 1, for engine, turn left, turn right; not"):
        env.step(action)
    assert (env.recording().presses, env.recording().duration) == ((), 0.0)


def test_analogue_actions_are_clipped_and_digital_ones_refused() -> None:
    env = SandboxEnv("landing", every=5)
    env.reset(seed=1)
    env.step([7.0, -3.0, 0.5])
    assert [(press.control, press.value) for press in env.recording().presses] == [("engine", 1.0), ("turn right", 0.5)]
    duel = SandboxEnv("duel")
    duel.reset()
    for action in ([2] * 6, [-1] * 6, [0.5] * 6, [np.nan] * 6):
        with pytest.raises(ValueError, match="6 numbers, 0 or 1, for left, right, up, down, weapon, fire"):
            duel.step(action)


def test_step_after_the_end_raises_until_reset() -> None:
    env = SandboxEnv("landing", every=50)
    episode = play_episode(env, 3)
    end = env.recording()
    with pytest.raises(gymnasium.error.ResetNeeded, match="the episode has ended"):
        env.step([0.0, 0.0, 0.0])
    assert env.recording() == end
    assert play_episode(env, 3) == episode  # a reset starts another episode


def held(levels: tuple[float, float, float], steps: int = 1000) -> list[tuple[float, float, float]]:
    return [levels] * steps


EPISODES = {
    "crash": (held((0.0, 0.0, 0.0)), "crashed outside the pad"),
    "leaves the bounds": (held((0.6, 0.0, 0.2)), "lost in space"),
    "empty tank": (held((1.0, 0.3, 0.0)), "crashed outside the pad"),
}
"""Actions in `Landing`, and how the episode ends."""


@pytest.mark.parametrize(
    ("name", "every", "engine"),
    [
        *(("crash", every, "reference") for every in (1, 7, 100)),
        ("leaves the bounds", 100, "pymunk"),
        ("leaves the bounds", 7, "reference"),
        ("empty tank", 7, "pymunk"),
        ("empty tank", 100, "reference"),
        ("random", 7, "pymunk"),
        ("random", 100, "reference"),
    ],
)
def test_steps_that_the_rules_do_not_see_change_nothing(
    name: str, every: int, engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All numbers of an episode equal those of an episode whose rules are called after every step."""
    if name == "empty tank":
        monkeypatch.setattr(landing, "TANK_CAPACITY", 5.0)
    quiet, called = (SandboxEnv("landing", engine, every=every) for _ in range(2))
    quiet.action_space.seed(4)
    actions, end = EPISODES.get(name) or ([quiet.action_space.sample() for _ in range(1000)], None)
    observed = [env.reset(seed=9)[0].tobytes() for env in (quiet, called)]
    assert observed[0] == observed[1]
    episode = called._episode
    assert episode is not None
    monkeypatch.setattr(episode, "_quiet_rules", None)
    for action in actions:
        one, other = quiet.step(action), called.step(action)
        assert (one[0].tobytes(), *one[1:]) == (other[0].tobytes(), *other[1:])
        assert quiet.display_lines() == called.display_lines()
        if one[2] or one[3]:
            break
    assert quiet.recording() == called.recording()
    assert end is None or one[4]["over"] == end
    if name == "empty tank":
        assert quiet.display_lines()["fuel"] == "0 %"


def test_divergence_among_steps_that_the_rules_do_not_see() -> None:
    """Fuel and score are then those of the last step before it, as if the rules had seen every step."""
    scene = load("landing", ["world.duration=60"])
    strong = tuple(thrust.model_copy(update={"force": (0.0, 1e13)}) for thrust in scene.thrusts)  # 10¹³ m/s in 1 s
    unbounded = scene.world.model_copy(update={"bounds": None})
    scene = scene.model_copy(update={"world": unbounded, "thrusts": strong})
    found = []
    for every in (1, 150):
        env = SandboxEnv(scene, every=every)
        env.reset(seed=9)
        rules = env._episode.rules
        rules._tank = rules._tank_then = rules._full = 1e16  # N·s: the tank lasts until the physics fails
        for _ in range(150):
            observation, _, terminated, truncated, info = env.step([1.0, 0.0, 0.0])
            if terminated or truncated:
                break
        assert truncated
        assert "failed" in info
        fuel = rules._tank
        found.append((fuel, observation.tobytes(), info["time"], info["failed"]))
    assert found[0] == found[1]


def test_quiet_rules_that_act_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rules that announce quiet steps and then return an action for one of them are wrong."""
    env = SandboxEnv("landing", every=100)
    env.reset(seed=9)
    episode = env._episode
    assert episode is not None
    act = episode.rules.on_input("engine", 1.0)
    monkeypatch.setattr(episode.rules, "on_step", lambda info: act)
    with pytest.raises(RuntimeError, match="quiet"):
        for _ in range(100):
            env.step([0.0, 0.0, 0.0])


def observed_value(env: SandboxEnv, observation: np.ndarray, name: str) -> float:
    return float(observation[env.observed.index(name)])


def test_duel_observes_barrel_weapon_wind_and_terrain() -> None:
    env = SandboxEnv("duel", every=10)
    first, _ = env.reset(seed=2)
    assert observed_value(env, first, "may fire") == 1.0
    assert env.display_lines()["wind"].startswith(f"{abs(observed_value(env, first, 'wind')):.1f} m/s")
    turned, *_ = env.step([1, 0, 0, 0, 1, 0])
    assert observed_value(env, turned, "Red barrel") > observed_value(env, first, "Red barrel")
    assert observed_value(env, turned, "Red weapon") == 1.0
    assert observed_value(env, turned, "Blue barrel") == observed_value(env, first, "Blue barrel")
    flying, *_ = env.step([0, 0, 0, 0, 0, 1])
    assert (observed_value(env, flying, "may fire"), observed_value(env, flying, "shells")) == (0.0, 1.0)
    heights = [k for k, name in enumerate(env.observed) if name.startswith("height")]
    other, _ = env.reset(seed=3)
    assert (first[heights] != other[heights]).any()
    for _ in range(100):
        later, *_ = env.step([0, 0, 0, 0, 0, 1])
    assert observed_value(env, later, "landed x") > 0.0


def test_curling_observes_broom_weight_turn_and_team() -> None:
    env = SandboxEnv("curling", every=20)
    env.reset(seed=2)
    while not env.step([0] * 7)[0][env.observed.index("may throw")]:
        pass
    aimed, *_ = env.step([1, 0, 1, 0, 1, 0, 0])
    found = [observed_value(env, aimed, name) for name in ("broom", "weight", "turn", "team", "thrown", "stones run")]
    assert found == [pytest.approx(0.1), pytest.approx(0.5), -1.0, 0.0, 0.0, 0.0]  # 0.2 s at 0.5 and 2.5 m/s
    thrown, *_ = env.step([0, 0, 0, 0, 0, 1, 0])
    assert observed_value(env, thrown, "stones run") == 1.0


@pytest.mark.parametrize("name", GAMES)
def test_sync_and_async_vector_environments_agree(name: str) -> None:
    """Equal seeds and actions give equal observations in one process and in several."""
    found = []
    for mode in ("sync", "async"):
        games = gymnasium.make_vec(f"sandbox/{name}-v1", num_envs=2, vectorization_mode=mode)
        observations, info = games.reset(seed=5)
        assert info["seed"].tolist() == [5, 6]
        games.action_space.seed(1)
        rows = [observations] + [games.step(games.action_space.sample())[0] for _ in range(20)]
        found.append(np.stack(rows))
        games.close()
    assert found[0].tobytes() == found[1].tobytes()
    assert (found[0][-1, 0] != found[0][-1, 1]).any()  # random actions differ


def test_spawned_processes_import_the_environment_by_its_spec() -> None:
    kwargs = {"context": "spawn"}
    games = gymnasium.make_vec("sandbox/Landing-v1", num_envs=1, vectorization_mode="async", vector_kwargs=kwargs)
    observations, _ = games.reset(seed=5)
    games.close()
    assert observations[0].tobytes() == gymnasium.make("sandbox/Landing-v1").reset(seed=5)[0].tobytes()


def test_environment_is_pickled_and_copied_before_an_episode() -> None:
    env = SandboxEnv("landing", every=20)
    episode = play_episode(SandboxEnv("landing", every=20), 4)
    assert play_episode(pickle.loads(pickle.dumps(env)), 4) == play_episode(copy.deepcopy(env), 4) == episode
    env.reset()
    with pytest.raises(TypeError, match=r"a running simulation cannot be pickled.*close\(\).*recording\(\)"):
        pickle.dumps(env)
    env.close()
    assert play_episode(pickle.loads(pickle.dumps(env)), 4) == episode


@pytest.mark.parametrize(("scene", "engine"), [("landing", "reference"), ("9-ball", "exact")])
def test_copy_of_an_environment_in_an_episode_continues_alike(scene: str, engine: str) -> None:
    env = SandboxEnv(scene, engine=engine, every=5)
    env.action_space.seed(2)
    env.reset(seed=3)
    actions = [env.action_space.sample() for _ in range(40)]
    for action in actions[:20]:
        env.step(action)
    copied = copy.deepcopy(env)
    for action in actions[20:]:
        one, other = env.step(action), copied.step(action)
        assert one[0].tobytes() == other[0].tobytes()
        assert one[1:] == other[1:]
        if one[2] or one[3]:
            break
    assert env.recording().actions == copied.recording().actions
    env.close()
    copied.close()


def test_copy_of_an_environment_on_pymunk_in_an_episode_is_refused() -> None:
    env = SandboxEnv("landing")
    env.reset()
    with pytest.raises(SnapshotError, match=r"on 'pymunk'.*exact and reference can.*same seed and repeat the actions"):
        copy.deepcopy(env)
    env.step([1.0, 0.0, 0.0])  # the original continues
    env.close()


def test_environment_that_has_been_rendered_is_copied() -> None:
    env = SandboxEnv("landing", "reference", render_mode="rgb_array")
    env.reset(seed=3)
    picture = env.render()
    copied = copy.deepcopy(env)
    assert (copied.render() == picture).all()
    env.close()
    env.reset(seed=3)
    env.render()
    env._release()  # an episode is over; the canvas is kept
    assert play_episode(pickle.loads(pickle.dumps(env)), 4) == play_episode(env, 4)


@pytest.mark.parametrize("name", GAMES)
def test_environment_is_made_again_from_its_spec(name: str) -> None:
    env = gymnasium.make(f"sandbox/{name}-v1", every=20, duration=9.0, observe=["score"])
    assert env.spec is not None
    for spec in (env.spec, EnvSpec.from_json(env.spec.to_json())):
        again = gymnasium.make(spec).unwrapped
        assert isinstance(again, SandboxEnv)
        assert (again.every, again.scene.world.duration, again.observed[-1]) == (20, 9.0, "score")
        assert again.observation_space == env.observation_space
        assert again.reset(seed=2)[0].tobytes() == env.reset(seed=2)[0].tobytes()


def test_old_version_of_an_id_names_the_new_one() -> None:
    with (
        pytest.warns(DeprecationWarning, match=r"sandbox/Landing-v0 is out of date.*`v1`"),
        pytest.raises(gymnasium.error.DeprecatedEnv, match="use `sandbox/Landing-v1` instead"),
    ):
        gymnasium.make("sandbox/Landing-v0")


def test_invalid_scene_option_or_engine_raises() -> None:
    with pytest.raises(UnsuitableSceneError, match="has no game with rules"):
        SandboxEnv("bounce")
    with pytest.raises(ValueError, match="no body is named 'shop'"):
        SandboxEnv("landing", bodies=["shop"])
    with pytest.raises(ValueError, match="unknown render mode 'human'"):
        SandboxEnv("landing", render_mode="human")
    with pytest.raises(ValueError, match="1 or more"):
        SandboxEnv("landing", every=0)
    with pytest.raises(ValueError, match=r"a whole number"):
        SandboxEnv("landing", **{"every": 1.5})
    with pytest.raises(ValueError, match="unknown engine 'box3d'; engines: pymunk, box2d, exact, reference"):
        SandboxEnv("landing", engine="box3d")
    with pytest.raises(Refusal, match=r"drag or polygons.*pymunk, box2d, reference"):
        SandboxEnv("duel", engine="exact")
    for wrong in ("speed", ["time", "time"]):
        with pytest.raises(ValueError, match="observe accepts 'time' and 'score', each once"):
            SandboxEnv("landing", observe=wrong)
    with pytest.raises(ValueError, match="unknown reward 'points'; rewards: score, lead, outcome"):
        SandboxEnv("duel", reward="points")
    for reward in ("lead", "outcome"):
        with pytest.raises(ValueError, match="needs a game of several players"):
            SandboxEnv("landing", reward=reward)
    with pytest.raises(ValueError, match="no player is named 'Green'; players: Red, Blue"):
        SandboxEnv("duel", player="Green")
    with pytest.raises(ValueError, match="a game of one player"):
        SandboxEnv("landing", player="Red")
    assert SandboxEnv("landing", bodies="ship").observed == SandboxEnv("landing").observed
    with pytest.raises(gymnasium.error.ResetNeeded):
        SandboxEnv("landing").step([0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="accepts no options"):
        SandboxEnv("landing").reset(options={"wind": 1})


def test_gymnasium_is_imported_only_by_sandbox_gym() -> None:
    code = "import sandbox, sandbox.measure.run.runner, sys; assert 'gymnasium' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
    code = "import sys; sys.modules['gymnasium'] = None\ntry:\n import sandbox.gym\nexcept ImportError as e: print(e)"
    printed = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert printed == "sandbox.gym needs gymnasium: pip install -e '.[gym]'\n"


SIDES = {
    "ArtilleryDuel": {"Red", "Blue"},
    "Curling": {"red", "yellow"},
    "EightBall": {"player 1", "player 2"},
    "NineBall": {"player 1", "player 2"},
}
"""Players of games of several"""


@pytest.mark.parametrize("name", GAMES)
def test_info_has_the_scores_of_all_players_and_whose_turn_it_is(name: str) -> None:
    env = gymnasium.make(f"sandbox/{name}-v1")
    _, info = env.reset(seed=1)
    if name in SIDES:
        assert info["scores"] == dict.fromkeys(SIDES[name], 0)
        assert info["player"] in SIDES[name]
    else:
        assert ("scores" in info) == (name == "ArtilleryFour")


def test_reward_of_the_duel_is_that_of_its_first_player_while_the_bot_scores_too() -> None:
    env = gymnasium.make("sandbox/ArtilleryDuel-v1")
    _, info = env.reset(seed=3)
    idle, total, over = np.zeros(env.action_space.shape or ()), 0.0, False
    fire = idle.copy()
    fire[[control.name for control in env.unwrapped.controls].index("fire")] = 1.0  # type: ignore[attr-defined]
    turns, is_pressed = set(), False
    while not over:
        turns.add(info["player"])
        is_pressed = not is_pressed
        _, reward, over, _, info = env.step(fire if is_pressed else idle)
        total += reward
    assert total == info["scores"]["Red"] == info["score"]
    assert turns == {"Red", "Blue"}
    assert info["scores"]["Blue"] > 0


@pytest.mark.parametrize(
    ("name", "player"), [("ArtilleryDuel", "Red"), ("ArtilleryFour", "Red"), ("Curling", "red"), ("NineBall", None)]
)
def test_reward_is_that_of_the_only_player_that_is_no_bot(name: str, player: str | None) -> None:
    assert gymnasium.make(f"sandbox/{name}-v1").unwrapped.player == player  # type: ignore[attr-defined]


def total_rewards(environments: dict[str, SandboxEnv], seed: int) -> tuple[dict[str, float], dict[str, Any]]:
    """Play the same random game in several environments; return the sums of the rewards, and the last info."""
    space = next(iter(environments.values())).action_space
    space.seed(seed)
    infos = {key: env.reset(seed=seed)[1] for key, env in environments.items()}
    totals, over = dict.fromkeys(environments, 0.0), False
    while not over:
        action = space.sample()
        for key, env in environments.items():
            _, reward, over, late, infos[key] = env.step(action)
            totals[key] += reward
            assert type(reward) is float
            assert not late
    info = infos.popitem()[1]
    assert all(other == info for other in infos.values())
    return totals, info


@pytest.mark.parametrize(
    ("scene", "player"), [("duel", "Red"), ("curling", "red"), ("9-ball", "player 1"), ("9-ball", "player 2")]
)
def test_rewards_add_up_to_score_lead_and_outcome(scene: str, player: str) -> None:
    engine = "exact" if scene == "9-ball" else "pymunk"
    loaded = load(scene, ["play.curling.ends=1"] if scene == "curling" else [])
    kinds = {
        reward: SandboxEnv(loaded, engine, every=50, duration=1800.0, reward=reward, player=player)
        for reward in ("score", "lead", "outcome")
    }
    totals, info = total_rewards(kinds, seed=3)
    (opponent,) = info["scores"].keys() - {player}
    assert totals["score"] == info["scores"][player]
    assert totals["lead"] == info["scores"][player] - info["scores"][opponent]
    assert totals["outcome"] == (1.0 if player in info["over"] else -1.0)
    assert (player in info["over"]) != (opponent in info["over"])


def test_reward_in_self_play_is_that_of_the_player_whose_turn_it_is() -> None:
    env = SandboxEnv("9-ball", "exact", every=50, duration=1800.0)
    env.action_space.seed(3)
    _, info = env.reset(seed=3)
    totals, over = dict.fromkeys(info["scores"], 0.0), False
    while not over:
        player = info["player"]
        _, reward, over, _, info = env.step(env.action_space.sample())
        totals[player] += reward
    assert totals == info["scores"]


def test_values_in_the_dead_zone_release_the_plunger() -> None:
    env = SandboxEnv("pinball/classic", every=2)
    heights = {}
    for rest in (0.0, 0.09, 0.2):
        env.reset(seed=1)
        for level, steps in ((1.0, 60), (rest, 40)):
            for _ in range(steps):
                observation, *_ = env.step([0.0, 0.0, level, 0.0, 0.0, 0.0])
        heights[rest] = observed_value(env, observation, "ball y")
    assert heights[0.09] == heights[0.0] > heights[0.2] + 0.3  # m: up the lane, or still at the plunger


def test_duration_ends_an_episode_and_bounds_its_time() -> None:
    env = SandboxEnv("landing", every=50, duration=1.2, observe=("time",))
    check(env)
    env.reset()
    times, ended = [0.0], False
    while not ended:
        observation, _, _, ended, info = env.step([0.0, 0.0, 0.0])
        assert env.observation_space.contains(observation)
        times.append(info["time"])
    assert times == pytest.approx([0.0, 0.5, 1.0, 1.2], abs=1e-9)  # rounding of sums of dt
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="duration"):
            SandboxEnv("landing", duration=wrong)
