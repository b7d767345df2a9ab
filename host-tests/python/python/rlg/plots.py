"""Plots of a diagnosis. Needs matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .allan import deviation
from .recording import Channel, Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_AXES = ("x", "y", "z")
_ARCSEC = np.degrees(1.0) * 3600.0
#: From rad/s to deg/h.
_DEG_H = np.degrees(1.0) * 3600.0


def _figure() -> tuple[Figure, np.ndarray]:
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(3, 1, sharex=True, figsize=(8.0, 7.5), layout="constrained")
    return figure, panels


def _no_residual(panels: np.ndarray) -> None:
    panels[0].set_title("No residual to draw: the recording cannot be used.")


def residual(curves: dict[str, np.ndarray] | None, title: str) -> Figure:
    """Draws the integrated residual of each gyro [arcsec] over time [s], before and after; held-out stretches shaded."""
    figure, panels = _figure()
    figure.suptitle(title, wrap=True, fontsize="medium")
    if curves is None:
        _no_residual(panels)
        return figure
    for axis, panel in enumerate(panels):
        for begin, end in curves["held_out_s"]:
            panel.axvspan(begin, end, color="0.92", lw=0.0)
        for name, label in (("angle_before_rad", "before"), ("angle_after_rad", "after")):
            panel.plot(curves["time_s"], curves[name][axis] * _ARCSEC, label=label, lw=1.0)
        panel.set_ylabel(f"gyro {_AXES[axis]} [″]")
    panels[0].legend(loc="best", title="residual angle; grey: held out", fontsize="small", title_fontsize="small")
    panels[-1].set_xlabel("time [s]")
    return figure


def allan(
    recordings: Sequence[Recording],
    noise: Sequence[dict[str, Any]],
    curves: dict[str, np.ndarray] | None,
    title: str,
) -> Figure:
    """Draws the Allan deviation of each gyro [deg/h] over averaging time [s].

    The data are the first recording's. Of the residual the report keeps some thousand points: its curve begins there.
    """
    figure, panels = _figure()
    figure.suptitle(f"{title}: Allan deviation", fontsize="medium")
    model = recordings[0].model
    weights = (model.to_dict() if model else {}).get("gyro", {}).get("pulse_weight_rad", [1.0] * 3)
    channels = recordings[0].channels()
    for axis, panel in enumerate(panels):
        shown: list[np.ndarray] = []
        angle = _angle(channels, axis, weights[axis])
        if angle is not None:
            shown.append(_draw(panel, *angle, "data", "C7"))
        if curves is not None and len(curves["time_s"]) > 8:
            step_s = float(np.mean(np.diff(curves["time_s"])))
            for name, label, colour in (("angle_before_rad", "before", "C0"), ("angle_after_rad", "after", "C1")):
                shown.append(_draw(panel, curves[name][axis], step_s, f"residual {label}", colour))
        entry = next((one for one in noise if one["channel"] == f"gyro_{_AXES[axis]}"), None)
        if entry is not None and shown:
            tau_s = np.geomspace(min(t[0] for t in shown), max(t[-1] for t in shown), 100)
            panel.loglog(tau_s, noise_deviation(entry, tau_s) * _DEG_H, "k--", lw=1.0, label=_fitted(entry))
        panel.set_ylabel(f"gyro {_AXES[axis]} [°/h]")
        panel.grid(True, which="both", color="0.92")
        if shown:
            panel.legend(loc="best", fontsize="small")
    panels[-1].set_xlabel("averaging time τ [s]")
    return figure


def noise_deviation(entry: dict[str, Any], tau_s: np.ndarray) -> np.ndarray:
    """Returns the Allan deviation [rad/s] of the noise that a gyro was judged with (IEEE 952, annex C)."""
    walk = entry["angle_random_walk_rad_sqrt_s"]
    variance = walk**2 / tau_s + 3.0 * entry["angle_noise_rad"] ** 2 / tau_s**2
    terms = entry.get("terms")
    if terms is not None:
        variance = variance + terms["bias_instability_rad_s"]["value"] ** 2 * 2.0 * np.log(2.0) / np.pi
        variance = variance + terms["rate_random_walk_rad_s_sqrt_s"]["value"] ** 2 * tau_s / 3.0
    return np.asarray(np.sqrt(variance))


def _fitted(entry: dict[str, Any]) -> str:
    n = np.degrees(entry["angle_random_walk_rad_sqrt_s"]) * 60.0
    text = f"noise fitted: N {n:.3g} °/√h"
    terms = entry.get("terms")
    if terms is not None:
        b, k = (terms[name] for name in ("bias_instability_rad_s", "rate_random_walk_rad_s_sqrt_s"))
        text += f"\nB {b['value'] * _DEG_H:.2g} ± {b['std'] * _DEG_H:.1g} °/h"
        text += f", K {k['value'] * _DEG_H * 60.0:.2g} ± {k['std'] * _DEG_H * 60.0:.1g} °/h/√h"
    return text


def _draw(panel: Axes, angle_rad: np.ndarray, period_s: float, label: str, colour: str) -> np.ndarray:
    tau_s, sigma = deviation(angle_rad, period_s)
    panel.loglog(tau_s, sigma * _DEG_H, label=label, color=colour, lw=1.2)
    return tau_s


def _angle(channels: list[Channel], axis: int, pulse_weight_rad: float) -> tuple[np.ndarray, float] | None:
    """The angle that a gyro integrates [rad] and its period [s]; what was not measured counts as the mean."""
    for channel in channels:
        if channel.axis != _AXES[axis] or channel.stamps_s is not None:
            continue
        factor = {
            "gyro_count": pulse_weight_rad,
            "gyro_increment": 1.0,
            "gyro_rate": channel.period_s,
        }.get(channel.quantity)
        if factor is not None:
            values = np.where(np.isnan(channel.values), np.nanmean(channel.values), channel.values)
            return np.concatenate([[0.0], np.cumsum(values * factor)]), channel.period_s
    return None
