"""Kernels as the Python functions that they are written as: oracles call each by itself, and arrays are guarded.

That is quick only while the compiler is off, so each of these runs tests in a process of its own.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core import config as compiler

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(compiler.DISABLE_JIT), reason="they are collected like any others"),
]


def interpreted(pattern, *options):
    """Run test files that a pattern names, without the compiler."""
    files = sorted(str(path) for path in Path(__file__).parent.glob(pattern))
    assert files
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *options, *files]
    done = subprocess.run(command, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-4000:]


def test_kernels_and_certificates_agree_with_their_oracles():
    interpreted("test_*_oracles.py")


def test_planners_read_and_write_no_array_beyond_its_end():
    """An index that is too large is an error in Python; `make bounds` asks compiled planners of larger scenes, too."""
    interpreted("test_small_*.py", "-m", "small and not large and not slow")
