"""Options and which of them touch, against brute force; catalogues that cannot be used."""

import pickle

import numpy as np
import pytest
from astropy.table import Table

import fiberplan as fp
from fiberplan.errors import ProblemError, TargetError
from fiberplan.scenes.decisive import row
from fiberplan.survey import Catalogue, conflicts
from fiberplan.tolerances import EQUALITY
from problems import among_obstacles, hexagon

pytestmark = pytest.mark.small


def scattered(plane, count, seed=0, **more):
    """Targets uniform over the array."""
    rng = np.random.default_rng(seed)
    far = np.ptp(plane.base, axis=0).max() / 2 + 15.0
    x, y = rng.uniform(-far, far, (2, count))
    return Catalogue(x, y, **more)


def touching_by_brute_force(plane, options, margin):
    found = set()
    for a in range(len(options)):
        for b in range(a):
            i, j = options.positioner[[a, b]]
            if i == j or options.target[a] == options.target[b]:
                continue  # they exclude each other anyway
            pose = np.full((plane.n, 2), np.nan)
            pose[i], pose[j] = options.angles[a], options.angles[b]
            gaps = plane.clearance(pose)
            if (gaps < margin + EQUALITY).any():
                found.add((b, a))
    return found


@pytest.mark.large
def test_every_option_and_every_contact_is_found():
    plane = hexagon(1, lower=np.radians([-90.0, -180.0]), upper=np.radians([300.0, 180.0]))  # both elbows, and turns
    catalogue = scattered(plane, 12)
    table = conflicts(plane, catalogue, margin=0.5)
    options = table.options
    points = np.stack([catalogue.x, catalogue.y], axis=1)
    for i in range(plane.n):
        away = np.hypot(*(points - plane.base[i]).T)
        mine = options.target[options.positioner == i]
        assert set(mine) == set(np.flatnonzero((away >= 15.0 - 7.4) & (away <= 15.0 + 7.4)))
    pose = np.tile(plane.folded, (1, 1))
    for k in range(len(options)):
        pose[options.positioner[k]] = options.angles[k]
        assert plane.fibers(pose)[options.positioner[k]] == pytest.approx(points[options.target[k]], abs=1e-9)
    dense = table.toarray()
    assert (dense == dense.T).all()
    assert set(zip(*np.nonzero(np.triu(dense)), strict=True)) == touching_by_brute_force(plane, options, 0.5)
    assert dense.any()
    assert not (options.positioner[table.nonzero()[0]] == options.positioner[table.nonzero()[1]]).any()


@pytest.mark.large
def test_what_stands_still_blocks_options_and_is_named():
    plane = among_obstacles().plane
    plane = plane.replace(online=np.arange(plane.n) != 9)
    start = plane.folded.copy()
    start[9] = np.radians([30.0, 10.0])
    table = conflicts(plane, scattered(plane, 60), margin=0.5, start=start, stay=[plane.ids[3]])
    assert not np.isin(table.options.positioner, [3, 9]).any()
    by = set(table.blocked.by.tolist())
    assert 9 in by
    assert {-1, -2, -3} & by
    free = {(i, t) for i, t in zip(table.options.positioner, table.options.target, strict=True)}
    for options, is_free in ((table.options, True), (table.blocked.options, False)):
        for k in range(len(options)):
            goal = np.full((plane.n, 2), np.nan)
            goal[options.positioner[k]] = options.angles[k]
            still = plane.replace(online=plane.online & (np.arange(plane.n) != 3))
            problem = fp.Problem(still, start, goal, 0.5, conflicts="drop")
            assert problem.has_goal[options.positioner[k]] == is_free
    assert free


def test_room_of_ones_own_is_on_top_of_the_margin():
    plane = row(2)
    catalogue = Catalogue([11.2, 9.0, 13.0, 20.0], [8.0, 7.0, 4.0, 9.0])
    rough = conflicts(plane, catalogue, 1.0, position_error=np.array([0.75, 0.25]))
    assert (rough.toarray() == conflicts(plane, catalogue, 2.0).toarray()).all()
    assert rough.nnz != conflicts(plane, catalogue, 1.0).nnz


