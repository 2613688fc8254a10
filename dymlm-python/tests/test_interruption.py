"""Ctrl-C takes effect between two frames, and the builder can still be used."""

import signal
import subprocess
import sys
import textwrap
import time

import dymlm
import pytest
from conftest import inserted, same


def test_an_interrupted_builder_goes_on(frames):
    """The signal arrives while a frame is inserted; Python raises when the frame is finished."""
    builder, inserted_frames = dymlm.MapBuilder(frames[0].camera, dymlm.Config(history="memory")), []
    raised = []
    for number, frame in enumerate(frames):
        try:
            if number == 4:
                signal.setitimer(signal.ITIMER_REAL, 1e-3)
            builder.insert_frame(frame)
        except KeyboardInterrupt:
            raised.append(number)
        inserted_frames.append(frame)
    assert raised == [4]
    assert same(builder.finish(), inserted(inserted_frames, history="memory").finish())


@pytest.fixture(autouse=True)
def alarm_is_ctrl_c():
    """SIGALRM comes at a chosen time; Python treats it as it does SIGINT."""
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, before)


def test_an_interrupted_correction_changes_nothing(frames):
    builder = inserted(frames, history="memory")
    before = builder.map()
    drift = dymlm.Pose([0.03, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
    signal.setitimer(signal.ITIMER_REAL, 1e-3)
    with pytest.raises(KeyboardInterrupt):
        builder.correct_poses({0: drift @ frames[0].world_from_camera})
    assert same(builder.map(), before)
    assert builder.correct_poses({0: drift @ frames[0].world_from_camera}).key_frames == len(frames)
    assert not same(builder.map(), before)


def test_an_interrupted_wait_ends(frames):
    builder = inserted(frames[:-1])
    reader = builder.reader()
    latest, start = reader.latest(), time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        reader.wait_newer(latest, 20.0)
    assert time.monotonic() - start < 10.0
    assert reader.wait_newer(latest, 0.15) is None
    builder.insert_frame(frames[-1])
    builder.settle()
    assert reader.wait_newer(latest).revision > latest.revision


def test_ctrl_c_ends_a_program(tmp_path):
    """A program that maps endlessly stops at SIGINT within a frame's time, saves its map, and exits with its own code."""
    program = textwrap.dedent("""
        import signal, sys, dymlm
        # Shells start background jobs with SIGINT ignored, which a program inherits.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        camera = dymlm.Camera(160, 120, 131.0, 131.0, 79.5, 59.5)
        sequence = dymlm.builtin_sequence(frames=1000, camera=camera)
        builder = dymlm.MapBuilder(camera)
        try:
            for index in range(1000):
                builder.insert_frame(sequence[index])
                print(index, flush=True)
        except KeyboardInterrupt:
            map = builder.finish()
            map.save(sys.argv[1])
            print("saved", len(map.cloud("all")), flush=True)
    """)
    command = [sys.executable, "-c", program, str(tmp_path / "map")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        for _ in range(5):
            running.stdout.readline()
        running.send_signal(signal.SIGINT)
        start = time.perf_counter()
        said = running.stdout.read()
        assert running.wait() == 0 and time.perf_counter() - start < 60.0
    points = int(said.rsplit("saved", 1)[1])
    assert points > 1000 and len(dymlm.load(tmp_path / "map").cloud("all")) == points
