"""Exported finishes are what the renderers draw, and simulators read them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from artsim.export import export
from artsim.export.looks import draw_finish
from artsim.export.options import ExportOptions
from artsim.families import make
from artsim.loading.urdf import load
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import as_robot
from tests.conftest import installed

Exported = tuple[ArticulatedObject, Path]
OPTIONS = ExportOptions(materials=True)


@pytest.fixture(scope="module", params=["laptop", "storage_furniture", "faucet"])
def exported(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Exported:
    obj, folder = make(request.param, 0), tmp_path_factory.mktemp("exported")
    export(obj, folder, ["urdf", "mjcf", "usd"], options=OPTIONS)
    return obj, folder


@pytest.mark.slow
def test_looks_cover_the_surface_of_each_part(exported: Exported) -> None:
    obj, _ = exported
    finish = draw_finish(as_robot(obj))
    for k, part in enumerate(obj.parts):
        area = sum(trimesh.Trimesh(look.vertices, look.faces, process=False).area for look in finish.looks[part.name])
        assert area == pytest.approx(trimesh.Trimesh(part.vertices, part.faces, process=False).area, rel=1e-4), k
        for look in finish.looks[part.name]:
            assert np.isfinite(look.uv).all()
            np.testing.assert_allclose(np.linalg.norm(look.normals, axis=1), 1.0, atol=1e-5)
    again = draw_finish(as_robot(obj))
    assert again.pictures == finish.pictures


def test_files_with_finishes_load_as_those_without(exported: Exported, tmp_path: Path) -> None:
    obj, folder = exported
    export(obj, tmp_path, ["urdf"])
    plain, finished = load(tmp_path), load(folder)
    assert finished.repairs == plain.repairs
    np.testing.assert_allclose(finished.part_bounds, plain.part_bounds, atol=2e-7)
    assert finished.tree == plain.tree


def test_mtl_files_name_pictures_that_are_there(exported: Exported) -> None:
    obj, folder = exported
    finish = draw_finish(as_robot(obj))
    colours = set()
    for part in obj.parts:
        scene = trimesh.load_scene(folder / "meshes" / f"{part.name}.obj")
        for mesh in scene.geometry.values():
            material = mesh.visual.material
            colours.add(tuple(material.diffuse[:3].tolist()))
            if material.image is not None:
                ours = next(m.texture for m in finish.materials.values() if m.texture is not None)
                assert np.asarray(material.image.convert("RGB")).shape == ours.shape
    assert len(colours) >= 1
    assert {path.name for path in (folder / "meshes").glob("*.png")} == set(finish.pictures)


def test_mujoco_shows_each_material(exported: Exported) -> None:
    mujoco = installed("mujoco")
    obj, folder = exported
    finish = draw_finish(as_robot(obj))
    model = mujoco.MjModel.from_xml_path(str(folder / "mobility.xml"))
    assert model.nmat == len(finish.materials)
    assert model.ntex == len(finish.pictures)
    shown = [g for g in range(model.ngeom) if model.geom_group[g] == 2]
    assert len(shown) == sum(map(len, finish.looks.values()))
    assert all(model.geom_matid[g] >= 0 for g in shown)
    for name, material in finish.materials.items():
        if material.texture is None:
            np.testing.assert_allclose(model.mat_rgba[model.material(name).id][:3], material.colour, atol=1e-6)


def test_usd_binds_every_face_to_a_material_and_passes_the_validators(exported: Exported) -> None:
    installed("pxr")
    from pxr import Usd, UsdGeom, UsdShade, UsdValidation

    obj, folder = exported
    stage = Usd.Stage.Open(str(folder / "mobility.usda"))
    for part in obj.parts:
        mesh = UsdGeom.Mesh(stage.GetPrimAtPath(stage.GetDefaultPrim().GetPath().AppendPath(f"{part.name}/visual")))
        count = len(mesh.GetFaceVertexCountsAttr().Get())
        subsets = UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets()
        bound = sorted(i for subset in subsets for i in subset.GetIndicesAttr().Get())
        assert bound == list(range(count))
        for subset in subsets:
            material, _ = UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()
            assert material
        places = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
        assert len(places.Get()) == 3 * count
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    faults = [e for e in context.Validate(stage) if e.GetType() == UsdValidation.ValidationErrorType.Error]
    assert faults == [], [e.GetMessage() for e in faults]


@pytest.mark.slow
def test_textures_are_files_of_usd_too(tmp_path: Path) -> None:
    obj = make("storage_furniture", 0)
    export(obj, tmp_path, ["usd"], options=OPTIONS)
    assert {path.name for path in (tmp_path / "meshes").iterdir()} == set(draw_finish(as_robot(obj)).pictures)
