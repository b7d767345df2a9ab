"""Calls of the command's code: arguments, warnings, folders for results."""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from . import _native

PathLike = str | os.PathLike[str]

T = TypeVar("T", bound=PathLike)

#: Called with a sentence at each step of the work.
Progress = Callable[[str], object]

#: One value, several, or several by name: `{"gx": "gyro_rate:x:deg/s"}` is `["gx=gyro_rate:x:deg/s"]`.
Options = str | Iterable[str] | Mapping[str, str]


def option(name: str, value: object) -> list[str]:
    """Returns `--name=value`, or nothing where the value is None or False."""
    if value is None or value is False:
        return []
    # An option that stands behind its sign may begin with a minus.
    return [f"--{name}"] if value is True else [f"--{name}={os.fspath(value) if isinstance(value, os.PathLike) else value}"]


def options(name: str, values: Options | None, between: str) -> list[str]:
    """Returns `--name=value` for each value; of a mapping, key and value with `between` between them."""
    if values is None:
        return []
    if isinstance(values, str):
        values = [values]
    elif isinstance(values, Mapping):
        values = [f"{key}{between}{value}" for key, value in values.items()]
    return [f"--{name}={value}" for value in values]


def each(given: T | Sequence[T] | None) -> list[T]:
    """Returns one folder, or several, as a list."""
    if given is None:
        return []
    # A text is a sequence too.
    return [given] if isinstance(given, str | os.PathLike) else list(given)


def warn(texts: Iterable[str]) -> None:
    """Warns as Python does, at the caller of the package."""
    for text in texts:
        warnings.warn(text, UserWarning, stacklevel=4)


def answered(said: tuple[str | None, list[str]]) -> Any:
    """Warns, and returns the result."""
    text, warned = said
    warn(warned)
    return None if text is None else json.loads(text)


def command(*arguments: PathLike, progress: Progress | None = None) -> Any:
    """Runs `rlg ARGUMENTS` in this process and returns what `--json` would print: for commands without a function here.

    >>> rlg.command("align", "flight", "--model", "flight/model.toml")
    """
    # The caller gave options, so the sentences may name them.
    return answered(_native.run([os.fspath(argument) for argument in arguments], progress, as_command=True))


class Folder:
    """A folder for a result: the caller's, or a temporary one that lives as long as this."""

    def __init__(self, out: PathLike | None, name: str) -> None:
        self._temporary: tempfile.TemporaryDirectory[str] | None = None
        if out is None:
            self._temporary = tempfile.TemporaryDirectory(prefix="rlg-")
            out = Path(self._temporary.name) / name
        self.path = Path(out)
