"""Recordings, and how they are made of files, arrays and data frames."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._calls import Folder, Options, PathLike, answered, option, options
from .model import Model


@dataclass(frozen=True)
class Channel:
    """One channel of a recording, in SI units; NaN was not measured."""

    table: str
    column: str
    quantity: str
    #: None for a quantity that the project does not know.
    unit: str | None
    axis: str | None
    #: Beginning of the first row [s].
    start_s: float
    #: Time that one row covers [s]; of rows with stamps the mean.
    period_s: float
    #: Stamps of the rows [s]; None where they are even.
    stamps_s: np.ndarray | None
    values: np.ndarray

    @property
    def time_s(self) -> np.ndarray:
        """Beginning of each row [s]; the stamps where there are any."""
        if self.stamps_s is not None:
            return self.stamps_s
        return self.start_s + self.period_s * np.arange(len(self.values))


class Recording:
    """A recording: a folder with `recording.toml` and its tables."""

    def __init__(self, folder: Folder, imported: Any = None, truth: dict[str, Any] | None = None) -> None:
        self._folder = folder
        #: What an import took and left: tables, channels, left_out, notes.
        self.imported: dict[str, Any] | None = imported
        #: What a simulation concealed; no function of this package looks at it.
        self.truth = truth

    @classmethod
    def open(cls, folder: PathLike) -> Recording:
        """Opens a recording.

        Raises:
            InputError: it cannot be read, or holds something that cannot be.
        """
        answered(_native.run(["inspect", os.fspath(folder)]))
        return cls(Folder(folder, ""))

    @classmethod
    def of(cls, recording: Recording | PathLike) -> Recording:
        """Returns the recording itself, or that of a folder, which is not read yet."""
        return recording if isinstance(recording, cls) else cls(Folder(recording, ""))

    @classmethod
    def from_arrays(
        cls,
        columns: Mapping[str, ArrayLike],
        *,
        name: str = "arrays",
        out: PathLike | None = None,
        map: Options | None = None,
        unit: Options | None = None,
        time: Options | None = None,
        rate: float | None = None,
        euler: str | None = None,
        sampling: str | Sequence[str] | None = None,
        latitude_deg: float | None = None,
        gravity: float | None = None,
        instrument: str | None = None,
        start: str | None = None,
        anyway: bool = False,
    ) -> Recording:
        """Makes a recording of columns by name, known and converted as `rlg import` does those of a file.

        Args:
            columns: one-dimensional arrays; a matrix becomes `name[0]`, `name[1]` and so on, its longer side being time.
            out: folder for the recording; without it a temporary one that goes with this object.
            map: what a column is, `{"gx": "gyro_rate:x:deg/s"}`.
            unit: the unit of all columns of a quantity, `{"gyro_rate": "deg/s"}`.
            time: the column of stamps and its unit, `{"t": "ms"}`.
            rate: rows a second, where no column of stamps says it [Hz].
            euler: order of the rotations of Euler angles, such as "zyx".
            sampling: "instant" where rates and forces are the values at the rows' ends and not means, or
                "gyro_rate:instant" for one quantity.
            latitude_deg, gravity: the site, for a unit at rest without a reference [deg, m/s^2].
            instrument, start: name of the instrument, and date, time and zone of time 0, for `summarize`.
            anyway: warn of what cannot be plausible instead of refusing it.

        Raises:
            InputError: what a column is, its unit or its clock is not known, or contradicts its values.
        """
        folder = Folder(out, name)
        arguments = [name, *option("format", "csv"), *option("out", folder.path)]
        arguments += _import_options(
            map, unit, time, rate, euler, sampling, latitude_deg, gravity, instrument, start, anyway
        )
        said = _native.import_columns(_vectors(columns, name), arguments)
        return cls(folder, answered(said))

    @classmethod
    def from_dataframe(cls, frame: Any, *, time: Options | None = None, **how: Any) -> Recording:
        """Makes a recording of a pandas data frame: its columns of numbers, and its index where that has a name or times.

        Date-times become seconds from the first one; an index of date-times with a zone says when the recording started.
        Further arguments are those of `from_arrays`.
        """
        columns: dict[str, ArrayLike] = {}
        stamps: list[str] = []
        index = frame.index
        of_times = index.dtype.kind in "Mm"
        series = [(str(name), frame[name]) for name in frame.columns]
        if of_times or index.name is not None:
            series.insert(0, (str(index.name or "time"), index))
        for name, values in series:
            kind = values.dtype.kind
            if kind in "Mm":
                columns[name] = _seconds(values)
                stamps.append(f"{name}:s")
            elif kind in "iufb":
                columns[name] = values.to_numpy(dtype=float, na_value=np.nan)
            elif kind == "c":
                # Refused with its name, as an array is.
                columns[name] = values.to_numpy()
        if time is None and len(stamps) == 1:
            time = stamps
        if index.dtype.kind == "M" and getattr(index, "tz", None) is not None:
            how.setdefault("start", index[0].isoformat())
        return cls.from_arrays(columns, time=time, **how)

    @property
    def folder(self) -> Path:
        """The recording's folder."""
        return self._folder.path

    @property
    def model(self) -> Model | None:
        """The `model.toml` beside the recording, as imports and simulations write it; None where there is none."""
        file = self.folder / "model.toml"
        return Model.open(file) if file.is_file() else None

    def channels(self) -> list[Channel]:
        """Reads all channels."""
        channels = []
        for entry in _native.channels(os.fspath(self.folder)):
            stamps, values = entry.pop("stamps_s"), entry.pop("values")
            stamps_s = None if stamps is None else np.frombuffer(stamps)
            channels.append(Channel(**entry, stamps_s=stamps_s, values=np.frombuffer(values)))
        return channels

    def export(self, file: PathLike, format: str | None = None) -> list[Path]:
        """Writes it as CSV, MATLAB, Parquet or MCAP, by the extension or `format`; returns the files."""
        said = _native.run(["export", os.fspath(self.folder), *option("out", file), *option("format", format)])
        return [Path(one["file"]) for one in answered(said)["files"]]

    def write(self, out: PathLike) -> Recording:
        """Copies the recording to a new folder and returns it there."""
        shutil.copytree(self.folder, out)
        return Recording(Folder(out, ""), self.imported, self.truth)

    def __fspath__(self) -> str:
        return os.fspath(self.folder)

    def __repr__(self) -> str:
        return f"Recording({os.fspath(self.folder)!r})"


