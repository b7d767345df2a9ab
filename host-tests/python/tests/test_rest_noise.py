"""A unit at rest with nothing declared: its noise beside another package's Allan deviation, and its lines."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import allantools
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "docs"))
from allan import TERMS, by_allan, rates

RATE_HZ = 100.0
#: Angle random walk N [rad/sqrt(s)], bias instability B [rad/s], rate random walk K [rad/s/sqrt(s)] of gyros x, y, z.
PLANTED = [(2.0e-5, 0.0, 0.0), (1.0e-5, 0.0, 4.0e-6), (1.5e-5, 1.2e-5, 0.0)]
#: Of those, what half an hour tells.
TOLD = {"x": {"N"}, "y": {"N", "K"}, "z": {"N", "B"}}
KEYS = {name: key for name, key, *_ in TERMS}
#: Frequency [Hz] and amplitudes [rad/s] of steady lines.
LINES = [(7.3127, (2.0e-5, 1.2e-5, 0.0)), (31.41, (0.0, 1.5e-5, 2.5e-5))]
#: Standard deviations within which two values that are right lie: further than four is chance once in 15 000.
SIGMAS = 4.0
#: Six significant digits, as the page has its numbers.
ROUNDED = 1e-5


@dataclass(frozen=True)
class Rest:
    """A recording of a unit at rest and what `rlg diagnose` says of it without a model."""

    folder: Path
    diagnosis: dict
    printed: str
    page: str

    def terms(self, axis: str) -> dict[str, tuple[float, float]]:
        """Value and standard deviation of each term of a gyro by its letter."""
        noise = next(one for one in self.diagnosis["noise"] if one["channel"] == f"gyro_{axis}")
        return {name: (noise["terms"][key]["value"], noise["terms"][key]["std"]) for name, key in KEYS.items()}

    def charts(self) -> dict[str, dict]:
        """The plots of the page by name: the numbers that its script draws."""
        text = self.page.split('id="charts">', 1)[1].split("</script>", 1)[0]
        return {chart["id"]: chart for chart in json.loads(text)}


def diagnosed(command: str, folder: Path, out: Path) -> Rest:
    run = subprocess.run([command, "diagnose", folder, "-o", out], check=True, capture_output=True, text=True)
    diagnosis = json.loads((out / "diagnosis.json").read_text())
    return Rest(folder, diagnosis, run.stdout, (out / "report.html").read_text())


def flicker(draw: np.random.Generator, rows: int) -> np.ndarray:
    """Draws a rate of two-sided density 1 / (2 pi f), which is B = 1 (IEEE 952, C.1.3), from a record twice as long."""
    frequency = np.fft.rfftfreq(2 * rows, 1.0 / RATE_HZ)[1:]
    size = np.sqrt(rows * RATE_HZ / (2.0 * np.pi * frequency))
    coefficients = size * (draw.normal(size=len(size)) + 1j * draw.normal(size=len(size)))
    return np.fft.irfft(np.concatenate([[0.0], coefficients]), 2 * rows)[:rows]


def noise(draw: np.random.Generator, rows: int, axis: int) -> np.ndarray:
    walk, bias_instability, rate_walk = PLANTED[axis]
    white = walk * np.sqrt(RATE_HZ) * draw.normal(size=rows)
    drift = rate_walk / np.sqrt(RATE_HZ) * np.cumsum(draw.normal(size=rows))
    return white + drift + bias_instability * flicker(draw, rows)


def lines(end_s: np.ndarray, axis: int) -> np.ndarray:
    total = np.zeros_like(end_s)
    for number, (frequency_hz, amplitudes) in enumerate(LINES):
        w, phase = 2.0 * np.pi * frequency_hz, 0.3 + number + axis
        # The mean over each row: what integrating gyros give.
        angle = np.cos(w * (end_s - 1.0 / RATE_HZ) + phase) - np.cos(w * end_s + phase)
        total += amplitudes[axis] / w * angle * RATE_HZ
    return total


def made(command: str, folder: Path, length_s: float, with_lines: bool) -> Rest:
    """Writes a logger's file in deg/s, imports it and diagnoses it."""
    rows, draw = int(RATE_HZ * length_s), np.random.default_rng(2)
    end_s = (np.arange(rows) + 1) / RATE_HZ
    rate_rad_s = [noise(draw, rows, axis) + with_lines * lines(end_s, axis) for axis in range(3)]
    header = "time_s," + ",".join(f"gyro_{axis}_dps" for axis in "xyz")
    columns = np.column_stack([end_s, *np.degrees(rate_rad_s)])
    np.savetxt(folder / "log.csv", columns, delimiter=",", header=header, comments="", fmt="%.10g")
    subprocess.run([command, "import", folder / "log.csv", "--out", folder / "log"], check=True, capture_output=True)
    return diagnosed(command, folder / "log", folder / "found")


@pytest.fixture(scope="module")
def noisy(command: str, tmp_path_factory: pytest.TempPathFactory) -> Rest:
    return made(command, tmp_path_factory.mktemp("noisy"), 1800.0, with_lines=False)


@pytest.fixture(scope="module")
def with_lines(command: str, tmp_path_factory: pytest.TempPathFactory) -> Rest:
    return made(command, tmp_path_factory.mktemp("lines"), 600.0, with_lines=True)


@pytest.fixture(scope="module")
def recordings() -> Path:
    folder = os.environ.get("RLG_RECORDINGS")
    if not folder:
        pytest.skip("RLG_RECORDINGS names no folder of foreign recordings")
    return Path(folder)


