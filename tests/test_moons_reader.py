from itertools import pairwise

import numpy as np
import pytest

from fiberplan.errors import InstrumentError, TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.instruments.moons_zones import INSET
from fiberplan.problem import Problem, Targets

pytestmark = pytest.mark.small

COMMON = {
    "LENGTH1": 8, "LENGTH2": 17, "WIDTH1": 8, "WIDTH2": 4, "LOW1": -180, "HIGH1": 180, "LOW2": -180, "HIGH2": 150,
    "MINDIST": 4, "B1": 5.25, "TB2": 2, "TB3": 8.25, "TW1": 4, "TW2": 3, "DL": 8, "DW": 4, "SAFETY": 0.5,
}  # fmt: skip
PITCH = 25.2587
BASES = {"2": (PITCH, 30.0), "3": (PITCH, 90.0), "5": (PITCH, 150.0)}  # r [mm], theta [deg]


def paf(orient=0.0, **changes):
    """Lines of a made-up file: three positioners round one camera."""
    lines = ["# made up", "PAF.HDR.START;  # a mark", 'PAF.TYPE "Configuration";', "PAF.HDR.END;", " "]
    lines += [f"INS.POS.{key} {value:.3f};  # mm or deg" for key, value in COMMON.items()]
    lines += ["INS.ACQ1.RFOCAL 0.0;", "INS.ACQ1.THFOCAL 90.0;", "INS.ACQ1.FOV 40.0;"]
    for k, (r, theta) in BASES.items():
        lines += [f"INS.POS{k}.RFOCAL {r};", f"INS.POS{k}.THFOCAL {theta};", f"INS.POS{k}.ORIENT {orient};"]
        lines += [f'INS.POS{k}.SIM "F";', f'INS.POS{k}.LOCK "F"; # (T=ok/F=locked)']
        lines += [f"INS.FIBRE{k}.RFOCAL 22.17372;", f"INS.FIBRE{k}.THFOCAL 9.42045;", f'INS.FIBRE{k}.HEALTH "T";']
    for key, value in changes.items():
        name = key.replace("_", ".")
        lines = [f"{name} {value};" if line.startswith(name + " ") else line for line in lines]
    return lines


def write(folder, lines, name="positioners.cfg"):
    path = folder / name
    path.write_text("\n".join(lines) + "\n")
    return path


def field(folder, rows, name="targets_1.txt"):
    return write(folder, ["\t\t".join(str(cell) for cell in row) for row in rows], name)


def rows():
    """Two targets and one positioner without."""
    return [
        [PITCH, 30, 39.5168, 10.0133, 0, 1, 2],
        [PITCH, 90, 42.1291, 78.6821, 1, 0, 1],
        [PITCH, 150, 1000000, 0, 0, 0, 0],
    ]


def test_datum_and_convention(tmp_path):
    plane = FocalPlane.load(write(tmp_path, paf()))
    assert plane.ids == ("2", "3", "5")
    np.testing.assert_allclose(plane.base[0], PITCH * np.array([0.5, np.sqrt(0.75)]))
    np.testing.assert_array_equal(plane.folded, 0.0)
    theta = np.radians(9.42045)  # the file says where the fibre of a positioner at its datum is
    datum = 22.17372 * np.array([np.sin(theta), np.cos(theta)])
    np.testing.assert_allclose(plane.fibers(plane.folded)[0], datum, atol=1e-3)
    np.testing.assert_allclose(np.degrees(plane.lower[0]), [-180, -180])
    np.testing.assert_allclose(np.degrees(plane.upper[0]), [180, 150])
    np.testing.assert_allclose(np.degrees(plane.max_speed[0]), [16.68, 22.5])
    turned = FocalPlane.load(write(tmp_path, paf(orient=90.0)))
    np.testing.assert_allclose(turned.fibers(turned.folded)[0], turned.base[0] - [0.0, 9.0], atol=1e-9)


