"""Instruments, planners, controllers and exports of a package that knows us, and that we do not know."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from fiberplan.errors import FiberplanError
from fiberplan.planners import PLANNERS
from fiberplan.registry import Registry

SRC = Path(__file__).parents[1] / "src"
PLUGIN = """
import dataclasses

import numpy as np

import fiberplan as fp
from fiberplan.tables.formats import FileFormat


def tiny():
    return fp.FocalPlane.hexagonal(0, 22.4, name="tiny")


points = FileFormat("a .points file", lambda path: path.suffix == ".points", lambda path: tiny())


@dataclasses.dataclass(frozen=True)
class StandStill:
    patience: float = 1.0
    seed: int = 0
    name = "stand-still"
    reference = "nobody"

    def plan(self, problem):
        lost = np.where(problem.has_goal, "DEADLOCKED", "NO_TARGET")
        outcomes = tuple(fp.Outcome[name] for name in lost)
        return fp.Plan(problem, fp.Trajectory.at_rest(problem.start), outcomes, planner=self.name)


class Loud:
    @staticmethod
    def write(plan, path):
        with open(path, "w") as file:
            file.write("MOVE")
"""
ENTRY_POINTS = """
[fiberplan.instruments]
tiny = mine:tiny
points = mine:points

[fiberplan.planners]
stand-still = mine:StandStill
broken = nowhere_to_be_found:Planner

[fiberplan.controllers]
loud = mine:Loud
"""


@pytest.fixture(scope="module")
def plugin(tmp_path_factory):
    """A folder in which a package of four entry points is installed."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "mine.py").write_text(PLUGIN)
    about = folder / "mine-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(ENTRY_POINTS)
    return folder


def run(plugin, folder, *arguments):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(SRC), str(plugin)])}
    command = [sys.executable, "-m", "fiberplan", *map(str, arguments)]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


def test_everything_of_another_package_is_found(plugin, tmp_path):
    """An instrument by name and by file, a planner, and a controller, from one package."""
    (tmp_path / "t.csv").write_text("positioner,x,y\nR0C1,10,0\n")
    (tmp_path / "mine.points").touch()
    assert "tiny" in run(plugin, tmp_path, "instruments").stdout
    given = ("--set", "patience=2")
    for instrument in ("tiny", "mine.points"):
        done = run(plugin, tmp_path, "plan", instrument, "t.csv", "--planner", "stand-still", "-o", "p.fits", *given)
        assert done.returncode == 1, done.stderr  # the target is lost
        assert "0 of 1 arrived" in done.stdout
    done = run(plugin, tmp_path, "export", "p.fits", "--to", "loud", "-o", "moves")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "moves").read_text() == "MOVE"


def test_one_that_cannot_be_imported_is_one_line(plugin, tmp_path):
    (tmp_path / "t.csv").write_text("positioner,x,y\nR0C1,10,0\n")
    done = run(plugin, tmp_path, "plan", "tiny", "t.csv", "--planner", "broken")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "planner 'broken' (nowhere_to_be_found:Planner) cannot be imported" in done.stderr


def test_planners_are_listed_though_one_is_broken(plugin, tmp_path):
    done = run(plugin, tmp_path, "planners", "--json")
    rows = {row["name"]: row for row in json.loads(done.stdout)}
    assert "cannot be imported" in rows["broken"]["about"]
    assert rows["stand-still"]["reference"] == "nobody"
    (setting,) = json.loads(run(plugin, tmp_path, "planners", "stand-still", "--json").stdout)["settings"]
    assert (setting["key"], setting["type"], setting["default"], setting["help"]) == ("patience", "float", 1.0, "")


def test_ours_come_first_in_a_fixed_order(plugin, tmp_path):
    check = "import json; from fiberplan.planners import PLANNERS; print(json.dumps(list(PLANNERS)))"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(SRC), str(plugin)])}
    done = subprocess.run([sys.executable, "-c", check], env=environment, capture_output=True, text=True, check=True)
    ours = ["direct", "greedy-fold", "navigation-function", "elliptic-navigation-function", "prioritized-roadmap"]
    assert json.loads(done.stdout) == [*ours, "broken", "stand-still"]


@pytest.mark.small
def test_a_registry_reads_like_a_mapping():
    colours: Registry[int] = Registry("colour", "fiberplan.tests.colours", ("red", "blue"))
    colours.register("green")(3)
    colours.register("blue")(2)
    colours.register("red")(1)
    assert dict(colours) == {"red": 1, "blue": 2, "green": 3}
    assert repr(colours) == "<colours: red, blue, green>"
    assert "pink" not in colours
    assert colours.get("pink") is None
    with pytest.raises(ValueError, match="colour 'red' is registered already"):
        colours.register("red")(4)
    with pytest.raises(FiberplanError, match="no colour 'gren'; did you mean 'green'"):
        colours.find("gren")
    with pytest.raises(FiberplanError, match="no colour 'x'; there are red, blue, green"):
        colours.find("x")


@pytest.mark.small
def test_planners_cannot_be_changed():
    with pytest.raises(TypeError):
        PLANNERS["mine"] = None
