"""The cache of compiled kernels: fresh after any change, shared between accounts, and never in the way."""

import inspect
import logging
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from numba.core import config, event
from numba.core.dispatcher import Dispatcher

from fiberplan.kernels import compile as policy
from fiberplan.kernels import kernel_cache
from fiberplan.kernels.kernel_cache import KernelCache

ROOT = Path(__file__).parents[1]
CONSTANTS = "STEP = 1.0\n"
INNER = """
from fiberplan.kernels.compile import inlined

from tiny.constants import STEP

@inlined
def inner(x):
    return x + STEP
"""
OUTER = """
from fiberplan.kernels.compile import leaf
from tiny.inner import inner

@leaf
def outer(x):
    return 10.0 * inner(x)
"""
ASK = """
from numba.core.event import install_recorder
from fiberplan.kernels.compile import compilation_notice
from tiny.outer import outer
with compilation_notice(), install_recorder("numba:compile") as compiled:
    print(outer(1.0), len(compiled.buffer) // 2)
"""


@pytest.fixture
def tiny(tmp_path):
    """A package of two kernels, one of which calls the other in another file, which takes a constant from a third."""
    folder = tmp_path / "tiny"
    folder.mkdir()
    for name, text in (("__init__", ""), ("constants", CONSTANTS), ("inner", INNER), ("outer", OUTER)):
        (folder / f"{name}.py").write_text(text)
    return folder


def start(tiny, **variables):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    environment |= {
        "PYTHONPATH": os.pathsep.join([str(tiny.parent), str(ROOT / "src")]),
        "XDG_CACHE_HOME": str(tiny.parent / "users"),
        **variables,
    }
    return subprocess.Popen([sys.executable, "-c", ASK], stdout=-1, stderr=-1, text=True, env=environment)


def ask(tiny, **variables):
    """(what the outer kernel says of 1, how many kernels were compiled, what was said on stderr)."""
    process = start(tiny, **variables)
    out, err = process.communicate()
    assert process.returncode == 0, err
    answer, compiled = out.split()
    return float(answer), int(compiled), err


def test_change_of_what_a_kernel_is_made_from_reaches_its_callers(tiny):
    assert ask(tiny)[:2] == (20.0, 2)
    assert ask(tiny)[:2] == (20.0, 0)
    (tiny / "inner.py").write_text(INNER.replace("x + STEP", "x - STEP"))
    assert ask(tiny)[:2] == (0.0, 2)
    (tiny / "constants.py").write_text("STEP = 2.0\n")  # has no kernel
    assert ask(tiny)[:2] == (-10.0, 2)
    (tiny / "inner.py").write_text(INNER)
    (tiny / "constants.py").write_text(CONSTANTS)
    assert ask(tiny)[:2] == (20.0, 0)  # back to what is still kept
    assert ask(tiny, NUMBA_BOUNDSCHECK="1")[:2] == (20.0, 2)  # other machine code from the same source


def test_damaged_files_are_compiled_again(tiny):
    ask(tiny)
    for file in tiny.rglob("*.nbc"):
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 1
        file.write_bytes(content)
    assert ask(tiny)[:2] == (20.0, 2)
    assert ask(tiny)[:2] == (20.0, 0)


def test_folder_that_cannot_be_written(tiny):
    pycache = tiny / "__pycache__"
    pycache.touch()  # a file where the folder should be, which stops even root
    answer, compiled, said = ask(tiny)
    assert (answer, compiled) == (20.0, 2)
    assert said.startswith("compiling kernels (first run only")
    assert list((tiny.parent / "users").rglob("outer-*.nbc"))
    assert ask(tiny)[:2] == (20.0, 0)


def test_no_folder_at_all(tiny):
    (tiny / "__pycache__").touch()
    nowhere = {"XDG_CACHE_HOME": "/dev/null/users", "NUMBA_CACHE_DIR": "/dev/null/cache"}
    answer, compiled, said = ask(tiny, **nowhere)
    assert (answer, compiled) == (20.0, 2)
    (line,) = said.splitlines()
    assert "on every run" in line
    assert "/dev/null/users" in line
    assert "/dev/null/cache" in line
    assert "NUMBA_CACHE_DIR" in line


def test_what_another_account_has_compiled_is_found(tiny):
    ask(tiny)
    kept = list(tiny.rglob("*.nbc"))
    assert all(file.stat().st_mode & 0o444 == 0o444 & ~os.umask(os.umask(0)) for file in kept)
    assert ask(tiny, XDG_CACHE_HOME="/dev/null/users")[:2] == (20.0, 0)


