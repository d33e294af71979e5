"""USD with UsdPhysics: rigid bodies, joints, masses and collision shapes, ready for Isaac Sim and its like."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.extras import require_extra
from artsim.common.names import unused_name
from artsim.export.looks import NO_FINISH, Finish, Look
from artsim.export.mjcf import STOP, STOP_TIME, rotor
from artsim.export.options import ExportOptions
from artsim.export.semantic_labels import add_labels
from artsim.model.details import GRIPS
from artsim.model.kinematics import Array
from artsim.model.robot import BoxShape, Link, LinkJoint, MeshShape, Robot

STATIC_FRICTION, SLIDING_FRICTION = 0.5, 0.4
"""Of every surface: lacquered wood and plastic on rubber and steel have 0.3 to 0.6."""
STOP_SHARE = 0.005
"""Of its range, how far full effort presses a joint into its stop at most."""
APPROACH = 0.06
"""Metres before a handle at which the line of a gripper's approach begins."""


def usd_stage(
    robot: Robot, options: ExportOptions, finish: Finish = NO_FINISH, pictures: str = "./meshes", labelled: bool = False
) -> Any:
    """The object as a USD stage in memory.

    One prim for each link, in metres, kilograms and degrees as UsdPhysics has it, Z up. A fixed base hangs on a fixed
    joint to the world, and the articulation root is the object's prim; the articulation root of a free one is its root
    link, to which Isaac Lab can add a fixed joint (``fix_root_link``). UsdPhysics has no velocity limits and no
    friction: these are attributes of the schemas of PhysX and Newton. Springs are drives; that they are springs, and
    latches, say ``artsim:spring``, ``hold`` and ``holdOver`` (radians, metres). UsdPhysics knows no joints that follow
    others: such a joint carries ``artsim:mimic:joint``, ``multiplier`` and ``offset`` and, where it follows one of
    its own kind, Newton's and PhysX's mimic.

    Parameters
    ----------
    robot : Robot
    options : ExportOptions
    finish : Finish
    pictures : str
        Folder of the textures, as the layer names it.
    labelled : bool
        Write semantic labels: category, parts and materials.
    """
    with require_extra("USD files"):
        from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    name = Tf.MakeValidIdentifier(robot.name)
    root = UsdGeom.Xform.Define(stage, f"/{name}")
    stage.SetDefaultPrim(root.GetPrim())
    Usd.ModelAPI(root.GetPrim()).SetKind(Kind.Tokens.component)
    paths = [root.GetPath().AppendChild(link.name) for link in robot.links]
    for link, path in zip(robot.links, paths, strict=True):
        _add_link(stage, path, link)
    substances = {_add_friction(stage, root.GetPath(), robot): ""}
    substances |= _add_finish(stage, root.GetPath(), robot, finish, pictures)
    free = options.base == "free"
    UsdPhysics.ArticulationRootAPI.Apply(stage.GetPrimAtPath(paths[0]) if free else root.GetPrim())
    if not free:
        held = unused_name("fixed_base", {link.name for link in robot.links})
        base = UsdPhysics.FixedJoint.Define(stage, root.GetPath().AppendChild(held))
        base.CreateBody1Rel().SetTargets([paths[0]])
        base.CreateLocalPos0Attr(Gf.Vec3f(*robot.links[0].origin.tolist()))
        base.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    scope = root.GetPath().AppendChild(unused_name("joints", {link.name for link in robot.links}))
    if robot.joints:
        UsdGeom.Scope.Define(stage, scope)
    for joint in robot.joints:
        _add_joint(stage, scope.AppendChild(joint.name), joint, robot, paths)
    slides = {joint.name: joint.type == "prismatic" for joint in robot.joints}
    for joint in robot.joints:
        if joint.mimic is not None:
            source, multiplier, offset = joint.mimic
            prim = stage.GetPrimAtPath(scope.AppendChild(joint.name))
            prim.CreateRelationship("artsim:mimic:joint").SetTargets([scope.AppendChild(source)])
            prim.CreateAttribute("artsim:mimic:multiplier", Sdf.ValueTypeNames.Double).Set(multiplier)
            prim.CreateAttribute("artsim:mimic:offset", Sdf.ValueTypeNames.Double).Set(offset)
            if slides[source] == slides[joint.name]:
                _add_mimic(prim, scope.AppendChild(source), slides[source], multiplier, offset)
    if labelled:
        add_labels(stage, robot, paths, substances)
    return stage


