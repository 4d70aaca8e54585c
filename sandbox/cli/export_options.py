"""Options of `export`, and their validation before any work: all faults at once."""

import math
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from sandbox.cli.common import reasons_not_writable
from sandbox.cli.options import OutputOptions
from sandbox.echo import MAX_NAMED, short_repr, shorten
from sandbox.scene.errors import Fault, SceneError
from sandbox.window.playback.snapshot import OVERLAYS

TABLES = (".csv", ".parquet")
FILMS = (".gif", ".mp4")
PICTURES = (*FILMS, ".png")
PROGRAMS = (".py", ".toml")
"""Files that are written from a scene: a program, or the scene itself"""
MIN_SIZE, MAX_WIDTH, MAX_HEIGHT = 16, 7680, 4320
"""px: a smaller picture is illegible, and few players support more than 8K"""
MAX_RATE = 240.0
"""frames/s, more than any display supports"""
MAX_FRAMES = 1_000_000
"""Largest number of frames of a film: nine hours at 30 frames/s."""


@dataclass(frozen=True, kw_only=True)
class Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    run: str
    """stored run, its folder, session or scene"""
    targets: tuple[str, ...]
    contacts: bool = False
    runs: bool = False
    fps: float | None = None
    width: int | None = None
    size: str | None = None
    speed: float | None = None
    start: float | None = None
    until: float | None = None
    at: float | None = None
    overlays: tuple[str, ...] = ()
    overrides: tuple[str, ...] = ()
    force: bool = False

    @property
    def suffixes(self) -> frozenset[str]:
        """File name extensions of the targets."""
        return frozenset(Path(target).suffix.lower() for target in self.targets)

    @property
    def has_program(self) -> bool:
        """Whether a target is written from a scene: a program, or the scene itself."""
        return not self.suffixes.isdisjoint(PROGRAMS)

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
        return width_asked, 2 * round(Fraction(9 * width_asked, 32))  # exact: a float may overflow


def check_options(options: Options) -> None:
    """Check the options that do not depend on the run.

    Raises:
        SceneError: an option is invalid; the error has all faults.
    """
    messages = [
        *_target_faults(options),
        *_unused_options(options),
        *_value_faults(options),
        *_run_table_faults(options),
        *_program_faults(options),
    ]
    if messages:
        raise SceneError([Fault.of(option, message) for option, message in messages])


def check_times(options: Options, end: float | None) -> None:
    """Check times against the duration of the run.

    Args:
        options: the options.
        end: end of the run, s; None if it has no frames.

    Raises:
        SceneError: an option is invalid; the error has all faults.
    """
    faults: list[tuple[str, str]] = []
    for option, time in (("--from", options.start), ("--at", options.at)):
        if time is not None and end is not None and end < time < math.inf:
            faults.append((option, f"is {time:g} s, but the run ends at {end:g} s"))
    if end is not None and not faults:
        last = end if options.until is None else min(options.until, end)
        frames = (last - (options.start or 0.0)) / (options.speed or 1.0) * (options.fps or 30.0)
        limit = _max_frames(options)
        if limit is not None and frames > limit:
            remedy = "use a higher --speed, a lower --fps, or a shorter part by --from and --until"
            instead = "; an mp4 may be longer" if ".gif" in options.suffixes else ""
            faults.append(
                ("--to", f"the film would have {frames:,.0f} frames, the limit is {limit:,}: {remedy}{instead}")
            )
    if faults:
        raise SceneError([Fault.of(option, message) for option, message in faults])


def _max_frames(options: Options) -> int | None:
    if ".gif" in options.suffixes:
        from sandbox.window.capture.limits import MAX_GIF_FRAMES

        return MAX_GIF_FRAMES
    return MAX_FRAMES if ".mp4" in options.suffixes else None


def _target_faults(options: Options) -> list[tuple[str, str]]:
    """Return the faults of the files to write."""
    found = []
    if not options.targets:
        found.append(("--to", "is missing: give --to FILE, once or several times"))
    seen: set[Path] = set()
    for target in options.targets:
        path = Path(target)
        suffix = path.suffix.lower()
        named = shorten(target, MAX_NAMED)
        if suffix not in (*TABLES, *PICTURES, *PROGRAMS):
            found.append(("--to", f"{named}: the name must end in .csv, .parquet, .gif, .mp4, .png, .py or .toml"))
        if path.absolute() in seen:
            found.append(("--to", f"{named}: is given twice"))
        seen.add(path.absolute())
        found += [("--to", f"{named}: {reason}") for reason in reasons_not_writable(path)]
    if ".parquet" in options.suffixes:
        from sandbox.report.table_export import NEEDS_PARQUET, can_write_parquet

        found += [] if can_write_parquet() else [("--to", NEEDS_PARQUET)]
    if ".mp4" in options.suffixes:
        from sandbox.window.capture.limits import NEEDS_VIDEO, can_make_mp4

        found += [] if can_make_mp4() else [("--to", NEEDS_VIDEO)]
    return found


