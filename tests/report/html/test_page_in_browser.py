"""Pages in a browser without a network: playing, scrubbing, clicking."""

from pathlib import Path

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from sandbox.measure.compare import compare
from sandbox.report.html.comparison import replay_page
from sandbox.scene.files.load import load
from tests.browser import Browser
from tests.report.html.page_documents import HOSTILE

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

Pages = dict[str, Path]

READY = "document.querySelector('.replay').dataset.ready"
PICTURE = "return document.querySelector('canvas').toDataURL()"
CURSOR = "return Number(document.querySelector('svg.time .cursor').getAttribute('x1'))"
TIME = "return Number(document.querySelector('.replay').dataset.time)"
SCRUB = "const it = document.querySelector('.scrub'); it.value = arguments[0]; it.dispatchEvent(new Event('input'))"


def show_page(browser: Browser, page: Path, **features: str) -> Browser:
    """Show a page and wait until its first replay is unpacked and drawn."""
    browser.show(page, **features)
    browser.wait(READY)
    next_picture(browser)
    return browser


def next_picture(browser: Browser) -> str:
    """Wait for two animation frames, and return the picture of the canvas."""
    browser.driver.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    return str(browser.do(PICTURE))


@pytest.mark.parametrize("kind", ["comparison", "tradeoff", "extremes", "game advice", "overview"])
def test_page_logs_no_errors_and_requests_nothing(kind: str, browser: Browser, pages: Pages) -> None:
    browser.show(pages[kind])
    if kind != "extremes":
        browser.do("document.querySelector('.replay').scrollIntoView()")
        browser.wait(READY)
        next_picture(browser)
    assert browser.log() == []
    assert {url for url in browser.requests() if not url.startswith("data:")} == {pages[kind].as_uri()}
    assert browser.do("return performance.getEntriesByType('resource').length") == 0


@pytest.mark.parametrize("kind", ["comparison", "tradeoff", "extremes", "game advice", "overview"])
def test_hostile_texts_are_shown_and_not_executed(kind: str, browser: Browser, pages: Pages) -> None:
    browser.show(pages[kind])
    assert browser.do("return window.harm === undefined && !document.querySelector('img, #harm')")
    assert HOSTILE in browser.do("return document.documentElement.textContent")
    assert browser.log() == []


def test_content_policy_blocks_injected_markup(browser: Browser, pages: Pages, tmp_path: Path) -> None:
    broken = tmp_path / "broken.html"
    text = pages["extremes"].read_text(encoding="utf-8")
    added = "<script>window.harm=1</script><img src='https://example.invalid/x.png' onerror='window.harm=1'>"
    broken.write_text(text.replace("<main>", f"<main>{added}"), encoding="utf-8")
    browser.show(broken)
    assert browser.do("return window.harm === undefined")
    assert sum("Content Security Policy" in line for line in browser.log()) >= 2  # the script and the picture


def test_play_moves_until_paused(browser: Browser, pages: Pages) -> None:
    show_page(browser, pages["comparison"])
    before = browser.do(PICTURE)
    button = browser.driver.find_element(By.CSS_SELECTOR, "[data-action=play]")
    button.click()
    assert browser.wait("Number(document.querySelector('.replay').dataset.time) > 0.02")
    button.click()
    assert browser.do("return document.querySelector('.replay').dataset.playing") == "false"
    stopped = browser.do(TIME)
    assert next_picture(browser) != before
    assert browser.do(TIME) == stopped


def test_scrubbing_moves_picture_cursor_and_errors(browser: Browser, pages: Pages) -> None:
    show_page(browser, pages["comparison"])
    before, cursor = browser.do(PICTURE), browser.do(CURSOR)
    browser.do(SCRUB, 0.4)
    assert next_picture(browser) != before
    chart = browser.do("const d = document.querySelector('svg.time').dataset; return [d.left, d.right].map(Number)")
    # The scene lasts 1 s; coordinates are written to 0.01.
    assert browser.do(CURSOR) == pytest.approx(0.6 * chart[0] + 0.4 * chart[1], abs=0.01)
    assert cursor == chart[0]
    # Explicit Euler lags the fall by g·h·T/2 = 0.02 m then.
    assert browser.do("return document.querySelector('.legend .error').textContent") == "0.02 m"
    assert browser.do("return document.querySelectorAll('.legend .error')[1].textContent") == "0 m"


