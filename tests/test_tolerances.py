"""The order that the tolerances are proven by, and that each is written down once."""

import ast
import runpy
from itertools import pairwise
from pathlib import Path

import pytest

import fiberplan
from fiberplan import tolerances
from fiberplan.arrays import LARGEST

pytestmark = pytest.mark.small

PACKAGE = Path(fiberplan.__file__).parent
LENGTHS = ("ROUNDING", "SLACK", "EQUALITY", "SCENE", "NEAR")


def test_lengths_are_in_the_stated_order():
    values = [getattr(tolerances, name) for name in LENGTHS]
    assert values[0] > 0
    assert all(smaller < larger for smaller, larger in pairwise(values))
    assert " < ".join(LENGTHS) in tolerances.__doc__
    assert 2 * tolerances.ROUNDING + tolerances.SLACK < tolerances.EQUALITY  # a planner can leave a start, and prove it
    assert LARGEST * 2.0**-52 < tolerances.OPENING  # rounding of the largest length is less
    assert 0 < 1 - tolerances.UNDER_LIMIT <= tolerances.SPEED * (1 + 1e-6)


def constants(path):
    """Names of numbers that a module defines for itself."""
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and isinstance(node.value, ast.Constant | ast.BinOp):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            yield from (target.id for target in targets if isinstance(target, ast.Name))


def test_no_module_defines_its_own():
    names = {name for name in vars(tolerances) if name.isupper()}
    own = {path.relative_to(PACKAGE).as_posix(): set(constants(path)) for path in PACKAGE.rglob("*.py")}
    assert own.pop("tolerances.py") == names
    for module in [name for name in own if name.startswith("certificates/replay")]:  # which share nothing
        there = runpy.run_path(str(PACKAGE / module))
        again = names & {*there}
        assert own.pop(module) & names <= again
        assert {name: there[name] for name in again} == {name: getattr(tolerances, name) for name in again}
    assert {module: found for module, all_ in own.items() if (found := {n.lstrip("_") for n in all_} & names)} == {}
