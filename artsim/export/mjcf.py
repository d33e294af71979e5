"""MJCF, in full precision (``MjSpec.to_xml`` keeps six digits), and compiled by ``mujoco.MjSpec`` before it counts."""

from collections.abc import Sequence

import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from artsim.common.extras import import_mujoco
from artsim.common.names import unused_name
from artsim.errors import AssetError
from artsim.export.looks import NO_FINISH, Finish, Look, looks_text
from artsim.export.options import ExportOptions
from artsim.export.text import number, numbers, obj_text
from artsim.model.robot import STRENGTH, BoxShape, Link, LinkJoint, MeshShape, Robot

STOP_TIME = 0.004
"""Seconds, one over the natural frequency of a stop: as stiff as MuJoCo's time step of 2 ms allows."""
_SOLREF, _SOLIMP = f"{STOP_TIME} 1", "0.9999 0.9999 0.001 0.5 2"
STIFF = {"solref": _SOLREF, "solimp": _SOLIMP}
"""How stiffly joints follow others. MuJoCo weighs a metre of the one like a radian of the other, which by its default
leaves a screw's thread far too soft."""
STOP = {"solreflimit": _SOLREF, "solimplimit": _SOLIMP}
"""How stiffly joints stop: by its default MuJoCo lets light parts through by tenths of a radian."""
BELOW = 1.0 - 1e-6
"""Share of the effort limit that a motor has at most. At the limit itself MuJoCo's implicit integrator forgets what the
motor loses with speed, and light parts dart off."""
TIME_STEP = 0.002
"""Seconds: MuJoCo's default."""
ROTOR_TIME = TIME_STEP
"""Seconds in which a motor alone reaches its speed, by the inertia of its rotor (``armature``). Without a rotor, light
joints reach it in microseconds. MuJoCo's implicit integrator then divides every force on them, that of their stops too,
by the time step over this time: a button sinks into its stop by a tenth of its travel."""
POSITION_TIME = 0.1
"""Seconds in which a position actuator, held by damping alone, would be where it is told."""


def mjcf_text(robot: Robot, options: ExportOptions, finish: Finish = NO_FINISH) -> str:
    """The object as an MJCF document; its meshes lie in ``meshes/``.

    Bodies, joints and inertias are those of the URDF file. What follows another joint (``mimic``, screws) is held by an
    equality constraint. Geoms of group 2 are seen, those of group 3 collide, as MuJoCo's viewers take them. Sites of
    group 4 are the boxes of handles, knobs and panes, in their frames.
    Actuators have the names of their joints. MuJoCo knows no velocity limits: motors that lose effort with speed keep
    them.

    Raises
    ------
    AssetError
        When MuJoCo refuses the model.
    """
    root = etree.Element("mujoco", model=robot.name)
    # Fused, a root that no joint moves would become part of the world.
    # The integrator treats damping and what motors lose with speed implicitly: light parts stay stable.
    etree.SubElement(root, "option", integrator="implicitfast", timestep=number(TIME_STEP))
    etree.SubElement(root, "compiler", angle="radian", meshdir="meshes", autolimits="true", fusestatic="false")
    default = etree.SubElement(root, "default")
    for group, more in (("visual", {"group": "2", "contype": "0", "conaffinity": "0"}), ("collision", {"group": "3"})):
        etree.SubElement(etree.SubElement(default, "default", {"class": group}), "geom", mass="0", **more)
    asset = etree.SubElement(root, "asset")
    seen = {link.visual.name for link in robot.links if link.visual is not None}
    finished = {link.visual.name for link in robot.links if link.visual is not None and link.name in finish.looks}
    for mesh in robot.meshes:
        if mesh.name not in finished:
            # What is only seen may be flat, and enclose nothing; its mass is 0 in any case.
            flat = {"inertia": "shell"} if mesh.name in seen else {}
            etree.SubElement(asset, "mesh", name=mesh.name, file=f"{mesh.name}.obj", **flat)
    _add_materials(asset, finish)
    bodies: list[etree._Element] = []
    incoming = {joint.child: joint for joint in robot.joints}
    world = etree.SubElement(root, "worldbody")
    for i, link in enumerate(robot.links):
        joint = incoming.get(i)
        parent = world if joint is None else bodies[joint.parent]
        offset = link.origin if joint is None else link.origin - robot.links[joint.parent].origin
        bodies.append(_add_body(parent, numbers(offset), link, joint, finish.looks.get(link.name, ())))
        if joint is not None and joint.mimic is None and options.actuators != "none":
            rotor = ROTOR_TIME * _lost(joint)
            bodies[-1].find("joint").set("armature", number(rotor))
        if joint is None and options.base == "free":
            free = unused_name("root", {other.name for other in robot.joints})
            bodies[-1].insert(0, etree.Element("freejoint", name=free))
    _add_exclusions(root, robot)
    _add_equalities(root, robot)
    if options.actuators != "none":
        _add_actuators(root, robot, options.actuators)
    text: str = etree.tostring(root, pretty_print=True, encoding="unicode")
    _compile(text, robot, finish)
    return text


