"""Saved shots of pooltool (.json) as billiards scenes.

A saved shot is a `System` of pooltool 0.5 or later, as `System.save("shot.json")` writes it: table, cue and balls in SI
units, and the angles of the cue in degrees. Its coordinates are those of a scene: x along the width of the table, y
along its length. The balls of the scene are in the first state of the recorded motion, or in their present state if
there is none.

Sources: the classes of pooltool 0.6 (Kiefl, doi 10.21105/joss.07301). Both programs use the stroke of Alciatore TP A.30
and A.31, the friction of balls of TP A.14, and the same laws of sliding, rolling and spinning.
"""

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from sandbox.echo import MAX_NAMED, printable, short_repr, shorten
from sandbox.games.billiards.scene import BALL_MATERIAL, DURATION, SUBSTEPS
from sandbox.games.billiards.tables import BALLS, CUSHION_MATERIAL
from sandbox.levels.builder import ImportedLevel
from sandbox.levels.safe_json import JsonNode, parse_json, read_json
from sandbox.levels.scene_text import LevelBlock, LevelElement, clean_text, compose_scene, table_lines, toml_text
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import END_MASS, MISCUE, squirt_angle
from sandbox.scene.errors import Fault

POCKETED = 4
"""Motion state of a ball in a pocket."""
MAX_LENGTH = 1e3
"""m, largest coordinate"""
MAX_RATE = 1e6
"""largest speed, m/s, and angular velocity, rad/s"""
MAX_DURATION = 1e4
"""s, longest recorded motion"""

_SAME_HEIGHT = 1e-9
"""m: rounding of the height of a ball's centre"""
_SAME_ANGLE = 1e-9
"""rad: rounding of angles"""
_SHARED = ("u_s", "u_r", "u_sp_proportionality", "e_b", "e_c", "f_c", "g")
"""Parameters that pooltool keeps for each ball, and a scene once."""
_KNOWN_PARAMS = frozenset((*_SHARED, "m", "R", "u_b"))
_KNOWN_CUE = frozenset({"id", "V0", "phi", "theta", "a", "b", "cue_ball_id", "specs"})

_COLOURS = {name.partition("-")[0]: colour for kind in BALLS.values() for name, colour in kind.colours.items()}
"""Colours of balls by name; pooltool numbers the reds of snooker `red_01` and so on."""


class BallParams(NamedTuple):
    """Parameters of a ball."""

    mass: float
    """kg"""
    radius: float
    """m"""
    shared: tuple[float, ...]
    """values of `_SHARED`"""


class Cue(NamedTuple):
    """Cue and stroke."""

    speed: float
    """speed of the cue, m/s"""
    aim: float
    """direction, rad from +x"""
    elevation: float
    """angle with the floor, rad"""
    side: float
    """offset of the tip to the right as a fraction of the ball's radius"""
    height: float
    """offset of the tip upwards as a fraction of the ball's radius"""
    mass: float
    """kg"""
    end_mass: float
    """effective mass of the end that moves aside with the ball, kg"""

    @property
    def offset(self) -> float:
        """Distance of the tip from the centre as a fraction of the ball's radius."""
        return math.hypot(self.side, self.height)


def import_pooltool(source: str | Path) -> ImportedLevel:
    """Return a saved shot of pooltool as a scene.

    Args:
        source: path of the file, or its text.

    Returns:
        The scene, its text, and the warnings.

    Raises:
        SceneError: the file is no saved shot, or a value of it is missing or invalid; the error names its path.
    """
    is_text = isinstance(source, str) and "{" in source
    file = "<shot>" if is_text else str(source)
    root = parse_json(str(source), file) if is_text else read_json(Path(source), file)
    _refuse_others(root)
    return _Shot(root).imported("Shot" if is_text else Path(source).stem)


def _refuse_others(root: JsonNode) -> None:
    """Refuse a document that is no saved shot."""
    document = root.value
    if not isinstance(document, dict):
        root.refuse("is no saved shot of pooltool: it is not a JSON object")
    if "multisystem" in document:
        root.refuse('contains several shots; save one of them: multisystem[0].save("shot.json")')
    if "tilewidth" in document:
        root.refuse("is a map of Tiled in JSON; save it as .tmx")
    if "scene" in document and "actions" in document:
        root.refuse("is a recorded session; use `sandbox run`")
    if missing := [key for key in ("cue", "table", "balls") if key not in document]:
        root.refuse(f"is no saved shot of pooltool: it has no `{missing[0]}`")


