#!/usr/bin/env python3
"""Writes the medians of the criterion benches, as the last run left them, as a table of Markdown.

    cargo bench -p dymlm-benches && python3 benches/medians.py target/criterion docs/benchmarks.md

The file is in the repository, so that its history has the medians of each commit for which it was written.
"""

import json
import subprocess
import sys
from datetime import date
from pathlib import Path

HEAD = """# Medians of the criterion benches

Written by `.ci/nightly performance` on {day}, commit {commit}; do not edit. Times are of that machine and that day:
compare them with each other, and with another commit's only where the machine is the same.

A run of a bench may handle many items (points, frames, questions): where it says how many, the last column is the median of
one. The rest of a row is the whole run.

| bench | median | its 95 % confidence interval | items | an item |
|---|---|---|---:|---:|
"""


def time(nanoseconds: float) -> str:
    for unit, size in [("s", 1e9), ("ms", 1e6), ("us", 1e3)]:
        if nanoseconds >= size:
            return f"{nanoseconds / size:.3g} {unit}"
    return f"{nanoseconds:.3g} ns"


def row(estimates: Path) -> tuple[str, str]:
    bench = json.loads(estimates.with_name("benchmark.json").read_text())
    name, items = bench["full_id"], (bench.get("throughput") or {}).get("Elements", 1)
    median = json.loads(estimates.read_text())["median"]
    interval = median["confidence_interval"]
    low, high = time(interval["lower_bound"]), time(interval["upper_bound"])
    each = f"{items} | {time(median['point_estimate'] / items)}" if items > 1 else " | "
    return name, f"| {name} | {time(median['point_estimate'])} | {low} to {high} | {each} |\n"


def main() -> int:
    criterion, out = map(Path, sys.argv[1:])
    rows = sorted(row(path) for path in criterion.glob("**/new/estimates.json"))
    if not rows:
        print(f"no bench was run: nothing in {criterion}", file=sys.stderr)
        return 1
    command = ["git", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    out.write_text(HEAD.format(day=date.today(), commit=commit) + "".join(text for _, text in rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