def _add_materials(asset: etree._Element, finish: Finish) -> None:
    """Materials with their textures, and the meshes of each; pictures lie beside the meshes."""
    for name, material in finish.materials.items():
        red, green, blue = (1.0, 1.0, 1.0) if material.texture is not None else material.colour
        shown = {"rgba": numbers((red, green, blue, 1.0)), "specular": number(material.specular)}
        shown |= {"shininess": number(1.0 - material.roughness), "emission": number(material.emission)}
        shown |= {"metallic": number(material.metallic), "roughness": number(material.roughness)}
        if material.texture is not None:
            etree.SubElement(asset, "texture", name=name, type="2d", file=f"meshes/{name}.png")
            shown["texture"] = name
        etree.SubElement(asset, "material", name=name, **shown)
    for looks in finish.looks.values():
        for look in looks:
            # Flat surfaces enclose nothing; their mass is 0 in any case.
            etree.SubElement(asset, "mesh", name=look.name, file=f"{look.name}.obj", inertia="shell")


def _add_body(
    parent: etree._Element, pos: str, link: Link, joint: LinkJoint | None, looks: Sequence[Look]
) -> etree._Element:
    body = etree.SubElement(parent, "body", name=link.name, pos=pos)
    inertia, tensor = link.inertia, link.inertia.tensor
    entries = [tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    pos = numbers(inertia.center - link.origin)
    etree.SubElement(body, "inertial", pos=pos, mass=number(inertia.mass), fullinertia=numbers(entries))
    if joint is not None:
        more = {"range": numbers((joint.lower, joint.upper)), **STOP} if np.isfinite(joint.lower) else {}
        keyed = {"stiffness": joint.spring, "springref": 0.0, "armature": rotor(joint)}
        sprung = {name: number(value) for name, value in keyed.items()} if joint.spring else {}
        etree.SubElement(
            body,
            "joint",
            name=joint.name,
            type="slide" if joint.type == "prismatic" else "hinge",
            axis=numbers(joint.axis),
            damping=number(joint.damping),
            frictionloss=number(joint.friction),
            actuatorfrcrange=numbers((-joint.effort, joint.effort)),
            **sprung,
            **more,
        )
    for look in looks:
        mesh = {"mesh": look.name, "material": look.material}
        etree.SubElement(body, "geom", {"class": "visual"}, type="mesh", pos=numbers(-link.origin), **mesh)
    if link.visual is not None and not looks:
        _add_geom(body, "visual", link, link.visual)
    for shape in link.collision:
        _add_geom(body, "collision", link, shape)
    for detail in link.details:
        T = detail.T_rest_detail
        x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
        place = {"pos": numbers(T[:3, 3] - link.origin), "quat": numbers((w, x, y, z))}
        etree.SubElement(
            body, "site", name=detail.name, type="box", size=numbers(0.5 * detail.size), group="4", **place
        )
    return body


def rotor(joint: LinkJoint) -> float:
    """Inertia (kg or kg m^2) that beside their damping keeps light sprung keys calm, and out of their stops."""
    return TIME_STEP**2 * joint.spring


def _add_geom(body: etree._Element, group: str, link: Link, shape: BoxShape | MeshShape) -> None:
    if isinstance(shape, BoxShape):
        pos, size = numbers(shape.center - link.origin), numbers(0.5 * shape.size)
        etree.SubElement(body, "geom", {"class": group}, type="box", pos=pos, size=size)
    else:
        etree.SubElement(body, "geom", {"class": group}, type="mesh", pos=numbers(-link.origin), mesh=shape.name)


def _add_exclusions(root: etree._Element, robot: Robot) -> None:
    """Parts that a joint connects do not collide: MuJoCo leaves that out where the parent is fixed to the world."""
    obj = robot.obj
    contact = etree.SubElement(root, "contact")
    for k in range(1, len(obj)):
        parent = obj.parts[obj.tree.parents[k]]
        etree.SubElement(contact, "exclude", body1=parent.name, body2=obj.parts[k].name)


def _add_equalities(root: etree._Element, robot: Robot) -> None:
    equality = etree.SubElement(root, "equality")
    for joint in robot.joints:
        if joint.mimic is not None:
            source, multiplier, offset = joint.mimic
            polycoef = numbers((offset, multiplier, 0.0, 0.0, 0.0))
            etree.SubElement(equality, "joint", joint1=joint.name, joint2=source, polycoef=polycoef, **STIFF)


def _add_actuators(root: etree._Element, robot: Robot, kind: str) -> None:
    """One for each joint that follows no other."""
    actuators = etree.SubElement(root, "actuator")
    for joint in robot.joints:
        if joint.mimic is not None:
            continue
        limit = numbers((-joint.effort, joint.effort))
        if kind == "motor":
            # The joint's damping has a share of what is lost.
            lost = max(_lost(joint) - joint.damping, 0.0)
            gain, bias, control = number(BELOW * joint.effort), numbers((0.0, 0.0, -lost)), "-1 1"
        else:
            gain_of = joint.effort / max(joint.velocity * POSITION_TIME, 1e-9)
            damp = gain_of * POSITION_TIME
            gain, bias = number(gain_of), numbers((0.0, -gain_of, -damp))
            control = numbers((joint.lower, joint.upper)) if np.isfinite(joint.lower) else ""
        more = {"ctrlrange": control} if control else {}
        etree.SubElement(
            actuators, "general", name=joint.name, joint=joint.name, gainprm=gain, biastype="affine", biasprm=bias,
            forcerange=limit, **more,
        )  # fmt: skip


def _lost(joint: LinkJoint) -> float:
    """Effort that a motor loses for each unit of speed: control, weight and speed cancel at the velocity limit."""
    return (1.0 + 1.0 / STRENGTH) * joint.effort / joint.velocity


def _compile(text: str, robot: Robot, finish: Finish) -> None:
    mujoco = import_mujoco("MJCF files")  # a file that MuJoCo does not compile is not written

    files = {f"{mesh.name}.obj": obj_text(mesh).encode() for mesh in robot.meshes}
    files |= {f"{look.name}.obj": looks_text([look]).encode() for looks in finish.looks.values() for look in looks}
    files |= {f"meshes/{name}": content for name, content in finish.pictures.items()}
    try:
        mujoco.MjSpec.from_string(text, assets=files).compile()
    except ValueError as error:
        where = f"{robot.obj.category} {robot.obj.object_id}"
        raise AssetError(f"MuJoCo refuses it ({error})", where, "correct the part it names") from error
