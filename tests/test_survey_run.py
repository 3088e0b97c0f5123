"""Many fields: what is planned does not depend on who plans it, nor on how often the run was ended."""

import json
import os
import shutil
import signal
import time
import zlib
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor

import numpy as np
import pytest
from astropy.table import Table

import fiberplan as fp
from fiberplan.errors import FiberplanError, ProblemError, TargetError
from fiberplan.scenes import clustered_sky
from fiberplan.survey import Telescope, run
from fiberplan.survey.batch.fingerprint import fingerprint
from fiberplan.survey.batch.precedence import Precedence
from fiberplan.survey.batch.workers import Here, LocalProcesses, died
from fiberplan.visuals.survey_report import Report, _maps
from problems import hexagon

PLANE = hexagon(1)
TOY = Telescope("toy", [2000.0], 0.02)
FIELDS = 4


def inputs():
    """Of a square of nine fields the lower row, in a chain, and one in the far corner."""
    catalogue, fields = clustered_sky(9, TOY.radius, 24.0, seed=3)
    fields = fields[[0, 8, 1, 2]]
    fields["chain"] = ["a", "b", "a", "a"]
    return catalogue, fields


def surveyed(folder, executor=None, **changes):
    settings = {"margin": 0.5, "telescope": TOY, "required": {"sky": 1}, "at_once": 1, "solver": "heuristic"}
    return run(PLANE, *inputs(), folder, Here() if executor is None else executor, **settings | changes)


def content(folder):
    """All files of a survey; of the ledger what no clock says, in the order of fields."""
    files = {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.stem not in ("ledger", "times")
    }
    lines = [json.loads(line.split(" ", 1)[1]) for line in (folder / "ledger.jsonl").read_text().splitlines()]
    files["ledger"] = [lines[0], *sorted((line | {"times": 0} for line in lines[1:]), key=lambda line: line["field"])]
    return files


