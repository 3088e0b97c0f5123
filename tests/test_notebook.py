"""What notebooks show: well formed, inert, light, and true to the plan."""

import re
import sys
from collections import Counter
from xml.etree import ElementTree

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.plan.summary import headline
from fiberplan.visuals import style
from fiberplan.visuals.page import render
from fiberplan.visuals.shapes import span
from test_page import small_plan

pytestmark = pytest.mark.small


@pytest.fixture(scope="module")
def plan():
    return small_plan()


def parsed(shown):
    return ElementTree.fromstring("<div>" + shown.replace("&nbsp;", " ").replace("&ensp;", " ") + "</div>")


def facts(shown):
    return [(row.find("th").text, row.find("td").text) for row in parsed(shown).iter("tr")]


def strokes(shown):
    """Of each colour, how many lines or dots are drawn."""
    found = re.findall(r'<path d="([^"]*)" stroke="([^"]*)"', shown)
    counted = Counter()
    for path, colour in found:
        counted[colour] += path.count("l") + path.count("h0")
    return counted


@pytest.mark.large
def test_a_plan_shows_every_arm_in_its_colour_and_its_facts(plan):
    shown = plan._repr_html_()
    counted = strokes(shown)
    for outcome, colour in style.OUTCOMES.items():
        assert counted[colour.light] == plan.outcomes.count(outcome)
    assert counted[style.CONTACT.light] == 2 * len(plan.lost)  # a cross each
    assert facts(shown)[: len(headline(plan))] == list(headline(plan))
    assert "<script" not in shown
    assert len(shown) < 10_000
    assert len(repr(plan)) < 3000


def test_arms_are_drawn_where_they_are(plan):
    """Lines are given each from the end of the one before: added up they are the elbows and fibers."""
    plane = plan.problem.plane.replace(online=np.ones(19, bool), obstacles=())
    (path,) = re.findall(r'<path d="(m[^"]*)" stroke=', plane._repr_html_())
    steps = np.array(re.findall(r"[ml](-?\d+) (-?\d+)", path), int).reshape(19, 2, 2)
    ends = np.cumsum(steps.reshape(-1, 2), axis=0).reshape(19, 2, 2)
    elbows, fibers = plane.elbows(plane.folded), plane.fibers(plane.folded)
    low, high = span(plane)
    scale = 1000 / (high - low).max()
    for drawn, real in ((ends[:, 0], elbows), (ends[:, 1], fibers)):
        moved = (real - real[0]) * [scale, -scale]
        assert np.abs(drawn - drawn[0] - moved).max() <= 1.01


def test_a_focal_plane_shows_what_it_is_made_of(plan):
    plane = plan.problem.plane
    shown = plane._repr_html_()
    assert ("positioners", "19, 1 of them cannot move") in facts(shown)
    assert strokes(shown)[style.OUTCOMES[fp.Outcome.OFFLINE].light] == 1
    bare = plane.replace(bodies=(), obstacles=(), name="<b>")._repr_html_()
    assert ("bodies", "none: nothing can touch") in facts(bare)
    assert "&lt;b&gt;" in bare


def test_many_are_dots_and_stay_light():
    plane = fp.FocalPlane.hexagonal(27, 22.4)
    shown = plane._repr_html_()
    assert plane.n > 2000
    assert sum(strokes(shown).values()) == plane.n
    assert len(shown) < 11 * plane.n


def test_a_certificate_shows_its_verdict_and_what_was_found():
    plan = small_plan(touching=True)
    certificate = plan.certificate
    found = facts(certificate._repr_html_())
    assert found[0] == ("verdict", str(certificate))
    (contact,) = certificate.contacts
    assert ("contact", f"{contact.pair[0]} and {contact.pair[1]} at {contact.time:.3f} s") in found
    nobody = fp.FocalPlane.hexagonal(0, 22.4)
    empty = fp.verify(nobody, fp.Trajectory.at_rest(nobody.folded))._repr_html_()
    assert "<svg" not in empty
    assert facts(empty)[0][1].startswith("safe: nothing is within reach")


def test_the_page_as_a_widget(plan):
    shown = fp.visuals.widget(plan, height=500)
    assert shown.page == render([plan]).decode()
    assert (shown.height, shown.title) == (500, f"small array: {plan}")


def test_a_widget_without_its_extra(plan, monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(fp.FiberplanError, match="a widget needs the extra 'notebook'"):
        fp.visuals.widget(plan)
