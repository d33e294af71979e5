"""A training folder: one trainer at a time; whatever stops it, nothing is lost, and damage is named."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from artperl.commands import verbs
from artperl.core.tensor_files import read_tensors, write_tensors
from artperl.training.box_records import load_records
from artperl.training.run import Training
from artperl.training.run_folder import RunFolder, differences
from artsim.errors import ArtsimError, ConfigError, DatasetError
from tests.artperl.training.test_run import TINY, ends_alike
from tests.conftest import ASSETS

ROOT = ASSETS.parent
OPTIONS = replace(TINY, perception_steps=2, dense_steps=0, validate_every=1)
CHILD = """
import os, signal, sys
from pathlib import Path
from artperl.training.run import Training
from tests.artperl.training.test_run_folder import OPTIONS

place = Path.replace
def stop_at_the_second(self, target):
    if Path(target).name == "state.json" and Path(target).exists():
        print("about to write", flush=True)
        sys.stdin.read()
    return place(self, target)
Path.replace = stop_at_the_second
Training(OPTIONS, Path(sys.argv[1]), workers=0, progress=False).run()
"""
"""Trains, and waits for ever while it holds the folder: tensors of its second step are written, but not named yet."""


class Killed(BaseException):
    """Stands for the end of the process."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run from beginning to end."""
    out = tmp_path_factory.mktemp("whole")
    Training(OPTIONS, out, workers=0, progress=False).run()
    return out


@pytest.fixture
def trained(whole: Path, tmp_path: Path) -> Path:
    """A copy of it that a test may spoil."""
    return Path(shutil.copytree(whole, tmp_path / "trained"))


@pytest.mark.slow
def test_two_processes_never_train_in_one_folder_and_a_killed_one_is_gone_on_with(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "run"
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, str(out)], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    try:
        assert child.stdout is not None
        while (line := child.stdout.readline()) != "about to write\n":
            assert line, child.wait()
        with pytest.raises(DatasetError, match=r"another run is writing here\. Fix: wait for it or stop it"):
            Training(OPTIONS, out, workers=0, progress=False)
        monkeypatch.setattr("sys.argv", ["train.py", "--category", "globe", "--parts", "any", "--out", str(out)])
        with pytest.raises(SystemExit) as stopped:
            verbs.train_main()
        assert stopped.value.code == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line == f"error: {out}: another run is writing here. Fix: wait for it or stop it"
    finally:
        child.send_signal(signal.SIGKILL)
        child.communicate()
    assert (out / ".state.safetensors.next").exists()
    assert list(out.glob(".*.part"))
    Training(OPTIONS, out, workers=0, progress=False).run()
    ends_alike(whole, out)
    assert [path.name for path in out.glob(".*")] == [".lock"]


def test_a_second_trainer_is_refused_even_before_anything_is_written_down(tmp_path: Path) -> None:
    training = Training(OPTIONS, tmp_path, workers=0, progress=False)
    with RunFolder(tmp_path).held(), pytest.raises(DatasetError, match="another run"):
        training.run()


@pytest.mark.slow
def test_what_another_process_has_trained_meanwhile_is_taken_up(whole: Path, tmp_path: Path) -> None:
    late = Training(OPTIONS, tmp_path / "run", workers=0, progress=False)
    shutil.copytree(whole, tmp_path / "run")
    late.run()
    assert late.context.state.done["perception"] == 2
    for name in ("state.json", "state.safetensors"):
        assert (tmp_path / "run" / name).read_bytes() == (whole / name).read_bytes()


TENSORS = {"done": torch.tensor([1, 0]), "weights": torch.arange(6.0).reshape(2, 3), "half": torch.ones(2).bfloat16()}
STATE = {"options": {"seed": 0, "rates": (1.0, float("inf"))}, "best": float("inf"), "history": [{"score": 2.5}]}


