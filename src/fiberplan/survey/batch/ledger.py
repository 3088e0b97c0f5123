"""The ledger of a survey: a line of JSON for each field that is done, each with a checksum.

Its first line says what the survey is of. A field's files are on disk, whole, before its line is appended, and the line
is on disk before anything builds on it; so a run may be killed at any moment. What a kill, or a loss of power, leaves
of a line has no end, and is cut off when the next run begins. Two runs cannot have it open at the same time.
"""

import fcntl
import hashlib
import json
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

from fiberplan.errors import FiberplanError
from fiberplan.survey.batch.record import Record
from fiberplan.tables.atomic import write_whole

NAME = "ledger.jsonl"
_FORMAT = 1


class Ledger:
    """An open ledger; a context that lets others have it at its end.

    Raises:
        FiberplanError: it is damaged, is of other inputs, another run has it, or it cannot be written.
    """

    def __init__(self, folder: Path, inputs: Mapping[str, str]):
        """Open the ledger in a folder, or begin one.

        Args:
            folder: of the survey; it exists.
            inputs: what the survey is of: names in words, such as "catalogue", and fingerprints.
        """
        self._folder, self._path = folder, folder / NAME
        self.records: dict[int, Record] = {}  #: by number of field
        try:
            self._file: BinaryIO = open(self._path, "a+b", buffering=0)  # noqa: SIM115, PTH123 (closed by the context)
        except OSError as error:
            raise FiberplanError(f"{self._path}: cannot be opened ({_reason(error)})") from None
        try:
            self._begin(dict(inputs))
        except BaseException:
            self._file.close()
            raise

    def _begin(self, inputs: dict[str, str]) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise FiberplanError(f"{self._path}: another run is at work in this folder") from None
        self._file.seek(0)
        content = self._file.read()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):  # a line that a kill cut short
            self._file.truncate(whole)
        lines = content[:whole].splitlines()
        if not lines:
            self._append({"ledger": _FORMAT, "inputs": inputs})
            _sync(self._folder)
            return
        said = self._read(1, lines[0])
        if said.get("ledger") != _FORMAT:
            raise FiberplanError(f"{self._path}: line 1: is not a ledger of format {_FORMAT}")
        known = said.get("inputs", {})
        for name, value in inputs.items():
            if known.get(name) != value:
                raise FiberplanError(f"{self._path}: is of another {name}: take another folder, or the {name} it is of")
        for number, line in enumerate(lines[1:], 2):
            try:
                record = Record.heard(self._read(number, line))
            except (TypeError, ValueError, KeyError):
                raise FiberplanError(f"{self._path}: line {number}: is no record of a field") from None
            if record.field in self.records:
                raise FiberplanError(f"{self._path}: line {number}: field '{record.id}' is there already")
            for name, size, _ in record.files:
                self._refuse_changed(self._folder / name, size, record.id)
            self.records[record.field] = record

    def _read(self, number: int, line: bytes) -> dict[str, Any]:
        check, _, text = line.partition(b" ")
        try:
            if int(check, 16) != zlib.crc32(text):
                raise ValueError
            said = json.loads(text)
        except ValueError:
            raise FiberplanError(f"{self._path}: line {number}: is damaged") from None
        return dict(said)

    @staticmethod
    def _refuse_changed(path: Path, size: int, field: str) -> None:
        """Refuse a file that is gone or has another size; plans carry a seal that is looked at when they are read."""
        try:
            there = path.stat().st_size
        except OSError:
            raise FiberplanError(f"{path}: cannot be read, and the ledger says that field '{field}' is done") from None
        if there != size:
            raise FiberplanError(f"{path}: has {there} bytes, and {size} were written for field '{field}'")

    def _append(self, said: Mapping[str, Any]) -> None:
        text = json.dumps(said, separators=(",", ":")).encode()
        try:
            self._file.write(f"{zlib.crc32(text):08x} ".encode() + text + b"\n")
            os.fsync(self._file.fileno())
        except OSError as error:
            raise FiberplanError(
                f"{self._path}: cannot be written ({(error.strerror or str(error)).lower()})"
            ) from None

    def enter(self, record: Record, files: Mapping[str, bytes]) -> Record:
        """Write a field's files, and then its line; the record with the files' names and digests.

        Raises:
            FiberplanError: one cannot be written.
        """
        written = []
        for name, content in files.items():
            path = self._folder / name
            path.parent.mkdir(exist_ok=True)
            write_whole(path, content, FiberplanError)
            _sync(path)
            written.append((name, len(content), hashlib.sha256(content).hexdigest()))
        for folder in {(self._folder / name).parent for name in files}:
            _sync(folder)
        record = record._replace(files=tuple(written))
        self._append(record.said())
        self.records[record.field] = record
        return record

    def __enter__(self) -> "Ledger":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()


def _sync(path: Path) -> None:
    """Have a file, or a folder's names, on disk."""
    number = os.open(path, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).lower()
