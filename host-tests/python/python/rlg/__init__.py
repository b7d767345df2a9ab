"""Simulate, replay and diagnose recordings of gyros.

    import rlg

    recording = rlg.import_file("log.csv")
    found = rlg.diagnose(recording)
    print(found)

The numbers are those of the command `rlg`, since its own code makes them. Files and arrays hold SI units. While `rlg`
works, Python's other threads run; Ctrl-C ends a call within a fraction of a second.
"""

from ._calls import command
from ._native import InputError, __version__
from .diagnosis import Combination, Diagnosis, Effect, Parameter, Registration, diagnose
from .model import Model
from .recording import Channel, Recording, import_file
from .works import Calibration, Replay, calibrate, replay, simulate

__all__ = [
    "Calibration",
    "Channel",
    "Combination",
    "Diagnosis",
    "Effect",
    "InputError",
    "Model",
    "Parameter",
    "Recording",
    "Registration",
    "Replay",
    "__version__",
    "calibrate",
    "command",
    "diagnose",
    "import_file",
    "replay",
    "simulate",
]
