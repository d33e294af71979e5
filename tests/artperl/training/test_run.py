"""Training goes on exactly where it stopped, and its commands do what they say."""

from __future__ import annotations

import json
import os
import signal
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from artperl.boxes.network import Boxes
from artperl.commands import verbs
from artperl.data.sources import Given
from artperl.evaluation.samples import TEST_SEEDS, VALIDATION_SEEDS
from artperl.methods.estimator_files import load_estimator
from artperl.methods.estimator_folders import read_settings
from artperl.methods.estimator_writing import save_estimator
from artperl.training.context import Report
from artperl.training.objects import BASE_SEEDS
from artperl.training.options import PRESETS, TrainOptions
from artperl.training.run import Training
from artperl.training.steps import one_cycle
from artsim import generate
from artsim.datasets.family_stream import STREAM_SEEDS
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError, DatasetError
from artsim.loading.sources import family_sources
from artsim.loading.urdf import load
from artsim.model.draws import StateOptions

pytestmark = pytest.mark.slow

TINY = TrainOptions(
    base_objects=3, reference_points=48, width=16, perception_steps=3, dense_steps=2, stretched=0.5, batch_size=4,
    num_points=96, box_views=0, validate_every=2, test_objects=2, foreign_categories=1, validation_views=1,
    test_views=1,
)  # fmt: skip

PAPER = replace(
    TINY, method="artperl", perception_steps=2, dense_steps=0, stretched=0.0, retrieval_steps=3, retrieval_objects=3,
    retrieval_batch=3, agent_rollouts=4, cloning_share=0.5, episodes=3, test_objects=1,
)  # fmt: skip


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run from beginning to end."""
    out = tmp_path_factory.mktemp("whole")
    Training(TINY, out, workers=0, progress=False).run()
    return out


def test_a_run_leaves_an_estimator_a_table_and_curves(whole: Path) -> None:
    figures = json.loads((whole / "figures.json").read_text())
    assert figures["laptop"]["instances"] == 2
    assert "laptop lid" in (whole / "table.txt").read_text()
    assert list((whole / "events").glob("events.*"))
    estimator = load_estimator(whole / "best")
    points = np.random.default_rng(0).normal(size=(200, 3)) * 0.1 + [0.0, 0.0, 1.0]
    assert np.isfinite(estimator(points).T_camera_part).all()
    history = json.loads((whole / "state.json").read_text())["history"]
    stages = ("perception", "dense")
    assert [tuple(h["done"].get(stage, 0) for stage in stages) for h in history] == [
        (2, 0), (3, 0), (3, 2),
    ]  # fmt: skip
    assert [h["step"] for h in history] == [2, 3, 5]


def test_an_estimator_looks_at_twice_the_points_of_a_learnt_cloud(whole: Path) -> None:
    assert load_estimator(whole / "best").options.num_points == 2 * TINY.num_points


@pytest.mark.parametrize("stop", [("perception", 2), ("dense", 1)], ids=str)
def test_a_stopped_run_ends_as_if_it_had_not_been(whole: Path, tmp_path: Path, stop: tuple[str, int]) -> None:
    stage, after = stop
    with pytest.raises(KeyboardInterrupt):
        Training(TINY, tmp_path, workers=0, progress=False, report=_interrupt(stage, after)).run()
    again = Training(TINY, tmp_path, workers=0, progress=False)
    assert again.context.state.done[stage] == after
    again.run()
    ends_alike(whole, tmp_path)


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the paper's method from beginning to end."""
    out = tmp_path_factory.mktemp("paper")
    Training(PAPER, out, workers=0, progress=False).run()
    return out


@pytest.mark.parametrize("stop", [("segmentation", 1), ("retrieval", 2), ("agent", 1), ("agent", 3)], ids=str)
def test_a_stopped_run_of_the_papers_method_ends_as_if_it_had_not_been(
    paper: Path, tmp_path: Path, stop: tuple[str, int]
) -> None:
    """In every stage, and of the agent while it clones and while it learns from rewards."""
    stage, after = stop
    with pytest.raises(KeyboardInterrupt):
        Training(PAPER, tmp_path, workers=0, progress=False, report=_interrupt(stage, after)).run()
    again = Training(PAPER, tmp_path, workers=0, progress=False)
    assert again.context.state.done[stage] == after
    again.run()
    ends_alike(paper, tmp_path)


def ends_alike(*runs: Path) -> None:
    """Two finished runs have the same weights, history and figures."""
    one, other = (load_file(folder / "state.safetensors") for folder in runs)
    assert one.keys() == other.keys()
    for name, tensor in one.items():
        assert torch.equal(tensor, other[name]), name
    states = [(folder / "state.json").read_text() for folder in runs]
    assert states[0] == states[1]
    timeless = [json.loads((folder / "figures.json").read_text()) for folder in runs]
    for figures in timeless:
        del figures["laptop"]["ms_per_instance"]
    assert timeless[0] == timeless[1]


