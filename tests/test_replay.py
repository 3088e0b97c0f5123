"""The replay accepts what is so and nothing else; every scene here is the smallest that decides."""

import ast
import copy
import gzip
import io
from pathlib import Path

import numpy as np
import pytest
from astropy.io import fits

from fiberplan.certificates import replay as replay_module
from fiberplan.certificates.replay import BadFileError, Claims
from fiberplan.certificates.replay_geometry import about, digest, geometry_fault
from fiberplan.certificates.replay_outcomes import faults, not_replayed
from fiberplan.certificates.whole_replay import replay
from fiberplan.focal_plane.bodies import Body
from fiberplan.scenes.decisive import row
from fuzz.made_false import base as base_of
from fuzz.made_false import sealed
from fuzz.mutations import BASES
from replayed import FILES, made

pytestmark = pytest.mark.small
FORMAT1 = Path(__file__).parent / "format1.fits.gz"


def base(name):
    """(tables with their formats and units, claims) of a plan whose every claim holds."""
    return base_of(FILES[name])


def changed(name, **tables):
    """Claims of a base in which some tables are others; each is given as a function that changes a copy."""
    before = base(name)[1]
    claims, copies = object.__new__(Claims), {key: table.copy() for key, table in before.tables.items()}
    for key, change in tables.items():
        copies[key] = copies[key] if (made := change(copies[key])) is None else made
    claims._take(copies)
    return claims


def judged(claims):
    """What is not shown of each pair."""
    return {pair: fault for pair in claims.pairs() if (fault := claims.judge(*pair)) is not None}


def setting(name, rows, value):
    """A change of some rows of a column."""

    def change(table):
        table[name][rows] = value

    return change


@pytest.mark.parametrize("name", ["three", "heights", "concave", "opening", "four-bar"])
def test_what_is_so_is_accepted(name):
    claims = base(name)[1]
    assert replay(claims, jobs=1).faults == ()
    assert any(shape.hollow for arm in claims.arms for shape in arm) == (name == "concave")
    assert bool(claims.opening) == (name == "opening")
    assert bool(claims.bar.size) == (name == "four-bar")


@pytest.mark.parametrize("name", ["three", "heights", "concave", "four-bar"])
def test_geometry_has_the_digest_that_verify_shows(name):
    """Made of the tables alone; of bodies that were made not to meet it is another, and that is a fault."""
    claims = base(name)[1]
    assert digest(claims) == claims.said["certificate"]["geometry"]["digest"]
    other = changed(name, BODIES=setting("meets", slice(None), b"[]"))
    assert digest(other) != digest(claims)
    assert [*geometry_fault(other)]


def test_the_checker_stands_alone_and_is_short():
    source = Path(replay_module.__file__).read_text()
    names = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Import | ast.ImportFrom)]
    modules = {(node.module or "") if isinstance(node, ast.ImportFrom) else node.names[0].name for node in names}
    assert not any(module.startswith("fiberplan") for module in modules)
    assert len(source.splitlines()) <= 300


@pytest.mark.parametrize("lost", ["all", "last", "first"])
def test_intervals_have_to_cover_the_motion(lost):
    claims = base("three")[1]
    pair = max(claims.rows, key=lambda pair: len(claims.rows[pair]))
    rows = claims.tables["CERTIFICATE_AXES"]
    own = np.flatnonzero((rows["first"] == pair[0]) & (rows["second"] == pair[1]))
    gone = {"all": own, "last": own[rows["end"][own] == rows["end"][own].max()], "first": own[:1]}[lost]
    assert set(judged(changed("three", CERTIFICATE_AXES=lambda rows: np.delete(rows, gone)))) == {pair}


