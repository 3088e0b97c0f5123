import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from numba.core import config as compiler

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.problem import Problem

PAPERS = ("makarem2014", "makarem2016", "sabater2018", "sayres2021")  #: that have figures
SHARED_DATA = Path(__file__).parents[2] / "shared" / "data"


def pytest_sessionstart(session):
    """Compile once, before the workers start; a worker finds everything on disk, and so do the commands it starts."""
    many = session.config.getoption("dist", "no") != "no" and not hasattr(session.config, "workerinput")
    if many and os.environ.get("NUMBA_DISABLE_JIT", "0") == "0":
        script = Path(__file__).parent / "warm_up.py"
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        shares = [subprocess.Popen([sys.executable, script, str(share)], **quiet) for share in (0, 1)]
        for share in shares:
            share.wait()


collect_ignore_glob = (
    [] if compiler.DISABLE_JIT else ["test_*_oracles.py"]
)  # called one by one they take long to compile
CASES_WITHOUT_COMPILER = 1  #: of each test, when kernels run some hundred times slower


@pytest.hookimpl(tryfirst=True)  # before workers read the groups
def pytest_collection_modifyitems(config, items):
    """Tests that share what their module sets up go to one worker, which sets it up once.

    With NUMBA_DISABLE_JIT=1 only the first case of each parametrized test is run, of small tests every case.
    """
    for item in items:
        if any(own[-1].scope == "module" for own in item._fixtureinfo.name2fixturedefs.values()):
            item.add_marker(pytest.mark.xdist_group(item.path.name))
    if compiler.DISABLE_JIT:
        taken = Counter()
        dropped = []
        for item in [item for item in items if item.get_closest_marker("small") is None]:
            test = item.nodeid.partition("[")[0]
            taken[test] += 1
            if taken[test] > CASES_WITHOUT_COMPILER:
                items.remove(item)
                dropped.append(item)
        config.hook.pytest_deselected(items=dropped)


@pytest.fixture(scope="session")
def shared_data():
    """Folder of real focal planes and designs, which the project does not ship."""
    if not SHARED_DATA.is_dir() or os.environ.get("FIBERPLAN_NO_DATA"):  # as where coverage is measured
        pytest.skip(f"real data are not in {SHARED_DATA}")
    return SHARED_DATA


@pytest.fixture
def calibration(shared_data):
    return shared_data / "sdss/apo/wok_calibs/sloanFlatCMM"


@pytest.fixture
def conf_summary(shared_data):
    return shared_data / "sdss/jaeger_test_design/confSummary-test.par"


@pytest.fixture
def drawn(monkeypatch):
    """File name -> axes of each figure that is saved; none is written, which takes longer than what it shows.

    Whoever draws, both axes are labelled.
    """
    found = {}
    for paper in PAPERS:
        save = f"fiberplan.reproductions.{paper}.figures.save"
        monkeypatch.setattr(save, lambda figure, path: found.update({path.name: figure.axes}))
    yield found
    for name, axes in found.items():
        assert all(ax.get_xlabel() and ax.get_ylabel() for ax in axes), name


@pytest.fixture
def examples(tmp_path):
    """Folder of the instrument files that docs/instrument-format.md shows."""
    text = (Path(__file__).parents[1] / "docs" / "instrument-format.md").read_text(encoding="utf-8")
    for name, content in re.findall(r"```\w+ file=(\S+)\n(.*?)```", text, re.S):
        (tmp_path / name).write_text(content, encoding="utf-8")
    return tmp_path


@pytest.fixture(scope="session")
def small_plane():
    """Seven positioners, of which the middle one is R0C2."""
    return FocalPlane.hexagonal(1, 22.4)


@pytest.fixture(scope="session")
def small_plan(small_plane):
    """All but the offline R+1C2 turn outward by a little, R0C3 has no target and one goal is dropped."""
    plane = small_plane.replace(online=np.array([True] * 6 + [False]))
    goal = plane.folded + np.array([0.3, -0.2])
    goal[4] = np.nan
    goal[1] = plane.upper[1] + 1.0
    alternatives = np.full((plane.n, 2, 2), np.nan)
    alternatives[0, 0] = 1.0, 2.0
    problem = Problem(
        plane, plane.folded, goal, 0.1, np.arange(1.0, 8.0), "drop", alternatives, notes=("one is offline",)
    )
    end = np.where(np.isnan(problem.goal), problem.start, problem.goal)
    outcomes = [Outcome.ARRIVED] * 7
    outcomes[1], outcomes[4], outcomes[6] = Outcome.DROPPED, Outcome.NO_TARGET, Outcome.OFFLINE
    return Plan(
        problem,
        Trajectory.from_samples(np.array([0.0, 1.0]), np.stack([problem.start, end])),
        tuple(outcomes),
        planner="greedy-fold",
        parameters={"step": np.float64(0.1), "skip_noops": True, "relief": None, "sizes": (1, (2.5, "a"))},
        seed=11,
        blockers={1: (0, -1), 3: ()},
        timings={"fold": 0.1 + 0.2},
        notes=("Größe 1 µm",),
    )
