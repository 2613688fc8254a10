"""The machine on which the figures are measured, and the one core that is used."""

import datetime
import os
import platform
import re
import shutil
from pathlib import Path

# Each library's own variable for "one thread".
ONE_THREAD = {
    name: "1"
    for name in [
        "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "RAYON_NUM_THREADS",
        "PARLAY_NUM_THREADS", "TBB_NUM_THREADS", "LOKY_MAX_CPU_COUNT",
    ]
}  # fmt: skip


def pinned_core(wanted: int | None) -> list[str]:
    """The command that keeps a program on one core; empty without taskset."""
    if shutil.which("taskset") is None:
        print("no taskset: programs are not kept on one core")
        return []
    core = max(os.sched_getaffinity(0)) if wanted is None else wanted
    return ["taskset", "--cpu-list", str(core)]


def describe(versions: dict[str, str]) -> dict:
    """Date, machine and versions."""
    cpu = re.search(r"model name\s*:\s*(.*)", Path("/proc/cpuinfo").read_text())
    megahertz = re.search(r"cpu MHz\s*:\s*([\d.]+)", Path("/proc/cpuinfo").read_text())
    return {
        "date": datetime.date.today().isoformat(),
        "cpu": cpu.group(1) if cpu else platform.processor(),
        "ghz": round(float(megahertz.group(1)) / 1000, 1) if megahertz else None,
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[0], 1),
        "system": platform.system() + " " + platform.machine(),
        "versions": versions,
    }
