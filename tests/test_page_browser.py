"""The page in a real browser: quiet, alive, accessible, and saying the same as the library.

Needs a Chromium: named by the environment variable CHROME, or found as chromium or google-chrome. Without one these
tests are skipped, but where CI is "true" they fail. One browser serves all, and one page all tests of a plan.
"""

import os
import re
import shutil
from functools import cache

import numpy as np
import pytest

from fiberplan.motion import Executed
from fiberplan.plan.diagnosis import diagnose
from fiberplan.visuals import show
from fiberplan.visuals.approaches import approaches
from fiberplan.visuals.motion_page import show_motion
from fiberplan.visuals.origin import Origin
from test_page import CENTRE, HOSTILE, LOST, MIXED, OFFLINE, RIGHT, STUCK, displaced_plan, small_plan, still_plan

try:
    from axe_core_python.sync_playwright import Axe
    from playwright import sync_api as playwright
except ImportError:
    playwright = None
CHROME = os.environ.get("CHROME") or next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
QUIET = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update")
QUIET += ("--disable-sync", "--no-first-run")
pytestmark = pytest.mark.xdist_group("browser")
ORIGIN = Origin("plan.fits", "2026-11-26 21:15 UTC")


STILL, DISPLACED = cache(still_plan), cache(displaced_plan)  # the same plan has the same page


@cache
def mixed_plan():
    return small_plan.__wrapped__(obstacles=(), bodies=MIXED)


@pytest.fixture(scope="module")
def browser():
    if playwright is None or CHROME is None:
        missing = "playwright or axe-core-python is not installed" if playwright is None else "no Chromium: set CHROME"
        (pytest.fail if os.environ.get("CI") == "true" else pytest.skip)(missing)
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROME, args=QUIET)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def tabs(browser, tmp_path_factory):
    """Pages that are open, by plan and settings, and what was heard of them."""
    folder, opened, heard = tmp_path_factory.mktemp("pages"), {}, []

    def tab(plans, settings):
        key = (plans, tuple(sorted(settings.items())))
        if key not in opened:
            path = folder / f"{len(opened)}.html"
            if callable(plans[0]):
                plans[0](path)
            else:
                show(plans, path, [ORIGIN] * len(plans))
            width, height = settings.pop("viewport", (1000, 640))
            context = browser.new_context(viewport={"width": width, "height": height}, **settings)
            page = context.new_page()
            page.on("console", lambda message: heard.append(f"{message.type}: {message.text}"))
            page.on("pageerror", lambda error: heard.append(f"error: {error}"))
            address = path.as_uri()
            own = (address, "blob:")  # a picture that is saved comes from the page itself
            page.on("request", lambda request: heard.append(request.url) if not request.url.startswith(own) else None)
            page.goto(address)
            playwright.expect(page.locator("#clock")).not_to_be_empty()
            opened[key] = page
        return opened[key]

    return tab, heard


@pytest.fixture
def open_page(tabs):
    """The page of a plan as it is first seen; afterwards nothing may have been fetched, logged or thrown."""
    tab, heard = tabs

    def opened(*plans, color_scheme="light", **settings):
        page = tab(plans, settings)
        page.emulate_media(color_scheme=color_scheme, reduced_motion="reduce")
        page.mouse.move(5, 5)
        page.select_option("#colour", "outcome")
        page.fill("#search", "")
        page.locator("#play").focus()
        page.keyboard.press("Escape")
        page.keyboard.press("0")
        page.keyboard.press("Home")
        settle(page)
        return page

    yield opened
    assert heard == []


