"""Optional dependencies: which extra brings each of them, and one sentence for whoever lacks one.

Every import of an optional dependency stands in :func:`require_extra`, or is reached through a program whose last net
is :func:`import_failure`: nobody has to read a traceback to learn what to install.
"""

import contextlib
import ctypes
import importlib
import importlib.util
import os
import platform
import re
import shlex
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from artsim.errors import ArtsimError, ConfigError, RenderError

MODULES = {
    "pybullet": ("PyBullet", "pybullet"),
    "pybullet_data": ("PyBullet", "pybullet"),
    "gymnasium": ("gymnasium", "envs"),
    "sapien": ("SAPIEN", "sapien"),
    "mani_skill": ("ManiSkill", "maniskill"),
    "warp": ("Warp", "warp"),
    "matplotlib": ("matplotlib", "view"),
    "rerun": ("rerun-sdk", "view"),
    "fcl": ("python-fcl", "sim"),
    "mujoco": ("MuJoCo", "sim"),
    "coacd": ("CoACD", "sim"),
    "pxr": ("usd-core", "sim"),
    "psutil": ("psutil", "sim"),
    "yourdfpy": ("yourdfpy", "sim"),
    "h5py": ("h5py", "formats"),
    "pyarrow": ("pyarrow", "formats"),
    "ray": ("Ray", "ray"),
    "fsspec": ("fsspec", "storage"),
    "s3fs": ("s3fs", "storage"),
    "torch": ("torch", "train"),
    "tensorboard": ("tensorboard", "train"),
    "safetensors": ("safetensors", "train"),
    "yaml": ("PyYAML", "train"),
    "transformers": ("transformers", "detect"),
    "pycocotools": ("pycocotools", "detect"),
    "hypothesis": ("hypothesis", "dev"),
    "pytest": ("pytest", "dev"),
    "stable_baselines3": ("stable-baselines3", "dev"),
    "webdataset": ("webdataset", "dev"),
    "playwright": ("playwright", "dev"),
    "simready": ("simready-validate", "dev"),
    "newton": ("Newton", "dev"),
}
"""Optional modules: what each is called, and the extra that brings it."""

_OURS = ("artsim", "artperl", "benchmarks")


@contextlib.contextmanager
def require_extra(where: str, kind: type[ArtsimError] = ConfigError, extra: str = "") -> Iterator[None]:
    """Import optional dependencies in this block; what is missing, or does not start, becomes one sentence.

    Parameters
    ----------
    where : str
        What they are for.
    kind : type of ArtsimError
        Raised when one cannot be imported.
    extra : str
        Extras to install, separated by commas; by default the one that brings the missing module.

    Raises
    ------
    ArtsimError
        Of the type ``kind``, with the command that installs what is missing, or the reason why it does not start.
    """
    try:
        yield
    except ImportError as error:
        if is_own_module(error):
            raise
        raise import_failure(error, where, kind, extra) from error


def import_mujoco(where: str, extra: str = "") -> ModuleType:
    """MuJoCo; parameters as of :func:`require_extra`.

    Raises
    ------
    ConfigError
        When it is not installed. On an x86-64 processor without AVX, too: its wheels consist of such instructions, and
        the first one would end this process without a word.
    """
    if platform.machine() in ("x86_64", "AMD64") and not _has_avx():
        raise ConfigError("MuJoCo needs a processor with AVX, which this one lacks", where, "use another machine")
    with require_extra(where, extra=extra):
        import mujoco
    module: ModuleType = mujoco
    return module


def _has_avx() -> bool:
    """Whether the processor has AVX: NumPy looks for it anyway."""
    with contextlib.suppress(ImportError):  # NumPy before 1.26 has it elsewhere
        features = importlib.import_module("numpy._core._multiarray_umath").__cpu_features__
        return bool(features.get("AVX", True))
    return True


def is_own_module(error: ImportError) -> bool:
    """Whether a module of this project is what cannot be imported: a fault whose traceback is wanted."""
    return (error.name or "").partition(".")[0] in _OURS


def import_failure(
    error: ImportError, where: str | None, kind: type[ArtsimError] = ConfigError, extra: str = ""
) -> ArtsimError:
    """The readable form of a failed import; parameters as of :func:`require_extra`."""
    module = (error.name or "").partition(".")[0]
    name, own = MODULES.get(module, (module, ""))
    fix = install_command(extra or own)
    if isinstance(error, ModuleNotFoundError) and module and importlib.util.find_spec(module) is None:
        if name == "PyBullet" and sys.version_info >= (3, 12):
            fix = "it has wheels for Python 3.10 and 3.11: use one of these, or MuJoCo as physics and another renderer"
        return kind(f"{name} is not installed", where, fix)
    if re.search(r"\.so\b|shared object|DLL|\.dylib", str(error)):
        fix = "install the system library that it names (scripts/install-system.sh does it on Debian and Ubuntu)"
    return kind(f"{name or 'a module'} is installed, but cannot be imported ({error})", where, fix)


def install_command(extra: str = "") -> str:
    """Shell command that installs extras of this very artsim, from its clone if it runs from one.

    Parameters
    ----------
    extra : str
        Names of extras, separated by commas; empty for the core alone.
    """
    extras = f"[{extra}]" if extra else ""
    clone = _clone()
    if clone is None:
        return f"{_pip()} install {shlex.quote('artsim' + extras)}"
    with contextlib.suppress(OSError):  # the current folder may be gone
        if Path.cwd() == clone:
            return f"{_pip()} install -e {shlex.quote('.' + extras)}"
    return f"{_pip()} install -e {shlex.quote(str(clone) + extras)}"


def _clone() -> Path | None:
    """Folder of the source tree that this package runs from; None once it is installed by itself."""
    folder = Path(__file__).resolve().parents[2]
    try:
        return folder if 'name = "artsim"' in (folder / "pyproject.toml").read_text(encoding="utf-8") else None
    except (OSError, ValueError):
        return None


def _pip() -> str:
    """What installs into the environment of this process, whichever one the shell is in."""
    if importlib.util.find_spec("pip") is None:  # as in environments that uv makes
        return "uv pip"
    found = shutil.which("pip")
    own = found is not None and Path(found).parent == Path(sys.executable).parent
    return "pip" if own else f"{shlex.quote(sys.executable)} -m pip"


@contextlib.contextmanager
def silence_output() -> Iterator[None]:
    """Keep what a library prints from C, such as PyBullet's chatter, out of the program's output."""
    sys.stdout.flush()
    sys.stderr.flush()
    with contextlib.ExitStack() as stack:
        null = os.open(os.devnull, os.O_WRONLY)
        stack.callback(os.close, null)
        for stream in (1, 2):
            saved = os.dup(stream)
            stack.callback(os.close, saved)
            os.dup2(null, stream)
            stack.callback(os.dup2, saved, stream)
        stack.callback(ctypes.CDLL(None).fflush, None)  # C buffers what it prints
        yield


def import_pybullet() -> ModuleType:
    """PyBullet, without its greeting.

    Raises
    ------
    RenderError
        When it is not installed.
    """
    with require_extra("pybullet", RenderError), silence_output():
        import pybullet
    return pybullet
