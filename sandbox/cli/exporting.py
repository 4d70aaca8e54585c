"""What `sandbox export` is asked for, and whether that can be: everything that is wrong, before the work."""

import math
import os
from dataclasses import dataclass
from pathlib import Path

from sandbox.play.sight import OVERLAYS
from sandbox.scene.faults import Fault, SceneError

TABLES = (".csv", ".parquet")
FILMS = (".gif", ".mp4")
PICTURES = (*FILMS, ".png")
SMALLEST, WIDEST, TALLEST = 16, 7680, 4320
"""px: below, nothing is to be seen; 8K is beyond what players take"""
FASTEST = 240.0
"""pictures/s"""
MOST_PICTURES = 1_000_000
"""of one film: nine hours at 30 a second"""


@dataclass(frozen=True)
class Options:
    """The command line, as it was typed; what was left out is None."""

    targets: tuple[str, ...]
    contacts: bool = False
    fps: float | None = None
    width: int | None = None
    size: str | None = None
    speed: float | None = None
    start: float | None = None
    until: float | None = None
    at: float | None = None
    overlays: tuple[str, ...] = ()

    @property
    def suffixes(self) -> frozenset[str]:
        """Of the targets."""
        return frozenset(Path(target).suffix.lower() for target in self.targets)

    @property
    def picture_size(self) -> tuple[int, int]:
        """Width and height of pictures, px.

        Raises:
            ValueError: `size` is not of the form 960x540.
        """
        if self.size is not None:
            width, _, height = self.size.lower().partition("x")
            return int(width), int(height)
        width_asked = 960 if self.width is None else self.width
        return width_asked, 2 * round(width_asked * 9 / 32)


def check_options(options: Options) -> None:
    """Refuse what cannot be made, whatever the run.

    Raises:
        SceneError: with every fault found.
    """
    messages = [*_of_targets(options), *_of_use(options), *_of_values(options)]
    if messages:
        raise SceneError([Fault(option, None, "", message) for option, message in messages])


def check_times(options: Options, end: float | None) -> None:
    """Refuse times that the run does not have.

    Args:
        options: what was asked for.
        end: of the run, s; None where it has not begun.

    Raises:
        SceneError: with every fault found.
    """
    faults: list[tuple[str, str]] = []
    for option, time in (("--from", options.start), ("--at", options.at)):
        if time is not None and end is not None and end < time < math.inf:
            faults.append((option, f"{time:g} s; the run ends at {end:g} s"))
    if end is not None and not faults:
        last = end if options.until is None else min(options.until, end)
        pictures = (last - (options.start or 0.0)) / (options.speed or 1.0) * (options.fps or 30.0)
        most = _most_pictures(options)
        if most is not None and pictures > most:
            remedy = "give a higher --speed, a lower --fps, or less by --from and --until"
            instead = "; an mp4 may be longer" if ".gif" in options.suffixes else ""
            faults.append(("--to", f"{pictures:,.0f} pictures, and a film holds at most {most:,}: {remedy}{instead}"))
    if faults:
        raise SceneError([Fault(option, None, "", message) for option, message in faults])


def _most_pictures(options: Options) -> int | None:
    if ".gif" in options.suffixes:
        from sandbox.play.footage.limits import MOST_GIF_PICTURES

        return MOST_GIF_PICTURES
    return MOST_PICTURES if ".mp4" in options.suffixes else None


