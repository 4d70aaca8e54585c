"""Resource limits: how much memory and work a command may ask for, checked before either is spent; free memory.

The defaults keep each load, start and step within some 20 s and 4 GiB. Every limit has an environment variable that
sets another value, which reaches worker processes too:

    SANDBOX_MAX_MEMORY=80GiB sandbox run table.toml --engine exact

Limits that follow from number formats or from the validity of the physics, such as the number of bodies, are not here.
Frames have no limit of their own: they may take `FREE_FRACTION` of the free memory.
"""

import math
import os
import re
from dataclasses import dataclass
from pathlib import Path

try:
    import resource
except ImportError:  # not on Windows
    resource = None  # type: ignore[assignment]

UNITS = {"": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12}
UNITS |= {"B": 1, "KIB": 2**10, "MIB": 2**20, "GIB": 2**30, "TIB": 2**40}

LARGEST = 2**62
"""Kernels compare with 64-bit integers."""

FREE_FRACTION = 0.6
"""of the free memory that the arrays of one run may take"""

_NUMBER = re.compile(r"\s*(\d[\d_]{0,30}(?:\.\d{1,30})?(?:e\d{1,2})?)\s*([a-z]{0,3})\s*", re.ASCII | re.IGNORECASE)


class LimitValueError(ValueError):
    """The environment variable of a limit does not hold an amount."""


class TooLargeError(ValueError):
    """The arrays of a run would not fit into memory, or the run has too many steps; `str()` has the amounts."""


@dataclass(frozen=True)
class ResourceLimit:
    """One limit: what it bounds, and the environment variable that changes it."""

    variable: str
    default: int
    bounds: str
    reason: str
    """for the default"""
    in_bytes: bool = False

    @property
    def value(self) -> int:
        """The limit in force.

        Raises:
            LimitValueError: the environment variable holds no amount.
        """
        text = os.environ.get(self.variable)
        return self.default if text is None or not text.strip() else self._parsed(text)

    def refusal(self, subject: str, needed: float) -> str | None:
        """Return why something is refused that needs so much, and how to allow it; None where it is within the limit.

        Args:
            subject: what needs it, and a verb, such as "the pairs of 100,000 balls take".
            needed: bytes, or a count.

        Raises:
            LimitValueError: the environment variable holds no amount.
        """
        if needed <= self.value:
            return None
        return f"{subject} {self.shown(needed)}, and {self.remedy(needed)}"

    def remedy(self, needed: float) -> str:
        """Return the limit in force, and how to allow what needs more: `the limit is …; set …=… to allow it`."""
        bound = f"the limit is {self.shown(self.value)}"
        if needed > LARGEST:
            return bound
        return f"{bound}; set {self.variable}={self._setting(needed)} to allow it"

    def shown(self, amount: float) -> str:
        """Return an amount as messages show it."""
        if not self.in_bytes:
            return f"{amount:,.0f}" if amount < 1e7 else f"{amount:.3g}".replace("e+0", "e").replace("e+", "e")
        unit = next((unit for unit in ("TiB", "GiB", "MiB", "KiB") if amount >= UNITS[unit.upper()]), "B")
        return f"{amount / UNITS[unit.upper()]:.3g} {unit}"

    def _setting(self, needed: float) -> str:
        """Return a value of the variable that suffices: the next two digits up."""
        if self.in_bytes:
            unit = "GiB" if needed > UNITS["GIB"] else "MiB"
            return f"{math.ceil(needed / UNITS[unit.upper()])}{unit}"
        digit = 10 ** max(len(str(math.ceil(needed))) - 2, 0)
        return f"{math.ceil(needed / digit) * digit:_}"

    def _parsed(self, text: str) -> int:
        match = _NUMBER.fullmatch(text)
        unit = match[2].upper() if match else ""
        if match is None or (unit and not self.in_bytes) or unit not in UNITS:
            example = "an amount of memory such as 16GiB" if self.in_bytes else "a number such as 2_000_000"
            shown = text if len(text) <= 40 else f"{text[:40]}…"
            raise LimitValueError(f"the environment variable {self.variable} is {shown!r}; it must be {example}")
        return int(min(float(match[1].replace("_", "")) * UNITS[unit], LARGEST))


