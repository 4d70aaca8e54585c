"""`[billiards]` of a scene file: its expansion, elements that override it, and faults."""

from typing import Any, get_args

import numpy as np
import pytest

from sandbox.games.billiards.rules.registry import RULESETS
from sandbox.games.billiards.scene import RACKS, expanded
from sandbox.games.billiards.tables import BALLS, Billiards, TableGame
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads
from tests.toml_text import toml

EIGHT: dict[str, Any] = {"billiards": {"table": "pool-9ft", "game": "8-ball"}}
SHOT = {"name": "break", "aim": 1.5, "speed": 8.0}
TABLES = [
    ("pool-7ft", "8-ball"),
    ("pool-8ft", "9-ball"),
    ("pool-9ft", "8-ball"),
    ("snooker-12ft", "snooker"),
    ("carom-10ft", "three-cushion"),
]

TEXT = (
    toml(title="Eight")
    + toml("billiards", table="pool-9ft", game="8-ball")
    + toml("shot", name="break", aim=1.5, speed=8.0)
)


@pytest.mark.parametrize(("table", "game"), TABLES)
def test_preset_expands_to_a_scene_of_primitives(table: str, game: str) -> None:
    scene = from_document({"billiards": {"table": table, "game": game}})
    assert scene.billiards is None
    assert scene.surface is not None
    assert scene.contact_models.ball_ball == "frictional"
    assert scene.contact_models.cushion == "han2005"
    assert (len(scene.walls), len(scene.posts), len(scene.pockets)) in {(18, 12, 6), (14, 12, 6), (4, 0, 0)}
    assert scene.play.game == game
    assert scene.play.area is not None
    assert loads(dumps(scene)) == scene


def test_rules_of_every_game_match_its_rack() -> None:
    assert set(RULESETS) == set(get_args(TableGame)) == set(RACKS)
    for name, rules in RULESETS.items():
        if name != "free":
            assert rules.rack == RACKS[name]  # type: ignore[index]


def test_balls_have_the_size_and_mass_of_their_set() -> None:
    for table, game, kind in (("pool-9ft", "8-ball", "pool"), ("snooker-12ft", "snooker", "snooker")):
        scene = from_document({"billiards": {"table": table, "game": game}})
        assert [ball.name for ball in scene.balls] == list(BALLS[kind].colours)
        assert {ball.radius for ball in scene.balls} == {BALLS[kind].radius}
        assert {ball.mass for ball in scene.balls} == {BALLS[kind].mass}
    assert BALLS["pool"].radius == pytest.approx(2.25 * 0.0254 / 2.0, abs=1e-12)  # WPA: 2.25 in
    assert BALLS["snooker"].radius == 0.0525 / 2.0  # WPBSA: 52.5 mm
    assert 0.061 <= 2.0 * BALLS["carom"].radius <= 0.0615  # UMB
    assert 0.205 <= BALLS["carom"].mass <= 0.22


def test_parameters_of_balls_and_cushions_default_to_the_set() -> None:
    more = {"ball_radius": 0.03, "ball_mass": 0.2, "ball_restitution": 0.9, "cushion_friction": 0.1, "nose": 0.04}
    scene = from_document({"billiards": {**EIGHT["billiards"], **more}})
    assert {(ball.radius, ball.mass) for ball in scene.balls} == {(0.03, 0.2)}
    assert [(pair.restitution, pair.friction) for pair in scene.pairs] == [(0.9, None), (0.85, 0.1)]
    assert {wall.height for wall in scene.walls} == {0.04}
    plain = from_document(EIGHT)
    assert plain.surface is not None
    # 64 % of the diameter, within what WPA allows; 0.444 R
    assert {wall.height for wall in plain.walls} == {0.64 * 0.05715}
    assert plain.surface.spinning_friction == pytest.approx(0.444 * 0.028575, rel=1e-15)
    carom = from_document({"billiards": {"table": "carom-10ft"}})
    assert {wall.height for wall in carom.walls} == {0.037}


