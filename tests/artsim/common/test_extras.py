"""Whoever lacks an optional dependency reads one line, with a command that installs it."""

from __future__ import annotations

import importlib
import json
import os
import re
import shlex
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artperl.commands.verbs
import artsim
import artsim.commands.verbs
from artsim.common.extras import MODULES, import_failure, import_mujoco, install_command, require_extra
from artsim.common.program import verb_name
from artsim.errors import ConfigError, RenderError
from artsim.renderers import RENDERERS
from tests.conftest import BOX_LAPTOP, ROOT, absent
from tests.without import beyond_the_core, distributions_of, environment, normal

pytestmark = pytest.mark.slow

BENCHMARKS = sorted(path.stem for path in ROOT.glob("benchmarks/*.py") if "__main__" in path.read_text())

VERBS: dict[str, dict[str, list[tuple[str, str]]]] = {
    "artsim": {
        "generate": [
            ("--objects box.urdf --out made --num-samples 4 --workers 1", ""),
            ("--objects box.urdf --out imaged --num-samples 4 --workers 1 --images depth part_mask", ""),
            ("--objects box.urdf --out bullet --num-samples 4 --workers 1 --renderer pybullet", "pybullet"),
        ],
        "dataset": [("--help", "")],
        "gallery": [("--categories globe --states 1 --out gallery.png", "")],
        "generate-objects": [
            ("--category globe --count 1 --workers 1 --out urdf", ""),
            ("--category globe --count 1 --workers 1 --formats usd --out usd", "sim"),
        ],
        "grasps": [("--category globe --count 1 --workers 1 --out grasps", "sim")],
        "record": [("--out motions --motions 1", "envs")],
        "scene": [("--out scene --renderer raycast", "sim")],
        "view": [("box.urdf --samples 1", "view"), ("made", "view")],
        "inspect": [("box.urdf", ""), ("box.urdf --gates", "sim")],
        "verify": [("made", "")],
        "repair": [("made", "")],
        "convert": [
            ("made --to webdataset --workers 1 --out tars", ""),
            ("made --to ply --workers 1 --out clouds", ""),
            ("imaged --to bop --workers 1 --out bop", ""),
            ("imaged --to coco --workers 1 --out coco", ""),
            ("imaged --to hdf5 --workers 1 --out hdf5", "formats"),
            ("made --to huggingface --workers 1 --out parquet", "formats"),
        ],
        "families": [("globe", "")],
        "vary": [("box.urdf --count 1 --out varied", "sim")],
        "export": [("box.urdf --out exported", "sim"), ("--help", "")],
        "merge": [("--help", "")],
        "doctor": [("warp", "")],
    },
    "artperl": {
        "demo": [("--out demo", "view,train"), ("--help", "")],
        "train": [("--out run", "train")],
        "evaluate": [("laptop", "train")],
        "artimage": [("", "train")],
        "robustness": [("", "train")],
        "reartmix": [("", "train")],
        "ablation": [("", "train")],
        "estimate": [("cloud.npy", "train"), ("--help", "")],
        "calibrate": [("laptop", "train"), ("--help", "")],
        "detections": [("--help", "")],
        "train-detector": [("--out detector", "detect")],
        "report": [("--help", "")],
        "score": [("poses.jsonl --data made", "train"), ("--help", "")],
    },
}
"""Command lines of every verb, and the extra that each wants."""

CALLS = {
    "import artperl": "",
    "import artsim; artsim.make_renderer('raycast')": "",
    **{f"import artsim; artsim.make_renderer({name!r})": name.partition("-")[0] for name in list(RENDERERS)[1:]},
    "import artperl; artperl.load_estimator('laptop')": "train",
    "import artsim.envs": "envs",
    "import artsim; artsim.vary(artsim.make('globe'))": "sim",
    "import artperl.training.gym_env": "train",
    "import artperl.training.run": "train",
    "import artsim.model.collision": "sim",
    "import artsim.checks.validity": "sim",
    "import artsim; from artsim.export import export; export(artsim.make('globe'), 'e', ('mjcf',))": "sim",
    "import artsim; from artsim.export import export; export(artsim.make('globe'), 'e', ('usd',))": "sim",
    "import artsim; from artsim.physics.world import Simulation; Simulation(artsim.make('globe'))": "envs",
    "from artsim.drawing.contact_sheet import contact_sheet; contact_sheet([])": "view",
    "from artsim.drawing.rerun_recording import write_recording; write_recording([], None)": "view",
    "from pathlib import Path; from artsim.physics.simulators import in_mujoco; in_mujoco(Path('box.urdf'))": "sim",
    "from pathlib import Path; from artsim.physics.simulators import in_pybullet as f; f(Path('box.urdf'))": "pybullet",
}
"""Calls from Python, and the extra that each wants."""

