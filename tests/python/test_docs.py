"""The notebooks, the pages, the reference and the stubs are those of the package."""

from __future__ import annotations

import ast
import doctest
import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import pilum
import reference
from conftest import ROOT, missing

DOCS = ROOT / "host/docs/python"
PAGES = sorted(page.name for page in DOCS.glob("*.md"))
NOTEBOOKS = sorted(notebook.name for notebook in DOCS.glob("*.ipynb"))


def run_cells(notebook: dict) -> int:
    """Executes the cells of a notebook one after the other; how many."""
    space: dict = {"__name__": "__main__"}
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    for number, cell in enumerate(cells, 1):
        exec(compile("".join(cell["source"]), f"cell {number}", "exec"), space)
    return len(cells)


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_notebooks_run(name: str, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = json.loads((DOCS / name).read_text())
    try:
        assert run_cells(notebook) >= 5
    except ModuleNotFoundError as error:
        missing(str(error.name))
    # Outputs are not kept: they would be others' than the reader's.
    assert all(not cell.get("outputs") for cell in notebook["cells"])


def test_a_cell_that_fails_is_noticed() -> None:
    with pytest.raises(ZeroDivisionError):
        run_cells({"cells": [{"cell_type": "code", "source": ["1 / 0\n"]}]})


def sessions(page: str) -> str:
    """The `pycon` blocks of a page."""
    parts = page.split("```pycon\n")[1:]
    return "\n".join(part.split("```")[0] for part in parts)


@pytest.mark.parametrize("name", [page for page in PAGES if page != "reference.md"])
def test_pages_are_followed(name: str, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "agg")
    text = (DOCS / name).read_text()
    test = doctest.DocTestParser().get_doctest(sessions(text), {}, name, str(DOCS / name), 0)
    said: list[str] = []
    options = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    outcome = doctest.DocTestRunner(optionflags=options).run(test, out=said.append)
    assert outcome.failed == 0, "".join(said)
    assert outcome.attempted >= (0 if name == "why.md" else 4)


def test_the_reference_is_that_of_the_package() -> None:
    page = DOCS / "reference.md"
    if reference.bless():
        page.write_text(reference.page())
    assert page.read_text() == reference.page(), "PILUM_BLESS=1 tests/python/run.sh writes it"


def test_every_public_name_says_what_it_is() -> None:
    for name in pilum.__all__:
        thing = getattr(pilum, name)
        assert thing.__doc__, name
        if isinstance(thing, type):
            for member, value in vars(thing).items():
                is_public = not member.startswith("_") and (callable(value) or hasattr(value, "__get__"))
                if is_public and not isinstance(value, (str, type(None))):
                    assert value.__doc__, f"{name}.{member}"


def stubs() -> dict[str, set[str]]:
    """Classes of the stubs with their members; functions under the empty name."""
    spec = importlib.util.find_spec("pilum")
    assert spec is not None and spec.origin is not None
    tree = ast.parse((Path(spec.origin).parent / "_pilum.pyi").read_text())
    found: dict[str, set[str]] = {"": set()}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            found[""].add(node.name)
        if isinstance(node, ast.ClassDef):
            found[node.name] = {n.name for n in node.body if isinstance(n, ast.FunctionDef)}
    return found


def test_stubs_have_what_the_module_has() -> None:
    from pilum import _pilum

    found = stubs()
    own = {name for name in dir(_pilum) if not name.startswith("__")}
    assert own == (found[""] | set(found)) - {""}
    for name, members in found.items():
        if name:
            public = {m for m in vars(getattr(_pilum, name)) if not m.startswith("_")}
            assert public == {m for m in members if not m.startswith("_")}, name


def test_types_are_checked(here: Path) -> None:
    """mypy accepts the package, and the stubs next to the module."""
    if importlib.util.find_spec("mypy") is None:
        missing("mypy")
    for check in (["mypy", "--strict", "--no-namespace-packages", "-p", "pilum"], ["mypy.stubtest", "pilum._pilum", "--ignore-missing-stub"]):
        done = subprocess.run([sys.executable, "-m", *check], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr


def flagged(checker: str, file: Path) -> list[int]:
    """Lines that a type checker finds wrong."""
    if importlib.util.find_spec(checker) is None:
        missing(checker)
    options = ["--strict", "--no-pretty"] if checker == "mypy" else ["--outputjson", "--pythonpath", sys.executable]
    command = [sys.executable, "-m", checker, *options, str(file)]
    said = subprocess.run(command, capture_output=True, text=True)
    if checker == "mypy":
        assert said.returncode in (0, 1), said.stdout + said.stderr
        lines = re.findall(rf"^.*{re.escape(file.name)}:(\d+): error:", said.stdout, re.MULTILINE)
    else:
        told = json.loads(said.stdout)
        assert told["summary"]["filesAnalyzed"] == 1, said.stdout
        errors = (one for one in told["generalDiagnostics"] if one["severity"] == "error")
        lines = [one["range"]["start"]["line"] + 1 for one in errors]
    return sorted({int(line) for line in lines})


@pytest.mark.parametrize("checker", ["mypy", "pyright"])
def test_types_are_used(checker: str, here: Path) -> None:
    """Right uses pass, with the types that `assert_type` names; each line of wrong ones is found, and no other."""
    folder = Path(__file__).resolve().parent / "types"
    assert flagged(checker, folder / "right.py") == []
    wrong = (folder / "wrong.py").read_text().splitlines()
    expected = [number for number, line in enumerate(wrong, 1) if line.endswith("# wrong")]
    assert len(expected) > 25 and flagged(checker, folder / "wrong.py") == expected
    (here / "loose.py").write_text(
        'from typing_extensions import assert_type\nimport pilum\nassert_type(pilum.run("case"), pilum.Results)\n'
    )
    assert flagged(checker, here / "loose.py") == [3]


def test_the_recipe_of_conda_is_that_of_the_package() -> None:
    from importlib.metadata import requires, version

    recipe = (ROOT / "host/python/conda/recipe.yaml").read_text()
    assert f'version: "{version("pilum")}"' in recipe
    assert [need.replace(">", " >") for need in requires("pilum") or []] == re.findall("- (numpy .*)", recipe)


def test_the_package_needs_numpy_alone() -> None:
    from importlib.metadata import requires

    assert requires("pilum") == ["numpy>=1.23"]
    spec = importlib.util.find_spec("pilum")
    assert spec is not None and spec.origin is not None
    assert (Path(spec.origin).parent / "py.typed").is_file()
    code = "import sys, pilum; print(sorted({'pandas', 'matplotlib', 'pyvista', 'meshio'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
