"""Text that is not TOML: the usual mistakes are named with the text that would be right."""

import re

import pytest

from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import loads
from tests.scene.faults import assert_faults, faults_of


@pytest.mark.parametrize(
    ("statement", "right"),
    [
        ("title = Worksheet", 'title = "Worksheet"'),
        ("title = My work sheet # of May", 'title = "My work sheet"'),
        ("title = “Worksheet”", 'title = "Worksheet"'),
        ('title = "Worksheet', 'title = "Worksheet"'),
        ("title = 'It's a sheet'", "between \" and \""),
        ("dt = 1/60", "dt = 0.016666666666666666"),
        ("dt = {0.01}", "dt = 0.01"),
        ("gravity = {0, -9.81}", "gravity = [0, -9.81]"),
        ("dt = 1 / 60 # s", "dt = 0.016666666666666666"),
        ("angle = pi/4", "angle = 0.7853981633974483"),
        ("angle = 45°", "radians: angle = 0.7853981633974483"),
        ("e = 0,5", "decimals have a point: e = 0.5"),
        ("e = 50%", "e = 0.5"),
        ("duration = 3 s", "duration = 3"),
        ("gravity = -9.81 m/s²", "gravity = -9.81"),
        ("radius = 5cm", "radius = 0.05"),
        ("e = .5", "e = 0.5"),
        ("e = -.5", "e = -0.5"),
        ("e = 5.", "e = 5.0"),
        ("seed = 007", "seed = 7"),
        ("e = −9.81", "e = -9.81"),
        ("fixed = True", "fixed = true"),
        ("fixed = no", "fixed = false"),
        ("mass = None", "remove this key"),
        ("mass =", "a value is missing"),
        ("mass == 1", "one ="),
        ("dt = 0.01;", "remove the ; at the end: dt = 0.01"),
        ("dt = 0.01,", "remove the , at the end: dt = 0.01"),
        ("dt 0.01", "dt = 0.01"),
        ("dt: 0.01", "dt = 0.01"),
        ("angular velocity = 1", "angular_velocity = 1"),
        ("a = 1 b = 2", "a line of its own"),
        ("a = [0, 1", "a = [0, 1]"),
        ("a = [0, 1]]", "remove the last ]"),
        ("a = [0 1]", "a comma is missing before 1"),
        ("a = [1/2, 0]", "0.5"),
        ("a = [0., 0.]", "0.0"),
        ("a = [left, right]", '"left"'),
        ("a = (0, 1)", "square brackets"),
        ("a = { b = 2,5 }", "2.5"),
        ("a = { b = 2, }", "remove the comma"),
        ("a = { b = 2,\n c = 3 }", "one line"),
        ("[world", "[world]"),
        ("[[ball]", "[[ball]]"),
        ("[ball]]", "[[ball]]"),
        ("world", "[world]"),
        ("// note", "a comment begins with #"),
    ],
)  # fmt: skip
def test_usual_mistake_is_named_with_what_is_right(statement: str, right: str) -> None:
    for text in (statement, f"{statement}\n", f"{statement}\n[[post]]\nradius = 1\n", f"{statement}\nzzz = 1\n"):
        (fault,) = faults_of(f"# a scene\n\n{text}")
        assert fault.line == 3
        assert right in fault.message


def test_mistake_has_the_path_of_its_key() -> None:
    above = "[world]\nseed = 1\n[[ball]]\nname = 'cue'\n[[ball]]\nmass = 1\n"
    assert_faults(f"{above}radius = 0,5\n", "7: ball[1].radius: 0.5")
    assert_faults(f"{above}name = 'b'\nvelocity = [\n  1/2,\n 0]\n", "9: ball.b.velocity: 0.5")
    assert_faults(f"{above}velocity = [\n 1\n 0]\n", "9: ball[1].velocity: comma")
    assert_faults(f"{above}velocity = [1, 0\nradius = 1\n", "7: ball[1].velocity: velocity = [1, 0]")
    assert_faults(f"{above}mass = 2\n", "7: ball[1].mass: twice")


def test_table_that_is_there_twice_is_named() -> None:
    assert_faults("[world]\nseed = 1\n[world]\n", "3: : one heading")
    assert_faults("[ball]\nmass = 1\n[[ball]]\n", "3: : [[ball]]")


@pytest.mark.parametrize(
    ("value", "right"),
    [("1/60", "0.016666666666666666"), ("3 s", "3"), ("0,5", "0.5"), ("0.01", "0.01 without quotes")],
)
def test_number_in_quotes_is_refused_with_the_number(value: str, right: str) -> None:
    (fault,) = faults_of(f'[world]\nduration = "{value}"\n')
    assert fault.path == "world.duration"
    assert fault.message.endswith(right)


@pytest.mark.parametrize("text", [f"a = 1{',' * 200_000}", f"a = 1{' ' * 200_000}x", f"a{' a' * 200_000} 1"])
def test_long_line_takes_no_quadratic_time(text: str) -> None:
    assert [fault.line for fault in faults_of(text)] == [1]


@pytest.mark.parametrize(
    ("text", "words", "not_words"),
    [
        ("[[wall]]\npoints = [\n  [0, 0],\n  [1, 1],\n[[ball]]\nradius = 0.1\n", "bracket ]", "write the heading"),
        ("[world]\ngravity = [0,\n-9.81\nduration = 3\n", "bracket ]", "gravity = [0,]"),
        ("[world]\ngravity = [0, -9.81 m/s^2]\n", "no unit", "comma is missing"),
        ("[world]\nduration = 1,000\n", "1000, or 1.000", "point"),
        ("[world]\nduration = 5 // five\n", "not TOML", "quotes"),
        ("[world]\nduration = NaN\n", "not TOML", "quotes"),
    ],
)
def test_remedy_does_not_lead_to_another_mistake(text: str, words: str, not_words: str) -> None:
    with pytest.raises(SceneError, match=re.escape(words)) as error:
        loads(text)
    assert not_words not in str(error.value)