def test_zones_and_what_they_meet(tmp_path):
    """Two arms side by side: each kind of zone in turn, as far apart as its padding says."""
    plane = FocalPlane.load(write(tmp_path, paf()))
    bodies = {body.name: body for body in plane.bodies}
    assert {name: body.meets for name, body in bodies.items() if name != "snag"} == {
        name: (name,) for name in ("holder", "metrology", "low", "middle", "high", "foot")
    }
    assert bodies["snag"].meets == ("holder",)
    assert bodies["holder"].radius == 2.5
    ends = [bodies[name].points[:, 0] for name in ("low", "middle", "high")]
    begin = np.sqrt(4.5**2 - 2**2)
    assert ends[0].min() == pytest.approx(begin - 0.5 + INSET)
    assert ends[2].max() == pytest.approx(17 - 6.5 + 0.5 - INSET)
    for a, b in pairwise(ends):
        assert a.max() - b.min() == pytest.approx(1.0 - 2 * INSET)  # both are padded at the cut between them
    for name, (low, high) in {"metrology": (11.25, 17.5), "foot": (-0.5, 8.5)}.items():
        corners = np.array([[low, -2.5], [high, -2.5], [high, 2.5], [low, 2.5]])
        inside = np.abs(corners - bodies[name].points)
        assert np.all(np.hypot(*inside.T) <= bodies[name].radius + 1e-12)  # contains the sharp corners
        assert bodies[name].radius - INSET < 0.005
    pair = plane.replace(ids=("a", "b"), base=np.array([[0.0, 0.0], [0.0, 5.02]]), **two(plane))
    for name in ("holder", "metrology", "foot", "low"):
        alone = pair.replace(bodies=(bodies[name],))
        assert alone.clearance(np.zeros((2, 2)))[0] == pytest.approx(0.02, abs=0.01), name
    beside = pair.replace(bodies=(bodies["snag"], bodies["holder"]), base=np.array([[0.0, 0.0], [6.0, 3.6]]))
    slope = np.arctan(1.5 / 8.25)  # of the triangle's side, from its tip 4.5 mm right of the base; a fiber at (-3, 3.6)
    gap = 3.6 * np.cos(slope) - 7.5 * np.sin(slope) - 0.5 - 2.5
    assert beside.clearance(np.zeros((2, 2)))[0] == pytest.approx(gap)
    assert beside.replace(bodies=(bodies["holder"],)).clearance(np.zeros((2, 2)))[0] == pytest.approx(
        np.hypot(6, 3.6) - 5
    )


def two(plane):
    """Fields of the first two positioners."""
    names = ("length", "folded", "lower", "upper", "max_speed", "zero", "online")
    return {name: getattr(plane, name)[:2] for name in names} | {"fiber_offsets": {"fiber": plane.fiber[:2]}}


def test_cameras_are_shown_and_touch_nothing(tmp_path):
    plane = FocalPlane.load(write(tmp_path, paf()))
    (camera,) = plane.obstacles
    assert camera.meets == ()
    assert any("cameras" in text and "touch nothing" in text for text in plane.assumptions)
    sides = np.linalg.norm(camera.points - np.roll(camera.points, 1, axis=0), axis=1)
    np.testing.assert_allclose(sides, PITCH / np.sqrt(3.0))
    toward = np.array([[np.radians(-120.0), np.pi / 6], [0.0, 0.0], [0.0, 0.0]])
    assert np.isfinite(plane.clearance(toward)).all()
    Problem(plane, plane.folded, toward)  # the first reaches over the camera


