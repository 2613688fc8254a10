"""The stubs agree with the module."""

import inspect
import subprocess
import sys
from pathlib import Path

import dymlm
import pytest


def test_the_stubs_are_the_modules():
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy.stubtest", "dymlm", "--ignore-missing-stub"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


README_LINES = '''
import dymlm

sequence = dymlm.builtin_sequence()
builder = dymlm.MapBuilder(sequence.camera, dymlm.Config(history="memory"))
corrected: dict[int, dymlm.Pose] = {}
for frame in sequence:
    report = builder.insert(
        frame.timestamp, frame.depth, frame.color, world_from_camera=frame.world_from_camera, detections=frame.detections
    )
    corrected[report.id] = frame.world_from_camera
builder.correct_poses(corrected)
with dymlm.MapSaver("map") as saver:
    saver.save(builder.map())
dymlm.load("map", history={"folder": "history"})
'''


def test_the_readme_s_lines_have_the_types_of_the_stubs():
    api = pytest.importorskip("mypy.api")
    words, errors, code = api.run(["--strict", "-c", README_LINES])
    assert code == 0, words + errors


def test_everything_is_explained():
    for module in (dymlm, dymlm.metrics):
        for name in module.__all__:
            thing = getattr(module, name)
            assert thing.__doc__, name
            if not inspect.isclass(thing) or issubclass(thing, Exception):
                continue
            for member, value in vars(thing).items():
                assert member.startswith("__") or value.__doc__, f"{name}.{member}"


def test_every_class_is_given_away():
    """Annotations cannot import names that only the extension has."""
    given = set(dymlm.__all__) | set(dymlm.metrics.__all__) | {"DatasetFrames", "SequenceFrames"}
    assert {name for name in dir(dymlm._dymlm) if not name.startswith("_")} <= given


def test_the_stubs_are_made_anew(tmp_path):
    here = Path(__file__).parent.parent
    subprocess.run([sys.executable, here / "make_stubs.py", tmp_path], check=True)
    for stub in ("__init__.pyi", "metrics.pyi"):
        made, kept = tmp_path / stub, here / "python" / "dymlm" / stub
        assert made.read_text() == kept.read_text(), "run make_stubs.py python/dymlm"