@pytest.fixture(scope="module", autouse=True)
def undrawn():
    """Maps take long to draw, and are drawn in a test of their own: here they are what would be drawn."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fiberplan.visuals.survey_report._maps", lambda report: repr(report).encode())
        yield


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    return surveyed(folder), folder


def test_every_field_is_planned_from_where_the_one_before_in_its_chain_ended(done):
    survey, folder = done
    assert not survey.failed
    assert all(record.taken for record in survey.records)
    plans = [fp.Plan.read(folder / "plans" / f"{k:06d}.fits") for k in range(FIELDS)]
    assert all(plan.certificate.ok and plan.problem.margin == 0.5 for plan in plans)
    for k, before in ((2, 0), (3, 2)):
        assert (plans[k].problem.start == plans[before].trajectory.end).all()
    assert (plans[0].problem.start == PLANE.folded).all()
    assert (plans[1].problem.start == PLANE.folded).all()
    for k, plan in enumerate(plans):
        targets = fp.Targets.read(folder / "targets" / f"{k:06d}.ecsv")
        points = np.stack([targets.x, targets.y], axis=1)
        assert plan.problem.plane.fibers(plan.trajectory.end)[targets.indices(PLANE)] == pytest.approx(points, abs=1e-3)


def test_nothing_is_observed_more_often_than_wanted_but_sky(done):
    survey, _ = done
    catalogue, _ = inputs()
    seen, sky = survey.seen, catalogue["category"] == "sky"
    assert (seen <= catalogue["visits"])[~sky].all()
    shared = survey.lying > 1
    assert (seen[shared] > 0).sum() > 3  # so that there was something to take twice
    assert sum(len(record.taken) for record in survey.records) == seen.sum()


def test_tables_agree_with_each_other(done):
    survey, folder = done
    tables = survey.tables()
    catalogue, _ = inputs()
    assert tables["completeness"]["targets"].sum() == len(catalogue)
    assert tables["completeness"]["in_fields"].sum() == (survey.lying > 0).sum()
    assert tables["by_field"]["observed"].sum() == tables["fields"]["observed"].sum() == survey.seen.sum()
    offered, missed = tables["fields"]["offered"].sum(), tables["reasons"]["targets"].sum()
    assert offered == missed + survey.seen.sum()
    assert tables["positioners"]["fields"].sum() == survey.seen.sum()
    assert tables["moves"]["stop"][0] == tables["fields"]["makespan"].max()
    read = Table.read(folder / "tables" / "fields.ecsv")
    assert read["makespan"].unit == "s"
    assert read["makespan"].tolist() == [record.makespan for record in survey.records]
    assert f"{survey.moving:.1f} s moving" in str(survey)
    page = (folder / "report.html").read_text()
    assert "Completeness by class and tier" in page
    assert "no refraction" in page
    assert "http" not in page


def test_a_run_that_was_ended_goes_on_as_if_it_had_not_been(done, tmp_path):
    _, whole = done
    lines = (whole / "ledger.jsonl").read_bytes().splitlines(keepends=True)
    for kept, rest in ((1, b""), (3, lines[3][:40])):
        folder = tmp_path / str(kept)
        shutil.copytree(whole, folder)
        shutil.rmtree(folder / "tables")
        (folder / "ledger.jsonl").write_bytes(b"".join(lines[:kept]) + rest)
        if kept == 1:
            shutil.rmtree(folder / "plans")
        surveyed(folder)
        assert content(folder) == content(whole)


class Backwards(ThreadPoolExecutor):
    """Two threads, and of what is handed over at a time the last is done first."""

    def __init__(self):
        super().__init__(1)
        self.waiting = []
        self.most = 0

    def submit(self, fn, /, *args):
        future = Future()
        self.waiting.append((future, fn, args))
        self.most = max(self.most, len(self.waiting))
        if len(self.waiting) == 1:
            super().submit(self._late)
        return future

    def _late(self):
        for _ in range(600):  # until two are handed over at a time, once
            if self.most > 1:
                break
            time.sleep(0.05)
        while self.waiting:
            future, fn, args = self.waiting.pop()
            future.set_result(fn(*args))


def test_any_executor_gives_the_same(done, tmp_path):
    with Backwards() as executor:
        surveyed(tmp_path, executor, at_once=3)
    assert executor.most == 2  # chains a and b begin together
    assert content(tmp_path) == content(done[1])


class Dying(Here):
    """Workers that die at some tries, counted from 1."""

    def __init__(self, when, error=BrokenExecutor):
        self.when, self.error, self.tries = when, error, 0

    def submit(self, fn, /, *args):
        self.tries += 1
        if self.tries not in self.when:
            return super().submit(fn, *args)
        future = Future()
        future.set_exception(self.error("worker ended abruptly"))
        return future


def test_a_worker_that_dies_costs_a_try(done, tmp_path):
    assert died(BrokenExecutor())
    assert not died(ValueError())
    survey = surveyed(tmp_path, Dying({2, 3}, MemoryError))
    assert content(tmp_path) == content(done[1])
    assert sorted(survey.tables()["times"]["tries"].tolist()) == [1, 1, 1, 3]


def test_a_field_that_fails_is_told_by_name_and_the_next_begins_where_the_last_ended(tmp_path):
    survey = surveyed(tmp_path, Dying({3, 4, 5}))
    (failed,) = survey.failed
    assert failed.id == "F0001"
    assert "its worker died 3 times (BrokenExecutor)" in failed.why
    plans = [fp.Plan.read(tmp_path / "plans" / f"{k:06d}.fits") for k in (0, 3)]
    assert (plans[1].problem.start == plans[0].trajectory.end).all()
    assert "F0001" in (tmp_path / "report.html").read_text()
    again = surveyed(tmp_path)
    assert again.failed == survey.failed


def one_robot(folder, executor=None):
    """Three fields, one after the other, of one robot and a target in each."""
    places = {"id": ["a", "b", "c"], "field": ["1", "2", "3"], "x": [9.0, 0.0, -9.0], "y": [8.0, 14.0, 8.0]}
    fields = Table({"id": ["1", "2", "3"]})
    settings = {"margin": 0.5, "at_once": 1, "solver": "heuristic"}
    return run(hexagon(0), Table(places), fields, folder, Here() if executor is None else executor, **settings)


@pytest.mark.small
def test_one_robot_goes_on_from_the_last_field_that_did_not_fail(tmp_path):
    """The worker of the first field dies once, that of the second always; and all is as if it had been one run."""
    with pytest.raises(KeyboardInterrupt):
        one_robot(tmp_path, Dying({2}, KeyboardInterrupt))
    survey = one_robot(tmp_path, Dying({1, 2, 3}, MemoryError))
    assert [record.why for record in survey.records] == ["", "its worker died 3 times (MemoryError)", ""]
    plans = [fp.Plan.read(tmp_path / "plans" / f"{k:06d}.fits") for k in (0, 2)]
    assert (plans[1].problem.start == plans[0].trajectory.end).all()
    assert plans[1].problem.state.source == "end of field 1"
    once = tmp_path / "once"
    one_robot(once, Dying({1, 3, 4, 5}, MemoryError))
    name = "plans/000002.fits"
    assert (once / name).read_bytes() == (tmp_path / name).read_bytes()


@pytest.mark.small
def test_an_executor_that_broke_is_told_and_a_record_that_is_none_is_refused(tmp_path):
    class Broken(Here):
        def submit(self, fn, /, *args):
            raise BrokenExecutor

    with pytest.raises(FiberplanError, match="the executor broke; what is done is kept"):
        one_robot(tmp_path, Broken())
    ledger = tmp_path / "ledger.jsonl"
    first = ledger.read_bytes()
    for said, complaint in ((b'{"field": 0}', "line 2: is no record of a field"), (b"7", "line 2: is no record")):
        ledger.write_bytes(first + f"{zlib.crc32(said):08x} ".encode() + said + b"\n")
        with pytest.raises(FiberplanError, match=complaint):
            one_robot(tmp_path)
    other = b'{"ledger": 99}'
    ledger.write_bytes(f"{zlib.crc32(other):08x} ".encode() + other + b"\n")
    with pytest.raises(FiberplanError, match="line 1: is not a ledger of format"):
        one_robot(tmp_path)
    (tmp_path / "folder" / "ledger.jsonl").mkdir(parents=True)
    with pytest.raises(FiberplanError, match="cannot be opened"):
        one_robot(tmp_path / "folder")


def test_an_error_of_a_field_is_not_tried_again(tmp_path):
    executor = Dying({1}, ValueError)
    survey = surveyed(tmp_path, executor)
    assert [record.why for record in survey.failed] == ["ValueError: worker ended abruptly"]
    assert executor.tries == FIELDS


def test_ctrl_c_ends_the_run_and_keeps_what_is_done(done, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        surveyed(tmp_path, Dying({3}, KeyboardInterrupt))
    assert len((tmp_path / "ledger.jsonl").read_text().splitlines()) == 3
    surveyed(tmp_path)
    assert content(tmp_path) == content(done[1])


@pytest.mark.large
@pytest.mark.slow
def test_a_local_process_that_is_killed_costs_its_field_a_try(done, tmp_path):
    killed = []

    class Killing(LocalProcesses):
        def __init__(self, count, setup):
            super().__init__(1, setup)

        def submit(self, fn, /, *args):
            future = super().submit(fn, *args)
            if not killed:
                killed.append(next(iter(self._pids.values())).result())
                os.kill(killed[0], signal.SIGKILL)
            return future

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fiberplan.survey.batch.run.LocalProcesses", Killing)
        settings = {"margin": 0.5, "telescope": TOY, "required": {"sky": 1}, "solver": "heuristic"}
        survey = run(PLANE, *inputs(), tmp_path, at_once=2, **settings)
    assert content(tmp_path) == content(done[1])
    assert sorted(survey.tables()["times"]["tries"].tolist()) == [1, 1, 1, 2]


def damaged(line, change):
    def damage(folder):
        path = folder / "ledger.jsonl"
        lines = path.read_bytes().splitlines(keepends=True)
        lines[line] = change(lines[line])
        path.write_bytes(b"".join(lines))

    return damage


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (damaged(2, lambda line: line.replace(b"makespan", b"makespam")), "ledger.jsonl: line 3: is damaged"),
        (damaged(0, lambda line: b"hello\n"), "ledger.jsonl: line 1: is damaged"),
        (damaged(3, lambda line: line + line), "ledger.jsonl: line 5: field 'F0001' is there already"),
        (
            lambda folder: (folder / "plans" / "000001.fits").unlink(),
            "000001.fits: cannot be read, and the ledger",
        ),
        (lambda folder: (folder / "targets" / "000001.ecsv").write_text(""), r"000001.ecsv: has 0 bytes, and \d+ were"),
    ],
)
def test_a_ledger_that_cannot_be_believed(done, tmp_path, damage, complaint):
    shutil.copytree(done[1], tmp_path, dirs_exist_ok=True)
    damage(tmp_path)
    with pytest.raises(FiberplanError, match=complaint):
        surveyed(tmp_path)


def test_a_ledger_of_other_inputs_is_refused(done, tmp_path):
    shutil.copytree(done[1], tmp_path, dirs_exist_ok=True)
    with pytest.raises(FiberplanError, match="is of another choice of settings: take another folder"):
        surveyed(tmp_path, margin=0.6)
    with pytest.raises(FiberplanError, match="is of another telescope"):
        surveyed(tmp_path, telescope=Telescope("toy", [2000.1], 0.02))
    with pytest.raises(FiberplanError, match="is of another focal plane"):
        run(hexagon(2), *inputs(), tmp_path, margin=0.5, telescope=TOY)
    assert content(tmp_path) == content(done[1])


@pytest.mark.small
def test_two_runs_do_not_share_a_folder(tmp_path):
    class Nosy(Here):
        def submit(self, fn, /, *args):
            surveyed(tmp_path)

    with pytest.raises(FiberplanError, match="another run is at work in this folder"):
        surveyed(tmp_path, Nosy())


@pytest.mark.small
@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"margin": -1.0}, "margin must be a length"),
        ({"seed": -1}, "seed must be"),
        ({"at_once": 0}, "at_once must be 1 or more"),
        ({"solver": "magic"}, "solver must be"),
        ({"required": {"sky": 1.5}}, "required: sky must be a whole number"),
        ({"telescope": None}, "there is no telescope 'hexagonal'"),
    ],
)
def test_settings_that_make_no_sense_leave_no_ledger(tmp_path, change, complaint):
    with pytest.raises(FiberplanError, match=complaint):
        surveyed(tmp_path / "new", **change)
    assert not (tmp_path / "new").exists()


@pytest.mark.small
def test_targets_without_a_field_of_theirs_are_refused(tmp_path):
    catalogue, fields = inputs()
    with pytest.raises(TargetError, match="row 1: needs ra and dec"):
        run(PLANE, catalogue, fields["id",], tmp_path, telescope=TOY)
    with pytest.raises(ProblemError, match="regions"):
        run(PLANE, catalogue, fields, tmp_path, telescope=TOY, regions=99)


@pytest.mark.small
def test_a_field_waits_for_its_chain_and_for_fields_that_share_targets():
    order = Precedence(["a", "b", "a", "c"], 5)
    for shared in ([0, 1], [2], [3], [1, 2]):
        order.add(np.array(shared))
    assert [order.next() for _ in range(3)] == [0, 1, None]
    order.done(1)
    assert order.next() is None
    order.done(0)
    assert [order.next() for _ in range(3)] == [2, 3, None]
    assert order.before == [None, None, 0, None]
    assert order.longest == 2
    assert [order.follows(k) for k in range(4)] == [True, False, False, False]


@pytest.mark.small
def test_a_fingerprint_is_of_every_bit_and_of_no_file_name():
    one, other = inputs()[0], inputs()[0]
    targets = fp.survey.SurveyTargets.of(one)
    other.meta["comment"] = "read elsewhere"
    assert fingerprint(targets) == fingerprint(fp.survey.SurveyTargets.of(other))
    other["priority"][7] = np.nextafter(other["priority"][7], 9.0)
    assert fingerprint(targets) != fingerprint(fp.survey.SurveyTargets.of(other))
    assert fingerprint(PLANE) == fingerprint(hexagon(1)) != fingerprint(hexagon(1).replace(name="other"))
    assert fingerprint(fp.planners.Direct()) != fingerprint(fp.planners.Direct(budget=61.0))


def test_maps_are_drawn_the_same_every_time():
    rng = np.random.default_rng(0)
    what = rng.random((3, 2)), rng.random(3), PLANE.base, rng.random(7), *rng.random((2, 3))
    page = Report("title", "verdict", True, *what, (), ())
    first, again = (_maps(page) for _ in range(2))
    assert first == again != _maps(page._replace(share=rng.random(3)))
    assert first.startswith(b"\x89PNG")
