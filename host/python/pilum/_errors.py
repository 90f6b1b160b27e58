"""Exceptions, with the place and the cause as data."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from typing import Any

__all__ = [
    "Error",
    "InputError",
    "InternalError",
    "LawError",
    "NoEquilibriumError",
    "PilumWarning",
]


class PilumWarning(UserWarning):
    """A warning, for example of a value outside its usual range."""


def warn(message: str) -> None:
    """Warns at the line of the caller: the innermost one that is not of this package."""
    level, frame = 1, sys._getframe().f_back
    while frame is not None and f"{frame.f_globals.get('__name__')}.".startswith("pilum."):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, PilumWarning, stacklevel=level + 1)


class Error(Exception):
    """Anything that Pilum cannot do. Attributes that do not apply are None.

    It is also a ValueError for a wrong value or shape, TypeError for a wrong type, KeyError for an unknown
    name, MemoryError for lack of memory.
    """

    message: str
    """Description of the error."""
    hint: str | None = None
    """What could be done about it."""
    place: str | None = None
    """Place in a run or a driver, in words."""
    phase: str | None = None
    """Name of the phase."""
    segment: int | None = None
    """Number of the segment of a driver, from 1."""
    increment: int | None = None
    """Number of the increment in its phase or segment, from 1."""
    reached: float | None = None
    """Increments of the phase reached; of a driver a fraction of the increment."""
    law: str | None = None
    """Id of the law."""
    group: str | None = None
    """Name of the group of elements."""
    element: int | None = None
    """Number of the element in its group, from 1."""
    point: int | None = None
    """Number of the integration point in its element, from 1; in `Law.integrate` its row, from 0."""
    position: Sequence[float] | None = None
    """Coordinates of the point, m."""
    outcome: str | None = None
    """What the law answered: "cut_step", "domain", "numeric", "internal" and so on."""
    factor: float | None = None
    """With "cut_step": factor on the increment."""
    cause: str | None = None
    """Reason from the law, or from the iterations."""
    file: str | None = None
    """The wrong file; None for a dictionary or `set`."""
    line: int | None = None
    """The line of it, from 1."""
    column: int | None = None
    """The column of it, from 1."""
    key: str | None = None
    """The wrong key of a dictionary or of `set`, as in `set`; entries of lists by their `name`, or from 1. The
    parameter whose value is out of bounds."""
    text: str | None = None
    """The text at that place."""

    def __init__(self, message: str = "", **attributes: Any) -> None:
        super().__init__(message)
        self.message = message
        for name, value in attributes.items():
            setattr(self, name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        return (_again, (type(self), self.message, dict(self.__dict__)))

    def __str__(self) -> str:
        lines = [self.message]
        if self.file is not None:
            lines[0] = f"{self.file}:{self.line}:{self.column}: {self.message}"
        if self.key and not (self.text or self.message).lstrip("`").startswith(self.key):
            lines.append(f"  in: {self.key}")
        if self.text:
            lines.append(f"  at: {self.text}")
        if self.hint:
            lines.append(f"  help: {self.hint}")
        return "\n".join(lines)


def _again(kind: type[Error], message: str, attributes: dict[str, Any]) -> Error:
    """An error that another process has raised."""
    error = kind(message)
    error.__dict__.update(attributes)
    return error


class InputError(Error, ValueError):
    """A file, a dictionary or an argument is wrong."""


class WrongTypeError(InputError, TypeError):
    """Something of this type is not taken."""


class NoSuchNameError(InputError, KeyError):
    """There is nothing of this name."""


class NoSuchItemError(InputError, IndexError):
    """There is nothing at this place of a sequence."""


class BusyError(Error, RuntimeError):
    """Another thread is at work there."""


class NoMemoryError(Error, MemoryError):
    """There is no memory for so much."""


class NoEquilibriumError(Error):
    """There is no equilibrium, or none was found. Results up to then are kept."""


class LawError(Error):
    """A law fails, for example over too large an increment, or its library cannot be used."""


class InternalError(Error):
    """A defect of Pilum. Please report it."""
