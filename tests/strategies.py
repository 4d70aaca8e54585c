"""Hypothesis strategies: valid scene documents as parsed from TOML, and TOML texts of them."""

import json
import math
import random
from functools import cache
from typing import Any

from hypothesis import strategies as st

from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Location
from sandbox.scene.files.load import from_document

Document = dict[str, Any]


NAMEABLE = ("plane", "wall", "post", "ball", "grid", "scatter", "emitter")
"""Keys of a document whose elements have names."""


@cache
def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Floats within bounds, and whole numbers as TOML integers."""
    floats = st.floats(low, high, allow_nan=False, allow_infinity=False)
    first, last = math.ceil(max(low, -(2**53))), math.floor(min(high, 2**53))
    return floats | st.integers(first, last) if first <= last else floats


@cache
def names() -> st.SearchStrategy[str]:
    """Names of bodies and materials: any text without control characters that cannot equal a default name."""
    letters = st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"], exclude_characters="-")
    return st.sampled_from(["cue", "8 ball", "a.b", "it's", 'say "hi"', "[x]", "#1", "=", "0"]) | st.text(
        letters, min_size=1, max_size=12
    ).filter(lambda name: name not in NAMEABLE)  # a grid "wall" has a ball "wall-1", the default name of a first wall


@cache
def pairs(low: float, high: float) -> st.SearchStrategy[list[float]]:
    """Arrays of two numbers."""
    return st.lists(numbers(low, high), min_size=2, max_size=2)


@cache
def _coefficients() -> Document:
    return {
        "restitution": numbers(0, 1),
        "friction": numbers(0, 1000),
    }


@cache
def _colours() -> st.SearchStrategy[str]:
    return st.from_regex("#[0-9a-fA-F]{6}", fullmatch=True)


@st.composite
def _elements(draw: st.DrawFn, required: Document, optional: Document, materials: list[str]) -> Document:
    optional = {
        **optional,
        **_coefficients(),
        "surface_speed": numbers(-10, 10),
        "surface_velocity": pairs(-10, 10),
        "colour": _colours(),
    }
    if materials:
        optional["material"] = st.sampled_from(materials)
    return dict(draw(st.fixed_dictionaries(required, optional=optional)))


@st.composite
def documents(draw: st.DrawFn, most: int = 2) -> Document:
    """Valid scene documents of up to `most` elements of each kind.

    With planes all coordinates are at most some hundred metres, so that no body starts far behind a plane; without,
    they reach 1e15 m.
    """
    document: Document = draw(
        st.fixed_dictionaries({}, optional={"title": st.text(max_size=20), "about": st.text(max_size=40)})
    )

    def elements_of(element: st.SearchStrategy[Document]) -> list[Document]:
        return draw(st.lists(element, max_size=most))

    materials = draw(st.lists(names(), unique=True, max_size=3))
    document["material"] = [
        {"name": name, **draw(st.fixed_dictionaries({}, optional=_coefficients()))} for name in materials
    ]
    if materials:
        sides = st.lists(st.sampled_from(materials), min_size=2, max_size=2)
        between = draw(st.lists(sides, max_size=3, unique_by=lambda two: frozenset(two)))
        document["pair"] = [
            {"between": two, **draw(st.fixed_dictionaries({}, optional=_coefficients()))} for two in between
        ]

    document["plane"] = elements_of(
        _elements({"point": pairs(-300, 300), "normal": pairs(-1e3, 1e3).filter(any_length)}, {}, materials)
    )
    far = 300.0 if document["plane"] else 1e15
    corners = st.lists(st.tuples(st.integers(-99, 99), st.integers(-99, 99)), min_size=3, max_size=5, unique=True)
    points = corners.map(lambda rows: [[x * 0.25, y * 0.25] for x, y in rows])
    document["wall"] = elements_of(
        _elements({"points": points}, {"thickness": numbers(0, 10), "closed": st.booleans()}, materials)
    )
    document["post"] = elements_of(
        _elements({"position": pairs(-far, far), "radius": numbers(1e-9, 1e9)}, {}, materials)
    )

    disc = {
        "angle": numbers(-1e12, 1e12),
        "collides": st.sampled_from(["all", "fixed", "none"]),
    }
    spin = {"angular_velocity": numbers(-1e12, 1e12)}
    speed = 7e11  # m/s in each component: 1e12 / √2, rounded down
    heavy = {"mass": numbers(1e-15, 1e30)}
    dense = {"density": numbers(1e-6, 1e6)}  # with the small radii below, masses of 3e-10 … 3e4 kg
    small = numbers(1e-2, 0.1)
    ball = {"position": pairs(-far, far), "radius": numbers(1e-9, 1e9)}
    moving = {"velocity": pairs(-speed, speed)}
    document["ball"] = elements_of(
        _elements(ball, {**disc, **spin, **moving, **heavy}, materials)
        | _elements({**ball, "radius": small, **dense}, {**disc, **spin, **moving}, materials)
        | _elements({**ball, "fixed": st.just(True)}, {**disc, **heavy}, materials)
    )
    grid = {
        "origin": pairs(-100, 100),
        "columns": st.integers(1, 4),
        "spacing": pairs(-10, 10),
        "radius": small,
    }
    jitter = {"jitter": numbers(0, 1), "velocity_jitter": numbers(0, 1e11), "rows": st.integers(1, 3)}
    document["grid"] = elements_of(_elements(grid, {**disc, **spin, **jitter, **heavy}, materials))
    scatter = {
        "count": st.integers(1, 6),
        "lower": pairs(-100, 0),
        "upper": pairs(3, 100),
        "radius": small,
    }
    document["scatter"] = elements_of(_elements(scatter, {**disc, **spin, **dense}, materials))
    emitter = {
        "position": pairs(-100, 100),
        "count": st.integers(1, 6),
        "velocity_min": pairs(-speed, 0),
        "velocity_max": pairs(0, speed),
    }
    document["emitter"] = elements_of(_elements(emitter, {**disc, **spin, **heavy}, materials))

    elements = [element for kind in NAMEABLE for element in document[kind]]
    drawn_names = draw(
        st.lists(st.none() | names(), min_size=len(elements), max_size=len(elements), unique_by=_unless_none())
    )
    for element, name in zip(elements, drawn_names, strict=True):
        if name is not None:
            element["name"] = name
    document["world"] = draw(
        st.fixed_dictionaries(
            {},
            optional={
                "gravity": pairs(-1e9, 1e9),
                "duration": numbers(1e-9, 999),
                "seed": st.integers(0, 2**63 - 1),
                "linear_drag": numbers(0, 1e9),
                "quadratic_drag": numbers(0, 1e9),
                "damping": numbers(1e-9, 1),
                "wind": pairs(-speed, speed),
                "bounds": st.just([[-1e16, -1e16], [1e16, 1e16]]),
            },
        )
    )
    if document["world"].keys() & {"linear_drag", "quadratic_drag"}:
        document["world"].pop("damping", None)  # pymunk does not model both
    document["solver"] = draw(
        st.fixed_dictionaries(
            {},
            optional={
                "dt": numbers(1e-4, 10),
                "substeps": st.integers(1, 100),
                "iterations": st.integers(1, 10_000),
                "slop": numbers(0, 1e9),
                "bias": numbers(0, 1),
                "persistence": st.integers(1, 1000),
                "half_kick": st.booleans(),
                "integrator": st.sampled_from(
                    ["explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"]
                ),
                "detection": st.sampled_from(["discrete", "bisect", "swept", "shrink"]),
                "response": st.sampled_from(["impulse", "penalty"]),
                "broad_phase": st.sampled_from(["all_pairs", "circles", "sweep", "grid", "oriented"]),
                "record_every": st.integers(1, 10**9),
            },
        )
    )
    filled = {key: value for key, value in document.items() if value not in ([], {})}
    return filled or {"title": ""}


OUTLINES = (
    [[0, 0], [1, 0], [0, 1]],
    [[0, 0], [0, 1], [1, 1], [1, 0]],
    [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]],
    [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]],
)
"""Clockwise and counterclockwise, convex and concave outlines."""


@st.composite
def solids(draw: st.DrawFn) -> Document:
    """Tables of named boxes, capsules, polygons and compound bodies, of their joints and of forces on them."""
    size, position = numbers(1e-3, 3), pairs(-100, 100)
    shape: dict[str, Document] = {
        "ball": {"radius": size},
        "box": {"size": st.lists(size, min_size=2, max_size=2)},
        "capsule": {"length": size, "radius": size},
        "polygon": {"points": st.sampled_from(OUTLINES)},
    }
    part = {**_coefficients(), "colour": _colours(), "density": numbers(1e-3, 1e3), "angle": numbers(-4, 4)}
    state = {"angle": numbers(-1e3, 1e3), "collides": st.sampled_from(["all", "fixed", "none"]), **_coefficients()}
    moving = {"velocity": pairs(-10, 10), "angular_velocity": numbers(-10, 10), "mass": numbers(1e-2, 1e2)}
    document: Document = {}
    for kind in ("box", "capsule", "polygon"):
        either = st.fixed_dictionaries({"position": position, **shape[kind]}, optional={**state, **moving})
        fixed = st.fixed_dictionaries({"position": position, **shape[kind], "fixed": st.just(True)}, optional=state)
        document[kind] = draw(st.lists(either | fixed, max_size=2))
    parts = {
        kind: st.lists(st.fixed_dictionaries(keys, optional={**part, "position": pairs(-2, 2)}), min_size=1, max_size=2)
        for kind, keys in shape.items()
    }
    more = {kind: those for kind, those in parts.items() if kind != "box"}
    some = st.fixed_dictionaries({"position": position, "box": parts["box"]}, optional={**state, **moving, **more})
    document["body"] = draw(st.lists(some, max_size=2))
    names = []
    for kind, those in document.items():
        for k, each in enumerate(those):
            each["name"] = f"{kind} {k}"
            names += [] if each.get("fixed") else [each["name"]]
    if names:
        document["joint"] = draw(st.lists(_joints(names), max_size=4))
        document["thrust"] = draw(st.lists(_thrusts(names), max_size=2))
        toward = st.sampled_from(names) | position
        pull = st.fixed_dictionaries({"toward": toward, "strength": numbers(-10, 10)}, optional={"softening": size})
        document["attraction"] = draw(st.lists(pull, max_size=2))
    return {kind: those for kind, those in document.items() if those}


@st.composite
def _joints(draw: st.DrawFn, names: list[str]) -> Document:
    """A joint of movable bodies, valid for any of them."""
    point, coefficient = pairs(-3, 3), numbers(1e-3, 10)
    kinds: dict[str, Document] = {
        "pivot": {"at": point},
        "slide": {"most": coefficient},
        "groove": {"groove": st.just([[0, 0], [1, 2]]), "anchor": point},
        "rotary_limit": {"least": numbers(-3, 0), "most": numbers(0, 3)},
        "motor": {"rate": numbers(-10, 10), "max_torque": coefficient},
        "gear": {"ratio": coefficient},
        "spring": {"stiffness": coefficient, "damping": coefficient, "rest_length": coefficient},
        "rotary_spring": {"stiffness": coefficient, "rest_angle": numbers(-3, 3)},
        "ratchet": {"ratchet": coefficient, "phase": numbers(-3, 3)},
    }
    if len(names) > 1:
        kinds["pulley"] = {"wheels": st.just([[-97.5, 98.5], [96.5, 99.5]]), "ratio": coefficient}
    kind = draw(st.sampled_from(list(kinds)))
    least = 2 if kind == "pulley" else 1
    between = st.lists(st.sampled_from(names), min_size=least, max_size=2, unique=True)
    optional: Document = {"collide": st.booleans()}
    if kind not in ("motor", "pulley"):
        optional["max_force"] = numbers(0, 100)
    if kind not in ("motor", "pulley", "spring", "rotary_spring"):
        optional |= {"max_bias": numbers(0, 10), "bias": numbers(0, 1)}
    joint = st.fixed_dictionaries({"between": between, **kinds[kind]}, optional=optional)
    return {"kind": kind, **draw(joint)}


def drives(names: list[str]) -> st.SearchStrategy[Document]:
    """A drive of a body that starts at rest at an angle of 0, valid for any such body."""
    common = {"body": st.sampled_from(names)}
    level = numbers(0, 1)
    hinged = {**common, "pivot": pairs(-100, 100), "stops": st.sampled_from([[0, 1], [0, -1], [-0.5, 0.5]])}
    torque = st.fixed_dictionaries(
        {**hinged, "kind": st.just("torque"), "torque": numbers(1e-3, 10)},
        optional={"ramp": level, "return_ratio": level, "hold_ratio": level, "hold_within": level, "bounce": level},
    )
    stroke = st.fixed_dictionaries(
        {**hinged, "kind": st.just("stroke"), "rate": numbers(1e-2, 30)}, optional={"return_rate": numbers(0, 30)}
    )
    plunger = st.fixed_dictionaries(
        {
            **common,
            "kind": st.just("plunger"),
            "direction": st.sampled_from([[0, 1], [-3, 4]]),
            "travel": numbers(1e-2, 3),
            "speed": numbers(1e-2, 10),
        },
        optional={"draw_time": numbers(1e-2, 3), "key": st.sampled_from(["space", "left shift"])},
    )
    return torque | stroke | plunger


def _thrusts(names: list[str]) -> st.SearchStrategy[Document]:
    optional = {"point": pairs(-3, 3), "begin": numbers(0, 1), "key": st.sampled_from(["up", "left"])}
    return st.fixed_dictionaries({"body": st.sampled_from(names), "force": pairs(-10, 10)}, optional=optional)


@st.composite
def solid_documents(draw: st.DrawFn) -> Document:
    """Valid scene documents of solids, joints and forces over a floor, small and slow enough to be run."""
    world = st.fixed_dictionaries({}, optional={"gravity": pairs(-10, 10), "linear_drag": numbers(0, 1)})
    floor = {"point": [0, -200], "normal": [0, 1], "restitution": 0.5, "friction": 0.5}
    document: Document = {"world": draw(world), "plane": [floor], "solver": {"dt": 0.01}, **draw(solids())}
    return {kind: value for kind, value in document.items() if value}


def solid_scenes() -> st.SearchStrategy[Scene]:
    """Valid scenes of solids, joints and forces."""
    return solid_documents().map(from_document)


def any_length(vector: list[float]) -> bool:
    """Return whether a vector is long enough to have a direction."""
    return math.hypot(*vector) > 1e-90


def _unless_none() -> Any:
    """Return a key for `unique_by` that treats every None as distinct."""
    return lambda name: object() if name is None else name


def scenes(most: int = 2) -> st.SearchStrategy[Scene]:
    """Valid scenes."""
    return documents(most).map(from_document)


def junk() -> st.SearchStrategy[Any]:
    """Values of any type that TOML or JSON can hold, most of them invalid for any key."""
    leaves = (
        st.none()
        | st.booleans()
        | st.integers()
        | st.integers(-(10**400), 10**400)
        | st.floats()
        | st.text(max_size=5)
        | st.dates()
        | st.datetimes()
        | st.times()
    )
    return st.recursive(
        leaves, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4)
    )


class Rendered:
    """A document written as TOML in a random layout, and the line of every location in it."""

    def __init__(self, document: Document, chance: random.Random) -> None:
        self._chance = chance
        self._line = 1
        self._parts: list[str] = []
        self.lines: dict[Location, int] = {}
        self._document(document)
        self.text = "".join(self._parts)

    def _write(self, text: str) -> None:
        self._parts.append(text)
        self._line += text.count("\n")

    def _note(self, location: Location) -> None:
        for length in range(1, len(location) + 1):
            self.lines.setdefault(location[:length], self._line)

    def _fill(self) -> None:
        """Write blank lines and comments; some comments look like keys, headings or open strings."""
        traps = ["", "   ", "# [[ball]]", "# radius = 1", '# """', "# '", "#\u2028]", "# ]\x85}", '\t# name = "x']
        for _ in range(self._chance.choice((0, 0, 1, 2))):
            self._write(self._chance.choice(traps) + "\n")

    def _end(self) -> None:
        self._write(self._chance.choice(("", "  ", " # ] x = 1", "\t#'''")) + self._chance.choice(("\n", "\r\n")))

    def _key(self, key: str) -> str:
        bare = key.isascii() and key.replace("_", "").isalnum()
        return self._chance.choice((key, json.dumps(key), f"'{key}'")) if bare else json.dumps(key)

    def _document(self, document: Document) -> None:
        tables: list[tuple[str, list[Document] | Document]] = []
        for key, value in self._shuffled(document.items()):
            is_table = isinstance(value, dict)
            is_array = isinstance(value, list) and value and all(isinstance(v, dict) for v in value)
            if (is_table or is_array) and self._chance.random() < 0.9:
                tables.append((key, value))
            elif is_table and value and self._chance.random() < 0.5:
                self._table((key,), value, f"{self._key(key)}.")
            else:
                self._table((), {key: value})
        waiting = [(key, value if isinstance(value, list) else [value]) for key, value in tables]
        several = {key: isinstance(value, list) for key, value in tables}
        written = dict.fromkeys(several, 0)
        while waiting:
            index = self._chance.randrange(len(waiting))
            key, values = waiting[index]
            self._fill()
            heading = f"[[{self._key(key)}]]" if several[key] else f"[ {self._key(key)} ]"
            location: Location = (key, written[key]) if several[key] else (key,)
            self._note(location)
            self._write(heading)
            self._end()
            self._table(location, values[written[key]])
            written[key] += 1
            if written[key] == len(values):
                del waiting[index]

    def _shuffled(self, items: Any) -> list[Any]:
        items = list(items)
        self._chance.shuffle(items)
        return items

    def _table(self, location: Location, table: Document, prefix: str = "") -> None:
        for key, value in self._shuffled(table.items()):
            self._fill()
            self._note((*location, key))
            self._write(prefix + self._key(key) + self._chance.choice((" = ", "=", "\t=  ")))
            self._value((*location, key), value)
            self._end()

    def _value(self, location: Location, value: Any) -> None:
        if isinstance(value, dict):
            self._write("{ ")
            for n, (key, inner) in enumerate(self._shuffled(value.items())):
                self._write(", " if n else "")
                self._note((*location, key))
                self._write(f"{self._key(key)} = ")
                self._value((*location, key), inner)
            self._write(" }")
        elif isinstance(value, list):
            self._write("[")
            for n, inner in enumerate(value):
                self._break()
                self._note((*location, n))
                self._value((*location, n), inner)
                self._break()
                self._write("," if n < len(value) - 1 or self._chance.random() < 0.3 else "")
            self._break()
            self._write("]")
        else:
            self._write(self._scalar(value))

    def _break(self) -> None:
        self._write(self._chance.choice(("", "", " ", "\n", "  # , ]\n")))

    def _scalar(self, value: Any) -> str:
        if isinstance(value, str):
            plain = json.dumps(value).replace("\x7f", "\\u007f")
            forms = [_toml_escapes(plain)]
            if value and value.isprintable() and "'" not in value:
                forms += [f"'{value}'", f"'''\n{value}'''"]
            if "\\" not in plain and value.isprintable():
                forms.append(f'"""\\\n   {value}"""' if value.strip() == value else f'"""{value}"""')
            return self._chance.choice(forms)
        if isinstance(value, bool):
            return "true" if value else "false"
        return repr(value)


def _toml_escapes(text: str) -> str:
    """Replace JSON's surrogate pairs by characters; TOML has no such escapes."""
    return json.dumps(json.loads(text), ensure_ascii=False).replace("\x7f", "\\u007f")


@st.composite
def rendered(draw: st.DrawFn, of: st.SearchStrategy[Document] | None = None) -> tuple[Document, Rendered]:
    """A document and a TOML text of it."""
    document = draw(documents() if of is None else of)
    return document, Rendered(document, draw(st.randoms(use_true_random=False)))
