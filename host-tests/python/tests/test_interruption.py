"""The interpreter is free while `rlg` works, and Ctrl-C is heard."""

import os
import signal
import threading
import time

import pytest

import rlg


def test_other_threads_run_while_it_works(log_csv):
    recording = rlg.import_file(log_csv)
    ended = threading.Event()
    longest_s = 0.0

    def watch():
        nonlocal longest_s
        before = time.monotonic()
        while not ended.is_set():
            time.sleep(0.001)
            now = time.monotonic()
            longest_s, before = max(longest_s, now - before), now

    thread = threading.Thread(target=watch)
    begin = time.monotonic()
    thread.start()
    steps: list[str] = []
    rlg.diagnose(recording, progress=steps.append)
    took_s = time.monotonic() - begin
    ended.set()
    thread.join()

    assert longest_s < 0.5 * took_s, f"another thread stood still for {longest_s:.2f} of {took_s:.2f} s"
    assert len(steps) > 4 and all(" of " in step for step in steps), steps


@pytest.fixture
def interrupt_soon():
    """Sends this process a Ctrl-C after so many seconds, also where a shell started it in the background."""
    timers = []
    # A process that inherits SIGINT as ignored gets no handler from the interpreter.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)

    def send(after_s: float) -> None:
        timer = threading.Timer(after_s, os.kill, (os.getpid(), signal.SIGINT))
        timers.append(timer)
        timer.start()

    yield send
    for timer in timers:
        timer.cancel()
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_ends_a_diagnosis_at_once(scenario, interrupt_soon, tmp_path):
    recording = rlg.simulate(text=scenario(20.0))
    begin = time.monotonic()
    interrupt_soon(0.3)
    with pytest.raises(KeyboardInterrupt):
        rlg.diagnose(recording, recording.model, out=tmp_path / "found")

    # A second where nothing else runs.
    assert time.monotonic() - begin < 10.0
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_ends_a_simulation_and_leaves_nothing(scenario, interrupt_soon, tmp_path):
    begin = time.monotonic()
    interrupt_soon(0.3)
    with pytest.raises(KeyboardInterrupt):
        rlg.simulate(text=scenario(20_000.0), out=tmp_path / "long")

    # It ends before its first row is asked for, or at one of the next.
    assert time.monotonic() - begin < 60.0
    assert list(tmp_path.iterdir()) == []


def test_what_progress_raises_ends_the_work(scenario, tmp_path):
    def stop(step: str) -> None:
        raise RuntimeError(step)

    with pytest.raises(RuntimeError, match="simulating"):
        rlg.simulate(text=scenario(20_000.0), out=tmp_path / "long", progress=stop)
    assert list(tmp_path.iterdir()) == []
