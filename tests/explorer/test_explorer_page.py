"""The explorer's page in a browser: Debian's Chromium, run by playwright.

The shown pixels are compared with those of the renderer.
"""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.exhaustive import by_turns
from tests.explorer.explorer_hosts import CHROMIUM, PATIENCE, wait_until
from tests.explorer.pages import Viewer, open_clip, picture_of
from tests.framebuffers import decode
from vkbloom import KinoBloom, Pyramid, Renderer, Scene, Separable, presets

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

ASPECT = (1280, 720)


@pytest.fixture(scope="module")
def scene_url(
    serve: Callable[[Callable[[], Viewer]], str], scene: Scene, renderer: Renderer
) -> str:
    return serve(lambda: Viewer(scene, renderer=renderer, size=ASPECT, shading="forward"))


@contextmanager
def show(page: Page, url: str) -> Iterator[None]:
    """Show an address in a page and wait for its first picture. An error or warning of the page
    fails the test."""
    complaints: list[str] = []

    def note(said: Any) -> None:
        complaints.append(str(getattr(said, "text", said)))

    page.set_default_timeout(1000 * PATIENCE)
    page.on("console", note)
    page.on("pageerror", note)
    page.set_viewport_size({"width": 980, "height": 640})
    page.emulate_media(color_scheme="light")
    page.mouse.move(0, 0)
    # An address that differs after its # alone would not load the page again.
    page.goto("about:blank")
    page.goto(url)
    page.locator(".vkb-status", has_text="until shown").wait_for()
    yield
    page.remove_listener("console", note)
    page.remove_listener("pageerror", note)
    assert complaints == []


@contextmanager
def open_page(browser: Browser, url: str, **options: Any) -> Iterator[Page]:
    """Show an address in a page of its own."""
    page = browser.new_page(**options)
    with show(page, url):
        yield page
    page.close()


@pytest.fixture(scope="module")
def tab(browser: Browser) -> Page:
    """The page of all tests that need none of their own."""
    return browser.new_page()


@pytest.fixture
def page(tab: Page, scene_url: str) -> Iterator[Page]:
    with show(tab, scene_url):
        yield tab


def see(page: Page, folder: Path) -> NDArray[np.uint8]:
    """Return the part of the screen that shows the framebuffer, without the wipe's handle."""
    visibility = 'document.querySelector(".vkb-divider").style.visibility = '
    page.evaluate(visibility + '"hidden"')
    # To hide the caret, a style sheet would be put into the page, which lets none in.
    picture = page.locator(".vkbloom canvas").screenshot(caret="initial")
    page.evaluate(visibility + '"visible"')
    return decode(picture, folder)[:, :, :3]


def field(page: Page, name: str) -> Locator:
    return page.locator(f'[data-field="{name}"]')


def wait_for_code(page: Page, code: str) -> None:
    from playwright.sync_api import expect

    # It changes with the picture that it is of.
    expect(page.locator(".vkb-foot code")).to_have_text(code, timeout=1000 * PATIENCE)


def size_of(picture: NDArray[Any]) -> tuple[int, int]:
    return picture.shape[1], picture.shape[0]


def assert_shows(
    picture: NDArray[np.uint8], renderer: Renderer, scene: Scene, settings: Any
) -> None:
    expected = renderer.render(scene, settings, size_of(picture), framebuffers="final")["final"]
    assert np.array_equal(picture, expected[:, :, :3])


