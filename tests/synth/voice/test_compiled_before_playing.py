"""Nothing is compiled while something plays: what a live voice runs is compiled, or loaded, before its first block."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from tests.few import few

PROBE = """
import json, sys
from synth.motion.motion import Update
from synth.scene.scene import parse_scene
from synth.voice.hand_voice import HandVoice

def compiled():
    kernels = [
        (module.__name__, name, len(kernel.signatures))
        for module in list(sys.modules.values())
        if getattr(module, "__name__", "").startswith("synth.")
        for name, kernel in vars(module).items()
        if hasattr(kernel, "signatures")
    ]
    return {f"{module}.{name}": count for module, name, count in kernels if count}

voice = HandVoice(parse_scene(json.loads(sys.argv[1])))
before = compiled()
voice.render(480)
contacts = [(0.0, None, 0.3), (0.001, None, 0.9), (0.5, None, None), (None, 0.1, 0.2)]
for number, (place, speed, load) in enumerate(contacts):
    voice.touch(Update(number, 0.01 * number, place, speed, load))
    voice.render(4000)
voice.lift()
voice.render(4000)
voice.touch(Update(9, 1.0, 0.0, None, 0.3))
voice.render(4000)
voice.release()
voice.render(2000)
after = compiled()
print(json.dumps(sorted(name for name in after if after[name] != before.get(name))))
"""
SMALL = {"contact_length": "2 mm"}
SCENES: dict[str, dict[str, Any]] = {
    "response": {},
    "stroke": {"scan": {"stroke": {}}, "output": {"channels": ["displacement", "velocity"]}},
    "simulated": {"effects": {"inertia": {}, "tangential": {}}},
    "viscous skin": {"effects": {"viscous_skin": {}}},
    "grating": {"texture": {"kind": "grating"}, "effects": {"tangential": {"pressure_exponent": 0.8}}},
}


@pytest.mark.parametrize("name", few(SCENES, 3))
def test_nothing_is_compiled_while_a_hand_plays(name: str) -> None:
    scene = {"finger": SMALL} | SCENES[name]
    words = [sys.executable, "-c", PROBE, json.dumps(scene)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=170, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == []
