"""The one family of errors that artsim raises on purpose.

Every message says *what* went wrong, *where*, and *how to fix it*.
"""

from collections.abc import Sequence
from pathlib import Path

from artsim.common.names import printable

__all__ = ["ArtsimError", "AssetError", "ConfigError", "DatasetError", "KinematicsError", "RenderError", "SceneError"]

_MAX_TEXT = 1200
"""Characters of each part of a message: names out of files may be of any length."""


class ArtsimError(Exception):
    """Base of every deliberate error.

    Parameters
    ----------
    what : str
        What went wrong, in one sentence.
    where : str or Path, optional
        File, element or option concerned.
    fix : str, optional
        What the user can do about it.
    """

    def __init__(self, what: str, where: str | Path | None = None, fix: str | None = None):
        self.what = what
        self.where = None if where is None else str(where)
        self.fix = fix
        super().__init__(str(self))

    def __str__(self) -> str:
        # Each part may quote names out of files, which hold anything.
        text = printable(self.what, _MAX_TEXT)
        if self.where is not None:
            text = f"{printable(self.where, _MAX_TEXT)}: {text}"
        return text if self.fix is None else f"{text.rstrip('.')}. Fix: {printable(self.fix, _MAX_TEXT)}"

    def __reduce__(self) -> tuple[type, tuple[str, str | None, str | None]]:
        # Errors cross process boundaries (generation workers).
        return type(self), (self.what, self.where, self.fix)


class AssetError(ArtsimError):
    """An object file (URDF, mesh, side file) cannot be used."""


class SceneError(AssetError):
    """A file holds several objects, and it is not said which is meant.

    Attributes
    ----------
    names : tuple of str
        What may be chosen.
    """

    def __init__(self, what: str, where: str | Path | None = None, fix: str | None = None, names: Sequence[str] = ()):
        self.names = tuple(names)
        super().__init__(what, where, fix)

    def __reduce__(self) -> tuple[type, tuple[str, str | None, str | None, tuple[str, ...]]]:  # type: ignore[override]
        return type(self), (self.what, self.where, self.fix, self.names)


class KinematicsError(ArtsimError):
    """A kinematic tree is inconsistent, or a state does not fit it."""


class RenderError(ArtsimError):
    """A renderer is missing, or cannot draw what it was asked to."""


class DatasetError(ArtsimError):
    """A dataset on disk is damaged, incomplete or of another plan."""


class ConfigError(ArtsimError):
    """An option has a value that makes no sense."""
