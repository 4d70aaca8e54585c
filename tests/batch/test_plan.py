"""Plans: sweeps and how they multiply."""

import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.batch.plan import MAX_FAILED, parse_sweep, plan, repeated_keys
from sandbox.resource_limits import RUNS
from sandbox.scene.errors import SceneError
from sandbox.scene.files.overrides import AddressError
from sandbox.scene.files.shipped_scenes import find

BALL = '[[ball]]\nname = "a"\nposition = [0, 0]\nradius = 1\n'

SPARKS = """
[[emitter]]
position = [0.0, 3.0]
count = 3
velocity_min = [-1.0, -1.0]
velocity_max = [1.0, 1.0]
"""


@pytest.fixture
def scene(tmp_path: Path) -> tuple[str, str]:
    path = tmp_path / "scene.toml"
    path.write_text(BALL)
    return "label", str(path)


@pytest.mark.parametrize(
    ("text", "key", "values"),
    [
        ("solver.dt=0.1,0.01", "solver.dt", [0.1, 0.01]),
        ("solver.dt = 0.1 , 0.01", "solver.dt", [0.1, 0.01]),
        ("solver.dt=0.1", "solver.dt", [0.1]),
        ("solver.half_kick=true,false", "solver.half_kick", [True, False]),
        ("solver.integrator=rk4,leapfrog", "solver.integrator", ["rk4", "leapfrog"]),
        ("world.gravity=[0,-9.81],[0, -1.62]", "world.gravity", [[0, -9.81], [0, -1.62]]),
        ("world.bounds=[[0,0],[1,1]],[[0,0],[2,2]]", "world.bounds", [[[0, 0], [1, 1]], [[0, 0], [2, 2]]]),
        ("title=\"a, b\",'c'", "title", ["a, b", "c"]),
        ('title="1:2:3"', "title", ["1:2:3"]),
        ('ball."a=b".mass=1,2', 'ball."a=b".mass', [1, 2]),
        ("solver.dt=0:1:5", "solver.dt", [0, 0.25, 0.5, 0.75, 1]),
        ("solver.dt=1:0:3", "solver.dt", [1, 0.5, 0]),
        ("solver.dt=0.5:2:1", "solver.dt", [0.5]),
        ("solver.dt=0.001:0.1:3:log", "solver.dt", [0.001, 0.01, 0.1]),
        ("solver.substeps=1:8:4:log", "solver.substeps", [1, 2, 4, 8]),
        ("world.seed=1:4:4", "world.seed", [1, 2, 3, 4]),
        ("ball.a.mass=-2:2:3", "ball.a.mass", [-2, 0, 2]),
    ],
)
def test_sweep_is_a_key_and_values(text: str, key: str, values: list[object]) -> None:
    found, swept = parse_sweep(text)
    assert (found, list(swept)) == (key, values)


@given(st.integers(1, 60), st.integers(1, 60), st.integers(1, 200))
def test_whole_values_between_whole_ends_are_integers_and_others_numbers(low: int, width: int, count: int) -> None:
    _, values = parse_sweep(f"x={low}:{low + width}:{count}")
    for k, value in enumerate(values):
        whole = count == 1 or k * width % (count - 1) == 0
        assert isinstance(value, int) == whole
        # Two roundings of numbers up to 120.
        assert value == pytest.approx(low + (k * width / (count - 1) if count > 1 else 0), rel=1e-15, abs=3e-14)
    assert all(isinstance(value, float) for value in parse_sweep(f"x={low}.0:{low + width}.0:{count}")[1])


@given(st.floats(1e-9, 1e9), st.floats(1.0, 1e9), st.integers(2, 200))
def test_log_range_has_equal_factors_and_its_very_ends(low: float, factor: float, count: int) -> None:
    high = low * factor
    _, values = parse_sweep(f"x={low!r}:{high!r}:{count}:log")
    assert (len(values), values[0], values[-1]) == (count if low < high else 1, low, high)
    for k, value in enumerate(values):
        # pow of up to 1e9 rounds its exponent by 1e-16, its result by 20 times that.
        assert math.log(value / low) == pytest.approx(math.log(factor) * k / (count - 1), abs=1e-14)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("solver.dt", "is not KEY=VALUE"),
        ("=1,2", "is not KEY=VALUE"),
        ("solver.dt=", "a value is missing"),
        ("solver.dt=1,", "a value is missing"),
        ("solver.dt=1,,2", "a value is missing"),
        ("solver.dt=1:2:x", "a range is LOW:HIGH:N"),
        ("solver.dt=1:2:2.5", "a range is LOW:HIGH:N"),
        ("solver.dt=a:2:3", "a range is LOW:HIGH:N"),
        ("solver.dt=1:2:0", "at least 1 value"),
        ("solver.dt=1:2:-3", "at least 1 value"),
        (f"solver.dt=1:2:{RUNS.default + 1}", "set SANDBOX_MAX_RUNS=1_100_000"),
        ("solver.dt=1:inf:3", "finite ends"),
        ("solver.dt=nan:1:3", "finite ends"),
        ("solver.dt=-1e308:1e308:3", "finite ends"),
        ("solver.dt=1" + "0" * 400 + ":2:3", "finite ends"),
        ("solver.dt=1:2:3:lin", "'lin' is unknown"),
        ("solver.dt=0:2:3:log", "0 < LOW <= HIGH"),
        ("solver.dt=-1:2:3:log", "0 < LOW <= HIGH"),
        ("solver.dt=2:1:3:log", "0 < LOW <= HIGH"),
        ("solver.dt=1e-300:1e300:3:log", "0 < LOW <= HIGH"),
    ],
)
def test_sweep_that_cannot_be_understood_is_refused(text: str, message: str) -> None:
    with pytest.raises(AddressError, match=message):
        parse_sweep(text)