def settle(page):
    """Until what was asked for is drawn."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def picture(page, id_="field"):
    """The canvas as text."""
    settle(page)
    return page.evaluate(f"document.getElementById('{id_}').toDataURL()")


def set_time(page, t):
    page.locator("#slider").evaluate("(node, t) => { node.value = t; node.dispatchEvent(new Event('input')); }", t)
    settle(page)


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


def test_opens_at_the_start_and_says_where_it_comes_from(open_page):
    page = open_page(small_plan())
    assert page.locator("#clock").inner_text() == "0.00 s of 16.00 s"
    assert page.title().startswith("field-7 on small array, 2026-11-26 21:15 UTC, 15 of 18 arrived")
    assert page.locator("h1").inner_text() == "field-7 on small array"
    said = page.locator(".origin").inner_text()
    for word in ("field-7.ecsv", "plan.fits", "greedy-fold, seed 0", "2026-11-26", "as given"):
        assert word in said
    assert "SAFE" in page.locator(".verdict").inner_text()
    assert "NOT" not in page.locator(".verdict").inner_text()
    assert page.locator("#trouble").is_hidden()
    assert "step\n1 deg" in page.locator("#about").inner_text()


def test_slider_moves_the_arms(open_page):
    page = open_page(small_plan())
    start = picture(page)
    set_time(page, 8)
    assert picture(page) != start
    assert page.locator("#clock").inner_text() == "8.00 s of 16.00 s"
    assert page.locator("#moving").inner_text() == "15 moving"


def test_what_the_proof_rests_on_is_at_the_top(open_page):
    page = open_page(DISPLACED())
    premises = page.locator("header .premises")
    assert f"1 assumption: a guess {HOSTILE}" in premises.inner_text()
    premises.locator("summary").click()
    assert "arm of radius 1.5 mm" in premises.inner_text()
    premises.locator("summary").click()


def test_who_is_displaced(open_page):
    page = open_page(DISPLACED())
    assert "Idle, elsewhere than recorded (1)".upper() in page.locator("#displaced").inner_text().upper()
    assert re.search(r"arrived\s+6 of 6\b", page.locator(".figures").inner_text(), re.IGNORECASE)
    page.locator("#displaced button").click()
    assert page.locator("#selected .name").inner_text().startswith("R0C2")
    assert not open_page(small_plan()).locator("#displaced").is_visible()


def test_play_runs_to_the_end_and_pauses(open_page):
    page = open_page(small_plan())
    page.select_option("#speed", "5")
    page.click("#play")
    clock = page.locator("#clock")
    playwright.expect(clock).to_have_text(re.compile(r"^[1-9]\.\d\d s"))
    page.click("#play")
    assert page.locator("#play").inner_text() == "Play"
    settle(page)  # the clock is drawn with the next frame
    held = clock.inner_text()
    page.wait_for_timeout(100)
    assert clock.inner_text() == held
    page.select_option("#speed", "10")
    page.click("#play")
    playwright.expect(clock).to_have_text("16.00 s of 16.00 s")
    assert page.locator("#play").inner_text() == "Play"


def test_keys(open_page):
    page = open_page(small_plan())
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("ArrowLeft")
    settle(page)
    assert page.locator("#clock").inner_text().startswith("1.44 s")
    page.locator("#field").focus()
    page.keyboard.press(" ")
    assert page.locator("#play").inner_text() == "Pause"
    page.keyboard.press(" ")
    assert page.locator("#play").inner_text() == "Play"
    page.keyboard.press("/")
    page.keyboard.type(" 0")  # typed, not obeyed
    assert page.locator("#search").input_value() == " 0"


def test_hover_names_the_arm_and_its_numbers(open_page):
    plan = small_plan()
    page = open_page(plan)
    page.keyboard.press("End")
    page.mouse.move(*middle(page))
    tip = page.locator("#tip")
    tip.wait_for()
    words = tip.inner_text()
    assert words.startswith(plan.problem.plane.ids[CENTRE])
    assert "arrived" in words
    alpha, beta = np.degrees(plan.trajectory.end[CENTRE])
    assert number(words, "alpha") == pytest.approx(alpha, abs=0.006)
    assert number(words, "beta") == pytest.approx(beta, abs=0.006)
    page.mouse.move(5, 5)
    tip.wait_for(state="hidden")


@pytest.mark.parametrize("bodies", [None, MIXED], ids=["capsules", "every kind of body"])
def test_clearance_agrees_with_the_library(open_page, bodies):
    plan = small_plan() if bodies is None else mixed_plan()
    plane = plan.problem.plane
    page = open_page(plan)
    for t in (0.0, 9.5):
        set_time(page, t)
        gaps = plane.clearance(plan.trajectory.at(t), plane.arm_pairs_within(plane.pair_margin))
        for i in (CENTRE, 8, 17):
            nearest = gaps[(plane.arm_pairs_within(plane.pair_margin) == i).any(axis=1)].min()
            assert number(select(page, plane.ids[i]), "clearance now") == pytest.approx(nearest, abs=2e-3)


def test_zoom_pan_and_ways_back(open_page):
    page = open_page(small_plan())
    whole = picture(page)
    x, y = middle(page)
    page.mouse.move(x, y)
    page.mouse.wheel(0, -400)
    page.mouse.move(5, 5)
    page.wait_for_timeout(100)
    close = picture(page)
    assert close != whole
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y + 30, steps=4)
    page.mouse.up()
    assert page.locator("#selected").is_hidden()  # a drag is no click
    page.mouse.move(5, 5)
    assert picture(page) not in (whole, close)
    page.mouse.move(x - 0.46 * 2 * (x - 5), 300)  # into a corner of the paper
    for _ in range(12):
        page.mouse.wheel(0, -300)
    page.locator("#show-everything").click()
    page.mouse.move(5, 5)
    assert picture(page) == whole
    page.fill("#search", "nobody")
    page.get_by_role("button", name="Clear search").click()
    assert page.locator("#search").input_value() == ""


def test_lost_targets_by_cause_and_priority(open_page):
    plan = small_plan()
    page = open_page(plan)
    losses = page.locator("#losses")
    assert "Lost targets (3)".upper() in losses.inner_text().upper()
    heads = losses.locator("summary").all_inner_texts()
    assert len(heads) == 3
    assert "dropped: its goal touches something at rest (1), priority 1 in all" in heads
    assert HOSTILE in losses.inner_text()
    assert losses.locator(".cause", has_text="offline").get_by_role("button").all_inner_texts() == [
        plan.problem.plane.ids[OFFLINE]
    ]
    page.select_option("#losses select", "distance")
    away = [float(d) for d in re.findall(r"ends ([\d.]+) mm from its target", losses.inner_text())]
    assert away == sorted(away, reverse=True)
    assert page.evaluate("document.activeElement.tagName") == "SELECT"


def red(page):
    """Whether the canvas has a pixel of the colour of blame, once what was asked for is drawn."""
    settle(page)
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
    item = page.locator("#losses .item", has=page.get_by_role("button", name=plan.problem.plane.ids[STUCK], exact=True))
    item = item.filter(has_text="deadlocked")
    distance = next(loss.distance for loss in diagnose(plan).losses if loss.positioner == STUCK)
    assert f"priority 1, ends {distance:.3f} mm from its target" in item.inner_text()
    assert "it ends where it starts" in item.inner_text()
    assert not red(page)
    item.get_by_role("button", name=plan.problem.plane.ids[STUCK], exact=True).click()
    settle(page)
    assert red(page)
    words = page.locator("#selected").inner_text()
    assert words.split("\n")[1] == plan.problem.plane.ids[STUCK]
    assert f"{plan.problem.plane.ids[8]}, F1" in words
    page.keyboard.press("Escape")
    assert not red(page)
    page.locator("#selected").wait_for(state="hidden")


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
    page.locator("#selected .name", has_text=re.compile(f"^{re.escape(first.id)}$")).wait_for()


def test_contacts_are_listed_and_lead_to_their_moment(open_page):
    plan = small_plan(touching=True)
    page = open_page(plan)
    assert "NOT SAFE" in page.locator(".verdict").inner_text()
    contact = plan.certificate.contacts[0]
    page.locator("#trouble button").first.click()
    settle(page)
    assert page.locator("#clock").inner_text().startswith(f"{contact.time:.2f} s")
    words = page.locator("#selected").inner_text()
    assert number(words, "clearance now") == pytest.approx(plan.problem.margin, abs=0.02)
    assert plan.problem.plane.ids[RIGHT] in words


def test_the_worst_moment_is_two_clicks_away(open_page):
    plan = small_plan(touching=True)
    page, ids = open_page(plan), plan.problem.plane.ids
    found = approaches(plan.problem.plane, plan.trajectory, plan.certificate)
    first = page.locator("#closest li").first
    assert first.inner_text().startswith(f"{ids[CENTRE]}, {ids[RIGHT]}")
    first.get_by_role("button").click()
    settle(page)
    assert page.locator("#clock").inner_text().startswith(f"{found.closest[0].time:.2f} s")
    now = number(page.locator("#selected").inner_text(), "clearance now")
    assert now == pytest.approx(found.closest[0].clearance, abs=2e-3)
    assert page.locator("#nearest").inner_text() == f"closest: {now:.3f} mm, {ids[CENTRE]} and {ids[RIGHT]}"
    page.keyboard.press("Home")
    page.keyboard.press("c")
    settle(page)
    assert page.locator("#clock").inner_text().startswith(f"{found.closest[0].time:.2f} s")
    box = page.locator("#clearances").bounding_box()
    page.mouse.click(box["x"] + 8 + (box["width"] - 16) * 0.25, box["y"] + 20)
    settle(page)
    assert page.locator("#clock").inner_text().startswith(f"{0.25 * plan.makespan:.1f}")


def test_curves_of_those_who_are_chosen(open_page):
    plan = small_plan()
    page = open_page(plan)
    assert page.locator("#joints").is_hidden()
    page.mouse.click(*middle(page))
    assert page.locator("#joints").is_visible()
    one = picture(page, "angles")
    assert picture(page, "speeds") != one
    page.get_by_role("button", name="Keep curves").click()
    select(page, plan.problem.plane.ids[STUCK])
    assert picture(page, "angles") != one  # two now
    page.get_by_role("button", name="Clear selection").click()
    page.locator("#joints").wait_for(state="hidden")


def test_legend_fades_a_class_and_shows_all(open_page):
    page = open_page(small_plan())
    before = picture(page)
    arrived = page.locator("#legend button").first
    assert re.fullmatch(r"arrived\s*15", arrived.inner_text().strip())
    arrived.click()
    assert arrived.get_attribute("aria-pressed") == "false"
    assert picture(page) != before
    page.get_by_role("button", name="Show all").click()
    page.mouse.move(5, 5)
    assert picture(page) == before


def test_colours_by_clearance_progress_and_priority(open_page):
    plan = small_plan(touching=True)
    page = open_page(plan)
    seen = {picture(page)}
    counts = {}
    for by in ("clearance", "progress", "priority"):
        page.select_option("#colour", by)
        seen.add(picture(page))
        rows = page.locator("#legend [data-class]").all_inner_texts()
        counts[by] = {label.strip(): int(count) for label, count in (row.rsplit("\n", 1) for row in rows)}
        assert sum(counts[by].values()) == plan.problem.n
    assert len(seen) == 4
    assert counts["clearance"]["below 0.5 mm"] == 2
    assert counts["priority"] == {"priority 1": 19}
    assert counts["progress"]["not started"] == 15
    page.select_option("#colour", "progress")
    page.keyboard.press("End")
    page.locator("#play").focus()
    page.keyboard.press("End")
    settle(page)
    assert page.locator("#legend [data-class='5']").inner_text().split() == ["there", "15"]


@pytest.mark.parametrize("bodies", [None, MIXED], ids=["capsules", "every kind of body"])
def test_colours_by_clearance_now_agree_with_the_library(open_page, bodies):
    plan = small_plan(touching=True) if bodies is None else mixed_plan()
    plane, page = plan.problem.plane, open_page(plan)
    pairs = plane.arm_pairs_within(plane.pair_margin)
    edges = plan.problem.margin + np.array([0, 0.1, 0.3, 0.6, 1, 2])
    page.select_option("#colour", "now")
    for t in (0.0, 4.0, 4.5, 9.5, 9.0, plan.makespan):  # a little on, far, and back
        set_time(page, t)
        gaps = plane.clearance(plan.trajectory.at(t), pairs)
        nearest = [gaps[(pairs == i).any(axis=1)].min() for i in range(plane.n)]
        expected = np.bincount(np.searchsorted(edges, nearest, side="right"), minlength=7)
        found = [int(row.rsplit("\n", 1)[1]) for row in page.locator("#legend [data-class]").all_inner_texts()]
        assert found == expected.tolist(), t


def test_what_lies_over_what_is_explained(open_page):
    words = open_page(mixed_plan()).locator("#shapes").inner_text()
    assert "post keeps the margin from arm, holder, hub; may lie over or under post, cable" in words
    assert "cable can touch nothing" in words


def test_hostile_strings_do_nothing(open_page):
    ids = (HOSTILE, *small_plan().problem.plane.ids[1:])
    page = open_page(small_plan(ids=ids, name=HOSTILE))
    assert HOSTILE in select(page, HOSTILE)
    assert page.locator("h1").inner_text() == f"field-7 on {HOSTILE}"
    assert page.evaluate("window.hit === undefined && document.images.length === 0")


def test_follows_the_reader_by_day_and_night(open_page):
    corner = """node => {
      const ink = new OffscreenCanvas(1, 1).getContext("2d");
      ink.drawImage(node, 9, node.height - 9, 1, 1, 0, 0, 1, 1);
      return ink.getImageData(0, 0, 1, 1).data[0];
    }"""
    for scheme, shade in (("light", 255), ("dark", 14), ("light", 255)):
        page = open_page(small_plan(), color_scheme=scheme)
        assert page.locator("#field").evaluate(corner) == shade


def test_a_plan_without_motion(open_page):
    page = open_page(STILL())
    assert page.locator("#play").is_disabled()
    assert page.locator("#slider").is_disabled()
    assert "No target was asked for".lower() in page.locator("#losses").inner_text().lower()


def test_links_lead_to_a_moment_and_follow(open_page):
    plan = small_plan()
    page, ids = open_page(plan), plan.problem.plane.ids
    page.evaluate("id => { location.hash = `t=3.2&id=${encodeURIComponent(id)}&colour=progress`; }", ids[STUCK])
    page.locator("#selected .name", has_text=ids[STUCK]).wait_for()
    settle(page)
    assert page.locator("#clock").inner_text().startswith("3.20 s")
    assert page.locator("#colour").input_value() == "progress"
    set_time(page, 8)
    page.wait_for_function("() => location.hash.startsWith('#t=8&')")
    # as people write it, unquoted; and just then the page writes what it showed
    page.evaluate("() => { location.hash = '#t=2&id=R+1C2'; history.replaceState(null, '', '#t=8'); }")
    page.locator("#selected .name", has_text="R+1C2").wait_for()
    page.evaluate("id => { location.hash = `t=8&id=${encodeURIComponent(id)}`; }", ids[STUCK])
    page.locator("#selected .name", has_text=ids[STUCK]).wait_for()
    page.reload()
    page.locator("#selected .name", has_text=ids[STUCK]).wait_for()
    assert page.locator("#clock").inner_text().startswith("8.00 s")


def test_saves_a_picture(open_page):
    page = open_page(small_plan())
    set_time(page, 4)
    with page.expect_download() as found:
        page.click("#save")
    assert found.value.suggested_filename == "field-7_on_small_array-4.00s.png"
    content = found.value.path().read_bytes()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = np.frombuffer(content[16:24], ">u4")
    assert [width, height] == page.locator("#field").evaluate("node => [node.width, node.height + 44]")


def audited(path):
    plan = small_plan(touching=True)
    plane, executed = plan.problem.plane, Executed.exactly(plan.trajectory)
    show_motion(plane, executed, plan.certificate, path, "traj.json on small array", [("file", "traj.json")])


def test_a_motion_without_targets_has_the_same_page(open_page):
    page = open_page(audited)
    assert page.locator(".summary").inner_text().strip() == "15 of 19 move in 28.0 s."
    assert "arrived" not in page.locator(".figures").inner_text()
    assert page.locator("#losses").is_hidden()
    assert page.locator("#diagnosis").is_hidden()
    page.locator("#trouble button").first.click()
    settle(page)
    words = page.locator("#selected").inner_text()
    assert "moves" in words
    assert number(words, "clearance now") == pytest.approx(0.5, abs=0.02)


PHONE = {"viewport": (390, 844), "has_touch": True, "device_scale_factor": 2}
LANDSCAPE = (844, 390)


def test_touch_on_a_phone(open_page):
    plan = small_plan()
    page, ids = open_page(plan, **PHONE), plan.problem.plane.ids
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.locator("#field").evaluate("node => node.width / node.clientWidth") == 2
    item = page.locator("#losses").get_by_role("button", name=ids[STUCK], exact=True)
    item.scroll_into_view_if_needed()
    item.tap()
    settle(page)
    box = page.locator("#field").bounding_box()
    assert box["y"] >= -1  # the picture came into view
    assert box["y"] + box["height"] <= 844
    page.locator("#reset").tap()
    settle(page)
    page.touchscreen.tap(*middle(page))
    page.locator("#selected .name", has_text=ids[CENTRE]).wait_for()


def test_landscape_leaves_room_for_the_picture(open_page):
    page = open_page(small_plan(), viewport=LANDSCAPE)
    box = page.locator("#field").bounding_box()
    assert box["height"] > 200
    assert box["width"] > 500
    assert page.locator("#slider").bounding_box()["y"] < 390


def test_two_plans_side_by_side(open_page):
    a, b = small_plan(), small_plan(touching=True)
    page, ids = open_page(a, b), a.problem.plane.ids
    assert page.locator(".verdict").all_inner_texts() == ["✓\nSAFE", "✕\nNOT SAFE"]
    assert page.locator("#clock").inner_text() == "0.00 s of 28.00 s"
    assert page.locator("#trouble").is_hidden()
    before = picture(page), picture(page, "field-B")
    set_time(page, 6)
    assert picture(page) != before[0]
    assert picture(page, "field-B") != before[1]
    page.locator("#tabs button").nth(1).click()
    assert page.locator("#trouble").is_visible()
    page.locator("#trouble button").first.click()
    settle(page)
    assert ids[CENTRE] in page.locator("#selected").inner_text()
    page.keyboard.press("0")
    box = page.locator("#field").bounding_box()
    page.keyboard.press("Home")
    settle(page)
    page.mouse.click(box["x"] + box["width"] / 2 + 2, box["y"] + box["height"] / 2)
    page.locator("#selected .name", has_text=ids[CENTRE]).wait_for()
    assert page.locator("#trouble").is_hidden()  # a click on A tells of A


@pytest.mark.parametrize(("scheme", "touching"), [("light", ()), ("dark", (True,))], ids=["one plan", "two"])
def test_accessible(open_page, scheme, touching):
    page = open_page(small_plan(), *map(small_plan, touching), color_scheme=scheme)
    select(page, small_plan().problem.plane.ids[LOST])
    found = Axe().run(page)["violations"]
    assert [(one["id"], [node["html"][:80] for node in one["nodes"]]) for one in found] == []
