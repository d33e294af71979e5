"""Folders of trained estimators and their settings, which are read without torch: it takes seconds to import."""

from pathlib import Path
from typing import Any

from artsim.common.files import read_json
from artsim.common.names import name_fix
from artsim.errors import DatasetError

WEIGHTS = Path(__file__).parents[1] / "weights"
"""Folder of the estimators that come with the package."""

RUNS = Path("out/train")
"""Where training runs are, each in a folder of its name, unless they are told otherwise."""

FORMAT = 4
SETTINGS, TENSORS, BASE = "estimator.json", "weights.safetensors", "base.npz"
"""Files of the folder."""
AGAIN = "train it again"


def folder_of(name: str | Path, method: str = "full") -> Path:
    """Folder of an estimator: of its own, of the package by its name, or the best one of a run, by its folder or name.

    One that comes with the package is not hidden by a folder of that name without any.
    """
    own, shipped = Path(name), WEIGHTS / ("" if method == "full" else method) / _FORMER_ESTIMATORS.get(str(name), name)
    if shipped != own and shipped.is_dir() and not (own / SETTINGS).is_file():  # own, where the name is a whole path
        return shipped
    places = (own, own / "best", RUNS / name / "best")
    return next((place for place in places if (place / SETTINGS).is_file()), own)


_FORMER_ESTIMATORS = {"any": "generic"}
"""Names that shipped estimators had."""


def read_settings(folder: Path) -> dict[str, Any]:
    """Settings of the estimator in a folder.

    Raises
    ------
    DatasetError
        When there is none, or it was written by another version.
    """
    if not (folder / SETTINGS).exists():
        raise DatasetError("there is no estimator", folder, estimator_fix(folder.name))
    # An option, or a figure of its training, may be infinite.
    settings = read_json(folder / SETTINGS, SETTINGS, DatasetError, _MAX_SETTINGS_BYTES, finite=False)
    if not isinstance(settings, dict) or not isinstance(settings.get("about"), dict):
        raise DatasetError(f"{SETTINGS} is damaged: it says nothing about an estimator", folder, AGAIN)
    if settings.get("format") != FORMAT:
        raise DatasetError(f"format {settings.get('format')!r:.20} is not {FORMAT}", folder, AGAIN)
    own = settings.get("options")
    for values in (settings, own if isinstance(own, dict) else {}):  # methods have them among their options
        for name in ("calibration", "part_calibration"):
            if isinstance(values.get(name), dict):
                values[name] = {_RENAMED.get(key, key): value for key, value in values[name].items()}
    return settings


def estimator_fix(name: str) -> str:
    """What to do where there is no estimator of a name."""
    shipped = sorted(path.parent.name for path in WEIGHTS.glob(f"*/{SETTINGS}"))
    for of in shipped:
        if name in read_settings(WEIGHTS / of)["about"].get("options", {}).get("categories", ()):
            return f"use {of}, which covers {name} and comes with the package, or a folder that artperl train wrote"
    runs = sorted(path.parents[1].name for path in RUNS.glob(f"*/best/{SETTINGS}"))
    where = "which come with the package, " + (f"and of {RUNS}, " if runs else "")
    return f"{name_fix(name, [*shipped, *runs])}, {where}or a folder that artperl train wrote"


_RENAMED = {"doubt": "expected_error", "foreign": "outlier_share"}
"""Names that files of former versions have for symptoms."""
_MAX_SETTINGS_BYTES = 16_000_000
