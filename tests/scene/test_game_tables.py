"""Tables of games in a scene: lazy import, values, round trip and faults."""

import copy
import pickle
import subprocess
import sys

import pytest

from sandbox.games.artillery.scene import Artillery, Terrain
from sandbox.games.billiards.tables import Billiards
from sandbox.games.curling.scene import CurlingMatch
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.game_tables import GAME_TABLES, PRESETS, game_table, lazy_table, table_of
from sandbox.scene.description.play import Play
from sandbox.scene.errors import PartError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import dumps, from_document, load, loads
from sandbox.scene.files.presets import Preset
from tests.scene.faults import faults_of

LIST_GAME_MODULES = """
import sys
from sandbox.scene.files.load import load
scene = load(sys.argv[1])
scene.bodies
print(*sorted(name for name in sys.modules if name.startswith("sandbox.games.")))
"""


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    ("scene", "folders"),
    [
        ("tutorial/bounce", set()), ("games/landing", set()), ("billiards/9-ball", {"billiards"}),
        ("pinball/classic", {"pinball"}), ("artillery/duel", {"artillery"}), ("games/curling", {"curling"}),
    ],
)  # fmt: skip
def test_scene_imports_only_the_games_of_its_tables(scene: str, folders: set[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LIST_GAME_MODULES, scene], capture_output=True, text=True, check=True, timeout=120
    )
    modules = set(done.stdout.split()) - {"sandbox.game_names"}
    assert {
        module.split(".")[2] for module in modules if module.count(".") > 2
    } == folders  # of other games only the spec is imported
    assert not [module for module in modules if module.endswith(("rules", "bot", "hand", "registry"))]


@pytest.mark.parametrize("heading", GAME_TABLES)
def test_every_table_is_a_lazy_field_with_its_model(heading: str) -> None:
    parent, _, key = heading.rpartition(".")
    table, field = game_table(heading), (Play if parent else Scene).model_fields[key]
    lazy = lazy_table(field)
    assert lazy.model is table.model
    assert isinstance(table, Preset) == (heading in PRESETS)
    assert table.about


def test_table_of_finds_a_table_by_its_model() -> None:
    scene = load("artillery/duel")
    artillery, terrain = table_of(scene, Artillery), table_of(scene, Terrain)
    assert [player.name for player in artillery.players] == [box.name for box in scene.boxes]
    assert terrain is not None
    assert table_of(scene, Billiards) is None
    assert table_of(scene.play, CurlingMatch) is None
    assert table_of(load("games/curling").play, CurlingMatch) is not None


@pytest.mark.parametrize("name", ["artillery/duel", "games/curling"])
def test_scene_with_tables_is_copied_pickled_and_hashed_by_value(name: str) -> None:
    scene = load(name)
    for copied in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene), scene.model_copy(deep=True)):
        assert copied == scene
        assert hash(copied) == hash(scene)
    assert loads(dumps(scene)) == scene
    assert from_document(to_document(scene)) == scene


def test_scene_accepts_tables_as_models_and_as_dicts() -> None:
    scene = Scene(billiards={"table": "pool-9ft"})
    assert table_of(scene, Billiards) == Billiards(table="pool-9ft")
    assert scene == Scene(billiards=Billiards(table="pool-9ft")) != Scene()
    assert table_of(scene.model_copy(update={"billiards": None}), Billiards) is None
    with pytest.raises(PartError, match=r"billiards\.tabel"):
        Scene(billiards={"tabel": "pool-9ft"})


@pytest.mark.parametrize(
    ("text", "fault"),  # the line, the path, a part of the message
    [
        ("[billiards]\ntabel = 'x'", "2: billiards.tabel: 'table'"),
        ("[billiards]\ntable = 'pool-9ft'\ngap = 1.0", "3: billiards.gap: is 1"),
        ("[terrain]\nbase = 1.0", "1: terrain.width: missing"),
        ("billiards = 3", "1: billiards: must be a table"),
        ("[play.curling]\nends = 0", "2: play.curling.ends: is 0"),
        (
            "[pinball]\n[[pinball.slingshot]]\npoints = [[0.0, 0.0], [1.0, 0.0]]",
            "3: pinball.slingshot[0].points: has 2",
        ),
        ("[pinball]\n[billiards]", "1: pinball: cannot be combined with [billiards]"),
    ],
)
def test_fault_in_a_table_has_its_line_and_path(text: str, fault: str) -> None:
    line, path, part = fault.split(": ", 2)
    assert any((str(each.line), each.path) == (line, path) and part in each.message for each in faults_of(text))
