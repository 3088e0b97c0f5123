"""Files that appear whole or not at all: written beside their place, then renamed into it."""

import contextlib
import os
from pathlib import Path

from fiberplan.errors import FiberplanError, PlanError


def write_whole(path: str | os.PathLike, content: bytes, error: type[FiberplanError] = PlanError) -> None:
    """Write `content` to `path`; what was there before is kept if that fails.

    Raises:
        error: the file cannot be written.
    """
    path = Path(path)
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        if path.is_dir():
            raise IsADirectoryError(21, "Is a directory")
        beside.write_bytes(content)
        beside.replace(path)
    except OSError as problem:
        raise error(f"{path}: cannot be written ({(problem.strerror or str(problem)).lower()})") from None
    finally:
        with contextlib.suppress(OSError):  # where its folder is no folder, there is nothing beside either
            beside.unlink(missing_ok=True)
