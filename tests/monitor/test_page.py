"""The page in a real browser: Playwright with Debian's Chromium."""

import shutil
from pathlib import Path

import pytest

from tests.monitor.conftest import WAIT_S

CHROMIUM = shutil.which("chromium")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium: apt-get install chromium"),
    # Playwright leaves a socket to its driver behind when it is stopped.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
MS = 1000 * WAIT_S


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs pip install playwright")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def tab(browser, served):
    """A function that opens a page; what the pages complain of and ask other hosts for fails the test at its end."""
    monitor, url = served
    wrong, pages = [], []

    def open_page(path="", width=1280):
        page = browser.new_page(viewport={"width": width, "height": 850})
        page.set_default_timeout(MS)
        page.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on(
            "request", lambda request: None if request.url.startswith((url, "data:")) else wrong.append(request.url)
        )
        page.goto(url + "/" + path)
        pages.append(page)
        return page

    yield monitor, open_page
    for page in pages:
        page.close()
    assert wrong == []


def test_a_machine_appears_and_wears_without_a_reload(tab):
    monitor, open_page = tab
    page = open_page()
    page.get_by_role("heading", name="No machine has sent samples yet.").wait_for()
    monitor.send(5, 1.0)
    page.get_by_role("heading", name="The machine runs as usual.").wait_for()
    monitor.send(6, 7.0)
    page.get_by_role("heading", name="One machine needs attention").wait_for()
    page.get_by_role("link", name="press-1").click()
    page.get_by_text("backlash (the network is 90 % sure of it).").wait_for()
    page.get_by_role("link", name="Play in the reducer").click()
    page.get_by_role("heading", name="Trend, 60 rpm").wait_for()
    page.locator(".chart canvas").first.wait_for()
    page.get_by_role("link", name="11", exact=True).click()
    page.get_by_role("heading", name="Turn 11, press-1").wait_for()
    assert page.locator(".chart canvas").count() == 2


def test_what_physics_says_comes_to_the_page_by_itself_in_the_units_that_are_told(tab):
    monitor, open_page = tab
    monitor.api.physical, monitor.diagnoser.units = True, {"backlash_deg": "° at the motor shaft"}
    monitor.send(6, 5.0)
    page = open_page("#/m/press-1")
    page.get_by_text("No answer yet").wait_for()
    page.get_by_text("5° (4.5° to 5.5°)").first.wait_for()
    answer = {"headline": "Faulty: play in the reducer.", "remarks": ["1.4 times the noise remains."], "turns": 3}
    monitor.store.write_explanation("press-1", 6, 0, {**answer, "level": 1.4, "before": 9.0, "took_s": 12.0})
    monitor.send(1, 5.0)
    page.get_by_text("Faulty: play in the reducer.").wait_for()
    page.get_by_text("1.4 times the noise, 9.0 times without a fault").wait_for()
    page.get_by_role("link", name="Play in the reducer").click()
    page.get_by_text("In ° at the motor shaft.").wait_for()


def test_an_alarm_is_acknowledged_in_one_tab_and_seen_in_another(tab):
    monitor, open_page = tab
    monitor.send(6, 5.0)
    first, second = open_page("#/m/press-1"), open_page("#/m/press-1")
    second.get_by_text("not acknowledged").wait_for()
    first.get_by_role("button", name="Acknowledge").press("Enter")
    first.get_by_label("Note (optional)").fill("bearing <b>ordered</b>")
    first.get_by_role("button", name="Save").press("Enter")
    first.get_by_text("local operator: bearing <b>ordered</b>").wait_for()
    second.get_by_text("local operator: bearing <b>ordered</b>").wait_for()
    assert second.get_by_text("not acknowledged").count() == 0


