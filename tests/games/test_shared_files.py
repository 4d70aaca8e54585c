"""Shared files do not name any game: a game is one folder and one line in `sandbox/game_names.py`."""

import re
from pathlib import Path

import sandbox
from sandbox.game_names import GAME_SPECS, GAMES

PACKAGE = Path(sandbox.__file__).parent
COMMON_WORDS = {"free"}
"""names of games that are also ordinary words"""
NAMES = {*GAME_SPECS, *GAMES, "billiard"} - COMMON_WORDS


def test_shared_files_of_window_and_games_name_no_game() -> None:
    files = [*(PACKAGE / "window").rglob("*.py"), *(PACKAGE / "games").glob("*.py")]
    assert len(files) > 20
    pattern = re.compile("|".join(map(re.escape, sorted(NAMES))), re.IGNORECASE)
    matches = [
        f"{file.relative_to(PACKAGE)}: {line.strip()}"
        for file in files
        for line in file.read_text(encoding="utf-8").splitlines()
        if pattern.search(line)
    ]
    assert not matches


def test_registry_lists_the_folder_of_every_game() -> None:
    folders = {path.parent.name for path in (PACKAGE / "games").glob("*/__init__.py")}
    assert set(GAME_SPECS) == folders
