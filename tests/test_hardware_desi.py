"""Move tables of DESI: the instrument's own golden numbers both ways, and two tables that were really sent."""

import json
from typing import NamedTuple

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import PlanError, ProblemError, TrajectoryError, UnprovenError
from fiberplan.hardware import desi
from fiberplan.hardware.desi.decode import Tables, read_tables
from fiberplan.hardware.desi.encode import as_csv, tables
from fiberplan.hardware.desi.moves import creeping_moves, moves_of
from fiberplan.hardware.desi.rows import Move, rows_of, turned, turned_linear
from fiberplan.hardware.desi.scheduling import SPARE, scheduled
from fiberplan.hardware.desi.turns import axis_turn
from fiberplan.hardware.desi.ways import seconds

pytestmark = pytest.mark.small

RETRACTED = 114.0 + 1.085708  # phi of the envelope Eo, as the golden positioners count it [deg]


class Golden(NamedTuple):
    """A table as it is printed."""

    where: str
    steps: list[tuple[int, int]]
    modes: list[tuple[str, str]]
    times: list[str]
    pauses: list[int]
    total: float
    linear: bool
    said: dict

    @property
    def tables(self):
        cruise = np.array([[mode == "cruise" for mode in row] for row in self.modes])
        times, pauses = np.array(self.times, float), np.array(self.pauses) / 1000
        return Tables("M0", "line 2", self.linear, np.array(self.steps), cruise, times, pauses)


def table_of(rows):
    """What is read of rows as they are written, pauses aside."""
    cruise = np.array([[mode == "cruise" for mode in row.mode] for row in rows])
    steps, times = (np.array([getattr(row, name) for row in rows]) for name in ("steps", "time"))
    return Tables("M0", "", False, steps, cruise, times, np.zeros(len(rows)))


def golden_tables(node, where=""):
    if isinstance(node, list):
        for k, each in enumerate(node):
            yield from golden_tables(each, f"{where}[{k}]")
    elif isinstance(node, dict):
        for name, text in node.get("move_tables", {}).items():
            heads = dict(map(str.strip, line.split(":", 1)) for line in text if ":" in line)
            rows = [line.split() for line in text if line.split()[0].lstrip("-").isdecimal()]
            steps = [(int(row[0]), int(row[1])) for row in rows]
            modes, times, pauses = (
                [(row[2], row[3]) for row in rows],
                [row[4] for row in rows],
                [int(row[5]) for row in rows],
            )
            total, linear = float(heads["total_time"]), heads.get("zeno") == "P"
            yield Golden(f"{where} {name}", steps, modes, times, pauses, total, linear, node)
        for key, each in node.items():
            if key != "move_tables":
                yield from golden_tables(each, f"{where}/{key}")


@pytest.fixture(scope="module")
def golden(shared_data):
    files = sorted((shared_data / "desi" / "baselines").glob("*.json"))
    found = [table for file in files for table in golden_tables(json.loads(file.read_text())["data"], file.name[:2])]
    assert len(found) == 45
    return found


def same_time(printed, seconds):
    """Whether a time reads as printed, in as many decimals."""
    decimals = len(printed.partition(".")[2])
    return abs(float(printed) - seconds) <= 0.5 * 10**-decimals + 1e-9


def test_golden_rows_are_written_as_printed(golden):
    """What a row turns, written again: the same steps, the same mode, the same time."""
    for table in golden:
        for k, steps in enumerate(table.steps):
            times = []
            for axis, (count, mode) in enumerate(zip(steps, table.modes[k], strict=True)):
                if count:
                    linear = table.linear and axis == 1
                    turn = axis_turn(count, mode == "cruise", linear)
                    made = turned_linear(turn.angles[-1]) if linear else turned(turn.angles[-1], mode == "creep")
                    assert made.steps == count, table.where
                    times.append(made.time)
            assert same_time(table.times[k], max(times, default=0.0)), table.where


def test_golden_times_add_up(golden):
    for table in golden:
        assert abs(table.tables.begins[-1] - table.total) < 0.0005 * len(table.steps), table.where


HOME = (0.0, 100.0)  # where golden positioners begin


def end_of(table):
    """Where a table leads, as printed."""
    said = table.said.get("final_state", table.said)
    said = said.get("positioner_state", said)
    if "positioner_states" in said:
        said = said["positioner_states"][table.where.split()[-1]]
    return np.array(said["posintTP"] if "posintTP" in said else table.said["enabled_state"]["posintTP"])


