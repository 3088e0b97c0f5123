"""Allocation as users see it: who takes what, that all arrive, and a reason for every target that nobody takes."""

import dataclasses
import json
from dataclasses import dataclass

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import ProblemError, TargetError
from fiberplan.plan import Bound
from fiberplan.scenes.decisive import row
from fiberplan.survey import Catalogue, Why, allocate, conflicts
from problems import behind_posts, hexagon
from test_survey_conflicts import scattered

pytestmark = pytest.mark.small


@dataclass(frozen=True)
class Together:
    """Two go straight to their goals; where the one goes to `first` and the other to `second`, as `then` says."""

    first: np.ndarray
    second: np.ndarray
    reference = "made up"

    def plan(self, problem):
        together = (problem.goal == np.stack([self.first, self.second])).all()
        goal = np.where(np.isnan(problem.goal), problem.start, problem.goal)
        outcomes = tuple(fp.Outcome.ARRIVED if has else fp.Outcome.NO_TARGET for has in problem.has_goal)
        seconds, outcomes, more = self.then(outcomes) if together else (30.0, outcomes, {})
        motion = fp.Trajectory.from_samples([0.0, seconds], [problem.start, goal])
        return fp.Plan(problem, motion, outcomes, "direct", **more)


class NotTogether(Together):
    """The first does not arrive then."""

    name = "not-together"

    def then(self, outcomes):
        return 30.0, (fp.Outcome.DEADLOCKED, *outcomes[1:]), {"blockers": {0: (-1, 1)}}


class SlowTogether(Together):
    """They take twice as long then."""

    name = "slow-together"

    def then(self, outcomes):
        return 60.0, outcomes, {"bounds": (Bound("pair", 60.0, (0, 1)),)}


@pytest.fixture(scope="module")
def crowded():
    """37 positioners among 80 targets, sky in two parts, one positioner that stays and one that cannot move."""
    plane = hexagon(3)
    plane = plane.replace(online=np.arange(plane.n) != 20)
    rng = np.random.default_rng(4)
    category = np.where(np.arange(80) % 4 == 0, "sky", "science")
    catalogue = scattered(plane, 80, 4, priority=rng.integers(1, 6, 80).astype(float), category=tuple(category))
    return allocate(plane, catalogue, 1.0, required={"sky": 5}, regions=2, stay=["R0C1"])


@pytest.mark.large
def test_everyone_arrives_where_it_was_sent(crowded):
    plan, plane = crowded.plan, crowded.problem.plane
    assert plan.certificate.ok
    assert len(plan.lost) == 0
    assert crowded.rounds == 1
    assert set(plan.having(fp.Outcome.ARRIVED)) == set(crowded.positioners)
    ends = plane.fibers(plan.trajectory.end)[crowded.positioners]
    listed = crowded.catalogue
    assert ends == pytest.approx(np.stack([listed.x, listed.y], axis=1)[crowded.rows], abs=1e-3)
    assert not {plane.names["R0C1"], 20} & set(crowded.positioners)
    assert len(set(crowded.rows)) == len(crowded.rows)
    science = [row for row in crowded.rows if listed.category[row] == "science"]
    assert crowded.value == listed.priority[science].sum() <= crowded.bound


@pytest.mark.large
def test_required_positions_are_spread_and_no_more_are_taken(crowded):
    assert [(q.category, q.region, q.required, q.allocated) for q in crowded.quotas] == [
        ("sky", 0, 3, 3),
        ("sky", 1, 2, 2),
    ]
    assert sum(crowded.catalogue.category[row] == "sky" for row in crowded.rows) == 5


@pytest.mark.large
def test_every_target_that_nobody_takes_has_a_reason_that_holds(crowded):
    missing = set(range(len(crowded.catalogue))) - set(crowded.rows.tolist())
    assert set(crowded.reasons) == missing
    taken = dict(zip(crowded.rows.tolist(), crowded.positioners.tolist(), strict=True))
    for reason in crowded.reasons.values():
        for who, what in zip(reason.positioners, reason.targets, strict=reason.why is not Why.AT_REST):
            assert taken[what] == who
            assert crowded.problem.plane.ids[who] in reason.text
    assert {Why.TAKEN, Why.CONFLICT, Why.QUOTA} <= set(crowded.counts())


@pytest.mark.large
def test_targets_are_a_problem_and_a_file(crowded, tmp_path):
    plane, path = crowded.problem.plane, tmp_path / "targets.ecsv"
    crowded.write(path)
    read = fp.Targets.read(path)
    assert read.positioner == crowded.targets.positioner
    problem = fp.Problem.from_targets(plane, read, margin=1.0)
    assert np.array_equal(problem.goal, crowded.plan.problem.goal, equal_nan=True)
    table = crowded.to_table()
    assert table["target"][0] == crowded.catalogue.ids[crowded.rows[0]]


