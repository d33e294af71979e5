"""A category of files: some are held out, always the same ones, and what is wrong with files is said before a run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from artperl.commands import verbs
from artperl.commands.train import Train
from artperl.methods.estimator_files import load_estimator
from artperl.methods.estimator_folders import folder_of
from artperl.training.options import TrainOptions
from artperl.training.run import Training
from artperl.training.split import Split
from artsim.errors import AssetError, ConfigError, DatasetError
from artsim.loading.sources import find_sources
from tests.conftest import BOX_LAPTOP

TINY = TrainOptions(
    categories=(), objects=("files",), name="mydoor", parts="any", max_parts=10, reference_points=48, width=40,
    start_from="generic", perception_steps=2, dense_steps=0, batch_size=4, num_points=96, box_views=0,
    validate_every=2, test_objects=2, foreign_categories=1, validation_views=1, test_views=1,
)  # fmt: skip


def laptops(folder: Path, count: int, name: str = "laptop_{}") -> Path:
    """URDF files of laptops of different widths."""
    for n in range(count):
        place = folder / name.format(n)
        place.mkdir(parents=True)
        (place / "mobility.urdf").write_text(BOX_LAPTOP.replace('"0.3 0.4', f'"0.3 0.{40 + n}'))
    return folder


def split_of(folder: Path) -> Split:
    return Split.of(find_sources(folder), "any", "mydoor")


def digests(split: Split) -> dict[str, set[str]]:
    return {name: {obj.sha256 for obj in getattr(split, name)} for name in ("train", "val", "test")}


def test_three_fifths_are_learnt_from_whatever_files_are_called_and_copies_stay_together(tmp_path: Path) -> None:
    own = digests(split_of(laptops(tmp_path / "a", 20)))
    assert {name: len(those) for name, those in own.items()} == {"train": 12, "val": 4, "test": 4}
    assert len(set.union(*own.values())) == 20
    laptops(tmp_path / "b", 20, "z_{}_renamed")
    laptops(tmp_path / "b", 3, "copy_{}")
    assert digests(split_of(tmp_path / "b")) == own
    assert all(obj.category == "mydoor" for obj in split_of(tmp_path / "b").test)


def test_too_few_files_get_a_command_that_makes_more(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"2 different objects are too few.*artsim vary .*/mobility.urdf --count 20"):
        split_of(laptops(tmp_path / "few", 2))
    least = split_of(laptops(tmp_path / "enough", 5))
    assert (len(least.train), len(least.val), len(least.test)) == (3, 1, 1)
    these = Split.of(find_sources(tmp_path / "few"), "any", None)
    assert these.train == these.test
    assert len(these.train) == 2


def test_every_file_that_does_not_load_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    laptops(tmp_path, 6)
    (tmp_path / "laptop_3" / "mobility.urdf").write_text(BOX_LAPTOP.replace('child link="lid"', 'child link="cover"'))
    with pytest.raises(AssetError, match=r"laptop_3.*'cover' does not exist"):
        split_of(tmp_path)
    (tmp_path / "laptop_5" / "mobility.urdf").write_text(BOX_LAPTOP[:99])
    with pytest.raises(AssetError, match="2 of 6"):
        split_of(tmp_path)
    said = caplog.text
    assert "laptop_3" in said
    assert "laptop_5" in said


@pytest.mark.slow
def test_a_named_run_leaves_its_split_and_an_estimator_of_that_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    files = laptops(tmp_path / "files", 6)
    out = Path("out/train/mydoor")
    Training(TINY, out, workers=0, progress=False).run()
    frozen = json.loads((out / "split.json").read_text())
    named = {name: {each["file"] for each in those} for name, those in frozen.items()}
    assert set.union(*named.values()) == {f"files/laptop_{n}/mobility.urdf" for n in range(6)}
    assert sum(map(len, named.values())) == 6
    best = load_estimator("mydoor")
    assert folder_of("mydoor") == out / "best"
    assert best.perception.votes  # another object of the category may have other parts
    assert set(best.base.object_ids) == {Path(file).parent.name for file in named["train"]}
    table = (out / "table.txt").read_text()
    assert "mydoor lid" in table
    assert "mydoor by generic lid" in table
    capsys.readouterr()
    verbs.Evaluate(Path("mydoor"), files=tuple(Path(file) for file in named["test"]), views=1).run()
    assert "mydoor lid" in capsys.readouterr().out
    Training(TINY, out, workers=0, progress=False).run()  # begun with the same objects: nothing is left to do
    laptops(files, 1, "another_{}")
    (files / "another_0" / "mobility.urdf").write_text(BOX_LAPTOP.replace('"0.3 0.4', '"0.3 0.9'))
    with pytest.raises(DatasetError, match="not those that this run was begun with"):
        Training(TINY, out, workers=0, progress=False).run()


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"name": "mydoor"}, "no objects to name"),
        ({"name": "laptop", "objects": (Path("a"),)}, "comes with the package"),
        ({"name": "../door", "objects": (Path("a"),)}, "is no name"),
        ({"objects": (Path("a"),), "categories": ("laptop",)}, "learnt from alone"),
    ],
)
def test_a_name_that_cannot_be_one_is_refused(options: dict[str, object], what: str) -> None:
    with pytest.raises(ConfigError, match=what):
        Train(**options).run()  # type: ignore[arg-type]
