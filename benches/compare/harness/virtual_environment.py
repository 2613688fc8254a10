"""The virtual environment that holds the Python peers."""

import os
import subprocess
import sys
import venv
from pathlib import Path


def enter(folder: Path, requirements: Path) -> None:
    """Makes the environment if needed and restarts the script inside it; returns when it already runs there."""
    folder = folder.absolute()
    if Path(sys.prefix).absolute() == folder:
        return
    python = folder / "bin" / "python"
    if not is_complete(python):
        print(f"making the virtual environment {folder}", flush=True)
        venv.create(folder, with_pip=True)
        install(python, requirements)
    os.execv(python, [str(python), *sys.argv])


def is_complete(python: Path) -> bool:
    """Whether there is an environment that was completely installed."""
    return python.exists() and subprocess.run([python, "-c", "import numpy"], stderr=subprocess.DEVNULL).returncode == 0


def install(python: Path, requirements: Path) -> None:
    """Installs the peers. A peer that is not available for this Python is left out, and a line says so."""
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    if subprocess.run([*pip, "-r", str(requirements)]).returncode == 0:
        return
    for requirement in requirements.read_text().split():
        if subprocess.run([*pip, requirement]).returncode != 0:
            print(f"peer missing: {requirement} cannot be installed")