def test_the_controls_on_its_own_page(
    page: Page, renderer: Renderer, scene: Scene, tmp_path: Path
) -> None:
    """Move the controls, and compare each picture with the renderer's."""

    def show() -> NDArray[np.uint8]:
        return see(page, tmp_path)

    box = size_of(show())
    assert abs(box[0] / box[1] - ASPECT[0] / ASPECT[1]) < 0.01
    assert_shows(show(), renderer, scene, Separable())

    field(page, "blur_scale").fill("0.1")
    wait_for_code(page, "vkbloom.Separable(blur_scale=0.1)")
    assert_shows(show(), renderer, scene, Separable(blur_scale=0.1))
    field(page, "bloom").uncheck()
    wait_for_code(page, "vkbloom.Separable(bloom=False, blur_scale=0.1)")
    assert_shows(show(), renderer, scene, Separable(bloom=False))

    page.get_by_label("method").select_option("pyramid")
    field(page, "bloom").check()
    field(page, "levels").fill("3")
    field(page, "tonemap").select_option("aces")
    field(page, "exposure").fill("1")
    page.get_by_label("threshold, on").check()
    field(page, "threshold").fill("0.5")
    settings = Pyramid(levels=3, tonemap="aces", exposure=1, threshold=0.5)
    code = 'vkbloom.Pyramid(threshold=0.5, tonemap="aces", exposure=1.0, levels=3)'
    wait_for_code(page, code)
    assert_shows(show(), renderer, scene, settings)

    # The half on the right is B's: A as it began, without bloom.
    page.get_by_label("wipe A | B").check()
    page.locator(".vkb-divider").press("ArrowRight")
    page.locator(".vkb-status", has_text="until shown").wait_for()
    left = round(0.52 * box[0])
    expected = renderer.render(scene, settings, box)["final"][:, :, :3].copy()
    expected[:, left:] = renderer.render(scene, Separable(bloom=False), box)["final"][:, left:, :3]
    # B's picture comes on its own.
    wait_until(lambda: np.array_equal(show(), expected))
    page.get_by_label("wipe A | B").uncheck()
    assert_shows(show(), renderer, scene, settings)


def test_presets_and_methods(page: Page, renderer: Renderer, scene: Scene, tmp_path: Path) -> None:
    page.get_by_label("preset").select_option("outline")
    wait_for_code(page, 'vkbloom.presets["outline"]')
    assert_shows(see(page, tmp_path), renderer, scene, presets["outline"])
    # The picture is developed as before when the method changes.
    field(page, "exposure").fill("2")
    page.get_by_label("method").select_option("kino")
    wait_for_code(page, "vkbloom.KinoBloom(exposure=2.0)")
    assert page.get_by_label("preset").input_value() == ""
    # And when a preset is chosen.
    page.get_by_label("preset").select_option("jimenez2014")
    wait_for_code(page, 'vkbloom.presets["jimenez2014"].replace(exposure=2.0)')


def test_point_spread_functions(tab: Page, serve: Any, renderer: Renderer) -> None:
    # Transforms of a small picture are quick to compile.
    url = serve(lambda: Viewer(np.ones((9, 16, 3), np.float32), renderer=renderer))
    with show(tab, url):
        choose_point_spread_functions(tab)


def choose_point_spread_functions(page: Page) -> None:
    page.get_by_label("preset").select_option("camera_lens")
    wait_for_code(page, 'vkbloom.presets["camera_lens"]')
    assert field(page, "psf").input_value() == "harvey_shack"
    field(page, "surfaces").fill("20")
    page.locator(".vkb-foot code", has_text="surfaces=20").wait_for()
    field(page, "psf").select_option("gaussian")
    page.locator(".vkb-foot code", has_text="vkbloom.psf.gaussian(sigma=8.0)").wait_for()
    field(page, "psf").select_option("aperture")
    field(page, "mask.blades").fill("5")
    page.locator(".vkb-foot code", has_text="blades=5").wait_for()
    # The preset is as before.
    page.get_by_label("preset").select_option("iris_6")
    wait_for_code(page, 'vkbloom.presets["iris_6"]')
    assert field(page, "mask.blades").input_value() == "6"
    # No pass writes the kernel.
    page.get_by_label("framebuffer").select_option("kernel")
    page.get_by_text("kernel is the point-spread function, which no pass writes").wait_for()


