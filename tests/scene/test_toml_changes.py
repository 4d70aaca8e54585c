"""Changes to scene files in place: the result is the changed document, and all other text is kept byte for byte."""

import random
import tomllib
from typing import Any

import pytest
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st

from sandbox.scene.files.shipped_scenes import find
from sandbox.scene.files.toml_changes import (
    AddElement,
    Change,
    RemoveElement,
    RemoveValue,
    SetValue,
    TextEditError,
    with_changes,
    with_swapped_elements,
)
from sandbox.scene.files.toml_index import statements
from tests.samples import each_shipped_scene
from tests.strategies import Rendered, documents, names, numbers, pairs, rendered, solids

A, B = "[[ball]]\nr = 1  # a\n", "[[ball]]\nr = 2\n"
BOX, WORLD = "[[box]]\ns = 1\n", "[world]\ng = 1\n"
NEW = "[[ball]]\nr = 3\n"
ADD = AddElement("ball", {"r": 3})


def check(before: str, after: str, *changes: Change) -> None:
    """Apply changes to a text, with each kind of line endings, with and without final newline."""
    assert with_changes(before, changes) == after
    assert with_changes(before.replace("\n", "\r\n"), changes) == after.replace("\n", "\r\n")
    assert with_changes(before.removesuffix("\n"), changes) == after.removesuffix("\n")


@pytest.mark.parametrize(
    ("before", "after", "location", "value"),
    [
        (A + B, A + B.replace("2", "0.5"), ("ball", 1, "r"), 0.5),
        (A + B, A.replace("1", "1e-6") + B, ("ball", 0, "r"), 1e-6),
        ("a = [ 1.50, # x\n  2.0 ]\n", "a = [ 1.50, # x\n  3.5 ]\n", ("a", 1), 3.5),
        ("a = [ 1.50, # x\n  2.0 ]\n", "a = [ 1.50, # x\n  3.5 ]\n", ("a",), [1.5, 3.5]),
        ("a = [1, 2] # x\n", "a = [1, 2, 3] # x\n", ("a",), (1, 2, 3)),
        ("a = [[1, 2], [3, 4]]\n", "a = [[1, 2], [3, 5]]\n", ("a", 1, 1), 5),
        ("w = [{k={s=1 ,t=2}}]\n", "w = [{k={s=1 ,t='x'}}]\n".replace("'", '"'), ("w", 0, "k", "t"), "x"),
        ("w = { a.'b' = 1, a.c = 2 }\n", "w = { a.'b' = 3, a.c = 2 }\n", ("w", "a", "b"), 3),
        ("'a' . \"b\" = 1 # x\n", "'a' . \"b\" = true # x\n", ("a", "b"), True),
        ("a = '''\n# [b]\n'''\n", 'a = "it\'s \\"\\u0001\\"\\n"\n', ("a",), 'it\'s "\x01"\n'),
        (
            "[[w]]\n[w.k]\ns = 1\n[[w]]\n[w.k]\ns = 2\n",
            "[[w]]\n[w.k]\ns = 1\n[[w]]\n[w.k]\ns = 3\n",
            ("w", 1, "k", "s"),
            3,
        ),
        ("t = 1979-05-27 07:32:00 # x\n", "t = 2 # x\n", ("t",), 2),
        (WORLD, WORLD.replace("1", '[{ a = 1.0, "b c" = {} }, []]'), ("world", "g"), [{"a": 1.0, "b c": {}}, []]),
        (WORLD + "h = 0x10\n", WORLD.replace("1", "2") + "h = 0x10\n", ("world",), {"g": 2, "h": 16}),
    ],
)
def test_only_the_characters_of_a_value_are_replaced(before: str, after: str, location: Any, value: Any) -> None:
    check(before, after, SetValue(location, value))
    check(after, after, SetValue(location, value))