# Every entry point in one process: to start twenty of them takes half a minute.
DRIVER = """
import contextlib, io, json, runpy, sys

def told(run):
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            run()
        except SystemExit as stop:
            code = stop.code or 0
        except BaseException as error:
            try:
                sys.excepthook(type(error), error, error.__traceback__)
                code = 1
            except SystemExit as stop:
                code = stop.code
    return code, out.getvalue(), err.getvalue()

def program(name, words):
    import importlib
    def run():
        module = f"{name}.commands.verbs"
        sys.argv = [name, *words]
        importlib.import_module(module).main()
    return told(run)

def benchmark(name):
    def run():
        sys.argv = ["-m"]
        sys.modules.pop("benchmarks", None)
        import benchmarks
        sys.argv = [name, "--help"]
        runpy.run_module(f"benchmarks.{name}", run_name="__main__", alter_sys=True)
    answer = told(run)
    sys.excepthook = sys.__excepthook__
    return answer

def call(source):
    import artsim.errors
    def run():
        try:
            exec(source, {})
        except artsim.errors.ArtsimError as error:
            print(f"error: {error}", file=sys.stderr)
            sys.exit(2)
    return told(run)

if __name__ == "__main__":
    tasks = json.load(sys.stdin)
    answers = [globals()[kind](*arguments) for kind, *arguments in tasks]
    print(json.dumps(answers))
"""


def run_driver(tasks: list[list[Any]], folder: Path, variables: dict[str, str]) -> list[tuple[int, str, str]]:
    (folder / "driver.py").write_text(DRIVER)
    variables = variables | {"PYTHONPATH": os.pathsep.join([variables["PYTHONPATH"], str(ROOT)])}
    done = subprocess.run(
        [sys.executable, "driver.py"], input=json.dumps(tasks), capture_output=True, text=True, cwd=folder,
        env=variables, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return [tuple(answer) for answer in json.loads(done.stdout.splitlines()[-1])]


def says_what_to_install(code: int, err: str, extra: str) -> None:
    """One line, and a command that installs an extra from here."""
    *before, line = err.strip().splitlines()
    assert code == 2, err
    assert "Traceback" not in err
    assert not any(said.startswith(("error: ", "warning: ")) for said in before), err  # progress alone
    what, fix = re.fullmatch(r"error: (.*) is not installed\. Fix: (.*)", line.rpartition("\r")[2]).groups()
    assert what
    *pip, install, editable, target = shlex.split(fix)
    assert pip[-1:] == ["pip"]
    assert (install, editable) == ("install", "-e")
    clone, named = re.fullmatch(r"(.*)\[(.*)\]", target).groups()
    assert (Path(clone) / "pyproject.toml").is_file()
    assert named == extra


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """A folder with things to work on, and an environment with the core alone."""
    folder, hidden = tmp_path_factory.mktemp("alone"), tmp_path_factory.mktemp("hidden")
    (folder / "box.urdf").write_text(BOX_LAPTOP)
    np.save(folder / "cloud.npy", np.random.default_rng(0).normal(size=(100, 3)))
    return folder, environment(hidden, beyond_the_core())


def test_every_verb_works_with_the_core_alone_or_says_in_one_line_which_extra_it_wants(
    alone: tuple[Path, dict[str, str]],
) -> None:
    for name, groups in (("artsim", artsim.commands.verbs.VERBS), ("artperl", artperl.commands.verbs.VERBS)):
        known = {verb_name(verb) for verbs in groups.values() for verb in verbs}
        assert set(VERBS[name]) == known, "a new verb needs a line here"
    lines = [
        (name, verb, words, extra)
        for name, verbs in VERBS.items()
        for verb, calls in verbs.items()
        for words, extra in calls
    ]
    answers = run_driver([["program", name, [verb, *words.split()]] for name, verb, words, _ in lines], *alone)
    for (name, verb, words, extra), (code, out, err) in zip(lines, answers, strict=True):
        print(name, verb, words, code, err[-300:])
        if extra:
            says_what_to_install(code, err, extra)
        else:
            assert code == 0, (name, verb, words, err)
            assert out or err


def test_every_call_from_python_says_which_extra_it_wants(alone: tuple[Path, dict[str, str]]) -> None:
    answers = run_driver([["call", source] for source in CALLS], *alone)
    for (source, extra), (code, _, err) in zip(CALLS.items(), answers, strict=True):
        print(source, code, err[-300:])
        if extra:
            says_what_to_install(code, err, extra)
        else:
            assert code == 0, (source, err)


def test_every_benchmark_shows_its_help_or_says_which_extra_it_wants(alone: tuple[Path, dict[str, str]]) -> None:
    assert len(BENCHMARKS) > 15
    answers = run_driver([["benchmark", name] for name in BENCHMARKS], *alone)
    works = 0
    for name, (code, out, err) in zip(BENCHMARKS, answers, strict=True):
        print(name, code, err[-300:])
        if code == 0:
            assert "usage" in out, name
            works += 1
        else:
            says_what_to_install(code, err, re.search(r"\[(\w+)\]", err)[1])
    assert 3 < works < len(BENCHMARKS)


def test_programs_exit_with_2(alone: tuple[Path, dict[str, str]]) -> None:
    """As a shell sees it: the hook of benchmarks decides the exit code, too."""
    folder, variables = alone
    variables = variables | {"PYTHONPATH": os.pathsep.join([variables["PYTHONPATH"], str(ROOT)])}
    for words in (["-m", "benchmarks.speed", "--help"], [str(ROOT / "train.py"), "--out", "run"]):
        done = subprocess.run(
            [sys.executable, *words], capture_output=True, text=True, cwd=folder, env=variables, timeout=60
        )
        says_what_to_install(done.returncode, done.stderr, "train")


def test_gymnasium_without_physics_names_the_extra(tmp_path: Path) -> None:
    source = (
        "import gymnasium, artsim.envs, artsim\n"
        "for name in ('artsim/Articulated-v0', 'ArtSimArticulated-v1'):\n"
        "    try:\n"
        "        gymnasium.make(name).reset(seed=0)\n"
        "    except artsim.ArtsimError as error:\n"
        "        print(error)\n"
    )
    variables = environment(tmp_path, ["pybullet", "mujoco", "mani_skill", "torch"])
    done = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, env=variables, timeout=60)
    assert done.returncode == 0, done.stderr
    physics, maniskill = done.stdout.splitlines()
    assert physics.startswith("physics: MuJoCo is not installed. Fix: ")
    assert "[envs]" in physics
    assert maniskill.startswith("ArtSimArticulated-v1: ")
    assert "[maniskill]" in maniskill


