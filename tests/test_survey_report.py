"""The page of a survey: what it says is on it, escaped, and it needs no other file."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.visuals.report_page import shown
from fiberplan.visuals.survey_report import _MOST, Report, _maps, survey_report

pytestmark = pytest.mark.small


def report(rows=(("field <1>", 3, 0.5),), centres=None, **changes):
    made = Report(
        title="survey & more",
        verdict="2 fields",
        good=True,
        centres=centres,
        share=np.array([0.5, np.nan]),
        base=np.array([[0.0, 0.0], [22.4, 0.0]]),
        used=np.array([1, 2]),
        makespan=np.array([12.0, 14.0]),
        lower_bound=np.array([11.0, 13.0]),
        tables=(("Fields", ("field", "targets", "share"), rows), ("Nothing", ("name",), ())),
        notes=("arms are <as drawn>",),
    )
    return made._replace(**changes)


def test_tables_notes_and_maps_are_on_one_page(tmp_path):
    survey_report(report(), tmp_path / "s.html")
    page = (tmp_path / "s.html").read_text()
    assert "<title>survey &amp; more</title>" in page
    assert "<p class='safe'>2 fields</p>" in page
    assert "<td class='word'>field &lt;1&gt;</td><td class='number'>3</td><td class='number'>0.500</td>" in page
    assert "<li>arms are &lt;as drawn&gt;</li>" in page
    assert "src='data:image/png;base64,iVBOR" in page
    assert "Nothing" not in page  # a table without rows is left out
    assert "more, in the tables beside" not in page


def test_of_many_rows_the_first_are_shown_and_the_others_counted(tmp_path, monkeypatch):
    monkeypatch.setattr("fiberplan.visuals.survey_report._maps", lambda report: b"")
    rows = [(f"row {k}", k, 0.0) for k in range(_MOST + 3)]
    survey_report(report(rows, notes=(), good=False), tmp_path / "s.html")
    page = (tmp_path / "s.html").read_text()
    assert f"row {_MOST - 1}<" in page
    assert f"row {_MOST}<" not in page
    assert "and 3 more, in the tables beside this page" in page
    assert "Assumed" not in page
    assert "<p class='unsafe'>" in page


@pytest.mark.large
def test_fields_on_the_sky_have_a_map_of_their_own():
    wide = (_maps(report(centres=centres)) for centres in (None, np.array([[10.0, 2.0], [11.0, 2.5]])))
    without, with_sky = (len(png) for png in wide)
    assert with_sky > 1.1 * without


def test_a_page_that_cannot_be_written_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr("fiberplan.visuals.survey_report._maps", lambda report: b"")
    with pytest.raises(fp.errors.FiberplanError, match=r"s\.html"):
        survey_report(report(), tmp_path / "nowhere" / "s.html")


def test_fractions_have_three_digits():
    assert [shown(value) for value in (1, 0.25, "a")] == ["1", "0.250", "a"]
