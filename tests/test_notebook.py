"""HTML display in notebooks: self-contained, escaped, of limited size, imported only when needed."""

import html
import re
import subprocess
import sys

import pytest

import sandbox
from sandbox.notebook import FIT_HEIGHT, MAX_CHARACTERS, html_of
from tests.toml_text import toml

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

HOSTILE = '</iframe><script>alert("1")</script>'
TEXT = (
    toml(title=HOSTILE, about="\"' onload='alert(2)'")
    + toml("world", gravity=[0, -10], duration=0.3)
    + toml("plane", point=[0, 0], normal=[0, 1])
    + toml("wall", points=[[2, 0], [2, 3]])
    + toml("post", position=[-2, 1], radius=0.1)
    + toml("ball", name="<b>bold</b>", position=[0, 0.7], radius=0.5, restitution=0.5)
)


def document_in(text: str) -> str:
    pattern = r'<script>(.*?)</script><iframe srcdoc="([^"]*)" sandbox="allow-scripts"[^<>]*></iframe>'
    found = re.fullmatch(pattern, text, re.DOTALL)
    assert found is not None
    assert found[1] == FIT_HEIGHT
    return html.unescape(found[2])


@pytest.fixture(scope="module")
def scene() -> sandbox.Scene:
    return sandbox.loads(TEXT)


def displayed(scene: sandbox.Scene) -> dict[str, str]:
    run = sandbox.run(scene)
    swept = sandbox.compare(scene, ["pymunk"], sweep={"solver.dt": [0.01, 0.005]})
    moved = sandbox.compare(scene, ["pymunk"], sweep={"world.gravity": [[0, -10], [0, -5]]})
    values = {
        "scene": scene,
        "run": run,
        "comparison": sandbox.compare(scene, ["pymunk"]),
        "sweep": swept,
        "moved": moved,
    }
    return {name: value._repr_html_() for name, value in values.items()}


def test_displays_escape_hostile_texts_within_a_sandboxed_frame(scene: sandbox.Scene) -> None:
    for name, text in displayed(scene).items():
        document = document_in(text)
        assert "<script>alert" not in document, name
        assert "&lt;script&gt;alert" in document, name
        assert "default-src 'none'" in document, name
        links = set(re.findall(r"https?://[^\s\"'<>&)]+", document))
        assert links <= {"http://www.w3.org/2000/svg"}, name
        assert len(text) < MAX_CHARACTERS, name


def test_run_shows_a_replay_and_figures_and_a_scene_a_picture(scene: sandbox.Scene) -> None:
    found = displayed(scene)
    run = document_in(found["run"])
    assert "<canvas" in run
    assert "energy of the scene, J" in run
    assert "first contact" in run
    picture = document_in(found["scene"])
    assert 'class="scene"' in picture
    assert "<canvas" not in picture
    assert "(0, −10) m/s²" in picture
    assert "pymunk, dt 0.005" in document_in(found["sweep"])
    assert "<canvas" in document_in(found["sweep"])
    assert "<canvas" not in document_in(found["moved"])  # its runs have different scenes


def test_display_of_a_refused_run_gives_the_reason(scene: sandbox.Scene) -> None:
    run = sandbox.run(scene, "pymunk", integrator="rk4")
    document = document_in(run._repr_html_())
    assert "refused" in document
    assert "pymunk refuses" in document


def test_run_with_added_bodies_is_displayed(scene: sandbox.Scene) -> None:
    ball = sandbox.Ball(name="new", position=(1.0, 2.0), radius=0.2)
    run = sandbox.run(scene, actions=[sandbox.Spawn(time=0.1, ball=ball)])
    assert "added during the run" in document_in(run._repr_html_())


