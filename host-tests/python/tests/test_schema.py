"""Real results are what `docs/diagnosis.schema.json`, the schema of `diagnosis.json`, permits."""

import json
import shutil
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import rlg

SCHEMA = json.loads((Path(__file__).resolve().parents[3] / "docs/diagnosis.schema.json").read_text(encoding="utf-8"))


def closed(schema):
    """The same without unlisted fields, which the schema permits to later versions: this one lists all of its own."""
    if isinstance(schema, list):
        return [closed(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    inner = {name: closed(one) for name, one in schema.items()}
    return inner | {"additionalProperties": False} if "properties" in schema else inner


CHECK = jsonschema.Draft202012Validator(closed(SCHEMA))


@pytest.fixture(scope="module")
def attitude(logged):
    """A turn about z with the angle as a quaternion ten times a second, and a late gyro."""
    angle = 0.8 * np.sin(2.0 * np.pi * 0.4 * logged.time_s)
    rate = 0.8 * 2.0 * np.pi * 0.4 * np.cos(2.0 * np.pi * 0.4 * (logged.time_s - 0.01))
    noise = np.random.default_rng(3).normal(0.0, 1e-3, (3, len(rate)))
    gyro = noise + np.array([np.zeros_like(rate), np.zeros_like(rate), rate])
    columns = {"t [s]": logged.time_s} | {f"gyro_{name}": values for name, values in zip("xyz", gyro)}
    columns |= {"qw": np.cos(angle / 2), "qx": 0 * angle, "qy": 0 * angle, "qz": np.sin(angle / 2)}
    kinds = {f"gyro_{name}": f"gyro_rate:{name}:rad/s" for name in "xyz"}
    kinds |= {f"q{name}": f"reference_attitude:{name}:1" for name in "wxyz"}
    return rlg.Recording.from_arrays(columns, map=kinds)


@pytest.fixture(scope="module")
def still(logged):
    """A unit at rest, with a steady line of one gyro."""
    gyro = np.random.default_rng(5).normal(0.0, 1e-4, (3, len(logged.time_s)))
    gyro[0] += 5e-5 * np.sin(2.0 * np.pi * 12.3 * logged.time_s)
    columns = {f"gyro_{name}": values for name, values in zip("xyz", gyro)}
    kinds = {f"gyro_{name}": f"gyro_rate:{name}:rad/s" for name in "xyz"}
    return rlg.Recording.from_arrays(columns, map=kinds, rate=200.0, latitude_deg=48.0, gravity=9.808)


def test_the_schema_is_one_and_knows_its_format(log_csv):
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    entries = rlg.diagnose(rlg.import_file(log_csv)).to_dict()

    assert CHECK.is_valid(entries) and not CHECK.is_valid(entries | {"format": 2})
    del entries["effects"][0]["covariance"]
    assert not CHECK.is_valid(entries)
    later = entries | {"effects": [], "of_a_later_version": 1}
    assert not CHECK.is_valid(later) and jsonschema.Draft202012Validator(SCHEMA).is_valid(later)


def test_results_of_every_kind_are_what_it_permits(log_csv, attitude, still, scenario, tmp_path):
    simulated = rlg.simulate(text=scenario(4))
    logged = rlg.import_file(log_csv)
    again = rlg.import_file(shutil.copy(log_csv, tmp_path / "again.csv"))
    found = {
        "rates": rlg.diagnose(logged),
        "dithered": rlg.diagnose(simulated, simulated.model),
        "attitude": rlg.diagnose(attitude),
        "rest": rlg.diagnose(still),
        "several": rlg.diagnose([logged, again]),
    }
    problems = {
        kind: [f"{one.json_path}: {one.message[:200]}" for one in CHECK.iter_errors(one.to_dict())]
        for kind, one in found.items()
    }
    assert problems == {kind: [] for kind in found}
    # Each kind has fields that the others lack.
    assert found["attitude"].registration and found["rest"].to_dict()["control"]
    assert found["several"].to_dict()["fit"]["recordings"]