def test_click_in_a_chart_seeks_to_its_time(browser: Browser, pages: Pages) -> None:
    show_page(browser, pages["comparison"])
    before = browser.do(PICTURE)
    chart = browser.driver.find_elements(By.CSS_SELECTOR, "svg.time")[1]  # the energy; its axis begins elsewhere
    offset = browser.do(
        "const [chart] = arguments, box = chart.getBoundingClientRect(), d = chart.dataset;"
        "return ((Number(d.left) + 0.75 * (d.right - d.left)) / d.width - 0.5) * box.width",
        chart,
    )
    ActionChains(browser.driver).move_to_element_with_offset(chart, round(offset), 0).click().perform()
    assert browser.do(TIME) == pytest.approx(0.75, abs=0.003)  # one pixel of 400 per second
    assert next_picture(browser) != before
    ActionChains(browser.driver).move_to_element(chart).click_and_hold().move_by_offset(-5000, 0).release()
    assert float(browser.do("return document.querySelector('.scrub').value")) == pytest.approx(0.75, abs=0.003)  # same


def test_legend_hides_an_engine(browser: Browser, pages: Pages) -> None:
    show_page(browser, pages["comparison"])
    browser.do(SCRUB, 0.9)
    before = next_picture(browser)
    box = browser.driver.find_element(By.CSS_SELECTOR, "[data-track=pymunk]")
    box.click()
    assert next_picture(browser) != before
    assert browser.do("return document.querySelector('.replay').dataset.shown") == "exact,truth"
    hidden = "return [...document.querySelectorAll('svg.time .line.e0')].map((it) => getComputedStyle(it).display)"
    assert set(browser.do(hidden)) == {"none"}
    box.click()
    assert next_picture(browser) == before


def test_keys_step_play_and_zoom(browser: Browser, pages: Pages) -> None:
    show_page(browser, pages["comparison"])
    replay = browser.driver.find_element(By.CSS_SELECTOR, ".replay")
    browser.do("arguments[0].focus()", replay)
    keys = ActionChains(browser.driver)
    keys.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_LEFT).perform()
    assert browser.do(TIME) == pytest.approx(0.02, abs=1e-9)  # frames lie at k·0.01, written to nine digits
    ActionChains(browser.driver).send_keys(Keys.END).perform()
    assert browser.do(TIME) == 1.0
    ActionChains(browser.driver).send_keys(Keys.HOME).perform()
    assert browser.do(TIME) == 0.0
    before = next_picture(browser)
    ActionChains(browser.driver).send_keys("+").perform()
    assert next_picture(browser) != before
    ActionChains(browser.driver).send_keys("0").perform()
    assert next_picture(browser) == before
    ActionChains(browser.driver).send_keys(" ").perform()
    assert browser.do("return document.querySelector('.replay').dataset.playing") == "true"
    ActionChains(browser.driver).send_keys(" ").perform()
    assert browser.do("return document.querySelector('.replay').dataset.playing") == "false"


def test_dragging_and_wheel_move_the_picture(browser: Browser, pages: Pages) -> None:
    show_page(browser, pages["comparison"])
    canvas = browser.driver.find_element(By.CSS_SELECTOR, "canvas")
    browser.do("arguments[0].scrollIntoView({block: 'center'})", canvas)
    before = next_picture(browser)
    wheel = "arguments[0].dispatchEvent(new WheelEvent('wheel', {deltaY: -200, cancelable: true, bubbles: true}))"
    assert browser.do(f"return {wheel}", canvas)  # without focus, the wheel scrolls the page
    assert next_picture(browser) == before
    ActionChains(browser.driver).drag_and_drop_by_offset(canvas, 60, 30).perform()
    moved = next_picture(browser)
    assert moved != before
    assert not browser.do(f"return {wheel}", canvas)
    assert next_picture(browser) != moved


