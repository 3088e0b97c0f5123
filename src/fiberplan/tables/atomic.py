"""Files that appear whole or not at all: written beside their place, then renamed into it.

A link stays a link: the file that it names is replaced. What is no file (a device, a named pipe) is written to, for
nothing can be renamed into its place. A file that was there before keeps its owner and its mode.
"""

import contextlib
import os
import secrets
import stat
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from fiberplan.errors import FiberplanError, PlanError

_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
_LINKS = 40  # the kernel follows no more


def _unchecked(written: bytes) -> None:
    """What is written is good as it is."""


def write_whole(
    path: str | os.PathLike,
    content: bytes,
    error: type[FiberplanError] = PlanError,
    check: Callable[[bytes], None] = _unchecked,
) -> None:
    """Write `content` to `path`; what was there before is kept if that fails.

    Args:
        path: of the file.
        content: of the file.
        error: what to raise.
        check: gets the bytes as they are read back from the disk (of what is no file, as they will be written) before
            anything is at `path`; what it raises leaves everything as it was.

    Raises:
        error: the file cannot be written.
    """
    try:
        before = _refuse_place(path)
        if is_special(path):
            check(content)
            _pour(path, content)
        else:
            _replace(Path(os.path.realpath(path)), content, before, check)
    except OSError as problem:
        raise error(f"{os.fspath(path)}: cannot be written ({_reason(problem)})") from None


def refuse_unwritable_place(path: Path, error: type[FiberplanError]) -> None:
    """Refuse, before any work is done, a place where `write_whole` could not write.

    Raises:
        error: a folder, a loop of links, a file or device that may not be written to, or a folder in which no file can
            be made.
    """
    try:
        _refuse_place(path)
    except OSError as problem:
        raise error(f"{path}: cannot be written ({_reason(problem)})") from None
    if not is_special(path):
        refuse_folder(Path(os.path.realpath(path)).parent, path, error)


def refuse_folder(folder: Path, output: Path, error: type[FiberplanError]) -> None:
    """Refuse a folder in which no file can be made for `output`.

    Raises:
        error: the folder does not exist, is not one, or may not be written to.
    """
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as problem:
        raise error(f"{output} cannot be written: folder {folder}: {_reason(problem)}") from None


def is_special(path: str | os.PathLike) -> bool:
    """Whether a device, a pipe or an open file of ours is there, which is written to rather than replaced."""
    try:
        mode = Path(path).stat().st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)) or _descriptor(path) is not None


def _refuse_place(path: str | os.PathLike) -> os.stat_result | None:
    """What is at `path` now, links followed; None if there is nothing yet."""
    try:
        before = Path(path).stat()
    except FileNotFoundError:
        return None
    except ValueError as problem:  # a zero byte in the name
        raise OSError(22, str(problem)) from None
    if stat.S_ISDIR(before.st_mode):
        raise IsADirectoryError(21, "Is a directory")
    if not os.access(path, os.W_OK):
        raise PermissionError(13, "Permission denied")
    return before


def _replace(target: Path, content: bytes, before: os.stat_result | None, check: Callable[[bytes], None]) -> None:
    """Put a new file in the place of `target`, which is not a link, once `check` has seen its bytes."""
    beside = target.with_name(f".fiberplan.{secrets.token_hex(8)}.part")  # of this call alone: threads write too
    mode = 0o666 if before is None else stat.S_IMODE(before.st_mode)
    try:
        with open(os.open(beside, _NEW, mode), "wb") as file:  # noqa: PTH123 (flags that Path.open has not)
            if before is not None:
                with contextlib.suppress(OSError):  # only the superuser gives files away
                    os.fchown(file.fileno(), before.st_uid, before.st_gid)
                os.fchmod(file.fileno(), mode)
            file.write(content)
        check(beside.read_bytes())
        beside.replace(target)
    finally:
        with contextlib.suppress(OSError):  # where its folder is no folder, there is nothing beside either
            beside.unlink(missing_ok=True)


def _pour(path: str | os.PathLike, content: bytes) -> None:
    """Write to a device, a pipe or an open file as it stands."""
    number = _descriptor(path)
    if number is not None:  # opened by its name it would begin again at its start, over what is printed
        sys.stdout.flush()
        opened = os.dup(number)
    else:
        opened = os.open(path, os.O_WRONLY | os.O_CLOEXEC)
    with open(opened, "wb") as file:  # noqa: PTH123
        file.write(content)


def _descriptor(path: str | os.PathLike) -> int | None:
    """The descriptor of this process that a name such as /dev/stdout stands for."""
    own = os.path.realpath("/proc/self/fd")
    name = os.path.abspath(path)  # noqa: PTH100 (links are followed one by one)
    for _ in range(_LINKS):
        folder, last = os.path.split(name)
        if os.path.realpath(folder) == own and last.isdecimal():
            return int(last)
        if not os.path.islink(name):  # noqa: PTH114
            break
        name = os.path.join(folder, os.readlink(name))  # noqa: PTH115, PTH118
    return None


def _reason(problem: OSError) -> str:
    return (problem.strerror or str(problem)).lower()
