"""Where readers of instruments' own files register, ours beside their definition and others by entry points.

A package of one's own names a `fiberplan.tables.formats.FileFormat` of a focal plane in its entry points of the group
``fiberplan.instruments``, a `ContentFormat` of a field of targets (whose `read` gives the fields of `Targets`) in those
of ``fiberplan.targets``. A function without arguments in ``fiberplan.instruments`` is a named instrument.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from fiberplan.focal_plane import FocalPlane
from fiberplan.registry import Registry
from fiberplan.tables.formats import ContentFormat, FileFormat

INSTRUMENTS: Registry[FileFormat[FocalPlane] | Callable[[], FocalPlane]] = Registry(
    "instrument", "fiberplan.instruments"
)
TARGET_FILES: Registry[ContentFormat[dict[str, Any]]] = Registry("format of targets", "fiberplan.targets")


_Reader = TypeVar("_Reader", bound=Callable[[Path], FocalPlane])


def focal_plane_format(
    name: str,
    about: str,
    accepts: Callable[[Path], bool],
    usable: Callable[[Path], FocalPlane] | None = None,
) -> Callable[[_Reader], _Reader]:
    """A decorator that registers a reader of focal planes; `usable` reads what it can of a file that is refused."""

    def registered(read: _Reader) -> _Reader:
        INSTRUMENTS.register(name)(FileFormat(about, accepts, read, usable))
        return read

    return registered


_Targets = Callable[[Path, bytes], dict[str, Any]]


def target_format(name: str, about: str, accepts: Callable[[Path, bytes], bool]) -> Callable[[_Targets], _Targets]:
    """A decorator that registers a reader of targets."""

    def registered(read: _Targets) -> _Targets:
        TARGET_FILES.register(name)(ContentFormat(about, accepts, read))
        return read

    return registered


def focal_plane_formats() -> dict[str, FileFormat[FocalPlane]]:
    """Readers of focal planes by name."""
    found = {name: INSTRUMENTS[name] for name in INSTRUMENTS}
    return {name: thing for name, thing in found.items() if isinstance(thing, FileFormat)}
