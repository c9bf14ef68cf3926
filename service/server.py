"""Starts the service: its log, its listening socket and its processes.

Model: accepted connections inherit a small `TCP_NOTSENT_LOWAT` from the listening socket, so that little sound waits in
    the kernel: no change and no stop can reach that sound. Beyond loopback, the service does not start without a key.
    SIGTERM fades the streams out at once (`service.lifespan`); other answers have RIDGEWAVE_SHUTDOWN_TIMEOUT to end.
    With one process, SIGHUP does the same.
Limits: only unsent sound is bounded, not sound that the reader's machine has received.
"""

from __future__ import annotations

import ipaddress
import logging
import os
import signal
import socket
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.operations.logs import set_up_log
from service.operations.settings import Settings, variable
from service.operations.settings_environment import SettingsError, as_environment
from service.operations.worker_messages import FOLDER_VARIABLE, check_folder
from service.unix_socket import identity, listen_on_path, remove_own
from synth.errors import CannotRender, Fault
from synth.kernel_folders import tell_for_all_processes
from synth.linear_algebra import use_one_thread

if TYPE_CHECKING:
    from fastapi import FastAPI

    from service.engine import Engine

log = logging.getLogger("ridgewave.service")

WAITING_BYTES = 16_384  # unsent, per connection: 85 ms of float32 mono at 48 kHz; a render still fills the link
WORKER_SECONDS = 30  # until a worker that does not answer is replaced; shorter replaces workers that start slowly
BACKLOG = 2048
LIVE_OPTIONS: dict[str, Any] = {  # uvicorn's, for connections
    "http": "service.http.request_timeout:RequestTimeout",
    "ws": "service.live.websocket:LiveProtocol",
    "ws_ping_interval": 5.0,  # s, and as long for the answer: a dead connection is noticed within 10 s
}
NO_SOCKETS_FOLDER = (
    "several workers need a temporary folder for their sockets, and none can be made here: set TMPDIR to a folder that "
    "can be written, or RIDGEWAVE_WORKERS to 1."
)
WORKER = "service.operations.worker_process:app"  # the application factory of each of several processes


def run(settings: Settings, engine: Engine | None = None, *, worker: str = WORKER) -> int:
    """Serve until a signal; return 0.

    engine: of a single process; `synth`, unless a test supplies its own.
    worker: the application factory of each of several processes, "module:function".
    Raises SettingsError for an address beyond loopback without a key, and CannotRender where the service cannot listen
    on the address.
    """
    require_key(settings)
    set_up_log(settings.log_level, settings.log_format)
    tell_for_all_processes()
    listener = listen(settings)
    own = identity(settings.uds)
    if own is not None and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, lambda number, _: _end_without_socket(number, settings.uds, own))
    log.info("listening on %s", f"unix:{settings.uds}" if settings.uds else f"http://{shown_address(listener)}")
    try:
        _serve(settings, listener, engine, worker)
    finally:
        listener.close()
        remove_own(settings.uds, own)
    return 0


def require_key(settings: Settings) -> None:
    """Raise SettingsError where the address is beyond loopback and no key is set. A Unix socket is on this machine."""
    if settings.requires_key or settings.uds or all(_is_loopback(address) for address in _addresses(settings.host)):
        return
    hint = "Set RIDGEWAVE_API_KEYS, or listen on 127.0.0.1."
    raise SettingsError(
        [Fault(variable("host"), settings.host, "a loopback address, without RIDGEWAVE_API_KEYS", hint)]
    )


def listen(settings: Settings) -> socket.socket:
    """Return the listening socket; raises CannotRender where the service cannot listen."""
    if settings.uds:
        listener = listen_on_path(settings.uds, BACKLOG)
        listener.set_inheritable(True)
        return listener
    family = socket.AF_INET6 if ":" in _addresses(settings.host)[0] else socket.AF_INET
    try:
        listener = socket.create_server((settings.host, settings.port), family=family, backlog=BACKLOG)
    except OSError as error:
        reason = os.strerror(error.errno).lower() if error.errno else str(error)
        raise CannotRender(f"cannot listen on {settings.host} port {settings.port}: {reason}.") from error
    low_water = getattr(socket, "TCP_NOTSENT_LOWAT", None)
    if low_water is not None:
        listener.setsockopt(socket.IPPROTO_TCP, low_water, WAITING_BYTES)
    else:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, WAITING_BYTES)
    listener.set_inheritable(True)
    return listener


def shown_address(listener: socket.socket) -> str:
    """Return `host:port` of a listening socket."""
    host, port = listener.getsockname()[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def _serve(settings: Settings, listener: socket.socket, engine: Engine | None, worker: str) -> None:
    use_one_thread()  # before numpy is imported, here and in the worker processes

    import uvicorn
    from uvicorn.supervisors import Multiprocess

    from service.http.connection_limit import burst

    options: dict[str, Any] = {
        "factory": True,
        "workers": settings.workers,
        "backlog": min(BACKLOG, burst() or BACKLOG),
        "log_config": None,
        "access_log": False,  # its lines have queries; those of `service.operations.logs` do not
        "server_header": False,
        "proxy_headers": False,
        "timeout_graceful_shutdown": settings.shutdown_timeout,
        "timeout_worker_healthcheck": WORKER_SECONDS,
        **LIVE_OPTIONS,
        "ws_max_size": settings.max_message,  # beyond it the connection is closed with 1009
    }
    if settings.workers > 1:
        with _sockets_folder() as folder:
            check_folder(Path(folder))
            os.environ.update(as_environment(settings) | {FOLDER_VARIABLE: folder})
            config = uvicorn.Config(worker, **options)
            Multiprocess(config, sockets=[listener]).run()
        return
    from service.app import create_app

    def app() -> FastAPI:
        """Return the application, of a process that serves alone."""
        made = create_app(settings, engine)
        made.state.service.serves_only = True
        return made

    if signal.getsignal(signal.SIGHUP) is signal.SIG_DFL:  # not ignored, as it is under nohup
        signal.signal(signal.SIGHUP, lambda *_: signal.raise_signal(signal.SIGTERM))
    config = uvicorn.Config(app, **options)
    uvicorn.Server(config).run(sockets=[listener])


def _end_without_socket(number: int, path: str, own: tuple[int, int]) -> None:
    """Remove the socket, then end by the signal: uvicorn sends it again once the service has ended."""
    remove_own(path, own)
    signal.signal(number, signal.SIG_DFL)
    signal.raise_signal(number)


def _sockets_folder() -> tempfile.TemporaryDirectory[str]:
    try:
        return tempfile.TemporaryDirectory(prefix="ridgewave-", ignore_cleanup_errors=True)
    except OSError as error:
        raise CannotRender(NO_SOCKETS_FOLDER) from error


def _addresses(host: str) -> list[str]:
    """Return the numeric addresses of `host`; raises SettingsError where it has none."""
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except OSError as error:
        fault = Fault(variable("host"), host, "an address or a host name of this machine", "Write 127.0.0.1.")
        raise SettingsError([fault]) from error
    return [str(entry[4][0]) for entry in found]


def _is_loopback(address: str) -> bool:
    return ipaddress.ip_address(address.partition("%")[0]).is_loopback
