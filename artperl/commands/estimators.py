"""Estimators by the names that commands take: those of the package, and folders."""

from collections.abc import Sequence
from pathlib import Path

from artperl.methods.estimator_folders import SETTINGS, estimator_fix, folder_of
from artsim.errors import ConfigError


def estimator_folder(name: str) -> Path:
    """Folder of an estimator, which there is; see :func:`artperl.methods.estimator_folders.folder_of`.

    Raises
    ------
    ConfigError
        When there is none.
    """
    folder = folder_of(name)
    if (folder / SETTINGS).is_file():
        return folder
    what = "holds no estimator" if Path(name).is_dir() else "is no estimator"
    raise ConfigError(f"{name!r} {what}", "category", estimator_fix(name))


def named_estimators(texts: Sequence[str]) -> dict[str, str | Path]:
    """Estimators by category: out of CATEGORY=NAME, and of folders with one for each category.

    Raises
    ------
    ConfigError
        When there is no such estimator.
    """
    found: dict[str, str | Path] = {}
    for text in texts:
        category, equals, name = text.partition("=")
        if equals:
            found[category] = estimator_folder(name)
            continue
        below = [path.parent for path in sorted(Path(text).glob("*/estimator.json"))]
        runs = [path.parent.parent for path in sorted(Path(text).glob("*/best/estimator.json"))]
        found |= {folder.name: folder for folder in below} | {run.name: run / "best" for run in runs}
        if not below and not runs:
            raise ConfigError(
                "it is no folder with an estimator for each category",
                text,
                "write CATEGORY=NAME, such as drawer=generic",
            )
    return found
