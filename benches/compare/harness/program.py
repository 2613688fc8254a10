"""A running program that answers requests: `operation key=value ..` in, `ok wall_seconds cpu_seconds` out."""

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

from .machine import ONE_THREAD


@dataclass
class Timing:
    """Wall-clock time and processor time, seconds."""

    wall: float
    cpu: float


class Refused(Exception):
    """The program answered with an error or died."""


class Program:
    def __init__(self, command: list[str], cwd: Path | None = None):
        self.name = Path(command[-1]).name
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=cwd, env=os.environ | ONE_THREAD
        )

    def run(self, operation: str, parameters: dict) -> Timing:
        words = [operation, *(f"{key}={value}" for key, value in parameters.items())]
        try:
            self.process.stdin.write(" ".join(words) + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass
        answer = self.process.stdout.readline().split(maxsplit=1)
        if not answer:
            raise Refused(f"{self.name} ended")
        if answer[0] != "ok":
            raise Refused(answer[1].strip())
        wall, cpu = map(float, answer[1].split())
        return Timing(wall, cpu)

    def close(self) -> None:
        try:
            self.process.stdin.close()
        except BrokenPipeError:
            # It has ended already; a request since then was refused, and so reported.
            pass
        self.process.wait()