def test_display_beyond_the_size_limit_has_no_replay(scene: sandbox.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    run = sandbox.run(scene)
    monkeypatch.setattr("sandbox.notebook.MAX_CHARACTERS", 1000)
    document = document_in(run._repr_html_())
    assert "<canvas" not in document
    assert "first contact" in document


TABLE = f"""
title = '{HOSTILE}'
world = {{ duration = 1.0 }}
surface = {{ sliding_friction = 0.2, rolling_friction = 0.01 }}
wall = [{{ points = [[0, 0], [2, 0], [2, 1], [0, 1]], closed = true, height = 0.04, restitution = 0.8 }}]
[[ball]]
name = "cue"
position = [0.3, 0.5]
radius = 0.03
[[ball]]
name = '<b>bold</b>'
position = [0.8, 0.5]
radius = 0.03
[[ball]]
name = "aside"
position = [1.5, 0.9]
radius = 0.03
[[pocket]]
name = '<i>hole</i>'
position = [1.1, 0.5]
radius = 0.06
"""


@pytest.fixture(scope="module")
def table() -> sandbox.Table:
    return sandbox.Table(sandbox.loads(TABLE))


def test_shot_shows_a_replay_paths_and_figures(table: sandbox.Table) -> None:
    shot = table.shoot(sandbox.Stroke(aim=0.0, speed=2.0), record_paths=True)
    assert shot.pocketed["<b>bold</b>"] == "<i>hole</i>"
    text = shot._repr_html_()
    document = document_in(text)
    assert "<canvas" in document
    assert document.count('<path d="M') >= 3  # the wall and two paths
    assert "&lt;b&gt;bold&lt;/b&gt; in &lt;i&gt;hole&lt;/i&gt;" in document
    assert "<b>bold" not in document
    assert "3, of which 2 moved" in document
    assert len(text) < MAX_CHARACTERS


def test_shot_without_recorded_paths_shows_its_end_and_a_hint(table: sandbox.Table) -> None:
    shot = table.shoot(sandbox.Stroke(aim=1.0, speed=2.0))
    document = document_in(shot._repr_html_())
    assert "<canvas" not in document
    assert 'class="paths"' in document
    assert "record_paths=True" in document


def test_shot_that_moves_nothing_is_displayed(table: sandbox.Table) -> None:
    document = document_in(table.shoot(None, record_paths=True)._repr_html_())
    assert "3, of which 0 moved" in document
    assert "all balls at rest" in document


def test_display_of_a_shot_beyond_the_size_limit_has_no_replay(
    table: sandbox.Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    shot = table.shoot(sandbox.Stroke(aim=0.0, speed=2.0), record_paths=True)
    monkeypatch.setattr("sandbox.notebook.MAX_CHARACTERS", 1000)
    document = document_in(shot._repr_html_())
    assert "<canvas" not in document
    assert 'class="paths"' in document


def test_odds_are_displayed_and_represented() -> None:
    odds = sandbox.odds(sandbox.load("9-ball"), count=50)
    document = document_in(odds._repr_html_())
    assert "data:image/png;base64," in document
    assert "50 strokes" in document
    lines = repr(odds).splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("<Odds '9-ball', shot 'break' at 'cue': 50 strokes, seed ")


@pytest.mark.nightly
def test_tradeoff_is_displayed_and_represented(scene: sandbox.Scene) -> None:
    found = sandbox.tradeoff(scene, ["pymunk"], effort=1.0)
    assert "Error against cost" in document_in(found._repr_html_())
    assert "Pareto front; error: " in repr(found).splitlines()[0]
    assert len(repr(found).splitlines()) <= 5


def test_display_of_another_type_raises() -> None:
    with pytest.raises(TypeError, match="no display for int"):
        html_of(1)


def test_renderer_is_not_imported_by_a_run() -> None:
    code = (
        f"import sys, sandbox; run = sandbox.run(sandbox.loads({TEXT!r}));"
        "print([n for n in sys.modules if n.startswith(('sandbox.report', 'sandbox.notebook', 'matplotlib'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout == "[]\n"


def test_representations_are_short(scene: sandbox.Scene) -> None:
    run = sandbox.run(scene)
    assert repr(scene).splitlines()[1] == "  gravity (0, -10) m/s², duration 0.3 s, dt 0.01 s>"
    assert repr(scene).splitlines()[0].endswith(": 1 body, 1 plane, 1 wall, 1 post")
    assert "first contact 0.2" in repr(run)
    simulation = sandbox.start(scene)
    simulation.step()
    assert repr(simulation.frame()) == "<Frame at 0.01 s: 1 body, largest speed 0.1 m/s>"
    assert repr(simulation.contacts()) == "<Contacts: 0>"
    simulation.close()
