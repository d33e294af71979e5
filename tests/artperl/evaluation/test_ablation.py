"""Stages are taken away one at a time, on the same views."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from artperl.evaluation.ablation import (
    MARGINS,
    STAGES,
    WHOLE,
    losses,
    permute_references,
    run_ablation,
    verdict,
    verdict_lines,
)
from artperl.evaluation.samples import frozen_samples
from artperl.methods.estimator_writing import save_estimator
from artperl.methods.full import Estimator
from artperl.perception.network import Perception
from artsim.errors import ConfigError
from tests.artperl.worlds import Oracle, small_base


def test_a_shuffled_base_finds_other_objects_of_the_same_tree() -> None:
    base = small_base("laptop", "eyeglasses")
    other = permute_references(base)
    assert base.embeddings is not None
    found = other.nearest_objects(base.embeddings)[0][:, 0].tolist()
    assert sorted(found) == list(range(len(base)))
    assert found != list(range(len(base)))
    assert all(base.categories[a] == base.categories[b] for a, b in enumerate(found))


@pytest.mark.slow
def test_every_stage_can_be_taken_away() -> None:
    (sample,) = frozen_samples(["laptop"], 1, 1)
    torch.manual_seed(0)
    whole = Estimator(Oracle(sample, 2), small_base("laptop"))
    for stage, change in STAGES.items():
        without = change(whole)
        assert without.perception is whole.perception, stage
        assert len(without(sample.points).size) == 2, stage


@pytest.mark.slow
def test_an_ablation_goes_on_from_its_file(tmp_path: Path) -> None:
    torch.manual_seed(0)
    save_estimator(Estimator(Perception(2, 16), small_base("laptop")), tmp_path / "laptop", {})
    out, lines = tmp_path / "record.json", list[str]()
    stages = {name: STAGES[name] for name in ("beam search", "normal alignment")}
    one = {"beam search": STAGES["beam search"]}
    first = run_ablation(["laptop"], tmp_path, None, 2, out, say=lines.append, stages=one)
    assert list(first) == [f"laptop procedural {view} {noise}" for view in ("artimage", "sphere") for noise in
                           ("none", "d435")]  # fmt: skip
    done = out.read_text()
    again = run_ablation(["laptop"], tmp_path, None, 2, out, say=lines.append, stages=one)
    assert (again, out.read_text()) == (first, done)
    more = run_ablation(["laptop"], tmp_path, None, 2, out, say=lines.append, stages=stages)
    assert json.loads(out.read_text()) == more
    for row, variants in more.items():
        assert variants.keys() == {WHOLE, *stages}
        assert variants[WHOLE] == first[row][WHOLE]
        assert {len(figures) for figures in variants.values()} == {2}
    assert len(verdict_lines(more)) == 2
    with pytest.raises(ConfigError, match="other views"):
        run_ablation(["laptop"], tmp_path, None, 3, out, stages=stages)


def test_losses_pair_the_views_of_each_row_where_a_stopped_run_lacks_rows() -> None:
    whole, off = [1.0, 0.5, 1.0], [1.5, 0.5, 1.0]
    record = {
        "laptop procedural artimage none": {WHOLE: [whole] * 2, "one": [off] * 2, "other": [off] * 2},
        "laptop procedural artimage d435": {WHOLE: [whole] * 4, "one": [whole] * 4},
    }
    groups = losses(record)
    assert groups["one"]["laptop procedural"].mean["rotation_deg"] == pytest.approx(0.5 * 2 / 6)
    assert groups["other"]["laptop procedural"].mean["rotation_deg"] == pytest.approx(0.5)


def test_a_stage_stays_where_its_loss_is_large_and_certain() -> None:
    rng = np.random.default_rng(0)
    whole = np.column_stack([rng.uniform(0, 1, 400), rng.uniform(0.5, 0.9, 400), np.ones(400)])
    columns = list(MARGINS)

    def judged(figure: str, loss: np.ndarray) -> str:
        without = whole.copy()
        without[:, columns.index(figure)] += loss
        record = {"laptop procedural artimage none": {WHOLE: whole.tolist(), "a stage": without.tolist()}}
        return verdict(losses(record)["a stage"])

    assert judged("rotation_deg", np.full(400, 0.2)) == "stays"
    assert judged("rotation_deg", np.full(400, 0.05)) == "goes"
    assert judged("rotation_deg", np.full(400, -3.0)) == "goes"
    assert judged("iou_exact", np.full(400, -0.02)) == "stays"
    assert judged("iou_exact", np.full(400, 0.02)) == "goes"
    assert judged("rotation_deg", np.where(np.arange(400) == 0, 80.0, 0.0)) == "unclear"  # one failure of 400
