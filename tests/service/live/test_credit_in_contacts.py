"""Credit in a contact is that of a message `more` just after it, as text and as bytes; it is never lost."""

from __future__ import annotations

from typing import Any

import pytest

from service.live.contact_update import CREDIT
from service.live.messages import V1, V2, Version
from tests.service.live.driver import RATE, Driver, contact, place, problem_of, started


def sent(driver: Driver) -> int:
    """Return the frames that the client has received, after the writer has run."""
    driver.write()
    return len(driver.pcm())


@pytest.mark.parametrize("version", [V1, V2])
def test_a_contact_brings_its_credit_and_is_in_the_sound_of_it(version: Version) -> None:
    driver = started("pull", version)
    driver.say("contact", seq=1, time=0.0, speed=0.1, more=480)
    assert sent(driver) == 480 and driver.order()[-2:] == ["applied", "pcm"]
    driver.binary(contact(2) + CREDIT.pack(100))
    assert sent(driver) == 580 and driver.texts("applied")[-1] == {"type": "applied", "seq": 2, "frame": 480}
    if version is V2:
        driver.binary(place(3, 0.1, 0.0) + CREDIT.pack(50))
        assert sent(driver) == 630 and driver.texts("applied")[-1]["seq"] == 3
    assert driver.texts("problem") == []


def test_no_credit_is_no_credit() -> None:
    driver = started("pull")
    driver.binary(contact(1) + CREDIT.pack(0))
    driver.say("contact", seq=2, time=0.0, speed=0.1, more=0)
    driver.say("contact", seq=3, time=0.0, speed=0.1)
    assert sent(driver) == 0 and driver.texts("problem") == []


def test_a_contact_that_is_ignored_or_refused_brings_its_credit_all_the_same() -> None:
    driver, frames = started("pull"), 0
    driver.binary(contact(9))
    wrong: list[dict[str, Any]] = [{"seq": 1}, {"load": -1}, {"load": "1 N"}, {"speed": 99.0}, {"note": 1}, {"x": 0.1}]
    for fields in wrong:
        driver.say("contact", **({"seq": 10, "time": 0.0, "speed": 0.1, "more": 100} | fields))
        frames += 100
        assert sent(driver) == frames, fields
    for data in (contact(1), contact(10, load=5000.0), contact(10, position=float("nan")), place(10, 0.0, 0.0)):
        driver.binary(data + CREDIT.pack(100))
        frames += 100
        assert sent(driver) == frames
    assert len(driver.texts("problem")) == len(wrong) - 1 + 3


@pytest.mark.parametrize("more", [-1, 10_000_001, 0.5, "480", True, None, 10**400])
def test_invalid_credit_is_refused_with_its_field(more: Any) -> None:
    driver = started("pull")
    driver.say("contact", seq=1, time=0.0, speed=0.1, more=more)
    fault = problem_of(driver)["errors"][0]
    assert fault["pointer"] == "/more" and "0 to 10000000 frames" in fault["allowed"]
    assert sent(driver) == 0


def test_too_much_credit_is_refused_and_the_contact_is_applied() -> None:
    driver = started("pull")
    driver.binary(contact(1) + CREDIT.pack(60 * RATE + 1))
    assert problem_of(driver)["errors"][0]["pointer"] == "/more"
    driver.pull(480)
    assert driver.texts("applied")[0]["seq"] == 1


def test_in_realtime_credit_is_refused_and_the_contact_is_applied() -> None:
    driver = started()
    driver.binary(contact(1) + CREDIT.pack(480))
    assert problem_of(driver)["errors"][0]["pointer"] == "/more"
    driver.run(0.1)
    assert driver.texts("applied")[0]["seq"] == 1


@pytest.mark.parametrize("field", ["seq", "time", "speed", "load", "more"])
def test_a_number_of_5000_digits_is_refused_with_its_field_and_the_stream_goes_on(field: str) -> None:
    driver = started("pull")
    fields = {"seq": "1", "time": "0", "speed": "0.1", "load": "0.3", "more": "480"} | {field: 5000 * "9"}
    driver.text('{"type":"contact",' + ",".join(f'"{name}":{digits}' for name, digits in fields.items()) + "}")
    (fault,) = problem_of(driver)["errors"]
    assert fault["pointer"] == f"/{field}" and fault["allowed"] and fault["hint"]
    assert driver.closed is None and sent(driver) == (0 if field == "more" else 480)
    driver.text('{"type":"more","frames":' + 5000 * "1" + "}")
    assert problem_of(driver)["errors"][0]["pointer"] == "/frames" and driver.closed is None
