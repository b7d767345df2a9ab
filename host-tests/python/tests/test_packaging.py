"""What pip reads of the package, and what type checkers do."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import rlg
from rlg import _native

PACKAGE = Path(__file__).resolve().parents[1]


def test_the_stubs_declare_what_the_library_has():
    stubs = ast.parse((PACKAGE / "python/rlg/_native.pyi").read_text())
    declared = {node.name: node for node in stubs.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    there = {name: value for name, value in vars(_native).items() if not name.startswith("__")}

    assert set(declared) == set(there)
    for name, value in there.items():
        node = declared[name]
        if isinstance(node, ast.FunctionDef):
            assert [argument.arg for argument in node.args.args] == list(inspect.signature(value).parameters), name
    methods = {node.name for node in declared["Diagnosed"].body if isinstance(node, ast.FunctionDef)}
    assert methods == {name for name in vars(_native.Diagnosed) if not name.startswith("__")}
    assert (Path(rlg.__file__).parent / "py.typed").is_file()


#: A user's program: every line is right.
PROGRAM = """
from pathlib import Path

import rlg

found: rlg.Diagnosis = rlg.diagnose("flight", model=Path("model.toml"), hold_out=[Path("a"), rlg.Recording.open("b")])
also: rlg.Diagnosis = rlg.diagnose([rlg.Recording.open("a"), "b"], model=rlg.Model.open("model.toml"))
drift: dict[str, object] = rlg.replay("flight", "model.toml").result
version: str = rlg.__version__
"""


def checked(*arguments: str, cache: Path, cwd: Path) -> str:
    command = [sys.executable, "-m", "mypy", "--cache-dir", str(cache), *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True).stdout


def test_the_types_are_those_that_mypy_finds(tmp_path):
    cache = tmp_path / "cache"
    said = checked(cache=cache, cwd=PACKAGE)
    assert said.startswith("Success"), said

    file = tmp_path / "program.py"
    file.write_text(PROGRAM)
    config = ["--config-file", str(PACKAGE / "pyproject.toml")]
    said = checked(*config, str(file), cache=cache, cwd=PACKAGE / "python")
    assert said.startswith("Success"), said
    file.write_text("import rlg\n\nrlg.diagnose(3)\n")
    assert 'error: Argument 1 to "diagnose"' in checked(*config, str(file), cache=cache, cwd=PACKAGE / "python")


def test_the_version_is_the_commands(command):
    printed = subprocess.run([command, "--version"], check=True, capture_output=True, text=True).stdout
    assert printed == f"rlg {rlg.__version__}\n"


def test_pip_is_told_name_version_and_needs(tmp_path):
    arguments = [sys.executable, "-m", "maturin", "pep517", "write-dist-info", "--metadata-directory", tmp_path]
    subprocess.run([*arguments, "--interpreter", sys.executable], cwd=PACKAGE, check=True, capture_output=True)
    metadata = next(tmp_path.glob("rlg-*.dist-info/METADATA")).read_text()

    assert "\nName: rlg\n" in metadata and "\nRequires-Dist: numpy" in metadata
    assert "\nRequires-Python: >=3.10\n" in metadata
