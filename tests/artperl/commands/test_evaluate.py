"""The verbs that test estimators: ``artperl evaluate``, ``artimage``, ``robustness``, ``reartmix`` and ``ablation``."""

from __future__ import annotations

from pathlib import Path

import pytest
import tyro

from artperl.commands import verbs
from artsim.errors import ConfigError


@pytest.mark.parametrize("verb", [verbs.ArtImage, verbs.Robustness, verbs.ReArtMix, verbs.Ablation])
@pytest.mark.parametrize("option", ["--states rest", "--preset sphere", "--noise d435", "--files a.urdf"])
def test_a_benchmark_has_objects_states_views_and_noise_of_its_own(verb: type, option: str) -> None:
    assert tyro.cli(verbs.Evaluate, args=["laptop", *option.split()]) != verbs.Evaluate(Path("laptop"))
    with pytest.raises(SystemExit):
        tyro.cli(verb, args=option.split())


def test_the_original_images_have_no_rows_and_regenerated_ones_are_of_the_method_full(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no rows"):
        verbs.ArtImage(root=tmp_path, rows=("real",)).run()
    with pytest.raises(ConfigError, match="method is full"):
        verbs.ArtImage(method="ancsh").run()


def test_the_ablation_is_told_of_no_azimuths_and_an_evaluation_of_no_detections() -> None:
    for verb, option in ((verbs.Ablation, "--seen-from -75 75"), (verbs.Evaluate, "laptop --skip-bad")):
        with pytest.raises(SystemExit):
            tyro.cli(verb, args=option.split())


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["evaluate", "--benchmark", "reartmix", "--views", "3"], ["reartmix", "--views", "3"]),
        (["evaluate", "folder", "--ablation"], ["ablation", "folder"]),
        (["evaluate", "laptop"], ["evaluate", "laptop"]),
        (["report", "--benchmark", "artimage"], ["report", "--benchmark", "artimage"]),
    ],
)
def test_former_names_of_benchmarks_are_commands(words: list[str], expected: list[str]) -> None:
    assert verbs.with_new_names(words) == expected
