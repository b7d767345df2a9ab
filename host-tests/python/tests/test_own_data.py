"""Files, arrays and data frames become recordings, and recordings findings."""

import numpy as np
import pandas
import pytest

import rlg


def within(parameter: rlg.Parameter, truth: float) -> bool:
    return abs(parameter.value - truth) < 4.0 * parameter.std


def effect(found: rlg.Diagnosis, kind: str) -> rlg.Effect:
    return next(effect for effect in found.effects if effect.kind == kind)


def test_a_loggers_file_becomes_a_finding(log_csv, logged):
    found = rlg.diagnose(rlg.import_file(log_csv))

    assert found.verdict == "explained"
    scale = effect(found, "gyro_scale")
    assert within(scale.parameters["y"], logged.scale_y)
    bias = effect(found, "gyro_bias").parameters["z"]
    assert within(bias, np.radians(logged.bias_z_deg_s)) and bias.unit == "rad/s"
    assert scale.covariance.shape == (len(scale.parameters),) * 2
    assert [one.weights for one in found.identifiable["gyro_bias"]] == [{"z": 1.0}]


def test_arrays_are_read_as_the_file_is(log_csv, logged):
    columns = {name: np.round(values, 15) for name, values in logged.columns().items()}
    from_file = rlg.import_file(log_csv).channels()
    from_arrays = rlg.Recording.from_arrays(columns).channels()

    assert [one.column for one in from_arrays] == [one.column for one in from_file]
    for one, other in zip(from_arrays, from_file):
        assert (one.quantity, one.unit, one.axis) == (other.quantity, other.unit, other.axis)
        # The file has nine digits.
        np.testing.assert_allclose(one.values, other.values, rtol=1e-8, atol=1e-12)
        np.testing.assert_allclose(one.time_s, other.time_s, atol=1e-9)


def test_a_matrix_with_a_map_is_known_by_its_columns(logged):
    recording = rlg.Recording.from_arrays(
        {"w": logged.gyro_deg_s, "table": logged.table_deg_s.T},
        map={"w": "gyro_rate:xyz:deg/s", "table": "reference_rate:xyz:deg/s"},
        rate=200.0,
    )
    by_axis = {one.axis: one for one in recording.channels() if one.quantity == "gyro_rate"}

    assert sorted(by_axis) == ["x", "y", "z"]
    np.testing.assert_allclose(by_axis["y"].values, np.radians(logged.gyro_deg_s[1]), rtol=1e-12)
    assert by_axis["y"].period_s == 1.0 / 200.0


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_a_data_frame_with_an_index_of_times_has_its_clock(logged, zone):
    columns = logged.columns()
    stamps = pandas.Timestamp("2026-03-01T12:00:00", tz=zone) + pandas.to_timedelta(columns.pop("time_s"), unit="s")
    frame = pandas.DataFrame(columns, index=stamps).assign(remark="a text is no channel")
    channels = rlg.Recording.from_dataframe(frame).channels()

    assert len(channels) == 6
    assert all(one.stamps_s is None and one.period_s == 1.0 / 200.0 for one in channels)


def test_a_mistake_is_one_exception_with_its_parts(logged, tmp_path):
    columns = logged.columns()
    columns["gyro_x_dps"] = columns["gyro_x_dps"].copy()
    columns["gyro_x_dps"][17] = np.inf
    with pytest.raises(rlg.InputError, match="row 17: is infinite") as caught:
        rlg.Recording.from_arrays(columns, name="bench")
    error = caught.value
    assert (error.file, error.channel, error.row, error.value) == ("bench", "gyro_x_dps", 17, "inf")
    assert error.expected.startswith("a finite number") and isinstance(error, ValueError)

    with pytest.raises(rlg.InputError, match="does not exist"):
        rlg.Recording.open(tmp_path / "nowhere")
    with pytest.raises(rlg.InputError, match="cannot be called so.*--core"):
        rlg.command("replay", "a", "--model", "b", "--core", "f16", "--out", "c")


def test_sentences_name_arguments_and_those_of_command_options(logged, tmp_path):
    gyros = dict(zip(["gx", "gy", "gz"], logged.gyro_deg_s))
    with pytest.raises(rlg.InputError) as caught:
        rlg.Recording.from_arrays(gyros | {"t [s]": logged.time_s})
    question = 'gx, gy, gz: is taken for gyro_rate, but its unit stands nowhere: unit={"gyro_rate": "'
    assert question in str(caught.value) and question in caught.value.expected
    assert "--" not in str(caught.value) and "rlg import" not in str(caught.value)
    with pytest.raises(rlg.InputError) as caught:
        rlg.Recording.from_arrays({"gx": gyros["gx"], "t [s]": logged.time_s})
    assert 'map={"COLUMN": "gyro_rate:AXIS:UNIT"}' in caught.value.expected and "--" not in str(caught.value)

    file = tmp_path / "log.csv"
    table = np.column_stack([logged.time_s, *gyros.values()])
    np.savetxt(file, table, delimiter=",", header="t [s],gx,gy,gz", comments="")
    with pytest.raises(rlg.InputError, match="rlg import .* --unit gyro_rate:"):
        rlg.command("import", file, "--out", tmp_path / "log")
    for given, words in [({"map": {"gx": "speed"}}, "map="), ({"rate": "fast"}, "rate="), ({"euler": "abc"}, "euler=")]:
        with pytest.raises(rlg.InputError) as caught:
            rlg.import_file(file, **given)
        assert words in str(caught.value) and "--" not in str(caught.value), given


def test_a_column_that_is_no_vector_of_real_numbers_is_named(logged):
    columns = logged.columns()
    for values, sentence in [
        (columns["gyro_x_dps"] + 0j, "arrays, gyro_x_dps: is complex, found complex128; expected real numbers"),
        (["0", "a", "1"], "arrays, gyro_x_dps, row 1: is no number, found 'a'"),
        (np.zeros((3, 3, 3)), "arrays, gyro_x_dps: has the wrong number of dimensions, found 3"),
    ]:
        with pytest.raises(rlg.InputError) as caught:
            rlg.Recording.from_arrays(columns | {"gyro_x_dps": values})
        assert str(caught.value).startswith(sentence) and caught.value.channel == "gyro_x_dps"
    with pytest.raises(rlg.InputError, match="gyro_x_dps: is complex"):
        rlg.Recording.from_dataframe(pandas.DataFrame(columns).assign(gyro_x_dps=columns["gyro_x_dps"] * 1j))


def test_a_temporary_recording_goes_with_its_object_and_a_copy_stays(logged, tmp_path):
    recording = rlg.Recording.from_arrays(logged.columns())
    folder = recording.folder
    copy = recording.write(tmp_path / "kept")
    del recording

    assert not folder.exists()
    assert len(rlg.Recording.open(copy.folder).channels()) == 6
