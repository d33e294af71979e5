"""Several processes learn what one does, and one that dies costs the steps since the last checkpoint."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from artperl.core.distributed import Ranks
from artperl.training.options import ANCSH_PRESETS, changed, preset_of
from artperl.training.run import Training
from artsim.errors import ConfigError
from tests.conftest import ROOT

pytestmark = pytest.mark.slow

TINY = {
    "base_objects": 3, "reference_points": 48, "width": 16, "perception_steps": 4, "dense_steps": 2, "batch_size": 6,
    "num_points": 96, "box_views": 3, "box_steps": 2, "validate_every": 2, "test_objects": 2, "foreign_categories": 1,
    "validation_views": 1, "test_views": 1, "stretched": 0.5, "mixed_precision": False,
}  # fmt: skip
"""Six clouds of unequal parts, so that halves of a batch weigh differently."""


def learn(out: Path, processes: int, *more: str, **changes: object) -> subprocess.CompletedProcess[str]:
    torchrun = ["-m", "torch.distributed.run", "--standalone", f"--nproc-per-node={processes}", "--max-restarts=1"]
    script = [str(ROOT / "tests/artperl/training/one_of_several.py"), str(out), json.dumps({**TINY, **changes}), *more]
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": paths, "OMP_NUM_THREADS": "1"}
    command = [sys.executable, *(torchrun if processes > 1 else []), *script]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)


def learn_here(out: Path, **changes: object) -> Path:
    """As :func:`learn` in one process, which is this one."""
    options = {**TINY, **changes}
    preset = preset_of(options.get("method", "full"), "quick")  # type: ignore[arg-type]
    Training(changed(preset, options), out, 1, progress=False).run()
    return out


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What one process learns."""
    return learn_here(tmp_path_factory.mktemp("alone") / "run")


def same_run(one: Path, other: Path) -> None:
    """The same weights and the same curve, but for the order of sums."""
    weights, others = load_file(one / "state.safetensors"), load_file(other / "state.safetensors")
    assert weights.keys() == others.keys()
    for name, tensor in weights.items():
        torch.testing.assert_close(tensor, others[name], rtol=1e-3, atol=2e-5, msg=lambda text, n=name: f"{n}: {text}")
    states = [json.loads((folder / "state.json").read_text()) for folder in (one, other)]
    assert states[0]["done"] == states[1]["done"]
    scores = [[entry["score"] for entry in state["history"]] for state in states]
    np.testing.assert_allclose(scores[0], scores[1], rtol=0.05)


def test_two_processes_end_what_one_has_begun_though_one_of_them_dies(alone: Path, tmp_path: Path) -> None:
    """What is learnt follows from the number of a step, not from who takes it; a checkpoint is all that is needed."""
    assert learn(tmp_path / "run", 1, "die").returncode == -9
    assert json.loads((tmp_path / "run" / "state.json").read_text())["done"] == {"perception": 2}
    done = learn(tmp_path / "run", 2, "die")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "died_of_2").exists()
    same_run(alone, tmp_path / "run")
    assert json.loads((tmp_path / "1.json").read_text()) == json.loads((tmp_path / "0.json").read_text())
    assert "laptop" in json.loads((tmp_path / "1.json").read_text())
    assert not [path for path in (tmp_path / "run").glob(".*") if path.name != ".lock"]


def test_two_processes_make_the_rollouts_of_one(tmp_path: Path) -> None:
    """Segmentation, retrieval and the agent of the paper's method: five episodes, each phase once."""
    changes = {
        "method": "artperl", "perception_steps": 2, "dense_steps": 0, "retrieval_steps": 2, "retrieval_objects": 3,
        "agent_rollouts": 3, "episodes": 5, "cloning_share": 0.7, "box_views": 0,
    }  # fmt: skip
    learn_here(tmp_path / "1" / "run", **changes)
    done = learn(tmp_path / "2" / "run", 2, **changes)
    assert done.returncode == 0, done.stderr
    one, other = (load_file(tmp_path / str(count) / "run" / "state.safetensors") for count in (1, 2))
    for name, tensor in one.items():
        torch.testing.assert_close(tensor, other[name], rtol=1e-3, atol=1e-4, msg=lambda text, n=name: f"{n}: {text}")


def test_a_method_that_learns_in_one_process_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WORLD_SIZE", "2")
    monkeypatch.setenv("RANK", "0")
    with pytest.raises(ConfigError, match="the method ancsh learns in one process"):
        Training(ANCSH_PRESETS["quick"], tmp_path, progress=False)


def test_rows_of_a_batch_are_shared_out_once() -> None:
    rows = [list(range(7))[Ranks(rank, 3).rows(7)] for rank in range(3)]
    assert rows == [[0, 1], [2, 3], [4, 5, 6]]