def test_reduced_motion_stops_at_the_end(browser: Browser, pages: Pages) -> None:
    show_page(browser, pages["comparison"], prefers_reduced_motion="reduce")
    browser.do(SCRUB, 0.98)
    browser.driver.find_element(By.CSS_SELECTOR, "[data-action=play]").click()
    assert browser.wait("document.querySelector('.replay').dataset.playing === 'false'")
    assert browser.do(TIME) == 1.0


def test_dark_theme_and_print_have_different_colours(browser: Browser, pages: Pages) -> None:
    show_page(browser, pages["comparison"], prefers_color_scheme="dark")
    background = "return getComputedStyle(document.body).backgroundColor"
    dark, picture = browser.do(background), browser.do(PICTURE)
    browser.do("window.dispatchEvent(new Event('beforeprint'))")
    printed = browser.do(PICTURE)
    browser.do("window.dispatchEvent(new Event('afterprint'))")
    assert browser.do(PICTURE) == picture
    show_page(browser, pages["comparison"], prefers_color_scheme="light")
    assert browser.do(background) != dark
    assert browser.do(PICTURE) == printed != picture


def test_distant_replays_are_unpacked_when_scrolled_into_view(browser: Browser, pages: Pages) -> None:
    browser.show(pages["overview"])
    last = "[...document.querySelectorAll('.replay')].at(-1)"
    next_picture(browser)
    assert browser.do(f"return {last}.dataset.ready") is None
    browser.do(f"{last}.scrollIntoView({{behavior: 'instant'}})")
    assert browser.wait(f"{last}.dataset.ready") == "true"


def test_selected_point_of_a_trade_off_shows_its_settings(browser: Browser, pages: Pages) -> None:
    browser.show(pages["tradeoff"])
    settings_script = "return document.querySelector('.chosen code').textContent"
    answer = '[solver]  # reference\ndt = 0.01\nsubsteps = 1\niterations = 10\nintegrator = "velocity_verlet"'
    assert browser.do(settings_script) == answer  # the cheapest within the tolerance is selected initially
    browser.driver.find_element(By.CSS_SELECTOR, "[data-point='1']").click()
    assert browser.do(settings_script).startswith("[solver]  # pymunk\ndt = 0.001\n")
    browser.do("document.querySelector('[data-point=\"0\"]').focus()")
    ActionChains(browser.driver).send_keys(Keys.ARROW_RIGHT).perform()
    assert browser.do("return document.querySelector('.tradeoff').dataset.chosen") == "3"  # the next point of the front
    browser.driver.find_element(By.CSS_SELECTOR, "[data-point='2']").click()
    assert HOSTILE in browser.do("return document.querySelector('.chosen').textContent")


@pytest.mark.parametrize("width", [360, 800, 1600])
@pytest.mark.parametrize("kind", ["comparison", "tradeoff", "extremes", "game advice", "overview"])
def test_page_is_not_wider_than_its_window(kind: str, width: int, browser: Browser, pages: Pages) -> None:
    browser.show(pages[kind])
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    assert browser.do("return document.documentElement.scrollWidth") <= width


def test_slider_of_a_sweep_shows_one_value_at_a_time(browser: Browser, tmp_path: Path) -> None:
    steps = [0.01, 0.02, 0.04, 0.05, 0.1, 0.2, 0.25]  # more runs than colours
    comparison = compare(load("ball"), ("pymunk",), sweep={"solver.dt": steps})
    page = tmp_path / "sweep.html"
    page.write_text(replay_page(comparison).html(), encoding="utf-8")
    show_page(browser, page)
    shown = "return document.querySelector('.replay').dataset.shown"
    solid = "return document.querySelectorAll('svg.time:first-child .line:not([data-off])').length"
    assert browser.do(shown) == "pymunk, dt 0.25,truth"
    slide = "const it = document.querySelector('.swept input'); it.value = 1; it.dispatchEvent(new Event('input'))"
    before = next_picture(browser)
    browser.do(SCRUB, 0.9)
    browser.do(slide)
    assert next_picture(browser) != before
    assert browser.do(shown) == "pymunk, dt 0.02,truth"
    assert browser.do("return document.querySelector('output.value').textContent") == "0.02"
    assert browser.do(solid) == 1  # its error
    time = browser.do(TIME)
    browser.do("document.querySelector('.swept input').focus()")
    ActionChains(browser.driver).send_keys(Keys.ARROW_RIGHT).perform()
    next_picture(browser)
    assert browser.do(shown) == "pymunk, dt 0.04,truth"
    ActionChains(browser.driver).send_keys(Keys.HOME).perform()
    next_picture(browser)
    assert browser.do(shown) == "pymunk, dt 0.01,truth"
    assert browser.do(TIME) == time
    browser.do("document.querySelector('[data-action=all]').click()")
    next_picture(browser)
    assert browser.do(shown).count("pymunk") == len(steps)
    assert browser.do(solid) == len(steps)


