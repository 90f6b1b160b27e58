"""What the tests share: they look at an installed package, and never at the sources of it."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest

import pilum

# Where a shell started this in the background, Python leaves Ctrl-C ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parents[2]

# De Gennaro & Frank, Table IV (1).
TABLE_4 = dict(
    k_n=0.86e5, k_t=0.37e5, n=0.55, mu_0=0.27, mu_p=0.7, mu_c0=0.46, a=0.008, c_0=40.0, t=0.002, p_0=100.0
)


def missing(what: str) -> None:
    """Passes a test over, or fails where nothing may be passed over."""
    if os.environ.get("PILUM_REQUIRE_ALL") or os.environ.get("CI"):
        pytest.fail(f"{what} is missing, and PILUM_REQUIRE_ALL or CI is set")
    print(f"SKIPPED: {what} is missing")
    pytest.skip(f"{what} is missing")


def compiled(source: str, into: Path, *options: str) -> Path:
    """A library of a source in `tests/fixtures`, with its sidecar next to it."""
    path = ROOT / "tests/fixtures" / source
    compiler = shutil.which("cc" if path.suffix == ".c" else "gfortran")
    if compiler is None:
        missing("cc" if path.suffix == ".c" else "gfortran")
    library = into / f"lib{path.stem}.so"
    command = [str(compiler), "-shared", "-fPIC", "-O2", f"-I{path.parent}", *options, "-o", str(library), str(path)]
    subprocess.run([*command, "-lm"], check=True, cwd=into)
    sidecar = path.with_suffix(".law.toml")
    if sidecar.is_file():
        shutil.copy(sidecar, into / f"lib{path.stem}.law.toml")
    into.chmod(0o755)
    return library


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="session")
def chamber(tmp_path_factory: pytest.TempPathFactory) -> pilum.Results:
    """The pile in the calibration chamber, in few increments."""
    return pilum.run(
        pilum.cases() / "chamber_mesh1",
        set={"phase.loading.increments": 10},
        results=tmp_path_factory.mktemp("chamber"),
    )
