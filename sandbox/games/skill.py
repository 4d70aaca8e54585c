"""Skill: how well a player plays that is a program, from 0 to 1."""


def checked_skill(skill: float) -> float:
    """Return a skill as it is.

    Raises:
        ValueError: it is not from 0 to 1.
    """
    if not 0.0 <= skill <= 1.0:
        raise ValueError(f"skill {skill:g} is out of range; it should be 0 to 1")
    return skill
