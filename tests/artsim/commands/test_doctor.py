"""The doctor tells what works, survives what crashes, and names the mend."""

from __future__ import annotations

from pathlib import Path

import pytest

from artsim.commands.doctor import BACKENDS, Finding, examine, finding_table
from artsim.errors import ConfigError
from artsim.renderers import RENDERERS
from tests.conftest import absent
from tests.programs import run_here
from tests.without import environment

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("backend", [*RENDERERS, "maniskill"])
def test_installed_renderers_are_found_to_work(backend: str) -> None:
    finding = examine(backend)
    if not finding.works:
        absent(f"{finding.problem}; {finding.fix}")
    assert finding.device
    assert finding.fps is not None
    assert finding.fps > 1
    assert finding.problem == finding.fix == ""


def test_every_renderer_is_examined() -> None:
    assert set(RENDERERS) <= set(BACKENDS)


def pretend(monkeypatch: pytest.MonkeyPatch, folder: Path, module: str, source: str) -> None:
    """Put a module of ours before an installed one, in child processes."""
    (folder / f"{module}.py").write_text(source)
    monkeypatch.setenv("PYTHONPATH", str(folder))


@pytest.mark.parametrize(
    ("module", "backend", "mend"),
    [("torch", "torch", "[train]"), ("pybullet", "pybullet", "[pybullet]"),
     ("mani_skill", "maniskill", "[maniskill]"), ("sapien", "sapien", "[sapien]"),
     ("warp", "warp", "[warp]"), ("ray", "ray", "[ray]")],
)  # fmt: skip
def test_what_is_not_installed_is_named_with_its_mend(
    module: str, backend: str, mend: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", environment(tmp_path, [module])["PYTHONPATH"])
    finding = examine(backend)
    assert not finding.works
    assert finding.problem.endswith("is not installed")
    assert mend in finding.fix


def test_a_backend_that_crashes_its_process_is_survived(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pretend(monkeypatch, tmp_path, "torch", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    finding = examine("torch")
    assert not finding.works
    assert "SIGSEGV" in finding.problem


def test_a_process_that_crashes_after_its_answer_has_answered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = (
        "import atexit, os, signal\n"
        "atexit.register(lambda: os.kill(os.getpid(), signal.SIGSEGV))\n"
        "class cuda: is_available = staticmethod(lambda: False)\n"
        "class ones:\n"
        "    def __init__(self, *_, device): pass\n"
        "    sum = lambda self: self\n"
        "    item = lambda self: 2.0\n"
    )
    pretend(monkeypatch, tmp_path, "torch", source)
    assert examine("torch").works


def test_without_a_vulkan_driver_sapien_names_the_script(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "/nonexistent")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nonexistent")
    finding = examine("sapien")
    assert not finding.works
    assert "install" in finding.fix


def test_the_table_has_a_mend_below_each_backend_that_does_not_work() -> None:
    text = finding_table(
        [Finding("raycast", True, "CPU", 1234.5), Finding("sapien", False, problem="no driver", fix="do it")]
    )
    lines = text.splitlines()
    assert lines[1].split() == ["raycast", "yes", "CPU", "1234"]
    assert lines[2].split() == ["sapien", "no"]
    assert [line.strip() for line in lines[3:]] == ["no driver", "fix: do it"]


def test_the_program_prints_the_table() -> None:
    done = run_here("artsim", "doctor", "raycast")
    assert done.returncode == 0, done.stderr
    assert "raycast       yes" in done.stdout


def test_an_unknown_backend_is_refused() -> None:
    with pytest.raises(ConfigError, match="raycast"):
        examine("abacus")
