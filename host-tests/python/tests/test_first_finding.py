"""A new user's path in six lines: a logger's file with an encoder on one axis at half the rate becomes a finding."""

from pathlib import Path

import numpy as np
import pandas
import pytest

import rlg

SCALE_Z, BIAS_Z_RAD_S, LATE_S = 800e-6, 2e-4, 0.004
G_M_S2 = 9.80665
EARTH_RAD_S = 7.3e-5


def angle_rad(time_s):
    return 1.5 * (1.0 - np.cos(0.7 * time_s)) + 0.2 * np.sin(5.1 * time_s)


@pytest.fixture
def logger_csv(tmp_path: Path) -> Path:
    """Two minutes at 100 Hz in deg/s and g, stamps in ms; the encoder has a value in every second row."""
    random = np.random.default_rng(11)
    time_s = (np.arange(12_000) + 1) / 100.0
    rate = (angle_rad(time_s) - angle_rad(time_s - 0.01)) * 100.0
    gyro = random.normal(0.0, 4e-5, (3, time_s.size))
    gyro[2] += rate * (1.0 + SCALE_Z) + BIAS_Z_RAD_S
    force = random.normal(0.0, 2e-3, (3, time_s.size))
    force[2] += G_M_S2
    encoder = angle_rad(time_s - LATE_S) + random.normal(0.0, 2e-6, time_s.size)
    encoder[::2] = np.nan
    columns = {"t (ms)": np.round(1000.0 * time_s)}
    columns |= {f"g{axis} (deg/s)": np.degrees(gyro[k]) for k, axis in enumerate("xyz")}
    columns |= {f"a{axis} (g)": force[k] / G_M_S2 for k, axis in enumerate("xyz")}
    columns["encoder_z (deg)"] = np.degrees(encoder)
    file = tmp_path / "logger.csv"
    pandas.DataFrame(columns).to_csv(file, index=False, float_format="%.8f")
    return file


def test_six_lines_find_what_was_planted(logger_csv):
    recording = rlg.import_file(logger_csv)
    found = rlg.diagnose(recording)
    numbers = {one.kind: one.parameters for one in [*found.effects, *found.registration]}
    scale = numbers["gyro_scale"]["z"]
    bias = numbers["gyro_bias"]["z"]
    late = numbers["reference_delay"]["all"]

    for parameter, truth in [(scale, SCALE_Z), (late, LATE_S)]:
        assert abs(parameter.value - truth) < 3.0 * parameter.std < 0.06 * truth, (parameter, truth)
    # Nothing says where north is: the Earth's rate about z is open.
    assert abs(bias.value - BIAS_Z_RAD_S) < 3.0 * bias.std < 3.3 * EARTH_RAD_S, bias


def test_an_export_comes_back(logger_csv, tmp_path):
    recording = rlg.import_file(logger_csv, start="2026-03-01T12:00:00Z", instrument="SN 17")
    (file,) = recording.export(tmp_path / "log.mat")
    again = rlg.import_file(file)

    assert recording.imported["start"] == "2026-03-01T12:00:00Z"
    for one, other in zip(recording.channels(), again.channels(), strict=True):
        assert (one.quantity, one.axis) == (other.quantity, other.axis)
        np.testing.assert_array_equal(one.values, other.values)


def test_the_index_of_a_data_frame_says_when_it_started(logger_csv):
    frame = pandas.read_csv(logger_csv)
    frame.index = pandas.Timestamp("2026-03-01T12:00:00+01:00") + pandas.to_timedelta(frame.pop("t (ms)"), unit="ms")
    recording = rlg.Recording.from_dataframe(frame)

    assert recording.imported["start"].startswith("2026-03-01T12:00:00.01")
