"""What vibrates: every face of a gamepad's actuator, several gamepads, and a phone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import watched
from tests.clients.web.conftest import DRAWER, link_to, loaded
from tests.few import few, thorough

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from tests.service.harness import Running

TOOLS = """() => {
  window.heard = [];
  window.pads = [];
  navigator.getGamepads = () => pads;
  const plays = async (form, { duration, ...strengths }) => {
    heard.push([form, Math.max(...Object.values(strengths)), duration]);
    return "complete";
  };
  const triggers = async (form, how) => {
    if (form !== "trigger-rumble") throw new DOMException("not this one", "NotSupportedError");
    return plays(form, { duration: how.duration, left: how.leftTrigger, right: how.rightTrigger });
  };
  const pulses = async (strength, duration) => (heard.push(["pulse", strength, duration]), true);
  const rejects = () => Promise.reject(new DOMException("no", "NotSupportedError"));
  const throws = () => { throw new TypeError("at once"); };
  const hangs = () => new Promise(() => {});
  const answers = async () => "not-supported";
  const one = { type: "vibration", pulse: pulses };
  const both = ["dual-rumble", "trigger-rumble"];
  window.faces = {
    "a list of effects": { vibrationActuator: { effects: both, playEffect: plays, pulse: throws } },
    "only trigger-rumble": { vibrationActuator: { effects: ["trigger-rumble"], playEffect: triggers } },
    "a type and no list": { vibrationActuator: { type: "dual-rumble", playEffect: plays } },
    "neither": { vibrationActuator: { playEffect: plays } },
    "dual-rumble rejects": { vibrationActuator: { effects: both, playEffect: triggers } },
    "playEffect rejects": { vibrationActuator: { effects: both, playEffect: rejects, pulse: pulses } },
    "playEffect throws": { vibrationActuator: { effects: both, playEffect: throws, pulse: pulses } },
    "playEffect hangs": { vibrationActuator: { effects: both, playEffect: hangs, pulse: pulses } },
    "playEffect says no": { vibrationActuator: { playEffect: answers, pulse: pulses } },
    "unknown effects": { vibrationActuator: { effects: ["pulse-train"], playEffect: throws, pulse: pulses } },
    "only pulse": { vibrationActuator: { type: "vibration", pulse: pulses } },
    "plural": { hapticActuators: [{ type: "vibration", pulse: pulses }] },
    "plural, one of which hangs": { hapticActuators: [{ pulse: hangs }, { pulse: pulses }] },
    "one in both places": { vibrationActuator: one, hapticActuators: [one] },
    "first rejects, plural plays": { vibrationActuator: { playEffect: rejects }, hapticActuators: [{ pulse: pulses }] },
    "all reject": { vibrationActuator: { effects: both, playEffect: rejects, pulse: rejects } },
    "all throw": { vibrationActuator: { playEffect: throws }, hapticActuators: [{ pulse: throws }] },
    "all hang": { vibrationActuator: { playEffect: hangs, pulse: hangs } },
    "only a type": { vibrationActuator: { type: "dual-rumble" } },
    "no effects": { vibrationActuator: { effects: [], playEffect: throws } },
    "no actuator": { vibrationActuator: null },
    "an empty plural": { hapticActuators: [] },
    "a getter that throws": { vibrationActuator: { get effects() { throw new Error("no"); }, playEffect: plays } },
    "pulse says false": { vibrationActuator: { pulse: async () => false } },
  };
  window.connect = (...names) => {
    heard.length = 0;
    pads = names.map((name, index) => ({ id: name, index, connected: true, ...faces[name] }));
    dispatchEvent(new Event("gamepadconnected"));
  };
}"""  # fmt: skip
PLAY = {
    "a list of effects": "dual-rumble",
    "only trigger-rumble": "trigger-rumble",
    "a type and no list": "dual-rumble",
    "neither": "dual-rumble",
    "dual-rumble rejects": "trigger-rumble",
    "playEffect rejects": "pulse",
    "playEffect throws": "pulse",
    "playEffect hangs": "pulse",
    "playEffect says no": "pulse",
    "unknown effects": "pulse",
    "only pulse": "pulse",
    "plural": "pulse",
    "plural, one of which hangs": "pulse",
    "one in both places": "pulse",
    "first rejects, plural plays": "pulse",
}
SHOWN = (
    "a list of effects", "only trigger-rumble", "neither", "dual-rumble rejects", "playEffect throws",
    "playEffect hangs", "only pulse", "plural, one of which hangs", "first rejects, plural plays",
)  # fmt: skip
REFUSE = ("all reject", "all throw", "all hang", "pulse says false")
LACK = ("only a type", "no effects", "no actuator", "an empty plural", "a getter that throws")
STATE = "document.getElementById('rumble-state').textContent"


@pytest.fixture(scope="module")
def stroking(chromium: Browser, service: Running) -> Iterator[Page]:
    """Yield a page that strokes by itself, with gamepads of the test."""
    with watched(chromium, service.url + link_to({}), reduced_motion="reduce") as (page, _):
        loaded(page)
        page.evaluate(DRAWER)
        page.evaluate(TOOLS)
        page.evaluate("() => { document.getElementById('devices').open = true; }")
        page.check("#rumble")
        page.click("#stroke")
        yield page
        page.click("#start")


def connect(page: Page, *names: str) -> None:
    page.evaluate("(names) => connect(...names)", list(names))


@pytest.mark.parametrize(("face", "form"), [one if one[0] in SHOWN else thorough(*one) for one in PLAY.items()])
def test_an_actuator_vibrates_in_a_way_that_it_has(stroking: Page, face: str, form: str) -> None:
    connect(stroking, face)
    stroking.wait_for_function("() => heard.filter(([, strength]) => strength > 0.05).length > 4")
    heard = stroking.evaluate("() => heard")
    assert {kind for kind, _, _ in heard} == {form}
    assert all(0 <= strength <= 1 and duration == 80 for _, strength, duration in heard)
    assert stroking.evaluate(f"() => {STATE}") == f"{face} vibrates."


@pytest.mark.parametrize("face", few(REFUSE, 2))
def test_an_actuator_that_refuses_is_named(stroking: Page, face: str) -> None:
    connect(stroking, face)
    said = f"{face} does not vibrate: it refuses every effect, or does not answer."
    stroking.wait_for_function(f"(said) => {STATE}.startsWith(said)", arg=said)
    assert stroking.locator("#notice").inner_text().startswith(said)


@pytest.mark.parametrize("face", LACK)
def test_an_actuator_without_a_way_is_named_at_once(stroking: Page, face: str) -> None:
    connect(stroking, face)
    said = f"This browser cannot make {face} vibrate. Try another gamepad or another browser."
    assert stroking.evaluate(f"() => {STATE}") == said
    assert stroking.locator("#notice").inner_text() == said


def test_of_several_gamepads_the_chosen_one_vibrates(stroking: Page) -> None:
    connect(stroking, "no actuator", "only pulse", "neither")
    assert "cannot make no actuator vibrate" in stroking.evaluate(f"() => {STATE}")
    for name, form in (("only pulse", "pulse"), ("neither", "dual-rumble")):
        stroking.select_option("#gamepad", label=name)
        stroking.wait_for_function("(form) => heard.at(-1)?.[0] === form", arg=form)
        assert stroking.evaluate(f"() => {STATE}") == f"{name} vibrates."


def test_a_gamepad_that_is_unplugged_while_it_vibrates_is_forgotten(stroking: Page) -> None:
    connect(stroking, "neither")
    stroking.wait_for_function("() => heard.length > 2")
    stroking.evaluate(
        """() => { pads[0].connected = false;
             pads[0].vibrationActuator.playEffect = () => Promise.reject(new DOMException("gone", "NetworkError"));
             pads = [null]; dispatchEvent(new Event("gamepaddisconnected")); heard.length = 0; }"""
    )
    assert stroking.evaluate(f"() => {STATE}") == "Connect a gamepad and press one of its buttons."
    assert stroking.evaluate("() => heard.length") == 0
    connect(stroking, "only pulse")
    stroking.wait_for_function("() => heard.length > 2")


def test_one_lost_effect_does_not_give_up_a_motor(functions: Page) -> None:
    report = functions.evaluate(
        """async () => {
          const [heard, refused] = [[], []];
          let count = 0;
          const playEffect = async (form) => {
            count += 1;
            if (count % 3) throw new DOMException("lost", "NetworkError");
            heard.push(form);
          };
          const pad = {id: "radio", vibrationActuator: {playEffect}};
          const motors = new modules.Motors({gamepads: () => [pad], onRefused: (name) => refused.push(name)});
          for (let turn = 0; turn < 12; turn += 1) await motors.motors()[0].play(0.5, 10);
          return {heard, refused, left: motors.motors().length};
        }"""
    )
    assert report == {"heard": ["dual-rumble"] * 4, "refused": [], "left": 1}


PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
VIBRATES = """window.pulses = []; window.last = 0;
  navigator.vibrate = (pattern) => { pulses.push(pattern); last = performance.now(); return true; };"""
STROKE = """() => { const pad = document.getElementById("pad"); const {left, top} = pad.getBoundingClientRect();
  window.finger = (kind, x) => pad.dispatchEvent(new PointerEvent(kind,
    {pointerId: 31, pointerType: "touch", button: 0, clientX: left + x, clientY: top + 50, bubbles: true}));
  finger("pointerdown", 20);
  window.going = setInterval(() => finger("pointermove", 100 + 80 * Math.sin(performance.now() / 200)), 8); }"""
PULSED = "() => pulses.filter((pulse) => pulse >= 10).length > 4"
STILL = "() => pulses.at(-1) === 0 && performance.now() - last > 400"
"""In 400 ms a motor that goes on would be told 8 times; a busy machine tells it late that the finger rests."""


@pytest.fixture
def phone(chromium: Browser, service: Running) -> Iterator[Page]:
    """Yield the page on a phone, which notes how long its motor is told to run."""
    with watched(chromium, "about:blank", reduced_motion="reduce", **PHONE) as (page, watch):
        watch.host = service.url.removeprefix("http://")
        page.add_init_script(VIBRATES)
        page.goto(service.url + link_to({}))
        loaded(page)
        page.evaluate(DRAWER)
        yield page


def stays_still(page: Page) -> None:
    """Fail if the motor is told to run on and on."""
    page.wait_for_function(STILL)


def test_a_phone_vibrates_in_bounded_pulses_until_the_finger_rests_or_lifts(phone: Page) -> None:
    phone.evaluate(STROKE)
    phone.wait_for_function(PULSED)
    assert all(pulse == 0 or 10 <= pulse <= 50 for pulse in phone.evaluate("() => pulses"))
    phone.evaluate("() => clearInterval(going)")
    stays_still(phone)
    phone.evaluate("() => { pulses.length = 0; finger('pointerup', 20); }")
    phone.evaluate(STROKE)
    phone.wait_for_function(PULSED)
    phone.evaluate("() => { clearInterval(going); finger('pointerup', 20); }")
    stays_still(phone)


def test_a_hidden_page_makes_no_phone_vibrate(phone: Page) -> None:
    phone.evaluate(STROKE)
    phone.wait_for_function(PULSED)
    phone.evaluate(
        "() => { Object.defineProperty(document, 'hidden', {get: () => true, configurable: true});"
        " document.dispatchEvent(new Event('visibilitychange')); }"
    )
    stays_still(phone)
    phone.evaluate("() => { delete document.hidden; pulses.length = 0; }")
    phone.wait_for_function(PULSED)


def test_the_switch_of_a_phone_begins_on_and_stays_where_it_was_put(phone: Page) -> None:
    assert phone.is_checked("#rumble")
    phone.evaluate(STROKE)
    phone.wait_for_function(PULSED)
    assert phone.evaluate(f"() => {STATE}").startswith("This phone vibrates in pulses")
    phone.evaluate("() => { document.getElementById('devices').open = true; }")
    phone.uncheck("#rumble")
    stays_still(phone)
    phone.reload()
    loaded(phone)
    phone.evaluate(DRAWER)
    assert not phone.is_checked("#rumble")
    phone.evaluate(STROKE)
    phone.wait_for_function("() => ridgewave.fingers[0]?.source?.played > 9600")
    assert phone.evaluate("() => pulses") == []


def test_a_gamepad_takes_the_place_of_the_phone(phone: Page) -> None:
    phone.evaluate(TOOLS)
    connect(phone, "neither")
    phone.evaluate(STROKE)
    phone.wait_for_function("() => heard.length > 4")
    assert phone.evaluate("() => pulses") == []
    connect(phone, "no actuator")
    phone.wait_for_function(PULSED)
    said = phone.evaluate(f"() => {STATE}")
    assert said.startswith("This browser cannot make no actuator vibrate.") and "This phone vibrates in pulses" in said


def test_a_phone_whose_browser_has_no_vibration_says_so(chromium: Browser, service: Running) -> None:
    with watched(chromium, "about:blank", **PHONE) as (page, watch):
        watch.host = service.url.removeprefix("http://")
        page.add_init_script("delete Navigator.prototype.vibrate")
        page.goto(service.url + link_to({}))
        loaded(page)
        page.evaluate(DRAWER)
        assert not page.is_checked("#rumble")
        page.evaluate("() => { document.getElementById('devices').open = true; }")
        page.check("#rumble")
        page.wait_for_function(f"() => {STATE}.startsWith('This browser cannot make this device vibrate.')")


def test_a_desktop_is_no_phone(still_page: Page) -> None:
    assert still_page.evaluate("() => typeof navigator.vibrate") == "function"
    assert not still_page.is_checked("#rumble")
