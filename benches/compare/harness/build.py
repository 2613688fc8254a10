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
# Libraries without packages, built from the caller's sources: `source_peers/CMakeLists.txt`.
SOURCE_PEERS = ["Bonxai", "CAPE", "small_gicp", "UFOMap", "PEAC", "wavemap"]
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


def contestants(here: Path, root: Path, sources: Path | None, pin: list[str]) -> Contestants:
    """All contestants that can be built on this machine; a line is printed for each that cannot."""
    found = Contestants({}, {})
    add_ours(found, root, pin)
    add_cpp_peers(found, here, sources, pin)
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


def add_cpp_peers(found: Contestants, here: Path, sources: Path | None, pin: list[str]) -> None:
    if sources is None:
        print(f"no --sources: {', '.join(SOURCE_PEERS)} are left out")
    if shutil.which("cmake") is None:
        print("no cmake: OctoMap, PCL and CGAL, and what is built from sources, are left out")
        return
    build = here / "build" / "peers"
    configure = ["cmake", "-S", here, "-B", build, f"-DSOURCES={sources.resolve() if sources else ''}"]
    configured = subprocess.run(configure, stdout=subprocess.PIPE, text=True)
    if configured.returncode != 0:
        print("the C++ peers cannot be configured: OctoMap, PCL and CGAL, and what is built from sources, are left out")
        return
    for missing in re.findall(r"peer missing: .*", configured.stdout):
        print(missing)
    if can_build(build, "peers"):
        program = Program([*pin, str(build / "peers")])
        for name, version in re.findall(r"peer found: (\w+) (\S+)", configured.stdout):
            found.programs[name] = program
            found.versions[name] = f"{version} (Debian's)"
    else:
        print("the C++ peers cannot be built: OctoMap, PCL and CGAL are left out")
    for name, folder, target in re.findall(r"peer from sources: (\w+) (\w+) (\w+)", configured.stdout):
        if can_build(build, target):
            found.programs[name] = Program([*pin, str(build / "source_peers" / target)])
            found.versions[name] = commit_of(sources / folder) or "of unknown commit"
        else:
            print(f"peer missing: {name} ({target} cannot be built)")


def can_build(build: Path, target: str) -> bool:
    """Whether a program of the C++ peers can be built."""
    print(f"building {target}", flush=True)
    command = ["cmake", "--build", build, "--target", target]
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0


def commit_of(folder: Path) -> str:
    """Empty when the folder is no checkout of its own."""
    if not (folder / ".git").exists():
        return ""
    describe = ["git", "-C", folder, "describe", "--always", "--tags"]
    commit = subprocess.run(describe, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return commit.stdout.strip()


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