@pytest.mark.parametrize(
    ("before", "after", "location"),
    [
        (A + "\n" + B, A + "k = 7\n\n" + B, ("ball", 0, "k")),
        (
            "[[w]]\n  a = 1\n\n  # x\n  [w.s]\n  b = 1\n",
            "[[w]]\n  a = 1\n  k = 7\n\n  # x\n  [w.s]\n  b = 1\n",
            ("w", 0, "k"),
        ),
        ("[world] # x\n# y\n" + A, "[world] # x\nk = 7\n# y\n" + A, ("world", "k")),
        ("w = {} # x\n", "w = { k = 7 } # x\n", ("w", "k")),
        ("w = { a = [1] } # x\n", "w = { a = [1], k = 7 } # x\n", ("w", "k")),
        ("w = {a=1}\n", "w = {a=1, k = 7}\n", ("w", "k")),
        ("w = [\n  {a=1}, # x\n  {},\n]\n", "w = [\n  {a=1}, # x\n  { k = 7 },\n]\n", ("w", 1, "k")),
        ("w.a = 1\nw . b = 2 # x\nt = 1\n", "w.a = 1\nw . b = 2 # x\nw .k = 7\nt = 1\n", ("w", "k")),
        ("[[w]]\n 'x.y'.a = 1\nb = 2\n", "[[w]]\n 'x.y'.a = 1\n 'x.y'.k = 7\nb = 2\n", ("w", 0, "x.y", "k")),
        ("w = { x.a = 1, b = 2 }\n", "w = { x.a = 1, b = 2, x.k = 7 }\n", ("w", "x", "k")),
        ("t = 1\n\n# x\n" + A, "t = 1\n\n[world]\nk = 7\n\n# x\n" + A, ("world", "k")),
        ("#:schema x\n" + A, "#:schema x\n\n[world]\nk = 7\n\n" + A, ("world", "k")),
        ("# x\n" + A, "[world]\nk = 7\n\n# x\n" + A, ("world", "k")),
        ("[solver]\na = 1\n\n" + A, "[solver]\na = 1\n\n[world]\nk = 7\n\n" + A, ("world", "k")),
        ("[solver]\na = 1\n# end\n", "[solver]\na = 1\n# end\n\n[world]\nk = 7\n", ("world", "k")),
        ("t = 1 # x\n\n# y\n" + A, "t = 1 # x\nk = 7\n\n# y\n" + A, ("k",)),
        ("#:schema x\n# y\n\n# z\n" + WORLD, "#:schema x\n# y\n\nk = 7\n\n# z\n" + WORLD, ("k",)),
        ("#:schema x\n" + WORLD, "#:schema x\n\nk = 7\n\n" + WORLD, ("k",)),
        ("# only\n", "# only\n\nk = 7\n", ("k",)),
        (A, A + "kick = { speed = { k = 7 } }\n", ("ball", 0, "kick", "speed", "k")),
        (A, A + '"1 ü" = 7\n', ("ball", 0, "1 ü")),
        ("[a.b]\nc = 1\n", "[a]\nk = 7\n\n[a.b]\nc = 1\n", ("a", "k")),
    ],
)
def test_missing_key_is_inserted_in_the_form_of_its_table(before: str, after: str, location: Any) -> None:
    check(before, after, SetValue(location, 7))


def test_keys_of_one_missing_table_are_inserted_together() -> None:
    places = ("world", "a"), ("solver", "b"), ("t",), ("world", "c")
    values = [SetValue(place, value) for place, value in zip(places, (1, 2, "x", 3), strict=True)]
    check(A, 't = "x"\n\n[world]\na = 1\nc = 3\n\n[solver]\nb = 2\n\n' + A, *values)
    assert with_changes("", values) == 't = "x"\n\n[world]\na = 1\nc = 3\n\n[solver]\nb = 2\n'
    kick = [SetValue(("ball", 0, "kick", "speed"), 1.0), SetValue(("ball", 0, "kick", "by"), "b")]
    check(A + BOX, A + 'kick = { speed = 1.0, by = "b" }\n' + BOX, *kick)


