"""Plays live voices of many kinds in one new process; prints which loops numba first met while one was being heard.

python -m tests.synth.rehearsal_probe [--unrehearsed] [KIND ...]: a JSON object, from the kind to the loops, empty where
all had rehearsed.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Iterator
from typing import Any

from numba.core.dispatcher import Dispatcher

from service.engine import SynthEngine
from synth.motion.update_smoothing import Update
from synth.scene.effect_registry import effect_names
from synth.scene.scene import Scene, parse_scene
from synth.voice.hand_voice import HandVoice
from synth.voice.live_voice import LiveVoice

RATE, BLOCK = 8000, 80
SCENES: dict[str, dict[str, Any]] = {
    "acceleration": {},
    "acceleration, exact": {"accuracy": {"tolerance": "exact"}},
    "velocity": {"output": {"quantity": "velocity"}},
    "displacement": {"output": {"quantity": "displacement"}},
    "three channels": {"output": {"channels": ["displacement", "velocity", "acceleration"]}},
    "two channels": {"output": {"channels": ["displacement", "acceleration"]}},
    "light": {"scan": {"load": "1 mN"}, "output": {"quantity": "displacement"}},
    "full contact": {"scan": {"load": "30 N"}, "output": {"quantity": "displacement"}},
    "at rest": {"scan": {"speed": 0}, "output": {"quantity": "displacement"}},
    "no load": {"scan": {"load": 0}, "output": {"quantity": "velocity"}},
    "flat": {"texture": {"amplitude": 0}},
    "stroke": {"scan": {"stroke": {}}, "output": {"quantity": "displacement"}},
    "trajectory": {"scan": {"trajectory": [[0, 0, 0.3], [0.3, 0.02, 0.2], [0.6, 0.05, 0.4], [1, 0.08, 0.3]]}},
    **{name: {"effects": {name: {}}} for name in effect_names()},
    "displacement and forces": {"effects": {"tangential": {}}, "output": {"quantity": "displacement"}},
    "a mass on a shape": {"effects": {"inertia": {}, "tangential": {}}},
    "skin with three time constants": {"effects": {"viscous_skin": {"model": "three_time_constants"}}},
}


class Unrehearsed(SynthEngine):
    """The engine as it would be without rehearsals."""

    def open_live(self, scene: Scene) -> LiveVoice:
        return LiveVoice(scene, cache=self._cache)

    def open_hand(self, scene: Scene, *, record: bool = False) -> HandVoice:
        return HandVoice(scene, cache=self._cache, record=record)


def main(words: list[str]) -> None:
    unrehearsed = words[:1] == ["--unrehearsed"]
    engine = Unrehearsed(1 << 28) if unrehearsed else SynthEngine(1 << 28)
    late: dict[str, list[str]] = {}
    for name in words[int(unrehearsed) :] or SCENES:
        document = SCENES[name]
        output = {"sample_rate": RATE, "bandwidth": 1000, **document.get("output", {})}
        scene = parse_scene({"finger": {"contact_length": "2 mm"}, **document, "output": output})
        for how, found in heard(engine, scene):
            late |= {f"{name}, {how}": found} if found else {}
    print(json.dumps(late))


def heard(engine: SynthEngine, scene: Scene) -> Iterator[tuple[str, list[str]]]:
    """Play a hand and a scan; yield which loops were met only then."""
    hand = engine.open_hand(scene)
    change = hand.prepare(scene)
    known = met()
    hand.render(BLOCK)
    for number in range(40):
        speed = 0.05 if 15 < number < 20 else None
        place = None if speed else 0.001 * number + (0.2 if number > 25 else 0.0)
        hand.touch(Update(number, 0.01 * number, place, speed, 0.1 + 0.1 * (number % 5)))
        if number == 10:
            hand.apply(change)
        hand.render((BLOCK, 1, 37)[number % 3])
        if number == 35:
            hand.lift()
            hand.render(5 * BLOCK)
    hand.release()
    hand.render(5 * BLOCK)
    hand.close()
    yield "a hand", sorted((met() - known).elements())
    voice: Any = engine.open_live(scene)
    change = voice.prepare(scene)
    known = met()
    voice.render(BLOCK)
    voice.apply(change)
    voice.render(7 * BLOCK)
    voice.release()
    voice.render(3 * BLOCK)
    yield "its scan", sorted((met() - known).elements())


def met() -> Counter[str]:
    """Return each loop of `synth`, as often as it was compiled or found on disk, once for each kind of arguments."""
    loops = {
        id(one): one
        for name, module in list(sys.modules.items())
        if name.split(".")[0] == "synth"
        for one in vars(module).values()
        if isinstance(one, Dispatcher)
    }
    return Counter({f"{one.py_func.__module__}.{one.py_func.__name__}": len(one.signatures) for one in loops.values()})


if __name__ == "__main__":
    main(sys.argv[1:])
