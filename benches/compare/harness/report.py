"""The measurements as text, JSON and Markdown."""

import json
from dataclasses import dataclass

from .measurement import Outcome, Result


@dataclass
class Verdict:
    """A line of the summary: ours against one peer."""

    ours: Result
    peer: Result
    ratio: float

    @classmethod
    def of(cls, outcome: Outcome, clock: str) -> "Verdict | None":
        """Ours against the peer that the row's aim names, or else the best peer."""
        return cls.against(outcome, clock, outcome.row.aim.against if outcome.row.aim else None)

    @classmethod
    def of_best(cls, outcome: Outcome, clock: str) -> "Verdict | None":
        """Ours against the best peer, where that is not the one that the aim names."""
        named, best = cls.of(outcome, clock), cls.against(outcome, clock, None)
        return None if best is None or named is not None and best.peer is named.peer else best

    @classmethod
    def against(cls, outcome: Outcome, clock: str, name: str | None) -> "Verdict | None":
        timed = [result for result in outcome.results if result.timings]
        ours = next((result for result in timed if result.entrant.name == "dymlm"), None)
        peers = [r for r in timed if r.entrant.library != "dymlm" and name in (None, r.entrant.name)]
        peers = [r for r in peers if r.agreement is None or r.agreement.reached]
        if ours is None or not peers:
            return None
        peer = min(peers, key=lambda result: result.seconds(clock))
        return cls(ours, peer, peer.seconds(clock) / ours.seconds(clock))


class Report:
    def __init__(self, outcomes: list[Outcome], machine: dict, clock: str, inputs: dict[str, str]):
        self.outcomes, self.machine, self.clock, self.inputs = outcomes, machine, clock, inputs

    def text(self) -> str:
        tables = [self.summary(), self.details()]
        return "\n" + self.headline() + "\n\n" + "\n\n".join(map(plain_table, tables))

    def markdown(self) -> str:
        inputs = "\n".join(f"- {name}: {text}" for name, text in self.inputs.items())
        summary, details = markdown_table(self.summary()), markdown_table(self.details())
        sections = [
            "# Other libraries and ours",
            "Written by `benches/compare/compare.py --markdown`; do not edit. What is measured, and how: benches/compare/README.md.",
            self.headline(),
            summary,
            "## All contestants",
            details,
            "## Inputs",
            inputs,
        ]
        return "\n\n".join(sections) + "\n"

    def json(self) -> str:
        rows = []
        for outcome in self.outcomes:
            verdict, row = Verdict.of(outcome, self.clock), outcome.row
            rows.append(
                {
                    "name": row.name,
                    "operation": row.operation,
                    "parameters": {key: str(value) for key, value in row.parameters.items()},
                    "unit": row.unit,
                    "count": row.count,
                    "aim": row.aim.factor if row.aim else None,
                    "ratio": verdict.ratio if verdict else None,
                    "peer": verdict.peer.entrant.name if verdict else None,
                    "contestants": [contestant(result) for result in outcome.results],
                }
            )
        measured = {"machine": self.machine, "clock": self.clock, "inputs": self.inputs, "rows": rows}
        return json.dumps(measured, indent=1)

    def headline(self) -> str:
        machine, clock = self.machine, {"cpu": "processor time", "wall": "wall time"}[self.clock]
        processor = f"{machine['cpu']} at {machine['ghz']} GHz, {machine['cores']} cores (load {machine['load']})"
        versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
        return (
            f"{machine['date']}, {processor}; one thread on one core each, medians of interleaved runs, {clock}. "
            f"{versions}."
        )

    def summary(self) -> list[list[str]]:
        table = [["comparison", "dymlm", "peer", "its time", "ratio", "aim", "agrees"]]
        for outcome in self.outcomes:
            verdict, best = Verdict.of(outcome, self.clock), Verdict.of_best(outcome, self.clock)
            if verdict is not None:
                table.append(self.line(outcome, verdict, aim_of(outcome, verdict)))
            if best is not None:
                table.append(self.line(outcome, best, ""))
            if verdict is None and best is None:
                table.append([outcome.row.name, "", "none ran", "", "", "", ""])
        return table

    def line(self, outcome: Outcome, verdict: Verdict, aim: str) -> list[str]:
        ours, theirs = (self.time(outcome, result, self.clock) for result in (verdict.ours, verdict.peer))
        agrees = "yes" if outcome.agreed else "NO"
        return [outcome.row.name, ours, verdict.peer.entrant.name, theirs, f"{verdict.ratio:.1f}x", aim, agrees]

    def details(self) -> list[list[str]]:
        table = [["comparison", "contestant", "processor", "wall", "per", "runs", "times ours", "agreement"]]
        for outcome in self.outcomes:
            ours = next((r for r in outcome.results if r.entrant.name == "dymlm" and r.timings), None)
            for result in outcome.results:
                start = [outcome.row.name, result.entrant.name]
                if not result.timings:
                    table.append([*start, "", "", "", "", "", f"refused: {result.refusal}"])
                    continue
                times = f"{result.seconds(self.clock) / ours.seconds(self.clock):.2f}" if ours else ""
                agreement = result.agreement.text if result.agreement else ""
                medians = [self.time(outcome, result, clock) for clock in ["cpu", "wall"]]
                runs = str(len(result.timings))
                table.append([*start, *medians, outcome.row.unit, runs, times, agreement])
        return table

    def time(self, outcome: Outcome, result: Result, clock: str) -> str:
        seconds = result.seconds(clock) / outcome.row.count
        for unit, scale in [("s", 1), ("ms", 1e-3), ("us", 1e-6)]:
            if seconds >= scale:
                return f"{seconds / scale:.3g} {unit}"
        return f"{seconds / 1e-9:.3g} ns"


def aim_of(outcome: Outcome, verdict: Verdict) -> str:
    aim = outcome.row.aim
    return f"{aim.factor:g}x " + ("met" if verdict.ratio >= aim.factor else "MISSED") if aim else ""


def contestant(result: Result) -> dict:
    return {
        "name": result.entrant.name,
        "library": result.entrant.library,
        "refusal": result.refusal,
        "agreement": result.agreement.text if result.agreement else None,
        "agrees": bool(result.agreement.good) if result.agreement else None,
        "wall_s": [timing.wall for timing in result.timings],
        "cpu_s": [timing.cpu for timing in result.timings],
    }


def plain_table(table: list[list[str]]) -> str:
    widths = [max(len(row[i]) for row in table) for i in range(len(table[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in table]
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])


def markdown_table(table: list[list[str]]) -> str:
    header, *rows = ["| " + " | ".join(row) + " |" for row in table]
    return "\n".join([header, "|" + " --- |" * len(table[0]), *rows])