def test_any_set_without_contacts_is_a_goal_of_a_problem():
    plane = hexagon(2)
    table = conflicts(plane, scattered(plane, 80), margin=1.0)
    goal, taken, who, out = (
        np.full((plane.n, 2), np.nan),
        set(),
        table.options.positioner,
        np.zeros(table.shape[0], bool),
    )
    for k in range(table.shape[0]):
        if not out[k] and np.isnan(goal[who[k], 0]) and table.options.target[k] not in taken:
            goal[who[k]] = table.options.angles[k]
            taken.add(table.options.target[k])
            out[table.indices[table.indptr[k] : table.indptr[k + 1]]] = True
    assert fp.Problem(plane, plane.folded, goal, 1.0).has_goal.sum() == len(taken) > 8


def test_table_is_pickled_with_its_options():
    table = conflicts(row(2), Catalogue([11.2, 9.0], [8.0, 7.0]))
    again = pickle.loads(pickle.dumps(table))
    assert (again.toarray() == table.toarray()).all()
    assert again.options.alpha.tolist() == table.options.alpha.tolist()


def test_fibers_of_a_kind_are_only_on_those_that_carry_it():
    plane = row(3)
    other = np.array([[np.nan, np.nan], [14.0, 1.0], [14.0, -1.0]])
    plane = plane.replace(fiber_offsets={"boss": plane.fiber, "apogee": other})
    catalogue = Catalogue([9.0, 8.0, 40.0], [12.0, 12.0, 12.0], fiber=("APOGEE", "", "apogee"))
    options = conflicts(plane, catalogue).options
    assert 0 not in options.positioner[options.target != 1]
    assert set(options.target[options.positioner == 0]) == {1}
    for k in np.flatnonzero(options.target != 1):
        pose = plane.folded.copy()
        pose[options.positioner[k]] = options.angles[k]
        point = plane.fibers(pose, "apogee")[options.positioner[k]]
        assert point == pytest.approx([catalogue.x[options.target[k]], 12.0])
    with pytest.raises(TargetError, match=r"catalogue: row 1: unnamed has no fiber 'nir'; it has boss, apogee"):
        conflicts(plane.replace(name="unnamed"), Catalogue([5.0], [12.0], fiber=("nir",)))


TABLES = {
    "no x": (Table({"y": [1.0]}), "catalogue: no column 'x'"),
    "priority": (Table({"x": [1.0], "y": [1.0], "priority": [-2.0]}), "row 1: priority is -2, expected a finite"),
    "tier": (
        Table({"x": [1.0, 2.0], "y": [1.0, 2.0], "tier": [1, 1.5]}),
        "row 2: tier is 1.5, expected a whole number",
    ),
    "parity": (Table({"x": [1.0], "y": [1.0], "parity": [3]}), r"row 1: parity is 3, expected \+1"),
    "nan": (Table({"x": [np.nan], "y": [1.0]}), "row 1: x is nan"),
    "none": ([], "a catalogue is a table, targets or the path of a file, not list"),
}


@pytest.mark.parametrize("case", TABLES)
def test_catalogues_that_cannot_be_used(case):
    table, complaint = TABLES[case]
    with pytest.raises(TargetError, match=complaint):
        Catalogue.of(table)


def test_catalogue_of_a_file(tmp_path):
    path = tmp_path / "catalogue.csv"
    path.write_text("id,x [cm],y,priority,tier,category\nstar,1,2,,2,\n,3,4,5,,sky\n")
    read = Catalogue.of(path)
    assert read.x.tolist() == [10.0, 30.0]
    assert read.ids == ("star", "line 3")
    assert read.priority.tolist() == [1.0, 5.0]
    assert read.tier.tolist() == [2, 1]
    assert read.category == ("science", "sky")


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"margin": -1.0}, "margin must be a length"),
        ({"stay": ["R9"]}, "stay: hexagonal has no positioner 'R9'"),
        ({"stay": [7]}, "stay: hexagonal has no positioner 7: indices run from 0 to 1"),
        ({"stay": "P0"}, "stay: expected ids or indices"),
        ({"stay": np.zeros(3, bool)}, r"stay: flags must have shape \(2,\)"),
        ({"start": np.zeros((3, 2))}, "a state of 3 positioners for 2"),
    ],
)
def test_settings_that_make_no_sense(settings, complaint):
    with pytest.raises(ProblemError, match=complaint):
        conflicts(row(2), Catalogue([11.2], [8.0]), **settings)