@pytest.mark.parametrize(
    ("before", "after", "location"),
    [
        ("[[ball]]\nr = 1\n# x\nv = [1, # y\n 2] # z\n\n" + B, "[[ball]]\nr = 1\n# x\n\n" + B, ("ball", 0, "v")),
        ("w = { a = 1, b = 2, c = 3 } # x\n", "w = { b = 2, c = 3 } # x\n", ("w", "a")),
        ("w = { a = 1, b = 2, c = 3 } # x\n", "w = { a = 1, c = 3 } # x\n", ("w", "b")),
        ("w = {a=1,b=2,c=3}\n", "w = {a=1,b=2}\n", ("w", "c")),
        ("w = { a = 1 }\n", "w = {}\n", ("w", "a")),
        ("t = 1\n\n" + WORLD + "\n# x\n" + A, "t = 1\n\n# x\n" + A, ("world",)),
        ("[world]\n\n[world.a]\nb = 1\n\n" + A, A, ("world",)),
        ("w.a = 1\nt = 2\nw.b = 3\n", "t = 2\n", ("w",)),
        ("w.a = 1\nt = 2\n", "t = 2\n", ("w", "a")),
        ("[[x]]\nw.a = 1 # x\nw.b = 2\n", "[[x]]\nw.b = 2\n", ("x", 0, "w", "a")),
        ("[[x]]\nw.a = 1 # x\n", "[[x]]\nw = {} # x\n", ("x", 0, "w", "a")),
        ("[[x]]\nw.a.b = 1 # x\nw.a.c = 2\n", "[[x]]\nw = {} # x\n", ("x", 0, "w", "a")),
        ("t = 1\n\n" + A + "\n" + BOX + "\n" + B, "t = 1\n\n" + BOX, ("ball",)),
        ("a = [1, 2, 3]\n", "a = [1, 3]\n", ("a", 1)),
        (A, A, ("ball", 0, "x", "y")),
        (A, A, ("world",)),
    ],
)
def test_value_is_removed_with_its_lines_or_comma(before: str, after: str, location: Any) -> None:
    check(before, after, RemoveValue(location))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (A + "\n" + B + "\n" + BOX, A + "\n" + B + "\n" + NEW + "\n" + BOX),
        (
            A + "\n" + BOX + "\n# x\n" + B + "# y\n\n# z\n" + BOX,
            A + "\n" + BOX + "\n# x\n" + B + "# y\n\n" + NEW + "\n# z\n" + BOX,
        ),
        (A + "[ball.k]\na = 1\n\n" + WORLD, A + "[ball.k]\na = 1\n\n" + NEW + "\n" + WORLD),
        (A + "\n" + BOX + "\n[ball.k]\na = 1\n", A + "\n" + BOX + "\n[ball.k]\na = 1\n\n" + NEW),
        (BOX + "# end\n", BOX + "# end\n\n" + NEW),
        ("ball = []\n", "ball = [{ r = 3 }]\n"),
        ("ball = [{r=1}] # x\n", "ball = [{r=1}, { r = 3 }] # x\n"),
        ("ball = [{r=1},]\n", "ball = [{r=1}, { r = 3 },]\n"),
        ("ball = [\n  {r=1}, # x\n\t{r=2}, # y\n]\n", "ball = [\n  {r=1}, # x\n\t{r=2}, # y\n\t{ r = 3 },\n]\n"),
        ("ball = [\n  {r=1} # x\n  # y\n]\n", "ball = [\n  {r=1}, # x\n  { r = 3 }\n  # y\n]\n"),
        ("ball = [ # x\n]\n", "ball = [ # x\n{ r = 3 }]\n"),
    ],
)
def test_element_is_added_behind_the_last_one(before: str, after: str) -> None:
    check(before, after, ADD)