def begin_of(table, golden):
    """The printed position from which a table leads to where it is printed to; None if there is none."""
    name, file = table.where.split()[-1], table.where[:2]
    printed = [end_of(other) for other in golden if other.where[:2] == file and other.where.split()[-1] == name]
    for begin in (np.array(HOME), *printed):
        if np.allclose(begin + table.tables.net[-1], end_of(table), atol=1.01e-6, rtol=0):
            return begin
    return None


def test_golden_positions_are_where_tables_lead(golden):
    """Net turns to the last digit printed, from one printed position to the next."""
    lost = [table.where for table in golden if begin_of(table, golden) is None]
    assert lost == []


def test_golden_moves_are_written_as_printed(golden):
    """From targets to whole tables: retract, rotate, extend; modes, steps, times and tail as printed."""
    checked = 0
    for table in golden:
        if table.where[:2] not in ("10", "11") or "target" not in table.said:
            continue
        start, target = begin_of(table, golden), np.array(table.said["target"])
        theta, phi = target - start
        if sum(p != 0 for _, p in table.steps) >= 4:  # two of them the tail's, or jogs
            moves = [Move((0, RETRACTED - start[1])), Move((theta, 0)), Move((0, target[1] - RETRACTED))]
        else:
            moves = [Move((theta, phi))]
        rows = rows_of(moves, table.linear)
        assert [row.steps for row in rows] == table.steps, table.where
        assert [row.mode for row in rows] == table.modes, table.where
        assert all(same_time(printed, row.time) for printed, row in zip(table.times, rows, strict=True)), table.where
        checked += 1
    assert checked == 8


def test_a_table_of_two_moves_is_written_as_printed():
    """Golden table 07: 30 and 20 deg, half a second, -15 and 10 deg, tail."""
    rows = rows_of([Move((30.0, 20.0), 500), Move((-15.0, 10.0))])
    assert [row.steps for row in rows] == [(-2659, -1637), (1125, -614), (-10121, 10121), (10139, -10118)]
    assert [round(row.time, 6) for row in rows] == [0.193056, 0.107833, 1.124556, 1.126556]
    assert [row.pause for row in rows] == [500, 0, 0, 0]
    assert [row.mode for row in rows] == [("cruise", "cruise")] * 2 + [("creep", "creep")] * 2
    table = table_of(rows)
    expected = [[30.00094, 20.003887], [15.005361, 30.00094], [18.005425, 27.000875], [15.000025, 30.00005]]
    np.testing.assert_allclose(table.net, expected, atol=5.1e-7, rtol=0)


@pytest.mark.parametrize("petal", ["04", "07"])
def test_real_tables_are_read_whole(shared_data, petal):
    """Every row: net angles by hand from steps, times and pauses as the file adds them up."""
    (path,) = (shared_data / "desi" / "move_tables").glob(f"hwtables_ptlid{petal}*.csv")
    tables = read_tables(path, path.read_bytes())
    assert (len(tables), sum(len(t.time) for t in tables)) == {"04": (453, 3869), "07": (431, 3710)}[petal]
    totals = {row.split(",")[6]: float(row.split(",")[-2]) for row in _unquoted(path)}
    gear = (46 / 14 + 1) ** 4
    for table in tables:
        assert abs(table.begins[-1] - totals[table.posid]) <= 0.0005 * len(table.pause)  # pauses are in whole ms
        motor = np.where(table.cruise, 3.3 * np.abs(table.steps) + 2 * 673.2, 0.1 * np.abs(table.steps))
        turns = -np.sign(table.steps) * motor / gear
        np.testing.assert_allclose(table.net, np.cumsum(turns, axis=0), atol=1e-9)
        for row, time in enumerate(table.time):
            longest = max(turn.times[-1] for turn in table.turns(row))
            assert -1e-9 <= time - longest <= 0.0014  # cruise is booked 1.3 ms longer than it takes


def _unquoted(path):
    """Lines of a CSV file, commas within quotes taken out."""
    for line in path.read_text().splitlines()[1:]:
        yield "".join(part.replace(",", ";") if k % 2 else part for k, part in enumerate(line.split('"')))


def test_real_rows_are_written_as_they_were_sent(shared_data):
    """Each row's turns, written again, have the steps, modes and time that were sent."""
    count = 0
    for path in sorted((shared_data / "desi" / "move_tables").glob("*.csv")):
        for table in read_tables(path, path.read_bytes()):
            for row, time in enumerate(table.time):
                made = [
                    turned(turn.angles[-1], not table.cruise[row, k])
                    for k, turn in enumerate(table.turns(row))
                    if len(turn.times) > 1
                ]
                assert [m.steps for m in made] == [s for s in table.steps[row] if s]
                assert max((m.time for m in made), default=0.0) == pytest.approx(time, abs=1e-9)
                count += len(made)
    assert count == 5815