MEMORY = ResourceLimit(
    "SANDBOX_MAX_MEMORY",
    2 * 2**30,
    "memory of one table of pairs, or of bodies and zones",
    "the whole process then fits into 4 GiB",
    in_bytes=True,
)
PAIRS = ResourceLimit(
    "SANDBOX_MAX_PAIRS",
    300_000_000,
    "pairs that one search for neighbours tests, or that attract each other in one step",
    "5 to 50 ns each",
)
STEP_WORK = ResourceLimit(
    "SANDBOX_MAX_STEP_WORK",
    100_000_000,
    "contacts and joints × (iterations + 10) × substeps of one step",
    "up to 0.2 μs each",
)
OVERLAPS = ResourceLimit(
    "SANDBOX_MAX_OVERLAPS",
    1_000_000,
    "pairs at the start of a scene: bodies that overlap without colliding, pieces close to each other, bodies in zones",
    "every engine tests them in each step, which takes a second",
)
CONTACTS = ResourceLimit(
    "SANDBOX_MAX_CONTACTS",
    20_000_000,
    "contacts recorded in one run",
    "1.4 GB of memory",
)
EVENTS = ResourceLimit(
    "SANDBOX_MAX_EVENTS",
    2_000_000,
    "events of one billiard shot; the limit per simulated second on `exact` is a tenth of it",
    "a few seconds of computing",
)
SPACE_SIZE = ResourceLimit(
    "SANDBOX_MAX_SPACE_SIZE",
    250_000,
    "bodies and joints of a pymunk space; those in free flight are not in it",
    "up to 0.08 ms each to add",
)
STEP_PIECES = ResourceLimit(
    "SANDBOX_MAX_STEP_PIECES",
    40_000,
    "pieces into which detection `shrink` cuts a step",
    "0.1 ms each for a few bodies, 0.4 ms for a pinball table",
)
FILE_SIZE = ResourceLimit(
    "SANDBOX_MAX_FILE_SIZE",
    8 * 2**20,
    "size of a scene file",
    "50,000 balls with all of their keys, read in 10 s; most TOML is read at 0.5 to 3 MB/s",
    in_bytes=True,
)
SESSION_SIZE = ResourceLimit(
    "SANDBOX_MAX_SESSION_SIZE",
    64 * 2**20,
    "size of a recorded session, also of one within a stored run",
    "500,000 actions; as parsed JSON it takes up to 25 times as much memory",
    in_bytes=True,
)
RUNS = ResourceLimit(
    "SANDBOX_MAX_RUNS",
    100_000_000,
    "runs of one command, and values of one range",
    "at 1,000 runs a second they take more than a day",
)
PLAN_MEMORY = ResourceLimit(
    "SANDBOX_MAX_PLAN_MEMORY",
    256 * 2**20,
    "memory of the checked scenes of a sweep that are kept until they run",
    "scenes beyond it are read again when they run",
    in_bytes=True,
)

LIMITS = (
    MEMORY,
    PAIRS,
    STEP_WORK,
    OVERLAPS,
    CONTACTS,
    EVENTS,
    SPACE_SIZE,
    STEP_PIECES,
    FILE_SIZE,
    SESSION_SIZE,
    RUNS,
    PLAN_MEMORY,
)


def check_environment() -> None:
    """Read all limits once.

    Raises:
        LimitValueError: an environment variable holds no amount.
    """
    for limit in LIMITS:
        _ = limit.value


def free_memory() -> int:
    """Return the bytes that this process may still allocate: the free memory, within its limit of address space."""
    return max(int(min(_free_in_system(), _free_in_address_space())), 0)


def _free_in_system() -> float:
    """Return the bytes that are free, or half of what there is where that is unknown, or 4 GiB."""
    for name, fraction in (("SC_AVPHYS_PAGES", 1.0), ("SC_PHYS_PAGES", 0.5)):
        try:
            return os.sysconf("SC_PAGE_SIZE") * os.sysconf(name) * fraction
        except (AttributeError, ValueError, OSError):
            continue
    return 4.0 * 2**30


def _free_in_address_space() -> float:
    """Return the bytes below the process's limit of address space (`ulimit -v`), inf where it has none."""
    if resource is None:
        return math.inf
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return math.inf
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except OSError:  # no Linux
        pages = 0
    return limit - pages * os.sysconf("SC_PAGE_SIZE")


def read_limited(path: Path, max_bytes: int) -> bytes:
    """Return the bytes of a file, which may be a pipe or a device without an end.

    Args:
        path: path of the file.
        max_bytes: largest size.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is larger.
    """
    with path.open("rb") as stream:
        content = stream.read(max_bytes + 1)
    if len(content) > max_bytes:
        raise ValueError(f"larger than {max_bytes >> 20} MiB")
    return content