def test_stages_of_glare(page: Page) -> None:
    """A published glare has controls of each stage; stages can be added."""
    code = page.locator(".vkb-foot code")
    page.get_by_label("method").select_option("pyramid")
    page.get_by_text("More", exact=True).click()
    field(page, "glare").select_option("three_lensflare")
    code.filter(has_text="Ghosts(").wait_for()
    field(page, "glare.0.falloff").fill("8")
    code.filter(has_text="falloff=8.0").wait_for()
    field(page, "glare.more").select_option("streaks")
    field(page, "glare.1.directions").fill("2")
    code.filter(has_text="directions=2").wait_for()
    assert field(page, "glare").input_value() == "own"
    assert "streaks" in page.get_by_label("framebuffer").inner_text()
    # The published one is as before.
    field(page, "glare").select_option("three_lensflare")
    assert field(page, "glare.0.falloff").input_value() == "25"
    field(page, "glare").select_option("")
    wait_for_code(page, "vkbloom.Pyramid()")


def test_refused_value_is_shown_with_the_reason(page: Page) -> None:
    """It stands below its field, which says so to screen readers, too."""
    field(page, "intensity").locator("xpath=following-sibling::input").fill("-1")
    message = page.locator(".vkb-field:has([data-field=intensity]) + .vkb-error")
    message.get_by_text("intensity: -1").wait_for()
    assert message.get_attribute("role") == "alert"
    invalid = page.locator("[aria-invalid=true]")
    assert invalid.count() == 2
    assert invalid.first.get_attribute("aria-describedby") == message.get_attribute("id")
    assert page.locator(".vkb-foot .vkb-error").inner_text() == ""
    field(page, "intensity").fill("2")
    wait_for_code(page, "vkbloom.Separable(intensity=2.0)")
    assert message.count() == invalid.count() == 0


def test_an_error_opens_what_hides_its_field(page: Page) -> None:
    page.get_by_text("More", exact=True).click()
    number = field(page, "bloom_scale").locator("xpath=following-sibling::input")
    number.fill("0")
    message = page.locator(".vkb-field:has([data-field=bloom_scale]) + .vkb-error")
    message.get_by_text("bloom_scale: 0").wait_for()
    page.get_by_text("More", exact=True).click()
    number.evaluate("input => input.dispatchEvent(new Event('input'))")
    message.wait_for()
    assert page.locator(".vkb-fields details").get_attribute("open") is not None


def test_every_framebuffer(page: Page, renderer: Renderer, scene: Scene, tmp_path: Path) -> None:
    picker = page.get_by_label("framebuffer")
    names = picker.locator("option").all_inner_texts()
    frames = renderer.render(scene, None, (320, 180))
    assert names == list(frames)
    picker.select_option("glow")
    page.locator(".vkb-status", has_text="256 × 256").wait_for()
    # A square in a wide box: its own aspect, its pixels enlarged.
    width, height = size_of(see(page, tmp_path))
    assert abs(width - height) <= 1
    # Pyramid has no such framebuffer, and Separable none of Pyramid's.
    picker.select_option("blur_vertical")
    page.get_by_label("method").select_option("pyramid")
    wait_for_code(page, "vkbloom.Pyramid()")
    assert picker.input_value() == "final"
    assert "down_3" in picker.locator("option").all_inner_texts()