def test_locked_and_broken_are_offline(tmp_path):
    away = {"INS_FIBRE3_RFOCAL": 39.0, "INS_FIBRE3_THFOCAL": 75.0}
    plane = FocalPlane.load(write(tmp_path, paf(INS_POS3_LOCK='"T"', INS_FIBRE2_HEALTH='"F"', **away)))
    assert plane.online.tolist() == [False, False, True]
    assert any("positioner 3" in note and "locked" in note for note in plane.notes)
    assert any("positioner 2" in note and "broken" in note for note in plane.notes)
    np.testing.assert_allclose(plane.folded[[0, 2]], 0.0)
    theta = np.radians(75.0)
    where = 39.0 * np.array([np.sin(theta), np.cos(theta)])
    np.testing.assert_allclose(plane.fibers(plane.folded)[1], where, atol=1e-9)
    again = FocalPlane.load(write(tmp_path, paf(orient=70.0, INS_POS3_LOCK='"T"', **away)))
    np.testing.assert_allclose(again.fibers(again.folded)[1], where, atol=1e-9)


def test_targets_stand_where_they_should(tmp_path):
    plane = FocalPlane.load(write(tmp_path, paf()))
    targets = Targets.read(field(tmp_path, rows()))
    goal = targets.configuration(plane)
    assert np.isnan(goal[2]).all()
    np.testing.assert_allclose(plane.fibers(goal)[:2], np.stack([targets.x, targets.y], axis=1), atol=1e-6)
    theta = np.radians(10.0133)
    np.testing.assert_allclose([targets.x[0], targets.y[0]], 39.5168 * np.array([np.sin(theta), np.cos(theta)]))
    bend = goal + plane.zero  # beta measured from the alpha link: positive is the right elbow
    assert np.sin(bend[0, 1]) < 0 < np.sin(bend[1, 1])
    np.testing.assert_array_equal(targets.priority, [2, 1])
    shuffled = Targets.read(field(tmp_path, rows()[::-1]))  # rows name positioners by their places
    np.testing.assert_array_equal(shuffled.configuration(plane), goal)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: [*rows, [60.0, 30, 70.0, 30, 1, 0, 1]], ["line 4", "no positioner at"]),  # more than there are
        (lambda rows: [*rows, rows[1]], ["line 4", "'3'", "already"]),
        (lambda rows: rows[:2], ["2 rows", "3 positioners", "'5'", "truncated"]),
        (lambda rows: [*rows[:2], rows[2][:4]], ["line 3", "4 values", "expected 7"]),
        (lambda rows: [rows[0][:5], *rows[1:]], ["line 1", "5 values"]),
        (lambda rows: [rows[0], [PITCH, 90, "nan", 78.0, 1, 0, 1], rows[2]], ["line 2", "target r", "nan"]),
        (lambda rows: [rows[0], [PITCH, 90, "4x", 78.0, 1, 0, 1], rows[2]], ["line 2", "target r", "'4x'"]),
        (lambda rows: [[PITCH, 30, -3, 78.0, 1, 0, 1], *rows[1:]], ["line 1", "target r is -3"]),
        (lambda rows: [[PITCH, 30, 39.5, 10.0, 2, 0, 1], *rows[1:]], ["line 1", "right is 2"]),
        (lambda rows: [[PITCH, 30, 39.5, 10.0, 0, 0, 1], *rows[1:]], ["line 1", "neither elbow"]),
        (lambda rows: [[PITCH, 30, 139.5, 10.0, 0, 1, 1], *rows[1:]], ["line 1", "out of reach", "'2'"]),
    ],
)
def test_bad_targets(tmp_path, change, words):
    plane, path = FocalPlane.load(write(tmp_path, paf())), field(tmp_path, change(rows()))
    with pytest.raises(TargetError) as caught:
        Targets.read(path).configuration(plane)
    message = str(caught.value)
    assert all(word in message for word in [str(path), *words]), message
    assert "\n" not in message


