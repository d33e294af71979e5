"""A network that tells the truth finds every object; detectors are kept and read back; damage is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from artperl.commands.detections import MakeDetections
from artperl.commands.estimate import Estimate
from artperl.detection.detector import Detector, load_detector, save_detector
from artperl.detection.network import DetectorNetwork, DetectorSize
from artperl.evaluation.mask_precision import mask_precision
from artperl.evaluation.realistic_detections import Flaws, realistic_detections
from artperl.training.detector import detector_losses, scene_options, train_detector
from artperl.training.scene_cells import Cells, SceneCells
from artsim.errors import ConfigError, DatasetError
from artsim.scenes import SceneCameraOptions, SceneDataset, SceneOptions, SceneRun, generate_scenes
from tests.artsim.datasets.conftest import quick_workers  # noqa: F401

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_workers")]

RUN = SceneRun(
    SceneOptions(("box", "box", "stapler", "scissors"), diagonal=(0.2, 0.38), distractors=2),
    SceneCameraOptions(width=640, height=360), views=2, renderer="raycast", num_points=64,
)  # fmt: skip
NO_FLAWS = Flaws(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("detector") / "scenes"
    generate_scenes(RUN, folder, 1, seed=12, workers=1, progress=False)
    return folder


class Truthful(DetectorNetwork):
    """Answers with what is true of the cells of one image, whatever it is shown."""

    def __init__(self, size: DetectorSize, cells: Cells):
        super().__init__(size)
        self.cells = cells

    def forward(self, channels: Tensor) -> tuple[Tensor, Tensor]:
        own = self.cells
        logits = 9.0 * torch.nn.functional.one_hot(own.category, len(self.size.categories) + 1).movedim(-1, 1).float()
        return logits, torch.cat([own.offset, own.size[:, None]], dim=1)


def truthful(folder: Path, view: int, monkeypatch: pytest.MonkeyPatch) -> Detector:
    """A detector that knows a view, seen as it is."""
    import artperl.training.scene_cells as module

    monkeypatch.setattr(module, "_ZOOM", (1.0, 1.0))
    monkeypatch.setattr(module, "_WINDOW_CELLS", (90, 160))
    categories = SceneDataset(folder).categories
    for seed in range(64):  # one of which does not mirror it
        data = SceneCells([folder], categories, 1, seed, 640)
        order = np.random.default_rng([seed, 0, 0]).permutation(2)
        if order[0] == view:
            cells = data[0]
            ids = SceneDataset(folder)[view].instance_ids[2::4, 2::4]
            if ((cells.category[0].numpy() > 0) == (ids < 4)).all():
                return Detector(Truthful(DetectorSize(categories, 8, 1), cells))
    raise AssertionError("no seed shows the view as it is")


@pytest.mark.parametrize("view", [0, 1])
def test_true_cells_give_the_true_masks_and_categories(
    folder: Path, view: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = SceneDataset(folder)[view]
    found = truthful(folder, view, monkeypatch)(None, record.depth, record.camera.K)
    large = [i for i in range(4) if (record.instance_ids == i).sum() > 400]
    assert len(found) == len(large)
    for own in found:
        masks = [own.mask & (record.instance_ids == i) for i in large]
        i = large[int(np.argmax([m.sum() for m in masks]))]
        truth = record.instance_ids == i
        assert own.category == record.entry.objects[i].category
        assert (own.mask & truth).sum() / (own.mask | truth).sum() > 0.75
    assert not np.sum([own.mask for own in found], axis=0).max() > 1


def test_true_cells_have_no_loss_and_wrong_ones_have(folder: Path) -> None:
    cells = SceneCells([folder], SceneDataset(folder).categories, 2, 0, 320)[0]
    truth = Truthful(DetectorSize(SceneDataset(folder).categories, 8, 1), cells)
    logits, told = truth(cells.channels)
    losses, figures = detector_losses(logits, told, cells)
    assert figures == {"right": 1.0, "off": 0.0}
    assert all(value < 0.01 for value in losses.values())
    _, figures = detector_losses(logits, told + 1.0, cells)
    assert figures["off"] > 0.1


def test_batches_depend_on_their_number_alone(folder: Path) -> None:
    categories = SceneDataset(folder).categories
    first, again = (SceneCells([folder], categories, 2, 3, 160) for _ in range(2))
    again[0]
    for name, value in vars(first[5]).items():
        assert torch.equal(value, getattr(again[5], name))
    assert not torch.equal(first[5].channels, first[6].channels)


def test_a_window_shows_what_the_whole_image_shows_there(folder: Path) -> None:
    categories = SceneDataset(folder).categories
    whole, windows = SceneCells([folder], categories, 1, 2, 640), SceneCells([folder], categories, 4, 2, 640)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("artperl.training.scene_cells._WINDOW_CELLS", (90, 160))
        image = whole[0]
    window = windows[0]
    assert window.channels.shape == (4, 8, 192, 320)
    assert (window.category.flatten(1) > 0).any(dim=1).all()
    places = image.category.unfold(1, 48, 1).unfold(2, 80, 1)
    ((row, column),) = (places[0] == window.category[0]).flatten(2).all(dim=2).nonzero()[:1].tolist()
    assert torch.equal(image.channels[0, :, 4 * row : 4 * row + 192, 4 * column : 4 * column + 320], window.channels[0])


def test_a_stopped_training_goes_on_with_the_same_result(folder: Path, tmp_path: Path) -> None:
    options = scene_options([folder], steps=4, batch_size=2, width=8, blocks=1, columns=160)
    whole = train_detector(options, tmp_path / "whole", 0, progress=False)

    import artperl.training.detector as module

    class Stopping(module.Stop):
        def __init__(self) -> None:
            self.asked = True

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "Stop", Stopping)
        for _ in range(2):
            with pytest.raises(KeyboardInterrupt):
                train_detector(options, tmp_path / "parts", 0, progress=False)
    parts = train_detector(options, tmp_path / "parts", 1, progress=False)
    for name, value in whole.network.state_dict().items():
        assert torch.equal(value, parts.network.state_dict()[name]), name
    read = load_detector(tmp_path / "whole")
    assert read.categories == ("box", "scissors", "stapler")
    record = SceneDataset(folder)[0]
    assert isinstance(read(record.rgb, record.depth, record.camera.K), list)
    with pytest.raises(DatasetError, match="steps"):
        train_detector(scene_options([folder], steps=5, batch_size=2, width=8, blocks=1, columns=160),
                       tmp_path / "whole", 0, progress=False)  # fmt: skip


def test_damaged_and_forged_detectors_are_refused(tmp_path: Path) -> None:
    good = Detector(DetectorNetwork(DetectorSize(("box",), 8, 1)))
    save_detector(good, tmp_path / "d", {})
    assert load_detector(tmp_path / "d").categories == ("box",)
    settings = tmp_path / "d" / "detector.json"
    text = settings.read_text()
    for wrong in ({"width": 10**9}, {"width": 16}, {"categories": []}, {"width": "8"}):
        told = json.loads(text)
        settings.write_text(json.dumps({**told, "size": {**told["size"], **wrong}}))
        with pytest.raises(DatasetError):
            load_detector(tmp_path / "d")
    settings.write_text("{}")
    with pytest.raises(DatasetError, match="damaged"):
        load_detector(tmp_path / "d")
    with pytest.raises(DatasetError, match="train-detector"):
        load_detector(tmp_path / "nothing")


def test_perfect_masks_have_full_precision_and_no_masks_none(folder: Path) -> None:
    scenes = SceneDataset(folder)
    perfect = realistic_detections(scenes, NO_FLAWS)
    table = mask_precision(scenes, perfect)
    assert all(own["AP"] == pytest.approx(1.0) for own in table.values())
    assert table["mean"]["objects"] == sum(o.visible_fraction >= 0.1 for e in scenes.entries for o in e.objects)
    assert mask_precision(scenes, [])["mean"]["AP50"] == 0.0
    wrong = [{**own, "category_id": 1 + own["category_id"] % 3} for own in perfect]
    assert mask_precision(scenes, wrong)["mean"]["AP50"] == 0.0


def test_an_image_and_its_depth_are_all_that_the_program_needs(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from PIL import Image

    save_detector(Detector(DetectorNetwork(DetectorSize(("laptop",), 8, 1))), tmp_path / "d", {})
    MakeDetections(folder, tmp_path / "found.json", str(tmp_path / "d")).run()
    assert "AP50" in capsys.readouterr().out
    with pytest.raises(ConfigError, match="leave them out"):
        MakeDetections(folder, tmp_path / "found.json", str(tmp_path / "d"), seed=3).run()
    record = SceneDataset(folder)[0]
    np.save(tmp_path / "depth.npy", record.depth)
    np.savetxt(tmp_path / "K.txt", record.camera.K)
    Image.new("RGB", (640, 360), (90, 90, 90)).save(tmp_path / "image.png")
    Estimate((tmp_path / "image.png", tmp_path / "depth.npy"), intrinsics=tmp_path / "K.txt",
             detector=str(tmp_path / "d"), out=tmp_path / "out.json").run()  # fmt: skip
    assert json.loads((tmp_path / "out.json").read_text())["notes"][0].startswith("objects are found by <Detector")
