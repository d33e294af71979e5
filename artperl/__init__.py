"""artperl: 9D pose of every part of an articulated object from a partial point cloud (ArtPERL)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from artperl.detection import SHIPPED
from artsim.common.extras import require_extra
from artsim.common.showing import PAGE_MODULES

if TYPE_CHECKING:
    from artperl.core.estimate import Estimate
    from artperl.methods.protocol import Method
    from artperl.scene.estimator import SceneEstimator

__all__ = ["Estimate", "load_estimator", "load_scene_estimator"]


PAGE_MODULES.append("artperl.evaluation.estimate_page")


def load_estimator(name: str | Path, method: str = "full", **changes: Any) -> Method:
    """An estimator by its folder, or one that comes with the package by its name, such as "laptop".

    Parameters
    ----------
    name : str or Path
    method : str
        full, which comes with the package; artperl (the paper's), which does for the categories of ArtImage; or ancsh,
        omad or sporeagent, which you train yourself: a folder of your own.
    **changes
        Of its options, such as ``seen_from=(-75.0, 75.0)``, degrees, where the camera is known to be in front of the
        object. :class:`artperl.fitting.options.EstimatorOptions` has them all.

    Raises
    ------
    ConfigError
        When there is no such option, or torch is not installed.
    DatasetError
        When there is no such estimator, or its files are damaged.
    """
    with require_extra("artperl"):
        from artperl.methods.estimator_files import load_estimator as load  # torch takes seconds to import

    return load(name, method=method, **changes)


def load_scene_estimator(
    estimators: Mapping[str, str | Path] | None = None, detector: str | Path = SHIPPED, **changes: Any
) -> SceneEstimator:
    """An estimator of all objects in an image: ``load_scene_estimator()(rgb, depth, K)``.

    Parameters
    ----------
    estimators : mapping, optional
        Name or folder of the estimator of each category; by default those that come with the package, by their names.
    detector : str or Path
        Name or folder of the detector, used where no detections are given.
    **changes
        ``apart=True`` moves estimates that stand in each other apart; others are of the estimators' options, such as
        ``seen_from=(-75.0, 75.0)``.

    Raises
    ------
    ConfigError
        When torch is not installed.
    """
    with require_extra("artperl"):
        from artperl.scene.estimator import SceneEstimator  # torch takes seconds to import

    return SceneEstimator(estimators, detector, **changes)


def __getattr__(name: str) -> Any:
    if name == "Estimate":
        with require_extra("artperl"):
            from artperl.core.estimate import Estimate  # torch takes seconds to import

        return Estimate
    raise AttributeError(f"module 'artperl' has no attribute {name!r}")