def test_text_tables_with_headings_are_read_as_before(tmp_path):
    path = write(tmp_path, ["positioner x y", "3 40.0 10.0"], "field.txt")
    assert Targets.read(path).positioner == ("3",)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda lines: [*lines[:9], "INS.POS.LOW1 -180"], ["line 10", "no ';'"]),
        (lambda lines: [*lines[:9], "-180.0;", *lines[9:]], ["line 10", "KEYWORD value"]),
        (lambda lines: [*lines, lines[20]], [f"line {len(paf()) + 1}", "already given in line 21"]),
        (lambda lines: [line.replace("LENGTH1 8.000", "LENGTH1 8,000") for line in lines], ["line 6", "'8,000'"]),
        (lambda lines: [line.replace("SAFETY 0.500", "SAFETY nan") for line in lines], ["SAFETY is nan"]),
        (lambda lines: [line.replace("WIDTH2 4.000", "WIDTH2 -4") for line in lines], ["WIDTH2 is -4"]),
        (lambda lines: [line.replace("WIDTH2 4.000", "WIDTH2 40") for line in lines], ["line 7", "no room"]),
        (lambda lines: [line for line in lines if "LENGTH2" not in line], ["no keyword INS.POS.LENGTH2"]),
        (lambda lines: [line for line in lines if "POS3.THFOCAL" not in line], ["no keyword INS.POS3.THFOCAL"]),
        (lambda lines: [line.replace('LOCK "F"', 'LOCK "X"') for line in lines], ["LOCK", "'X'", "T or F"]),
        (lambda lines: [line.replace("LOW2 -180", "LOW2 10") for line in lines], ["LOW2", "out of range"]),
        (lambda lines: [line for line in lines if "POS2" not in line and "POS3" not in line and "POS5" not in line],
         ["no positioners"]),
    ],
)  # fmt: skip
def test_bad_parameter_files(tmp_path, change, words):
    path = write(tmp_path, change(paf()))
    with pytest.raises(InstrumentError) as caught:
        FocalPlane.load(path)
    message = str(caught.value)
    assert all(word in message for word in [str(path), *words]), message
    assert "\n" not in message


def test_a_locked_fibre_out_of_reach_is_refused(tmp_path):
    path = write(tmp_path, paf(INS_POS3_LOCK='"T"', INS_FIBRE3_RFOCAL=139.0))
    with pytest.raises(InstrumentError, match=r"line \d+: INS.FIBRE3.RFOCAL is .* out of its reach"):
        FocalPlane.load(path)


@pytest.mark.parametrize("size", [10, 30, 60, 120, 250, 500, 1006])
def test_real_cases(shared_data, size):
    folder = shared_data / "moons" / str(size)
    plane = FocalPlane.load(folder / "positioners.cfg")
    assert plane.online.all()
    assert len(plane.obstacles) == 18
    for k in (1, 2, 3):
        targets = Targets.read(folder / f"targets_{k}.txt")
        problem = Problem.from_targets(plane, targets, conflicts="drop")
        who = targets.indices(plane)
        goal = targets.configuration(plane)
        np.testing.assert_allclose(plane.fibers(goal)[who], np.stack([targets.x, targets.y], axis=1), atol=1e-6)
        assert (np.sign(np.sin((goal + plane.zero)[who, 1])) == targets.parity).all()
        assert len(problem.dropped) <= 0.04 * len(targets)


def test_holders_metrology_and_feet_of_real_goals_just_clear(shared_data):
    """What the prototype checked when it chose its targets must not touch; so it tells the shape."""
    for k, closest in ((1, 5.0147), (2, 5.0475), (3, 5.332)):
        folder = shared_data / "moons" / "1006"
        plane = FocalPlane.load(folder / "positioners.cfg")
        goal = Targets.read(folder / f"targets_{k}.txt").configuration(plane)
        gaps = {}
        for body in plane.bodies[:-1]:
            gaps[body.name] = np.nanmin(plane.replace(bodies=(body,)).clearance(goal))
        assert gaps["holder"] == pytest.approx(closest - 5.0, abs=1e-4)
        assert all(0 < gaps[name] < 0.2 for name in ("metrology", "foot"))
        contacts = {plane.ids[i] for i in Problem(plane, plane.folded, goal, conflicts="drop").dropped}
        assert len(contacts) == {1: 15, 2: 14, 3: 9}[k]  # snag triangles, and a pair of arms in each