def _add_link(stage: Any, path: Any, link: Link) -> None:
    from pxr import Gf, UsdGeom, UsdPhysics, Vt

    xform = UsdGeom.Xform.Define(stage, path)
    xform.AddTranslateOp().Set(Gf.Vec3d(*link.origin.tolist()))
    UsdPhysics.RigidBodyAPI.Apply(xform.GetPrim())
    moments, axes = link.inertia.principal()
    mass = UsdPhysics.MassAPI.Apply(xform.GetPrim())
    mass.CreateMassAttr(link.inertia.mass)
    mass.CreateCenterOfMassAttr(Gf.Vec3f(*(link.inertia.center - link.origin).tolist()))
    mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*moments.tolist()))
    mass.CreatePrincipalAxesAttr(_quaternion(axes))
    seen = None if link.visual is None else _add_mesh(stage, path.AppendChild("visual"), link, link.visual)
    for detail in link.details:
        frame = UsdGeom.Xform.Define(stage, path.AppendChild(detail.name))
        T = detail.T_rest_detail.copy()
        T[:3, 3] -= link.origin
        frame.AddTransformOp().Set(Gf.Matrix4d(T.T.tolist()))
        if detail.label in GRIPS:  # in the middle of the handle, from where a gripper comes
            line = UsdGeom.BasisCurves.Define(stage, path.AppendChild(f"grasp_identifier_{detail.name}"))
            ends = np.stack([T[:3, 3] + (0.5 * detail.size[0] + APPROACH) * T[:3, 0], T[:3, 3]])
            points = Vt.Vec3fArray.FromNumpy(ends.astype(np.float32))
            line.CreatePointsAttr(points)
            line.CreateWidthsAttr([0.002])
            line.CreateExtentAttr(UsdGeom.Curves.ComputeExtent(points, line.GetWidthsAttr().Get()))
            line.CreateCurveVertexCountsAttr([2])
            line.CreateTypeAttr(UsdGeom.Tokens.linear)
            line.SetWidthsInterpolation(UsdGeom.Tokens.constant)
            line.CreatePurposeAttr(UsdGeom.Tokens.guide)
    for i, shape in enumerate(link.collision):
        here = path.AppendChild(f"collision_{i}")
        if any(_is_same(shape, other) for other in link.collision[:i]):
            continue
        if isinstance(shape, BoxShape):
            collider: Any = UsdGeom.Cube.Define(stage, here)
            collider.CreateSizeAttr(1.0)
            collider.CreateExtentAttr([(-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)])
            collider.AddTranslateOp().Set(Gf.Vec3d(*(shape.center - link.origin).tolist()))
            collider.AddScaleOp().Set(Gf.Vec3f(*shape.size.tolist()))
        else:
            shown = link.visual is not None and _is_same(shape, link.visual)  # one mesh is seen and collides
            collider = seen if shown else _add_mesh(stage, here, link, shape)
            UsdPhysics.MeshCollisionAPI.Apply(collider.GetPrim()).CreateApproximationAttr("convexHull")
            collider.GetPrim().AddAppliedSchema("NewtonMeshCollisionAPI")
        UsdPhysics.CollisionAPI.Apply(collider.GetPrim())
        for schema in ("NewtonCollisionAPI", "MjcCollisionAPI"):
            collider.GetPrim().AddAppliedSchema(schema)
        if collider is not seen:
            collider.CreatePurposeAttr(UsdGeom.Tokens.guide)


def _add_friction(stage: Any, root: Any, robot: Robot) -> Any:
    """One physics material for all that collides; its path."""
    from pxr import UsdPhysics, UsdShade

    path = root.AppendChild(unused_name("surface", {link.name for link in robot.links}))
    material = UsdShade.Material.Define(stage, path)
    physics = UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    physics.CreateStaticFrictionAttr(STATIC_FRICTION)
    physics.CreateDynamicFrictionAttr(SLIDING_FRICTION)
    physics.CreateRestitutionAttr(0.0)
    for prim in stage.Traverse():
        if prim.HasAPI(UsdPhysics.CollisionAPI):
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(material, UsdShade.Tokens.weakerThanDescendants, "physics")
    return path


def _is_same(shape: BoxShape | MeshShape, other: BoxShape | MeshShape) -> bool:
    """Whether two meshes have the same corners and as many faces, in any order."""
    if not (isinstance(shape, MeshShape) and isinstance(other, MeshShape) and len(shape.faces) == len(other.faces)):
        return False
    first, second = (np.unique(np.round(mesh.vertices, 7), axis=0) for mesh in (shape, other))
    return np.array_equal(first, second)