def test_ramps_are_as_the_motor_runs_them():
    """33 increments of 12 ticks: 0.1, 0.2, ... 3.3 deg of the motor a tick, and back."""
    speeds = np.concatenate(
        [np.repeat(np.arange(1, 34) * 0.1, 12), np.full(500, 3.3), np.repeat(np.arange(33, 0, -1) * 0.1, 12)]
    )
    place = -np.concatenate([[0.0], np.cumsum(speeds)]) / (46 / 14 + 1) ** 4
    turn = axis_turn(500, True, False)
    said = np.interp(np.arange(len(place)) / 18000, turn.times, turn.angles)
    assert abs(said[-1] - place[-1]) < 1e-9
    assert turn.times[-1] == pytest.approx((500 + 2 * 396) / 18000)
    assert 0.3 * turn.error < np.abs(said - place).max() <= turn.error


def test_short_turns_wait_for_more_or_for_the_tail():
    """2 deg would creep for 0.75 s: theta takes them along later, phi leaves them to the tail."""
    times = np.array([0.0, 0.1, 0.45])
    moves, rest = moves_of(times, np.array([[0.0, 0.0], [2.0, 0.0], [60.0, 3.0]]), False)
    assert [round(move.turn[0], 9) for move in moves] == [0.0, 60.0]  # after a pause
    assert [move.turn[1] for move in moves] == [0.0, 0.0]
    assert rest == (0.0, 3.0)
    rows = rows_of(moves, rest=rest)
    assert rows[-2].steps[1] == 0 or rows[-2].mode[1] == "creep"
    table = table_of(rows)
    np.testing.assert_allclose(table.net[-1], [60.0, 3.0], atol=2e-4)


def test_pieces_slower_than_cruise_become_several_rows():
    """60 and 30 deg in a second: the time has room for rows in which both axes cruise."""
    moves, _ = moves_of(np.array([0.5, 1.5]), np.array([[0.0, 0.0], [60.0, 30.0]]), False)
    assert moves[0] == Move((0.0, 0.0), 500)
    assert len(moves) == 1 + 4
    assert all(move.turn == pytest.approx((15.0, 7.5)) for move in moves[1:])
    rows = rows_of(moves, tail=False)
    assert sum(row.time + row.pause / 1000 for row in rows[:-1]) == pytest.approx(1.5 - 1 / 4, abs=0.001)


SPEED = np.radians(59_400 / (46 / 14 + 1) ** 4)


@pytest.fixture(scope="module")
def seven():
    """Seven arms of DESI's size; between the tail and the ranges there is room."""
    plane = fp.FocalPlane.hexagonal(1, 10.4, (3.0, 3.0), 1.0, 0.8 * SPEED, lower=(-3.2, 0.0), upper=(3.2, 3.2))
    return plane.replace(aliases=tuple(f"M{5000 + i:05d}" for i in range(plane.n)))


def by_hand(plane, knots):
    """A plan of knots (time [s], theta, phi [deg]) by positioner; the others rest folded."""
    rows = [(i, *row) for i in range(plane.n) for row in knots.get(plane.ids[i], [(0.0, 0.0, 180.0)])]
    owner, times, theta, phi = np.array(rows, float).T
    motion = fp.Trajectory.from_knots(owner.astype(int), times, np.radians(np.stack([theta, phi], axis=1)), plane.n)
    problem = fp.Problem(plane, motion.start, motion.end)
    return fp.Plan(problem, motion, (fp.Outcome.ARRIVED,) * plane.n, "by hand")


def fast(plane):
    """The same with the speed that the motors have."""
    return plane.replace(max_speed=np.full((plane.n, 2), SPEED))


def test_what_is_written_is_executed_to_the_goal(tmp_path, seven):
    """Ends within a micron; starts at the start; nobody is faster than cruise; those at rest have no table."""
    plan = by_hand(fast(seven), {"R0C2": [(0, 0, 180), (1, 120, 150)], "R0C3": [(0.25, 0, 170), (0.75, -50, 120)]})
    done = desi.write(plan, tmp_path / "t.csv")
    executed = desi.read(tmp_path / "t.csv", plan.problem.plane, plan.state_at(0.0))
    assert done.certificate.ok
    assert done.certificate.violations == ()
    away = plan.problem.plane.fibers(executed.trajectory.end) - plan.problem.plane.fibers(plan.trajectory.end)
    assert np.abs(away).max() < 1e-3
    assert done.facts["tables"] == 2
    (line,) = [row for row in (tmp_path / "t.csv").read_text().splitlines() if "M05002" in row or "M05003" in row][:1]
    assert line.startswith(",50")  # no bus is known without a calibration
    assert desi.accepts(tmp_path / "t.csv", (tmp_path / "t.csv").read_bytes())


