"""The rooms are as docs/architecture.md draws them, and every package's page names what is in it."""

import ast
import importlib
import re
import runpy
import tomllib
from pathlib import Path

import grimp
import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import fiberplan as fp
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.scenes.uniform import uniform_field

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "fiberplan"
PAGE = (ROOT / "docs" / "architecture.md").read_text()
ROOMS = runpy.run_path(str(ROOT / "docs" / "rooms.py"))
PACKAGES = sorted(path.parent for path in SOURCE.rglob("__init__.py") if path.parent != SOURCE)
PLANNERS = [path for path in PACKAGES if path.parent.name == "planners" and path.name != "shared"]
PROSE = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("design/*.md")])
GROUPS = {
    f"fiberplan.{name}" for name in ("instruments", "planners", "controllers", "targets", "exports", "figures")
}  # entry points are no modules
PAGES = [path for path in PACKAGES if path.name not in ("cli", "planners") and path.parent.name != "reproductions"]


def name_of(path):
    return ".".join(path.relative_to(SOURCE.parent).parts)


def page_of(package):
    return ast.get_docstring(ast.parse((package / "__init__.py").read_text()))


@pytest.fixture(scope="module")
def graph():
    return grimp.build_graph("fiberplan", exclude_type_checking_imports=True, cache_dir=None)


def test_drawings_are_those_of_the_contracts():
    assert ROOMS["drawn"](PAGE) == PAGE, "run: python docs/rooms.py"
    assert PAGE.count("drawn by docs/rooms.py") == 2


def test_every_room_is_described_at_its_level():
    levels = {room: number for number, rooms in enumerate(ROOMS["contract"]("rooms"), 1) for room in rooms}
    described = {room: int(number) for number, room in re.findall(r"^\| (\d+) \| `(\w+)` \|", PAGE, re.MULTILINE)}
    assert described == levels
    assert len(set(levels.values())) <= 10
    there = {path.parent.name for path in SOURCE.glob("*/__init__.py")} | {path.stem for path in SOURCE.glob("*.py")}
    assert there - {"__init__", "__main__"} == set(levels)
    assert len(list(SOURCE.glob("[!_]*.py"))) + len(list(SOURCE.glob("__main__.py"))) <= 6


def test_rules_of_a_room_are_contracts():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    for contract in contracts:
        rooms = [name for name in contract.get("source_modules", ()) if name.count(".") == 1]  # others are within one
        for room in rooms:
            (rule,) = re.findall(rf"^\| \d+ \| `{room.split('.')[1]}` \|.*\| (.*) \|$", PAGE, re.MULTILINE)
            assert set(re.findall(r"`(\w+)`", rule)) == {name.split(".")[1] for name in contract["forbidden_modules"]}


@pytest.mark.parametrize("page", PROSE, ids=lambda path: path.name)
def test_files_and_names_that_prose_points_to_exist(page):
    text = page.read_text()
    links = {link.partition("#")[0] for link in re.findall(r"\]\(((?!http|#)[^)]+)\)", text)}
    linked = {link for link in links if not (page.parent / link).exists()}
    paths = set(re.findall(r"`((?:\w[\w-]*/)+[\w-]+\.(?:py|md|toml|yml))[`:]", text))
    missing = {path for path in paths if not ((ROOT / path).exists() or (SOURCE / path).exists())}
    dotted = {name for name in re.findall(r"`(fiberplan(?:\.\w+)+)`", text) if not exists("fiberplan", name)}
    assert sorted(linked | missing | dotted - GROUPS) == []


def test_no_import_circle(graph):
    """Importing a module also runs the packages that it lies in, so those count as imported."""
    modules = sorted(graph.modules)
    place = {module: k for k, module in enumerate(modules)}
    arrows = set()
    for module in modules:
        for imported in graph.find_modules_directly_imported_by(module):
            parts = imported.split(".")
            packages = {".".join(parts[:k]) for k in range(2, len(parts))}
            outside = {package for package in packages if not f"{module}.".startswith(f"{package}.")}
            arrows |= {(place[module], place[reached]) for reached in outside | {imported}}
    rows, columns = np.array(sorted(arrows)).T
    matrix = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(modules),) * 2)
    count, circle = connected_components(matrix, connection="strong")
    members = [[m for m, c in zip(modules, circle, strict=True) if c == k] for k in range(count)]
    assert [circle for circle in members if len(circle) > 1] == []


