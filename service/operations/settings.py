"""The settings of the service: the default, the allowed values and the description of each.

Each field of `Settings` is one environment variable: RIDGEWAVE_ and the field's name in capitals. docs/settings.md has
the same table, and a test compares the two. `settings_environment` reads and checks the variables.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import Field, dataclass, field, fields
from typing import Any

from service.operations.root_path_setting import read_root_path
from service.operations.setting_readers import (
    HOST,
    existing_folder,
    listed,
    matching,
    networks,
    number,
    origins,
    socket_path,
    whole,
)

PREFIX = "RIDGEWAVE_"
OWNER_NAME = r"[a-z0-9][a-z0-9-]{0,31}"  # no colon: it ends the name
NODE_NAME = r"[A-Za-z0-9_-]{1,32}"  # no dot: in a session's id a dot ends the node's name
_KEY = r"[\x21-\x2b\x2d-\x7e]{1,256}"


def _setting(default: Any, read: Callable[[str], Any], allowed: str, sentence: str) -> Any:
    """Return a field with its reader; `read` raises ValueError for text that is not allowed."""
    return field(default=default, metadata={"read": read, "allowed": allowed, "sentence": sentence})


@dataclass(frozen=True, slots=True)
class Settings:
    """The checked settings; times in seconds, sizes in bytes."""

    host: str = _setting(
        "127.0.0.1",
        matching(r"[A-Za-z0-9._:-]+"),
        "an address or a host name",
        "The address to listen on. Beyond loopback the service starts only with RIDGEWAVE_API_KEYS.",
    )
    port: int = _setting(8000, whole(0, 65535), "0 to 65535", "The port to listen on; 0 selects a free port.")
    uds: str = _setting(
        "",
        socket_path,
        "the path of a Unix socket, of at most 100 bytes",
        "A Unix socket to listen on in place of address and port. Its mode is 0660: it is for this user and group.",
    )
    workers: int = _setting(
        1,
        whole(1, 64),
        "1 to 64",
        "Server processes. With more than one, renders and live connections work, but sessions of plain HTTP do not.",
    )
    root_path: str = _setting(
        "",
        read_root_path,
        "a path such as /lab/touch: letters, digits and -._~@+, no / at the end, none of the service's own paths",
        "The path under which a proxy offers the service, in all links. A proxy may pass it on or remove it.",
    )
    node: str = _setting(
        "",
        matching(NODE_NAME),
        "1 to 32 letters, digits, _ and -",
        "The name of this process, if a proxy serves several. Ids of sessions begin with it: NODE.RANDOM.",
    )
    api_keys: tuple[str, ...] = _setting(
        (),
        listed(_KEY),
        "keys of 1 to 256 visible ASCII characters, separated by commas",
        "The keys of callers. Each request must carry one as a Bearer token. If empty, no key is required.",
    )
    owner_keys: tuple[str, ...] = _setting(
        (),
        listed(rf"{OWNER_NAME}:{_KEY}"),
        "pairs OWNER:KEY, separated by commas; an owner is 1 to 32 small letters, digits and -; a key is as above",
        "Keys of owners with names, beside the keys above. An owner may have several keys, and keeps its textures.",
    )
    allowed_hosts: tuple[str, ...] = _setting(
        ("localhost", "127.0.0.1", "[::1]"),
        listed(rf"\*|{HOST}"),
        "host names without a port, separated by commas; * for every host, only together with RIDGEWAVE_API_KEYS",
        "The Host names that the service accepts, against DNS rebinding. Requests with other names are refused.",
    )
    allowed_origins: tuple[str, ...] = _setting(
        (),
        origins,
        "origins such as https://lab.example:8443, separated by commas",
        "Origins of other web pages that may use the service (CORS). The service's own pages always may.",
    )
    max_sessions: int = _setting(
        64,
        whole(1, 10_000),
        "1 to 10000",
        "Sessions of a worker at a time, and as many live ones. Beyond: 503 with Retry-After, or close code 1013.",
    )
    full_at: float = _setting(
        0.9,
        number(0.1, 1.0),
        "0.1 to 1",
        "Part of the last second in which the event loop of a worker may have been busy. Beyond it, or where blocks "
        "are 20 ms late on average, new streams get 503 with Retry-After, or close code 1013. A worker always takes "
        "four streams. 1: streams are never refused because of the load.",
    )
    session_idle: float = _setting(
        300.0,
        number(0.05, 86_400),
        "0.05 to 86400 s",
        "A session without a reader, a play or a request for this long expires.",
    )
    max_renders: int = _setting(
        64, whole(1, 10_000), "1 to 10000", "Renders running or waiting at a time; further ones get 503."
    )
    render_seconds_per_client: float = _setting(
        36_000.0,
        number(1.0, 1e9),
        "1 to 1000000000 s",
        "Predicted processor time of all renders under way of one key or address; beyond, 429 or 413.",
    )
    render_seconds: float = _setting(
        144_000.0,
        number(1.0, 1e9),
        "1 to 1000000000 s",
        "The same for all renders of a worker; beyond, 503 with Retry-After.",
    )
    solves_per_client: int = _setting(
        4,
        whole(1, 10_000),
        "1 to 10000",
        "Long solves of one key or address at a time, for renders and for sessions separately. Others wait.",
    )
    max_solves: int = _setting(8, whole(1, 10_000), "1 to 10000", "The same for all clients of a worker.")
    max_duration: float = _setting(
        3600.0,
        number(0.001, 86_400),
        "0.001 to 86400 s",
        "The longest render, the longest finite stream, and the longest recording of the file sink.",
    )
    max_body: int = _setting(
        1_048_576, whole(1024, 67_108_864), "1024 to 67108864 bytes", "The largest request body; beyond, 413."
    )
    stream_block: float = _setting(
        0.02, number(0.001, 0.1), "0.001 to 0.1 s", "Duration of one block of a stream or a play."
    )
    lead: float = _setting(
        0.25,
        number(0.0, 1.0),
        "0 to 1 s",
        "Time by which a stream is sent ahead of the clock. A change is heard after it; a slow network needs more.",
    )
    max_silence: float = _setting(
        0.25,
        number(0.01, 10.0),
        "0.01 to 10 s",
        "After this long without a contact update, the load of a live stream ramps to zero.",
    )
    max_updates: int = _setting(
        2000,
        whole(10, 100_000),
        "10 to 100000 a second",
        "Messages of one live connection that are read per second. More wait, and the client waits with them.",
    )
    resume: float = _setting(
        10.0,
        number(0.0, 600.0),
        "0 to 600 s",
        "Time for which a live session can be resumed after its connection broke.",
    )
    slow_reader: float = _setting(
        1.0,
        number(0.05, 60.0),
        "0.05 to 60 s",
        "Time by which a real-time stream may be late because its client does not read; beyond, close code 4408.",
    )
    file_folder: str = _setting(
        "recordings",
        matching(r"[^\x00]+"),
        "a folder",
        'The only folder that the file sink ("file:NAME") writes to. It is made when it is first needed.',
    )
    data_folder: str = _setting(
        "",
        matching(r"[^\x00]+"),
        "a folder",
        "The folder of imported textures, and of tables. Unset, it is the platform's folder of the user's data.",
    )
    prepare_textures: str = _setting(
        "on",
        matching("on|off"),
        "on or off",
        "Solve imported textures and the catalogue ahead, in one process of the lowest priority.",
    )
    max_import: int = _setting(
        134_217_728,
        whole(1024, 134_217_728),
        "1024 to 134217728 bytes",
        "The largest body of an import: the file of a surface with its form; beyond, 413.",
    )
    imports_per_client: int = _setting(
        8,
        whole(1, 10_000),
        "1 to 10000",
        "Imports of one key or address uploading, waiting or being read at a time in a worker; beyond, 429.",
    )
    import_bytes_per_client: int = _setting(
        1 << 28,
        whole(1024, 1 << 40),
        "1024 to 1099511627776 bytes",
        "The bodies of these imports together; beyond, 429. One that is larger alone gets 413.",
    )
    max_imports: int = _setting(
        64,
        whole(1, 10_000),
        "1 to 10000",
        "Imports of all clients under way at a time in a worker; beyond, 503.",
    )
    textures_per_key: int = _setting(
        200, whole(0, 1_000_000), "0 to 1000000", "Imported textures that one key may keep; beyond, 413."
    )
    texture_bytes_per_key: int = _setting(
        1 << 30,
        whole(0, 1 << 40),
        "0 to 1099511627776 bytes",
        "The size of the imported textures that one key may keep, 4 bytes a point; beyond, 413.",
    )
    web: str = _setting(
        "",
        existing_folder,
        "an existing folder",
        "A folder with the web page at / and /vr, instead of the page that is part of ridgewave.",
    )
    cache_bytes: int = _setting(
        268_435_456,
        whole(0, 1 << 40),
        "0 to 1099511627776 bytes",
        "Memory for solved contact responses, tables, surfaces and solvers, shared by all sessions of a process.",
    )
    live_bytes: int = _setting(
        1 << 30,
        whole(1 << 20, 1 << 40),
        "1048576 to 1099511627776 bytes",
        "Memory of a worker for all sessions: voices, buffers, recordings. Beyond, new ones are refused (503, 1013).",
    )
    shutdown_timeout: int = _setting(
        1,
        whole(1, 3600),
        "1 to 3600 s, whole",
        "Time for unfinished answers after SIGTERM. Streams fade out and end at once, whatever the value.",
    )
    streams_per_key: int = _setting(
        512,
        whole(1, 100_000),
        "1 to 100000",
        "Streams of one key in a worker at a time: live streams, HTTP streams and plays together; beyond, 429.",
    )
    streams_per_address: int = _setting(
        512, whole(1, 100_000), "1 to 100000", "The same for one address. All of loopback is one address."
    )
    requests_per_second: float = _setting(
        500.0,
        number(0.1, 1e6),
        "0.1 to 1000000",
        "Requests per second, on average, of one address or key in a worker; beyond, 429 with Retry-After.",
    )
    request_burst: int = _setting(
        1000,
        whole(1, 1_000_000),
        "1 to 1000000",
        "Requests that one address or key may send at once, after a pause.",
    )
    max_stream: float = _setting(
        86_400.0,
        number(0.05, 31_536_000),
        "0.05 to 31536000 s",
        "The longest live stream or HTTP stream without a duration. It ends with a fade.",
    )
    max_message: int = _setting(
        65_536, whole(1024, 16_777_216), "1024 to 16777216 bytes", "The largest message of a live connection."
    )
    trusted_proxies: tuple[str, ...] = _setting(
        (),
        networks,
        "addresses or networks such as 10.0.0.0/8, separated by commas",
        "Proxies whose X-Forwarded-For names the caller. Without them, limits count the proxy's address.",
    )
    log_level: str = _setting(
        "info",
        matching("debug|info|warning|error"),
        "debug, info, warning or error",
        "The lowest level that is logged.",
    )
    log_format: str = _setting(
        "text", matching("text|json"), "text or json", "Write each event as a plain line, or as a JSON object."
    )

    @property
    def requires_key(self) -> bool:
        """Whether a request must carry a key."""
        return bool(self.api_keys or self.owner_keys)


def variable(name: str) -> str:
    """Return the environment variable of the field `name`."""
    return PREFIX + name.upper()


def setting_fields() -> tuple[Field[Any], ...]:
    """Return one dataclass field per setting; its `metadata` has read, allowed and sentence."""
    return fields(Settings)


def default_text(entry: Field[Any]) -> str:
    """Return the default of a setting as written in the environment."""
    return (",".join(entry.default) if isinstance(entry.default, tuple) else str(entry.default)) or "none"