def two_of(plane):
    """R0C2 and R0C3 alone."""
    return fast(plane).subset(np.array([plane.index["R0C2"], plane.index["R0C3"]]))


@pytest.fixture(scope="module")
def beside(seven):
    """How far phi of R0C2 may unfold towards R0C3, who stands at (180, 150) deg, with 0.08 mm to spare."""
    plane = two_of(seven)
    phi = np.arange(10.0, 120.0, 0.25)
    gaps = [plane.clearance(np.radians([[0.0, p], [180.0, 150.0]])).min() for p in phi]
    first = phi[np.flatnonzero(np.array(gaps) > 0.08)[0]]  # smaller phi touches
    assert 11 < first < 119
    return float(first)


BELOW, WALL = (-40.0, 114.0), (150.0, 20.0)
"""Of R0C2 and R0C3 [deg], 0.025 mm apart; where R0C2 turns back by 3 deg, phi alone or theta, too, it touches."""


@pytest.mark.large
def test_the_tail_is_swept(tmp_path, seven):
    """Clear along the plan, and touching three degrees before the goal in the tail, whichever way it comes."""
    plan = by_hand(two_of(seven), {"R0C2": [(0, -40, 180), (1, *BELOW)], "R0C3": [(0, *WALL)]})
    assert plan.certificate.ok
    with pytest.raises(UnprovenError, match=r"t\.csv: not written: .* R0C2 and R0C3 at"):
        desi.write(plan, tmp_path / "t.csv")
    assert not list(tmp_path.iterdir())
    assert desi.write(plan, tmp_path / "t.csv", tail=False, allowance=0.0).certificate.ok


def test_who_would_meet_goes_another_way(tmp_path, seven, beside):
    """If R0C3 moves, too, it can come when the tail of R0C2 is over."""
    plan = by_hand(two_of(seven), {"R0C2": [(0, 0, 180), (1, 0, beside)], "R0C3": [(0, 180, 180), (1, 180, 150)]})
    assert plan.certificate.ok
    done = desi.write(plan, tmp_path / "t.csv")
    assert done.certificate.ok
    assert done.facts["other ways than planned"] >= 1
    np.testing.assert_allclose(
        plan.problem.plane.fibers(done.executed.trajectory.end),
        plan.problem.plane.fibers(plan.trajectory.end),
        atol=1e-3,
    )


@pytest.mark.large
def test_who_waits_for_a_tail_waits_no_longer_than_that(tmp_path, seven):
    """Both need all of the time, and cannot end together; whoever ends last would meet it 60 ms sooner."""
    plan = by_hand(fast(seven), {"R0C2": [(0, 145, 180), (1, -15, 46)], "R0C3": [(0, 4, 180), (1, 164, 109)]})
    planned = tables(plan, {}, {}, True)
    made = scheduled(plan, planned, True, 0.0)
    assert max(map(seconds_of, made)) > max(map(seconds_of, planned)) + SPARE
    last = max(range(len(made)), key=lambda k: seconds_of(made[k]))
    pauses = [row.pause for row in made[last].rows]
    k = int(np.argmax(pauses))
    rows = list(made[last].rows)
    for sooner, safe in ((0, True), (60, False)):
        rows[k] = rows[k]._replace(pause=pauses[k] - sooner)
        made[last] = made[last]._replace(rows=tuple(rows))
        executed = desi.decode(tmp_path, as_csv(made), plan.problem.plane, plan.state_at(0.0), frozenset())
        assert desi.prove(plan.problem.plane, executed, 0.0).ok == safe


def seconds_of(table):
    return seconds(table.rows)


def test_who_turns_aside_by_less_than_a_row_has_no_table(tmp_path, seven):
    """Nor does one without neighbours who is late trouble anybody."""
    plan = by_hand(
        fast(seven), {"R0C2": [(0, 0, 180), (1, 120, 150)], "R0C3": [(0, 0, 180), (0.1, 3, 180), (0.2, 0, 180)]}
    )
    assert desi.write(plan, tmp_path / "t.csv").facts["tables"] == 1
    lone = fp.FocalPlane.hexagonal(0, 10.4, (3.0, 3.0), 1.0, 10 * SPEED).replace(aliases=("M00001",))
    plan = by_hand(lone, {"R0C1": [(0, 0, 180), (1, 0, 180), (1.1, 120, 150)]})
    assert desi.write(plan, tmp_path / "l.csv").certificate.ok


