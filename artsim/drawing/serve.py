"""A local page of a dataset that loads samples on demand: ``artsim view DIR --serve``."""

import json
import re
import threading
from collections.abc import Iterable
from contextlib import ExitStack
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np

from artsim.common.names import printable
from artsim.common.progress import track
from artsim.datasets.dataset import Dataset
from artsim.drawing.page import SENSOR_ERROR, PageContent, frames_page, sample_frame
from artsim.errors import ArtsimError, ConfigError
from artsim.observing.sample import Sample

_HOST = "127.0.0.1"
"""No other machine reaches this address."""
_PATIENCE = 30.0
"""Seconds after which a connection that asks for nothing is closed."""
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; img-src blob:"
"""The page runs what is in it, and asks this server alone."""


def serve(path: Path, split: str | None = None, port: int = 0) -> None:
    """Show a dataset to browsers of this machine until Ctrl-C; say where.

    Parameters
    ----------
    path : Path
        Folder of the dataset.
    split : str, optional
        Show this split only.
    port : int
        0 takes a free one.

    Raises
    ------
    ArtsimError
        When there is no dataset or no sample, or the port is in use.
    """
    with DatasetServer(Dataset(path, split), path.resolve().name, port) as server:
        try:
            print(f"open {server.url} in a browser of this machine; stop with Ctrl-C", flush=True)
            server.serve_forever()
        except KeyboardInterrupt:
            print("\nstopped", flush=True)


class DatasetServer(ThreadingHTTPServer):
    """Serves one page, and each sample of a dataset by its number; no file.

    Parameters
    ----------
    dataset : Dataset
    name : str
    port : int
        0 takes a free one.

    Raises
    ------
    ConfigError
        When there is no sample, or the port is in use.
    """

    daemon_threads = True  # a browser that keeps a connection open does not keep the program

    def __init__(self, dataset: Dataset, name: str, port: int = 0):
        if not len(dataset):
            raise ConfigError("there is no sample to show", name, "choose another split")
        try:
            super().__init__((_HOST, port), _Answer)
        except (OSError, OverflowError) as error:
            raise ConfigError(f"port {port} cannot be used ({error})", "port", "leave it out for a free one") from error
        with ExitStack() as stack:  # a damaged sample, or Ctrl-C, frees the port
            stack.callback(self.server_close)
            index = index_of(track("read samples", iter(dataset), total=len(dataset), unit="sample", leave=False))
            content = PageContent(f"{printable(name)}: {len(dataset)} samples", error_word=SENSOR_ERROR, index=index)
            self.page = frames_page(content, [])
            stack.pop_all()
        self._dataset, self._one_reads = dataset, threading.Lock()

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{_HOST}:{self.server_port}/"

    def sample(self, i: int) -> str:
        """JSON of the frame of sample ``i``.

        Raises
        ------
        IndexError
            When there is no such sample.
        ArtsimError
            When it is damaged.
        """
        with self._one_reads:  # a dataset has one position in each of its files
            sample = self._dataset[i]
        return json.dumps(sample_frame(sample).to_json(), allow_nan=False)


def index_of(samples: Iterable[Sample]) -> dict[str, Any]:
    """What the page filters by.

    Returns
    -------
    dict
        ``categories``, their names; and for each sample ``category``, its number there, ``visible``, the share that is
        seen of the least visible part, and ``open``, how far the most open joint is from rest, both in per cent.
    """
    numbers: dict[str, int] = {}
    rows = [
        (
            numbers.setdefault(one.category, len(numbers)),
            100.0 * float(one.visible_fraction.min()),
            100.0 * openness(one),
        )
        for one in samples
    ]
    columns = zip(*rows, strict=True)
    named = zip(
        ("category", "visible", "open"), ([round(value) for value in column] for column in columns), strict=True
    )
    return {"categories": [printable(name, 60) for name in numbers], **dict(named)}


def openness(sample: Sample) -> float:
    """How far the most open joint is from rest: 1 at its farther limit, or after half a turn where it has none."""
    way = np.abs(sample.joint_state - sample.joint_rest)
    longest = np.abs(sample.joint_limits - sample.joint_rest[:, None]).max(axis=1)
    longest = np.where(np.isfinite(longest) & (longest > 0), longest, np.pi)
    moves = ~np.isin(sample.joint_type, ("free", "fixed"))
    return float(np.clip(way / longest, 0.0, 1.0).max(initial=0.0, where=moves))


class _Answer(BaseHTTPRequestHandler):
    """Answers one request. Whatever else is asked for is not found."""

    server: DatasetServer
    timeout = _PATIENCE

    def do_GET(self) -> None:
        host, port = self.headers.get("Host", ""), self.server.server_port
        asked = re.fullmatch(r"/sample/([0-9]{1,9})", self.path)
        if host not in (f"{_HOST}:{port}", f"localhost:{port}"):  # a site may give its own name to this address
            self._send(403, "this page is for this machine")
        elif self.path == "/":
            self._send(200, self.server.page, "text/html")
        elif asked is None:
            self._send(404, "there is no such page")
        else:
            try:
                self._send(200, self.server.sample(int(asked[1])), "application/json")
            except IndexError:
                self._send(404, "there is no such sample")
            except ArtsimError as error:
                self._send(500, printable(error, 1000))

    def _send(self, status: int, text: str, kind: str = "text/plain") -> None:
        body = text.encode()
        self.send_response(status)
        for name, value in {
            "Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(body)), "Cache-Control": "no-store",
            "Content-Security-Policy": _POLICY, "X-Content-Type-Options": "nosniff",
        }.items():  # fmt: skip
            self.send_header(name, value)
        self.end_headers()
        try:
            self.wfile.write(body)
        except ConnectionError:  # the browser has gone on to another sample
            self.close_connection = True

    def version_string(self) -> str:
        return "artsim"

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: what is asked for is of no interest in a terminal."""
