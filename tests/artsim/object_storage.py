"""A server of object storage on this machine, whose every tenth write fails."""

from __future__ import annotations

import contextlib
import secrets
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import pytest

from tests.conftest import installed

FAILS_EVERY = 10


class Faulty:
    """A web application that answers every tenth PUT as S3 does when it is in trouble."""

    def __init__(self, app: Callable[..., Iterable[bytes]]):
        self.app, self.writes, self.failed = app, 0, 0
        self._lock = threading.Lock()

    def __call__(self, environ: dict[str, Any], start_response: Callable[..., Any]) -> Iterable[bytes]:
        if environ["REQUEST_METHOD"] == "PUT" and environ["PATH_INFO"].count("/") > 1:
            with self._lock:
                self.writes += 1
                fails = self.writes % FAILS_EVERY == 0
                self.failed += fails
            if fails:
                environ["wsgi.input"].read(int(environ.get("CONTENT_LENGTH") or 0))
                start_response("500 Internal Server Error", [("Content-Type", "application/xml")])
                return [b"<Error><Code>InternalError</Code><Message>in trouble</Message></Error>"]
        return self.app(environ, start_response)


@contextlib.contextmanager
def object_storage(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, Faulty]]:
    """URL of a new bucket, which processes that are started find, too; and the server."""
    installed("s3fs")
    installed("moto")
    from moto.moto_server.werkzeug_app import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import make_server

    faulty = Faulty(DomainDispatcherApplication(create_backend_app))
    server = make_server("127.0.0.1", 0, faulty, threaded=True)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{server.server_port}")
    for name, value in (("AWS_ACCESS_KEY_ID", "any"), ("AWS_SECRET_ACCESS_KEY", "any"), ("AWS_REGION", "us-east-1")):
        monkeypatch.setenv(name, value)
    import s3fs

    s3fs.S3FileSystem.clear_instance_cache()
    bucket = f"bucket-{secrets.token_hex(4)}"  # all servers of a process share one memory
    s3fs.S3FileSystem().mkdir(bucket)
    try:
        yield f"s3://{bucket}/first", faulty
    finally:
        server.shutdown()
        thread.join()
        s3fs.S3FileSystem.clear_instance_cache()
