"""Places of the program, the laws and the headers that came with the package."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

__all__ = ["cases", "include", "program"]

_INSTALLED = Path(__file__).resolve().parent / "installed"


def program() -> Path:
    """The program `pilum`."""
    return _INSTALLED / "bin" / ("pilum.exe" if sys.platform == "win32" else "pilum")


def include() -> Path:
    """Folder of the headers for laws in C and C++; `pilum_law.f90` for Fortran is in `share` next to it."""
    return _INSTALLED / "include" / "pilum"


def cases() -> Path:
    """The folder of the cases that came with the package."""
    return _INSTALLED / "share" / "pilum" / "cases"


def _ready() -> None:
    """Has the program run for everybody: unpackers of wheels differ in what they keep of rights."""
    path = program()
    if os.name == "posix" and path.is_file() and not os.access(path, os.X_OK):
        with contextlib.suppress(OSError):
            path.chmod(path.stat().st_mode | 0o755)