def _interrupt(stage: str, after: int) -> Report:
    """Ctrl-C in the midst of a step of a stage."""
    steps = 0

    def report(group: str, figures: dict[str, float], step: int) -> None:
        nonlocal steps
        steps += group == stage
        if group == stage and steps == after:
            os.kill(os.getpid(), signal.SIGINT)

    return report


def test_families_with_any_parts_are_learnt_by_votes_and_learnt_on_by_number(tmp_path: Path) -> None:
    """An estimator of any parts begins one for files: what both have is taken over, heads are their own."""
    options = replace(TINY, categories=("drawer",), parts="any", max_parts=5, dense_steps=0)
    Training(options, tmp_path / "any", workers=0, progress=False).run()
    best = load_estimator(tmp_path / "any" / "best")
    learnt = best.perception
    assert learnt.votes
    save_estimator(replace(best, boxes=Boxes(learnt.num_rows, 8)), tmp_path / "any" / "best", {})
    files = replace(
        options, categories=(), objects=("urdf_assets/cabinet/mobility.urdf",), max_parts=learnt.num_rows,
        start_from=str(tmp_path / "any" / "best"),
    )  # fmt: skip
    training = Training(files, tmp_path / "files", workers=0, progress=False)
    begun = training.context.estimator().perception
    assert not begun.votes
    assert training.context.estimator().boxes is None  # they learnt from parts by votes
    same_head = replace(options, start_from=str(tmp_path / "any" / "best"))
    again = Training(same_head, tmp_path / "again", workers=0, progress=False)
    assert again.context.estimator().boxes is not None
    same = {
        name: torch.equal(t, begun.state_dict()[name]) for name, t in learnt.state_dict().items() if "head" not in name
    }
    assert len(same) > 20
    assert all(same.values())
    with pytest.raises(ConfigError, match="another size"):
        Training(replace(files, width=24), tmp_path / "wide", workers=0, progress=False)


def test_a_finished_run_stays_as_it_is(whole: Path) -> None:
    before = (whole / "state.safetensors").read_bytes()
    Training(TINY, whole, workers=0, progress=False).run()
    assert (whole / "state.safetensors").read_bytes() == before


def test_a_folder_with_another_run_is_refused(whole: Path) -> None:
    with pytest.raises(DatasetError, match="other options"):
        Training(replace(TINY, seed=1), whole, workers=0, progress=False)


def test_no_object_is_both_learnt_from_and_tested_on() -> None:
    for options in PRESETS.values():
        test = range(TEST_SEEDS, TEST_SEEDS + options.test_objects)
        validation = range(VALIDATION_SEEDS, VALIDATION_SEEDS + options.test_objects)
        references = range(BASE_SEEDS, BASE_SEEDS + options.base_objects)
        assert not set(test) & set(validation)
        assert not (set(test) | set(validation)) & set(references)
        assert max(references) < STREAM_SEEDS[0]


def test_the_learning_rate_rises_once_and_falls() -> None:
    rates = [one_cycle(step, 100) for step in range(100)]
    assert max(rates) == pytest.approx(1.0)
    assert rates.index(max(rates)) in (9, 10)
    assert rates[0] == pytest.approx(0.1)
    assert rates[-1] < 0.02
    assert all(a >= b for a, b in pairwise(rates[10:]))