@pytest.mark.parametrize("column", ["begin", "end", "axis"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_shows_nothing(column, value):
    rows = base("three")[1].tables["CERTIFICATE_AXES"]
    pair = (int(rows["first"][0]), int(rows["second"][0]))
    found = judged(changed("three", CERTIFICATE_AXES=setting(column, slice(0, 1), value)))
    harmless = (column, value) in {("begin", -np.inf), ("end", np.inf)}  # only more than the motion is covered
    assert set(found) == (set() if harmless else {pair})


def test_an_axis_that_does_not_part_shows_nothing():
    claims = base("three")[1]
    turned = changed("three", CERTIFICATE_AXES=lambda rows: rows["axis"].__iadd__(np.pi / 2) is None or None)
    assert len(judged(turned)) > 0.5 * len(claims.rows)


def test_order_and_surplus_rows_change_nothing():
    rng = np.random.default_rng(0)
    assert not judged(changed("three", CERTIFICATE_AXES=lambda rows: rng.permutation(np.append(rows, rows[::2]))))


def test_a_motion_into_a_neighbour_is_seen_between_knots():
    """A knot put in between sends one arm through its neighbours and back, within its speed."""
    claims = base("three")[1]
    i = next(i for i in range(claims.n) if claims.online[i])

    def away(knots):
        own = knots[knots["positioner"] == i][:1].repeat(3)
        own["time"] += [0.0, 200.0, 400.0]
        own["alpha"][1], own["beta"] = 2 * np.pi, 0.0
        return np.concatenate([own, knots[knots["positioner"] != i]])

    assert any(i in pair for pair in judged(changed("three", KNOTS=away)))


def test_a_body_inside_a_hollow_outline_touches_no_edge_and_is_seen():
    """An obstacle that is not convex becomes a star around everyone."""
    claims = base("concave")[1]

    def star(rows):
        turn = 2 * np.pi * np.arange(len(rows)) / len(rows)
        far = np.where(np.arange(len(rows)) % 2, 900.0, 200.0)
        rows["x"], rows["y"] = claims.place[0, 0] + far * np.cos(turn), claims.place[0, 1] + far * np.sin(turn)

    found = judged(changed("concave", OBSTACLES=star))
    assert set(found.values()) == {"is not shown to begin outside of each other"}
    assert len(found) == claims.online.sum()


L_SHAPED = [(0, 0), (20, 0), (20, 10), (10, 10), (10, 20), (0, 20)]


@pytest.mark.parametrize(
    ("outline", "hollow"),
    [
        (L_SHAPED, True),
        (L_SHAPED[:4] + [(10, 10), (10, 20), (0, 20), (0, 20)], True),  # repeated points hide as large a turn each
        ([(0, 0), (100, 0), (100, 100), (50, 100 - 5e-5), (0, 100)], True),  # less full than its hull by 0.05 um
        ([(0, 0), (100, 0), (100, 100), (50, 100), (0, 100), (0, 100)], False),
    ],
)
def test_an_outline_that_is_not_convex_is_taken_for_no_fuller_than_it_is(outline, hollow):
    """Else arms that pass where it is not would count as blocked, and their goals as proven out of reach."""

    def drawn(table):
        made = np.repeat(table[:1], len(outline))
        made["vertex"], made["closed"] = np.arange(len(outline)), b"T"
        made["x"], made["y"] = np.transpose(outline)
        return made

    assert changed("three", OBSTACLES=drawn).arms[-1][0].hollow is hollow


def test_reach_is_no_smaller_for_what_a_description_should_not_say():
    """The pivot of a four-bar arm's rocker is as far away if its distance is given with a sign."""
    far = base("four-bar")[1].reach

    def turned(table):
        table["four_bar_spacing"] *= -1.0

    np.testing.assert_allclose(changed("four-bar", POSITIONERS=turned).reach, far)
    with pytest.raises(BadFileError, match="contradict each other"):  # a text for a list: it would meet its letters
        changed("three", BODIES=setting("meets", slice(None), b'"arm"'))


@pytest.mark.parametrize("column", ["clearance", "time"])
@pytest.mark.parametrize("by", [-1e-3, 1e-3])
def test_what_is_said_of_a_near_start_has_to_be_so(column, by):
    """Nearer or farther than it is, or below the margin for longer or shorter."""
    row = np.flatnonzero(base("opening")[1].tables["CERTIFICATE"]["kind"] == b"opening")[0]
    value = base("opening")[1].tables["CERTIFICATE"][column][row] + by
    claims = changed("opening", CERTIFICATE=setting(column, row, value))
    assert judged(claims) or [*faults(claims)]


def test_an_opening_cannot_be_claimed_of_others():
    """Who begins with the margin may not be said to begin nearer, which would let them lose it."""
    row = np.flatnonzero(base("three")[1].tables["CERTIFICATE"]["kind"] == b"pair")[0]

    def nearer(table):
        table["kind"][row], table["clearance"][row], table["time"][row] = b"opening", -5.0, np.inf

    found = [*faults(changed("three", CERTIFICATE=nearer))]
    assert len(found) == 2
    assert "not shown to begin so near" in found[0]
    assert "below it until" in found[1]


def _last(i):
    def move(knots):
        own = np.flatnonzero(knots["positioner"] == i)
        knots["alpha"][own[-1]] += 1e-3

    return move


def test_limits_goals_and_outcomes():
    claims = base("three")[1]
    arrived = next(i for i, row in enumerate(claims.problem) if row["outcome"] == b"ARRIVED")
    offline = int(np.flatnonzero(~claims.online)[0])

    def said(outcome, i):
        def say(table):
            names = table.dtype.names
            wide = table.astype([(name, "S12" if name == "outcome" else table.dtype[name]) for name in names])
            wide["outcome"][i] = outcome
            return wide

        return dict.fromkeys(("POSITIONERS", "PROBLEM"), say)

    for tables, word in (
        ({"KNOTS": _last(arrived)}, "said to arrive"),
        ({"PROBLEM": setting("goal_alpha", arrived, 1.0)}, "not the one it was asked for"),
        ({"PROBLEM": setting("start_beta", arrived, 1.0)}, "does not begin"),
        ({"POSITIONERS": setting("upper_alpha", arrived, 1e-3)}, "leaves its range"),
        ({"POSITIONERS": setting("max_speed_alpha", arrived, 1e-3)}, "faster"),
        ({"POSITIONERS": setting("max_speed_alpha", arrived, np.nan)}, "faster"),
        (said(b"NO_TARGET", arrived), "rules out"),
        (said(b"OFFLINE", arrived), "rules out"),
        (said(b"ELSEWHERE", arrived), "rules out"),
        (said(b"ARRIVED", offline), "rules out"),
        ({"POSITIONERS": setting("online", arrived, b"F")}, "is offline but moves"),
    ):
        assert any(word in fault for fault in faults(changed("three", **tables))), word
    lost = changed("three", **said(b"INFEASIBLE", arrived))
    assert not [*faults(lost)]
    assert "without a claimed proof" in next(not_replayed(lost))


def test_claims_about_something_else_are_faults():
    other, clocks = changed("three"), changed("three")
    other.said["certificate"]["margin"] = 0.4
    clocks.said["certificate"]["jitter"] = 0.1
    for claims in (other, clocks):
        assert "another margin, or about clocks that are off" in next(faults(claims))
    thick = replay(changed("three", OBSTACLES=setting("radius", slice(None), 12.0)), jobs=1)
    assert any("obstacle 'post'" in fault for fault in thick.faults)
    near = np.flatnonzero(base("opening")[1].tables["CERTIFICATE"]["kind"] == b"opening")[0]
    kept = changed("opening", CERTIFICATE=setting("clearance", near, 2.0))
    assert any("are no such pair" in fault for fault in faults(kept))


def test_who_could_meet_is_told_by_the_longest_of_all_bodies():
    """Whichever is listed first: alpha's are 4 mm long, beta's reach 15 mm from its axis."""
    plane = row(2).replace(length=np.full(2, 5.0))
    short, long = Body([[0.0, 0.0], [4.0, 0.0]], 0.5, "alpha"), Body([[0.0, 0.0], [10.0, 0.0]], 1.0, "beta")
    for bodies in ((short, long), (long, short)):
        claims = Claims(made(plane.replace(bodies=bodies), [[(0, 90, 90)], [(0, 90, 90)]], 0.5))
        assert claims.reach == pytest.approx([16.5, 16.5], abs=1e-6)
        assert [*claims.pairs()] == [(0, 1)]


def test_outlines_that_are_not_convex_need_no_margin():
    claims = copy.copy(base("concave")[1])
    claims.margin = 0.0
    assert any(shape.hollow for shape in claims.arms[0])
    assert [claims.judge(*pair) for pair in claims.pairs()] == [None] * len([*claims.pairs()])


def test_what_a_replay_says_nothing_of_is_noted():
    limits = {"max_acceleration": np.full((2, 2), 9.0), "min_speed": np.full((2, 2), 0.01)}
    still = [[(0, 90, 90)], [(0, 90, 90)]]
    claims = Claims(made(row(2).replace(**limits), still, 0.5))
    claims.said["bounds"] = ["one"]
    notes = [*not_replayed(claims)]
    assert [note.split(" are not replayed")[0] for note in notes] == [
        "limits of accelerations",
        "limits of least speeds",
        "bounds of the makespan",
    ]


def test_a_slider_that_leaves_its_range_is_seen():
    claims = base("four-bar")[1]
    moving = next(i for i, own in enumerate(claims.knots) if np.ptp(own[:, 1]) > 0.1)
    tight = changed("four-bar", POSITIONERS=setting("four_bar_longest", moving, claims.bar[moving, 2] + 1e-3))
    assert any("zone of avoidance" in fault for fault in faults(tight))


def test_only_what_changed_is_replayed():
    claims = base("three")[1]
    count = len([*claims.pairs()])
    same = replay(claims, claims, jobs=1)
    assert (same.judged, same.taken, same.faults) == (0, count, ())
    i = next(i for i in range(claims.n) if claims.online[i])
    moved = replay(changed("three", KNOTS=_last(i)), claims, jobs=1)
    assert moved.judged == sum(i in pair for pair in claims.pairs())
    other = replay(changed("three", BODIES=setting("radius", slice(None), 1.4)), claims, jobs=1)
    assert other.judged >= count - 1


@pytest.mark.large
def test_processes_say_what_one_does():
    claims = base_of(BASES["thirty-seven"])[1]
    assert len([*claims.pairs()]) > 200
    told = []
    assert replay(claims, jobs=2, report=told.append) == replay(claims, jobs=1)
    assert told[-1].startswith(f"{len([*claims.pairs()])} of ")


class TestFiles:
    def content(self):
        columns, claims = base("three")
        return sealed(columns, claims.tables)

    def test_any_flipped_bit_is_refused(self):
        content = bytearray(self.content())
        rng = np.random.default_rng(0)
        begin = content.index(b"XTENSION")
        for at in rng.integers(begin, len(content), 40):
            changed = content.copy()
            changed[at] ^= 1 << int(rng.integers(8))
            try:
                again = Claims(bytes(changed))
            except BadFileError:
                continue
            before = base("three")[1].tables
            assert all(again.tables[name].tobytes() == before[name].tobytes() for name in before)

    def test_keywords_cannot_change_values(self):
        """A digest knows nothing of TZERO, by which a reader of FITS would add a day to every time."""
        with fits.open(io.BytesIO(self.content())) as hdul:
            hdul["KNOTS"].header["TZERO2"] = 86400.0
            made = io.BytesIO()
            hdul.writeto(made, output_verify="ignore")
        try:
            again = Claims(made.getvalue())
        except BadFileError:
            return
        assert again.tables["KNOTS"].tobytes() == base("three")[1].tables["KNOTS"].tobytes()

    def test_older_formats_are_read_and_newer_are_not(self):
        old = Claims(gzip.decompress(FORMAT1.read_bytes()))
        assert old.rows == {}
        assert judged(old)  # nothing is stated, so nothing is shown
        columns, claims = base("three")
        second = sealed({name: of for name, of in columns.items() if name != "CERTIFICATE_AXES"}, claims.tables, 2)
        assert Claims(second).rows == {}
        newer = self.content().replace(b"FPFORMAT=                    3", b"FPFORMAT=                    4")
        with pytest.raises(BadFileError, match="format 4"):
            Claims(newer)

    def test_what_is_no_plan_is_refused_in_a_line(self):
        for content in (b"", b"SIMPLE  =", b"x" * 9000, self.content()[:9000]):
            with pytest.raises(BadFileError) as refused:
                Claims(content)
            assert "\n" not in str(refused.value)


def test_bodies_are_of_the_positioner_and_openings_of_the_obstacle_that_they_name():
    def of_each(table):
        each = np.repeat(table[None], 3, axis=0)
        each["positioner"] = np.arange(3)[:, None]
        each["radius"] += 0.1 * np.arange(3)[:, None]
        return each.ravel()

    def nearer(table):
        table["kind"][:1], table["first"][:1], table["second"][:1] = b"opening", 1, -1

    before, claims = base("three")[1], changed("three", BODIES=of_each, CERTIFICATE=nearer)
    for i in range(3):
        assert [s.radius for s in claims.arms[i]] == pytest.approx([s.radius + 0.1 * i for s in before.arms[i]])
    assert set(claims.opening) == {(1, 3)}
    least = before.arms[0][0].radius
    assert f"of radius {least:.6g} to {least + 0.2:.6g} mm" in about(claims)
