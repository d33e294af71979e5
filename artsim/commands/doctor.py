"""Which backends work on this machine, on which device, how fast, and how to mend those that do not.

Each backend is tried in a process of its own: some drivers crash the process that asks for a device in vain.
"""

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial

import tyro

from artsim.common.extras import import_failure, install_command
from artsim.common.program import Figures
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError, RenderError
from artsim.renderers import RENDERERS
from artsim.renderers.ray_scenes import RAY_LIBRARY

SIZE = 128
"""Width and height of the pictures that rates are measured with, pixels."""

_MEASURE = 1.0  # seconds
_TIMEOUT = 300.0  # seconds; drivers compile their shaders first
_START_EGL = """
import importlib.util, pybullet
pybullet.connect(pybullet.DIRECT)
pybullet.loadPlugin(importlib.util.find_spec("eglRenderer").origin, "_eglRendererPlugin")
"""  # the only way to learn the device is from what PyBullet prints
_FIXES = {name: install_command(name) for name in ("pybullet", "warp", "ray")} | {
    "raycast": f"pip install --force-reinstall {RAY_LIBRARY}",
    "pybullet-egl": f"{install_command('pybullet')}, then scripts/install-system.sh as root",
    **{name: f"{install_command(name)}, then scripts/install-vulkan.sh as root" for name in ("sapien", "maniskill")},
    "torch": install_command("train"),
}


@dataclass(frozen=True)
class Finding:
    """What was found out about one backend."""

    backend: str
    works: bool
    device: str = ""
    """What it runs on; empty if it does not."""
    fps: float | None = None
    """Pictures of a laptop (depth and part ids) per second; None where the backend makes none."""
    problem: str = ""
    fix: str = ""
    """What is wrong and what to do about it; empty if nothing is."""


def examine(backend: str) -> Finding:
    """Try one of ``BACKENDS`` in a process of its own.

    Raises
    ------
    ConfigError
        When there is no such backend.
    """
    if backend not in BACKENDS:
        raise ConfigError(f"there is no backend {backend!r}", "backend", f"use one of {', '.join(BACKENDS)}")
    try:
        child = subprocess.run(
            [sys.executable, "-m", "artsim.commands.doctor", backend], capture_output=True, text=True, timeout=_TIMEOUT
        )
    except subprocess.TimeoutExpired:
        return _failure(backend, f"gave no answer within {_TIMEOUT:.0f} s")
    # A process that has answered may still crash at its exit.
    for line in reversed(child.stdout.splitlines()):
        if line.startswith('{"backend":'):
            return Finding(**json.loads(line))
    if child.returncode < 0:
        return _failure(backend, f"crashes its process ({signal.Signals(-child.returncode).name})")
    last = (child.stderr.strip().splitlines() or [f"ended with {child.returncode}"])[-1]
    return _failure(backend, last)


def _failure(backend: str, problem: str, fix: str = "") -> Finding:
    fix = fix or _FIXES.get(backend, "read in its module what it needs")
    return Finding(backend, works=False, problem=problem, fix=fix)


def finding_table(findings: list[Finding]) -> str:
    """Findings as text: a line for each backend, and one more for what to do about those that do not work."""
    width = max(len("device"), *(len(finding.device) for finding in findings))
    lines = [f"{'backend':<14}{'works':<7}{'device':<{width + 2}}frames/s at {SIZE}x{SIZE}"]
    for finding in findings:
        rate = "" if finding.fps is None else f"{finding.fps:.0f}"
        lines.append(f"{finding.backend:<14}{'yes' if finding.works else 'no':<7}{finding.device:<{width + 2}}{rate}")
        if not finding.works:
            lines.append(f"{'':<14}{finding.problem}\n{'':<14}fix: {finding.fix}")
    return "\n".join(line.rstrip() for line in lines)


def _rate(draw: Callable[[], object]) -> float:
    """Calls per second, after a first one."""
    draw()
    count, start = 0, time.perf_counter()
    while (elapsed := time.perf_counter() - start) < _MEASURE or count == 0:
        draw()
        count += 1
    return count / elapsed


def _renderer_fps(name: str) -> float:
    from artsim.families import make
    from artsim.model.camera import Camera
    from artsim.renderers import make_renderer

    obj, renderer = make("laptop", seed=0), make_renderer(name)
    reach = 1.5 * obj.diagonal
    camera = Camera.look_at((-reach, 0.4 * reach, 0.6 * reach), (0.0, 0.0, 0.0), SIZE, SIZE)
    if not (renderer.render(obj, obj.tree.rest, camera).depth > 0).any():
        raise RenderError("draws an empty picture", name)
    return _rate(lambda: renderer.render(obj, obj.tree.rest, camera))


