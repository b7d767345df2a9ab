"""Rates that a logger samples at an instant beside means over the row: half a row late, unless the import is told."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

RATE_HZ, LENGTH_S = 100.0, 60.0
END_S = (np.arange(int(RATE_HZ * LENGTH_S)) + 1) / RATE_HZ
#: Amplitude [deg/s], frequency [Hz] and phase [rad] of the motion about x, y, z.
TONES = [
    [(40.0, 0.7, 0.1), (20.0, 4.3, 0.4), (8.0, 11.0, 1.0)],
    [(50.0, 0.9, 0.3), (15.0, 5.1, 0.2), (9.0, 13.0, 1.2)],
    [(45.0, 0.5, 1.3), (18.0, 3.7, 0.9), (7.0, 9.5, 0.1)],
]
SCALE_Y, BIAS_Z_DEG_S = 600e-6, 0.02
#: A right value lies further by chance once in 15 000.
SIGMAS = 4.0


def rate_deg_s(axis: int, sampling: str) -> np.ndarray:
    total = np.zeros_like(END_S)
    for amplitude, frequency_hz, phase in TONES[axis]:
        w = 2.0 * np.pi * frequency_hz
        if sampling == "instant":
            total += amplitude * np.sin(w * END_S + phase)
        else:
            total += amplitude * RATE_HZ / w * (np.cos(w * (END_S - 1.0 / RATE_HZ) + phase) - np.cos(w * END_S + phase))
    return total


def found(command: str, folder: Path, columns: dict[str, np.ndarray], options: list[str]) -> dict[str, dict]:
    """Parameters of each effect that `rlg diagnose` names in a log of these columns."""
    file = folder / "log.csv"
    np.savetxt(file, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.10g")
    subprocess.run([command, "import", file, "--out", folder / "log", *options], check=True, capture_output=True)
    said = subprocess.run([command, "diagnose", folder / "log", "--json"], check=True, capture_output=True, text=True).stdout
    effects = json.loads(said)["effects"]
    return {one["kind"]: {number["name"]: number for number in one["parameters"]} for one in effects}


def columns(gyro: str, reference: str | None) -> dict[str, np.ndarray]:
    draw = np.random.default_rng(5)
    made = {"time_s": END_S}
    for axis, name in enumerate("xyz"):
        rate = rate_deg_s(axis, gyro) * (1.0 + SCALE_Y * (name == "y")) + BIAS_Z_DEG_S * (name == "z")
        made[f"gyro_{name}_dps"] = rate + draw.normal(0.0, 0.02, len(END_S))
    for axis, name in enumerate("xyz" if reference else ""):
        made[f"ref_rate_{name}_dps"] = rate_deg_s(axis, reference) + draw.normal(0.0, 0.002, len(END_S))
    return made


def assert_planted(effects: dict[str, dict]) -> None:
    assert sorted(effects) == ["gyro_bias", "gyro_scale"]
    for kind, name, planted in [("gyro_scale", "y", SCALE_Y), ("gyro_bias", "z", np.radians(BIAS_Z_DEG_S))]:
        number = effects[kind][name]
        assert abs(number["value"] - planted) < SIGMAS * number["std"], (kind, number)


@pytest.mark.parametrize(
    "gyro, reference, options",
    [
        ("instant", "mean", ["--sampling", "gyro_rate:instant"]),
        ("instant", "instant", ["--sampling", "instant"]),
        ("mean", "instant", ["--sampling", "reference_rate:instant"]),
    ],
)
def test_what_is_sampled_at_an_instant_is_compared_as_such(command, tmp_path, gyro, reference, options):
    assert_planted(found(command, tmp_path, columns(gyro, reference), options))
    assert 'sampling = "instant"' in (tmp_path / "log/recording.toml").read_text()


def test_taken_for_a_mean_it_is_half_a_row_early(command, tmp_path):
    effects = found(command, tmp_path, columns("mean", "instant"), [])
    delay = effects["reference_delay"]["all"]
    assert abs(delay["value"] + 0.5 / RATE_HZ) < 5e-5, effects


def attitudes(noise_rad: float) -> np.ndarray:
    """Unit quaternions w x y z of a case that turns as TONES say about its axes, at the rows' ends: RK4, four steps a row."""
    def rate_rad_s(t: float) -> np.ndarray:
        return np.radians([sum(a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in tones) for tones in TONES])

    def slope(q: np.ndarray, w: np.ndarray) -> np.ndarray:
        x, y, z = w
        return 0.5 * np.array([[0, -x, -y, -z], [x, 0, z, -y], [y, -z, 0, x], [z, y, -x, 0]]) @ q

    draw, steps = np.random.default_rng(6), 4
    h, q, t, made = 1.0 / RATE_HZ / steps, np.array([1.0, 0.0, 0.0, 0.0]), 0.0, []
    for row in range(len(END_S)):
        for step in range(steps):
            t = (row + step / steps) / RATE_HZ
            w = [rate_rad_s(t), rate_rad_s(t + 0.5 * h), rate_rad_s(t + h)]
            k1 = slope(q, w[0])
            k2 = slope(q + 0.5 * h * k1, w[1])
            k3 = slope(q + 0.5 * h * k2, w[1])
            k4 = slope(q + h * k3, w[2])
            q = q + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        q = q / np.linalg.norm(q)
        noisy = q + slope(q, draw.normal(0.0, noise_rad, 3))
        made.append(noisy / np.linalg.norm(noisy))
    return np.array(made)


def test_beside_attitudes_gyros_sampled_at_an_instant_are_not_late(command, tmp_path):
    made = columns("instant", None)
    for name, values in zip(["qw", "qx", "qy", "qz"], attitudes(2e-5).T):
        made[name] = values
    assert_planted(found(command, tmp_path, made, ["--sampling", "gyro_rate:instant"]))


def test_what_cannot_be_sampled_so_is_refused(command, tmp_path):
    def refused(options: list[str], made: dict[str, np.ndarray]) -> str:
        file = tmp_path / "log.csv"
        np.savetxt(file, np.column_stack(list(made.values())), delimiter=",", header=",".join(made), comments="", fmt="%.10g")
        run = subprocess.run([command, "import", file, "--out", tmp_path / "log", *options], capture_output=True, text=True)
        assert run.returncode == 2 and not (tmp_path / "log").exists()
        return run.stderr

    made = columns("instant", "instant")
    assert "mean or instant" in refused(["--sampling", "momentary"], made)
    made["time_s"] = END_S + np.random.default_rng(7).uniform(-0.2, 0.2, len(END_S)) / RATE_HZ
    said = refused(["--sampling", "instant"], made)
    assert "is sampled at an instant by uneven stamps" in said and "--rate HZ" in said