def test_new_list_of_tables_is_added_at_the_end() -> None:
    post = AddElement("a b", {"position": (0, 1.0), "name": "x", "kick": {"speed": 1e22}})
    new = '[["a b"]]\nposition = [0, 1.0]\nname = "x"\nkick = { speed = 1e22 }\n'
    check(WORLD, f"{WORLD}\n{new}\n{new}\n{NEW}", post, post, ADD)
    assert with_changes("", [ADD]) == NEW


@pytest.mark.parametrize(
    ("before", "after", "indices"),
    [
        (A + "\n# x\n# y\n" + B + "\n" + BOX, A + "\n" + BOX, [1]),
        (A + "\n# x\n" + B + "\n" + BOX, "# x\n" + B + "\n" + BOX, [0]),
        (A + "\n" + BOX + "\n# z\n" + B + "# y\n\n# x\n" + WORLD, A + "\n" + BOX + "\n# x\n" + WORLD, [1]),
        (A + "\n" + BOX + "\n" + B, BOX, [0, 1]),
        (BOX + "\n" + A + "\n[ball.k]\na = 1\n\n[[ball.l]]\n", BOX, [0]),
        (A + BOX + "[ball.k]\na = 1\n" + B, BOX + B, [0]),
        ("#:schema x\n" + A + B, "#:schema x\n" + B, [0]),
        ('t = """\n# x"""\n' + A, 't = """\n# x"""\n', [0]),
        ("ball = [{r=1}, {r=2} , {r=3}]\n", "ball = [{r=2} , {r=3}]\n", [0]),
        ("ball = [{r=1}, {r=2} , {r=3}]\n", "ball = [{r=1}]\n", [1, 2]),
        ("ball = [ {r=1}, {r=2}, ]\n", "ball = [ {r=1}, ]\n", [1]),
        ("ball = [ {r=1} ]\n", "ball = []\n", [0]),
        ("ball = [\n  {r=1}, # x\n  # y\n  {r=2} # z\n]\n", "ball = [\n  # y\n  {r=2} # z\n]\n", [0]),
        ("ball = [\n  {r=1}, # x\n  # y\n  {r=2} # z\n]\n", "ball = [\n  {r=1} # x\n  # y\n]\n", [1]),
        ("ball = [{r=1}\n, {r=2}]\n", "ball = [{r=2}]\n", [0]),
    ],
)
def test_element_is_removed_with_its_comments_and_subtables(before: str, after: str, indices: list[int]) -> None:
    check(before, after, *(RemoveElement("ball", index) for index in indices))


def test_several_changes_refer_to_the_original_indices() -> None:
    text = f"t = 1\n\n{A}\n{BOX}\n{B}"
    changes: list[Change] = [
        RemoveElement("ball", 0),
        ADD,
        SetValue(("ball", 1, "r"), 9),
        SetValue(("ball", 1, "m"), 1),
        ADD,
    ]
    check(text, f"t = 1\n\n{BOX}\n[[ball]]\nr = 9\nm = 1\n\n{NEW}\n{NEW}", *changes)
    check(text, f"t = 1\n\n[world]\na = 1\n\n{BOX}\n{NEW}", RemoveValue(("ball",)), SetValue(("world", "a"), 1), ADD)
    check(A, "[[ball]]\nm = 2\n", SetValue(("ball", 0, "m"), 2), RemoveValue(("ball", 0, "r")))
    check(WORLD + A, WORLD.replace("g = 1", "a = 2") + A, RemoveValue(("world",)), SetValue(("world", "a"), 2))
    inline = "ball = [{r=1}, {r=2}, {r=5}]\n"
    changes = [RemoveElement("ball", 2), ADD, SetValue(("ball", 1, "r"), 4), RemoveElement("ball", 0)]
    check(inline, "ball = [{r=4}, { r = 3 }]\n", *changes)
    lines = "ball = [\n  {r=1},\n  {r=2},\n  {r=5}\n]\n"
    check(lines, "ball = [\n  {r=4},\n  { r = 3 }\n]\n", *changes)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (SetValue(("ball", 0, "r"), float("nan")), r"ball\[0\]\.r: must be a finite number"),
        (SetValue(("ball", 0, "r"), [{"a": None}]), r"type NoneType cannot be written"),
        (SetValue(("ball", 7, "r"), 1), r"ball\[7\]\.r: does not exist"),
        (SetValue(("ball", 0, "r", "x"), 1), "does not exist"),
        (SetValue((), 1), "at least one key"),
        (SetValue(("world",), 1), "world: is made of several lines"),
        (SetValue(("ball",), []), "ball: is made of several lines"),
        (RemoveElement("ball", 1), r"ball\[1\]: does not exist"),
        (RemoveElement("box", 0), r"box\[0\]: does not exist"),
        (AddElement("world", {}), "world: is not a list of tables"),
        (AddElement("ball", {"r": float("inf")}), "must be a finite number"),
    ],
)
def test_impossible_change_is_refused(change: Change, reason: str) -> None:
    with pytest.raises(TextEditError, match=reason):
        with_changes(A + WORLD, [change])