def test_the_program_evaluates_and_estimates(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    verbs.Evaluate(whole / "best", objects=1, views=1, json=tmp_path / "figures.json").run()
    assert "laptop base" in capsys.readouterr().out
    assert json.loads((tmp_path / "figures.json").read_text())["laptop"]["instances"] == 1
    cloud = np.random.default_rng(0).normal(size=(200, 3)) * 0.1 + [0.0, 0.0, 1.0]
    np.save(tmp_path / "cloud.npy", cloud)
    np.savez(tmp_path / "cloud.npz", points=cloud)
    (tmp_path / "cloud.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 200\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        + "\n".join(" ".join(map(str, p)) for p in cloud.tolist())
    )
    for name in ("cloud.npy", "cloud.npz", "cloud.ply"):
        monkeypatch.setattr(
            "sys.argv", ["artperl", "estimate", str(tmp_path / name), "--category", str(whole / "best"), "--out", "-"]
        )
        verbs.main()
        record = json.loads(capsys.readouterr().out)
        assert len(record["rotation"]) == 2
    verbs.Estimate((tmp_path / "cloud.npy",), str(whole / "best"), tmp_path / "out.npz").run()
    with np.load(tmp_path / "out.npz") as arrays:
        assert arrays["part"].shape == (200,)
    whole_line, head, *parts = capsys.readouterr().out.splitlines()
    assert record["reference"] in whole_line
    assert head.split()[:3] == ["part", "joint", "state"]
    assert [line.split()[:2] for line in parts] == [["base", "free"], ["lid", "revolute"]]
    assert f"{np.degrees(record['state'][1]):.1f}°" in parts[1]


def test_the_program_says_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cloud.npy").write_bytes(b"nothing")
    for argv in (
        ["estimate", str(tmp_path / "cloud.npy"), "--category", "none"],
        ["estimate", str(tmp_path / "cloud.npy"), "--out", "pose.txt"],
        ["train", "--category", "teapot"],
    ):
        monkeypatch.setattr(
            "sys.argv", ["artperl", *argv, *(["--out", str(tmp_path / "t")] if "train" in argv else [])]
        )
        with pytest.raises(SystemExit) as stopped:
            verbs.main()
        assert stopped.value.code == 2
        assert "Fix:" in capsys.readouterr().err


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset of laptops and eyeglasses."""
    sources = family_sources(["laptop", "eyeglasses"], 3)
    options = SampleOptions(num_points=96)
    return generate(sources, tmp_path_factory.mktemp("recorded"), num_samples=24, sample=options).folder


def test_a_run_on_a_dataset_ends_like_any_other(recorded: Path, tmp_path: Path) -> None:
    options = replace(TINY, dataset=str(recorded))
    with pytest.raises(DatasetError, match="fewer than 192"):
        Training(options, tmp_path, workers=0, progress=False)
    Training(replace(options, dense_steps=0), tmp_path, workers=0, progress=False).run()
    assert "laptop lid" in (tmp_path / "table.txt").read_text()
    assert read_settings(tmp_path / "best")["about"]["options"]["dataset"] == str(recorded)


def test_a_dataset_says_what_is_learnt_from_it_and_how_it_is_tested(tmp_path: Path) -> None:
    sample = SampleOptions(num_points=64, noise="d435", states=StateOptions("rest"), images=("depth",))
    folder = generate(family_sources(["drawer", "laptop"], 1), tmp_path / "of", num_samples=4, sample=sample).folder
    options = verbs.Train(dataset=folder)._options(None)
    assert options.categories == ("drawer", "laptop")
    assert options.sample == replace(sample, images=())
    options = verbs.Train(dataset=folder, categories=("laptop",), noise="azure")._options(None)
    assert options.categories == ("laptop",)
    assert options.sample == replace(sample, images=(), noise="azure")


def test_objects_of_files_are_learnt_from_and_tested_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without categories: one estimator for exactly these objects, with rows for parts to spare for larger ones."""
    urdf = Path("urdf_assets/cabinet/mobility.urdf")
    options = replace(TINY, categories=(), objects=(str(urdf),), parts="any", max_parts=6)
    training = Training(options, tmp_path, workers=0, progress=False)
    objects = training.context.objects
    assert (len(objects.base), training.context.estimator().perception.num_rows) == (1, 6)
    training.run()
    figures = json.loads((tmp_path / "figures.json").read_text())
    ((category, figure),) = figures.items()
    assert category == load(urdf).category
    assert len(figure["parts"]) == len(load(urdf))
    given, seen = objects.given.train, SampleOptions(num_points=64)
    samples = Given(given, seen, 5, 2, 6)
    states = [samples[i].joint_state for i in range(3)]
    assert not np.array_equal(states[0], states[1])
    np.testing.assert_array_equal(states[0], Given(given, seen, 5, 2, 6)[0].joint_state)
    with pytest.raises(ConfigError, match="more than 2"):
        Training(replace(options, max_parts=2), tmp_path / "few", workers=0, progress=False)
    # What it was learnt from is no family, so that a test needs to be told its objects.
    with pytest.raises(ConfigError, match="--files"):
        verbs.Evaluate(tmp_path / "best").run()
    verbs.Evaluate(tmp_path / "best", files=(urdf,), views=2).run()
    assert figure["part_names"][0] in capsys.readouterr().out
    monkeypatch.setattr(
        "sys.argv", ["train.py", "--objects", str(urdf), "--category", "laptop", "--out", str(tmp_path)]
    )
    with pytest.raises(SystemExit):
        verbs.train_main()
    assert "given objects are learnt from alone" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "value"),
    [("--stretched", "2"), ("--noisy", "-1"), ("--perception-rate", "0"), ("--denser", "0"), ("--box-width", "0")],
)
def test_an_impossible_option_is_named(
    option: str, value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["train.py", option, value, "--out", str(tmp_path)])
    with pytest.raises(SystemExit):
        verbs.train_main()
    assert option.removeprefix("--").replace("-", "_") in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