def test_the_last_way_follows_short_pieces_in_creep(seven):
    """3 deg of theta before phi unfolds: other rows would leave them to the tail, and pass 3 deg beside the plan."""
    knots = {"R0C2": [(0, 0, 180), (0.5, 3, 180), (1, 3, 110), (1.5, 0, 110)]}
    plan = by_hand(fast(seven), knots)
    moves = creeping_moves(plan, seven.index["R0C2"])
    turns = [(3.0, 0.0), (0.0, -35.0), (0.0, -35.0), (-3.0, 0.0)]
    assert [move.turn for move in moves] == [pytest.approx(turn) for turn in turns]
    assert rows_of(moves)[0].mode == ("creep", "creep")


def test_goals_whose_tails_have_no_room_are_given_up(seven):
    """Phi less than 3 deg above its range, or beside one that rests; another configuration is taken if there is one."""
    plane = fast(seven)
    i, j = plane.index["R0C2"], plane.index["R0C3"]
    start, goal = plane.folded.copy(), np.full((plane.n, 2), np.nan)
    start[j], goal[i] = np.radians(WALL), np.radians(BELOW)
    goal[0] = np.radians([180.0, 2.0])
    problem = fp.Problem(plane, start, goal, conflicts="drop")
    made = desi.with_goals(problem)
    assert sorted(made.dropped) == [0, i]
    assert made.dropped[0].cause == "the tail of its move has no room in its ranges"
    assert made.dropped[i].cause == "the tail of its move has no room: R0C3"
    assert made.dropped[i].blockers == (j,)
    assert desi.with_goals(problem, tail=False) is problem
    with pytest.raises(ProblemError, match="goal: positioner 'R-1C1': the tail of its move has no room"):
        desi.with_goals(fp.Problem(plane, start, goal))
    other = np.full((plane.n, 1, 2), np.nan)
    other[0, 0] = np.radians([180.0, 170.0])
    kept = desi.with_goals(fp.Problem(plane, start, goal, conflicts="drop", alternatives=other))
    assert sorted(kept.dropped) == [i]
    np.testing.assert_array_equal(kept.goal[0], other[0, 0])


def test_who_has_no_device_id_is_named(tmp_path, seven):
    plan = by_hand(seven.replace(aliases=()), {"R0C2": [(0, 0, 180), (1, 20, 180)]})
    with pytest.raises(PlanError, match="positioner 'R0C2' has no device id"):
        desi.write(plan, tmp_path / "t.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("posid", "pid", "no column 'posid'"),
        ("M05003", "M09999", "line 2: hexagonal has no positioner 'M09999'"),
        ("'cruise'", "'crawl'", "line 2: speed_mode_P has 'crawl', neither cruise nor creep"),
        ("[0, 10121", "[0.5, 10121", "line 2: motor_steps_P has 0.5"),
        ("[0, 10121", "[10121", "line 2: rows differ in number"),
        ("[0, 10121", "[0) 10121", "line 2: motor_steps_P is '.*', expected a list"),
    ],
)
def test_bad_tables_are_one_line(tmp_path, seven, before, after, says):
    steps, modes = "[0, 10121, -10121]", "['creep', 'creep', 'creep']"
    cells = [",5003", f'"{steps}"', '"[-614, -10121, 10111]"', '"[0.079, 1.125, 1.123]"', "3", "M05003", '"[0, 0, 0]"']
    cells += ["True", f'"{modes}"', "\"['cruise', 'creep', 'creep']\"", "2.3", "False"]
    heads = "busid,canid,motor_steps_P,motor_steps_T,move_time,nrows,posid,postpause,required"
    text = f"{heads},speed_mode_P,speed_mode_T,total_time,failed_to_send\n{','.join(cells)}\n"
    (tmp_path / "t.csv").write_text(text)
    assert desi.read(tmp_path / "t.csv", seven).trajectory.duration == pytest.approx(2.327, abs=0.002)
    assert before in text
    where = text.rindex(before) if before.startswith("'") else text.index(before)
    if before == "'cruise'":
        text = text.replace("['creep', 'creep', 'creep']", "['crawl', 'creep', 'creep']")
    else:
        text = text[:where] + after + text[where + len(before) :]
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(TrajectoryError, match=says) as caught:
        desi.read(tmp_path / "t.csv", seven)
    assert "\n" not in str(caught.value)


def test_a_real_petal_knows_its_buses_and_linear_motors(shared_data):
    motors = desi.motors_of(shared_data / "desi")
    assert motors.buses["M05826"] == (5826, "can30")
    assert len(motors.linear) == 316
