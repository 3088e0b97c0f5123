"""Compiled kernels on disk, each under a name that holds everything its machine code was made from.

numba looks only at the file of the function it compiles, not at what that file imports, so that after a change of one
kernel its callers in other files keep answering with the old one. Here the key of a kernel covers the sources of its
module and of all modules that it imports, directly or not, within its own package and this one (the constants that a
kernel sees are imported too), the versions of what compiles it, and the switches that change what is compiled.

Nothing is ever overwritten by something else: a file is written under another name and then renamed, and holds the
signature it was compiled for and a checksum. What cannot be read, or is not what it should be, is compiled again.
"""

import hashlib
import importlib.util
import os
import pickle
import re
import shutil
import sys
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import config
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps
from numba.misc.appdirs import AppDirs

_KEPT = 4  # folders of one module, for as many states of the sources or switches; those used longest ago go first
_IMPORT = re.compile(
    rb"^(?:from[ \t]+([.\w]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n#]*)|import[ \t]+([^\n#]*))", re.MULTILINE
)
_VERSIONS = f"{sys.version_info[:2]} {numba.__version__} {llvmlite.__version__} {np.__version__}"
_DIGEST = hashlib.sha256

# Per module, what was read when it was first asked for, which is when it was loaded: valid while the specification
# that it was loaded with is the same object, that is, until it is reloaded.
_read: dict[str, tuple[Any, bytes, tuple[str, ...]]] = {}
_keys: dict[str, tuple[Any, str]] = {}


def _loaded(name: str, family: set[str]) -> bool:
    return name.partition(".")[0] in family and name in sys.modules


def _imports(source: bytes, package: str) -> Iterator[str]:
    """Names that the top level of a module imports: of modules, and what may be a module in a package."""
    for origin, names, plain in _IMPORT.findall(source):
        if plain:
            yield from (part.split()[0].decode() for part in plain.split(b",") if part.split())
            continue
        home = origin.decode()
        if home.startswith("."):
            home = importlib.util.resolve_name(home, package)
        yield home
        for part in names.strip(b"()").split(b","):
            if part.split():
                yield f"{home}.{part.split()[0].decode()}"


def _source(module: ModuleType) -> tuple[bytes, tuple[str, ...]]:
    """Digest of a module's source and the names it imports.

    Raises:
        OSError: there is no source.
    """
    spec = getattr(module, "__spec__", None)
    known = _read.get(module.__name__)
    if known is None or known[0] is not spec:
        file = getattr(module, "__file__", None)
        if file is None:
            raise FileNotFoundError(module.__name__)
        text = Path(file).read_bytes()
        known = spec, _DIGEST(text).digest(), tuple(_imports(text, getattr(module, "__package__", None) or ""))
        _read[module.__name__] = known
    return known[1], known[2]


def sources(name: str) -> dict[str, bytes]:
    """Digest of the source of every module that the kernels of module `name` can be made from, by name.

    Raises:
        OSError: one has no source.
    """
    family = {name.partition(".")[0], __name__.partition(".")[0]}
    found: dict[str, bytes] = {}
    todo = [name]
    while todo:
        module = sys.modules[todo.pop()]
        if module.__name__ in found:
            continue
        found[module.__name__], imported = _source(module)
        todo += [other for other in imported if _loaded(other, family) and other not in found]
    return found


def key_of(name: str) -> str:
    """Sixteen digits that change with any source of module `name`, with versions, and with numba's switches.

    Raises:
        OSError: a module has no source.
    """
    if name not in sys.modules:
        raise FileNotFoundError(name)
    spec = getattr(sys.modules[name], "__spec__", None)
    known = _keys.get(name)
    if known is None or known[0] is not spec:
        switches = [getattr(config, switch, None) for switch in ("BOUNDSCHECK", "OPT", "DEBUGINFO_DEFAULT")]
        whole = _DIGEST(f"{_VERSIONS} {switches}".encode())
        for module, digest in sorted(sources(name).items()):
            whole.update(module.encode() + b"\0" + digest)
        known = _keys[name] = spec, whole.hexdigest()[:16]
    return known[1]


