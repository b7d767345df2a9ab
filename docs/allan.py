#!/usr/bin/env python3
"""Sets the noise terms that `rlg diagnose` fits to units at rest beside an Allan deviation by another package.

    pip install allantools numpy pyarrow
    python3 docs/allan.py FOLDER...

Each folder holds a recording (recording.toml, tables in Parquet) and its model.toml, as `rlg import` and
`rlg challenge --keep` write them. For every gyro it prints N, B, K of both with ±: rlg's from diagnosis.json; allantools'
by least squares of the overlapping Allan variance, σ²(τ) = 3 Q²/τ² + N²/τ + (2 ln 2/π) B² + K² τ/3 (IEEE 952, C.1), each term ≥ 0,
every octave of τ with its degrees of freedom (Greenhall). The last lines say how far apart a term is at most
where both know it within a half.
"""

import json
import math
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import allantools
import numpy as np
import pyarrow.parquet

ARCSECOND_RAD = math.pi / 180 / 3600
# Name, key of diagnosis.json, share of its square at τ, unit that is printed.
TERMS = [
    ("Q", "quantisation_rad", lambda tau: 3 / tau**2, ("″", 1 / ARCSECOND_RAD)),
    ("N", "angle_random_walk_rad_sqrt_s", lambda tau: 1 / tau, ("°/√h", 180 / math.pi * 60)),
    ("B", "bias_instability_rad_s", lambda tau: 2 * math.log(2) / math.pi + 0 * tau, ("°/h", 180 / math.pi * 3600)),
    ("K", "rate_random_walk_rad_s_sqrt_s", lambda tau: tau / 3, ("°/h/√h", 180 / math.pi * 3600 * 60)),
]


def rates(folder):
    """Rates of the gyros [rad/s] by axis, and rows a second."""
    recording = tomllib.loads((folder / "recording.toml").read_text())
    found = {}
    for table in recording["table"]:
        columns = pyarrow.parquet.read_table(folder / table["file"])
        for channel in table["channel"]:
            if channel["quantity"] in ("gyro_rate", "gyro_increment"):
                rate_hz = table["rate_hz"]
                values = np.asarray(columns[channel["column"]], float) * channel.get("scale", 1.0) + channel.get("offset", 0.0)
                per_row = rate_hz if channel["quantity"] == "gyro_increment" else 1.0
                found[channel["axis"]] = values * per_row, rate_hz
    return found


def by_allan(values, rate_hz):
    """Squares of Q, N, B, K by least squares of the Allan variance, with their standard deviations."""
    taus, deviations, _, _ = allantools.oadev(values, rate=rate_hz, data_type="freq", taus="octave")
    rows = [round(tau * rate_hz) for tau in taus]
    # Degrees of freedom of white noise of rate: allantools' own ± counts rows that overlap as if they did not.
    freedom = np.array([allantools.edf_greenhall(0, 2, m, len(values) + 1, True, False) for m in rows])
    columns = np.stack([share(taus) for _, _, share, _ in TERMS], 1)
    kept, variances = [0, 1, 2, 3], deviations**2
    expected = variances
    for _ in range(20):
        spreads = expected * np.sqrt(2 / freedom)
        weighted = columns[:, kept] / spreads[:, None]
        covariance = np.linalg.pinv(weighted.T @ weighted)
        squares = covariance @ weighted.T @ (variances / spreads)
        if squares.min() < 0:
            # A term below zero is none.
            del kept[int(squares.argmin())]
            continue
        expected = columns[:, kept] @ squares
    found = {k: (0.0, math.inf) for k in range(4)}
    for place, k in enumerate(kept):
        found[k] = squares[place], math.sqrt(covariance[place, place])
    return found


def main(folders):
    differences = {name: [] for name, *_ in TERMS}
    for folder in map(Path, folders):
        with tempfile.TemporaryDirectory() as kept:
            out = Path(kept) / "out"
            command = ["rlg", "diagnose", folder, "--model", folder / "model.toml", "--out", out, "-q"]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            noise = json.loads((out / "diagnosis.json").read_text())["noise"]
        label = folder.parent.name if folder.name == "recording" else folder.name
        for entry in noise:
            terms = entry.get("terms")
            axis = entry["channel"].removeprefix("gyro_")
            series = rates(folder).get(axis)
            if terms is None or series is None:
                print(f"{label} {axis}: what is left is not noise of these terms")
                continue
            said = []
            for k, (square, spread) in by_allan(*series).items():
                name, key, _, (unit, factor) = TERMS[k]
                own, std = terms[key]["value"], terms[key]["std"]
                other = math.sqrt(square)
                other_std = spread / (2 * other) if other > 0 else math.inf
                is_known = std < own / 2 and other_std < other / 2
                if is_known:
                    differences[name].append(abs(own - other) / math.hypot(std, other_std))
                    said.append(f"{name} {own * factor:.3g} ± {std * factor:.1g} | {other * factor:.3g} ± {other_std * factor:.1g} {unit}")
            print(f"{label} {axis}: " + "; ".join(said))
    for name, found in differences.items():
        print(f"{name}: {len(found)} records, {max(found, default=0):.1f} standard deviations apart at most")


if __name__ == "__main__":
    main(sys.argv[1:])
