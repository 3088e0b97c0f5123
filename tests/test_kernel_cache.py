"""The cache of compiled kernels: fresh after any change, shared between accounts, and never in the way."""

import inspect
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core import config
from numba.core.dispatcher import Dispatcher

from fiberplan.kernels import kernel_cache

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


def test_few_states_of_a_module_are_kept(tmp_path):
    for age, name in enumerate(["a-4", "a-3", "a-2", "a-1", "a-0", "a_b-9", "a-file"]):
        path = tmp_path / name
        path.touch() if name == "a-file" else path.mkdir()
        os.utime(path, (1000.0 + age, 1000.0 + age))
    kernel_cache._forget_oldest(tmp_path / "a-4")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a-0", "a-1", "a-2", "a-4", "a-file", "a_b-9"]


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
