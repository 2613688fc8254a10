"""Builds and starts the programs that run the libraries."""

import importlib.metadata
import importlib.util
import json
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from .program import Program

# Library and its Python module.
PYTHON_PEERS = [
    ("dbscan", "dbscan"),
    ("scikit-learn", "sklearn"),
    ("Open3D", "open3d"),
    ("OpenCV", "cv2"),
    ("isotree", "isotree"),
    ("scipy", "scipy"),
    ("DUFOMap", "dufomap"),
    ("GTSAM", "gtsam"),
]
# Crates in the program `rust_peers`.
RUST_PEERS = ["factrs", "tiny-solver"]


@dataclass
class Contestants:
    """The running programs by the names of their libraries, and the libraries' versions."""

    programs: dict[str, Program]
    versions: dict[str, str]

    def close(self) -> None:
        for program in set(self.programs.values()):
            program.close()


def contestants(here: Path, root: Path, pin: list[str]) -> Contestants:
    """All contestants that can be built on this machine; a line is printed for each that cannot."""
    found = Contestants({}, {})
    add_ours(found, root, pin)
    add_cpp_peers(found, here, pin)
    add_rust_peers(found, here, pin)
    add_python_peers(found, here, pin)
    return found


def add_ours(found: Contestants, root: Path, pin: list[str]) -> None:
    print("building ours: cargo build --release -p dymlm-benches --bin compare_ours", flush=True)
    command = ["cargo", "build", "--release", "-p", "dymlm-benches", "--bin", "compare_ours"]
    command.append("--message-format=json-render-diagnostics")
    built = subprocess.run(command, cwd=root, check=True, stdout=subprocess.PIPE, text=True)
    executables = [json.loads(message).get("executable") for message in built.stdout.splitlines()]
    executable = next(path for path in executables if path and Path(path).name == "compare_ours")
    found.programs["dymlm"] = Program([*pin, executable])
    describe = ["git", "describe", "--always", "--dirty"]
    commit = subprocess.run(describe, cwd=root, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    found.versions["dymlm"] = commit.stdout.strip() or "of unknown commit"


def add_cpp_peers(found: Contestants, here: Path, pin: list[str]) -> None:
    if shutil.which("cmake") is None:
        print("no cmake: OctoMap, PCL and CGAL are left out")
        return
    build = here / "build" / "peers"
    configured = subprocess.run(["cmake", "-S", here, "-B", build], stdout=subprocess.PIPE, text=True)
    built = subprocess.run(["cmake", "--build", build], stdout=subprocess.DEVNULL)
    if configured.returncode != 0 or built.returncode != 0:
        print("the C++ peers cannot be built: OctoMap, PCL and CGAL are left out")
        return
    for missing in re.findall(r"peer missing: .*", configured.stdout):
        print(missing)
    program = Program([*pin, str(build / "peers")])
    for name, version in re.findall(r"peer found: (\w+) (\S+)", configured.stdout):
        found.programs[name] = program
        found.versions[name] = f"{version} (Debian's)"


def add_rust_peers(found: Contestants, here: Path, pin: list[str]) -> None:
    folder, target = here / "rust_peers", here / "build" / "rust_peers"
    print("building the Rust peers: cargo build --release --locked", flush=True)
    built = subprocess.run(["cargo", "build", "--release", "--locked", "--quiet", "--target-dir", target], cwd=folder)
    if built.returncode != 0:
        print(f"the Rust peers cannot be built: {' and '.join(RUST_PEERS)} are left out")
        return
    locked = (folder / "Cargo.lock").read_text()
    for name in RUST_PEERS:
        found.programs[name] = Program([*pin, str(target / "release" / "rust_peers"), name])
        found.versions[name] = re.search(rf'name = "{name}"\nversion = "(.*)"', locked).group(1)


def add_python_peers(found: Contestants, here: Path, pin: list[str]) -> None:
    # OpenCV comes in packages of several names.
    packages = importlib.metadata.packages_distributions()
    for name, module in PYTHON_PEERS:
        if importlib.util.find_spec(module) is None:
            print(f"peer missing: {name}")
            continue
        # One process for each library, so that none is affected by another's threads or memory.
        found.programs[name] = Program([*pin, sys.executable, "-m", "harness.python_peer", module], cwd=here)
        found.versions[name] = importlib.metadata.version(packages[module][0])
