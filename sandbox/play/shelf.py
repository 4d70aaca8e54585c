"""Shelf: the scene files that lie beside the one that was opened, and the shipped ones."""

from pathlib import Path

from sandbox.scene.files.shipped_scenes import shipped


def beside(path: Path | None) -> tuple[Path, ...]:
    """Return the scene files to walk through from one: those of its folder, or where none is open, the shipped."""
    if path is None:
        return tuple(scene.path for scene in shipped())
    try:
        found = sorted(path.parent.glob("*.toml"))
    except OSError:  # the folder has gone, or may not be read: what is open can still be played
        found = []
    known = {file.resolve() for file in found}
    return tuple(found) if path.resolve() in known else (path, *found)


def neighbour(path: Path | None, by: int) -> Path | None:
    """Return the scene file so many places on, round and round; None where there is none."""
    files = beside(path)
    if not files:
        return None
    if path is None:
        return files[0 if by > 0 else -1]
    here = next((k for k, file in enumerate(files) if file.resolve() == path.resolve()), 0)
    return files[(here + by) % len(files)]


def to_pick(path: Path | None) -> list[tuple[str, Path]]:
    """Return what a picker offers, by name: the shipped scenes, and those beside the one that is open."""
    own = [(scene.name, scene.path) for scene in shipped()]
    known = {file.resolve() for _, file in own}
    others = [file for file in (beside(path) if path is not None else ()) if file.resolve() not in known]
    return [*((f"{file.parent.resolve().name}/{file.stem}", file) for file in others), *own]