@pytest.mark.parametrize("step", range(4))
def test_a_kill_between_any_two_files_leaves_the_state_before_or_after(
    step: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tensors and JSON always belong together, and no file is left over."""
    folder = RunFolder(tmp_path)
    folder.write({**STATE, "best": 1.0}, TENSORS)
    later = {**TENSORS, "done": torch.tensor([2, 0])}
    calls = 0
    place = Path.replace

    def replace_until(self: Path, target: Path) -> Path:
        nonlocal calls
        calls += 1
        if calls > step:
            raise Killed
        return place(self, target)

    monkeypatch.setattr(Path, "replace", replace_until)
    monkeypatch.setattr(Path, "unlink", lambda *_, **__: None)  # who is killed tidies nothing up
    if step < 3:
        with pytest.raises(Killed):
            folder.write({**STATE, "best": 2.0}, later)
    else:
        folder.write({**STATE, "best": 2.0}, later)
    monkeypatch.undo()
    with folder.held():
        state, tensors, _ = folder.read()
    assert (state["best"], tensors["done"].tolist()) == ((2.0, [2, 0]) if step >= 2 else (1.0, [1, 0]))
    assert torch.equal(tensors["weights"], TENSORS["weights"])
    assert sorted(path.name for path in tmp_path.iterdir()) == [".lock", "state.json", "state.safetensors"]


def _truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-7])


def _flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-20 if path.suffix == ".safetensors" else data.index(b"2.5")] ^= 1
    path.write_bytes(data)


def _nest(path: Path) -> None:
    path.write_text("[" * 100_000)


def _resave(path: Path) -> None:
    write_tensors({"views": torch.tensor(1)}, path)


DAMAGES: list[tuple[str, Callable[[Path], object]]] = [
    *((name, damage) for name in ("state.json", "state.safetensors") for damage in (
        Path.unlink, _truncate, _flip, lambda path: path.write_bytes(b""), lambda path: path.write_bytes(b"\xff" * 99),
        lambda path: path.write_bytes(bytes(1000)),
    )),
    ("state.json", _nest),
    ("state.json", lambda path: path.write_text("{}")),
    ("state.json", lambda path: path.write_text("[1]")),
    ("state.safetensors", _resave),
    ("state.safetensors", lambda path: (path.unlink(), path.mkdir())),
]  # fmt: skip


@pytest.mark.parametrize(("name", "damage"), DAMAGES)
def test_damage_is_named_with_what_to_do(name: str, damage: Callable[[Path], object], tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    folder.write(STATE, TENSORS)
    damage(tmp_path / name)
    assert folder.begun
    with pytest.raises(DatasetError) as caught:
        folder.read()
    text = str(caught.value)
    assert text.startswith(f"{tmp_path / name}: ")
    assert "\n" not in text
    assert text.endswith(f"rm {tmp_path / 'state.json'} {tmp_path / 'state.safetensors'}")


@pytest.mark.slow
def test_the_command_that_a_damaged_run_names_begins_it_anew(
    whole: Path, trained: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _truncate(trained / "state.safetensors")
    with pytest.raises(DatasetError) as caught:
        Training(OPTIONS, trained, workers=0, progress=False)
    subprocess.run(str(caught.value).partition("beginning: ")[2], shell=True, check=True)
    Training(OPTIONS, trained, workers=0, progress=False).run()
    ends_alike(whole, trained)


@pytest.mark.slow
def test_a_lost_best_estimator_is_told(trained: Path) -> None:
    shutil.rmtree(trained / "best")
    with pytest.raises(DatasetError, match="the best estimator is lost"):
        Training(OPTIONS, trained, workers=0, progress=False).run()


@pytest.mark.parametrize("damage", [_truncate, _flip, lambda path: path.write_bytes(b"x" * 50), _resave])
def test_damaged_records_of_boxes_are_told(damage: Callable[[Path], object], tmp_path: Path) -> None:
    file = tmp_path / "boxes.safetensors"
    write_tensors({"views": torch.tensor(3), "center": torch.ones(2, 3)}, file)
    damage(file)
    if damage is _resave:
        assert load_records(file) == (1, [])
        write_tensors({"views": torch.tensor(1), "unknown": torch.ones(2, 3)}, file)
    with pytest.raises(DatasetError, match=r"boxes\.safetensors: .* damaged.*Fix: .*rm .*boxes\.safetensors"):
        load_records(file)


def test_other_options_are_named(whole: Path) -> None:
    sample = replace(OPTIONS.sample, states=replace(OPTIONS.sample.states, mode="rest"))
    with pytest.raises(
        DatasetError, match=r"other options is here: seed \(0 there, 3 asked for\), sample\.states\.mode"
    ):
        Training(replace(OPTIONS, seed=3, sample=sample), whole, workers=0, progress=False)
    many = differences({str(i): 0 for i in range(10)}, {str(i): 1 for i in range(10)})
    assert many.endswith("and 4 more")
    assert len(differences({"files": ["x" * 1000]}, {"files": []})) < 120


@contextmanager
def full_disk(monkeypatch: pytest.MonkeyPatch, after: int) -> Iterator[None]:
    """From the so-manieth file on, nothing more fits."""
    calls = 0

    def fsync(_: int) -> None:
        nonlocal calls
        calls += 1
        if calls > after:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", fsync)
        yield


@pytest.mark.slow
def test_a_full_disk_loses_nothing(whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "run"
    with (
        full_disk(monkeypatch, 5),
        pytest.raises(ConfigError, match=r"the disk is full\. Fix: free some space and run"),
    ):
        Training(OPTIONS, out, workers=0, progress=False).run()
    assert not list(out.rglob(".*.part"))
    assert json.loads((out / "state.json").read_text())["history"]
    Training(OPTIONS, out, workers=0, progress=False).run()
    ends_alike(whole, out)


def test_curves_that_cannot_be_written_are_told(tmp_path: Path) -> None:
    (tmp_path / "events").write_text("not a folder")
    with pytest.raises(ArtsimError, match=r"events: it is a file, where a folder"):
        Training(OPTIONS, tmp_path, workers=0, progress=False).run()


def test_tensors_come_back_as_they_were(tmp_path: Path) -> None:
    path = tmp_path / "t.safetensors"
    digest = write_tensors(TENSORS, path)
    tensors, found = read_tensors(path, "it", "fix")
    assert digest == found
    assert {name: tensor.dtype for name, tensor in tensors.items()} == {n: t.dtype for n, t in TENSORS.items()}
    assert all(torch.equal(tensors[name], TENSORS[name]) for name in TENSORS)
    assert write_tensors({**TENSORS, "done": torch.tensor([1, 1])}, path) != digest
