"""`[terrain]` and `[artillery]`: hills from the seed, column heights in whole quanta, and tanks on level ground."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.games.artillery.scene import QUANTUM, Terrain, columns_of, course_of, heights_of, settled
from sandbox.measure.seeds import with_seed
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import dumps, from_document, loads
from tests.toml_text import toml

DUEL = (
    toml("world", gravity=[0.0, -9.81], seed=5)
    + toml("terrain", width=200.0, columns=100, base=8.0, height=30.0, friction=0.5)
    + toml("artillery")
    + toml("artillery.player", name="Red", position=30.0)
    + toml("artillery.player", name="Blue", position=170.0, bot=0.5)
)


def columns(scene: Scene) -> tuple[float, ...]:
    found = columns_of(next(wall for wall in scene.walls if wall.name == "terrain").points)
    assert found is not None
    return found[0]


@given(st.integers(0, 2**63 - 1), st.integers(2, 400), st.floats(0, 1))
def test_hills_fill_their_range_and_depend_on_the_seed(seed: int, count: int, roughness: float) -> None:
    terrain = Terrain(width=100.0, columns=count, base=5.0, height=20.0, roughness=roughness)
    heights = heights_of(terrain, seed)
    assert len(heights) == count
    assert (min(heights), max(heights)) == (5.0, 25.0)  # both are multiples of the quantum
    assert all((height / QUANTUM).is_integer() for height in heights)
    assert heights == heights_of(terrain, seed)
    assert count == 2 or heights != heights_of(terrain, seed ^ 1)


def test_roughness_increases_the_steps_of_the_ground() -> None:
    def steps(roughness: float) -> float:
        heights = heights_of(Terrain(width=100.0, columns=257, base=0.0, height=1.0, roughness=roughness), 3)
        return sum(abs(a - b) for a, b in itertools.pairwise(heights))

    assert steps(0.0) < 0.5 * steps(0.5) < 0.25 * steps(1.0)


@given(st.lists(st.floats(0, 1e6), min_size=2, max_size=50), st.floats(1e-3, 1e6))
def test_columns_are_recovered_from_a_course(heights: list[float], width: float) -> None:
    assert columns_of(course_of(heights, width)) == (tuple(heights), width)
    moved = [(x, y) for x, y in course_of(heights, width)]
    moved[1] = (moved[1][0] + 0.1 * width / len(heights), moved[1][1])
    assert columns_of(moved) is None


def test_tanks_stand_on_level_ground() -> None:
    scene = loads(DUEL)
    heights = columns(scene)
    assert scene.play.game == "artillery"
    assert scene.terrain is not None
    assert scene.terrain.laid == scene.world.seed
    assert [box.name for box in scene.boxes] == ["Red", "Blue"]
    for box in scene.boxes:
        under = {h for k, h in enumerate(heights) if abs(2.0 * k + 1.0 - box.position[0]) <= 1.5 + 2.0}
        assert under == {box.position[1] - 0.75}
    assert scene.walls[0].friction == 0.5


def test_scene_survives_a_round_trip_and_overrides_change_it() -> None:
    scene = loads(DUEL)
    assert loads(dumps(scene)) == scene
    assert from_document(to_document(scene)) == scene
    other = loads(DUEL, overrides=["world.seed=6"])
    assert columns(other) != columns(scene)
    assert columns(loads(DUEL, overrides=["terrain.columns=50"])) != columns(scene)
    assert len(columns(loads(DUEL, overrides=["terrain.columns=50"]))) == 50
    moved = loads(DUEL, overrides=["artillery.player.Red.position=60", "wall.terrain.restitution=0.3"])
    assert moved.boxes[0].position[0] == 60.0
    assert moved.walls[0].restitution == 0.3


@pytest.mark.fail_slow(60)  # takes over half a second
@given(st.integers(0, 2**63 - 1))
def test_another_seed_rebuilds_the_hills_of_an_expanded_scene(seed: int) -> None:
    scene = loads(DUEL)
    assert with_seed(scene, seed) == loads(DUEL, overrides=[f"world.seed={seed}"])
    assert with_seed(with_seed(scene, seed), scene.world.seed) == scene


def test_another_seed_keeps_overrides() -> None:
    scene = loads(DUEL, overrides=["wall.terrain.restitution=0.3", "box.Red.position=[30.0, 90.0]"])
    other = with_seed(scene, 6)
    assert columns(other) == columns(loads(DUEL, overrides=["world.seed=6"]))
    assert other.walls[0].restitution == 0.3
    assert other.boxes[0].position == (30.0, 90.0)
    points = course_of([2.0] * 100, 200.0)
    flat = from_document(to_document(scene), "<scene>", [("wall.terrain.points", [list(each) for each in points])])
    assert columns(with_seed(flat, 6)) == (2.0,) * 100


def test_stated_heights_are_used_as_the_ground() -> None:
    given_heights = [3.0, 4.0, 5.0, 6.0] * 5
    text = DUEL.replace("columns = 100\nbase = 8.0\nheight = 30.0", f"heights = {given_heights}")
    text = text.replace("tank", "").replace("position = 30.0", "position = 25.0")
    heights = columns(loads(text))
    assert [h for k, h in enumerate(heights) if k not in (1, 2, 3, 16, 17, 18)] == [
        h for k, h in enumerate(given_heights) if k not in (1, 2, 3, 16, 17, 18)
    ]


@pytest.mark.parametrize(
    ("change", "path", "words"),
    [
        (("position = 30.0", "position = 199.5"), "artillery.player.Red.position", "between 1.5 and 198.5 m"),
        (("position = 170.0", "position = 32.9"), "artillery.player.Blue.position", "is too near 'Red'"),
        (("width = 200.0", "width = 200.0\nheights = [1.0, 2.0]"), "terrain.heights", "combined with `columns`"),
        (('name = "Blue"', 'name = "Red"'), "artillery.player.Red.name", "names must be unique"),
        (("[artillery]", "[artillery]\nwind = 5.0"), "artillery.wind", "world.linear_drag"),
        (("columns = 100", "columns = 1"), "terrain.columns", "must be between 2 and 5000"),
    ],
)
def test_faults_have_path_and_line(change: tuple[str, str], path: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        loads(DUEL.replace(*change), "duel.toml")
    faults = [(fault.path, fault.message) for fault in caught.value.faults]
    assert any(found == path and words in message for found, message in faults), faults
    assert all(fault.line is not None for fault in caught.value.faults)


def test_players_need_ground_made_of_columns() -> None:
    without_terrain = DUEL[DUEL.index("[artillery]") :]
    with pytest.raises(SceneError, match=r"add a \[terrain\]"):
        loads(without_terrain)
    wall = '[[wall]]\nname = "terrain"\npoints = [[0.0, 1.0], [50.0, 1.0], [60.0, 2.0], [200.0, 2.0]]\n'
    with pytest.raises(SceneError, match="columns of equal width"):
        loads(wall + without_terrain)
    even = str([list(point) for point in course_of([4.0] * 40, 200.0)])
    assert loads(f'[[wall]]\nname = "terrain"\npoints = {even}\n' + without_terrain).boxes[0].position == (30.0, 4.75)
    with pytest.raises(SceneError, match="remove one of the two"):
        loads(DUEL + wall)


def test_settled_heights_are_nearest_quanta_and_not_negative() -> None:
    assert settled(1.0) == 1.0
    assert settled(-3.0) == 0.0
    assert abs(settled(0.1) - 0.1) <= QUANTUM / 2
