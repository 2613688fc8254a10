"""Interleaved runs: every contestant runs once in each round, so that disturbances affect all alike."""

import statistics
import time
from dataclasses import dataclass, field
from pathlib import Path

from .agreement import Agreement
from .build import Contestants
from .program import Refused, Timing
from .rows import Entrant, Row

# A contestant that takes longer than this per run, in seconds, runs only as often as fits into its budget.
SLOW, SLOW_BUDGET = 10.0, 40.0


@dataclass
class Result:
    """One contestant in one row."""

    entrant: Entrant
    timings: list[Timing] = field(default_factory=list)
    # Why there is no timing, if so.
    refusal: str | None = None
    agreement: Agreement | None = None
    output: Path | None = None

    def seconds(self, clock: str) -> float:
        """Median time of the runs."""
        return statistics.median(getattr(timing, clock) for timing in self.timings)


@dataclass
class Outcome:
    """A row with what was measured."""

    row: Row
    results: list[Result]

    @property
    def agreed(self) -> bool:
        """Whether all results that should agree do, and ours refused no request."""
        refused = any(result.refusal is not None for result in self.results if result.entrant.library == "dymlm")
        return not refused and all(result.agreement is None or result.agreement.good for result in self.results)


def measure(rows: list[Row], contestants: Contestants, runs: int, folder: Path) -> list[Outcome]:
    folder.mkdir(parents=True, exist_ok=True)
    outcomes = []
    for row in rows:
        start = time.monotonic()
        print(f"{row.name} ..", end="", flush=True)
        outcomes.append(run_row(row, contestants, runs, folder))
        print(f" {time.monotonic() - start:.0f} s", flush=True)
    return outcomes


def run_row(row: Row, contestants: Contestants, runs: int, folder: Path) -> Outcome:
    results = [Result(entrant) for entrant in row.entrants if entrant.library in contestants.programs]
    first_runs(row, contestants, results, folder)
    check(row, results)

    wanted = {id(result): wanted_runs(result, runs) for result in results}
    for _ in range(runs):
        for result in results:
            if len(result.timings) < wanted[id(result)]:
                run_once(row, contestants, result)
    return Outcome(row, results)


def first_runs(row: Row, contestants: Contestants, results: list[Result], folder: Path) -> None:
    """The first run warms up and leaves its output for the check."""
    for i, result in enumerate(results):
        result.output = folder / f"{i}.output"
        run_once(row, contestants, result, {"result": result.output})


def wanted_runs(result: Result, runs: int) -> int:
    """Number of measured runs. The first run of a slow contestant counts; that of others was for warming up."""
    if result.refusal is not None:
        return 0
    first = result.timings[0].cpu
    if first > SLOW:
        return max(1, min(runs, int(SLOW_BUDGET / first)))
    result.timings.clear()
    return runs


def run_once(row: Row, contestants: Contestants, result: Result, more: dict | None = None) -> None:
    """Adds a timing. A contestant that has refused is not asked again in this row."""
    if result.refusal is not None:
        return
    parameters = row.parameters | result.entrant.parameters | (more or {})
    try:
        result.timings.append(contestants.programs[result.entrant.library].run(row.operation, parameters))
    except Refused as refused:
        result.refusal = str(refused)


def check(row: Row, results: list[Result]) -> None:
    """Compares the outputs, then deletes them, since they are large."""
    ran = [result for result in results if result.refusal is None]
    agreements = row.check(row.parameters, {result.entrant.name: result.output for result in ran})
    for result in ran:
        result.agreement = agreements.get(result.entrant.name)
    for result in ran:
        result.output.unlink()
        result.output.with_suffix(".core").unlink(missing_ok=True)
