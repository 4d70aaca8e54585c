"""Benchmarks: what this project claims about speed, as ratios against a peer in the same run.

    python tools/bench.py [NAME…] [--json] [--repeats N]

Ours and the peer take turns, after a warm-up, so that a noisy machine meets both; the ratio is that of the medians.
The rows are those of benches.py and game_benches.py. Times are seconds unless the unit says otherwise.
"""

import argparse
import json
import statistics
import sys
from datetime import UTC, datetime
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from bench_row import Bench
from benches import BENCHES

from sandbox.measure.versions import machine, versions


def measure(bench: Bench, repeats: int) -> dict[str, object]:
    """Time ours and the peer in turns and return the row."""
    ours, peer = bench.ours(), bench.peer()
    ours(), peer()
    best = max if bench.rate else min
    mine, theirs = [], []
    for _ in range(repeats):
        mine.append(ours())
        theirs.append(peer())
    own, other = statistics.median(mine), statistics.median(theirs)
    claimed = own - other if bench.above else own / other
    met = None if bench.target is None else own >= bench.target if bench.rate else claimed <= bench.target
    return {
        "name": bench.name,
        "about": bench.about,
        "ours": own - other if bench.above else own,
        "peer": other,
        "unit": f"{bench.unit} above" if bench.above else bench.unit,
        "ratio": (own - other) / other if bench.above else own / other,
        "target": bench.target,
        "met": met,
        "repeats": repeats,
        "ours_best": min(mine) - min(theirs) if bench.above else best(mine),
        "peer_best": best(theirs),
        "spread": max(theirs) / min(theirs) - 1.0,
    }


def main() -> int:
    """Run the benches named, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(bench.name for bench in BENCHES))
    parser.add_argument("--json", action="store_true", help="one JSON document on standard output")
    parser.add_argument("--repeats", type=int, default=7, metavar="N")
    arguments = parser.parse_args()
    unknown = set(arguments.names) - {bench.name for bench in BENCHES}
    if unknown or arguments.repeats < 1:
        parser.error(f"no bench {', '.join(sorted(unknown))}" if unknown else "--repeats is 1 or more")

    rows, skipped = [], []
    if not arguments.json:
        print(f"{datetime.now(UTC):%Y-%m-%d}", *(f"{k} {v}" for k, v in {**machine(), **versions()}.items()), sep=" · ")
    for bench in BENCHES:
        if arguments.names and bench.name not in arguments.names:
            continue
        if bench.missing and (reason := bench.missing()):
            skipped.append({"name": bench.name, "reason": reason})
            if not arguments.json:
                print(f"{bench.name:<16} left out: {reason}", flush=True)
            continue
        row = measure(bench, arguments.repeats)
        rows.append(row)
        if not arguments.json:
            print(told(row), flush=True)
    if arguments.json:
        date = f"{datetime.now(UTC):%Y-%m-%d}"
        told_of = {"machine": {**machine(), "date": date}, "versions": versions(), "rows": rows}
        print(json.dumps({**told_of, "skipped": skipped} if skipped else told_of))
    return 0


def told(row: dict[str, object]) -> str:
    """Return a row as two lines."""
    verdict = {None: "", True: ", met", False: ", MISSED"}[row["met"]]
    rate = str(row["unit"]).endswith("/s")
    goal = "" if row["target"] is None else f"   target {'>=' if rate else '<='} {row['target']:.3g}{verdict}"
    figure = f"{row['ours']:.3f} s above" if row["unit"] == "s above" else f"{row['ratio']:.3g} ×"
    if rate:
        figure = f"{row['ours']:.3g} /s"
    unit = str(row["unit"]).split()[0]
    return (
        f"{row['name']:<16}{figure:>14}{goal}   (median {row['ours']:.4g} / {row['peer']:.4g} {unit}, "
        f"best {row['ours_best']:.4g} / {row['peer_best']:.4g}, {row['repeats']} repeats, "
        f"peer's spread {row['spread']:.0%})\n"
        f"{'':<16}{row['about']}"
    )


if __name__ == "__main__":
    sys.exit(main())
