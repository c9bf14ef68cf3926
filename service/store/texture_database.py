"""The database of imported textures: a file of SQLite in the data folder, and connections to it.

Model: one database, textures.sqlite. Each change is one transaction, so a process that is killed leaves it whole or
    absent. In WAL mode readers never wait, and writers of several processes take turns. A connection is opened for each
    call: threads and forked processes share none. In WAL mode a reader makes small files beside the database. Where it
    cannot, on a full or read-only disk, the file of the database alone is read.
Source: SQLite, Atomic Commit In SQLite; Write-Ahead Logging.
Limits: WAL needs a local disk, not a network share. A call waits up to BUSY_SECONDS for another writer.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from synth.errors import CannotRender

FILE = "textures.sqlite"
BUSY_SECONDS = 20.0
NO_ROOM = {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY}
UNREADABLE = (
    "the imported textures cannot be read or kept. The data folder (RIDGEWAVE_DATA_FOLDER) must be writable and have "
    "room, and textures.sqlite in it must be whole."
)
TABLES = """
BEGIN IMMEDIATE;
CREATE TABLE IF NOT EXISTS surfaces (
    address TEXT PRIMARY KEY, shape TEXT NOT NULL, spacing TEXT NOT NULL, heights BLOB NOT NULL
);
CREATE TABLE IF NOT EXISTS textures (
    owner TEXT NOT NULL, name TEXT NOT NULL, address TEXT NOT NULL REFERENCES surfaces, kind TEXT NOT NULL,
    report TEXT NOT NULL, created TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%SZ', 'now')),
    PRIMARY KEY (owner, name)
);
CREATE INDEX IF NOT EXISTS textures_by_address ON textures (address);
COMMIT;
"""


@dataclass(frozen=True, slots=True)
class TextureDatabase:
    """The database in `folder`. Databases of the same folder are equal.

    tells_folder: whether errors name the folder.
    """

    folder: Path
    tells_folder: bool = field(default=False, compare=False)

    @property
    def _path(self) -> Path:
        return self.folder / FILE

    @contextmanager
    def reading(self) -> Iterator[sqlite3.Connection]:
        """Yield a connection to read with; without a database, to an empty one. Raises CannotRender."""
        if not self._path.exists():
            with closing(sqlite3.connect(":memory:")) as database:
                database.executescript(TABLES)
                yield database
            return
        with _plain_errors(self.folder if self.tells_folder else None), closing(self._readable()) as database:
            yield database

    @contextmanager
    def writing(self) -> Iterator[sqlite3.Connection]:
        """Yield a connection in a transaction, which an exception undoes. Makes the database. Raises CannotRender."""
        with _plain_errors(self.folder if self.tells_folder else None):
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            with closing(self._connected()) as database:
                database.execute("BEGIN IMMEDIATE")
                try:
                    yield database
                    database.execute("COMMIT")
                except BaseException:
                    if database.in_transaction:
                        database.execute("ROLLBACK")
                    raise

    def _readable(self) -> sqlite3.Connection:
        try:
            return self._connected()
        except sqlite3.OperationalError as error:
            log = self._path.with_name(f"{FILE}-wal")  # of changes that are not in the database yet
            if error.sqlite_errorcode & 0xFF not in NO_ROOM or (log.exists() and log.stat().st_size):
                raise
            return sqlite3.connect(f"{self._path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)

    def _connected(self) -> sqlite3.Connection:
        database = sqlite3.connect(self._path, timeout=BUSY_SECONDS, isolation_level=None)
        try:
            made = "SELECT count(*) FROM sqlite_master WHERE name = 'textures_by_address'"  # the last of TABLES
            if not database.execute(made).fetchone()[0]:
                database.execute("PRAGMA auto_vacuum = FULL")  # deleting a surface frees its place on the disk
                database.executescript(TABLES)
            with suppress(sqlite3.OperationalError):  # refused while another reads or writes: a later call does it
                database.execute("PRAGMA journal_mode = WAL")
            database.execute("PRAGMA synchronous = FULL")  # a commit is on the disk: a power cut does not undo it
        except BaseException:
            database.close()
            raise
        return database


@contextmanager
def _plain_errors(folder: Path | None) -> Iterator[None]:
    """Raise CannotRender in place of what SQLite and the file system raise, without their words.

    folder: the data folder, to be told to its owner; None for a peer, who is told no path.
    """
    try:
        yield
    except (sqlite3.Error, OSError) as error:
        raise CannotRender(UNREADABLE + (f" It is {folder}." if folder else "")) from error