def test_processes_that_compile_at_once(tiny):
    cache = tiny.parent / "cache"
    several = [start(tiny, NUMBA_CACHE_DIR=str(cache)) for _ in range(3)]
    assert [process.communicate()[0].split()[0] for process in several] == ["20.0"] * 3
    names = sorted(path.name.partition("-")[0] for path in cache.rglob("*") if path.is_file())
    assert names == ["inner", "outer"]
    assert ask(tiny, NUMBA_CACHE_DIR=str(cache))[:2] == (20.0, 0)


@pytest.mark.small
def test_few_states_of_a_module_are_kept(tmp_path):
    for age, name in enumerate(["a-4", "a-3", "a-2", "a-1", "a-0", "a_b-9", "a-file"]):
        path = tmp_path / name
        path.touch() if name == "a-file" else path.mkdir()
        os.utime(path, (1000.0 + age, 1000.0 + age))
    kernel_cache._forget_oldest(tmp_path / "a-4")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a-0", "a-1", "a-2", "a-4", "a-file", "a_b-9"]


@pytest.mark.small
def test_reloaded_module_has_another_key(tiny, monkeypatch):
    import importlib

    monkeypatch.syspath_prepend(str(tiny.parent))
    constants = importlib.import_module("tiny.constants")
    before = kernel_cache.key_of("tiny.constants")
    (tiny / "constants.py").write_text("STEP = 2.00\n")
    assert kernel_cache.key_of("tiny.constants") == before  # what is loaded has not changed
    importlib.reload(constants)
    assert kernel_cache.key_of("tiny.constants") != before
    for name in [name for name in sys.modules if name.partition(".")[0] == "tiny"]:
        monkeypatch.delitem(sys.modules, name)
    shutil.rmtree(tiny)


def kernels_called(function, found):
    """Dispatchers that a function names, and those that these name."""
    code = function.__code__
    for name in code.co_names:
        value = function.__globals__.get(name)
        if isinstance(value, Dispatcher) and value not in found:
            found.add(value)
            kernels_called(value.py_func, found)
    return found


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled")
def test_sources_of_a_kernel_cover_every_kernel_that_it_calls():
    import fiberplan.planners  # noqa: F401

    modules = [(name, module) for name, module in list(sys.modules.items()) if name.startswith("fiberplan.")]
    kernels = [
        value
        for name, module in modules
        for value in vars(module).values()
        if isinstance(value, Dispatcher) and value.py_func.__module__ == name
    ]
    assert len(kernels) > 150
    for kernel in kernels:
        covered = kernel_cache.sources(kernel.py_func.__module__)
        called = kernels_called(kernel.py_func, set())
        assert {inspect.getmodule(other.py_func).__name__ for other in called} <= set(covered)
    assert "fiberplan.tolerances" in kernel_cache.sources("fiberplan.certificates.bisection")


# The cache as a dispatcher asks it, without a compiler: what is kept is any text.

CODEGEN = SimpleNamespace(magic_tuple=lambda: ("machine",))
CONTEXT = SimpleNamespace(refresh=lambda: None, codegen=lambda: CODEGEN)


class Compiled:
    """What numba hands over to be kept."""

    codegen = CODEGEN
    lifted = ()

    def __init__(self, text, dynamic=False):
        self.text, self.library = text, SimpleNamespace(has_dynamic_globals=dynamic)

    def _reduce(self):
        return (self.text,)


def first(x):
    return x


def other(x):
    return -x


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """Caches of a function in one of two folders under `tmp_path`."""
    monkeypatch.setattr(kernel_cache.CompileResult, "_rebuild", lambda context, text: text)
    monkeypatch.setattr(kernel_cache, "folders", lambda source: [tmp_path / "near", tmp_path / "users"])
    monkeypatch.setattr(KernelCache, "lost", 0)
    return lambda function, **options: KernelCache(function, options)


@pytest.mark.small
def test_what_is_kept_is_found_by_signature_function_and_options(kept, tmp_path):
    cache = kept(first)
    assert cache.load_overload("(i8)", CONTEXT) is None
    cache.save_overload("(i8)", Compiled("of whole numbers"))
    cache.save_overload("(f8)", Compiled("of reals"))
    assert Path(cache.cache_path).parent == tmp_path / "near"
    assert len(list(Path(cache.cache_path).glob("first-*.nbc"))) == 2
    assert [kept(first).load_overload(of, CONTEXT) for of in ("(i8)", "(f8)", "(b1)")] == [
        "of whole numbers", "of reals", None,
    ]  # fmt: skip
    assert kept(other).load_overload("(i8)", CONTEXT) is None
    assert kept(first, forceinline=True).load_overload("(i8)", CONTEXT) is None
    assert kept(lambda x, y=cache: x).load_overload("(i8)", CONTEXT) is None
    cache.flush()
    assert cache.load_overload("(i8)", CONTEXT) is None
    assert KernelCache.lost == 0


