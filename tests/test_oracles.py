"""The oracles call every kernel by itself, which is quick only while the compiler is off."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core import config as compiler


@pytest.mark.slow
@pytest.mark.skipif(bool(compiler.DISABLE_JIT), reason="they are collected like any others")
def test_kernels_and_certificates_agree_with_their_oracles():
    files = sorted(str(path) for path in Path(__file__).parent.glob("test_*_oracles.py"))
    assert files
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *files]
    done = subprocess.run(command, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-4000:]
