"""What a model leaves out of a recording, as types."""

from __future__ import annotations

import base64
import html
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native, plots
from ._calls import PathLike, Progress, each, option, options, warn
from .model import Model
from .recording import Recording

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect, in SI units: a number with its standard deviation, or a text such as an axis."""

    value: float | str
    std: float | None = None
    unit: str | None = None


@dataclass(frozen=True)
class Combination:
    """A combination of parameters that the data fix."""

    #: Weight by parameter.
    weights: dict[str, float]
    value: float
    std: float


@dataclass(frozen=True)
class Effect:
    """Physics that the model leaves out."""

    kind: str
    parameters: dict[str, Parameter]
    #: Of the numeric parameters, in order.
    covariance: np.ndarray
    identifiable: list[Combination]
    #: `named`, or `class` where the recording cannot tell it from another kind; None where it was not asked.
    label: str | None
    indistinguishable_from: list[str]
    log_evidence_gain: float
    p_value: float
    equation: str
    what_was_left_out: str
    expression: str | None


@dataclass(frozen=True)
class Registration:
    """Numbers that align gyros and a reference of attitude."""

    kind: str
    parameters: dict[str, Parameter]
    supported: bool


class Diagnosis:
    """What `rlg diagnose` found."""

    def __init__(self, native: _native.Diagnosed, recordings: Sequence[Recording | PathLike]) -> None:
        self._native = native
        self._recordings = [Recording.of(one) for one in recordings]
        #: The text of `rlg diagnose --json`.
        self.json: str = native.json()
        self._entries: dict[str, Any] = json.loads(self.json)
        #: matches, explained, partly_explained, unexplained or unusable.
        self.verdict: str = self._entries["verdict"]
        #: One sentence each.
        self.summary: list[str] = self._entries["summary"]
        self.effects: list[Effect] = [_effect(entry) for entry in self._entries["effects"]]
        self.registration: list[Registration] = [
            Registration(entry["kind"], _parameters(entry), entry["supported"])
            for entry in self._entries.get("registration", [])
        ]
        #: The motion that would separate what is confused.
        self.next_experiment: str = self._entries["next_experiment"]
        #: Kinds that this recording could not have shown, with the reason.
        self.not_excluded: list[str] = self._entries["not_excluded"]

    @property
    def identifiable(self) -> dict[str, list[Combination]]:
        """What the data fix, by kind of effect."""
        return {effect.kind: effect.identifiable for effect in self.effects}

    @property
    def model(self) -> Model:
        """The model with the found effects switched on."""
        return Model(self._native.model())

    def to_dict(self) -> dict[str, Any]:
        """Returns `diagnosis.json` as a dictionary."""
        entries: dict[str, Any] = json.loads(self.json)
        return entries

    def curves(self) -> dict[str, np.ndarray] | None:
        """Returns the report's curves, [gyro, point] where there is one a gyro; None where there is no residual.

        Angles [rad] over `time_s`, power [(rad/s)^2/Hz] over `frequency_hz`, held-out stretches [s].
        """
        entries = self._native.curves()
        if entries is None:
            return None
        curves = {name: np.array([np.frombuffer(one) for one in values]) for name, values in entries.items()}
        for name in ("time_s", "frequency_hz"):
            curves[name] = curves[name][0]
        curves["held_out_s"] = curves["held_out_s"].reshape(-1, 2)
        return curves

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns a row a parameter: effect, parameter, value, std, unit and how sure the effect is. Needs pandas."""
        import pandas

        rows = [
            {
                "kind": effect.kind,
                "parameter": name,
                "value": one.value,
                "std": one.std,
                "unit": one.unit,
                "label": effect.label,
                "indistinguishable_from": ", ".join(effect.indistinguishable_from),
                "p_value": effect.p_value,
                "log_evidence_gain": effect.log_evidence_gain,
            }
            for effect in self.effects
            for name, one in effect.parameters.items()
        ]
        columns = ["kind", "parameter", "value", "std", "unit", "label"]
        columns += ["indistinguishable_from", "p_value", "log_evidence_gain"]
        return pandas.DataFrame(rows, columns=columns)

    def plot_residual(self) -> Figure:
        """Draws the integrated residual of each gyro before and after what was found. Needs matplotlib."""
        return plots.residual(self.curves(), f"{self._entries['recording']}: {self.summary[0]}")

    def plot_allan(self) -> Figure:
        """Draws the Allan deviation of each gyro: data, residual before and after, and the noise fitted. Needs matplotlib."""
        return plots.allan(self._recordings, self._entries["noise"], self.curves(), self.to_dict()["recording"])

    def html(self) -> str:
        """Returns the report's page."""
        return self._native.page()

    def write(self, out: PathLike) -> None:
        """Writes what `rlg diagnose --out` writes: diagnosis.json, report.html, residual.svg, model.toml."""
        self._native.write(os.fspath(out))

    def __str__(self) -> str:
        return "\n".join(self._native.lines())

    def __repr__(self) -> str:
        return f"Diagnosis({self.verdict}: {', '.join(effect.kind for effect in self.effects) or 'no effects'})"

    def _repr_html_(self) -> str:
        lines = "<br>".join(html.escape(line) for line in self._native.lines())
        picture = base64.b64encode(self._native.residual_svg().encode()).decode()
        image = f'<img alt="Integrated residual of the gyros" src="data:image/svg+xml;base64,{picture}">'
        return f'<p style="white-space: pre-wrap">{lines}</p>{image}'