@pytest.mark.small
def test_what_is_damaged_or_of_another_signature_is_not_taken(kept):
    cache = kept(first)
    cache.save_overload("(i8)", Compiled("right"))
    (file,) = Path(cache.cache_path).glob("*.nbc")
    content = file.read_bytes()
    for wrong in (content[:-1], content[:40] + bytes([content[40] ^ 1]) + content[41:], b"", os.urandom(100)):
        file.write_bytes(wrong)
        assert cache.load_overload("(i8)", CONTEXT) is None
    cache.save_overload("(f8)", Compiled("of reals"))
    (reals,) = set(Path(cache.cache_path).glob("*.nbc")) - {file}
    shutil.copy(reals, file)  # whole, and of something else
    assert cache.load_overload("(i8)", CONTEXT) is None
    cache.save_overload("(i8)", Compiled("right"))
    assert cache.load_overload("(i8)", CONTEXT) == "right"


@pytest.mark.small
def test_what_cannot_be_kept_anywhere_is_counted(kept, tmp_path):
    (tmp_path / "near").touch()
    cache = kept(first)
    cache.save_overload("(i8)", Compiled("right"))
    assert list((tmp_path / "users").rglob("first-*.nbc"))
    assert cache.load_overload("(i8)", CONTEXT) == "right"
    cache.save_overload("(f8)", Compiled("names what may change", dynamic=True))
    assert cache.load_overload("(f8)", CONTEXT) is None
    assert KernelCache.lost == 0
    shutil.rmtree(tmp_path / "users")
    (tmp_path / "users").touch()
    cache.save_overload("(i8)", Compiled("right"))
    assert KernelCache.lost == 1


@pytest.mark.small
def test_folders_are_beside_the_source_or_named_and_then_the_users(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    near, users = kernel_cache.folders(tmp_path / "package" / "kernel.py")
    assert near == tmp_path / "package" / "__pycache__"
    assert users.is_relative_to(tmp_path / "home")
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "named"))
    named, again = kernel_cache.folders(tmp_path / "package" / "kernel.py")
    assert named.is_relative_to(tmp_path / "named")
    assert named.name == again.name == users.name
    assert kernel_cache.writable(named)
    assert not list(named.iterdir())
    (tmp_path / "file").touch()
    assert not kernel_cache.writable(tmp_path / "file" / "folder")


@pytest.mark.small
def test_a_kernel_without_source_is_compiled_in_memory(monkeypatch):
    monkeypatch.setattr(policy, "_SWITCHED_OFF", False)
    monkeypatch.setattr(policy, "njit", lambda **options: lambda function: SimpleNamespace(_cache="numba's own"))
    monkeypatch.setattr(KernelCache, "lost", 0)
    assert isinstance(policy.kernel(first)._cache, KernelCache)
    assert KernelCache.lost == 0
    scope = {"__name__": "typed by hand"}
    exec("def by_hand(x):\n    return x", scope)
    assert policy.kernel(scope["by_hand"])._cache == "numba's own"
    assert KernelCache.lost == 1
    with pytest.raises(FileNotFoundError, match="sys"):
        kernel_cache.key_of("sys")


@pytest.mark.small
@pytest.mark.parametrize("usable", [True, False])
def test_the_first_compilation_is_said_once(usable, monkeypatch, capsys, caplog):
    monkeypatch.setattr(policy, "writable", lambda folder: usable)
    ours = SimpleNamespace(py_func=kernel_cache.sources)  # any function of fiberplan
    with caplog.at_level(logging.DEBUG, logger="fiberplan"), policy.compilation_notice():
        assert capsys.readouterr().err == ""
        for dispatcher in (ours, SimpleNamespace(py_func=first), ours):
            with event.trigger_event("numba:compile", data={"dispatcher": dispatcher}):
                pass
    (line,) = capsys.readouterr().err.splitlines()
    assert ("on every run" in line) is not usable
    told = [record.getMessage() for record in caplog.records if record.name == policy.__name__]
    assert told == ["compiling sources of fiberplan.kernels.kernel_cache"] * 2