def import_file(
    file: PathLike | Sequence[PathLike],
    out: PathLike | None = None,
    *,
    map: Options | None = None,
    unit: Options | None = None,
    time: Options | None = None,
    rate: float | None = None,
    euler: str | None = None,
    sampling: str | Sequence[str] | None = None,
    format: str | None = None,
    latitude_deg: float | None = None,
    gravity: float | None = None,
    instrument: str | None = None,
    start: str | None = None,
    anyway: bool = False,
) -> Recording:
    """Makes a recording of a CSV, MATLAB, HDF5 or Parquet file, or of another that `rlg import` knows.

    Several files may be given, as one of the gyros and one of the reference. Arguments as of `Recording.from_arrays`.
    """
    files = [file] if isinstance(file, str | os.PathLike) else list(file)
    folder = Folder(out, Path(files[0]).stem or "recording")
    arguments = ["import", *(os.fspath(one) for one in files), *option("out", folder.path), *option("format", format)]
    arguments += _import_options(
        map, unit, time, rate, euler, sampling, latitude_deg, gravity, instrument, start, anyway
    )
    return Recording(folder, answered(_native.run(arguments)))


def _import_options(
    map: Options | None,
    unit: Options | None,
    time: Options | None,
    rate: float | None,
    euler: str | None,
    sampling: str | Sequence[str] | None,
    latitude_deg: float | None,
    gravity: float | None,
    instrument: str | None,
    start: str | None,
    anyway: bool,
) -> list[str]:
    said = options("map", map, "=") + options("unit", unit, ":") + options("time", time, ":")
    said += option("rate", rate) + option("euler", euler)
    for one in [sampling] if isinstance(sampling, str) else sampling or []:
        said += option("sampling", one)
    said += option("latitude-deg", latitude_deg) + option("gravity", gravity)
    said += option("instrument", instrument) + option("start", start)
    return said + (["--anyway"] if anyway else [])


def _vectors(columns: Mapping[str, ArrayLike], file: str) -> list[tuple[str, np.ndarray]]:
    vectors = []
    for name, values in columns.items():
        array = np.asarray(values)
        if array.ndim not in (1, 2):
            expected = "one dimension for a column, two for a matrix"
            raise _native.refusal(file, "has the wrong number of dimensions", name, value=str(array.ndim), expected=expected)
        array = _doubles(array, name, file)
        if array.ndim == 1:
            vectors.append((name, np.ascontiguousarray(array)))
            continue
        if array.shape[0] < array.shape[1]:
            array = array.T
        vectors += [(f"{name}[{k}]", np.ascontiguousarray(array[:, k])) for k in range(array.shape[1])]
    return vectors


def _doubles(array: np.ndarray, name: str, file: str) -> np.ndarray:
    """The values as doubles, date-times as seconds; nothing is lost on the way."""
    if array.dtype.kind in "Mm":
        return _seconds(array)
    if array.dtype.kind == "c":
        real = "real numbers: np.real, np.imag, np.abs or np.angle of it"
        raise _native.refusal(file, "is complex", name, value=str(array.dtype), expected=real)
    try:
        return array.astype(float)
    except (TypeError, ValueError):
        row, value = next((at[0], one) for at, one in np.ndenumerate(array.astype(object)) if not _is_number(one))
        raise _native.refusal(file, "is no number", name, row, repr(value), "real numbers") from None


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return True


def _seconds(values: Any) -> np.ndarray:
    """Date-times or durations as seconds from the first one; exact to a nanosecond, as a difference."""
    times = np.asarray(values)
    if times.dtype == object:
        # pandas keeps a zone beside its times; the differences are the same.
        times = np.asarray(values.tz_convert(None) if hasattr(values, "tz_convert") else values.dt.tz_convert(None))
    return np.asarray((times - times[0]) / np.timedelta64(1, "ns") * 1e-9)
