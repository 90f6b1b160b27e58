"""The reference of the package, from its signatures and docstrings: `python tests/python/reference.py`."""

from __future__ import annotations

import ast
import inspect
import os
import textwrap
from collections.abc import Iterator
from typing import Any

import pilum

TOP = """# The Python package

*For users of the package: all public names of `pilum`.*

Units are kN, m, kPa, angles in degrees; tension and opening are positive, shear strains are γ = 2ε.
Dictionaries have the keys of [cases](../reference/case.md) and [drivers](../reference/driver.md).
"""

ORDER = [
    ("Laws", ["Law", "State", "describe", "laws", "point"]),
    ("Runs and their results", ["run", "Progress", "Results", "Table", "Fields", "Field"]),
    ("Calibrations and studies", ["calibrate", "Calibration", "CalibrationProblem", "study", "Study"]),
    ("Libraries, tables, reports", ["check", "Check", "table", "report"]),
    ("Problems, step by step", ["Problem", "Mesh", "Simulation", "Step", "SimulationState"]),
    ("Errors", ["Error", "InputError", "NoEquilibriumError", "LawError", "InternalError", "PilumWarning"]),
    ("Where things are", ["program", "include", "cases"]),
]


def bless() -> bool:
    """Whether to rewrite the page."""
    return bool(os.environ.get("PILUM_BLESS"))


def is_native(kind: Any) -> bool:
    """Whether a class is written in Rust."""
    return isinstance(kind, type) and getattr(pilum._pilum, kind.__name__, None) is kind


def signature(name: str, thing: Any) -> str:
    """A call as its caller writes it, without types."""
    if is_native(thing) and "__new__" not in vars(thing):
        return name
    try:
        parameters = list(inspect.signature(thing).parameters.values())
    except ValueError:
        return name
    plain = []
    for parameter in parameters:
        if parameter.name in ("self", "cls"):
            continue
        plain.append(parameter.replace(annotation=inspect.Parameter.empty))
    return f"{name}{inspect.Signature(plain)}"


def doc(thing: Any) -> str:
    """The docstring; lines of a paragraph are joined."""
    paragraphs = inspect.cleandoc(thing.__doc__ or "").split("\n\n")
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)


def attributes(kind: type) -> Iterator[tuple[str, str]]:
    """Attributes of a class that are documented where they are set."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(kind)))
    except (OSError, TypeError):
        return
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if not isinstance(body, list):
            continue
        for one, after in zip(body, body[1:]):
            said = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            target = one.target if isinstance(one, ast.AnnAssign) else None
            if isinstance(one, ast.Assign):
                target = one.targets[0]
            if said and target is not None:
                name = target.attr if isinstance(target, ast.Attribute) else getattr(target, "id", "_")
                if not name.startswith("_"):
                    yield name, " ".join(str(after.value.value).split())


def members(kind: type) -> Iterator[tuple[str, str]]:
    """Public methods and properties of a class; those of a class in Rust have no inherent order."""
    all_of_it = list(vars(kind).items())
    if is_native(kind):
        all_of_it.sort(key=lambda item: (not callable(item[1]), item[0]))
    for name, value in all_of_it:
        if name.startswith("_") or isinstance(value, (str, type(None), int)):
            continue
        if isinstance(value, (classmethod, staticmethod)):
            value = value.__func__
            yield signature(name, value), doc(value)
        elif callable(value):
            yield signature(name, value), doc(value)
        elif hasattr(value, "__get__") and value.__doc__ and not value.__doc__.startswith("Alias for"):
            yield name, doc(value)


def page() -> str:
    """The whole page."""
    parts = [TOP]
    listed = [name for _, names in ORDER for name in names]
    assert sorted(listed) == sorted(pilum.__all__), set(listed) ^ set(pilum.__all__)
    explained: dict[tuple[str, str], str] = {}
    for title, names in ORDER:
        parts.append(f"## {title}\n")
        for name in names:
            thing = getattr(pilum, name)
            is_error = isinstance(thing, type) and issubclass(thing, BaseException)
            call = name if is_error else signature(name, thing)
            parts.append(f"### `{call}`\n\n{doc(thing)}\n")
            if isinstance(thing, type):
                rows = [*attributes(thing), *members(thing)]
                # Members that an earlier class explains alike.
                same = [row for row in rows if row in explained]
                if len(same) > 1:
                    rows = [row for row in rows if row not in same]
                    rows.append(("`, `".join(member for member, _ in same), f"As of `{explained[same[0]]}`."))
                if rows:
                    parts.append("| | |\n|---|---|")
                    for member, text in rows:
                        explained.setdefault((member, text), name)
                        cell = text.replace("\n\n", "<br>").replace("|", "\\|")
                        parts.append(f"| `{member}` | {cell} |")
                    parts.append("")
    return "\n".join(parts).rstrip() + "\n"


if __name__ == "__main__":
    print(page(), end="")
