"""The Allan deviation."""

from __future__ import annotations

import numpy as np


def deviation(angle_rad: np.ndarray, period_s: float, per_decade: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Computes the overlapping Allan deviation of a rate from the angle that it integrates to (IEEE 952, equation C.5).

    Args:
        angle_rad: angle at even times; `period_s` between two [s].
        per_decade: averaging times a decade, up to a third of the record.

    Returns:
        Averaging times [s], and the deviation [rad/s] at each.
    """
    angle = np.asarray(angle_rad, dtype=float)
    most = max(len(angle) // 3, 1)
    count = max(int(np.log10(most) * per_decade), 1)
    averaged = np.unique(np.geomspace(1, most, count).round().astype(int))
    tau_s = averaged * period_s
    second = (angle[2 * m :] - 2.0 * angle[m:-m] + angle[: -2 * m] for m in averaged)
    sigma = [np.sqrt(0.5 * np.mean(one**2)) / tau for one, tau in zip(second, tau_s)]
    return tau_s, np.array(sigma)
