"""Kinds of files: how each is told from others, and what reads it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from fiberplan.tables.contents import plain_name

T = TypeVar("T")


@dataclass(frozen=True)
class FileFormat(Generic[T]):
    """One kind of file or folder.

    `accepts` looks at the name, and at a few bytes at most; it never raises. `read` raises one line that names what
    cannot be used.
    """

    about: str  #: what it is, for people
    accepts: Callable[[Path], bool]
    read: Callable[[Path], T]
    usable: Callable[[Path], T] | None = None
    """Reads what can be used, and names what cannot, where `read` refuses the whole; None: there is no such thing."""


@dataclass(frozen=True)
class ContentFormat(Generic[T]):
    """One kind of file that is read once, as a whole: both functions get its path, for messages, and its bytes."""

    about: str  #: what it is, for people
    accepts: Callable[[Path, bytes], bool]
    read: Callable[[Path, bytes], T]


def content_format(formats: Mapping[str, ContentFormat[T]], path: Path, content: bytes) -> ContentFormat[T] | None:
    """The first of `formats` that accepts a file; one that was packed, by its name without ``.gz``."""
    path = plain_name(path)
    return next((formats[name] for name in formats if formats[name].accepts(path, content)), None)


def format_of(formats: Mapping[str, FileFormat[T]], path: Path) -> FileFormat[T] | None:
    """The first of `formats` that accepts `path`."""
    return next((formats[name] for name in formats if formats[name].accepts(path)), None)