def test_the_plan_has_the_times_of_its_passes(
    page: Page, renderer: Renderer, scene: Scene, tmp_path: Path
) -> None:
    page.get_by_text("Plan", exact=True).click()
    plan = renderer.plan(scene, None, size_of(see(page, tmp_path)), framebuffers="final")
    rows = page.locator(".vkb-plan tbody tr")

    def times() -> dict[str, str]:
        found = zip(
            rows.locator("th").all_inner_texts(), rows.locator("th + td").all(), strict=True
        )
        return {name: cell.inner_text() for name, cell in found}

    for row, one in zip(rows.all(), plan.passes, strict=True):
        reads, writes = ", ".join(one.reads), ", ".join(one.writes)
        cells = row.locator("td").all_inner_texts()
        assert cells[-4:] == [one.shader, one.variant, reads, writes]
    # Skybox and saucer are one render pass with one time.
    assert list(times()) == list(dict.fromkeys(one.name for one in plan.passes))
    assert len(plan.passes) > len(times())
    field(page, "intensity").fill("1.5")
    wait_for_code(page, "vkbloom.Separable(intensity=1.5)")
    assert re.fullmatch(r"[\d.]+ ms, \d+ %", times()["final"])
    assert times()["scene"] == "up to date"


def test_the_pointer_reads_values(
    page: Page, renderer: Renderer, scene: Scene, tmp_path: Path
) -> None:
    box = size_of(see(page, tmp_path))
    expected = renderer.render(scene, None, box)
    for name in ("final", "depth"):
        page.get_by_label("framebuffer").select_option(name)
        page.locator(".vkb-status", has_text=str(expected[name].dtype)).wait_for()
        page.locator("canvas").hover(position={"x": 123, "y": 45})
        values = "  ".join(str(value) for value in np.atleast_1d(expected[name][45, 123]))
        page.get_by_text(f"{name}[45, 123] = {values}", exact=True).wait_for()
    page.mouse.move(1, 1)
    page.get_by_text("Point at the picture").wait_for()
    # It comes to the picture while another framebuffer is on its way, which takes long.
    page.evaluate(
        """() => {
            const decode = window.createImageBitmap;
            window.createImageBitmap = async (...whatever) => {
                await new Promise((done) => setTimeout(done, 500));
                return decode(...whatever);
            };
        }"""
    )
    page.get_by_label("framebuffer").select_option("final")
    page.locator("canvas").hover(position={"x": 123, "y": 45})
    page.locator(".vkb-status", has_text="uint8").wait_for()
    values = "  ".join(str(value) for value in expected["final"][45, 123])
    page.get_by_text(f"final[45, 123] = {values}", exact=True).wait_for()


def test_time_plays_and_pauses(
    page: Page, renderer: Renderer, scene: Scene, tmp_path: Path
) -> None:
    from playwright.sync_api import expect

    still = see(page, tmp_path)
    slider = page.get_by_label("time, in turns")
    page.get_by_role("button", name="Play").click()
    # (The page's policy forbids the strings that `wait_for_function` would evaluate.)
    expect(slider).not_to_have_value("0", timeout=1000 * PATIENCE)
    page.get_by_role("button", name="Pause").click()
    moment = float(slider.input_value())
    assert 0 < moment < 0.9
    page.wait_for_timeout(300)
    assert float(slider.input_value()) == moment
    assert not np.array_equal(see(page, tmp_path), still)
    slider.fill("0.25")
    expected = renderer.render(scene, None, size_of(still), time=0.25)["final"]
    wait_until(lambda: np.array_equal(see(page, tmp_path), expected[:, :, :3]))


#: The frames of a sequence, whose light changes.
CLIP = [
    (np.random.default_rng(3).random((30, 40, 3)) ** 8 * 20 * 4.0 ** (number > 5)).astype("float16")
    for number in range(12)
]


@pytest.fixture(scope="module")
def clip_url(serve: Callable[[Callable[[], Viewer]], str], renderer: Renderer) -> str:
    def new_viewer() -> Viewer:
        clip = open_clip(CLIP, fps=24, exposure="bevy")
        return Viewer(CLIP[0], KinoBloom(), renderer=renderer, clip=clip)

    return serve(new_viewer)


