"""SimReady packages pass the field's own validator, and Newton reads the joints that other simulators read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import artsim
from artsim.export import FORMATS, export, prepare
from artsim.export.semantic_labels import CATEGORIES, OBJECT, PARTS, category_item, part_item
from artsim.export.simready import metadata
from artsim.families import FAMILIES
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import as_robot
from tests.conftest import installed, valve

PROFILE = "Robotics-Prop"


def package(obj: ArticulatedObject, folder: Path) -> Path:
    """The USD file of an object's package."""
    export(obj, folder, ["simready"])
    (file,) = (folder / FORMATS["simready"]).rglob("*.usdc")
    return file


@pytest.mark.slow
@pytest.mark.parametrize("category", ["refrigerator", "cart", "phone", "robot_arm"])
def test_a_package_passes_every_requirement_of_the_profile(category: str, tmp_path: Path) -> None:
    installed("simready")
    import simready.validate as validator

    validator.initialize(rules_and_requirements_paths=[], features_paths=[], profiles_paths=[])
    file = package(artsim.make(category, 0), tmp_path)
    found = validator.validate_asset(validator.AssetValidationConfig(asset_path=str(file), profile_id=PROFILE))
    assert found is not None
    assert len(found.features_summary) > 10
    failed = {name: said for name, said in found.features_summary.items() if said["blocking_failure"]}
    assert not failed
    (file.parent / ".thumbs").rename(file.parent / "hidden")  # the validator does look
    found = validator.validate_asset(validator.AssetValidationConfig(asset_path=str(file), profile_id=PROFILE))
    assert [said for said in found.features_summary.values() if said["blocking_failure"]]


def test_a_real_object_passes_too_and_its_picture_shows_it(partnet_dir: Path, tmp_path: Path) -> None:
    installed("simready")
    import simready.validate as validator

    validator.initialize(rules_and_requirements_paths=[], features_paths=[], profiles_paths=[])
    folder = next(path for path in sorted((partnet_dir / "Refrigerator").iterdir()) if path.is_dir())
    obj = prepare(artsim.load(folder), "hull")
    file = package(obj, tmp_path)
    found = validator.validate_asset(validator.AssetValidationConfig(asset_path=str(file), profile_id=PROFILE))
    assert not [said for said in found.features_summary.values() if said["blocking_failure"]]
    (thumbnail,) = file.parent.glob(".thumbs/256x256/*.png")
    picture = np.asarray(Image.open(thumbnail))
    assert picture.shape == (256, 256, 3)
    assert 0.1 < (picture < 250).any(axis=2).mean() < 0.95
    assert str(partnet_dir) not in str(metadata(as_robot(obj)))  # no folder of this machine


@pytest.mark.slow
def test_bytes_depend_on_the_object_and_the_date_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed("pxr")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    first, second = (package(artsim.make("drawer", 3), tmp_path / name) for name in "ab")
    assert first.read_bytes() == second.read_bytes()
    assert metadata(as_robot(artsim.make("drawer", 3)))["usd_date_generated"] == "1970-01-02"


def test_one_file_holds_the_object_with_its_textures(tmp_path: Path) -> None:
    installed("pxr")
    from pxr import Sdf, Usd

    obj = artsim.make("drawer", 3)
    export(obj, tmp_path, ["usdz"], options=artsim.export.ExportOptions(materials=True))
    file = tmp_path / FORMATS["usdz"]
    assert any(name.endswith(".png") for name in Sdf.ZipFile.Open(str(file)).GetFileNames())
    assert Usd.Stage.Open(str(file)).GetDefaultPrim().GetName() == "drawer_3"
    loaded = artsim.load(file)
    assert [part.name for part in loaded.parts] == [part.name for part in obj.parts]
    np.testing.assert_allclose(loaded.tree.limits[1:], obj.tree.limits[1:], atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("obj", [valve(), artsim.make("drawer", 3), artsim.make("laptop", 1)], ids=lambda o: o.category)
def test_newton_reads_limits_friction_speeds_efforts_masses_and_mimics(obj: ArticulatedObject, tmp_path: Path) -> None:
    newton = installed("newton")
    export(obj, tmp_path, ["usd"])
    read, robot = newton.ModelBuilder(), as_robot(obj)
    read.add_usd(str(tmp_path / FORMATS["usd"]))
    first = read.joint_label.index(next(name for name in read.joint_label if name.endswith(robot.joints[0].name)))
    names = [name.rsplit("/", 1)[-1] for name in read.joint_label[first:]]
    assert sorted(names) == sorted(joint.name for joint in robot.joints)
    joints = {joint.name: joint for joint in robot.joints}
    for values, wanted in (
        (read.joint_limit_upper, [joints[name].upper for name in names]),
        (read.joint_limit_lower, [joints[name].lower for name in names]),
        (read.joint_friction, [joints[name].friction for name in names]),
        (read.joint_velocity_limit, [joints[name].velocity for name in names]),
        (read.joint_effort_limit, [joints[name].effort for name in names]),
        (read.joint_target_kd, [joints[name].damping for name in names]),
    ):
        finite = np.isfinite(wanted)
        np.testing.assert_allclose(np.array(values)[finite], np.array(wanted)[finite], rtol=1e-5, atol=1e-9)
    masses = dict(zip((name.rsplit("/", 1)[-1] for name in read.body_label), read.body_mass, strict=True))
    assert masses == pytest.approx({link.name: link.inertia.mass for link in robot.links}, rel=1e-5)


def test_categories_and_parts_have_items_of_wikidata() -> None:
    assert all(item[0] == "Q" and item[1:].isdigit() for item in (*CATEGORIES.values(), *PARTS.values()))
    assert CATEGORIES.keys() <= FAMILIES.keys()
    assert len(CATEGORIES) == 50
    assert category_item("refrigerator") == "Q37828" != category_item("gizmo") == OBJECT
    assert part_item("door_left") == part_item("door") == PARTS["door"]
    assert part_item("gizmo") is None