def assert_curve_is_allantools(rest: Rest) -> None:
    charts = rest.charts()
    for axis, (values, rate_hz) in rates(rest.folder).items():
        chart = charts[f"allan-deviation-{axis}"]
        place = next(place for place, line in enumerate(chart["lines"]) if line["name"] == "as recorded")
        drawn = dict(zip(chart["data"][0], chart["data"][1 + place]))
        # allantools takes averaging times that are whole rows; the page rounds what it shows.
        drawn = {round(tau * rate_hz): value for tau, value in drawn.items() if value is not None}
        taus, deviation, *_ = allantools.oadev(values, rate=rate_hz, data_type="freq", taus=np.array(list(drawn)) / rate_hz)
        assert len(taus) == len(drawn) > 20
        np.testing.assert_allclose(list(drawn.values()), np.degrees(deviation) * 3600.0, rtol=ROUNDED)


def assert_terms_are_allantools(rest: Rest, axis: str, names: set[str]) -> None:
    own = rest.terms(axis)
    other = dict(zip(KEYS, by_allan(*rates(rest.folder)[axis]).values()))
    for name in names:
        (value, std), (square, spread) = own[name], other[name]
        read = np.sqrt(square)
        assert std < value / 2.0 and spread < square, f"{axis} {name}: {value} ± {std}, {read}"
        assert abs(value - read) < SIGMAS * np.hypot(std, spread / (2.0 * read)), f"{axis} {name}: {value} ± {std}, {read}"


def test_the_pages_allan_deviation_is_allantools_point_by_point(noisy):
    assert_curve_is_allantools(noisy)


@pytest.mark.parametrize("axis", "xyz")
def test_terms_are_those_read_off_allantools_curve_and_those_planted(noisy, axis):
    assert_terms_are_allantools(noisy, axis, TOLD[axis])
    own = noisy.terms(axis)
    for name, planted in zip("NBK", PLANTED["xyz".index(axis)]):
        value, std = own[name]
        if name in TOLD[axis]:
            assert abs(value - planted) < SIGMAS * std, f"{name}: {value} ± {std}"
        else:
            assert value < SIGMAS * std, f"{name}: {value} ± {std}"


def test_the_answer_says_all_three_terms_of_every_gyro(noisy):
    said = next(line for line in noisy.printed.splitlines() if line.startswith("Noise: "))
    parts = [part.strip() for part in said.removeprefix("Noise: ").split(";")]
    by_letter = {part[0]: part for part in parts}
    for name in "NBK":
        for axis, told in TOLD.items():
            own = re.search(rf"{axis} (< )?[\d.]+( ± [\d.]+)?", by_letter[name])
            assert own is not None and (own[2] is not None) == (name in told) and (own[1] is None) == (name in told), said


def test_steady_lines_have_the_frequency_and_the_amplitudes_planted(with_lines):
    found = {}
    for effect in with_lines.diagnosis["effects"]:
        numbers = {one["name"]: one for one in effect["parameters"]}
        if "frequency_hz" in numbers:
            found[numbers["frequency_hz"]["value"]] = numbers
    assert len(found) == len(LINES), found.keys()
    for planted_hz, amplitudes in LINES:
        numbers = found[min(found, key=lambda one: abs(one - planted_hz))]
        frequency = numbers["frequency_hz"]
        assert abs(frequency["value"] - planted_hz) < SIGMAS * frequency["std"]
        # A row is a mean over its period, which lowers a line by its sinc.
        lowered = np.sinc(planted_hz / RATE_HZ)
        for axis, amplitude in zip("xyz", amplitudes):
            value, std = numbers[axis]["value"], numbers[axis]["std"]
            assert abs(value - lowered * amplitude) < SIGMAS * std, f"{planted_hz} Hz {axis}: {value} ± {std}"


#: Rest recordings by others, and gyros whose N an Allan deviation can be asked for: not one with spikes in it.
OTHERS = [("rest-bias", "xyz"), ("rest-bias-250", "xyz"), ("warm-up", "xyz"), ("spikes-at-rest", "xz")]


@pytest.mark.parametrize("name, axes", OTHERS)
def test_the_noise_of_recordings_by_others_is_allantools(command, recordings, tmp_path, name, axes):
    rest = diagnosed(command, recordings / "outside" / name, tmp_path / "found")
    assert_curve_is_allantools(rest)
    for axis in axes:
        assert_terms_are_allantools(rest, axis, {"N"})


REAL_UNITS = [("x_LN100_up.ins", "f64x7"), pytest.param("lasergyro.imu", "psins-imu", marks=pytest.mark.in_full)]


@pytest.mark.parametrize("file, form", REAL_UNITS)
def test_the_allan_deviation_of_real_ring_laser_units_is_allantools(command, recordings, tmp_path, file, form):
    folder = tmp_path / "recording"
    subprocess.run([command, "import", recordings / file, "--format", form, "--out", folder], check=True, capture_output=True)
    rest = diagnosed(command, folder, tmp_path / "found")

    assert_curve_is_allantools(rest)
    # What lines, bands and bursts leave of a gyro is noise of these terms, or it is said not to be, and none is stated.
    [unlike] = [line for line in rest.printed.splitlines() if line.startswith("Held-out residual exceeds its noise")]
    for one in rest.diagnosis["noise"]:
        assert ("terms" in one) != (one["channel"].replace("_", " ") in unlike), one["channel"]
