"""Simulation, replay and calibration."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _native
from ._calls import Folder, PathLike, Progress, answered, each, option
from .model import Model
from .recording import Recording


def simulate(
    scenario: PathLike | None = None,
    *,
    text: str | None = None,
    seed: int = 0,
    out: PathLike | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Makes a recording from a scenario, a file or its text; `host-tests/scenarios/README.md` has its keys.

    Returns:
        The recording, with `model` (without what is concealed) and `truth` (with it).
    """
    written = Folder(None, "scenario.toml")
    if text is not None and scenario is None:
        written.path.write_text(text, encoding="utf-8")
        scenario = written.path
    elif text is not None or scenario is None:
        raise TypeError("simulate takes a scenario's file or its text")
    folder = Folder(out, "simulated")
    arguments = ["simulate", os.fspath(scenario), *option("seed", seed), *option("out", folder.path)]
    said = answered(_native.run(arguments, progress))
    truth = json.loads(Path(said["truth"]).read_text(encoding="utf-8"))
    return Recording(folder, truth=truth)


@dataclass(frozen=True)
class Replay:
    """A recording through the firmware's chain."""

    #: `replay.json`: drift before and after, by segment.
    result: dict[str, Any]
    #: Rotation vectors a period of output.
    compensated: Recording


def replay(
    recording: Recording | PathLike,
    model: Model | PathLike | None = None,
    *,
    core: str = "f32",
    out: PathLike | None = None,
    output_every: int | None = None,
    adapt_s: float | None = None,
    progress: Progress | None = None,
) -> Replay:
    """Runs a recording through the chain on the host.

    Args:
        recording: a `Recording` or its folder.
        model: what the chain compensates, a `Model` or its file; without it the model beside the recording.
        core: number system of the chain: f32, fixed or reference.
        output_every: samples in one output period.
        adapt_s: time in which the dither strip follows the pickoff's gain and delay [s].
    """
    folder = Folder(out, "replayed")
    arguments = ["replay", os.fspath(recording), *option("model", _model(model, recording))]
    arguments += option("core", core) + option("output-every", output_every)
    arguments += option("adapt-s", adapt_s) + option("out", folder.path)
    return Replay(answered(_native.run(arguments, progress)), Recording(folder))


class Calibration:
    """Flexure coefficients, with what was not identifiable."""

    def __init__(self, folder: Folder, result: dict[str, Any]) -> None:
        self._folder = folder
        #: `calibration.json`.
        self.result = result
        #: One sentence each.
        self.summary: list[str] = result["summary"]
        #: The model with the flexure that the recordings fix.
        self.model = Model((folder.path / "model.toml").read_text(encoding="utf-8"))

    def html(self) -> str:
        """Returns the report's page."""
        return (self._folder.path / "report.html").read_text(encoding="utf-8")

    def __repr__(self) -> str:
        return "\n".join(self.summary)


def calibrate(
    recordings: Recording | PathLike | Sequence[Recording | PathLike],
    model: Model | PathLike | None = None,
    *,
    out: PathLike | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Calibrates how far the dither suspensions bend, of recordings of one instrument.

    Args:
        recordings: a `Recording` or its folder, or several.
        model: what the instrument's compensation already contains, a `Model` or its file; without it the model beside the
            first recording.
    """
    all_of_them = each(recordings)
    folder = Folder(out, "calibrated")
    arguments = ["calibrate", *(os.fspath(one) for one in all_of_them)]
    arguments += option("model", _model(model, all_of_them[0])) + option("out", folder.path)
    return Calibration(folder, answered(_native.run(arguments, progress)))


def _model(model: Model | PathLike | None, recording: Recording | PathLike) -> Model | PathLike:
    beside = model or Recording.of(recording).model
    if beside is None:
        raise _native.refusal(os.fspath(recording), "has no model.toml beside it", expected="model=")
    return beside