@pytest.mark.large
def test_the_same_seed_allocates_the_same(crowded):
    settings = {"margin": 1.0, "required": {"sky": 5}, "regions": 2, "stay": [crowded.problem.plane.index["R0C1"]]}
    again = allocate(crowded.problem.plane, crowded.catalogue, **settings, motion=False)
    assert (again.chosen == crowded.chosen).all()
    assert again.plan is None


@pytest.mark.large
def test_a_target_that_no_motion_reaches_is_given_up_alone():
    problem = behind_posts()
    plane = problem.plane
    places = plane.fibers(problem.goal)
    catalogue = Catalogue(*places.T, ids=("pocket", "other"), priority=[5.0, 2.0])
    assert set(allocate(plane, catalogue, motion=False).rows) == {0, 1}
    moving = allocate(plane, catalogue)
    assert moving.rows.tolist() == [1]
    assert (moving.rounds, moving.price, moving.value) == (2, 5.0, 2.0)
    assert moving.plan.certificate.ok
    assert len(moving.plan.lost) == 0
    assert moving.reasons[0].why is Why.MOTION


def test_two_that_are_lost_together_are_each_taken_with_another():
    plane = row(2, 60.0)
    catalogue = Catalogue([9.0, 8.0, 69.0], [12.0, 13.0, 12.0], priority=[5.0, 4.0, 5.0])
    table = conflicts(plane, catalogue)
    assert table.options.target.tolist() == [0, 1, 2]
    planner = NotTogether(table.options.angles[0], table.options.angles[2])
    found = allocate(plane, catalogue, planner=planner)
    assert set(found.rows) == {1, 2}
    assert (found.rounds, found.price) == (2, 1.0)
    assert found.reasons[0].why is Why.MOTION
    assert found.reasons[0].text.startswith("P0 did not arrive together with P0 on row 2 (priority 4), P1 on row 3")


def test_two_that_set_the_time_are_parted_where_that_costs_nothing():
    plane = row(2, 60.0)
    for priority, makespan, rounds in (([5.0, 5.0, 5.0], 30.0, 2), ([5.0, 4.0, 5.0], 60.0, 1)):
        catalogue = Catalogue([9.0, 8.0, 69.0], [12.0, 13.0, 12.0], priority=priority)
        still = allocate(plane, catalogue, motion=False)
        found = allocate(plane, catalogue, planner=SlowTogether(*still.table.options.angles[still.chosen]))
        assert (found.plan.makespan, found.rounds, found.price) == (makespan, rounds, 0.0)
        assert (set(found.rows) == set(still.rows)) == (rounds == 1)
        assert found.value == still.value


def test_two_that_want_one_place_are_told_who_has_it():
    plane = row(2)
    places = [11.2, 11.3, 500.0, -5.0], [11.0, 11.1, 0.0, 12.0]
    catalogue = Catalogue(*places, ids=("a", "b", "far", "c"), priority=[3.0, 2, 1, 0])
    found = allocate(plane, catalogue, motion=False)
    assert found.catalogue.ids[found.rows[0]] == "a"
    assert [found.reasons[k].why for k in (1, 2, 3)] == [Why.TAKEN, Why.OUT_OF_REACH, Why.WORTHLESS]
    assert "a (priority 3)" in found.reasons[1].text
    tiers = allocate(plane, dataclasses.replace(catalogue, tier=[2, 1, 1, 1]), motion=False)
    assert tiers.catalogue.ids[tiers.rows[0]] == "b"
    assert [(t.tier, t.targets, t.value) for t in tiers.tiers] == [(1, 1, 2.0), (2, 0, 0.0)]


def test_what_nobody_can_reach_is_told_why():
    plane = row(2).replace(online=np.array([True, False]), field_radius=100.0, forbidden=[[-5.0, 12.0, 1.0]])
    found = allocate(plane, Catalogue([16.0, 500.0, -5.0, -50.0], [2.0, 0.0, 12.0, 0.0]), motion=False)
    assert not len(found.rows)
    assert found.reasons[0].why is Why.AT_REST
    for k, words in enumerate(("would touch P1, which stands still", "field of radius 100 mm", "no fiber may end")):
        assert words in found.reasons[k].text
    assert found.reasons[3].text.endswith("the nearest is P0, 50.000 mm away")