def test_invalid_text_is_refused() -> None:
    with pytest.raises(TextEditError, match="not TOML"):
        with_changes("[world\n", [])


def test_numbers_of_numpy_are_written_as_plain_ones() -> None:
    numpy = pytest.importorskip("numpy")
    values = [SetValue(("ball", 0, "p"), numpy.array([0.5, 1])), SetValue(("ball", 0, "n"), numpy.int64(3))]
    check(A, A + "p = [0.5, 1.0]\nn = 3\n", *values)


@pytest.mark.parametrize("name", each_shipped_scene())
def test_moved_balls_of_a_shipped_scene_leave_all_other_lines_unchanged(name: str) -> None:
    text = find(name).read_bytes().decode()
    balls = tomllib.loads(text).get("ball", [])
    moves = [SetValue(("ball", k, "position"), [each["position"][0] + 0.125, 7.0]) for k, each in enumerate(balls)]
    result = with_changes(text, moves)
    before, after = text.split("\n"), result.split("\n")
    different = [old for old, new in zip(before, after, strict=True) if old != new]
    assert len(different) == len(balls)
    assert all("position" in line for line in different)
    added = with_changes(text, [AddElement("ball", {"position": [0, 1], "radius": 0.5})])
    assert with_changes(added, [RemoveElement("ball", len(balls))]) == text


some_values = st.one_of(
    numbers(-1e9, 1e9),
    st.booleans(),
    names(),
    st.text(max_size=9),
    pairs(-9, 9),
    st.fixed_dictionaries({"a": pairs(0, 1)}),
)


