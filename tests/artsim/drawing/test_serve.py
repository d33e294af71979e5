"""``artsim view DIR --serve``: samples on demand, filters, this machine alone, no file, and an end at Ctrl-C."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artsim
from artsim.drawing.serve import DatasetServer, openness
from artsim.errors import ConfigError
from artsim.loading.sources import family_sources
from tests.conftest import ROOT

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> artsim.Dataset:
    folder = tmp_path_factory.mktemp("served") / "set"
    artsim.generate(family_sources(("laptop", "drawer"), 2), folder, 40, splits=(1, 0, 0), progress=False)
    return artsim.open_dataset(folder)


@pytest.fixture(scope="module")
def server(dataset: artsim.Dataset) -> Iterator[DatasetServer]:
    with DatasetServer(dataset, "set") as made:
        thread = threading.Thread(target=made.serve_forever)
        thread.start()
        yield made
        made.shutdown()
        thread.join()


def ask(server: DatasetServer, path: str, host: str | None = None, method: str = "GET") -> tuple[int, bytes]:
    connection = HTTPConnection("127.0.0.1", server.server_port, timeout=30)
    connection.putrequest(method, path, skip_host=True)
    connection.putheader("Host", host or f"127.0.0.1:{server.server_port}")
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, body


def test_each_sample_comes_on_demand_as_it_is_in_the_dataset(server: DatasetServer, dataset: artsim.Dataset) -> None:
    status, page = ask(server, "/")
    assert status == 200
    assert b'"frames": [],' in page  # none of them comes with it
    for i in (0, 17, len(dataset) - 1):
        status, body = ask(server, f"/sample/{i}")
        frame, sample = json.loads(body), dataset[i]
        assert status == 200
        assert frame["parts"][0]["name"] == sample.part_names[0]
        for box, T, size in zip(frame["shown"]["boxes"], sample.T_camera_part, sample.box_size, strict=True):
            np.testing.assert_allclose(box["T"], T, atol=1e-5)
            np.testing.assert_allclose(box["size"], size, atol=1e-5)


@pytest.mark.parametrize(
    "path",
    ["/dataset.json", "/../dataset.json", "/sample/../../etc/passwd", "/sample/%2e%2e/plan.json", "//etc/passwd",
     "/sample/40", "/sample/-1", "/sample/1e3", "/sample/99999999999999", "/sample/", "/sample/0?x"],
)  # fmt: skip
def test_nothing_else_is_served(server: DatasetServer, path: str) -> None:
    status, body = ask(server, path)
    assert status == 404
    assert body in (b"there is no such page", b"there is no such sample")


def test_only_this_machine_is_served(server: DatasetServer) -> None:
    assert server.socket.getsockname()[0] == "127.0.0.1"
    assert ask(server, "/", f"localhost:{server.server_port}")[0] == 200
    for host in ("evil.example", f"evil.example:{server.server_port}", "127.0.0.1", ""):  # a site's name for 127.0.0.1
        assert ask(server, "/sample/0", host or " ")[0] == 403
    assert ask(server, "/", method="POST")[0] == 501


def test_a_damaged_sample_is_an_answer_not_an_end(tmp_path: Path) -> None:
    artsim.generate(family_sources(("laptop",), 1), tmp_path / "set", 4, splits=(1, 0, 0), progress=False)
    dataset = artsim.open_dataset(tmp_path / "set")
    with DatasetServer(dataset, "set") as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        shard = next((tmp_path / "set").glob("**/*.tar"))
        data = shard.read_bytes()
        with shard.open("r+b") as file:  # the same file, which is open
            file.write(data.replace(b'"points"', b'"spoilt"').replace(b'"joint_limits"', b'"joint_spoilt"'))
        assert ask(server, "/sample/0")[0] == 500
        assert b"damaged sample" in ask(server, "/sample/1")[1]
        assert ask(server, "/")[0] == 200
        server.shutdown()
        thread.join()


def test_a_person_finds_samples(server: DatasetServer, dataset: artsim.Dataset, browser: Any) -> None:
    samples = list(dataset)
    context = browser.new_context(viewport={"width": 900, "height": 600})
    page, faults = context.new_page(), []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: request.url.startswith((server.url, "blob:")) or faults.append(request.url))
    page.goto(server.url)
    page.wait_for_selector("body[data-ready=yes]", timeout=60_000)

    def found() -> int:
        return int(page.locator("#found").inner_text().split()[0])

    page.locator("#category").select_option("drawer")
    assert found() == sum(sample.category == "drawer" for sample in samples)
    page.locator("#frame-name", has_text="drawer").wait_for()
    page.locator("#category").select_option(index=0)
    page.locator("#open-from").fill("60")
    page.locator("#open-from").blur()
    assert 0 < found() == sum(round(100 * openness(sample)) >= 60 for sample in samples) < len(samples)
    page.locator("#open-from").fill("0")
    page.locator("#visible-to").fill("50")
    page.locator("#visible-to").blur()
    wanted = [i for i, sample in enumerate(samples) if round(100 * sample.visible_fraction.min()) <= 50]
    assert 0 < found() == len(wanted) < len(samples)
    page.locator("#frame").fill("0")
    for i in wanted[:3]:
        page.locator("#frame-name", has_text=re.compile(f", sample {samples[i].index}$")).wait_for()
        page.keyboard.press(".")
    page.locator("#visible-to").fill("0")
    page.locator("#open-from").fill("100")
    page.locator("#open-from").blur()
    assert "widen" in page.locator("#found").inner_text()
    context.close()
    assert faults == []


def test_openness_is_the_share_of_the_way_of_the_most_open_joint() -> None:
    obj = artsim.load(ROOT / "urdf_assets" / "cabinet")
    camera = artsim.Camera.look_at([-2, 0.5, 1], [0, 0, 0])
    for share in (0.0, 0.25, 1.0):
        q = obj.tree.rest.copy()
        q[2] = share * obj.tree.joints[2].upper
        assert openness(artsim.observe(obj, q, camera, num_points=64)) == pytest.approx(share)


def test_the_program_says_where_and_ends_at_ctrl_c(dataset: artsim.Dataset) -> None:
    command = [sys.executable, "-m", "artsim", "view", str(dataset.folder), "--serve"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    run = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a job in the background ignores Ctrl-C
    )
    assert run.stdout is not None
    told = re.search(r"http://127\.0\.0\.1:(\d+)/", run.stdout.readline())
    assert told is not None
    port = int(told[1])
    idle = socket.create_connection(("127.0.0.1", port))  # a browser that keeps a connection open
    run.send_signal(signal.SIGINT)
    out, err = run.communicate(timeout=60)
    idle.close()
    assert (run.returncode, out.strip(), err) == (0, "stopped", "")
    with socket.socket() as again:
        again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        again.bind(("127.0.0.1", port))  # the port is free


def test_a_port_in_use_and_an_empty_split_are_told(server: DatasetServer, dataset: artsim.Dataset) -> None:
    with pytest.raises(ConfigError, match=r"port: port \d+ cannot be used"):
        DatasetServer(dataset, "set", server.server_port)
    with pytest.raises(ConfigError, match="cannot be used"):
        DatasetServer(dataset, "set", 70_000)
    with pytest.raises(ConfigError, match="no sample"):
        DatasetServer(artsim.open_dataset(dataset.folder, "test"), "set")
