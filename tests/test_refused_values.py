"""Values that nobody can mean are refused in one line that names where they are, whoever hands them over."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import InstrumentError, ProblemError, TargetError
from fiberplan.focal_plane.bodies import Body
from fiberplan.io.states import read_state
from fiberplan.scenes.decisive import row
from fiberplan.survey import Catalogue
from fiberplan.survey.batch.fields import Fields
from fiberplan.tables.ecsv import read_ecsv

pytestmark = pytest.mark.small
TWO = np.zeros(2)
NAMED = {"positioner": ("P0", "P1")}


def refused(error, complaint, make):
    with pytest.raises(error) as found:
        make()
    assert complaint in str(found.value)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"priority": [1.0]}, "priority must have shape (2,), got (1,)"),
        ({"angles": np.zeros((2, 3))}, "angles must have shape (2, 2), got (2, 3)"),
        ({"assigned": [True]}, "assigned must have shape (2,), got (1,)"),
        ({"base": np.zeros((2, 3))}, "base must have shape (k, 2), got (2, 3)"),
        ({"base": np.zeros((3, 2))}, "base has 3 entries for 2 targets"),
        ({"positioner": ("P0",)}, "positioner has 1 entries for 2 targets"),
        ({"positioner": ("P0", "P0")}, "row 2: positioner 'P0' already has a target in row 1"),
        ({"offline": ("P1",)}, "row 2: positioner 'P1' has a target but its position is unknown"),
        ({"prefer": "either"}, "prefer must be 'angles' or 'xy', got 'either'"),
        ({"priority": [1.0, -1.0]}, "row 2: priority is -1, expected a finite number of 0 or more"),
        ({"parity": [2.0, 0.0]}, "row 1: parity is 2, expected +1 (right), -1 (left) or 0 (either)"),
        ({"x": [0.0, np.inf]}, "row 2: x is inf"),
        ({"angles": [[0.0, np.nan], [0.0, 0.0]]}, "row 1: alpha, beta are 0, nan deg: both must be finite"),
    ],
)
def test_targets(changes, complaint):
    refused(TargetError, complaint, lambda: fp.Targets(**{"x": TWO, "y": TWO} | NAMED | changes))


def test_targets_that_are_none_or_nobodys():
    refused(TargetError, "there are no targets", lambda: fp.Targets([], []))
    for order in ({"conflicts": "keep"}, {"priority_order": "largest"}):
        (name,) = order
        refused(TargetError, f"{name} must be", lambda order=order: fp.Targets.read("none.csv", **order))
    refused(TargetError, "no column 'positioner'", lambda: fp.Targets(TWO, TWO).indices(row(2)))
    for more in ({}, {"offline": ("P9",)}):
        names = ("P0", "P9") if not more else ("P0", "P1")
        unknown = fp.Targets(TWO, TWO, positioner=names, **more)
        refused(TargetError, "has no positioner 'P9'", lambda unknown=unknown: unknown.indices(row(2)))


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"position_error": [0.1] * 3}, "position error must be one length or 2, of 0 to 4e+09 mm"),
        ({"position_error": -0.1}, "position error must be one length or 2, of 0 to 4e+09 mm"),
        ({"near_start": "close"}, "near_start must be 'raise' or 'open', got 'close'"),
        ({"margin": True}, "margin must be a length of 0 mm or more, got True"),
        ({"margin": -1.0}, "margin must be a length of 0 mm or more, got -1.0"),
        ({"priority": [1.0]}, "priority must be 2 finite numbers of 0 or more"),
        ({"wished": [True]}, "wished must have shape (2,), got (1,)"),
        ({"conflicts": "keep"}, "conflicts must be 'raise' or 'drop', got 'keep'"),
        ({"goal": np.zeros((3, 2))}, "goal must have shape (2, 2), got (3, 2)"),
        ({"start": fp.State(np.zeros((3, 2)))}, "a state of 3 positioners for 2"),
    ],
)
def test_problems(changes, complaint):
    plane = row(2)
    fields = {"plane": plane, "start": plane.folded, "goal": plane.folded} | changes
    refused(ProblemError, complaint, lambda: fp.Problem(**fields))


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"base": [[0.0, 0.0], [1e300, 0.0]]}, "positioner 'P1'"),
        ({"aliases": ("A",)}, "1 second names for 2 positioners"),
        ({"recommended_margin": -1.0}, "recommended margin -1 mm is not a length"),
        ({"forbidden": np.zeros((1, 2))}, "forbidden must be finite and of shape (m, 3)"),
        ({"bodies": (Body(np.zeros((3, 2, 2)), 1.0, name="arm"),)}, "body 'arm': points of 3 positioners, not 2"),
        ({"bodies": (Body([[0.0, 0.0]], np.ones(3), name="arm"),)}, "body 'arm': radii of 3 positioners, not 2"),
        ({"bodies": (Body([[0.0, 0.0]], 1.0, "rocker"),)}, "a body rides on the rocker, but two-link arms have"),
        ({"field_radius": 0.0}, "field_radius 0 mm is not a positive length"),
        ({"length": [7.4, -1.0]}, "length"),
        ({"max_speed": np.zeros((2, 2))}, "is not a positive speed"),
        ({"folded": np.full((2, 2), 99.0)}, "lies outside the joint's range"),
    ],
)
def test_focal_planes(changes, complaint):
    refused(InstrumentError, complaint, lambda: row(2).replace(**changes))


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"priority": [1.0]}, "priority must have shape (2,), got (1,)"),
        ({"ids": ("a",)}, "ids has 1 entries for 2 targets"),
        ({"x": [], "y": []}, "there are no targets"),
    ],
)
def test_catalogues(changes, complaint):
    refused(TargetError, complaint, lambda: Catalogue(**{"x": TWO, "y": TWO} | changes))


def test_a_catalogue_is_made_of_targets_too():
    catalogue = Catalogue.of(fp.Targets(TWO, TWO, priority=[2.0, 3.0], **NAMED))
    assert catalogue.priority.tolist() == [2.0, 3.0]
    assert Catalogue.of(catalogue) is catalogue
    assert repr(catalogue).startswith("<Catalogue: 2 targets from")


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        ({"ids": ()}, "there are no fields"),
        ({"ids": ("a", "")}, "row 2: id is empty"),
        ({"ids": ("a", "a")}, "row 2: id 'a' is that of row 1, too"),
        ({"ids": ("a", "b"), "chain": ("c",)}, "2 fields, but 1 chains"),
        ({"ids": ("a", "b"), "ra": [1.0]}, "must have shape (2,), got (1,)"),
    ],
)
def test_fields(fields, complaint):
    refused(TargetError, complaint, lambda: Fields(**fields))


def test_states():
    plane = row(2)
    refused(ProblemError, "a state is read at a moment of 0 s or more, got -1 s", lambda: read_state("no", plane, -1.0))
    refused(ProblemError, "a state is read from a plan, a motion or a file, got int", lambda: read_state(7, plane))
    state = fp.State(plane.folded)
    assert read_state(state, plane) is state


@pytest.mark.parametrize(
    ("rows", "complaint"),
    [
        ("a b", "the table has no rows"),
        ('a b\n"1 2\n3" 4', "a quoted cell runs over more than one line"),
        ('a b\n"1"2 3', "is not an ECSV table"),
        ("a b\n1 2\n3", "line 6: 1 values for 2 columns: is the file truncated?"),
    ],
)
def test_ecsv_tables(tmp_path, rows, complaint):
    path = tmp_path / "t.ecsv"
    path.write_text(f"# %ECSV 1.0\n# ---\n# delimiter: ' '\n{rows}\n")
    refused(TargetError, complaint, lambda: read_ecsv(path, TargetError))
