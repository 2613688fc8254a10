#!/usr/bin/env python3
"""Runs other libraries and ours on the same input, checks that the results agree, and prints the ratios of times.

    python3 benches/compare/compare.py [--quick] [--runs N] [--only TEXT] [--sources DIR] [--json FILE] [--markdown FILE]

See README.md beside this file. Needs Python with venv, and cargo; the C++ peers need cmake and Debian's
liboctomap-dev and libpcl-dev, or sources in the folder DIR, and are left out without these.
"""

import argparse
import os
import sys
from pathlib import Path

from harness import virtual_environment

HERE = Path(__file__).resolve().parent


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small inputs, three runs: a minute or two")
    parser.add_argument("--runs", type=int, help="measured runs of each contestant (default 5, with --quick 3)")
    parser.add_argument("--only", action="append", metavar="TEXT", help="rows with TEXT in the name; may be repeated")
    parser.add_argument("--list", action="store_true", help="print the names of the rows and stop")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write everything measured to FILE")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables to FILE")
    parser.add_argument("--clock", choices=["cpu", "wall"], default="cpu", help="time in the tables (default cpu)")
    parser.add_argument("--core", type=int, help="processor core to run on (default the last one allowed)")
    parser.add_argument("--venv", type=Path, default=HERE / ".venv", help="virtual environment of the Python peers")
    parser.add_argument("--sources", type=Path, metavar="DIR", help="folder with checkouts of more peers")
    parser.add_argument("--data", type=Path, help="folder that holds kitchen/ (default DYMLM_DATA or ../shared/data)")
    return parser.parse_args()


def main() -> int:
    options = arguments()
    virtual_environment.enter(options.venv, HERE / "requirements.txt")
    # From here on, numpy is available.
    from harness import build, inputs, machine, measurement, report, rows

    root = HERE.parents[1]
    data = options.data or Path(os.environ.get("DYMLM_DATA", root.parent / "shared" / "data"))
    runs = options.runs or (3 if options.quick else 5)

    prepared = inputs.prepare(HERE / "build" / "inputs", data)
    chosen = rows.rows(prepared, options.quick)
    if options.only:
        chosen = [row for row in chosen if any(text in row.name for text in options.only)]
    if options.list:
        print("\n".join(row.name for row in chosen))
        return 0

    contestants = build.contestants(HERE, root, options.sources, machine.pinned_core(options.core))
    outcomes = measurement.measure(chosen, contestants, runs, HERE / "build" / "results")
    contestants.close()

    summary = report.Report(outcomes, machine.describe(contestants.versions), options.clock, prepared.description)
    print(summary.text())
    if options.json:
        options.json.write_text(summary.json())
    if options.markdown:
        options.markdown.write_text(summary.markdown())
    return 0 if all(outcome.agreed for outcome in outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())
