"""Tables as people have them: packed, separated by anything, of any case, with cells and rows that are empty."""

import gzip

import numpy as np
import pytest
from astropy.io import fits
from astropy.table import Table

from fiberplan.errors import TargetError
from fiberplan.problem import Problem, Targets
from fiberplan.tables.wording import nearest

pytestmark = pytest.mark.small

ROWS = [("R0C2", 3.5, 10.25), ("R0C3", 22.0, -9.0)]


def lines(mark, head=("positioner", "x", "y")):
    return "\n".join(mark.join(map(str, row)) for row in (head, *ROWS)) + "\n"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.csv", lines(",").encode()),
        ("a.csv", lines(";").encode()),
        ("a.csv", lines("\t").encode()),
        ("a.tsv", lines("\t").encode()),
        ("a.txt", lines(";").encode()),
        ("a.dat", b"\xef\xbb\xbf" + lines(" ").encode()),
        ("a.csv", b"\xef\xbb\xbf" + lines(";").encode()),
        ("a.csv", lines(",", ("Positioner", "X [millimeters]", "Y [millimetres]")).encode()),
        ("a.csv.gz", gzip.compress(lines(",").encode(), mtime=0)),
        ("a.txt.gz", gzip.compress(lines("\t").encode(), mtime=0)),
    ],
)
def test_text_tables(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    targets = Targets.read(tmp_path / name)
    assert targets.positioner == ("R0C2", "R0C3")
    np.testing.assert_array_equal(targets.x, [3.5, 22.0])
    np.testing.assert_array_equal(targets.y, [10.25, -9.0])


@pytest.mark.parametrize("name", ["a.fits", "a.fits.gz"])
def test_fits_takes_the_first_table_that_has_the_columns(tmp_path, name):
    other = fits.table_to_hdu(Table({"ra": [1.0, 2.0], "x": [0.0, 0.0]}))
    good = fits.table_to_hdu(
        Table(dict(zip(("POSITIONER", "X", "Y"), map(list, zip(*ROWS, strict=True)), strict=True)))
    )
    fits.HDUList([fits.PrimaryHDU(), other, good]).writeto(tmp_path / name)
    targets = Targets.read(tmp_path / name)
    assert targets.positioner == ("R0C2", "R0C3")
    np.testing.assert_array_equal(targets.x, [3.5, 22.0])


def test_angles_in_degrees_and_damaged_packing(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("positioner,Alpha [degrees],Beta [Degree]\nR0C2,90,180\n")
    np.testing.assert_allclose(Targets.read(path).angles, [[np.pi / 2, np.pi]])
    packed = tmp_path / "b.csv.gz"
    packed.write_bytes(gzip.compress(lines(",").encode(), mtime=0)[:-12])
    with pytest.raises(TargetError, match="is truncated: it ends before"):
        Targets.read(packed)


FIELD = "positioner,x,y\nR0C2,3.5,10.25\nR0C3,nan,nan\n-1,-80.1,2.2\n,-60,2\nR0C4,,--\nR0C1,five,4\nR+1C1,-11,22\n"


def test_rows_without_a_target_are_refused_all_at_once(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(FIELD)
    with pytest.raises(TargetError) as caught:
        Targets.read(path)
    assert str(caught.value) == (
        f"{path}: 5 of 7 rows cannot be used: line 3: x is nan and y is nan; line 4: positioner is -1; line 5: "
        "positioner is empty; line 6: x is empty and y is empty; line 7: x is 'five', not a number; "
        "--conflicts drop leaves them out"
    )


def test_rows_left_out_are_named_and_places_without_a_robot_lost(tmp_path, small_plane):
    path = tmp_path / "a.csv"
    path.write_text(FIELD)
    targets = Targets.read(path, conflicts="drop")
    assert targets.positioner == ("R0C2", "R+1C1")
    assert targets.rows == ("line 2", "line 8")
    for number, cause in ((3, "x is nan and y is nan"), (4, "positioner is -1"), (5, "positioner is empty")):
        assert any(note.startswith(f"line {number} of {path} was left out: {cause}") for note in targets.notes)
    assert [text.split(" of ")[0] for text in targets.left_out] == ["line 4", "line 5", "line 7"]
    assert Problem.from_targets(small_plane, targets, conflicts="drop").left_out == targets.left_out
    targets.write(tmp_path / "b.ecsv")
    assert Targets.read(tmp_path / "b.ecsv").left_out == targets.left_out


@pytest.mark.parametrize("conflicts", ["raise", "drop"])
def test_a_table_of_empty_rows_is_refused_in_any_case(tmp_path, conflicts):
    path = tmp_path / "a.csv"
    path.write_text("positioner,x,y\nR0C2,,\nR0C3,nan,nan\n")
    with pytest.raises(TargetError, match="2 of 2 rows cannot be used"):
        Targets.read(path, conflicts=conflicts)


def test_numbers_are_no_near_misses():
    assert not nearest("-1", ["R-9C1", "R-1C1"])
    assert not nearest("17", ["R17", "170"])
    assert nearest("r-9c2", ["R-9C1"])


def test_stretched_arms_with_three_decimals(small_plane):
    for length, bend in ((22.4, 0.0), (7.6, np.pi)):
        for degrees in np.arange(0.0, 360.0, 7.5):
            angles = small_plane.folded.copy()
            angles[3] = np.radians(degrees), bend
            x, y = np.round(small_plane.fibers(angles)[3], 3)
            solution = Targets([x], [y], ("R0C2",)).solve(small_plane)
            assert not solution.unreachable, (length, degrees)
            assert np.hypot(*(small_plane.fibers(solution.goal)[3] - [x, y])) <= 1e-3
            Problem(small_plane, small_plane.folded, np.where(np.arange(7)[:, None] == 3, solution.goal, np.nan))


def test_a_joint_that_ends_before_the_reach(small_plane):
    plane = small_plane.replace(lower=np.tile([0.0, np.radians(5.0)], (7, 1)))
    edge = plane.folded.copy()
    edge[3] = 1.0, np.radians(5.0)
    outward = plane.fibers(edge)[3] - plane.base[3]
    outward /= np.hypot(*outward)
    for excess, reachable in ((9e-4, True), (1.1e-3, False)):
        x, y = plane.fibers(edge)[3] + excess * outward
        solution = Targets([x], [y], ("R0C2",), parity=[1]).solve(plane)
        assert (3 not in solution.unreachable) == reachable
        if reachable:
            assert np.hypot(*(plane.fibers(solution.goal)[3] - [x, y])) <= 1e-3


def test_angles_out_of_range_by_rounding_are_at_its_end(small_plane):
    rounded = Targets([np.nan], [np.nan], ("R0C2",), angles=np.radians([[30.0, -1e-7]]))
    assert Problem.from_targets(small_plane, rounded).goal[3, 1] == 0.0
    wrong = Targets([np.nan], [np.nan], ("R0C2",), angles=np.radians([[30.0, 180.01]]))
    with pytest.raises(Exception, match=r"beta 180\.01 deg is outside 0 to 180 deg"):
        Problem.from_targets(small_plane, wrong)
