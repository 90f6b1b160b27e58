"""Calls of the program that came with the package, and its errors as exceptions."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._errors import Error, InputError, InternalError, LawError, NoEquilibriumError, warn
from ._where import program

__all__ = ["carry_out", "read_toml", "settings", "toml_value"]

_KINDS: dict[int, type[Error]] = {1: InputError, 2: NoEquilibriumError, 3: LawError, 4: InternalError}
_PLACE = re.compile(r"^ *--> (.*):(\d+):(\d+)$", re.M)
_TEXT = re.compile(r"^ *\d+ \| (.*)$", re.M)
_MORE = re.compile(r"^ *= (?:(help): )?(.*)$", re.M)
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def carry_out(arguments: Sequence[str], allowed: Sequence[int] = (0,)) -> str:
    """Standard output of the program with these arguments; other exit codes than those allowed are raised."""
    done = subprocess.run(
        [str(program()), *arguments], capture_output=True, text=True, encoding="utf-8", check=False
    )
    if done.returncode == 130:
        raise KeyboardInterrupt
    if done.returncode not in allowed or done.returncode and not done.stdout:
        raise _error(done.returncode, done.stderr)
    for line in done.stderr.splitlines():
        if line.startswith("warning: "):
            warn(line.removeprefix("warning: "))
    return done.stdout


def _error(code: int, text: str) -> Error:
    """The last error that the program has told of."""
    start = max(text.rfind("\nerror: ") + 1, 0)
    text = text[start:].strip()
    attributes: dict[str, Any] = {}
    place = _PLACE.search(text)
    if place is not None and place[1] != "--set":  # which nobody has written
        attributes.update(file=place[1], line=int(place[2]), column=int(place[3]))
    written = _TEXT.search(text)
    if place is not None and written is not None:
        attributes["text"] = written[1].strip()
        key = re.match(r"\[*([\w.\"-]+)\]* *(?:=|$)", attributes["text"])
        attributes["key"] = key[1] if key else None
    message = text.split("\n", 1)[0].removeprefix("error: ") or f"the program ended with {code}"
    for kind, more in _MORE.findall(text):
        if kind:
            attributes["hint"] = more
        else:
            message += f": {more}"
    return _KINDS.get(code, InternalError)(message, **attributes)


def settings(values: Mapping[str, Any] | None) -> list[str]:
    """Settings as arguments of the program."""
    pairs = (values or {}).items()
    return [part for key, value in pairs for part in ("--set", f"{key}={toml_value(value)}")]


def toml_value(value: Any) -> str:
    """A value as in a TOML file."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, (str, os.PathLike)):
        return json.dumps(os.fspath(value), ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(name)} = {toml_value(v)}" for name, v in value.items()) + " }"
    if isinstance(value, (Sequence, np.ndarray)):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    raise InputError(f"a value of type {type(value).__name__} has no form in a file")


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """A file, without its base."""
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        try:
            import tomli as tomllib
        except ImportError:
            raise InputError("reading this file in Python 3.10 needs the package `tomli`") from None
    try:
        return dict(tomllib.loads(Path(path).read_text(encoding="utf-8")))
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(str(error), file=str(path)) from None