def folders(source: Path) -> list[Path]:
    """Where compiled kernels of a file may lie, in the order in which they are looked for and written.

    The folder that NUMBA_CACHE_DIR names, or beside the source; then the user's cache.
    """
    below = f"{source.parent.name}_{hashlib.sha1(os.fsencode(source.parent)).hexdigest()}"
    named = getattr(config, "CACHE_DIR", "")
    first = Path(named) / below if named else source.parent / "__pycache__"
    users = Path(AppDirs("numba", appauthor=False).user_cache_dir) / below
    return [first, users] if users.is_absolute() else [first]  # an account without a home has no such folder


def writable(folder: Path) -> bool:
    """Whether a file can be made in a folder, which is made if need be."""
    try:
        _write(folder / f"probe.{uuid.uuid4().hex}", b"").unlink()
    except OSError:
        return False
    return True


def _write(path: Path, content: bytes) -> Path:
    """Write a file whole or not at all, readable to whom the account lets read (a temporary file would not be)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.name}.{uuid.uuid4().hex[:16]}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return path


def _forget_oldest(folder: Path) -> None:
    """Keep the newest few folders of the module that `folder` belongs to."""
    stem = folder.name.rpartition("-")[0]
    same = [other for other in folder.parent.glob(f"{stem}-*") if other.is_dir() and other != folder]
    for other in sorted(same, key=lambda path: path.stat().st_mtime)[: -(_KEPT - 1)]:
        shutil.rmtree(other, ignore_errors=True)


class KernelCache:
    """The cache of one kernel, as numba's dispatchers ask it."""

    lost = 0  #: how many compiled kernels could not be kept anywhere, in this process

    def __init__(self, function: Callable, options: dict[str, bool]):
        """Look for the compiled forms of a function.

        Raises:
            OSError: there is no source of a module it is made from, so that nothing tells stale from fresh.
        """
        key = key_of(function.__module__)
        source = Path(sys.modules[function.__module__].__file__ or "")
        folder = f"{source.stem}-{key}"
        self._folders = [above / folder for above in folders(source)]
        self._name = re.sub(r"[^\w.]", "", function.__qualname__)
        code = function.__code__
        cells = tuple(cell.cell_contents for cell in function.__closure__ or ())
        self._what = repr((function.__qualname__, code.co_firstlineno, sorted(options.items()))).encode()
        self._what += code.co_code + dumps(cells)

    @property
    def cache_path(self) -> str:
        """Folder that is looked at first."""
        return str(self._folders[0])

    def _file(self, signature: Any, codegen: Any) -> str:
        asked = _DIGEST(self._what + repr((str(signature), codegen.magic_tuple())).encode())
        return f"{self._name}-{asked.hexdigest()[:16]}.nbc"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The kernel compiled for a signature, or None."""
        target_context.refresh()
        name = self._file(sig, target_context.codegen())
        for folder in self._folders:
            try:
                content = (folder / name).read_bytes()
                check, content = content[:32], content[32:]
                if check != _DIGEST(content).digest():
                    continue
                signature, reduced = pickle.loads(content)
                if signature == sig:
                    return CompileResult._rebuild(target_context, *reduced)
            except Exception:  # not there, not ours, or not whole: another folder may have it, or it is compiled
                continue
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled kernel in the first folder that can be written, if in any."""
        if data.library.has_dynamic_globals or any(not lifted.can_cache for lifted in data.lifted):
            return
        name = self._file(sig, data.codegen)
        content = dumps((sig, data._reduce()))
        for folder in self._folders:
            fresh = not folder.exists()
            try:
                _write(folder / name, _DIGEST(content).digest() + content)
                if fresh:
                    _forget_oldest(folder)
            except OSError:
                continue
            return
        KernelCache.lost += 1

    def flush(self) -> None:
        """Forget what was kept of this kernel."""
        for folder in self._folders:
            for file in folder.glob(f"{self._name}-*.nbc"):
                file.unlink(missing_ok=True)

    def enable(self) -> None:
        """Do nothing: it is enabled."""

    def disable(self) -> None:
        """Do nothing, likewise."""