@pytest.mark.parametrize("package", PAGES, ids=name_of)
def test_page_names_every_module(package):
    page = page_of(package)
    modules = {p.stem for p in package.glob("*.py")} | {p.parent.name for p in package.glob("*/__init__.py")}
    missing = [m for m in sorted(modules - {"__init__"}) if not re.search(rf"`(?:\w+\.)*{m}[`.]", page)]
    assert missing == []


@pytest.mark.parametrize("package", PLANNERS, ids=name_of)
def test_planner_page_is_an_algorithm_of_this_code(package):
    """Its lines are numbered from 1 without a gap, and each name that it gives for a line exists."""
    page = page_of(package)
    numbers = [int(number) for number in re.findall(r"^ ?(\d+)  ", page, re.MULTILINE)]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) >= 5
    references = set(re.findall(r"`((?:[a-z]\w*\.)+\w+)`", page))
    assert len(references) >= 8
    assert [ref for ref in sorted(references) if not exists(name_of(package), ref)] == []


def exists(package, reference):
    """Whether a dotted name leads somewhere from a package, or from fiberplan."""
    for home in (package, "fiberplan"):
        parts = reference.removeprefix("fiberplan.").split(".")
        thing = importlib.import_module(home)
        for part in parts:
            if not hasattr(thing, part) and hasattr(thing, "__path__"):
                try:
                    importlib.import_module(f"{thing.__name__}.{part}")
                except ModuleNotFoundError:
                    break
            if not hasattr(thing, part):
                break
            thing = getattr(thing, part)
        else:
            return True
    return False


def test_page_of_shared_names_its_users(graph):
    items = re.findall(r"^- `(\w+)`: ([^-]*)", page_of(SOURCE / "planners" / "shared"), re.MULTILINE)
    assert items
    methods = {path.name for path in PLANNERS}
    known = methods | {path.stem for path in (SOURCE / "planners").glob("*.py")}
    for module, line in items:
        importers = graph.find_modules_that_directly_import(f"fiberplan.planners.shared.{module}")
        users = {name.split(".")[2] for name in importers if name.startswith("fiberplan.planners.")} - {"shared"}
        line = " ".join(line.split())
        (excluded,) = re.findall(r"\(all but (\w+)\)", line) or [""]
        named = methods - {excluded} if excluded else {word for word in re.findall(r"\w+", line) if word in known}
        assert named == users, module


@pytest.fixture(scope="module")
def example():
    """The planner written out in the page of `fiberplan.planners`."""
    (block,) = re.findall(r"::\n\n((?: {4}.*\n|\n)+)", page_of(SOURCE / "planners"))
    code = "\n".join(line[4:] for line in block.splitlines())
    assert len([line for line in code.splitlines() if line.strip()]) <= 25
    names = {"__name__": __name__}
    exec(compile(code, "fiberplan/planners/__init__.py", "exec"), names)
    return names["OneAfterTheOther"]()


def test_example_of_a_planner_keeps_the_contract(example):
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    online = np.ones(plane.n, bool)
    online[4] = False
    plane = plane.replace(online=online, obstacles=(Obstacle("post", [[11.2, 14.0]], 1.5),))
    goal = np.where(online[:, None], uniform_field(plane, 1, 0.5), np.nan)
    goal[7] = np.nan
    problem = fp.Problem(plane, plane.folded, goal, 0.5)
    plan = example.plan(problem)
    assert plan.faults() == []
    assert plan.outcomes[4] is fp.Outcome.OFFLINE
    assert plan.outcomes[7] is fp.Outcome.NO_TARGET
    arrived, lost = (len(plan.having(o)) for o in (fp.Outcome.ARRIVED, fp.Outcome.DEADLOCKED))
    assert arrived > lost
    assert arrived + lost == plane.n - 2
    np.testing.assert_array_equal(example.plan(problem).trajectory.angles, plan.trajectory.angles)
