"""The typed result: the command's numbers, its files, its tables and pictures."""

import json
import subprocess
import warnings

import matplotlib
import numpy as np
import pytest

import rlg
from rlg import plots
from rlg.allan import deviation

matplotlib.use("Agg")


@pytest.fixture(scope="module")
def recording(log_csv):
    return rlg.import_file(log_csv)


@pytest.fixture(scope="module")
def found(recording):
    return rlg.diagnose(recording, recording.model)


def test_the_json_is_the_commands_byte_for_byte(command, recording, found):
    arguments = [command, "diagnose", recording.folder, "--model", recording.model.file, "--json"]
    printed = subprocess.run(arguments, check=True, capture_output=True, text=True).stdout

    assert found.json + "\n" == printed
    assert found.to_dict() == json.loads(printed)


def test_the_lines_are_the_commands_too(command, recording):
    printed = subprocess.run([command, "diagnose", recording.folder], check=True, capture_output=True, text=True).stdout

    # The one option that they name is an argument here.
    assert printed.count("--") == printed.count("no --model is given") + printed.count("--out DIR") == 2
    lines = printed.replace("no --model is given", "no model= is given").splitlines()
    assert str(rlg.diagnose(recording)) == "\n".join(lines[:-1])


def test_files_and_folders_are_taken_as_their_objects_are(recording, found):
    assert rlg.diagnose(str(recording.folder), model=str(recording.model.file)).json == found.json
    assert rlg.diagnose([recording.folder], model=recording.model.file).json == found.json


def test_the_files_are_the_commands(command, recording, found, tmp_path):
    found.write(tmp_path / "package")
    arguments = [command, "diagnose", recording.folder, "--model", recording.model.file, "--out", tmp_path / "command"]
    subprocess.run(arguments, check=True, capture_output=True)

    names = sorted(file.name for file in (tmp_path / "command").iterdir())
    assert names == ["diagnosis.json", "model.toml", "report.html", "residual.svg"]
    for name in names:
        assert (tmp_path / "package" / name).read_bytes() == (tmp_path / "command" / name).read_bytes(), name
    with pytest.raises(rlg.InputError, match="folder of the recording itself"):
        found.write(recording.folder)


def test_the_found_model_explains_the_recording(recording, found):
    assert sorted(effect["kind"] for effect in found.model.effects) == ["gyro_bias", "gyro_scale"]
    again = rlg.diagnose(recording, found.model)

    assert again.verdict == "matches" and again.effects == []
    assert again.to_dataframe().empty


def test_a_data_frame_has_a_row_a_parameter(found):
    frame = found.to_dataframe().set_index(["kind", "parameter"])

    numbers = {(effect.kind, name): one for effect in found.effects for name, one in effect.parameters.items()}
    assert set(frame.index) == set(numbers)
    assert frame.loc[("gyro_scale", "y"), "value"] == numbers[("gyro_scale", "y")].value


def test_the_plots_show_the_residual_that_falls(found):
    figure = found.plot_residual()
    y = figure.axes[1]
    before, after = (line.get_ydata() for line in y.get_lines())

    assert np.ptp(before) > 2.0 * np.ptp(after)
    labels = [text.get_text() for text in found.plot_allan().axes[0].get_legend().get_texts()]
    assert labels[:3] == ["data", "residual before", "residual after"] and "°/√h" in labels[3]


def test_a_notebook_shows_words_and_a_picture_and_no_foreign_markup(logged):
    recording = rlg.Recording.from_arrays(logged.columns(), name="<b>bench")
    shown = rlg.diagnose(recording)._repr_html_()

    assert "gyro scale y" in shown and "data:image/svg+xml;base64," in shown
    assert "<b>" not in shown


def test_the_allan_deviation_of_white_and_of_walking_rates_is_the_textbooks():
    draw = np.random.default_rng(3)
    period_s, walk = 0.01, 2.0e-5
    white = np.cumsum(draw.normal(0.0, walk * np.sqrt(period_s), 400_000))
    tau_s, sigma = deviation(white, period_s)
    short = tau_s < 10.0
    # 4000 averages of 10 s or more: a percent or so.
    np.testing.assert_allclose(sigma[short], walk / np.sqrt(tau_s[short]), rtol=0.06)

    entry = {"angle_random_walk_rad_sqrt_s": walk, "angle_noise_rad": 0.0}
    np.testing.assert_allclose(plots.noise_deviation(entry, tau_s), walk / np.sqrt(tau_s), rtol=1e-12)
    steady = deviation(np.arange(1000) * 0.3, 0.1)[1]
    assert np.max(steady) < 1e-12


def test_models_are_made_opened_and_refused(recording, tmp_path):
    model = rlg.Model.new("mems")
    assert model.effects == [] and "MEMS" in model.text
    model.write(tmp_path / "model.toml")
    assert rlg.Model.open(tmp_path / "model.toml").to_dict() == model.to_dict()
    assert rlg.Model.ideal(recording).to_dict()["motion"]["source"] == "reference"
    with pytest.raises(rlg.InputError, match="mems|fog"):
        rlg.Model.new("gold")
    with pytest.raises(rlg.InputError):
        rlg.Model(model.text + '\n[[effect]]\nkind = "no such physics"\n')


def test_simulation_replay_and_calibration_go_through_the_chain(scenario):
    recording = rlg.simulate(text=scenario(6.0), seed=5)
    assert recording.truth["effects"][0]["kind"] == "axis_flexure"
    with warnings.catch_warnings():
        # The chain says what it has no term for.
        warnings.simplefilter("ignore")
        replayed = rlg.replay(recording, core="fixed")
    assert replayed.result["core"] == "fixed" and replayed.result["samples"] == 12_000
    assert {one.column for one in replayed.compensated.channels()} >= {"dtheta_x", "dtheta_y", "dtheta_z"}

    calibrated = rlg.calibrate(recording)
    assert calibrated.summary and calibrated.result["summary"] == calibrated.summary
    assert calibrated.html().startswith("<!DOCTYPE html>")
