"""The folder of a training run: who may write there, and where the run stands.

Where it stands is two files, ``state.safetensors`` and ``state.json``, which names the digest of the first. New tensors
are written beside the old ones, then the JSON that names them, then they take the old ones' place: whenever the process
is killed, one of the two tensor files is the one that the JSON names.
"""

import contextlib
import hashlib
import json
import os
import shlex
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from torch import Tensor
from torch.utils.tensorboard import SummaryWriter

from artperl.core.tensor_files import read_tensors, write_tensors
from artsim.common.files import parse_json, read_bounded, read_json, write_atomic, write_error
from artsim.errors import DatasetError
from artsim.runs import recipe
from artsim.runs.lock import folder_lock

_FORMAT = 3
_MAX_JSON = 64_000_000
_PATIENCE = 60.0
"""Seconds that a process that was started again waits for the workers of the one before; they look every five."""
_SHOWN = 6
"""Differing options that are named."""


class RunFolder:
    """Files of a run.

    Parameters
    ----------
    path : Path
        Made when first written to.
    """

    def __init__(self, path: Path):
        self.path, self.best = path, path / "best"
        self._json, self._tensors = path / "state.json", path / "state.safetensors"
        self._next = path / ".state.safetensors.next"
        self._seconds = path / "seconds.json"
        self.fix = (
            "to start this run again from its beginning: rm "
            f"{shlex.quote(str(self._json))} {shlex.quote(str(self._tensors))}"
        )
        """What to do when the state is damaged."""

    @property
    def begun(self) -> bool:
        """Whether a run has been written down here."""
        return self._json.exists() or self._tensors.exists()

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Nobody else writes here in this block; what a killed run left half written is gone.

        Raises
        ------
        DatasetError
            When another run is writing here.
        """
        with contextlib.ExitStack() as stack:
            self._lock(stack)
            for folder in (self.path, self.best):
                for part in (*folder.glob(".*.part"), *folder.glob(".*.safetensors"), *folder.glob(".*.npz")):
                    part.unlink(missing_ok=True)
            yield

    def _lock(self, stack: contextlib.ExitStack) -> None:
        """Lock the folder. Workers of a killed process hold it until they notice, while torchrun starts it again."""
        last = time.monotonic() + (_PATIENCE if os.environ.get("TORCHELASTIC_RESTART_COUNT", "0") != "0" else 0.0)
        while True:
            try:
                stack.enter_context(folder_lock(self.path))
                return
            except DatasetError:
                if time.monotonic() > last:
                    raise
                time.sleep(0.5)

    def write(self, state: Mapping[str, Any], tensors: Mapping[str, Tensor]) -> str:
        """Write down where the run stands.

        Parameters
        ----------
        state : mapping
            In JSON's terms.
        tensors : mapping

        Returns
        -------
        str
            Digest of all of it.

        Raises
        ------
        ConfigError
            When the folder cannot be written to, or the disk is full; what was written before is still there.
        """
        kept = {**state, "format": _FORMAT, "tensors_sha256": write_tensors(tensors, self._next)}
        digest = _digest(kept)
        write_atomic(self._json, (json.dumps({**kept, "sha256": digest}, indent=1) + "\n").encode())
        try:
            self._next.replace(self._tensors)
        except OSError as error:
            raise write_error(error, self._tensors) from error
        return digest

    def read(self) -> tuple[dict[str, Any], dict[str, Tensor], str]:
        """Where the run stands, as :meth:`write` was told, and the digest; only while the folder is held.

        Raises
        ------
        DatasetError
            When a file is missing or damaged; the message names it.
        """
        if not self._json.exists():
            raise DatasetError("this file is missing beside state.safetensors", self._json, self.fix)
        try:
            state = parse_json(read_bounded(self._json, _MAX_JSON, "the state of the run", DatasetError), finite=False)
        except DatasetError as error:
            raise DatasetError(error.what, self._json, self.fix) from error
        except ValueError as error:
            raise DatasetError(f"the state of the run is damaged ({error})", self._json, self.fix) from error
        if not isinstance(state, dict) or not isinstance(state.get("options"), dict) or "sha256" not in state:
            raise DatasetError("the state of the run is damaged (there is no run in it)", self._json, self.fix)
        if state.get("format") != _FORMAT:
            raise DatasetError(f"format {state.get('format')!r:.20} is not {_FORMAT}", self._json, self.fix)
        digest = str(state.pop("sha256"))
        if digest != _digest(state):
            raise DatasetError("the state of the run is damaged (its checksum differs)", self._json, self.fix)
        wanted = state.pop("tensors_sha256", None)
        if self._next.exists():  # the run was killed before these tensors were in place, or before they were named
            with contextlib.suppress(DatasetError):
                if self._read_tensors(self._next)[1] == wanted:
                    self._next.replace(self._tensors)
            self._next.unlink(missing_ok=True)
        tensors, found = self._read_tensors(self._tensors)
        if wanted != found:
            raise DatasetError("these are not the tensors that state.json names", self._tensors, self.fix)
        return state, tensors, digest

    def write_seconds(self, seconds: Mapping[str, float]) -> None:
        """Write down the processor time of each stage, in a file of its own: what a run learns does not depend on it.

        Raises
        ------
        ConfigError
            When the folder cannot be written to, or the disk is full.
        """
        write_atomic(self._seconds, (json.dumps(seconds, indent=1) + "\n").encode())

    def read_seconds(self) -> dict[str, float]:
        """The processor time of each stage; none of a run that has not written any down.

        Raises
        ------
        DatasetError
            When the file is damaged.
        """
        if not self._seconds.exists():
            return {}
        told = read_json(self._seconds, "the processor time of the run", DatasetError, _MAX_JSON)
        try:
            return {str(name): float(value) for name, value in told.items()}
        except (AttributeError, TypeError, ValueError) as error:
            raise DatasetError("the processor time of the run is damaged", self._seconds, "remove it") from error

    def _read_tensors(self, path: Path) -> tuple[dict[str, Tensor], str]:
        return read_tensors(path, "the state of the run", self.fix)

    @contextlib.contextmanager
    def curves(self) -> Iterator[SummaryWriter]:
        """What writes curves for TensorBoard, into ``events``.

        Raises
        ------
        ConfigError
            When it cannot, for example since the disk is full.
        """
        events = self.path / "events"
        try:
            board = SummaryWriter(str(events))
        except OSError as error:
            raise write_error(error, events) from error
        try:
            yield board
        except BaseException:  # Ctrl-C, too: what was written so far is kept
            with contextlib.suppress(OSError):  # the first error is the one to tell
                board.close()
            raise
        try:
            board.close()
        except OSError as error:
            raise write_error(error, events) from error


def differences(begun: Mapping[str, Any], asked: Mapping[str, Any]) -> str:
    """Names of options whose values differ, at every depth, each with the value that the run was begun with."""
    found = [
        f"{name} ({json.dumps(old):.40} there, {json.dumps(new):.40} asked for)"
        for name, old, new in recipe.differences(begun, {**dict.fromkeys(begun), **asked})
    ]
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return ", ".join(found[:_SHOWN]) + more


def _digest(state: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(state, sort_keys=True).encode()).hexdigest()
