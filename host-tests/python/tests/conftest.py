"""Inputs of the tests: a logger's file whose physics is known here, and the command `rlg` to compare with."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]

#: Rows a second [Hz], length [s].
RATE_HZ, LENGTH_S = 200.0, 20.0


@dataclass(frozen=True)
class Logged:
    """Rates of gyros and of a turntable [deg/s] with what the gyros do wrong."""

    time_s: np.ndarray
    gyro_deg_s: np.ndarray
    table_deg_s: np.ndarray
    scale_y: float = 800e-6
    bias_z_deg_s: float = 0.02

    def columns(self) -> dict[str, np.ndarray]:
        columns = {"time_s": self.time_s}
        for axis, name in enumerate("xyz"):
            columns[f"gyro_{name}_dps"] = self.gyro_deg_s[axis]
            columns[f"ref_rate_{name}_dps"] = self.table_deg_s[axis]
        return columns


@pytest.fixture(scope="session")
def logged() -> Logged:
    rows = int(RATE_HZ * LENGTH_S)
    end_s = (np.arange(rows) + 1) / RATE_HZ

    def mean_rate(amplitude: float, frequency_hz: float, phase: float) -> np.ndarray:
        # Of amplitude sin(w t + phase) over each row, as a logger of integrating gyros has it.
        w = 2.0 * np.pi * frequency_hz
        angle = lambda t: -amplitude / w * np.cos(w * t + phase)
        return (angle(end_s) - angle(end_s - 1.0 / RATE_HZ)) * RATE_HZ

    turns = [(60.0, 0.7, 0.0), (80.0, 1.1, 0.4), (50.0, 0.3, 1.0)]
    table = np.array([mean_rate(*turn) for turn in turns])
    noise = np.random.default_rng(7).normal(0.0, 0.02, table.shape)
    gyro = table + noise
    gyro[1] += Logged.scale_y * table[1]
    gyro[2] += Logged.bias_z_deg_s
    return Logged(end_s, gyro, table)


@pytest.fixture(scope="session")
def log_csv(logged: Logged, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("log") / "log.csv"
    columns = logged.columns()
    np.savetxt(file, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    return file


#: Two seconds of a dithered unit that cones, with a bend concealed.
SCENARIO = """
format = 1
name = "short"
rate_hz = 2000.0
start_s = 0.0

[site]
latitude_rad = 0.6
gravity_m_s2 = 9.80665

[gyro]
pulse_weight_rad = [2e-6, 2e-6, 2e-6]
bias_rad_s = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
angle_random_walk_rad_sqrt_s = [5e-7, 5e-7, 5e-7]
installation_rad = { xy = 0.0, xz = 0.0, yx = 0.0, yz = 0.0, zx = 0.0, zy = 0.0 }

[dither]
frequency_hz = [392.6, 430.1, 474.8]
amplitude_rad = [7.3e-4, 7.3e-4, 7.3e-4]
amplitude_spread = 0.15
pickoff_gain = [1.0, 1.0, 1.0]
pickoff_noise_rad = [2.4e-7, 2.4e-7, 2.4e-7]
pickoff_weight_rad = 9.7e-9

[reference]
angle_noise_rad = 2.4e-7
angle_random_walk_rad_sqrt_s = 8.7e-8
weight_rad = 4.8e-9

[[motion]]
kind = "coning"
axis = "x"
frequency_hz = 15.0
angle_rad = 0.011
duration_s = LENGTH
ramp_s = 0.5

[[effect]]
kind = "axis_flexure"
xy = 7e-8
xz = 7e-8
yx = 7e-8
yz = 7e-8
zx = 7e-8
zy = 7e-8
"""


@pytest.fixture(scope="session")
def scenario():
    """Text of a scenario of a dithered unit that cones for so many seconds."""
    return lambda length_s: SCENARIO.replace("LENGTH", str(float(length_s)))


@pytest.fixture(scope="session")
def command() -> str:
    """The command `rlg` that was built beside the package."""
    given = Path(os.environ.get("RLG_COMMAND", ROOT / "target/release/rlg"))
    assert given.is_file(), f"{given}: build it, or name one in RLG_COMMAND"
    return str(given)