class _Shot:
    """A saved shot while it is read."""

    def __init__(self, root: JsonNode) -> None:
        self._root = root
        self._file = root.file
        self._warnings: list[Fault] = []

    def imported(self, title: str) -> ImportedLevel:
        """Return the scene of the shot."""
        root = self._root
        balls = dict(root["balls"].members())
        cue_ball = root["cue"]["cue_ball_id"]
        if cue_ball.text() not in balls:
            cue_ball.refuse("is not the name of a ball")
        params = {name: self._params(node["params"]) for name, node in balls.items()}
        blocks = [*self._cushions(root["table"]), *self._balls(balls, params)]
        blocks += self._stroke(root["cue"], blocks, params[cue_ball.value])
        self._note_differences(balls, params, cue_ball.value)
        head = self._head(title, params[cue_ball.value])
        scene, text = compose_scene(head, blocks, self._file)
        return ImportedLevel(scene, text, tuple(self._warnings), Counter(block.table for block in blocks))

    def _warn(self, node: JsonNode, message: str) -> None:
        """Note a part of the shot that the scene has not, or only approximately."""
        self._warnings.append(Fault(self._file, None, node.path, message))

    def _params(self, node: JsonNode) -> BallParams:
        """Return the parameters of a ball."""
        for key, _ in node.members():
            if key not in _KNOWN_PARAMS:
                self._warn(node, f"{short_repr(key)} is unknown and has no effect")
        ranges = {"g": (1e-9, 1e9), "e_b": (0.0, 1.0), "e_c": (0.0, 1.0)}
        shared = tuple(node[key].number(*ranges.get(key, (0.0, 1000.0))) for key in _SHARED)
        return BallParams(node["m"].number(1e-15, 1e30), node["R"].number(1e-9, MAX_LENGTH), shared)

    def _head(self, title: str, params: BallParams) -> list[str]:
        """Return the lines of the scene before its named tables; `params` are those of the cue ball."""
        values = dict(zip(_SHARED, params.shared, strict=True))
        time = self._root.find("t")
        duration = 0.0 if time is None else time.number(0.0, MAX_DURATION)
        tables: list[tuple[str, dict[str, Any]]] = [
            ("[world]", {"duration": max(DURATION, float(math.ceil(duration)))}),
            ("[solver]", {"dt": 0.01, "substeps": SUBSTEPS}),
            (
                "[surface]",
                {
                    "gravity": values["g"],
                    "sliding_friction": values["u_s"],
                    "rolling_friction": values["u_r"],
                    "spinning_friction": values["u_sp_proportionality"] * params.radius,
                },
            ),
            ("[contact_models]", {"ball_ball": "frictional", "cushion": "han2005"}),
            ("[[material]]", {"name": BALL_MATERIAL}),
            ("[[material]]", {"name": CUSHION_MATERIAL}),
            ("[[pair]]", {"between": (BALL_MATERIAL, BALL_MATERIAL), "restitution": values["e_b"]}),
            (
                "[[pair]]",
                {"between": (BALL_MATERIAL, CUSHION_MATERIAL), "restitution": values["e_c"], "friction": values["f_c"]},
            ),
        ]
        if (area := self._area()) is not None:
            tables.append(("[play]", {"area": area}))
        file = shorten(printable(self._file), MAX_NAMED)
        lines = [
            f"# Imported from {file}, a saved shot of pooltool, by `sandbox import`.",
            "",
            f"title = {toml_text(clean_text(title)[:200])}",
        ]
        for heading, table in tables:
            lines += ["", heading, *table_lines(table)]
        return lines

    def _area(self) -> tuple[Point, Point] | None:
        """Return the corners of the playing area, m, between the cushions 3, 12, 18 and 9; None if one is missing.

        These are the names of the left, right, lower and upper cushion on every standard table of pooltool.
        """
        linear = self._root["table"]["cushion_segments"]["linear"]
        names = ("3", "18", "12", "9")
        if any(linear.find(name) is None for name in names):
            return None
        left, lower, right, upper = (linear[name]["p1"].vector(MAX_LENGTH)[k % 2] for k, name in enumerate(names))
        return ((left, lower), (right, upper)) if left < right and lower < upper else None

    def _cushions(self, table: JsonNode) -> Iterator[LevelBlock]:
        """Yield the cushions, the jaws of the pockets and the pockets of a table."""
        for name, node in table["cushion_segments"]["linear"].members():
            (ax, ay, height), (bx, by, other) = (node[key].vector(MAX_LENGTH) for key in ("p1", "p2"))
            if height != other:
                node["p2"].refuse(f"has the height {other:g} m, and p1 {height:g} m; a cushion has one height")
            values = {"points": ((ax, ay), (bx, by)), "height": height, "material": CUSHION_MATERIAL}
            yield _block("wall", f"cushion {name}", values, node)
        for name, node in table["cushion_segments"]["circular"].members():
            x, y, height = node["center"].vector(MAX_LENGTH)
            radius = node["radius"].number(1e-9, MAX_LENGTH)
            values = {"position": (x, y), "radius": radius, "height": height, "material": CUSHION_MATERIAL}
            yield _block("post", f"jaw {name}", values, node)
        for name, node in table["pockets"].members():
            x, y, _ = node["center"].vector(MAX_LENGTH)
            values = {"position": (x, y), "radius": node["radius"].number(1e-9, MAX_LENGTH)}
            yield _block("pocket", f"pocket {name}", values, node)

    def _balls(self, balls: dict[str, JsonNode], params: dict[str, BallParams]) -> Iterator[LevelBlock]:
        """Yield the balls that are on the table at the start."""
        for name, node in balls.items():
            state = self._first_state(node)
            if state["s"].value == POCKETED:
                self._warn(node, "is in a pocket at the start, and is left out")
                continue
            rows = state["rvw"].elements(3)
            x, y, z = rows[0].vector(MAX_LENGTH)
            (vx, vy, vz), spin = rows[1].vector(MAX_RATE), rows[2].vector(MAX_RATE)
            mass, radius, _ = params[name]
            if abs(z - radius) > _SAME_HEIGHT or vz:
                self._warn(
                    node, f"is in the air: its height, {z - radius:g} m, and velocity upwards, {vz:g} m/s, are 0"
                )
            values: dict[str, Any] = {"position": (x, y)}
            values |= {"velocity": (vx, vy)} if vx or vy else {}
            values |= {"spin": spin} if any(spin) else {}
            values |= {"radius": radius, "mass": mass, "material": BALL_MATERIAL}
            colour = _COLOURS.get(name.partition("_")[0])
            yield _block("ball", name, values | ({"colour": colour} if colour else {}), node)

    def _first_state(self, ball: JsonNode) -> JsonNode:
        """Return the first state of the recorded motion of a ball, or its present state if there is none."""
        history = ball.find("history")
        states = [] if history is None else history["states"].elements()
        return states[0] if states else ball["state"]

    def _cue(self, node: JsonNode) -> Cue:
        """Return the cue and its stroke."""
        for key, _ in node.members():
            if key not in _KNOWN_CUE:
                self._warn(node, f"{short_repr(key)} is unknown and has no effect")
        specs = node["specs"]
        end_mass = specs.find("end_mass")
        if end_mass is None:
            specs.refuse("has no end_mass; save the shot with pooltool 0.5 or later")
        cue = Cue(
            speed=node["V0"].number(0.0, 100.0),
            aim=math.radians(node["phi"].number(-1e6, 1e6)),
            elevation=math.radians(node["theta"].number(-90.0, 90.0)),
            side=0.0 - node["a"].number(-1.0, 1.0),  # 0 − 0 is 0, and −0 would be printed
            height=node["b"].number(-1.0, 1.0),
            mass=specs["M"].number(1e-15, 1e30),
            end_mass=end_mass.number(1e-15, 1e30),
        )
        if cue.offset >= 1.0:
            node.refuse("a² + b² must be less than 1, otherwise the tip misses the ball")
        return cue

    def _stroke(self, node: JsonNode, blocks: list[LevelBlock], params: BallParams) -> list[LevelBlock]:
        """Return the `[[shot]]` of the cue.

        A stroke that a shot cannot state gives the cue ball its velocity and spin instead, and there is no shot. Balls
        that move at the start are not struck, as in pooltool.
        """
        cue = self._cue(node)
        if cue.speed == 0.0:
            return []
        balls = {block.values["name"]: block.values for block in blocks if block.table == "ball"}
        if any("velocity" in ball or "spin" in ball for ball in balls.values()):
            self._warn(node, "does not strike, as in pooltool, because balls move at the start")
            return []
        name = node["cue_ball_id"].value
        if name not in balls:
            self._warn(node, "does not strike, because its ball is in a pocket")
            return []
        if cue.elevation == 0.0 and cue.offset <= MISCUE:
            return [_block("shot", "stroke", {"ball": name, **self._shot_values(node, cue, params)}, node)]
        balls[name] |= _state_after(cue, params)
        reason = "is elevated" if cue.elevation else f"strikes more than {MISCUE:g} R off the centre"
        self._warn(node, f"{reason}, which no [[shot]] states: the ball has the velocity and spin after the stroke")
        return []

    def _shot_values(self, node: JsonNode, cue: Cue, params: BallParams) -> dict[str, float]:
        """Return the values of a `[[shot]]` after which the ball has the direction that it has in pooltool."""
        squirt, own_squirt = squirt_angle(cue.side, cue.end_mass / params.mass), squirt_angle(cue.side)
        aim = cue.aim
        if abs(own_squirt - squirt) > _SAME_ANGLE:
            aim += own_squirt - squirt
            self._warn(
                node["specs"]["end_mass"],
                f"is {cue.end_mass / params.mass:.4g} of the ball's mass, and that of a scene {END_MASS:.4g}: the aim "
                f"is turned by {math.degrees(own_squirt - squirt):.2g}°, for the same direction of the ball",
            )
        if cue.side and cue.height:
            angle = abs(math.degrees(own_squirt))
            self._warn(node, f"follow and draw are about an axis that is {angle:.2g}° from pooltool's, due to squirt")
        return {"aim": aim, "speed": cue.speed, "side": cue.side, "height": cue.height, "cue_mass": cue.mass}

    def _note_differences(self, balls: dict[str, JsonNode], params: dict[str, BallParams], cue_ball: str) -> None:
        """Warn of what a shot does not state, and of what a scene does not have."""
        own = params[cue_ball].shared
        for name, node in balls.items():
            for key, value, used in zip(_SHARED, params[name].shared, own, strict=True):
                if value != used:
                    self._warn(node["params"][key], f"is {value:g}; the scene has that of the cue ball, {used:g}")
        self._warn(
            self._root,
            'a shot does not state its collision models: the scene has "frictional" balls, as pooltool by default, and '
            '"han2005" cushions, which differ from its default',
        )
        events = self._root.find("events")
        if events is not None and events.elements():
            self._warn(events, "the recorded motion and its events are not imported")


def _state_after(cue: Cue, params: BallParams) -> dict[str, tuple[float, ...]]:
    """Return the velocity, m/s, and spin, rad/s, of a ball directly after a stroke, also of an elevated cue.

    The offsets are those of the tip in a plane across the cue. The vertical velocity is lost to the floor.
    """
    speed = 2.0 * cue.speed / (1.0 + params.mass / cue.mass + 2.5 * cue.offset**2)
    heading = cue.aim - squirt_angle(cue.side, cue.end_mass / params.mass)
    level = speed * math.cos(cue.elevation)
    rate = speed / (0.4 * params.radius)
    follow, side = rate * cue.height, rate * cue.side * math.cos(cue.elevation)
    curve = rate * cue.side * math.sin(cue.elevation)  # about the direction of the cue, which makes the path a curve
    cos, sin = math.cos(cue.aim), math.sin(cue.aim)
    return {
        "velocity": (level * math.cos(heading), level * math.sin(heading)),
        "spin": (curve * cos - follow * sin, curve * sin + follow * cos, side),
    }


def _block(table: str, name: str, values: dict[str, Any], node: JsonNode) -> LevelBlock:
    return LevelBlock(table, {"name": name, **values}, LevelElement(node.path, None))
