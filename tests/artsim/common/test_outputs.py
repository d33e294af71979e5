"""Nothing that a user has is lost to a result: inputs, files of datasets, pipes, devices, folders of others."""

from __future__ import annotations

import os
import shutil
import stat
from pathlib import Path

import pytest

from artsim.commands.view import Gallery, View
from artsim.common.files import read_bounded, write_atomic
from artsim.common.outputs import check_output, write_output
from artsim.datasets.generate import generate
from artsim.errors import ConfigError
from artsim.export.batch import generate_objects
from artsim.families import make
from artsim.loading.sources import family_sources
from artsim.variation.folder import write_variations
from tests.conftest import ASSETS


@pytest.fixture
def laptop(tmp_path: Path) -> Path:
    """The folder of an object."""
    return Path(shutil.copytree(ASSETS / "laptop", tmp_path / "laptop"))


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data") / "laptops"
    generate(family_sources("laptop", 2), folder, 4, workers=1, progress=False)
    return folder


def _bytes(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_an_input_is_not_overwritten_by_its_page(laptop: Path, tmp_path: Path) -> None:
    before = _bytes(laptop)
    link = tmp_path / "link.html"
    link.symlink_to(laptop / "mobility.urdf")
    for path in (laptop, laptop / "mobility.urdf"):
        for out in (laptop / "mobility.urdf", laptop / ".." / "laptop" / "mobility.urdf", link):
            with pytest.raises(ConfigError, match=r"it is an input|it is no .* file"):
                View(path, html=out).run()
            with pytest.raises(ConfigError, match=r"it is an input|it is no .* file"):
                View(path, out=out).run()
    assert _bytes(laptop) == before
    View(laptop, html=laptop / "page.html").run()
    View(laptop, html=laptop / "page.html").run()  # a result may be written again


@pytest.mark.slow
def test_files_of_a_dataset_are_not_overwritten(dataset: Path) -> None:
    before = _bytes(dataset)
    own = [
        "dataset.json",
        "plan.json",
        next(dataset.glob("*.tar")).name,
        f"objects/{next((dataset / 'objects').iterdir()).name}",
    ]
    for name in own:
        with pytest.raises(ConfigError, match=r"it is an input|it belongs to|it is no .* file"):
            View(dataset, html=dataset / name).run()
        with pytest.raises(
            ConfigError, match=r"it is an input|it belongs to|it is no .* file what .*dataset.json describes"
        ):
            Gallery(categories=("laptop",), states=1, out=dataset / name).run()
    assert _bytes(dataset) == before
    View(dataset, html=dataset / "page.html").run()
    check_output(dataset / "page.html")
    (dataset / "page.html").unlink()


def test_what_is_no_regular_file_stays(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.html"
    os.mkfifo(pipe)
    special = {pipe: "no regular file", tmp_path: "a folder", Path(): "a folder", Path("/dev/null"): "no regular file"}
    for out, words in special.items():
        for write in (write_atomic, write_output):
            with pytest.raises(ConfigError, match=words):
                write(out, b"page")
        with pytest.raises(ConfigError, match=words):
            make("laptop", seed=0).show(out)
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_what_was_read_is_an_input_by_any_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a").write_bytes(b"1")
    monkeypatch.chdir(tmp_path)
    check_output(Path("a"))
    read_bounded(tmp_path / "a", 10, "file")
    for path in (Path("a"), tmp_path / "a", Path("./a")):
        with pytest.raises(ConfigError, match=r"it is an input|it is no .* file"):
            write_output(path, b"2")
    with pytest.raises(ConfigError, match=r"it is an input|it is no .* file"):
        check_output(Path("b"), [Path("./b")])
    write_output(Path("b"), b"2")


@pytest.mark.slow
def test_folders_of_others_are_not_replaced(laptop: Path, tmp_path: Path) -> None:
    """A folder goes only where artsim wrote it, and nothing in it is an input."""
    shutil.copytree(laptop, tmp_path / "some" / "0")
    (tmp_path / "more" / "0").mkdir(parents=True)
    (tmp_path / "more" / "0" / "thesis.txt").write_text("years")
    before = _bytes(tmp_path)
    for path, out in ((tmp_path / "some" / "0", tmp_path / "some"), (laptop, tmp_path / "more")):
        with pytest.raises(ConfigError, match="a folder is there"):
            write_variations(path, out, 1, progress=False)
    (tmp_path / "laptop" / "3").mkdir()
    (tmp_path / "laptop" / "3" / "mobility.urdf").write_text("<robot/>")
    before["laptop/3/mobility.urdf"] = b"<robot/>"
    with pytest.raises(ConfigError, match="artsim did not write it"):
        generate_objects(["laptop"], tmp_path, 1, 3, workers=1, progress=False)
    assert {name: data for name, data in _bytes(tmp_path).items() if not name.endswith(".lock")} == before


def test_variations_of_a_variation_do_not_take_its_place(laptop: Path, tmp_path: Path) -> None:
    write_variations(laptop, tmp_path / "out", 1, progress=False)
    before = _bytes(tmp_path / "out" / "0")
    with pytest.raises(ConfigError, match="an input is in it"):
        write_variations(tmp_path / "out" / "0", tmp_path / "out", 1, progress=False)
    assert _bytes(tmp_path / "out" / "0") == before
