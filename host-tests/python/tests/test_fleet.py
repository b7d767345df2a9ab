"""Twelve recordings, one of them corrupt, through the Snakefile: killed and resumed, on one core and on two."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas
import pytest

SNAKEFILE = Path(__file__).resolve().parents[2] / "fleet/Snakefile"
COUNT, CORRUPT = 12, 4
#: The instrument of recordings 8 and 9.
OFF = "SN 4"

SCENARIO = """
format = 1
name = "unit"
rate_hz = 100.0

[site]
latitude_rad = 0.6
gravity_m_s2 = 9.80665

[gyro]
pulse_weight_rad = [2e-6, 2e-6, 2e-6]
bias_rad_s = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
angle_random_walk_rad_sqrt_s = [2e-6, 2e-6, 2e-6]
installation_rad = { xy = 0.0, xz = 0.0, yx = 0.0, yz = 0.0, zx = 0.0, zy = 0.0 }

[reference]
angle_noise_rad = 2.4e-7
angle_random_walk_rad_sqrt_s = 8.7e-8
weight_rad = 4.8e-9

[[motion]]
kind = "coning"
axis = "x"
frequency_hz = 2.0
angle_rad = 0.1
duration_s = 10.0
ramp_s = 0.5

[[effect]]
kind = "gyro_scale"
y = %r
"""


def scale(k: int) -> float:
    """The scale error of a recording's gyro y: a production's spread, and one unit that is off."""
    return 900e-6 if instrument(k) == OFF else 200e-6 + 4e-6 * (k // 2)


def instrument(k: int) -> str:
    """Six units, each recorded twice."""
    return f"SN {k // 2}"


@pytest.fixture(scope="module")
def recordings(command, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fleet") / "recordings"
    for k in range(COUNT):
        scenario = folder.parent / "scenario.toml"
        scenario.write_text(SCENARIO % scale(k))
        unit = folder / f"unit-{k:02}"
        subprocess.run([command, "-q", "simulate", scenario, "--out", unit, "--seed", str(k)], check=True, stdout=subprocess.DEVNULL)
        manifest = unit / "recording.toml"
        about = f'instrument = "{instrument(k)}"\nstart = 2026-03-{1 + k % 2:02}T12:00:00Z\n'
        manifest.write_text(about + manifest.read_text())
    table = folder / f"unit-{CORRUPT:02}" / "samples.parquet"
    table.write_bytes(table.read_bytes()[: table.stat().st_size // 2])
    return folder


def arguments(command: str, work: Path, *more: str) -> list[str]:
    return [sys.executable, "-m", "snakemake", "--snakefile", str(SNAKEFILE), "--directory", str(work), *more, "--config", f"rlg={command}"]


def work_on(recordings: Path, folder: Path) -> Path:
    """A folder to work in, with the recordings in the same relative place."""
    folder.mkdir()
    (folder / "recordings").symlink_to(recordings)
    return folder


def bytes_of(work: Path) -> dict[str, bytes]:
    return {name: (work / name).read_bytes() for name in ("fleet.parquet", "fleet.html")}


@pytest.fixture(scope="module")
def whole(command, recordings, tmp_path_factory) -> Path:
    """Work that nothing interrupted, on two cores."""
    work = work_on(recordings, tmp_path_factory.mktemp("whole") / "work")
    subprocess.run(arguments(command, work, "--cores", "2"), check=True, capture_output=True)
    return work


def test_killed_half_way_and_resumed_on_one_core_it_writes_the_same_bytes(command, recordings, whole, tmp_path):
    work = work_on(recordings, tmp_path / "work")
    one_core = arguments(command, work, "--cores", "1")
    killed = subprocess.Popen(one_core, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    done = lambda: len(list(work.glob("results/*/run.json")))
    end = time.monotonic() + 120.0
    while done() < 5 and killed.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    half = done()
    assert 5 <= half < COUNT and not (work / "fleet.parquet").exists()

    # A killed process leaves its lock, and perhaps a recording half done.
    subprocess.run([*one_core, "--unlock"], check=True, capture_output=True)
    resumed = subprocess.run([*one_core, "--rerun-incomplete"], check=True, capture_output=True, text=True)
    diagnosed = resumed.stderr.count("rule diagnose:")
    assert COUNT - half <= diagnosed <= COUNT - half + 1, "what was done is not done again"
    assert bytes_of(work) == bytes_of(whole)


def test_a_second_run_does_nothing(command, whole):
    before = {file: file.stat().st_mtime_ns for file in whole.rglob("*") if file.is_file() and ".snakemake" not in file.parts}
    again = subprocess.run(arguments(command, whole, "--cores", "1"), check=True, capture_output=True, text=True)

    assert "Nothing to be done" in again.stderr
    assert before == {file: file.stat().st_mtime_ns for file in before}


def test_the_corrupt_one_is_listed_with_its_sentence_and_the_one_that_is_off_stands_out(whole, command):
    # By the command, as pandas needs one more package for Parquet.
    csv = whole / "fleet.csv"
    folders = sorted(whole.glob("results/*"))
    subprocess.run([command, "-q", "summarize", *folders, "--out", csv], check=True, stdout=subprocess.DEVNULL)
    frame = pandas.read_csv(csv)

    refused = frame[frame["refused"].notna()]
    assert list(refused["run"]) == [f"unit-{CORRUPT:02}"]
    sentence = refused["refused"].iloc[0]
    assert "samples.parquet" in sentence and "unit-04" in sentence
    assert sentence in (whole / "fleet.html").read_text()

    scales = frame[(frame["kind"] == "gyro_scale") & (frame["parameter"] == "y")].set_index("run")
    assert len(scales) == COUNT - 1 and set(scales["instrument"]) == {f"SN {k}" for k in range(6)}
    planted = [scale(int(run[-2:])) for run in scales.index]
    assert (np.abs(scales["value"] - planted) < 4.0 * scales["std"]).all()
    assert list(scales.index[scales["outlier"] == "outlier"]) == ["unit-08", "unit-09"]
    assert set(scales["instrument"][scales["outlier"] == "outlier"]) == {OFF}