def test_what_is_shown_of_a_machine_is_its_own(tab):
    """Where the answer for another one comes late, and where none comes."""
    monitor, open_page = tab
    for name, turns in (("press-1", 6), ("turner-1", 9)):
        monitor.send(turns, 5.0, machine=name)
    page = open_page("#/m/press-1/f/backlash_deg")
    page.get_by_role("link", name="6", exact=True).wait_for()
    held = []
    page.route("**/api/machines/turner-1/turns?*", lambda route: held.append(route))
    page.evaluate("location.hash = '#/m/turner-1/f/backlash_deg'")
    while not held:
        page.wait_for_timeout(20)
    monitor.send(1, 5.0, machine="crane-1")  # which draws the page anew meanwhile
    page.get_by_role("heading", name="turner-1").wait_for()
    assert page.locator(".chart canvas").count() == 0 and page.get_by_role("link", name="6", exact=True).count() == 0
    page.evaluate("location.hash = '#/m/press-1/f/backlash_deg'")
    page.get_by_role("link", name="6", exact=True).wait_for()
    held[0].continue_()
    page.wait_for_timeout(500)
    monitor.send(1, 5.0, machine="crane-1")
    page.wait_for_timeout(500)
    assert page.get_by_role("link", name="9", exact=True).count() == 0


def test_a_dead_sensor_is_shown_as_such(tab):
    monitor, open_page = tab
    monitor.send(5, 1.0)
    page = open_page()
    page.get_by_role("heading", name="The machine runs as usual.").wait_for()
    monitor.send(1, 0.0)
    page.get_by_text("Not diagnosed: it is dead").wait_for()
    page.get_by_role("heading", name="One machine needs attention").wait_for()
    monitor.send(1, 1.0)
    page.get_by_text("Not diagnosed: it is dead").wait_for(state="detached")
    page.get_by_role("heading", name="The machine runs as usual.").wait_for()


def test_a_repair_is_told_on_the_page(tab):
    monitor, open_page = tab
    monitor.send(6, 5.0)
    page = open_page("#/m/press-1/f/backlash_deg")
    page.get_by_role("button", name="Repaired").press("Enter")
    page.get_by_text("Trend and remaining time begin anew").wait_for()
    page.get_by_label("Note (optional)").fill("new reducer")
    page.get_by_role("button", name="Save").press("Enter")
    page.get_by_text("local operator: new reducer").wait_for()
    page.get_by_text("No turn was diagnosed yet.").wait_for()


def test_a_silent_machine_and_a_broker_that_is_away_are_shown_as_such(tab):
    monitor, open_page = tab
    troubles = monitor.api.troubles = ["the broker plant:1883 cannot be reached (no route); trying again"].copy
    page = open_page()
    page.get_by_text(troubles()[0]).wait_for()
    monitor.send(1, 1.0)
    page.get_by_role("heading", name="No alarm, but it is not certain that the machine runs as usual.").wait_for()
    monitor.engine._stale_s = 0.2
    page.get_by_text("no samples have come since 2027-01-15").wait_for()
    page.get_by_role("heading", name="One machine needs attention").wait_for()
    monitor.api.troubles = list
    monitor.hub.again()
    page.get_by_text(troubles()[0]).wait_for(state="detached")


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("path", ["", "#/m/press-1", "#/m/press-1/f/backlash_deg", "#/m/press-1/t/2", "#/m/nobody"])
def test_no_view_is_wider_than_the_screen(tab, path, width):
    monitor, open_page = tab
    monitor.send(6, 5.0)
    page = open_page(path, width)
    page.get_by_role("heading", level=1).wait_for()
    page.get_by_text("live").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_what_is_shipped_is_small_and_drawn_at_once(tab):
    _, open_page = tab
    page = open_page()
    page.get_by_text("live").wait_for()
    shipped = page.evaluate(
        "performance.getEntriesByType('resource').filter(e => /\\.(js|css)$/.test(e.name))"
        ".reduce((sum, e) => sum + e.encodedBodySize, 0)"
    )
    assert 0 < shipped <= 300 * 1024


@pytest.mark.parametrize("width", [1280, 390])
def test_axe_finds_nothing(tab, width):
    package = pytest.importorskip("axe_playwright_python", reason="needs pip install axe-playwright-python")
    axe = (Path(package.__file__).parent / "axe.min.js").read_text(encoding="utf-8")
    monitor, open_page = tab
    monitor.send(6, 7.0)
    for path in ("", "#/m/press-1", "#/m/press-1/f/backlash_deg", "#/m/press-1/t/2"):
        page = open_page(path, width)
        page.get_by_text("live").wait_for()
        page.get_by_role("heading", level=1).wait_for()
        # The page's own policy forbids foreign scripts, so axe is evaluated by the debugger.
        page.evaluate(axe)
        found = page.evaluate(
            "axe.run().then(r => r.violations.map(v => v.id + ': ' + v.nodes.map(n => n.html).join(' ')))"
        )
        assert found == [], path