def diagnose(
    recordings: Recording | PathLike | Sequence[Recording | PathLike],
    model: Model | PathLike | None = None,
    *,
    hold_out: Recording | PathLike | Sequence[Recording | PathLike] | None = None,
    anyway: bool = False,
    seed: int = 0,
    threads: int | None = None,
    most_rows: int | None = None,
    out: PathLike | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Finds what a model leaves out of a recording, or of several together.

    Ctrl-C ends the call at once; the computation behind it ends at its next step, and has no effect any more.

    Args:
        recordings: a `Recording` or its folder, or several.
        model: what a simulation of the recordings already contains, a `Model` or its file; without it an ideal unit is
            assumed.
        hold_out: of several recordings those that test what was found; without it the last.
        anyway: put channels right that are reversed, exchanged or of another unit, instead of refusing them.
        seed: of the self-test and the control; the findings do not depend on it.
        threads: to use; the results are the same for any number.
        most_rows: to hold in memory at once.
        out: folder for the files of `Diagnosis.write`.
        progress: called with a sentence at each step.

    Raises:
        InputError: the recording or the model cannot be used.
    """
    all_of_them = each(recordings)
    arguments = [os.fspath(one) for one in all_of_them]
    arguments += options("hold-out", [os.fspath(one) for one in each(hold_out)], "")
    arguments += option("model", model) + option("anyway", anyway)
    arguments += option("seed", seed) + option("threads", threads) + option("most-rows", most_rows)
    native = _native.diagnose(arguments, progress)
    warn(native.warnings())
    found = Diagnosis(native, all_of_them)
    if out is not None:
        found.write(out)
    return found


def _parameters(entry: dict[str, Any]) -> dict[str, Parameter]:
    return {one["name"]: Parameter(one["value"], one.get("std"), one.get("unit")) for one in entry["parameters"]}


def _effect(entry: dict[str, Any]) -> Effect:
    fixed = [Combination(one["combination"], one["value"], one["std"]) for one in entry["identifiable"]]
    return Effect(
        kind=entry["kind"],
        parameters=_parameters(entry),
        covariance=np.array(entry["covariance"], dtype=float),
        identifiable=fixed,
        label=entry.get("label"),
        indistinguishable_from=entry["indistinguishable_from"],
        log_evidence_gain=entry["log_evidence_gain"],
        p_value=entry["p_value"],
        equation=entry["equation"],
        what_was_left_out=entry["what_was_left_out"],
        expression=entry["expression"],
    )
