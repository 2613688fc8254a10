"""The example of a fleet: Ray's tasks map recordings, and one task loses its worker. Skipped without ray."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "fleet_ray.py"


def run(*arguments):
    command = [sys.executable, EXAMPLE, "--sim", "3", "--frames", "6", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout.splitlines()[-1]), done.stderr


def test_a_killed_worker_changes_no_bit(tmp_path):
    pytest.importorskip("ray")
    alone, _ = run("--in-sequence", "--out", tmp_path / "alone")
    fleet, said = run("--workers", 2, "--kill-one", "--out", tmp_path / "fleet")
    assert "was killed in the middle of a recording" in said
    assert fleet["checksum"] == alone["checksum"] and fleet["points"] > 10_000
    # Each recording after the first is mapped again once.
    assert alone["frames_mapped_again"] == fleet["frames_mapped_again"] == 12
    assert [path.name for path in (tmp_path / "fleet").iterdir()] == ["map"]
    assert (tmp_path / "fleet" / "map" / "manifest.json").exists()


def test_only_a_map_is_replaced(tmp_path):
    out = tmp_path / "out"
    (out / "work").mkdir(parents=True)
    (out / "work" / "notes.txt").write_text("of somebody else")
    (out / "map").mkdir()
    (out / "map" / "house.svg").write_text("no map of ours")
    command = [sys.executable, EXAMPLE, "--in-sequence", "--sim", "1", "--frames", "2", "--out", out]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and "not a map" in done.stderr
    assert (out / "map" / "house.svg").exists()

    (out / "map" / "house.svg").rename(out / "house.svg")
    (out / "map").rmdir()
    for _ in range(2):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in out.iterdir()) == ["house.svg", "map", "work"]
    assert (out / "work" / "notes.txt").read_text() == "of somebody else"

    # A recording within the map that is replaced would be lost with it.
    recording = out / "map" / "recording"
    recording.mkdir()
    command = [sys.executable, EXAMPLE, "--in-sequence", recording, "--out", out]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and "a recording in the folder of the result" in done.stderr and recording.exists()


def test_folders_are_recordings_and_others_are_refused(tmp_path):
    command = [sys.executable, EXAMPLE, "--in-sequence", "--out", tmp_path / "out"]
    done = subprocess.run([*command, tmp_path / "nowhere"], capture_output=True, text=True, check=False)
    assert done.returncode != 0 and "nowhere" in done.stderr
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and "either recordings or --sim N" in done.stderr
