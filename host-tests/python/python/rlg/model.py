"""Models: what a simulation of the recordings already contains."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from . import _native
from ._calls import Folder, PathLike, answered, option, warn

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


class Model:
    """A `model.toml`: its text, and the file that it stands in."""

    def __init__(self, text: str, *, _file: PathLike | None = None) -> None:
        """Takes the text of a `model.toml`; it is checked.

        Raises:
            InputError: a key, a kind of effect or a value is none that a model may have.
        """
        self._folder = None
        if _file is None:
            self._folder = Folder(None, "model.toml")
            _file = self._folder.path
            Path(_file).write_text(text, encoding="utf-8")
        self.file = Path(_file)
        _, warned = _native.read_model(os.fspath(self.file))
        warn(warned)
        self.text = text

    @classmethod
    def open(cls, file: PathLike) -> Model:
        """Reads a model from a file."""
        _native.read_model(os.fspath(file))
        return cls(Path(file).read_text(encoding="utf-8"), _file=file)

    @classmethod
    def new(cls, grade: str, *, at_rest: bool = False) -> Model:
        """Makes an ideal unit with the usual noise of a grade (rlg, fog, mems, consumer) as comments in its text."""
        folder = Folder(None, "model.toml")
        arguments = ["model", "new", *option("grade", grade), *option("at-rest", at_rest)]
        answered(_native.run([*arguments, *option("out", folder.path)]))
        return cls(folder.path.read_text(encoding="utf-8"))

    @classmethod
    def ideal(cls, recording: PathLike) -> Model:
        """Makes the ideal unit that `diagnose` assumes of a recording, or its folder, where no model is given."""
        return cls(_native.ideal_model(os.fspath(recording)))

    @property
    def effects(self) -> list[dict[str, Any]]:
        """The effects that the model has, each with its kind and parameters in SI units."""
        effects: list[dict[str, Any]] = self.to_dict().get("effect", [])
        return effects

    def to_dict(self) -> dict[str, Any]:
        """Returns the model as the dictionary that its text stands for."""
        return tomllib.loads(self.text)

    def write(self, file: PathLike) -> None:
        """Writes the model to a file."""
        Path(file).write_text(self.text, encoding="utf-8")

    def __fspath__(self) -> str:
        return os.fspath(self.file)

    def __repr__(self) -> str:
        kinds = [effect.get("kind", "?") for effect in self.effects]
        return f"Model({', '.join(kinds) if kinds else 'no effects'})"
