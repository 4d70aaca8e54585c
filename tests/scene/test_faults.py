"""Faults: their lines, paths and messages."""

import random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.errors import Fault, Lines, SceneError, path_of
from sandbox.scene.files.load import loads
from tests import strategies


@pytest.mark.fail_slow(60)  # takes over half a second
@given(strategies.rendered())
def test_line_of_a_location_is_the_line_of_its_key(drawn: tuple[strategies.Document, strategies.Rendered]) -> None:
    rendered = drawn[1]
    lines = Lines(rendered.text)
    assert {location: lines.find(location) for location in rendered.lines} == rendered.lines


@pytest.mark.fail_slow(60)  # takes over half a second
@given(strategies.rendered(), st.integers(), st.text(min_size=1))
def test_line_of_a_missing_key_is_the_line_of_its_table(drawn, index, key):
    rendered = drawn[1]
    lines = Lines(rendered.text)
    for location, line in rendered.lines.items():
        assert lines.find((*location, index % 1000 + 1000)) == line
        assert lines.find((*location, f"no {key}", index)) == line
    assert lines.find((f"no {key}",)) is None


def with_fault(document: strategies.Document, chance: random.Random) -> tuple[strategies.Document, tuple[Any, ...]]:
    """Put one value of a wrong type, or one unknown key, into a document; return it and the location."""
    node: Any = document
    location: tuple[Any, ...] = ()
    while isinstance(node, dict | list) and node:
        key = chance.choice(list(node) if isinstance(node, dict) else range(len(node)))
        location += (key,)
        holder, node = node, node[key]
        if isinstance(node, dict) and chance.random() < 0.5:
            node["zzz"] = 1
            return document, (*location, "zzz")
    if isinstance(node, bool):
        holder[key] = 0
    else:
        holder[key] = True if isinstance(node, str | list) else "0.1"
    return document, location


@pytest.mark.fail_slow(60)  # takes over half a second
@given(
    st.tuples(strategies.documents(), st.randoms(use_true_random=False)).map(lambda pair: with_fault(*pair)),
    st.randoms(use_true_random=False),
)
def test_every_fault_has_file_line_path_and_message(faulty, chance):
    document, location = faulty
    rendered = strategies.Rendered(document, chance)
    with pytest.raises(SceneError) as caught:
        loads(rendered.text, "a scene.toml")
    assert rendered.lines[location] in [fault.line for fault in caught.value.faults]
    for fault in caught.value.faults:
        assert fault.file == "a scene.toml"
        assert fault.line in set(rendered.lines.values())
        assert fault.path
        assert fault.message
        assert str(fault).startswith(f"a scene.toml:{fault.line}: ")


def line(text: str, *location: str | int) -> int | None:
    return Lines(text).find(location)


def test_line_of_keys_in_dotted_keys_and_inline_tables() -> None:
    text = "world.seed = 1\nworld . 'wind' = [0,\n 1]\nsolver = {dt = 0.1, x = [\n[1], {y = 2}]}\n"
    assert line(text, "world") == 1
    assert line(text, "world", "seed") == 1
    assert line(text, "world", "wind") == 2
    assert line(text, "world", "wind", 0) == 2
    assert line(text, "world", "wind", 1) == 3
    assert line(text, "solver", "dt") == 4
    assert line(text, "solver", "x", 0, 0) == 5
    assert line(text, "solver", "x", 1, "y") == 5
    assert line(text) is line("", "a") is None


def test_line_of_keys_in_nested_tables() -> None:
    text = "[[a]]\nb.c = 1\n[[a.d]]\nx = 1\n[[a.d]]\nx = 2\n[a.e]\nx = 3\n[[a]]\n[[a.d]]\n\nx = 4\n[f.g.h]\ni = 1"
    assert line(text, "a") == 1
    assert line(text, "a", 0, "b", "c") == 2
    assert line(text, "a", 0, "d", 1, "x") == 6
    assert line(text, "a", 0, "e", "x") == 8
    assert line(text, "a", 1) == 9
    assert line(text, "a", 1, "d", 0, "x") == 12
    assert line(text, "f", "g") == 13
    assert line(text, "f", "g", "h", "i") == 14


@pytest.mark.parametrize(
    "trap",
    [
        's = "# [x]"', "s = '[x]'", 's = """\n[x]\ny = 1\n"""', "s = '''\n\"\"\"\n'''", 's = "\\\\"', 's = "\\""',
        's = """a\\"""b"""', "# '''", '# """', "s = ''", 's = ""', 's = """"""', "s = ''''a''''", 's = """"a"""""',
        's = ["]", \'}\', "]", # ]\n]', "s = {}", "s = []", "s = [[], [], ]", "s = [{}, {}]", "s = 1979-05-27 07:32:00",
        "s = {a = '}', b = [1, # }\n2]}", "'[x]' = 1", '"a = b" = 1', '"a\\"=" = 1', "s = 'a\u2028b\x85c'", "[s] # ]",
        "[ 's]' ]", '[[ s . "]]" ]]', "s.t . 'u=' = 1", "\t", "s = +1e+5", "s=''''''",
    ],
)  # fmt: skip
def test_line_after_text_that_looks_like_a_heading_or_string(trap: str) -> None:
    text = f"{trap}\n[end]\n  z = [1,\n2]"
    base = trap.count("\n") + 1
    assert line(text, "end") == base + 1
    assert line(text, "end", "z") == base + 2
    assert line(text, "end", "z", 1) == base + 3
    assert line(text.replace("\n", "\r\n"), "end", "z") == base + 2


def test_path_names_elements_with_a_printable_name() -> None:
    document = {"ball": [{"name": "cue"}, {}, {"name": "a\x1bb"}, {"name": 3}], "x\ny": 1}
    assert path_of(("ball", 0, "velocity", 1), document) == "ball.cue.velocity[1]"
    assert path_of(("ball", 1, "mass"), document) == "ball[1].mass"
    assert path_of(("ball", 2), document) == "ball[2]"
    assert path_of(("ball", 3), document) == "ball[3]"
    assert path_of(("x\ny",), document) == '"x\\ny"'
    assert path_of(("nowhere", 7, "x"), document) == "nowhere[7].x"
    assert path_of((), document) == ""


def test_fault_is_one_printable_line() -> None:
    assert str(Fault("s.toml", 3, "ball.cue", "is wrong")) == "s.toml:3: ball.cue: is wrong"
    assert str(Fault("s.toml", None, "", "is wrong")) == "s.toml: is wrong"
    assert str(Fault("a\nb", 1, "é", "\x1b[31m \u2028 \x85 \ud800")) == "a\\nb:1: é: \\x1b[31m \\u2028 \\x85 \\ud800"


FLIPPER = "[pinball]\n[[pinball.flipper]]\npivot = [0.1, 0.1]\nstops = [{}, 0.35]\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[pinball]\nslope = 6.5\n", "must be between 0 and 1.5, is 6.5; angles are in radians, 6.5° is 0.1134"),
        (FLIPPER.format(-3100), "must be between -10 and 10, is -3100"),  # out of range in degrees too
        ("[[ball]]\nangular_velocity = 1e99\nposition = [0, 0]\nradius = 0.1\n", "-1e+12 and 1e+12, is 1e+99"),  # rad/s
    ],
)
def test_message_of_an_angle_out_of_range_gives_it_in_radians(text: str, message: str) -> None:
    with pytest.raises(SceneError) as error:
        loads(text)
    assert error.value.faults[0].message.endswith(message)
