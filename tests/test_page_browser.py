"""The page in a real browser: quiet, alive, and saying the same as the library.

Needs a Chromium: named by the environment variable CHROME, or found as chromium or google-chrome.
"""

import os
import re
import shutil

import numpy as np
import pytest

from fiberplan.plan.diagnosis import diagnose
from fiberplan.visuals import show
from test_page import CENTRE, HOSTILE, MIXED, OFFLINE, RIGHT, STUCK, displaced_plan, small_plan, still_plan

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROME = os.environ.get("CHROME") or next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
pytestmark = pytest.mark.skipif(CHROME is None, reason="no browser: set CHROME to a Chromium's path")
QUIET = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update")
QUIET += ("--disable-sync", "--no-first-run")


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROME, args=QUIET)
        yield browser
        browser.close()


@pytest.fixture
def open_page(browser, tmp_path):
    """Opens the page of a plan; afterwards nothing may have been fetched, logged or thrown."""
    heard, contexts = [], []

    def opened(plan, **settings):
        show(plan, tmp_path / "field.html")
        context = browser.new_context(viewport={"width": 1200, "height": 800}, **settings)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: heard.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: heard.append(f"error: {error}"))
        address = (tmp_path / "field.html").as_uri()
        page.on("request", lambda request: heard.append(request.url) if request.url != address else None)
        page.goto(address)
        playwright.expect(page.locator("#clock")).not_to_be_empty()
        return page

    yield opened
    for context in contexts:
        context.close()
    assert heard == []


