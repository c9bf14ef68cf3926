"""What the page says in each state: header, pad, message, titles of the views."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import visited
from tests.clients.web.conftest import link_to, loaded
from tests.clients.web.page_service import Breaker, serving_pages
from tests.service.harness import START, Running, kept_engine, roomy_settings, until

if TYPE_CHECKING:
    from playwright.sync_api import Page, Route

ROUGH = "ERR_|WebSocket|status of|ServiceProblem"
LOOK = """() => {
  const shown = (id) => (document.getElementById(id).hidden ? "" : document.getElementById(id).textContent);
  const told = (id) => {
    const title = document.getElementById(id).closest("figure").querySelector("figcaption");
    const { content } = getComputedStyle(title, "::after");
    return content === "none" ? "" : content.replaceAll('"', "");
  };
  return {header: shown("state"), pad: shown("pad-note"), notice: shown("notice"),
    waveform: told("waveform"), contact: told("contact"), button: shown("start")};
}"""
AGREED = "() => document.getElementById('pad-note').hidden && !document.querySelector('[data-stale]')"
LIVE = "() => document.getElementById('state').textContent === 'live'"
SCENE = "() => ridgewave.state.write(['texture', 'period'], '1.1 mm')"
BAD = "() => ridgewave.state.write(['texture', 'period'], '-1 mm')"


def gone(page: Page, breaker: Breaker) -> None:
    breaker.target = None
    breaker.reset()


def busy(page: Page, breaker: Breaker) -> None:
    answering(page, 503, "The service has no room for more requests. Try again in a second.")


def answering(page: Page, status: int, detail: str) -> None:
    """Answer requests for pictures with a problem."""
    problem = json.dumps({"type": "about:blank", "title": "No", "status": status, "detail": detail})

    def answer(route: Route) -> None:
        route.fulfill(status=status, content_type="application/problem+json", body=problem)

    page.route("**/v1/picture", answer)


def stopped(page: Page, breaker: Breaker) -> None:
    page.evaluate("() => fetch('/v1/stop', {method: 'POST'})")


FIELD = "texture.period: got '-1 mm'; allowed: 1 um to 1 m. Write at least 1 um."
STATES: dict[str, tuple[bool, Callable[[Page, Breaker], Any], str, dict[str, str]]] = {
    # state: whether it sounds before, what happens, what the page then does, what it says
    "gone during play": (
        True, gone, "() => {}",
        {"header": "no connection", "pad": "There is no connection to the service. This page tries again.",
         "waveform": "", "contact": ""},
    ),
    "gone, and another scene": (
        True, gone, SCENE,
        {"header": "no connection", "pad": "There is no connection to the service. This page tries again.",
         "waveform": "", "contact": " – not of this scene"},
    ),
    "gone before the sound, and another scene": (
        False, gone, SCENE,
        {"header": "not started", "pad": "The service does not answer. The picture follows when it is back.",
         "notice": "The service does not answer. Check that it is running, then try again.",
         "contact": " – not of this scene"},
    ),
    "gone, then Touch": (
        False, gone, "() => document.getElementById('start').click()",
        {"header": "not started", "pad": "", "button": "Touch",
         "notice": "The sound did not load. Check that the service is running, then press Touch again."},
    ),
    "busy": (
        False, busy, SCENE,
        {"pad": "The service is busy. The picture follows.", "contact": " – not of this scene"},
    ),
    "a bug of the service": (
        False, lambda page, _: answering(page, 500, "This is a mistake of the service."), SCENE,
        {"pad": "The service failed to draw this scene.", "notice": "This is a mistake of the service."},
    ),
    "another scene is refused": (
        False, lambda *_: None, BAD,
        {"pad": "This scene is refused. The picture is still of the previous scene.", "notice": FIELD,
         "contact": " – not of this scene"},
    ),
    "another scene is refused while it sounds": (
        True, lambda *_: None, BAD,
        {"header": "live", "pad": "This scene is refused. Sound and picture are still of the previous scene.",
         "notice": FIELD, "waveform": " – not of this scene"},
    ),
    "the page is not admitted": (
        False, lambda page, _: answering(page, 403, "This origin is not allowed."), SCENE,
        {"pad": "The service does not admit this page.", "notice": "This origin is not allowed."},
    ),
    "a key is required from now on": (
        False, lambda page, _: answering(page, 401, "Send your key."), SCENE,
        {"pad": "The service requires a key. Enter it above."},
    ),
    "stopped at the service": (
        True, stopped, "() => {}",
        {"header": "not started", "pad": "", "button": "Touch",
         "notice": "Everything was stopped at the service. Press Touch to go on."},
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def own() -> Iterator[Running]:
    """Yield a service of this module, whose streams may be stopped."""
    with serving_pages(kept_engine(), **roomy_settings()) as running:
        until(lambda: running.service.warm, START)
        yield running


@contextmanager
def opened(page: Page, url: str, hash_of: str) -> Iterator[Breaker]:
    page.emulate_media(reduced_motion="reduce")
    with Breaker(url) as breaker, visited(page, breaker.url + hash_of) as watch:
        watch.allow(ROUGH)
        loaded(page)
        yield breaker


def says(page: Page, wanted: dict[str, str]) -> None:
    """Return once the page says what is wanted; fail with what it says."""
    for _ in range(300):
        said = page.evaluate(LOOK)
        if all(said[place].startswith(text) and bool(said[place]) == bool(text) for place, text in wanted.items()):
            return
        page.wait_for_timeout(100)
    assert {place: said[place] for place in wanted} == wanted


@pytest.mark.parametrize("state", STATES)
def test_the_page_says_what_is_true(kept_touch_page: Page, own: Running, state: str) -> None:
    sounding, happens, then, wanted = STATES[state]
    page = kept_touch_page
    with opened(page, own.url, link_to({})) as breaker:
        page.wait_for_function(AGREED)
        if sounding:
            page.click("#start")
            page.wait_for_function(LIVE)
        before = page.locator("#pad").bounding_box()
        happens(page, breaker)
        page.evaluate(then)
        says(page, wanted)
        assert page.locator("#pad").bounding_box() == before
        if state.startswith("a key"):
            assert page.is_visible("#key-text") and page.evaluate("document.activeElement.id") == "key-text"


def test_a_first_scene_that_is_refused_has_nothing_before_it(kept_touch_page: Page, own: Running) -> None:
    page = kept_touch_page
    refused = "The service refuses this scene. Change it under Scene, or open another one."
    with opened(page, own.url, link_to({"texture": {"period": "-1 mm"}})):
        says(page, {"header": "not started", "pad": refused, "contact": " – none yet"})
        page.click("#start")
        page.wait_for_function("(text) => document.getElementById('notice').textContent === text", arg=FIELD)
        says(page, {"header": "not started", "pad": refused, "button": "Touch"})
        page.evaluate(SCENE)
        page.wait_for_function(AGREED)
        page.click("#start")
        page.wait_for_function(LIVE)


def test_a_service_that_was_restarted_goes_on_and_says_so(kept_touch_page: Page, own: Running) -> None:
    page = kept_touch_page
    with serving_pages(kept_engine(), **roomy_settings()) as new, opened(page, own.url, link_to({})) as breaker:
        page.click("#start")
        page.wait_for_function(LIVE)
        breaker.target = None
        breaker.reset()
        says(page, {"header": "no connection"})
        breaker.target = new.url
        says(page, {"header": "live", "pad": "", "notice": "The service has forgotten the stream, as after a restart."})


def test_a_service_without_room_is_waited_for(kept_touch_page: Page) -> None:
    page = kept_touch_page
    settings = {**roomy_settings(), "max_sessions": 1, "resume": 1.0}
    with serving_pages(kept_engine(), **settings) as full, opened(page, full.url, link_to({})) as breaker:
        until(lambda: full.service.warm, START)
        holder = page.context.new_page()
        holder.goto(full.url + link_to({}))
        loaded(holder)
        holder.click("#start")
        holder.wait_for_function(LIVE)
        page.click("#start")
        says(page, {"header": "no room, waiting…", "waveform": "",
                    "pad": "The service has no room for another stream. This page tries again."})  # fmt: skip
        holder.close()
        says(page, {"header": "live", "pad": ""})
        assert breaker.target


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (0, "The service does not answer. Check that it is running, then reload the page."),
        (502, "The service does not answer. Check that it is running, then reload the page."),
        (503, "The service is busy. Reload the page in a moment."),
        (500, "The service failed to answer. Its log says why. Then reload the page."),
    ],
)
def test_a_page_that_cannot_load_says_why(kept_touch_page: Page, own: Running, status: int, said: str) -> None:
    page = kept_touch_page
    page.route("**/v1/textures", lambda route: route.fulfill(status=status) if status else route.abort())
    with visited(page, own.url + "/") as watch:
        watch.allow(ROUGH)
        page.wait_for_function("(said) => document.getElementById('loading').textContent === said", arg=said)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"sound": "none", "picture": "pending"}, "Not updated yet: picture."),
        ({"sound": "pending", "picture": "pending", "shown": True}, "Not updated yet: sound and picture."),
        ({"sound": "refused", "picture": "current", "shown": True}, "This scene is refused. The sound is still"),
        ({"sound": "current", "picture": "current", "output": "asleep"}, "The browser keeps this page silent"),
        ({"sound": "broken", "picture": "away", "output": "asleep"}, "There is no connection to the service."),
        ({"sound": "current", "picture": "current", "output": "awake"}, ""),
    ],
)
def test_the_pad_says_first_what_matters_most(functions: Page, parts: dict[str, Any], said: str) -> None:
    sentence = functions.evaluate(
        "async (parts) => (await import('/web/page/status_texts.js')).padSentence(parts)", parts
    )
    assert sentence.startswith(said) and bool(sentence) == bool(said)


@pytest.mark.parametrize(
    ("fingers", "said"),
    [
        ([None, None], "current"),
        ([None, "full"], "current"),
        (["full", "full"], "full"),
        (["full", "broken"], "broken"),
        ([None, "broken"], "current"),
    ],
)
def test_a_finger_without_room_takes_no_sound_from_the_others(
    functions: Page, fingers: list[str | None], said: str
) -> None:
    status = functions.evaluate(
        """async (troubles) => {
          const {soundStatusOf} = await import("/web/page/session_status.js");
          const scene = {isCurrent: true, pending: false, refused: false};
          const finger = (trouble) => ({scene, connection: {trouble, state: trouble ? "connecting" : "live"}});
          return soundStatusOf({awake: true}, troubles.map(finger));
        }""",
        fingers,
    )
    assert status == said