def test_what_is_required_goes_first_and_no_further():
    def sky_and(x, y, n, *category):
        catalogue = Catalogue([9.0, x], [12.0, y], priority=[0.0, 9.0], category=category)
        return allocate(row(n, 60.0), catalogue, motion=False, required={"sky": 1})

    found = sky_and(8.0, 13.0, 1, "sky", "science")
    assert found.rows.tolist() == [0]
    assert found.reasons[1].text == "a required position would go: P0 on row 1 (sky)"
    found = sky_and(69.0, 12.0, 2, "sky", "sky")
    ((left, reason),) = found.reasons.items()
    assert reason.why is Why.QUOTA
    assert reason.text.startswith("1 of category sky are required in region 0")
    assert found.rows.tolist() == [1 - left]


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"solver": "cplex"}, "solver must be 'milp' or 'heuristic', got 'cplex'"),
        ({"required": {"sky": 1.5}}, "required: sky must be a whole number of 0 or more, got 1.5"),
        ({"regions": 0}, "regions must be from 1 to 2, got 0"),
        ({"regions": [0.5, 1]}, "regions must be a number, or 2 whole numbers from 0"),
        ({"deadline": 0.0}, "deadline must be a time of more than 0 s"),
        ({"seed": -1}, "seed"),
    ],
)
def test_settings_that_make_no_sense(settings, complaint):
    with pytest.raises(ProblemError, match=complaint):
        allocate(row(2), Catalogue([11.2], [8.0]), **settings)


CATALOGUE = "id,x,y,priority,category\na,11.2,11.0,3,\nb,11.3,11.1,2,\nskyline,-5,12,1,sky\nfar,500,0,1,\n"


@pytest.fixture
def catalogue(tmp_path):
    path = tmp_path / "catalogue.csv"
    path.write_text(CATALOGUE)
    return path


def test_priority_one_is_first_where_that_is_said(tmp_path, capsys):
    """Two targets of one place: one of them can be had; and what the proof rests on is told."""
    path = tmp_path / "c.csv"
    path.write_text("id,x,y,priority\nfirst,11.2,5,1\nlast,11.6,5,15\n")
    for order, taken in (("larger", "last"), ("smaller", "first")):
        assert run(["allocate", "sayres2021", str(path), "--no-motion", "--priority-order", order, "--json"]) == 0
        assert list(json.loads(capsys.readouterr().out)["allocated"].values()) == [taken]
    with pytest.raises(TargetError, match="priority_order must be"):
        Catalogue.read(path, "lower")


def test_command_writes_targets_that_plan_takes(catalogue, tmp_path, capsys):
    out, moved, two = (str(tmp_path / name) for name in ("targets.ecsv", "plan.fits", "two.fits"))
    row(2).write(two)
    assert run(["allocate", two, str(catalogue), "--require", "sky=1", "-o", out, "--plan", moved]) == 0
    said = capsys.readouterr().out
    assert said.startswith("2 of 4 targets allocated to 2 positioners, value 3 of at most 3\n")
    assert "not allocated: 1: no positioner that can move brings its fiber there" in said
    assert "note: the margin is 0 mm" in said
    assert len(fp.Targets.read(out)) == 2
    assert len(fp.Plan.read(moved).lost) == 0


def test_command_answers_programs_and_tells_what_is_short(catalogue, capsys):
    assert run(["allocate", "sayres2021", str(catalogue), "--no-motion", "--require", "sky=2", "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert set(said["allocated"].values()) == {"a", "skyline"}
    assert said["required"] == [{"category": "sky", "region": 0, "required": 2, "allocated": 1}]
    assert said["not_allocated"]["far"]["why"] == "OUT_OF_REACH"
    assert run(["allocate", "sayres2021", str(catalogue), "--no-motion", "--require", "sky=2"]) == 1
    told = capsys.readouterr().out
    assert "1 of 2 required positions of category sky in region 0" in told
    assert told.endswith("nothing written: -o FILE keeps the targets\n")


def test_command_that_finds_nothing_writes_nothing(tmp_path, capsys):
    path = tmp_path / "far.csv"
    path.write_text("x,y\n900,0\n")
    assert run(["allocate", "sayres2021", str(path), "--no-motion", "-o", str(tmp_path / "targets.ecsv")]) == 1
    assert "nothing written" in capsys.readouterr().out
    assert [each.name for each in tmp_path.iterdir()] == ["far.csv"]


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--require", "sky"], "--require sky: expected CATEGORY=N"),
        (["--require", "sky=1", "--require", "sky=2"], "there is a number for sky already"),
        (["--stay", "R99"], "stay: sayres2021 has no positioner 'R99'"),
        (["--no-motion", "--plan", "plan.fits"], "--plan asks for a motion"),
        (["-o", "targets.html"], "this command writes a table"),
    ],
)
def test_command_refuses_in_one_line(catalogue, options, complaint, capsys, monkeypatch):
    monkeypatch.chdir(catalogue.parent)
    assert run(["allocate", "sayres2021", str(catalogue), *options]) == 2
    said = capsys.readouterr().err
    assert complaint in said
    assert said.count("\n") == 1
    assert [path.name for path in catalogue.parent.iterdir()] == ["catalogue.csv"]