@given(st.text(max_size=20))
def test_any_text_is_a_sweep_or_refused(text: str) -> None:
    try:
        key, values = parse_sweep(text)
    except AddressError as error:
        assert str(error)
    else:
        assert key
        assert values


@given(
    st.lists(
        st.integers() | st.booleans() | st.lists(st.integers(), max_size=3) | st.sampled_from(["a,b", "[", "c"]),
        min_size=1,
        max_size=5,
    )
)
def test_listed_values_are_read_as_toml_has_them(values: list[object]) -> None:
    texts = [str(v).lower() if isinstance(v, bool) else f'"{v}"' if isinstance(v, str) else str(v) for v in values]
    key, found = parse_sweep(f"x={','.join(texts)}")
    stated = tomllib.loads(f"x = [{','.join(texts)}]")["x"]
    assert (key, found) == ("x", [value for k, value in enumerate(stated) if not _is_among(value, stated[:k])])


def _is_among(value: object, others: list[object]) -> bool:
    """Tell whether one of the others is the same value of the same type: 1, 1.0 and true are three."""
    return any(type(other) is type(value) and repr(other) == repr(value) for other in others)


@pytest.mark.parametrize("values", [",".join(["a"] * 10**5), "1:1:1000000", '"' + "," * 10**5, "[" + "," * 10**5])
def test_equal_values_of_a_sweep_are_one(values: str) -> None:
    assert len(parse_sweep(f"title={values}")[1]) == 1


def test_runs_that_would_be_too_many_are_counted_without_being_laid_out(scene: tuple[str, str]) -> None:
    with pytest.raises(AddressError, match=r"multiply to 1,000,000,000 runs"):
        plan([scene], None, sweeps=["world.duration=1:2:1000000", "solver.dt=1:2:1000"])
    with pytest.raises(AddressError, match=r"multiply to 10\^300 runs"):
        plan([scene], None, sweeps=["solver.dt=1:2:1000000"] * 50)


def test_scenes_that_would_fill_the_memory_are_refused_at_the_first(scene: tuple[str, str]) -> None:
    Path(scene[1]).write_text(BALL + SPARKS.replace("3\n", "100000\n"))
    with pytest.raises(SceneError, match="200,000 runs of 100,001 bodies"):
        plan([scene], None, sweeps=["world.duration=1:2:1000"], seeds=200)
    Path(scene[1]).write_text(BALL)
    assert plan([scene], None, seeds=1_000_000)[0].seeds == 1_000_000  # one run, as nothing is random


def test_faults_of_many_runs_end_the_check(scene: tuple[str, str]) -> None:
    with pytest.raises(SceneError) as error:
        plan([scene], None, sweeps=["solver.dt=-1:-2:1000000"])
    assert len(error.value.faults) == MAX_FAILED


def test_plan_multiplies_in_its_order(scene: tuple[str, str], tmp_path: Path) -> None:
    second = tmp_path / "second.toml"
    second.write_text(BALL.replace("1\n", "2\n") + SPARKS)
    Path(scene[1]).write_text(BALL + SPARKS)
    jobs = plan(
        [scene, ("second", str(second))],
        ["pymunk", "other"],
        sweeps=["solver.dt=0.1,0.01", "world.gravity=[0,-1],[0,-2]"],
        seeds=2,
    )
    found = [(j.label, j.scene.solver.dt, j.scene.world.gravity[1], j.scene.world.seed, j.engine) for j in jobs]
    assert found == [
        (label, dt, g, seed, engine)
        for label in ("label", "second")
        for dt in (0.1, 0.01)
        for g in (-1.0, -2.0)
        for seed in (1, 2)
        for engine in ("pymunk", "other")
    ]
    assert {job.scene.balls[0].radius for job in jobs if job.label == "second"} == {2.0}