def picture(page):
    """The canvas as text, once what was asked for is drawn."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return page.evaluate("document.getElementById('field').toDataURL()")


def set_time(page, t):
    page.locator("#slider").evaluate("(node, t) => { node.value = t; node.dispatchEvent(new Event('input')); }", t)
    picture(page)


def middle(page):
    box = page.locator("#field").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def select(page, name):
    page.fill("#search", name)
    page.press("#search", "Enter")
    page.locator("#selected .name", has_text=name).wait_for()
    return page.locator("#selected").inner_text()


def number(text, label):
    return float(re.search(rf"{label}\s+(?:≥ )?(-?[\d.]+)", text).group(1))


def test_slider_moves_the_arms(open_page):
    page = open_page(small_plan())
    seen = picture(page)
    set_time(page, 0)
    folded = picture(page)
    assert folded != seen
    set_time(page, 8)
    assert picture(page) not in (folded, seen)
    assert page.locator("#clock").inner_text() == "8.00 s of 16.00 s"
    assert page.locator("#moving").inner_text() == "15 moving (at most 15)"


def test_premises_and_who_is_displaced(open_page):
    page = open_page(displaced_plan())
    assert "Idle, elsewhere than recorded (1)".upper() in page.locator("#displaced").inner_text().upper()
    assert re.search(r"arrived\s+6 of 6\b", page.locator("#figures").inner_text(), re.IGNORECASE)
    text = page.locator("#premises").inner_text()
    assert "arm of radius 1.5 mm" in text
    assert f"a guess {HOSTILE}" in text
    page.locator("#displaced button").click()
    assert page.locator("#selected .name").inner_text().startswith("R0C2")
    assert not open_page(small_plan()).locator("#displaced").is_visible()


def test_play_runs_to_the_end_and_pauses(open_page):
    page = open_page(small_plan())
    page.click("#play")  # from the end it starts over
    clock = page.locator("#clock")
    playwright.expect(clock).to_have_text(re.compile(r"^\d\.\d\d s"))
    before = picture(page)
    playwright.expect(clock).to_have_text(re.compile(r"^[1-9]\.\d\d s"))
    assert picture(page) != before
    page.click("#play")
    assert page.locator("#play").inner_text() == "Play"
    held = clock.inner_text()
    page.wait_for_timeout(150)
    assert clock.inner_text() == held
    page.select_option("#speed", "10")
    page.click("#play")
    playwright.expect(clock).to_have_text("16.00 s of 16.00 s")
    assert page.locator("#play").inner_text() == "Play"


def test_keys(open_page):
    page = open_page(small_plan())
    page.keyboard.press("Home")
    picture(page)
    assert page.locator("#clock").inner_text().startswith("0.00 s")
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("ArrowLeft")
    picture(page)
    assert page.locator("#clock").inner_text().startswith("1.44 s")
    page.keyboard.press(" ")
    assert page.locator("#play").inner_text() == "Pause"
    page.keyboard.press(" ")
    assert page.locator("#play").inner_text() == "Play"
    page.keyboard.press("/")
    page.keyboard.type(" 0")  # typed, not obeyed
    assert page.locator("#search").input_value() == " 0"


def test_hover_names_the_positioner_and_its_numbers(open_page):
    plan = small_plan()
    page = open_page(plan)
    page.mouse.move(*middle(page))
    tip = page.locator("#tip")
    tip.wait_for()
    words = tip.inner_text()
    assert words.startswith(plan.problem.plane.ids[CENTRE])
    assert "arrived" in words
    alpha, beta = np.degrees(plan.trajectory.end[CENTRE])
    assert number(words, "alpha") == pytest.approx(alpha, abs=0.006)
    assert number(words, "beta") == pytest.approx(beta, abs=0.006)
    page.mouse.move(5, 400)
    tip.wait_for(state="hidden")


@pytest.mark.parametrize("bodies", [None, MIXED], ids=["capsules", "every kind of body"])
def test_clearance_agrees_with_the_library(open_page, bodies):
    plan = small_plan(obstacles=(), **({} if bodies is None else {"bodies": bodies}))
    plane = plan.problem.plane
    page = open_page(plan)
    for t in (0.0, 9.5):
        set_time(page, t)
        gaps = plane.clearance(plan.trajectory.at(t))
        for i in (CENTRE, 8, 17):
            nearest = gaps[(plane.pairs == i).any(axis=1)].min()
            assert number(select(page, plane.ids[i]), "clearance now") == pytest.approx(nearest, abs=2e-3)


def test_zoom_pan_and_reset(open_page):
    page = open_page(small_plan())
    whole = picture(page)
    x, y = middle(page)
    page.mouse.move(x, y)
    page.mouse.wheel(0, -400)
    page.mouse.move(5, 400)
    page.wait_for_timeout(100)
    close = picture(page)
    assert close != whole
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y + 30, steps=4)
    page.mouse.up()
    assert page.locator("#selected").is_hidden()  # a drag is no click
    page.mouse.move(5, 400)
    assert picture(page) not in (whole, close)
    page.click("#reset")
    page.mouse.move(5, 400)
    assert picture(page) == whole


def test_lost_targets_say_why_and_lead_there(open_page):
    plan = small_plan()
    page = open_page(plan)
    losses = page.locator("#losses")
    assert "Lost targets (3)".upper() in losses.inner_text().upper()
    assert HOSTILE in losses.inner_text()
    whole = picture(page)
    losses.get_by_role("button", name=plan.problem.plane.ids[STUCK], exact=True).click()
    page.wait_for_timeout(450)
    assert picture(page) != whole
    words = page.locator("#selected").inner_text()
    assert words.split("\n")[1] == plan.problem.plane.ids[STUCK]
    assert f"{plan.problem.plane.ids[8]}, F1" in words
    page.keyboard.press("Escape")
    page.locator("#selected").wait_for(state="hidden")


def red(page):
    """Whether the canvas has a pixel of the colour of blame, once what was asked for is drawn."""
    picture(page)
    return page.evaluate(
        """() => {
          const { width, height } = document.getElementById("field");
          const ink = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
          ink.drawImage(document.getElementById("field"), 0, 0);
          const { data } = ink.getImageData(0, 0, width, height);
          for (let k = 0; k < data.length; k += 4)
            if (data[k] === 0xbf && data[k + 1] === 0 && data[k + 2] === 0x29) return true;
          return false;
        }"""
    )


def test_a_loss_shows_who_is_in_the_way(open_page):
    plan = small_plan()
    page = open_page(plan, color_scheme="light")
    item = page.locator("#losses .item", has_text=plan.problem.plane.ids[STUCK])
    distance = next(loss.distance for loss in diagnose(plan).losses if loss.positioner == STUCK)
    assert f"priority 1, ends {distance:.3f} mm from its target" in item.inner_text()
    assert "it ends where it starts" in item.inner_text()
    page.keyboard.press("0")
    assert not red(page)
    item.get_by_role("button", name=plan.problem.plane.ids[STUCK], exact=True).click()
    page.wait_for_timeout(450)
    assert red(page)
    page.keyboard.press("Escape")
    assert not red(page)
    offline = page.locator("#losses .chips", has_text="asked of positioners that cannot move")
    assert offline.get_by_role("button").all_inner_texts() == [plan.problem.plane.ids[OFFLINE]]


def test_what_set_the_duration(open_page):
    plan = small_plan()
    page = open_page(plan)
    diagnosis, words = diagnose(plan), page.locator("#diagnosis").inner_text()
    assert number(words, "duration") == pytest.approx(plan.makespan, abs=0.006)
    assert number(words, "lower bound") == pytest.approx(diagnosis.lower_bound, abs=0.006)
    assert f"need {diagnosis.bound_by.needed:.2f} s" in words
    assert "reversals of alpha\nmedian 0, at most 0" in words
    first = diagnosis.slowest[0]
    assert f"stops at {first.stops:.2f} s, needs {first.needed:.2f} s" in words
    page.locator("#diagnosis .chips", has_text="stops at").first.get_by_role("button").click()
    assert page.locator("#selected .name").inner_text() == first.id


def test_verdicts(open_page):
    page = open_page(small_plan())
    assert "SAFE" in page.locator("#verdict").inner_text()
    assert "NOT" not in page.locator("#verdict").inner_text()
    assert page.locator("#trouble").is_hidden()


def test_contacts_are_listed_and_lead_to_their_moment(open_page):
    plan = small_plan(touching=True)
    page = open_page(plan)
    assert "NOT SAFE" in page.locator("#verdict").inner_text()
    contact = plan.certificate.contacts[0]
    page.locator("#trouble button").first.click()
    page.wait_for_timeout(450)
    assert page.locator("#clock").inner_text().startswith(f"{contact.time:.2f} s")
    words = page.locator("#selected").inner_text()
    assert number(words, "clearance now") == pytest.approx(plan.problem.margin, abs=0.02)
    assert plan.problem.plane.ids[RIGHT] in words


def test_legend_fades_an_outcome(open_page):
    page = open_page(small_plan())
    before = picture(page)
    arrived = page.locator("#legend button").first
    assert re.fullmatch(r"arrived\s*15", arrived.inner_text().strip())
    arrived.click()
    assert arrived.get_attribute("aria-pressed") == "false"
    assert picture(page) != before


def test_hostile_strings_do_nothing(open_page):
    ids = (HOSTILE, *small_plan().problem.plane.ids[1:])
    page = open_page(small_plan(ids=ids, name=HOSTILE))
    assert HOSTILE in select(page, HOSTILE)
    assert page.locator("h1").inner_text() == HOSTILE
    assert page.evaluate("window.hit === undefined && document.images.length === 0")


@pytest.mark.parametrize(("scheme", "shade"), [("light", 255), ("dark", 14)])
def test_follows_the_reader_by_day_and_night(open_page, scheme, shade):
    page = open_page(small_plan(), color_scheme=scheme, device_scale_factor=2)
    picture(page)
    canvas = page.locator("#field")
    corner = "node => node.getContext('2d').getImageData(9, node.height - 9, 1, 1).data[0]"
    assert canvas.evaluate(corner) == shade
    assert canvas.evaluate("node => node.width / node.clientWidth") == 2


def test_a_plan_without_motion(open_page):
    page = open_page(still_plan())
    assert page.locator("#play").is_disabled()
    assert page.locator("#slider").is_disabled()
    assert "No target was asked for".lower() in page.locator("#losses").inner_text().lower()
