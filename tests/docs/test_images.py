"""Pictures of README and documentation: each is referenced, made by the tool, small, and decodable."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from sandbox.scene.files.shipped_scenes import shipped
from tests.docs.examples import ROOT

FOLDER = ROOT / "docs" / "images"
FILES = sorted(path for path in FOLDER.rglob("*") if path.is_file())
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), *sorted((ROOT / "docs").rglob("*.ipynb")))
REFERENCE = re.compile(r"(?:!\[[^\]]*\]\(|:img-top: |\{image\} |\{figure\} |src=\\?\")([^)\s\"\\]+\.(?:png|gif|svg))")
TOTAL, LARGEST_GIF, LARGEST_PNG, LARGEST_THUMBNAIL = 3_100_000, 700_000, 160_000, 9_000
"""bytes"""
THUMBNAIL = (360, 225)
"""px"""


def _referenced() -> set[Path]:
    found = {FOLDER / "scenes" / f"{scene.name.replace('/', '-')}.png" for scene in shipped()}
    for page in PAGES:
        names = REFERENCE.findall(page.read_text(encoding="utf-8"))
        found |= {(page.parent / name).resolve() for name in names if not name.startswith("http")}
    return found


def test_every_referenced_picture_exists() -> None:
    assert sorted(path for path in _referenced() if not path.is_file()) == []


def test_every_picture_is_referenced() -> None:
    assert sorted(set(FILES) - _referenced()) == []


@pytest.mark.fail_slow(60)  # takes over half a second
def test_every_picture_is_made_by_the_tool() -> None:
    tool = [sys.executable, "-m", "tools.images", "--list"]
    done = subprocess.run(tool, cwd=ROOT, capture_output=True, text=True, check=True, timeout=120)
    known = {line.split()[0] for line in done.stdout.splitlines()}
    assert {path.relative_to(FOLDER).as_posix() for path in FILES} == known


def test_total_size_of_pictures_is_limited() -> None:
    assert sum(path.stat().st_size for path in FILES) < TOTAL


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(FOLDER).as_posix())
def test_picture_is_small_and_not_blank(path: Path) -> None:
    is_thumbnail = path.parent.name == "scenes"
    limit = LARGEST_GIF if path.suffix == ".gif" else LARGEST_THUMBNAIL if is_thumbnail else LARGEST_PNG
    assert path.stat().st_size <= limit
    with Image.open(path) as image:
        image.load()
        assert image.size == THUMBNAIL if is_thumbnail else 200 <= min(image.size) <= max(image.size) <= 1600
        low, high = image.convert("L").getextrema()
        assert high - low > 60
        if path.suffix == ".gif":
            assert image.n_frames > 10
            assert image.info["loop"] == 0
            assert 30 <= image.info["duration"] <= 100  # ms: 10 to 33 frames/s