def _unused_options(options: Options) -> list[tuple[str, str]]:
    """Return the options that apply to none of the files."""
    uses = (
        ("--contacts", options.contacts or None, TABLES),
        ("--runs", options.runs or None, TABLES),
        ("--fps", options.fps, FILMS),
        ("--speed", options.speed, PICTURES),
        ("--width", options.width, PICTURES),
        ("--size", options.size, PICTURES),
        ("--overlay", options.overlays or None, PICTURES),
        ("--at", options.at, (".png",)),
        ("--set", options.overrides or None, PROGRAMS),
        ("--force", options.force or None, PROGRAMS),
    )
    return [
        (option, f"applies to {', '.join(suffixes)} only, and no --to FILE is one of these")
        for option, value, suffixes in uses
        if value is not None and options.targets and options.suffixes.isdisjoint(suffixes)
    ]


def _run_table_faults(options: Options) -> list[tuple[str, str]]:
    """Return the options that do not apply to a table of runs."""
    if not options.runs:
        return []
    others = (("--contacts", options.contacts or None), ("--from", options.start), ("--until", options.until))
    found = [(option, "does not apply to a table of runs") for option, value in others if value is not None]
    pictures = [target for target in options.targets if Path(target).suffix.lower() in (*PICTURES, *PROGRAMS)]
    return found + [("--runs", f"{shorten(target, MAX_NAMED)}: is no table") for target in pictures]


def _program_faults(options: Options) -> list[tuple[str, str]]:
    """Return the faults of files that are written from a scene; an existing one may have been edited."""
    if not options.has_program:
        return []
    found = [
        (option, "does not apply to a program or a scene")
        for option, time in (("--from", options.start), ("--until", options.until))
        if time is not None
    ]
    for target in options.targets:
        path, named = Path(target), shorten(target, MAX_NAMED)
        if path.suffix.lower() not in PROGRAMS:
            found.append(
                (
                    "--to",
                    f"{named}: is written from a run, a program or a scene file from a scene; export them separately",
                )
            )
        elif path.is_file() and not options.force:
            found.append(("--to", f"{named}: exists already; add --force to replace it, or name another file"))
    return found


def _value_faults(options: Options) -> list[tuple[str, str]]:
    """Return the faults of times, speed, frame rate, size and overlays."""
    found = []
    for option, time in (("--from", options.start), ("--until", options.until), ("--at", options.at)):
        if time is not None and not (math.isfinite(time) and time >= 0.0):
            found.append((option, f"is {time:g} s; it must be 0 or more"))
    if options.start is not None and options.until is not None and options.until < options.start:
        found.append(("--until", f"is {options.until:g} s, before --from at {options.start:g} s"))
    if options.speed is not None and not 1e-6 <= options.speed <= 1e6:
        found.append(("--speed", f"is {options.speed:g}; it must be between 1e-6 and 1e6 (1 is real time)"))
    found += _rate_faults(options) + _size_faults(options)
    unknown = [name for name in options.overlays if name not in OVERLAYS]
    if unknown:
        found.append(
            ("--overlay", f"unknown: {', '.join(map(short_repr, unknown[:5]))}; overlays: {', '.join(OVERLAYS)}")
        )
    return found


def _rate_faults(options: Options) -> list[tuple[str, str]]:
    from sandbox.window.capture.limits import MAX_GIF_RATE

    if options.fps is None:
        return []
    if not 0.01 <= options.fps <= MAX_RATE:
        return [("--fps", f"is {options.fps:g}; it must be between 0.01 and {MAX_RATE:g} frames per second")]
    if ".gif" in options.suffixes and options.fps > MAX_GIF_RATE:
        return [("--fps", f"is {options.fps:g}; a gif shows at most {MAX_GIF_RATE:g} frames per second")]
    return []


def _size_faults(options: Options) -> list[tuple[str, str]]:
    option = "--width" if options.size is None else "--size"
    if options.width is not None and options.size is not None:
        return [("--width", "cannot be combined with --size; give one of them")]
    try:
        width, height = options.picture_size
    except ValueError:
        return [(option, f"{short_repr(options.size)} is not a size, such as 960x540")]
    if not (MIN_SIZE <= width <= MAX_WIDTH and MIN_SIZE <= height <= MAX_HEIGHT):
        limits = f"{MIN_SIZE}x{MIN_SIZE} to {MAX_WIDTH}x{MAX_HEIGHT} pixels"
        return [(option, f"is {shorten(f'{width}x{height}')}; it must be {limits}")]
    if ".mp4" in options.suffixes and (width % 2 or height % 2):
        return [(option, f"is {width}x{height}; an mp4 needs an even width and height")]
    return []
