"""Objects that give trouble: each is named, and none stops a run that may leave it out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.datasets.sample_options import SampleOptions, check_visible
from artsim.datasets.verify import verify
from artsim.drawing.inspect import describe
from artsim.errors import AssetError, RenderError
from artsim.families import make
from artsim.loading.sources import Source, family_sources, find_sources
from artsim.model.draws import ViewOptions, sample_view
from artsim.model.kinematics import Array
from tests.artsim.datasets.troublesome import Troublesome, digests
from tests.conftest import ASSETS, BOX_LAPTOP, rigid

quick = pytest.mark.usefixtures("quick_workers")

TROUBLES = {
    "kills": "a worker process died of it (SIGKILL: out of memory?)",
    "crashes": "a worker process died of it (SIGABRT)",
    "leaves": "cannot be loaded (SystemExit: 3)",
    "runs out of memory": "cannot be loaded (MemoryError: )",
    "recurses": "cannot be loaded (RecursionError: ",
}
OPTIONS = SampleOptions(num_points=32)


def generate(sources: list[Source], out: Path, **more: object) -> artsim.datasets.generate.GenerateResult:
    options = {"sample": OPTIONS, "progress": False, "splits": (1, 0, 0), **more}
    return artsim.generate(sources, out, 12, **options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_no_object_stops_a_run_that_may_leave_it_out(tmp_path: Path) -> None:
    """The others are what they are without it, whatever it does to its process."""
    good = family_sources(["laptop"], 3)
    troublesome: list[Source] = [Troublesome(name, f"{n:064x}") for n, name in enumerate(TROUBLES)]  # type: ignore[misc]
    mixed = [good[0], *troublesome[:3], good[1], *troublesome[3:], good[2]]
    made = generate(mixed, tmp_path / "mixed", workers=2, skip_broken=True)
    assert len(made.left_out) == len(TROUBLES)
    for name, why in TROUBLES.items():
        (reason,) = (reason for reason in made.left_out if reason.startswith(f"{name}: "))
        assert why in reason
    generate(good, tmp_path / "good", workers=1)
    alone, beside = digests(tmp_path / "good"), digests(tmp_path / "mixed")
    for description in ("plan.json", "dataset.json"):  # which name what was left out
        assert alone.pop(description) != beside.pop(description)
    assert alone == beside
    assert generate(mixed, tmp_path / "mixed", skip_broken=True).made == 0


@quick
def test_an_object_that_stalls_or_ends_its_process_is_named(tmp_path: Path) -> None:
    sources: list[Source] = [*family_sources(["laptop"], 1), Troublesome("stalls")]  # type: ignore[list-item]
    with pytest.raises(
        AssetError, match=r"1 of 2 objects do not load: stalls: it took over 2 s\. Fix: .*--skip-broken"
    ):
        generate(sources, tmp_path / "out", workers=1, load_limit=2.0)
    assert len(list((tmp_path / "out").glob(".parts/objects/*.npz"))) == 1  # the next run has it


def one_sided(rng: np.random.Generator, obj: artsim.ArticulatedObject, q: Array) -> artsim.Camera:
    """Looks away from drawers."""
    if obj.category == "drawer":
        return artsim.Camera.look_at([2, 0, 0], [3, 0, 0], 64, 48)
    return sample_view(obj, q, ViewOptions(), rng)


@quick
def test_an_object_that_no_view_sees_is_left_out_before_a_sample_is_made(tmp_path: Path) -> None:
    options = replace(OPTIONS, views=ViewOptions(custom="tests.artsim.datasets.test_worker_pool:one_sided"))
    with pytest.raises(RenderError, match="0 of 50 drawn views see the object"):
        check_visible(make("drawer", 0), options, 0, "ab" * 32)
    check_visible(make("laptop", 0), options, 0, "ab" * 32)
    sources: list[Source] = list(family_sources(["laptop", "drawer"], 1))
    made = generate(sources, tmp_path / "out", sample=options, workers=1, skip_broken=True)
    assert len(made.objects) == 1
    assert made.left_out == (
        "drawer:0: 0 of 50 drawn views see the object. Fix: correct the view options, or the object",
    )


@pytest.fixture
def repaired(tmp_path: Path) -> list[Source]:
    """A sound object, one with swapped limits, one that cannot move."""
    for name, text in {
        "sound": BOX_LAPTOP,
        "swapped": BOX_LAPTOP.replace('lower="0" upper="2.2"', 'lower="2.2" upper="0"'),
        "rigid": BOX_LAPTOP.replace('type="revolute"', 'type="fixed"'),
    }.items():
        (tmp_path / "files" / name).mkdir(parents=True)
        (tmp_path / "files" / name / "mobility.urdf").write_text(text)
    return list(find_sources([tmp_path / "files"]))


@quick
def test_what_was_repaired_is_stored_said_and_refused_if_asked(repaired: list[Source], tmp_path: Path) -> None:
    made = generate(repaired, tmp_path / "out", workers=1)
    by_name = {planned.source: planned for planned in made.objects}
    assert by_name["files/swapped/mobility.urdf"].repairs == (("joint 'hinge'", "limits 2.2 and 0 swapped"),)
    assert by_name["files/sound/mobility.urdf"].repairs == ()
    assert by_name["files/rigid/mobility.urdf"].repairs == ()  # merging fixed joints changes nothing: a note
    assert [planned.source for planned in made.objects if planned.rigid] == ["files/rigid/mobility.urdf"]
    text = str(artsim.open_dataset(made.folder))
    assert "1 object has no moving joint: files/rigid/mobility.urdf" in text
    assert "1 of 3 objects repaired while loading, most often:" in text
    assert "1 x  joint 'hinge': limits 2.2 and 0 swapped  (files/swapped/mobility.urdf)" in text
    (command,) = (line for line in text.splitlines() if line.startswith("details: artsim inspect "))
    assert "limits 2.2 and 0 swapped" in describe(artsim.load(command.split()[-1]))
    assert verify(made.folder, progress=False) == []

    with pytest.raises(AssetError, match=r"\(--strict\): files/swapped/mobility.urdf: repaired while loading: joint"):
        generate(repaired, tmp_path / "strict", workers=1, strict=True)
    strict = generate(repaired, tmp_path / "strict", workers=1, strict=True, skip_broken=True)
    assert len(strict.objects) == 2, strict.left_out
    assert "swapped/mobility.urdf: repaired while loading" in strict.left_out[0]


def test_a_rigid_object_says_so() -> None:
    assert "no joint can move: the object is rigid" in describe(artsim.load(ASSETS / "quirks" / "zero_axis"))
    assert "no joint can move" not in describe(artsim.load(ASSETS / "laptop"))
    import trimesh

    assert rigid(trimesh.creation.box()).is_rigid


@quick
def test_a_description_fits_a_screen(tmp_path: Path) -> None:
    sources: list[Source] = [*find_sources([ASSETS / "quirks"]), *family_sources(["box", "fan"], 2)]
    made = generate(sources, tmp_path / "out", workers=2, skip_broken=True)
    text = str(artsim.open_dataset(made.folder, "train"))
    assert len(text.splitlines()) <= 24
    assert max(map(len, text.splitlines())) <= 240
    for word in ("12 samples", "train 12, val 0, test 0", "box 2", "32 points, raycast, noise none", "artsim 0.1.0"):
        assert word in text
    assert repr(artsim.open_dataset(made.folder)).startswith("<Dataset ")
