"""Conversions as a whole: complete, resumable, the same whoever does them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import get_args

import pytest

import artsim
from artsim import Dataset
from artsim.commands.generate import Generate
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError, DatasetError
from artsim.formats import two_state
from artsim.formats.base import FormatName
from artsim.formats.conversion import DONE, FORMATS, convert
from artsim.loading.sources import family_sources
from artsim.runs.tasks import JOURNAL
from tests.artsim.formats.conftest import contents

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_workers")]


@pytest.mark.parametrize("to", get_args(FormatName))
def test_the_bytes_do_not_depend_on_the_number_of_workers(
    imaged: Dataset, tmp_path: Path, to: FormatName, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(two_state, "VIEWS", {"train": 1, "val": 1, "test": 1})
    one = convert(imaged, to, tmp_path / "one", group=5, workers=1, progress=False)
    three = convert(imaged, to, tmp_path / "three", group=5, workers=3, progress=False)
    total = len(imaged if FORMATS[to].converts_samples else imaged.plan.objects)
    assert one.made == three.made == one.num_samples == total
    assert contents(tmp_path / "one") == contents(tmp_path / "three")
    assert len(contents(tmp_path / "one")) == one.files + 1
    assert set(FORMATS) == set(get_args(FormatName))


def test_a_second_run_finds_nothing_to_do_and_damage_is_mended(imaged: Dataset, tmp_path: Path) -> None:
    out = tmp_path / "out"
    convert(imaged, "bop", out, group=5, progress=False)
    before = contents(out)
    times = {path: path.stat().st_mtime_ns for path in out.rglob("*.png")}
    assert convert(imaged, "bop", out, group=5, progress=False).made == 0
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.png")} == times
    victim = next(path for path in out.rglob("*.png"))
    victim.write_bytes(victim.read_bytes()[:-1] + b"?")
    assert convert(imaged, "bop", out, group=5, progress=False).made == len(imaged)
    assert contents(out) == before


def test_a_conversion_that_was_killed_goes_on(imaged: Dataset, tmp_path: Path) -> None:
    whole, out = tmp_path / "whole", tmp_path / "out"
    convert(imaged, "coco", whole, group=2, progress=False)
    words = ["convert", str(imaged.folder), "--to", "coco", "--out", str(out), "--group", "2", "--workers", "1"]
    script = tmp_path / "script.py"
    script.write_text("import artsim.commands.verbs\nif __name__ == '__main__':\n    artsim.commands.verbs.main()\n")
    with subprocess.Popen(
        [sys.executable, script, *words], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL
    ) as run:
        while run.poll() is None:
            if (out / JOURNAL).exists() and (out / JOURNAL).read_bytes().count(b"\n") > 3:
                os.kill(run.pid, signal.SIGKILL)
                break
            time.sleep(0.001)
    assert (out / JOURNAL).exists(), "it was too fast to be killed"
    deadline = time.monotonic() + 5.0
    while time.monotonic() < deadline:  # its worker notices within half a second
        time.sleep(0.2)
        if not list(out.rglob(".*.part")):
            break
    assert 0 < convert(imaged, "coco", out, group=2, progress=False).made < len(imaged)
    assert contents(out) == contents(whole)


def test_samples_and_a_split_can_be_chosen(imaged: Dataset, tmp_path: Path) -> None:
    result = convert(imaged, "ply", tmp_path / "two", samples=[3, 7], progress=False)
    assert result.num_samples == 2
    assert {Path(name).name for name in contents(tmp_path / "two")} == {"000000003.ply", "000000007.ply", DONE}
    test = artsim.open_dataset(imaged.folder, "test")
    convert(imaged, "ply", tmp_path / "test", split="test", progress=False)
    names = {f"test/{sample.index:09d}.ply" for sample in test}
    assert set(contents(tmp_path / "test")) == {*names, DONE}
    with pytest.raises(ConfigError, match="no sample 99"):
        convert(imaged, "ply", tmp_path / "none", samples=[99])


def test_a_folder_that_holds_something_else_is_left_alone(imaged: Dataset, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(DatasetError, match=r"already holds 'mine\.txt'"):
        convert(imaged, "ply", tmp_path)
    out = tmp_path / "out"
    convert(imaged, "ply", out, samples=[0], progress=False)
    with pytest.raises(DatasetError, match=r"another conversion \(different: format\)"):
        convert(imaged, "webdataset", out, samples=[0])
    with pytest.raises(DatasetError, match=r"different: samples"):
        convert(imaged, "ply", out, samples=[1])
    with pytest.raises(ConfigError, match="within the dataset"):
        convert(imaged, "ply", imaged.folder / "ply")


@pytest.mark.parametrize("to", ["bop", "coco", "hdf5"])
def test_formats_of_images_say_how_to_generate_with_images(tmp_path: Path, to: FormatName) -> None:
    options = SampleOptions(num_points=16)
    artsim.generate(family_sources(("globe",), 1), tmp_path / "data", 1, sample=options, workers=1, progress=False)
    with pytest.raises(ConfigError, match=r"no depth and no part_mask. Fix: generate .*--images depth part_mask"):
        convert(tmp_path / "data", to, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_bop_refuses_objects_that_change_their_size(tmp_path: Path) -> None:
    options = SampleOptions(num_points=16, scale=(0.5, 1.0), images=("depth", "part_mask"))
    artsim.generate(family_sources(("globe",), 1), tmp_path / "data", 1, sample=options, workers=1, progress=False)
    with pytest.raises(ConfigError, match=r"one size.*--scale native"):
        convert(tmp_path / "data", "bop", tmp_path / "out")


def test_generate_converts_what_it_made_or_refuses_before_it_makes_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "artsim")
    out = tmp_path / "data"
    words = {"categories": ("globe",), "objects_per_category": 1, "num_samples": 3, "workers": 1}
    with pytest.raises(ConfigError, match=r"bop needs images.*--images depth part_mask"):
        Generate(out, **words, format="bop").run()
    assert not out.exists()
    Generate(out, **words, format="ply").run()
    assert len(list((tmp_path / "data_ply").rglob("*.ply"))) == 3
    Generate(out, **words, format="ply").run()
    assert "data_ply: already complete, 3 samples in 3 files" in caplog.text
