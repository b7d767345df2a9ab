"""The Python of docs/python.md runs, from the first block to the last."""

import re
from pathlib import Path

import matplotlib

import rlg

matplotlib.use("Agg")
PAGE = Path(__file__).resolve().parents[3] / "docs/python.md"


def test_the_page_runs(log_csv, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("log.csv").write_bytes(log_csv.read_bytes())
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    names = {}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)

    assert len(blocks) == 2 and names["found"].verdict == "explained"
    assert Path("results/report.html").is_file()
    assert names["still"].model.to_dict()["motion"]["source"] == "static"


def test_the_page_has_every_name_of_the_package():
    text = PAGE.read_text(encoding="utf-8")
    functions = [name for name in rlg.__all__ if name[0].islower()]
    assert [name for name in functions if f"`{name}(" not in text] == []
