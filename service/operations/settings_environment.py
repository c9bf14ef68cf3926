"""The settings from environment variables, read and checked once at the start, and back for the workers.

The variables, their defaults and their allowed values are in `settings`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import Field
from typing import Any

from service.operations.root_path_setting import WithHint
from service.operations.settings import Settings, default_text, setting_fields, variable
from synth.errors import Fault, InvalidRequest, shown

NOT_SHOWN = "(not shown)"  # in place of a key


class SettingsError(InvalidRequest):
    """Invalid settings; the pointer of each fault is the name of an environment variable."""


def read_settings(environment: Mapping[str, str] | None = None, **overrides: object) -> Settings:
    """Return the settings in `environment`, by default that of this process.

    An override that is not None wins. An empty variable counts as unset. Raises SettingsError with all faults.
    """
    source = os.environ if environment is None else environment
    values: dict[str, Any] = {}
    faults: list[Fault] = []
    for entry in setting_fields():
        given = overrides.pop(entry.name, None)
        text = source.get(variable(entry.name), "") if given is None else str(given)
        if not text.strip() and given is None:
            continue
        try:
            values[entry.name] = entry.metadata["read"](text.strip())
        except ValueError as error:
            faults.append(_fault(entry, text, str(error) if isinstance(error, WithHint) else ""))
    assert not overrides, f"not settings: {', '.join(overrides)}"
    if not faults:
        settings = Settings(**values)
        faults = _contradictions(settings)
    if faults:
        raise SettingsError(faults)
    return settings


def as_environment(settings: Settings) -> dict[str, str]:
    """Return the variables from which `read_settings` reads `settings`; workers get them."""
    values = {entry.name: getattr(settings, entry.name) for entry in setting_fields()}
    texts = {name: ",".join(value) if isinstance(value, tuple) else str(value) for name, value in values.items()}
    return {variable(name): text for name, text in texts.items()}


def _fault(entry: Field[Any], text: str, hint: str = "") -> Fault:
    value = NOT_SHOWN if entry.name in ("api_keys", "owner_keys") else shown(text)
    hint = hint or f"Leave {variable(entry.name)} unset for {default_text(entry)}."
    return Fault(variable(entry.name), value, entry.metadata["allowed"], hint)


def _contradictions(settings: Settings) -> list[Fault]:
    """Return faults in the combination of valid settings."""
    faults = []
    if "*" in settings.allowed_hosts and not settings.requires_key:
        hint = "Name the hosts, or set RIDGEWAVE_API_KEYS."
        faults.append(Fault(variable("allowed_hosts"), "'*'", "* only together with RIDGEWAVE_API_KEYS", hint))
    pairs = set(settings.owner_keys)
    keys = [pair.partition(":")[2] for pair in pairs] + list(set(settings.api_keys))
    if len(set(keys)) < len(keys):
        hint = "Write each key once, for one owner; remove from RIDGEWAVE_API_KEYS a key that has a name here."
        faults.append(Fault(variable("owner_keys"), NOT_SHOWN, "keys of one owner each", hint))
    return faults
