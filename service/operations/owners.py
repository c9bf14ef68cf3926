"""The owners of keys: who has which key, and under which word the store knows an owner.

Model: a pair of RIDGEWAVE_OWNER_KEYS gives a key to an owner with a name. A key of RIDGEWAVE_API_KEYS is an owner of
    its own, and the SHA-256 of the key is its word, so that the database holds no key. A name has at most 32
    characters, so it is never such a hash.
"""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha256

from service.operations.settings import Settings


def owners_of_keys(settings: Settings) -> Mapping[str, str]:
    """Return the owner of each key."""
    named = {key: name for name, _, key in (pair.partition(":") for pair in settings.owner_keys)}
    return named | {key: owner_without_name(key) for key in settings.api_keys}


def owners(settings: Settings) -> tuple[str, ...]:
    """Return each owner once. The number of an owner is its place here; it is the same in every worker."""
    return tuple(dict.fromkeys(owners_of_keys(settings).values()))


def owner_without_name(key: str) -> str:
    """Return the owner of `key` where it has no name."""
    return sha256(key.encode()).hexdigest()
