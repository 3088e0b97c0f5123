"""The bytes of a file, read once and whole: whatever is made of them is made of the same ones.

What is compressed by gzip is unpacked, whatever its name; `plain_name` is the name without ``.gz``.
A file may be replaced at any time by another process; a reader that opens it twice may see two. What never ends is not
read: a device is refused, and a pipe (``/dev/stdin``, the shell's ``<(...)``) is read up to `STREAM` bytes.
"""

import os
import stat
import zlib
from pathlib import Path

from fiberplan.errors import FiberplanError

FILE = 2**32  #: bytes of a file, at most; 100,000 positioners with 1,000 knots each take 3.2e9
STREAM = 2**28  #: bytes of a pipe, at most
_GZIP = b"\x1f\x8b"


def read_whole(path: Path, error: type[FiberplanError]) -> bytes:
    """All bytes of a file or a pipe, unpacked if they are compressed by gzip.

    Raises:
        error: no such file, a folder, a device, one that cannot be read, is too large, or damaged as a gzip.
    """
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise error(f"{path}: is a folder, expected a file")
        if not (stat.S_ISREG(mode) or stat.S_ISFIFO(mode)):
            raise error(f"{path}: is a device, expected a file")
        with path.open("rb") as file:
            now = os.fstat(file.fileno())
            most = FILE if stat.S_ISREG(now.st_mode) else STREAM
            content = file.read(most + 1) if now.st_size <= most else b""
            if now.st_size > most or len(content) > most:
                raise error(f"{path}: is larger than {most / 2**30:g} GiB, the most that is read")
            return _unpacked(content, path, error) if content.startswith(_GZIP) else content
    except FileNotFoundError:
        raise error(f"{path}: no such file") from None
    except OSError as problem:
        raise error(f"{path}: cannot be read ({(problem.strerror or str(problem)).lower()})") from None
    except ValueError:  # a zero byte in the name
        raise error(f"{path}: no such file") from None


def beginning(path: Path, count: int) -> bytes:
    """The first `count` bytes of a file, unpacked if they are compressed by gzip; b"" of what is no file or damaged.

    Raises:
        OSError: a file that cannot be read.
    """
    if not path.is_file():
        return b""
    with path.open("rb") as file:
        head = file.read(count)
    if not head.startswith(_GZIP):
        return head
    try:
        return zlib.decompressobj(16 + zlib.MAX_WBITS).decompress(head, count)
    except zlib.error:
        return b""


def plain_name(path: Path) -> Path:
    """The path without the ``.gz`` at its end: its ending says what is inside."""
    return path.with_suffix("") if path.suffix.lower() == ".gz" else path


def _unpacked(content: bytes, path: Path, error: type[FiberplanError]) -> bytes:
    """What gzip compressed, all members of it."""
    parts, size = [], 0
    while content.startswith(_GZIP):
        unpacking = zlib.decompressobj(16 + zlib.MAX_WBITS)
        try:
            parts.append(unpacking.decompress(content, FILE + 1 - size))
        except zlib.error:
            raise error(f"{path}: is damaged: it cannot be unpacked") from None
        size += len(parts[-1])
        if size > FILE:
            raise error(f"{path}: unpacked it is larger than {FILE / 2**30:g} GiB, the most that is read")
        if not unpacking.eof:
            raise error(f"{path}: is truncated: it ends before what it packs does")
        content = unpacking.unused_data
    if content.strip(b"\0"):
        raise error(f"{path}: is damaged: something follows what it packs")
    return b"".join(parts)
