"""Scene of two tanks, 140 m apart on level columns."""


def two_tanks(world: str = "", game: str = "", red: str = "", blue: str = "") -> str:
    """Return the text of the scene, with further lines in `[world]`, `[artillery]` and the two players."""
    return f"""
[world]
gravity = [0.0, -9.81]
{world}
[solver]
dt = 0.02
[terrain]
width = 240.0
columns = 240
height = 20.0
[artillery]
{game}
[[artillery.player]]
name = "Red"
position = 50.0
{red}
[[artillery.player]]
name = "Blue"
position = 190.0
{blue}
"""