def test_the_case_of_two_names_other_positioners(shared_data):
    folder = shared_data / "moons" / "2"
    with pytest.raises(TargetError, match=r"line 1: .* no positioner at x -25\.257"):
        Targets.read(folder / "targets_2.txt").configuration(FocalPlane.load(folder / "positioners.cfg"))


def test_built_in_zones_are_those_of_the_file(tmp_path):
    built_in, read = FocalPlane.load("moons"), FocalPlane.load(write(tmp_path, paf()))
    for ours, theirs in zip(built_in.bodies, read.bodies, strict=True):
        np.testing.assert_allclose(ours.points, theirs.points, atol=1e-9)
        assert ours.radius == pytest.approx(float(theirs.radius))
        assert (ours.category, ours.meets, ours.closed) == (theirs.category, theirs.meets, theirs.closed)
    for name in ("folded", "lower", "upper", "max_speed", "zero"):
        np.testing.assert_allclose(getattr(built_in, name)[0], getattr(read, name)[0])


def test_round_trip_through_tables(tmp_path):
    plane = FocalPlane.load(write(tmp_path, paf()))
    plane.write(tmp_path / "plane.fits")
    again = FocalPlane.load(tmp_path / "plane.fits")
    goal = np.array([[0.3, 0.2], [0.1, 0.4], [2.0, -1.0]])
    np.testing.assert_array_equal(plane.clearance(goal), again.clearance(goal))
    assert again.obstacles[0].meets == ()


NEWER = {
    "B1": 5.5, "B2": 1.25, "B3": 6, "B4": 4, "TB2": 1.5, "W3": 2.75, "W4": 5, "D1": 8.7, "D2": 2, "DW": 4,
    "DEF1": 0, "DEF2": 0, "SLOW1": 0.6, "FAST1": 2, "CHANGE1": 0.4, "SLOW2": 0.8, "FAST2": 3, "CHANGE2": 0.4,
}  # fmt: skip


def newer(without=(), **more):
    """Lines of a made-up file of the newer form: two positioners."""
    kept = {k: COMMON[k] for k in COMMON if k not in ("B1", "TB2", "TB3", "TW1", "TW2", "DL", "DW")}
    values = {k: v for k, v in (kept | NEWER | more).items() if k not in without}
    lines = ["PAF.HDR.START;", *(f"INS.POS.{key} {value:.3f};" for key, value in values.items())]
    for k, theta in (("7", 30.0), ("8", 90.0)):
        lines += [f"INS.POS{k}.RFOCAL {PITCH};", f"INS.POS{k}.THFOCAL {theta};", f"INS.POS{k}.ORIENT 0.0;"]
        lines += [f'INS.POS{k}.LOCK "F";', f'INS.FIBRE{k}.HEALTH "T";']
    return lines


