"""Benchmarks: the speed claims of this project, as ratios against a peer in the same run.

    python tools/bench.py [NAME…] [--json] [--repeats N]

Each row first checks that both sides compute the same, if they should. After a warm-up the sides take turns, so that
a noisy machine affects both; the ratio is that of the medians, with a 95 % interval by paired bootstrap. The rows are
in suite.py and games.py. Times are in seconds unless the unit says otherwise: processor time where one thread works,
wall time where threads or processes do.
"""

import argparse
import gc
import json
import statistics
import sys
from datetime import UTC, datetime
from typing import Any

from sandbox.provenance import machine, versions
from tools.benchmarks.row import Bench, ratio
from tools.benchmarks.suite import BENCHES
from tools.benchmarks.workloads import Timed


def measure(bench: Bench, repeats: int) -> dict[str, Any]:
    """Check that both sides compute the same, time them in turns and return the row.

    The first side alternates, and the garbage collector runs between the timings, not during them.

    Raises:
        AssertionError: the sides do not compute the same.
    """
    if bench.same is not None:
        bench.same()
    ours, peer = bench.ours(), bench.peer()
    ours(), peer()
    best = max if bench.rate else min
    our_values: list[float] = []
    peer_values: list[float] = []
    for k in range(repeats):
        turns = [(ours, our_values), (peer, peer_values)]
        for work, values in turns if k % 2 == 0 else reversed(turns):
            values.append(_without_collection(work))
    our_median, peer_median = statistics.median(our_values), statistics.median(peer_values)
    result = bench.result(our_values, peer_values)
    compared = ratio(our_values, peer_values)
    met = None if bench.target is None else result.value >= bench.target if bench.rate else result.value <= bench.target
    return {
        "name": bench.name,
        "about": bench.about,
        "ours": result.value if bench.above else our_median,
        "peer": peer_median,
        "unit": f"{bench.unit} above" if bench.above else bench.unit,
        "ratio": compared.value - bench.above,
        "ratio_interval": [compared.low - bench.above, compared.high - bench.above],
        "interval": [result.low, result.high],
        "target": bench.target,
        "met": met,
        "spans_target": None if bench.target is None else result.spans(bench.target),
        "repeats": repeats,
        "ours_best": min(our_values) - min(peer_values) if bench.above else best(our_values),
        "peer_best": best(peer_values),
        "spread": max(peer_values) / min(peer_values) - 1.0,
        "ours_spread": max(our_values) / min(our_values) - 1.0,
        "same": "checked" if bench.same is not None else None,
    }


def _without_collection(work: Timed) -> float:
    """Return the value that a workload measures, with the garbage collector off."""
    gc.collect()
    gc.disable()
    try:
        return work()
    finally:
        gc.enable()


def main() -> int:
    """Run the named benches, or all."""
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
                print(f"{bench.name:<32}left out: {reason}", flush=True)
            continue
        row = measure(bench, arguments.repeats)
        rows.append(row)
        if not arguments.json:
            print(format_row(row), flush=True)
    if arguments.json:
        date = f"{datetime.now(UTC):%Y-%m-%d}"
        document = {"machine": {**machine(), "date": date}, "versions": versions(), "rows": rows}
        print(json.dumps({**document, "skipped": skipped} if skipped else document))
    return 0


def format_row(row: dict[str, Any]) -> str:
    """Return a row as two lines of text."""
    unit, rate = str(row["unit"]).split()[0], str(row["unit"]).endswith("/s")
    result = f"{row['ratio']:.3g} × ({_interval(row['ratio_interval'])})"
    if rate:
        result = f"{row['ours']:.3g} {unit} ({_interval(row['interval'])}), {result} the peer"
    elif row["unit"] != unit:
        result = f"{row['ours']:.3f} {unit} above ({_interval(row['interval'])})"
    target = ""
    if row["target"] is not None:
        undecided = ", but the interval spans it" if row["spans_target"] else ""
        target = (
            f"   target {'>=' if rate else '<='} {row['target']:.3g}{', met' if row['met'] else ', MISSED'}{undecided}"
        )
    return (
        f"{row['name']:<32}{result}{target}   (median {row['ours']:.4g} / "
        f"{row['peer']:.4g} {unit}, best {row['ours_best']:.4g} / {row['peer_best']:.4g}, "
        f"{row['repeats']} repeats, spread {row['ours_spread']:.0%} / {row['spread']:.0%})\n"
        f"{'':<32}{row['about']}"
    )


def _interval(ends: list[float]) -> str:
    """Return an interval as text."""
    return "{:.3g} to {:.3g}".format(*ends)


if __name__ == "__main__":
    sys.exit(main())