def test_elements_of_the_scene_override_the_preset() -> None:
    document = {
        **EIGHT,
        "world": {"duration": 3.0},
        "surface": {"rolling_friction": 0.02},
        "contact_models": {"cushion": "simple"},
        "play": {"game": "free"},
        "pair": [{"between": ["cushion", "phenolic"], "restitution": 0.7}],
        "material": [{"name": "cushion"}, {"name": "phenolic"}],
        "ball": [{"name": "cue", "position": [0.3, 0.3], "radius": 0.03}],
        "pocket": [{"name": "left pocket", "position": [-0.1, 1.27], "radius": 0.05}],
    }
    scene = from_document(document)
    assert scene.world.duration == 3.0
    assert scene.surface is not None
    assert (scene.surface.rolling_friction, scene.surface.sliding_friction) == (0.02, 0.2)
    assert (scene.contact_models.cushion, scene.contact_models.ball_ball) == ("simple", "frictional")
    assert scene.play.game == "free"
    assert [pair.restitution for pair in scene.pairs] == [0.7, 0.95]
    assert (scene.balls[0].name, scene.balls[0].radius, len(scene.balls)) == ("cue", 0.03, 16)
    assert (scene.pockets[0].radius, len(scene.pockets)) == (0.05, 6)


def test_balls_are_placed_by_name() -> None:
    scene = from_document({"billiards": {**EIGHT["billiards"], "place": {"cue": [0.4, 0.5], "8": [0.6, 0.6]}}})
    positions = {ball.name: ball.position for ball in scene.balls}
    assert (positions["cue"], positions["8"], len(positions)) == ((0.4, 0.5), (0.6, 0.6), 16)
    scene = from_document({"billiards": {"table": "pool-9ft", "place": {"cue": [0.4, 0.5], "3": [0.6, 0.6]}}})
    assert [ball.name for ball in scene.balls] == ["cue", "3"]
    assert len({ball.colour for ball in scene.balls}) == 2


def test_rack_is_placed_on_a_custom_table_by_its_spots() -> None:
    spots = [{"name": "head", "position": [-1.0, 0.0]}, {"name": "foot", "position": [1.0, 0.0]}]
    wall = {"points": [[-2, -1], [2, -1], [2, 1], [-2, 1]], "closed": True, "height": 0.037, "material": "cushion"}
    scene = from_document({"billiards": {"game": "9-ball", "gap": 0.0}, "play": {"spot": spots}, "wall": [wall]})
    positions = {str(ball.name): np.asarray(ball.position) for ball in scene.balls}
    assert positions["1"] == pytest.approx([1.0, 0.0])
    assert positions["9"] - positions["1"] == pytest.approx([2.0 * 0.05715 * np.sqrt(0.75), 0.0])  # two rows, along x
    assert (len(scene.walls), scene.play.area) == (1, None)
    assert loads(dumps(scene)) == scene


def test_overrides_apply_to_the_preset_and_its_expansion() -> None:
    sets = [
        "ball.cue.velocity=[0.5, 1.0]",
        "shot.break.aim=1.4",
        "billiards.gap=0.0",
        "world.seed=7",
        "ball.*.mass=0.16",
        "surface.rolling_friction=0.02",
        "play.spot.foot.position=[0.6, 1.9]",
    ]
    scene = loads(TEXT, overrides=sets)
    plain = loads(TEXT, overrides=["world.seed=7", "billiards.gap=0.0"])
    assert scene.balls[0].velocity == (0.5, 1.0)
    assert scene.shots[0].aim == 1.4
    assert {ball.mass for ball in scene.balls} == {0.16}
    assert [ball.position for ball in scene.balls] == [ball.position for ball in plain.balls]
    assert scene.surface is not None
    assert scene.surface.rolling_friction == 0.02
    assert {spot.name: spot.position for spot in scene.play.spots}["foot"] == (0.6, 1.9)
    assert [b.position for b in loads(TEXT, overrides=["world.seed=8"]).balls] != [b.position for b in plain.balls]


