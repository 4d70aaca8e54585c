"""Scene of two tanks, 140 m apart on level columns."""

from tests.toml_text import toml


def two_tanks(world: str = "", game: str = "", red: str = "", blue: str = "") -> str:
    """Return the text of the scene, with further lines in `[world]`, `[artillery]` and the two players."""
    return (
        f"{toml('world', gravity=[0.0, -9.81])}{world}\n{toml('solver', dt=0.02)}"
        f"{toml('terrain', width=240.0, columns=240, height=20.0)}{toml('artillery')}{game}\n"
        f"{toml('artillery.player', name='Red', position=50.0)}{red}\n"
        f"{toml('artillery.player', name='Blue', position=190.0)}{blue}\n"
    )