def test_the_newer_form(tmp_path):
    plane = FocalPlane.load(write(tmp_path, newer()))
    assert plane.online.all()
    np.testing.assert_allclose(np.degrees(plane.max_speed), [[12, 18], [12, 18]])  # FAST, 2 and 3 rpm
    np.testing.assert_allclose(np.degrees(plane.min_speed), [[3.6, 4.8], [3.6, 4.8]])  # SLOW
    assert FocalPlane.load(write(tmp_path, newer(without=("SLOW1", "SLOW2")))).min_speed is None
    with pytest.raises(InstrumentError, match=r"SLOW2 is above the largest speed, 3 rpm"):
        FocalPlane.load(write(tmp_path, newer(SLOW2=3.5)))
    assert any("CHANGE" in text for text in plane.assumptions)
    older = FocalPlane.load(write(tmp_path, paf()))
    assert any("no SLOW" in text for text in older.assumptions)
    assert any("as large as" in text for text in plane.assumptions)
    bodies = {body.name: body.points for body in plane.bodies}
    pad = 0.5 - INSET
    for name, (begin, end, width) in {"metrology": (11.5, 18.25, 5), "foot": (-2, 8.7, 4)}.items():
        low, high = [begin - pad, -width / 2 - pad], [end + pad, width / 2 + pad]
        np.testing.assert_allclose([bodies[name].min(axis=0), bodies[name].max(axis=0)], [low, high])
    np.testing.assert_allclose(bodies["snag"], [[11.5, -1.375], [11.5, 1.375], [5.5, 0]])
    assert bodies["low"][:, 0].min() == pytest.approx(4 - pad)  # no arm over B4
    elsewhere = FocalPlane.load(write(tmp_path, newer(DEF2=20)))
    np.testing.assert_allclose(np.degrees(elsewhere.folded), [[0, 20]] * 2)


@pytest.mark.parametrize(
    ("rows", "name"),
    [
        ([[7, 42, 18, "R", 1], [8, 30, 110, "L", 3]], "number"),
        ([[PITCH, 30, 42, 18, "R", 1], [PITCH, 90, 30, 110, "L", 3]], "place"),
    ],
)
def test_fields_of_the_newer_form(tmp_path, rows, name):
    plane = FocalPlane.load(write(tmp_path, newer()))
    targets = Targets.read(field(tmp_path, rows, f"field-by-{name}.txt"))
    problem = Problem.from_targets(plane, targets)
    np.testing.assert_allclose(np.degrees(problem.goal), [[19.470, -84.438], [56.552, 28.463]], atol=1e-3)
    np.testing.assert_array_equal(problem.priority, [1, 3])


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([[7, 42, 18, "R", 1], [8, 30, 110, "X", 3]], ["line 2", "elbow is 'X'"]),
        ([[7, 42, 18, "R", 1], [8, 30, 110, "L"]], ["line 2", "4 values", "expected 5"]),
        ([[7, 42, 18, "R", 1], [9, 30, 110, "L", 3]], ["line 2", "no positioner '9'"]),
        ([[7, 42, 18, "R", 1], [7, 30, 110, "L", 3]], ["line 2", "'7'", "already"]),
        ([[7, 42, 18, "R", 1], [8, "far", 110, "L", 3]], ["line 2", "target r is 'far'"]),
    ],
)
def test_bad_fields_of_the_newer_form(tmp_path, rows, words):
    plane = FocalPlane.load(write(tmp_path, newer()))
    with pytest.raises(TargetError) as caught:
        Targets.read(field(tmp_path, rows)).configuration(plane)
    message = str(caught.value)
    assert all(word in message for word in words), message


@pytest.mark.parametrize(
    ("lines", "words", "absent"),
    [
        (newer(without=("W3", "D2")), ["no keyword INS.POS.W3, INS.POS.D2"], "TB3"),
        (newer(without=("D1", "D2"), DL=8), ["INS.POS.TB3, INS.POS.TW2", "INS.POS.D1, INS.POS.D2"], "did you mean"),
        (newer(without=("B2", "B3", "B4", "W3", "W4", "D1", "D2")), ["neither is whole"], "did you mean"),
        (newer(B4=12), ["INS.POS.B4 is 12", "no room"], "TB3"),
        (newer(FAST1=0), ["INS.POS.FAST1 is 0"], "TB3"),
        (newer(DEF2=160), ["INS.POS.HIGH2", "datum at 160 deg"], "TB3"),
    ],
)
def test_bad_files_of_the_newer_form(tmp_path, lines, words, absent):
    with pytest.raises(InstrumentError) as caught:
        FocalPlane.load(write(tmp_path, lines))
    message = str(caught.value)
    assert all(word in message for word in words), message
    assert absent not in message
    assert "\n" not in message
