"""Files of MJCF and USD are objects wherever a URDF file is one; folders of GAPartNet are those of PartNet-Mobility."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from artsim.checks.validity import check_file
from artsim.commands.inspect import Inspect
from artsim.datasets.dataset import open_dataset
from artsim.datasets.generate import generate
from artsim.datasets.plan import SampleOptions
from artsim.export import FORMATS, export
from artsim.families import make
from artsim.loading.sources import find_sources
from artsim.loading.urdf import load
from artsim.variation.folder import write_variations
from tests.conftest import ASSETS

OTHERS = ["mjcf", "usd"]


@pytest.mark.parametrize("kind", OTHERS)
def test_an_exported_file_passes_the_gates(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    export(make("drawer", 0), tmp_path / "o", [kind])
    file = tmp_path / "o" / FORMATS[kind]
    assert [str(gate) for gate in check_file(load(file), file) if not gate.passed] == []
    Inspect(file, gates=True).run()
    assert "inertia: passed" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("kind", OTHERS)
def test_an_exported_file_is_varied(kind: str, tmp_path: Path) -> None:
    export(make("drawer", 0), tmp_path / "o", [kind])
    summary = write_variations(tmp_path / "o" / FORMATS[kind], tmp_path / "v", count=2, formats=[kind], progress=False)
    assert summary.made == 2, summary.failed
    assert load(tmp_path / "v" / "0").sha256 != load(tmp_path / "v" / "1").sha256


@pytest.mark.slow
@pytest.mark.parametrize("kind", OTHERS)
def test_samples_of_an_exported_file_are_those_of_the_object(kind: str, tmp_path: Path) -> None:
    export(make("drawer", 0), tmp_path / "o", [kind])
    sources = find_sources([tmp_path / "o" / FORMATS[kind]])
    generate(sources, tmp_path / "d", num_samples=2, seed=0, workers=1, sample=SampleOptions(), progress=False)
    sample = open_dataset(tmp_path / "d")[0]
    np.testing.assert_allclose(sample.box_size / sample.scale, make("drawer", 0).box_size, atol=1e-5)


def test_a_folder_of_gapartnet_is_named_and_labelled_by_its_own_annotation(tmp_path: Path) -> None:
    folder = tmp_path / "45661"
    shutil.copytree(ASSETS / "cabinet", folder)
    (folder / "mobility.urdf").rename(folder / "mobility_annotation_gapartnet.urdf")
    before = load(folder)
    assert before.object_id == "45661"
    moving = [part.name for part in before.parts[1:]]
    entries = [{"link_name": name, "is_gapart": True, "category": "slider_drawer", "bbox": []} for name in moving]
    entries.append({"link_name": before.parts[0].name, "is_gapart": True, "category": "line_fixed_handle"})
    (folder / "link_annotation_gapartnet.json").write_text(json.dumps(entries))
    obj = load(folder)
    assert {part.label for part in obj.parts[1:]} == {"slider_drawer"}
    assert obj.parts[0].label == obj.parts[0].name
    assert [source.path.name for source in find_sources([tmp_path])] == ["mobility_annotation_gapartnet.urdf"]
    (folder / "link_annotation_gapartnet.json").write_text('{"not": ["a list"]}')
    assert load(folder).parts[1].label == obj.parts[1].name
