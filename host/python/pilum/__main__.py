"""The command `pilum`, which came with the package: `pilum …` or `python -m pilum …`."""

from __future__ import annotations

import os
import subprocess
import sys

from ._where import program


def main() -> int:
    """Runs the program in place of the interpreter."""
    path = str(program())
    arguments = [path, *sys.argv[1:]]
    if os.name == "posix":
        os.execv(path, arguments)
    return subprocess.call(arguments)


if __name__ == "__main__":
    sys.exit(main())
