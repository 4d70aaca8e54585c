"""Each command run once with `--json`: exit status, published schema, and the keys that docs/reference/json.md has."""

import json
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

import sandbox
from sandbox.action import Impulse
from sandbox.cli.json_schemas import DOCUMENTS
from sandbox.cli.main import COMMANDS, call
from sandbox.recording import RecordedGame, Recording, ReplayCheck
from tests.cli.json_validation import assert_valid_document

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

PAGE = (Path(__file__).parents[2] / "docs/reference/json.md").read_text(encoding="utf-8")
NO_DOCUMENT = {"play", "replay", "serve", "schema", "warm"}
"""Commands without a JSON document."""

BAD = "[world]\nduraton = 1\n"

SAMPLES: dict[str, tuple[str, ...]] = {
    "Faults": ("run bad.toml",),
    "sandbox run": (
        "run bounce --set world.duration=0.1 --ledger",
        "run tunnel.toml --out damaged",
        "run 9-ball --engine exact --set world.duration=0.1",
        "run landing --seeds 2 --player none --set world.duration=0.2",
        "run session.json",
        "run lacking.json",
        "run tunnel.toml --observe figures.py:figure",
    ),
    "sandbox run --dry-run": ("run tunnel.toml --sweep solver.dt=0.01,0.005 --dry-run",),
    "sandbox runs": ("runs store", "runs store --by engine --of contacts"),
    "sandbox import": ("import level.svg", "import level.svg --to level.toml"),
    "sandbox check": (
        "check bounce",
        "check bullet",
        "check landing --no-trial",
        "check bad.toml",
        "check lacking.json",
    ),
    "sandbox compare": (
        "compare tunnel.toml --engines pymunk,exact --why",
        "compare tunnel.toml --engines pymunk,exact --minimise small.toml",
        "compare tunnel.toml --engine pymunk --sweep solver.dt=0.01,0.005",
        "compare lacking.json --engine pymunk",
    ),
    "sandbox tradeoff": (
        "tradeoff pendulum_90 --effort 0.01 --tolerance 1 --set world.duration=0.2",
        "tradeoff tunnel.toml --effort 0.01 --tolerance 0.5",
        "tradeoff lacking.json --effort 0.01 --tolerance 0.5",
    ),
    "sandbox advise": (
        "advise tunnel.toml --effort 0.1 --repeats 1",
        "advise acted.json --effort 0.1 --repeats 1",
        "advise lacking.json --effort 0.1 --repeats 1 --tolerance 0.5m",
    ),
    "sandbox advise GAME.py": (
        "advise --starts 1 --pixels --tolerance 20px shooting.py",
        "advise --starts 1 --zoom 5 --tolerance 4m shooting.json",
    ),
    "sandbox rehearse": ("rehearse shooting.py --substeps 8", "rehearse shooting.py"),
    "sandbox extremes": ("extremes --quick --axes speed --engines pymunk --against against.json",),
    "sandbox report": ("report tunnel.toml --effort 0 --engines exact --out page.html",),
    "sandbox shots": ("shots 9-ball --count 20 --sensitivity --horizon --window '7:upper left pocket'",),
    "sandbox miss": ("miss duel",),
    "sandbox match": ("match straight-rail --players bot:0.5,bot:1 --turns 2",),
    "sandbox export": (
        "export store --to run.csv",
        "export store --to run.png",
        "export bent.toml --to game.py",
        "export lacking.json --to level.toml",
    ),
    "sandbox record": ("record --to recorded.json played.py",),
    "sandbox scenes": ("scenes",),
    "sandbox engines": ("engines",),
}
"""Commands that together print all keys of a section, by section of the page."""

SLOW = [
    f"sandbox {name}"
    for name in ("compare", "tradeoff", "advise", "advise GAME.py", "extremes", "report", "shots", "match")
]
"""Sections of which all samples run in the nightly part, and the first one in CI."""
UNSUCCESSFUL = ("extremes", "match")
"""Commands whose samples end with status 1: a limit is worse than the stored one, and a frame is abandoned."""

BENT = """title = "bent"
[[wall]]
points = [[0, -9], [5, -9], [9, -8]]
[[box]]
position = [1, -8]
size = [1, 1]
"""

PLAYED = """
import pymunk
space = pymunk.Space()
body = pymunk.Body(1, 1)
space.add(body, pymunk.Circle(body, 1))
space.step(0.01)
"""
SHOOTING = """
import pymunk
space = pymunk.Space()
wall = pymunk.Segment(space.static_body, (50, -50), (50, 50), 1)
body = pymunk.Body(1, 1)
body.velocity = 300, 0
shape = pymunk.Circle(body, 3)
wall.collision_type, shape.collision_type = 1, 2
space.add(body, shape, wall)
space.on_collision(1, 2, begin=lambda arbiter, space, data: None, post_solve=lambda arbiter, space, data: None)
for _ in range(20):
    space.step(1 / 60)
"""
TUNNEL = """
world = { duration = 0.2 }
solver = { dt = 0.01 }
wall = [{ name = "wall", points = [[1.0, -1.0], [1.0, 1.0]], thickness = 0.01 }]

[[ball]]
name = "bullet"
position = [0.0, 0.0]
velocity = [20.0, 0.0]
radius = 0.05
restitution = 1.0
"""