PICTURES = "return [...document.querySelectorAll('canvas')].map((it) => it.toDataURL())"


def test_runs_of_a_game_share_time_and_view(browser: Browser, pages: Pages) -> None:
    browser.show(pages["game advice"])
    browser.do("document.querySelector('.replay').scrollIntoView()")
    browser.wait(READY)
    next_picture(browser)
    assert browser.do(TIME) == pytest.approx(59 / 60, abs=1e-5)  # the first differing contact, to six digits
    assert browser.do("return document.querySelectorAll('.marks .mark').length") == 1
    for change in (
        (SCRUB, 1.5),
        ("document.querySelector('[data-action=nearer]').click()",),
        ("document.querySelector('[data-track=truth]').click()",),
    ):
        before = browser.do(PICTURES)
        browser.do(*change)
        next_picture(browser)
        assert all(new != old for new, old in zip(browser.do(PICTURES), before, strict=True))
    cursors = browser.do("return [...document.querySelectorAll('svg.time')].map((it) => Number(it.dataset.time))")
    assert cursors == [1.5, 1.5, 1.5]  # the marks of two runs, and the errors
    # The present setting is 6 · 90/120 units of 0.5 px off then.
    assert browser.do("return document.querySelector('.legend .error').textContent") == "2.25 px"


def test_drag_in_the_marks_of_a_run_seeks(browser: Browser, pages: Pages) -> None:
    browser.show(pages["game advice"])
    marks = browser.driver.find_element(By.CSS_SELECTOR, ".marks svg")
    browser.do("arguments[0].scrollIntoView({block: 'center'})", marks)
    browser.wait(READY)
    ActionChains(browser.driver).move_to_element(marks).click().perform()
    assert browser.do(TIME) == pytest.approx(1.0, abs=0.005)  # half of 2 s, within a pixel of 900


def test_ring_marks_a_lost_contact_in_its_run(browser: Browser, pages: Pages) -> None:
    browser.show(pages["game advice"])
    browser.do("document.querySelector('.replay').scrollIntoView()")
    browser.wait(READY)
    browser.do("document.documentElement.style.setProperty('--bad', '#00ff00')")
    green = (
        "return [...document.querySelectorAll('canvas')].map((it) => {"
        "const { data } = it.getContext('2d').getImageData(0, 0, it.width, it.height); let count = 0;"
        "for (let k = 0; k < data.length; k += 4) count += data[k] < 60 && data[k + 1] > 200 && data[k + 2] < 60;"
        "return count; })"
    )
    browser.do(SCRUB, 59 / 60)
    next_picture(browser)
    truth, present, recommended = browser.do(green)
    assert truth == recommended == 0
    assert present > 60  # px: the ring alone has 2π · 10 · 2, some of them blended with the background
    browser.do(SCRUB, 1.9)
    next_picture(browser)
    assert browser.do(green) == [0, 0, 0]


def test_sweep_over_words_has_no_slider() -> None:
    sweep = {"solver.integrator": ["explicit_euler", "rk4"]}
    comparison = compare(load("ball"), ("reference",), sweep=sweep)
    assert 'class="swept"' not in replay_page(comparison).html()