def _add_finish(stage: Any, root: Any, robot: Robot, finish: Finish, pictures: str) -> dict[Any, str]:
    """Materials, and meshes with places on textures, each face in the subset of its material; substances by path."""
    from pxr import Sdf, UsdGeom, UsdShade, Vt

    if not finish.materials:
        return {}
    scope = root.AppendChild(unused_name("Looks", {link.name for link in robot.links}))
    UsdGeom.Scope.Define(stage, scope)
    for name, material in finish.materials.items():
        made = UsdShade.Material.Define(stage, scope.AppendChild(name))
        shader = UsdShade.Shader.Define(stage, made.GetPath().AppendChild("surface"))
        shader.CreateIdAttr("UsdPreviewSurface")
        colour = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
        colour.Set(tuple(_linear(np.asarray(material.colour)).tolist()))
        shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(material.roughness)
        shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(material.metallic)
        if material.emission:
            sent = tuple((material.emission * _linear(np.asarray(material.colour))).tolist())
            shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set(sent)
        if material.texture is not None:
            place = UsdShade.Shader.Define(stage, made.GetPath().AppendChild("place"))
            place.CreateIdAttr("UsdPrimvarReader_float2")
            place.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
            out = place.CreateOutput("result", Sdf.ValueTypeNames.Float2)
            texture = UsdShade.Shader.Define(stage, made.GetPath().AppendChild("texture"))
            texture.CreateIdAttr("UsdUVTexture")
            texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(f"{pictures}/{name}.png")
            texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(out)
            for side in ("wrapS", "wrapT"):
                texture.CreateInput(side, Sdf.ValueTypeNames.Token).Set("repeat")
            texture.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB")
            colour.ConnectToSource(texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
        made.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    for link in robot.links:
        looks = finish.looks.get(link.name, ())
        if not looks:
            continue
        mesh = _add_mesh(stage, root.AppendChild(link.name).AppendChild("visual"), link, _joined(link, looks))
        laid = np.concatenate([look.uv[look.faces.ravel()] for look in looks]).astype(np.float32)
        places = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
            "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
        )
        places.Set(Vt.Vec2fArray.FromNumpy(laid))
        normals = np.concatenate([look.normals[look.faces.ravel()] for look in looks]).astype(np.float32)
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals))
        mesh.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
        binding, first = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()), 0
        for look in looks:
            faces = Vt.IntArray.FromNumpy(np.arange(first, first + len(look.faces), dtype=np.int32))
            first += len(look.faces)
            subset = binding.CreateMaterialBindSubset(look.material, faces)
            material = UsdShade.Material(stage.GetPrimAtPath(scope.AppendChild(look.material)))
            UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)
    return {scope.AppendChild(name): material.substance for name, material in finish.materials.items()}


def _joined(link: Link, looks: Sequence[Look]) -> MeshShape:
    """The surfaces of all materials as one mesh, with each corner once."""
    corners = np.concatenate([look.vertices[look.faces.ravel()] for look in looks])
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    return MeshShape(link.name, vertices, index.reshape(-1, 3).astype(np.int32))


def _linear(srgb: Array) -> Array:
    """Colours without the curve of sRGB, as UsdPreviewSurface takes them."""
    low: Array = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return low


