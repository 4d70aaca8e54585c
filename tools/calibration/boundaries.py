"""Boundaries: limits of each engine and setup, measured and compared with the stored ones of the last release.

    python -m tools.calibration.boundaries [--store] [--axes NAME,…] [--workers N] [--timeout S]

Without `--store` it prints the changes and exits with 1 if a limit got worse. With it, the measured limits are written
to boundaries.json beside this file and replace the stored ones of the same axes and setups.
"""

import argparse
import json
import os
import sys
from pathlib import Path

from sandbox.measure.extremes import ExtremesPlan, extremes
from sandbox.measure.extremes.baseline import changes, read, store
from sandbox.measure.extremes.runner import SAMPLE_SECONDS
from sandbox.measure.extremes.scenarios import AXES
from sandbox.progress import Progress

STORED = Path(__file__).resolve().parent / "boundaries.json"


def main() -> int:
    """Measure the limits; store them or compare them with the stored ones."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--store", action="store_true", help=f"write {STORED.name}")
    parser.add_argument("--axes", metavar="NAME[,NAME]", default=",".join(AXES), help="which; by default all")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N")
    parser.add_argument("--timeout", type=float, default=SAMPLE_SECONDS, metavar="S", help="of each run")
    arguments = parser.parse_args()
    names = [name.strip() for name in arguments.axes.split(",")]
    unknown = [name for name in names if name not in AXES]
    if unknown or arguments.workers < 1 or not arguments.timeout > 0.0:
        parser.error(f"no axis {', '.join(unknown)}" if unknown else "--workers is 1 or more, --timeout above 0")
    plan = ExtremesPlan(
        tuple(AXES[name] for name in names), pairs=(), seconds=arguments.timeout, workers=arguments.workers
    )
    result = extremes(plan, _print_progress)
    if result.interrupted:
        print("interrupted: nothing is stored or compared", file=sys.stderr)
        return 130
    if arguments.store:
        kept = read(STORED, plan) if STORED.exists() and set(names) != set(AXES) else []
        store(result, STORED, [each for each in kept if each["axis"] not in names])
        print(f"{len(result.limits)} boundaries written: {STORED}")
        return 0
    found = changes(read(STORED, plan), result.limits)
    for change in found:
        print(change)
    print(json.dumps({"compared": len(result.limits), "moved": len(found), "seconds": round(result.seconds)}))
    return int(any(change.worse for change in found))


def _print_progress(progress: Progress) -> None:
    if sys.stderr.isatty():
        print(f"\r\033[K{progress.fraction or 0.0:.0%} {progress.message}", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