def test_a_sequence(tab: Page, clip_url: str, renderer: Renderer, tmp_path: Path) -> None:
    """It is scrubbed and played; the curve of its exposure grows to its end by itself."""
    from playwright.sync_api import expect

    page = tab

    def middles(seen: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the middle of each pixel, which is enlarged."""
        rows, columns = (
            ((np.arange(count) + 0.5) * side / count).astype(int)
            for count, side in zip((30, 40), seen.shape[:2], strict=True)
        )
        return seen[np.ix_(rows, columns)]

    def assert_shows_frame(number: int, exposure: Any = "bevy") -> None:
        how: dict[str, Any] = {"fps": 24, "renderer": renderer, "exposure": exposure}
        made = [*vkbloom.sequence(CLIP, KinoBloom(), **how)][number]["final"]
        shown = picture_of(made, "final", encoding="none", stops=0.0)
        page.locator(".vkb-moment", has_text=f"frame {number + 1} of 12").wait_for()
        wait_until(lambda: np.array_equal(middles(see(page, tmp_path)), decode(shown, tmp_path)))

    with show(page, clip_url):
        assert_shows_frame(0)
        slider = page.get_by_label("frame", exact=True)
        page.get_by_role("img", name="exposure of 12 of 12 frames").wait_for()
        slider.fill("8")
        assert_shows_frame(8)
        assert slider.evaluate("one => one.ariaValueText") == "0.33 s, frame 9 of 12"
        page.locator(".vkb-stage").press(".")
        assert_shows_frame(9)
        exposure = page.get_by_role("combobox", name="exposure of")
        exposure.select_option("granite")
        assert_shows_frame(9, "granite")
        page.wait_for_url("**granite**")
        link = page.url
        exposure.select_option("")
        assert_shows_frame(9, None)
        expect(page.locator(".vkb-curve")).to_be_hidden()
        exposure.select_option("bevy")
        page.get_by_label("speed").select_option("0.1")
        page.locator(".vkb-stage").press(" ")
        page.locator(".vkb-moment", has_text="frame 11 of 12").wait_for()
        page.get_by_role("button", name="Pause").click()
        page.locator(".vkb-curve").click(position={"x": 9, "y": 20})
        assert_shows_frame(0)
    with show(page, link):
        assert_shows_frame(9, "granite")


def test_code_is_copied(browser: Browser, scene_url: str) -> None:
    with open_page(browser, scene_url) as page:
        page.context.grant_permissions(["clipboard-read", "clipboard-write"])
        field(page, "loops").fill("2")
        wait_for_code(page, "vkbloom.Separable(loops=2)")
        page.get_by_role("button", name="Copy as code").click()
        page.get_by_role("button", name="Copied").wait_for()
        assert page.evaluate("navigator.clipboard.readText()") == "vkbloom.Separable(loops=2)"


def test_the_newest_wins(page: Page) -> None:
    """Of many changes at once only some are rendered, and the last one is shown."""
    page.evaluate(
        """() => {
            window.drawn = window.sent = 0;
            const send = WebSocket.prototype.send;
            WebSocket.prototype.send = function (message) {
                ++window.sent;
                send.call(this, message);
            };
            const root = document.querySelector(".vkbloom");
            root.addEventListener("vkbloom:drawn", () => ++window.drawn);
            const slider = document.querySelector("[data-field=blur_strength]");
            for (let step = 0; step <= 400; ++step) {
                slider.value = step / 100;
                slider.dispatchEvent(new Event("input", { bubbles: true }));
            }
        }"""
    )
    wait_for_code(page, "vkbloom.Separable(blur_strength=4.0)")
    # The first, and what the slider stood at when that had come. The server would drop messages,
    # too, but a notebook's kernel could not.
    assert page.evaluate("[window.sent, window.drawn]") == [2, 2]


def test_pictures_follow_the_window(page: Page, tmp_path: Path) -> None:
    before = size_of(see(page, tmp_path))
    page.set_viewport_size({"width": 1200, "height": 640})
    page.locator(".vkb-status", has_text=f"{before[0]} × {before[1]}").wait_for(state="detached")
    after = size_of(see(page, tmp_path))
    assert after[0] > before[0]
    page.get_by_text(f"{after[0]} × {after[1]} uint8").wait_for()
    page.get_by_label("size").select_option("own")
    page.get_by_text("1280 × 720 uint8").wait_for()
    # A pixel of the screen for each of its own; what does not fit is cut off.
    page.get_by_text("100 %", exact=True).wait_for()
    area = page.locator("canvas").bounding_box()
    assert area is not None
    assert (area["width"], area["height"]) == (1280, 720)


def test_an_image(tab: Page, serve: Any, renderer: Renderer, tmp_path: Path) -> None:
    image = (np.random.default_rng(3).random((60, 80, 3)) ** 8 * 20).astype(np.float32)
    url = serve(lambda: Viewer(image, KinoBloom(), renderer=renderer))
    page = tab
    with show(page, url):
        assert page.get_by_label("time, in turns").count() == 0
        expected = renderer.apply(image, KinoBloom())["final"]
        # It is smaller than it is shown: rendered as it is, and enlarged with hard pixels.
        page.locator(".vkb-status", has_text="80 × 60 float32").wait_for()
        area = page.locator("canvas").bounding_box()
        assert area is not None
        x, y = (7 + 0.5) * area["width"] / 80, (33 + 0.5) * area["height"] / 60
        page.locator("canvas").hover(position={"x": x, "y": y})
        page.get_by_text("final[33, 7] = ").wait_for()
        values = page.locator(".vkb-readout").inner_text().partition(" = ")[2].split()
        assert np.array_equal(np.array(values, np.float32), expected[33, 7])
        dark = see(page, tmp_path).mean()
        page.get_by_label("view exposure").fill("3")
        # (Colours above 1 keep their hue, so that few pixels become white.)
        wait_until(lambda: see(page, tmp_path).mean() >= 1.05 * dark)


def test_a_server_that_stops_is_noticed(tab: Page, serve: Any, renderer: Renderer) -> None:
    class Failing(Viewer):
        def answer(self, message: Any, files: Any = ()) -> Any:
            if message["kind"] == "frame" and message["sides"]["a"]["bloom"] is False:
                raise ZeroDivisionError
            return super().answer(message, files)

    image = np.zeros((9, 16, 3), np.uint8)
    with show(tab, serve(lambda: Failing(image, renderer=renderer))):
        field(tab, "bloom").uncheck()
        tab.get_by_role("alert").get_by_text("The server has stopped.").wait_for()


def test_the_address_keeps_the_state(
    tab: Page, scene_url: str, renderer: Renderer, scene: Scene, tmp_path: Path
) -> None:
    page = tab
    with show(page, scene_url):
        page.get_by_label("method").select_option("pyramid")
        field(page, "levels").fill("3")
        page.get_by_label("shading").select_option("deferred")
        field(page, "glow").locator("xpath=following-sibling::input").fill("9")
        page.get_by_label("framebuffer").select_option("bloom")
        page.get_by_label("wipe A | B").check()
        wait_for_code(page, "vkbloom.Pyramid(levels=3)")
        page.wait_for_url("**%22glow%22%3A9**")
        page.wait_for_url("**wipe**")
        link = page.url
    with show(page, link):
        assert_is_as_left(page)
        page.reload()
        page.locator(".vkb-status", has_text="until shown").wait_for()
        assert_is_as_left(page)
        page.get_by_label("wipe A | B").uncheck()
        picture = see(page, tmp_path)
        bright = dataclasses.replace(scene, glow_intensity=9)
        expected = renderer.render(bright, Pyramid(levels=3), size_of(picture), shading="deferred")[
            "bloom"
        ]
        assert np.array_equal(
            picture, decode(picture_of(expected, "bloom", encoding="none", stops=0.0), tmp_path)
        )
        page.get_by_role("button", name="Reset").click()
        wait_for_code(page, "vkbloom.Separable()")
        page.wait_for_url(scene_url)
    with show(page, scene_url + "#%7B%22a%22%3A3%2C%22zoom%22%3A%5B%22x%22%5D%7D"):
        wait_for_code(page, "vkbloom.Separable()")


def assert_is_as_left(page: Page) -> None:
    wait_for_code(page, "vkbloom.Pyramid(levels=3)")
    assert page.get_by_label("wipe A | B").is_checked()
    assert page.get_by_label("framebuffer").input_value() == "bloom"
    assert page.get_by_label("shading").input_value() == "deferred"


def test_zoom_and_pan(page: Page) -> None:
    def corner() -> Any:
        return page.evaluate(
            "(e => [e.offsetLeft, e.offsetTop, e.offsetWidth])(document.querySelector('canvas'))"
        )

    left, top, width = corner()
    assert (left, top) == (0, 0)
    page.locator("canvas").hover(position={"x": 100, "y": 50})
    page.mouse.wheel(0, -120)
    page.mouse.wheel(0, -120)
    page.get_by_text("200 %", exact=True).wait_for()
    # The place under the pointer stays.
    assert np.allclose(corner(), (-100, -50, 2 * width), atol=1)
    page.mouse.down()
    page.mouse.move(40, 40, steps=3)
    page.mouse.up()
    assert corner()[0] < -120
    page.locator(".vkb-stage").focus()
    page.keyboard.press("0")
    assert np.allclose(corner(), (0, 0, width))
    page.keyboard.press("+")
    page.get_by_text("150 %", exact=True).wait_for()
    page.get_by_role("button", name="fit the picture").click()
    assert np.allclose(corner(), (0, 0, width))


def test_files(page: Page, tmp_path: Path) -> None:
    pixels = np.random.default_rng(4).integers(0, 256, (30, 50, 3), dtype=np.uint8)
    path = vkbloom.write(tmp_path / "photo.png", pixels)
    page.get_by_label("image or settings").set_input_files(path)
    page.locator(".vkb-status", has_text="50 × 30 float32").wait_for()
    read = 'image = vkbloom.read("photo.png", expand=4)'
    wait_for_code(page, f'{read}\nsettings = vkbloom.presets["photo"]')
    page.locator(".vkb-status", has_text="highlights expanded up to 4").wait_for()
    assert page.get_by_label("shading").count() == 0
    preset = page.get_by_label("preset")
    assert preset.input_value() == "photo"
    assert "soft glow of highlights" in (preset.get_attribute("title") or "")
    # The preset is shown where its values are, but for how a picture is developed.
    for key, name in (("ArrowRight", ""), ("ArrowLeft", "photo")):
        field(page, "intensity").press(key)
        assert preset.input_value() == name
    field(page, "bloom").uncheck()
    assert preset.input_value() == "photo"
    wait_for_code(page, f'{read}\nsettings = vkbloom.presets["photo"].replace(bloom=False)')
    with page.expect_download() as download:
        page.get_by_role("button", name="Save picture").click()
    assert download.value.suggested_filename == "final.png"
    saved = decode(download.value.path().read_bytes(), tmp_path)
    # Encoded again, by way of half floats. Highlights are expanded.
    plain = (pixels <= 231).all(axis=2)
    assert np.abs(saved.astype(int) - pixels)[plain].max() <= 1
    assert (saved[~plain].astype(int) >= pixels[~plain].astype(int) - 1).all()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save settings").click()
    settings = download.value.path()
    expected = presets["photo"].replace(bloom=False)
    assert vkbloom.Settings.from_json(settings.read_text()) == expected
    assert json.loads(settings.read_text())["vkbloom:expand"] == 4
    # Dropped, not chosen.
    text = KinoBloom(radius=3).to_json()
    page.evaluate(
        """(text) => {
            const carried = new DataTransfer();
            carried.items.add(new File([text], "settings.json"));
            const options = { dataTransfer: carried, bubbles: true, cancelable: true };
            document.querySelector("canvas").dispatchEvent(new DragEvent("drop", options));
        }""",
        text,
    )
    wait_for_code(page, f"{read}\nsettings = vkbloom.KinoBloom(radius=3.0)")
    # Presets begin as on the command line; what is expanded is chosen, too.
    page.get_by_label("preset").select_option("kino")
    wait_for_code(page, "vkbloom.KinoBloom()")
    page.get_by_label("expand, on").check()
    wait_for_code(page, f"{read}\nsettings = vkbloom.KinoBloom()")
    field(page, "expand").fill("2.5")
    wait_for_code(page, f"{read.replace('=4', '=2.5')}\nsettings = vkbloom.KinoBloom()")
    page.locator(".vkb-status", has_text="highlights expanded up to 2.5").wait_for()
    page.get_by_label("preset").select_option("photo")
    wait_for_code(page, f'{read}\nsettings = vkbloom.presets["photo"]')
    (tmp_path / "words.png").write_text("words")
    page.get_by_label("image or settings").set_input_files(tmp_path / "words.png")
    page.get_by_role("alert").get_by_text("words.png").wait_for()
    page.locator(".vkb-status", has_text="50 × 30 float32").wait_for()


def test_narrow_screens(page: Page) -> None:
    """At 390 pixels nothing is cut off, and the picture stays in view while controls are moved."""
    page.set_viewport_size({"width": 390, "height": 844})
    page.locator(".vkb-status", has_text="358 × 201").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    # The title, then the picture, then the controls.
    title, picture = page.locator(".vkb-title"), page.locator(".vkb-stage")
    tops = [one.bounding_box() for one in (title, picture, page.locator(".vkb-head"))]
    order = [box["y"] for box in tops if box is not None]
    assert order == sorted(order)
    assert order[1] < 80
    field(page, "blur_strength").scroll_into_view_if_needed()
    page.evaluate("window.scrollTo(0, document.documentElement.scrollHeight)")
    assert page.evaluate("window.scrollY") > 100
    area = page.locator("canvas").bounding_box()
    assert area is not None
    assert area["y"] >= 0
    assert area["y"] + area["height"] <= 844 / 2


def assert_theme(page: Page, theme: str) -> None:
    """Hold a text to be dark on light or light on dark, as asked."""
    red = "+getComputedStyle(document.querySelector('.vkbloom')).color.match(/\\d+/)[0]"
    assert (page.evaluate(red) < 128) == (theme == "light")


@pytest.mark.parametrize(("theme", "width"), by_turns(["light", "dark"], turns=[980, 390]))
def test_no_rule_of_accessibility_is_broken(page: Page, theme: Any, width: int) -> None:
    """The rules of contrast, and Deque's axe-core, with all that the page can show open, in both
    layouts."""
    page.emulate_media(color_scheme=theme)
    assert_theme(page, theme)
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page.get_by_label("wipe A | B").check()
    page.get_by_text("More", exact=True).click()
    page.get_by_text("Plan", exact=True).click()
    # An error beside its field is shown, too.
    field(page, "intensity").locator("xpath=following-sibling::input").fill("-1")
    page.locator(".vkb-fields .vkb-error").wait_for()
    page.set_viewport_size({"width": width, "height": 844})
    page.wait_for_timeout(300)
    found = axe.run(page)
    assert found.violations_count == 0, found.generate_report()


@pytest.mark.parametrize(("theme", "width"), by_turns(["light", "dark"], turns=[980, 390]))
def test_a_sequence_is_accessible(tab: Page, clip_url: str, theme: Any, width: int) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    with show(tab, clip_url):
        tab.emulate_media(color_scheme=theme)
        tab.get_by_label("wipe A | B").check()
        tab.set_viewport_size({"width": width, "height": 844})
        tab.wait_for_timeout(300)
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        found = axe.run(tab)
        assert found.violations_count == 0, found.generate_report()