def _of_targets(options: Options) -> list[tuple[str, str]]:
    """Return what is wrong with the files to write."""
    found = []
    if not options.targets:
        found.append(("--to", "says where the run goes; give --to FILE, once or several times"))
    seen: set[Path] = set()
    for target in options.targets:
        path = Path(target)
        suffix = path.suffix.lower()
        if suffix not in (*TABLES, *PICTURES):
            found.append(("--to", f"{target}: the name ends in .csv, .parquet, .gif, .mp4 or .png"))
        try:
            place = path.absolute()
            if place in seen:
                found.append(("--to", f"{target}: named twice"))
            seen.add(place)
            if not place.parent.is_dir():
                found.append(("--to", f"{target}: there is no folder {path.parent}"))
            elif path.is_dir():
                found.append(("--to", f"{target}: is a folder"))
            elif not os.access(place.parent, os.W_OK):
                found.append(("--to", f"{target}: the folder {path.parent} cannot be written to"))
        except (OSError, ValueError) as error:  # such as a name longer than any file's
            reason = (error.strerror if isinstance(error, OSError) else None) or error
            found.append(("--to", f"{target}: {reason}"))
    if ".parquet" in options.suffixes:
        from sandbox.report.tables import NEEDS_PARQUET, can_write_parquet

        found += [] if can_write_parquet() else [("--to", NEEDS_PARQUET)]
    if ".mp4" in options.suffixes:
        from sandbox.play.footage.limits import NEEDS_VIDEO, can_make_mp4

        found += [] if can_make_mp4() else [("--to", NEEDS_VIDEO)]
    return found


def _of_use(options: Options) -> list[tuple[str, str]]:
    """Return the options that say nothing of any of the files."""
    uses = (
        ("--contacts", options.contacts or None, TABLES),
        ("--fps", options.fps, FILMS),
        ("--speed", options.speed, PICTURES),
        ("--width", options.width, PICTURES),
        ("--size", options.size, PICTURES),
        ("--overlay", options.overlays or None, PICTURES),
        ("--at", options.at, (".png",)),
    )
    return [
        (option, f"is for {', '.join(suffixes)}, and no --to FILE is one")
        for option, value, suffixes in uses
        if value is not None and options.targets and options.suffixes.isdisjoint(suffixes)
    ]


def _of_values(options: Options) -> list[tuple[str, str]]:
    """Return what is wrong with the figures."""
    found = []
    for option, time in (("--from", options.start), ("--until", options.until), ("--at", options.at)):
        if time is not None and not (math.isfinite(time) and time >= 0.0):
            found.append((option, f"{time:g} s; a time is 0 or more"))
    if options.start is not None and options.until is not None and options.until < options.start:
        found.append(("--until", f"{options.until:g} s comes before --from, {options.start:g} s"))
    if options.speed is not None and not 1e-6 <= options.speed <= 1e6:
        found.append(("--speed", f"{options.speed:g}; 1 is real time, and it lies between 1e-6 and 1e6"))
    found += _of_rate(options) + _of_size(options)
    unknown = [name for name in options.overlays if name not in OVERLAYS]
    if unknown:
        found.append(("--overlay", f"{', '.join(map(repr, unknown))}; there are {', '.join(OVERLAYS)}"))
    return found


def _of_rate(options: Options) -> list[tuple[str, str]]:
    from sandbox.play.footage.limits import FASTEST_GIF

    if options.fps is None:
        return []
    if not 0.01 <= options.fps <= FASTEST:
        return [("--fps", f"{options.fps:g}; it lies between 0.01 and {FASTEST:g} pictures a second")]
    if ".gif" in options.suffixes and options.fps > FASTEST_GIF:
        return [("--fps", f"{options.fps:g}; a gif shows at most {FASTEST_GIF:g} pictures a second")]
    return []


def _of_size(options: Options) -> list[tuple[str, str]]:
    option = "--width" if options.size is None else "--size"
    if options.width is not None and options.size is not None:
        return [("--width", "gives the size, and so does --size; give one of them")]
    try:
        width, height = options.picture_size
    except ValueError:
        return [(option, f"{options.size!r}; a size is written like 960x540")]
    if not (SMALLEST <= width <= WIDEST and SMALLEST <= height <= TALLEST):
        return [(option, f"{width}x{height}; sizes go from {SMALLEST}x{SMALLEST} to {WIDEST}x{TALLEST} pixels")]
    if ".mp4" in options.suffixes and (width % 2 or height % 2):
        return [(option, f"{width}x{height}; both sides of an mp4 are even")]
    return []