def locations(value: Any, location: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Return every location in a document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    inner = [each for key, child in items for each in locations(child, (*location, key))]
    return [location, *inner] if location else inner


def place_of(change: Change) -> tuple[str | int, ...]:
    if isinstance(change, SetValue | RemoveValue):
        return change.location
    return (change.table, change.index) if isinstance(change, RemoveElement) else (change.table,)


@st.composite
def changes_of(draw: st.DrawFn, document: dict[str, Any]) -> list[Change]:
    """Changes of existing values and of new ones in existing tables; no two concern the same value."""
    chance = random.Random(draw(st.integers(0, 2**32)))
    tables = [key for key, value in document.items() if isinstance(value, list) and isinstance(value[0], dict)]
    changes: list[Change] = []
    for location in locations(document):
        value: Any = document
        for key in location:
            value = value[key]
        is_inner = any(location[: len(place)] == place for place in map(place_of, changes))
        table, index = location[0], location[-1]
        element = RemoveElement(str(table), int(index)) if len(location) == 2 and table in tables else None
        if is_inner or (element and chance.random() < 0.9) or len(changes) > 8 or chance.random() < 0.6:
            continue
        if element:
            changes.append(RemoveValue(location) if chance.random() < 0.5 else element)
        elif isinstance(value, dict):
            changes.append(SetValue((*location, draw(st.sampled_from(["new", "a b", "#"]))), draw(some_values)))
        elif location[0] not in tables or len(location) > 1:
            is_set = isinstance(location[-1], int) or chance.random() < 0.7
            changes.append(SetValue(location, draw(some_values)) if is_set else RemoveValue(location))
    values = st.dictionaries(st.sampled_from(["name", "position", "it's", "k"]), some_values, max_size=3)
    added = draw(st.lists(st.sampled_from([*tables, "new", "b c"]), max_size=3))
    changes += [AddElement(each, draw(values)) for each in added]
    for location in draw(
        st.lists(st.sampled_from([("world", "new"), ("solver", "a"), ("title",), ("new 2",)]), max_size=3)
    ):
        if all(place_of(each)[0] != location[0] for each in changes):
            changes.append(SetValue(location, draw(some_values)))
    return changes


def filled(document: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in document.items() if value not in ([], {})}


def changed(document: dict[str, Any], changes: list[Change]) -> dict[str, Any]:
    """Make changes of a document one by one, and return it; removed elements are dropped at the end."""
    result = document
    removed: list[tuple[list[Any], int]] = []
    for each in changes:
        if isinstance(each, AddElement):
            result.setdefault(each.table, []).append(dict(each.values))
            continue
        place = (each.table, each.index) if isinstance(each, RemoveElement) else each.location
        holder: Any = result
        for key in place[:-1]:
            holder = holder.setdefault(key, {}) if isinstance(holder, dict) else holder[key]
        if isinstance(each, SetValue):
            holder[place[-1]] = each.value
        elif isinstance(holder, dict):
            holder.pop(place[-1], None)
        else:
            removed.append((holder, int(place[-1])))
    for elements, index in sorted(removed, key=lambda each: -each[1]):
        del elements[index]
    return result


def located_statements(text: str) -> list[tuple[tuple[str | int, ...], str]]:
    """Return every statement with the location of its key or of its heading, and its text."""
    found: list[tuple[tuple[str | int, ...], str]] = []
    table: tuple[str | int, ...] = ()
    counts: dict[tuple[str, ...], int] = {}
    for each in statements(text):
        if each.heading:
            table = each.keys
            if text.startswith("[[", each.head[0]):
                counts[each.keys] = counts.get(each.keys, -1) + 1
                table = (*each.keys, counts[each.keys])
        location = table if each.heading else (*table, *each.keys)
        found.append((location, text[each.begin : each.end]))
    return found


def is_touched(location: tuple[str | int, ...], changes: list[Change]) -> bool:
    """Return whether the statement with a key or heading may change."""
    for each in changes:
        place = place_of(each)
        is_inside = place[: len(location)] == location and isinstance(location[-1], str)
        is_removed = isinstance(each, RemoveValue | RemoveElement) or len(place) == len(location)
        if is_inside or (is_removed and location[: len(place)] == place):
            return True
    return False


@pytest.mark.fail_slow(60)  # takes over half a second
@settings(max_examples=60)  # of large documents
@given(rendered(documents() | solids()), st.data())
def test_random_changes_of_any_layout_give_the_changed_document(case, data):
    document, text = case[0], case[1].text
    changes = data.draw(changes_of(document))
    result = with_changes(text, changes)
    assert filled(tomllib.loads(result)) == filled(changed(tomllib.loads(text), changes))
    remaining = iter([body.rstrip("\r\n") for _, body in located_statements(result)])
    for location, body in located_statements(text):
        if not is_touched(location, changes):
            assert body.rstrip("\r\n") in remaining, body  # consumes those before it, so the order is checked


@pytest.mark.fail_slow(60)  # takes over half a second
@given(rendered(documents()))
def test_present_values_change_nothing(case: tuple[Any, Rendered]) -> None:
    document, text = case[0], case[1].text
    changes: list[Change] = []
    for location in locations(document):
        value: Any = document
        for key in location:
            value = value[key]
        changes.append(SetValue(location, value))
    assert with_changes(text, changes) == text
    assert with_changes(text, []) == text


@pytest.mark.fail_slow(60)  # takes over half a second
@given(rendered(documents()), st.dictionaries(names(), some_values, max_size=3), st.booleans())
def test_added_element_removed_again_leaves_the_original_text(case, values, is_cut):
    document, text = case[0], case[1].text
    text = text.removesuffix("\n").removesuffix("\r") if is_cut else text
    headings = {each.keys[0] for each in statements(text) if each.heading}
    for table, elements in document.items():
        if table in headings and isinstance(elements, list):
            added = with_changes(text, [AddElement(table, values)])
            assert tomllib.loads(added)[table] == [*elements, values]
            assert with_changes(added, [RemoveElement(table, len(elements))]) == text


@pytest.mark.parametrize("end", ["\n", ""])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_swapped_elements_take_their_comments_with_them(end: str, ending: str) -> None:
    text = (
        '# file\n\n# one\n[[ball]]\nname = "a" # first\nradius = 1.0\n\n[[box]]\nsize = [1, 1]\n\n'
        '# two\n[[ball]]\nname = "b"\n[ball.sub]\nx = 1' + end
    ).replace("\n", ending)
    swapped = (
        '# file\n\n# two\n[[ball]]\nname = "b"\n[ball.sub]\nx = 1\n\n[[box]]\nsize = [1, 1]\n\n'
        '# one\n[[ball]]\nname = "a" # first\nradius = 1.0' + end
    ).replace("\n", ending)
    assert with_swapped_elements(text, "ball", 0, 1) == swapped
    assert with_swapped_elements(swapped, "ball", 1, 0) == text


def test_swapped_elements_of_inline_arrays() -> None:
    text = "plane = [{ a = 1 }, # one\n  { a = 2 }]\n"
    assert with_swapped_elements(text, "plane", 0, 1) == "plane = [{ a = 2 }, # one\n  { a = 1 }]\n"


@pytest.mark.fail_slow(60)  # takes over half a second
@given(rendered(documents()), st.data())
def test_swapping_twice_restores_any_text(case: tuple[dict[str, object], Rendered], data: st.DataObject) -> None:
    document, text = case
    tables = [key for key, value in document.items() if isinstance(value, list) and len(value) > 1]
    assume(tables)
    table = data.draw(st.sampled_from(tables))
    try:
        swapped = with_swapped_elements(text.text, table, 0, 1)
    except TextEditError:  # such as elements whose subtables are scattered
        reject()
    elements = document[table]
    assert isinstance(elements, list)
    assert tomllib.loads(swapped)[table] == [elements[1], elements[0], *elements[2:]]
    restored = with_swapped_elements(swapped, table, 0, 1)
    # A blank line keeps a comment below an element apart from the next one.
    assert [line for line in restored.splitlines() if line] == [line for line in text.text.splitlines() if line]


def test_comment_below_an_element_stays_with_it_when_it_is_swapped() -> None:
    before = "[[ball]]\nr = 1\n[[ball]]\nr = 2\n# mass = 3\n\n[[box]]\ns = 1\n"
    after = "[[ball]]\nr = 2\n# mass = 3\n\n[[ball]]\nr = 1\n\n[[box]]\ns = 1\n"
    assert with_swapped_elements(before, "ball", 0, 1) == after
    assert with_swapped_elements(after, "ball", 0, 1).startswith("[[ball]]\nr = 1\n\n[[ball]]\nr = 2\n# mass = 3\n")