@dataclass
class Key:
    """A documented key and its child keys."""

    free: bool = False
    """whether it may have keys that are not documented"""
    printed: bool = False
    children: "dict[str, Key]" = field(default_factory=dict)


def documented(section: str) -> Key:
    """Read the tables of a section."""
    text = re.split(r"^## ", PAGE.split(f"\n## {section}\n")[1], maxsplit=1, flags=re.MULTILINE)[0]
    root = Key()
    for line in text.splitlines():
        if not line.startswith("| `"):
            continue
        paths, kind = line.split("|")[1:3]
        for path in re.findall(r"`([^`]+)`", paths):
            key = root
            for name in path.replace("[]", ".[]").split("."):
                key = key.children.setdefault(name, Key())
            key.free = bool(re.search(r"\bopen\b|settings|changes|any", kind))
    return root


def undocumented(printed: Any, key: Key, path: str = "") -> Iterator[str]:
    """Yield the printed keys that are not documented; mark the others as printed."""
    key.printed = True
    if isinstance(printed, dict):
        for name, value in printed.items():
            child = key.children.get(name) or key.children.get("NAME")
            if child is not None:
                yield from undocumented(value, child, f"{path}.{name}")
            elif not key.free:
                yield f"{path}.{name}"
    elif isinstance(printed, list):
        element = key.children.get("[]")
        for value in printed:
            if element is not None:
                yield from undocumented(value, element, f"{path}[]")
            elif isinstance(value, dict) and not key.free:
                yield f"{path}[]"


def never_printed(key: Key, path: str = "") -> Iterator[str]:
    """Yield the documented keys that were never printed."""
    for name, child in key.children.items():
        if not child.printed and (name != "[]" or child.children):  # a list may be empty
            yield f"{path}.{name}"
        else:
            yield from never_printed(child, f"{path}.{name}")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to a folder with the files and stores that the samples use."""
    monkeypatch.chdir(tmp_path)
    Path("bad.toml").write_text(BAD)
    Path("tunnel.toml").write_text(TUNNEL)
    Path("bent.toml").write_text(BENT)
    Path("played.py").write_text(PLAYED)
    Path("shooting.py").write_text(SHOOTING)
    call(["record", "--quiet", "shooting.py"])
    Path("figures.py").write_text("def figure(run):\n    return len(run.time)\n")
    Path("level.svg").write_text('<svg viewBox="0 0 9 9"><circle r="5"/><text>x</text></svg>')
    limit = {"axis": "speed", "engine": "pymunk", "setup": "pymunk", "limit": 50.0, "first_failure": 60.0}
    Path("against.json").write_text(json.dumps({"limits": [limit]}))
    scene = sandbox.loads(TUNNEL)
    Recording(scene, "pymunk", scene.solver, (), duration=0.1).save("session.json")
    push = Impulse(time=0.05, body="bullet", impulse=(1.0, 0.0))
    Recording(scene, "pymunk", scene.solver, (push,), duration=0.2).save("acted.json")
    game = RecordedGame(omitted=("a joint",), replay=ReplayCheck(False, 1, "bullet", 0.5, "bullet", 0.25))
    Recording(scene, "pymunk", scene.solver, (), duration=0.2, game=game).save("lacking.json")
    for store in ("store", "damaged"):
        call(["run", "tunnel.toml", "--out", store, "--quiet"])
    (stored,) = Path("damaged").glob("*.npz")
    stored.write_bytes(b"")
    return tmp_path


def check_sample(sample: str, keys: Key, section: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Run a sample; check its exit status and its document, and mark the printed keys."""
    command, *arguments = shlex.split(sample)
    schema = "advise-game" if section == "sandbox advise GAME.py" else command
    status = call([command, "--json", *arguments])  # `record` passes what follows its file to the game
    document = json.loads(capsys.readouterr().out)
    assert status == (2 if "bad.toml" in sample else command in UNSUCCESSFUL)
    if schema in DOCUMENTS and "--dry-run" not in sample and section != "Faults":
        assert_valid_document(schema, document)
    if section == "Faults":
        document = {"faults": document["faults"]}
    assert list(undocumented(document, keys)) == [], sample


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "section", [pytest.param(each, marks=pytest.mark.nightly) if each in SLOW else each for each in SAMPLES]
)
def test_every_printed_key_is_documented_and_every_documented_key_is_printed(section, capsys):
    keys = documented(section)
    for sample in SAMPLES[section]:
        check_sample(sample, keys, section, capsys)
    assert list(never_printed(keys)) == []


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("section", SLOW)
def test_document_of_a_slow_command_is_valid_and_documented(section: str, capsys: pytest.CaptureFixture[str]) -> None:
    check_sample(SAMPLES[section][0], documented(section), section, capsys)


def test_every_command_has_a_section() -> None:
    assert {f"sandbox {name}" for name in COMMANDS} - {f"sandbox {name}" for name in NO_DOCUMENT} <= set(SAMPLES)