def test_plan_without_anything_is_the_scene_as_it_stands(scene: tuple[str, str]) -> None:
    (job,) = plan([scene], ["pymunk"])
    assert (job.scene.world.seed, job.scene.solver.dt, job.engine, job.actions) == (0, 0.01, "pymunk", ())


def test_sweep_outranks_a_set_value_and_seeds_a_sweep(scene: tuple[str, str]) -> None:
    jobs = plan([scene], ["pymunk"], ["solver.dt=1.0", "world.seed=9"], ["solver.dt=0.1,0.2", "world.seed=7"], seeds=1)
    assert [(job.scene.solver.dt, job.scene.world.seed) for job in jobs] == [(0.1, 1), (0.2, 1)]


def test_every_fault_is_told_once(scene: tuple[str, str], tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text(BALL.replace("radius = 1", "radius = -1\nmass = -1"))
    with pytest.raises(SceneError) as caught:
        plan([scene, ("bad", str(bad))], ["pymunk"], sweeps=["solver.dt=-1,0.1,0"], seeds=3)
    told = [(fault.file, fault.line, fault.path) for fault in caught.value.faults]
    assert told == [
        (scene[1], None, "solver.dt (set)"),
        (scene[1], None, "solver.dt (set)"),
        (str(bad), 4, "ball.a.radius"),
        (str(bad), 5, "ball.a.mass"),
        (str(bad), None, "solver.dt (set)"),
        (str(bad), None, "solver.dt (set)"),
    ]


@pytest.mark.parametrize("path", ["nothing.at.all", "ball..radius", "ball.none.radius"])
def test_path_that_leads_nowhere_is_named_by_its_option(scene: tuple[str, str], path: str) -> None:
    with pytest.raises(SceneError) as caught:
        plan([scene], None, [f"{path}=1"])
    assert {fault.path for fault in caught.value.faults} == {"--set"}
    with pytest.raises(SceneError) as caught:
        plan([scene], None, ["solver.none.x=3"], [f"{path}=1,2"])
    assert sorted(fault.path for fault in caught.value.faults) == ["--set", "--sweep"]


def test_too_many_runs_are_refused_before_any_is_laid_out(scene: tuple[str, str]) -> None:
    sweeps = ["solver.dt=0.1:1:1001", "ball.a.mass=1:2:1000"]
    with pytest.raises(AddressError, match="multiply to 1,001,000 runs"):
        plan([scene], ["pymunk"], sweeps=sweeps)


def test_jobs_tell_the_swept_values() -> None:
    jobs = plan([("bounce", str(find("bounce")))], ["pymunk"], sweeps=["ball.ball.restitution=0,1"], seeds=2)
    assert [dict(job.point) for job in jobs] == [{"ball.ball.restitution": e, "world.seed": 1} for e in (0, 1)]
    assert [job.seeds for job in jobs] == [2, 2]  # nothing is random


def test_seeds_are_one_run_only_where_nothing_is_random(scene: tuple[str, str]) -> None:
    Path(scene[1]).write_text(BALL + SPARKS)
    jobs = plan([scene], ["pymunk"], sweeps=["emitter.0.velocity_max=[1.0,1.0],[-1.0,-1.0]"], seeds=3)
    assert [(job.scene.emitters[0].velocity_max[0], job.scene.world.seed, job.seeds) for job in jobs] == [
        (1.0, 1, 1),
        (1.0, 2, 1),
        (1.0, 3, 1),
        (-1.0, 1, 3),
    ]


@pytest.mark.parametrize(
    ("overrides", "sweeps", "seeds", "told"),
    [
        ([], ["world.seed=1,2"], 2, [("--sweep", "world.seed")]),
        (["world.seed=1"], [], 2, [("--set", "world.seed")]),
        (["solver.dt=1"], ["solver.dt=1,2"], None, [("--sweep", "solver.dt")]),
        ([], ["ball[0].mass=1", "ball.0.mass=2"], None, [("--sweep", "ball.0.mass")]),
        (["solver.dt=1"], ["world.seed=1,2"], None, []),
        (["nonsense"], ["ball..mass=1", "ball..mass=2"], 2, []),
    ],
)
def test_keys_that_are_given_twice_are_found(
    overrides: list[str], sweeps: list[str], seeds: int | None, told: list[tuple[str, str]]
) -> None:
    faults = repeated_keys(overrides, sweeps, seeds)
    assert [(fault.file, fault.path) for fault in faults] == told
