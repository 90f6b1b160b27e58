"""Files of input with their base, variant and settings merged, as the program does it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ._command import read_toml

__all__ = ["merged", "variants"]


def merged(
    path: str | os.PathLike[str], variant: str | None = None, set: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The keys of a file over those of its base, those of a variant over both, settings over all."""
    content = _with_base(Path(path))
    variants = content.pop("variant", [])
    for own in variants:
        if own.get("name") == variant:
            content = _over(content, {key: value for key, value in own.items() if key != "name"})
    for key, value in (set or {}).items():
        _put(content, key.split("."), value)
    return content


def variants(path: str | os.PathLike[str]) -> int:
    """Number of variants of a file."""
    return len(_with_base(Path(path)).get("variant", []))


def _with_base(path: Path) -> dict[str, Any]:
    content = read_toml(path)
    base = content.pop("base", None)
    return content if base is None else _over(_with_base(path.parent / base), content)


def _over(below: Any, above: Any) -> Any:
    if isinstance(below, dict) and isinstance(above, dict):
        both = dict(below)
        both.update({key: _over(below[key], value) if key in below else value for key, value in above.items()})
        return both
    if _are_named(below) and _are_named(above):
        entries = {entry["name"]: entry for entry in below}
        for entry in above:
            entries[entry["name"]] = _over(entries.get(entry["name"], {}), entry)
        return list(entries.values())
    return above


def _are_named(entries: Any) -> bool:
    return isinstance(entries, list) and all(isinstance(entry, dict) and "name" in entry for entry in entries)


def _put(table: Any, keys: list[str], value: Any) -> None:
    for key in keys[:-1]:
        if isinstance(table, list):
            table = next(entry for entry in table if entry.get("name") == key)
        else:
            table = table.setdefault(key, {})
    table[keys[-1]] = value