def test_override_adds_a_preset_or_corrects_it() -> None:
    scene = from_document({}, overrides=["billiards.game=9-ball", "billiards.table=pool-8ft"])
    assert len(scene.balls) == 10
    faulty = TEXT.replace("pool-9ft", "pool-10ft").replace("speed = 8.0", "speed = -8.0")
    sets = ["shot.break.speed=8.0", "billiards.table=pool-9ft", "ball.cue.velocity=[0.1, 0.0]"]
    assert loads(faulty, overrides=sets).balls[0].velocity == (0.1, 0.0)


@pytest.mark.parametrize(
    ("document", "path", "words"),
    [
        ({"billiards": {"table": "pool-10ft"}}, "billiards.table", "one of"),
        ({"billiards": {"tables": "pool-9ft"}}, "billiards.tables", "did you mean 'table'?"),
        ({"billiards": {"table": "pool-9ft", "game": "snooker"}}, "billiards.game", "cannot be racked on pool-9ft"),
        ({"billiards": {"table": "snooker-12ft", "rack": "8-ball"}}, "billiards.rack", "'head', 'foot'"),
        ({"billiards": {"game": "8-ball"}}, "billiards.game", "[[play.spot]]"),
        ({"billiards": {**EIGHT["billiards"], "gap": -1}}, "billiards.gap", "must be between 0 and 0.1"),
        ({"billiards": {**EIGHT["billiards"], "place": {"16": [0, 0]}}}, "billiards.place.16", "not a ball of the set"),
        ({**EIGHT, "shot": [{**SHOT, "ball": "queue"}]}, "shot.break.ball", "no body is named 'queue'"),
        ({**EIGHT, "play": {"arrows": "9 ball"}}, "play.arrows", "no body"),
        ({**EIGHT, "play": {"area": [[1, 0], [0, 1]]}}, "play.area", "upper right corner"),
        ({"ball": [], "play": {"spot": 2 * [{"name": "foot", "position": [0, 0]}]}}, "play.spot.foot.name", "unique"),
        ({**EIGHT, "wall": [{"name": "cue", "points": [[5, 0], [6, 0]], "height": 0.03}]}, "wall.cue.name", "unique"),
    ],
)
def test_faults_have_their_path(document: dict[str, Any], path: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        from_document(document)
    (fault,) = caught.value.faults
    assert fault.path == path
    assert words in fault.message


def test_faults_of_expanded_elements_point_at_the_preset() -> None:
    with pytest.raises(SceneError) as caught:
        loads(TEXT + "\n[world]\nbounds = [[0.0, 0.0], [1.0, 1.0]]\n", "eight.toml")
    faults = caught.value.faults
    assert len(faults) == 15  # the rack lies outside the bounds, the cue ball inside
    assert {fault.line for fault in faults} == {2}
    assert "ball.8" in {fault.path for fault in faults}


def test_every_fault_beside_a_preset_is_reported() -> None:
    document = {**EIGHT, "shot": [SHOT, {**SHOT, "name": "again", "ball": "17"}], "world": {"duration": -1}}
    with pytest.raises(SceneError) as caught:
        from_document(document)
    assert {fault.path for fault in caught.value.faults} == {"world.duration", "shot.again.ball"}


def test_faults_of_the_preset_precede_those_of_overrides_of_its_elements() -> None:
    with pytest.raises(SceneError) as caught:
        from_document({"billiards": {"table": "pool"}}, overrides=["ball.cue.mass=0.2"])
    assert [fault.path for fault in caught.value.faults] == ["billiards.table"]
    with pytest.raises(SceneError, match="no element 'queue'"):
        from_document(EIGHT, overrides=["ball.queue.mass=0.2"])


def test_scene_built_in_python_has_no_bodies_before_its_preset_is_expanded() -> None:
    scene = Scene(billiards=Billiards(table="carom-10ft", game="straight-rail"))
    with pytest.raises(ValueError, match="is not expanded"):
        _ = scene.bodies
    assert len(expanded(scene).bodies) == 3