def _add_mesh(stage: Any, path: Any, link: Link, shape: MeshShape) -> Any:
    from pxr import UsdGeom, Vt

    points = (shape.vertices - link.origin).astype(np.float32)
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(shape.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(shape.faces.ravel().astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateExtentAttr([tuple(points.min(axis=0).tolist()), tuple(points.max(axis=0).tolist())])
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(face_normals(points, shape.faces)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.uniform)
    return mesh


def face_normals(vertices: NDArray[np.float32], faces: NDArray[np.int32]) -> NDArray[np.float32]:
    """Unit normals (F, 3) of triangles; up for those without area."""
    a, b, c = vertices.astype(np.float64)[faces].swapaxes(0, 1)
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    up = np.array([0.0, 0.0, 1.0])
    unit: NDArray[np.float32] = np.where(length > 0, normals / np.where(length > 0, length, 1.0), up).astype(np.float32)
    return unit


def _add_joint(stage: Any, path: Any, joint: LinkJoint, robot: Robot, paths: list[Any]) -> None:
    from pxr import Gf, Sdf, UsdPhysics

    slides = joint.type == "prismatic"
    unit = 1.0 if slides else 180.0 / np.pi
    schema = UsdPhysics.PrismaticJoint if slides else UsdPhysics.RevoluteJoint
    added = schema.Define(stage, path)
    added.CreateBody0Rel().SetTargets([paths[joint.parent]])
    added.CreateBody1Rel().SetTargets([paths[joint.child]])
    added.CreateLocalPos0Attr(Gf.Vec3f(*(robot.links[joint.child].origin - robot.links[joint.parent].origin).tolist()))
    added.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    turn = _quaternion(frame_along(joint.axis))
    added.CreateLocalRot0Attr(turn)
    added.CreateLocalRot1Attr(turn)
    added.CreateAxisAttr("X")
    if np.isfinite(joint.lower):
        added.CreateLowerLimitAttr(joint.lower * unit)
        added.CreateUpperLimitAttr(joint.upper * unit)
    stop, blow = _stop(joint)
    drive = UsdPhysics.DriveAPI.Apply(added.GetPrim(), "linear" if slides else "angular")
    drive.CreateDampingAttr(joint.damping / unit)
    drive.CreateStiffnessAttr(joint.spring / unit)
    drive.CreateTargetPositionAttr(0.0)
    drive.CreateTypeAttr("force")
    drive.CreateMaxForceAttr(joint.effort)
    # Schemas of PhysX and Newton are not part of usd-core: they are named, and their attributes written, as these read
    # them. Damping is that of the drive in both.
    prim, axis = added.GetPrim(), "linear" if slides else "angular"
    for schema_name, name, value in (
        ("PhysxJointAPI", "physxJoint:maxJointVelocity", joint.velocity * unit),
        (f"PhysxJointAxisAPI:{axis}", f"physxJointAxis:{axis}:staticFrictionEffort", joint.friction),
        (f"PhysxJointAxisAPI:{axis}", f"physxJointAxis:{axis}:dynamicFrictionEffort", joint.friction),
        ("NewtonJointAPI", "newton:velocityLimit", joint.velocity * unit),
        ("NewtonJointAPI", "newton:friction", joint.friction),
        ("PhysxJointAPI", "physxJoint:armature", rotor(joint)),
        ("NewtonJointAPI", "newton:armature", rotor(joint)),
        ("NewtonJointAPI", "newton:limitStiffness", stop / unit),
        ("NewtonJointAPI", "newton:limitDamping", blow / unit),
    ):
        prim.AddAppliedSchema(schema_name)
        prim.CreateAttribute(name, Sdf.ValueTypeNames.Float).Set(value)
    prim.AddAppliedSchema("MjcJointAPI")
    for name, text in STOP.items():
        attribute = prim.CreateAttribute(f"mjc:{name}", Sdf.ValueTypeNames.DoubleArray, False, Sdf.VariabilityUniform)
        attribute.Set([float(word) for word in text.split()])
    for name, value in (("spring", joint.spring), ("hold", joint.hold), ("holdOver", joint.hold_over)):
        if value:
            prim.CreateAttribute(f"artsim:{name}", Sdf.ValueTypeNames.Double).Set(value)


def _stop(joint: LinkJoint) -> tuple[float, float]:
    """Stiffness (N m/rad or N/m) and damping of a joint's stops, which do not bounce: it is critical.

    Newton's own default is the same for a button and a drawer, and full effort takes a drawer far past it. A blow at
    the velocity limit, at most the range in ``STROKE_TIME``, goes 0.7 % of the range past this stop. Newton's MuJoCo
    solver softens it for blows, and so takes MuJoCo's own attributes, which say the same as the MJCF file.
    """
    stiffness = joint.inertia / STOP_TIME**2
    if 0.0 < joint.upper - joint.lower < np.inf:
        stiffness = max(stiffness, joint.effort / (STOP_SHARE * (joint.upper - joint.lower)))
    return stiffness, 2.0 * np.sqrt(stiffness * joint.inertia)


def _add_mimic(prim: Any, source: Any, slides: bool, multiplier: float, offset: float) -> None:
    """``q = offset + multiplier q_source`` as Newton and PhysX have it: the latter's terms add up to zero."""
    from pxr import Sdf

    offset *= 1.0 if slides else 180.0 / np.pi
    prim.AddAppliedSchema("NewtonMimicAPI")
    prim.CreateRelationship("newton:mimicJoint").SetTargets([source])
    prim.CreateAttribute("newton:mimicCoef0", Sdf.ValueTypeNames.Float).Set(offset)
    prim.CreateAttribute("newton:mimicCoef1", Sdf.ValueTypeNames.Float).Set(multiplier)
    axis = "transX" if slides else "rotX"
    prim.AddAppliedSchema(f"PhysxMimicJointAPI:{axis}")
    prim.CreateRelationship(f"physxMimicJoint:{axis}:referenceJoint").SetTargets([source])
    prim.CreateAttribute(f"physxMimicJoint:{axis}:referenceJointAxis", Sdf.ValueTypeNames.Token).Set(axis)
    prim.CreateAttribute(f"physxMimicJoint:{axis}:gearing", Sdf.ValueTypeNames.Float).Set(-multiplier)
    prim.CreateAttribute(f"physxMimicJoint:{axis}:offset", Sdf.ValueTypeNames.Float).Set(-offset)


def frame_along(axis: Array) -> Array:
    """A rotation (3, 3) that carries the X axis to a unit vector."""
    side = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    side /= np.linalg.norm(side)
    return np.column_stack([axis, side, np.cross(axis, side)])


def _quaternion(rotation: Array) -> Any:
    from pxr import Gf
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(rotation).as_quat().tolist()
    return Gf.Quatf(w, x, y, z)
