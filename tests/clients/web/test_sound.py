"""What the page plays is what the service sent, bit for bit, whatever becomes of the connection."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import soundfile

from tests.conftest import RunsRidgewave

if TYPE_CHECKING:
    from playwright.sync_api import Page

RATE = 48000
Samples = npt.NDArray[np.float32]

STROKE = """async ({seconds, scene}) => {
  const player = await house.Player.open({sampleRate: 48000});
  const tap = player.tap();
  const finger = new house.Finger({player, scene, record: true});
  const {session} = await finger.open();
  await house.stroke(finger, seconds, (t) => ({position: 0.02 * Math.sin(4 * t), load: 0.2 + 0.1 * Math.sin(7 * t)}));
  finger.lift();
  await finger.close();
  const {runs, given, played, underruns, missing} = finger.source;
  const samples = house.packed(await tap.take());
  const recording = await house.recordingOf(session);
  await player.close();
  return {samples, first: tap.first, runs, given, played, underruns, missing, recording};
}"""


def unpacked(text: str) -> Samples:
    """Return the samples of `house.packed`."""
    return np.frombuffer(base64.b64decode(text), "<f4")


def sounding(report: dict[str, Any]) -> Samples:
    """Return the frames in which the ring played samples, [frames, channels] of the mix, from a tap's report."""
    heard = unpacked(report["samples"]).reshape(-1, 2)
    starts = [(start - report["first"], frames) for start, frames in report["runs"]]
    assert all(0 <= start and start + frames <= len(heard) for start, frames in starts)
    return np.concatenate([heard[start : start + frames] for start, frames in starts])


def test_what_left_the_ring_is_what_the_recording_renders_to(
    house: Page, tmp_path: Path, ridgewave: RunsRidgewave
) -> None:
    report = house.evaluate(STROKE, {"seconds": 1.2, "scene": {"texture": {"period": "1 mm"}}})
    heard = sounding(report)
    assert report["played"] == report["given"] == len(heard)
    assert np.array_equal(heard[:, 0], heard[:, 1])

    recording, out = tmp_path / "stroke.json", tmp_path / "stroke.wav"
    recording.write_text(report["recording"])
    assert json.loads(report["recording"])["frames"] == len(heard)
    done = ridgewave("render", str(recording), "-o", str(out))
    assert done.returncode == 0, done.stderr
    rendered, rate = soundfile.read(out, dtype="float32")
    assert rate == RATE
    assert np.abs(rendered).max() > 0.1
    assert np.array_equal(heard[:, 0].view(np.uint32), rendered.view(np.uint32))