@pytest.mark.parametrize("module", MODULES)
def test_the_extra_that_is_named_brings_the_module(module: str) -> None:
    owners = packages_distributions().get(module)
    if owners is None:
        absent(f"{module} is not installed here")
    _, extra = MODULES[module]
    assert {normal(owner) for owner in owners} & distributions_of(extra)
    assert not {normal(owner) for owner in owners} & distributions_of("")


def load_films() -> None:
    with require_extra("films", RenderError):
        import mujoco  # noqa: F401


def test_mujoco_says_that_the_processor_lacks_avx_instead_of_ending_the_process(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import_mujoco("physics")  # what runs here has AVX
    monkeypatch.setitem(importlib.import_module("numpy._core._multiarray_umath").__cpu_features__, "AVX", False)
    monkeypatch.setattr("platform.machine", lambda: "x86_64")
    with pytest.raises(ConfigError, match=r"^physics: MuJoCo needs a processor with AVX.* Fix: use another machine"):
        import_mujoco("physics")
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    import_mujoco("physics")  # ARM's wheels have no AVX


def test_pybullet_says_which_pythons_have_wheels(monkeypatch: pytest.MonkeyPatch) -> None:
    absent_module = ModuleNotFoundError("No module named 'pybullet'", name="pybullet")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("artsim.common.extras.sys.version_info", (3, 11))
    assert "[pybullet]" in str(import_failure(absent_module, "films"))
    monkeypatch.setattr("artsim.common.extras.sys.version_info", (3, 12))
    assert "PyBullet is not installed. Fix: it has wheels for" in str(import_failure(absent_module, "films"))


def test_a_library_of_the_system_that_is_missing_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mujoco.py").write_text(
        "raise ImportError('libGL.so.1: cannot open shared object file: No such file', name='mujoco')"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mujoco", raising=False)
    with pytest.raises(RenderError, match=r"films: MuJoCo is installed.*libGL\.so\.1.*Fix: .*install-system") as caught:
        load_films()
    assert isinstance(caught.value.__cause__, ImportError)


def test_what_an_optional_module_itself_lacks_is_told_by_its_name() -> None:
    error = import_failure(
        ModuleNotFoundError("No module named 'colorlibrary'", name="colorlibrary"), "films", extra="view"
    )
    assert str(error).startswith("films: colorlibrary is not installed. Fix: ")
    assert "[view]" in str(error)
    too_old = import_failure(ModuleNotFoundError("No module named 'numpy.later'", name="numpy.later"), "films")
    assert "numpy is installed, but cannot be imported (No module named 'numpy.later')" in str(too_old)


def test_a_fault_of_our_own_keeps_its_traceback() -> None:
    with pytest.raises(ImportError, match="nonsense"), require_extra("films"):
        from artsim import nonsense  # type: ignore[attr-defined]  # noqa: F401


def test_the_command_fits_where_the_package_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert install_command("train").endswith("pip install -e '.[train]'")
    assert install_command().endswith("pip install -e .")
    monkeypatch.chdir(tmp_path)
    assert install_command("train").endswith(f"pip install -e '{ROOT}[train]'")
    installed = tmp_path / "site-packages" / "artsim" / "common" / "extras.py"
    monkeypatch.setattr("artsim.common.extras.__file__", str(installed))
    assert install_command("train,view").endswith("pip install 'artsim[train,view]'")
    with pytest.raises(ConfigError, match=r"Fix: .*pip install artsim$"), require_extra("films"):
        raise ModuleNotFoundError("No module named 'no_such_module'", name="no_such_module")