def processor() -> str:
    """Name of the processor, where the system tells."""
    try:
        with open("/proc/cpuinfo") as file:  # noqa: PTH123
            names = re.findall(r"^model name\s*: *(.*)$", file.read(), flags=re.MULTILINE)
    except OSError:
        names = []
    return f"CPU ({names[0]}, {len(names)} threads)" if names else "CPU"


def _renderer(name: str) -> tuple[str, float | None]:
    """A renderer that draws on the processor."""
    return processor(), _renderer_fps(name)


def _pybullet_egl() -> tuple[str, float | None]:
    fps = _renderer_fps("pybullet-egl")
    said = subprocess.run([sys.executable, "-c", _START_EGL], capture_output=True, text=True, timeout=_TIMEOUT).stdout
    found = re.search(r"^GL_RENDERER=(.*)$", said, flags=re.MULTILINE)
    return found[1] if found else "", fps


def _sapien() -> tuple[str, float | None]:
    from artsim.renderers.sapien import import_sapien

    return str(import_sapien().render.RenderSystem().device.name), _renderer_fps("sapien")


def _maniskill() -> tuple[str, float | None]:
    """A step of the environment, with a picture, each time."""
    import mani_skill  # noqa: F401 - tells which module is missing

    import artsim.envs  # noqa: F401 - registers it
    from artsim.envs.maniskill import ENV_ID
    from artsim.model.draws import ViewOptions
    from artsim.renderers.sapien import import_sapien

    device = str(import_sapien().render.RenderSystem().device.name)
    import gymnasium

    views = ViewOptions(width=SIZE, height=SIZE)
    env = gymnasium.make(ENV_ID, categories=("laptop",), obs_mode="depth+segmentation", views=views)
    observation, info = env.reset(seed=0)
    if not (observation["sensor_data"]["base_camera"]["segmentation"] == info["segmentation_id"][0, 0]).any():
        raise RenderError("draws no part of the object", "maniskill")
    return device, _rate(lambda: env.step(None))


def _warp() -> tuple[str, float | None]:
    from artsim.renderers.warp import WarpRenderer, import_warp

    device = import_warp().get_device(WarpRenderer().device)
    return str(device.name) if device.is_cuda else processor(), _renderer_fps("warp")


def _ray() -> tuple[str, float | None]:
    import ray

    return f"Ray {ray.__version__}, for artsim generate --ray", None


def _torch() -> tuple[str, float | None]:
    import torch

    kind = "cuda" if torch.cuda.is_available() else "cpu"
    torch.ones(2, device=kind).sum().item()
    return torch.cuda.get_device_name() if kind == "cuda" else processor(), None


BACKENDS: dict[str, Callable[[], tuple[str, float | None]]] = {
    **{name: partial(_renderer, name) for name in RENDERERS},
    "pybullet-egl": _pybullet_egl,
    "sapien": _sapien,
    "warp": _warp,
    "maniskill": _maniskill,
    "ray": _ray,
    "torch": _torch,
}
"""What tries each backend: its device and frames per second."""


def _answer(backend: str) -> Finding:
    """Try a backend in this process."""
    try:
        device, fps = BACKENDS[backend]()
    except ArtsimError as error:
        return _failure(backend, error.what, error.fix or "")
    except ImportError as error:
        told = import_failure(error, backend)
        return _failure(backend, told.what, "" if isinstance(error, ModuleNotFoundError) else told.fix or "")
    except Exception as error:  # backends fail in many ways
        return _failure(backend, f"{type(error).__name__}: {error}")
    return Finding(backend, works=True, device=device, fps=fps)


@dataclass(frozen=True)
class Doctor(Figures):
    """Try every backend: does it work, on which device, how fast, and what to do if not."""

    backends: tyro.conf.Positional[tuple[str, ...]] = ()
    """raycast, pybullet, pybullet-egl, sapien, warp, maniskill, ray, torch; by default all of them."""

    def run(self) -> None:
        findings = [examine(backend) for backend in track("backends", self.backends or tuple(BACKENDS), leave=False)]
        self.say(finding_table(findings))
        self.finish(findings)


if __name__ == "__main__":
    print(json.dumps(asdict(_answer(sys.argv[1]))), flush=True)
