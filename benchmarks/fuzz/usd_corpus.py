"""Ten USD files such as people have, as text and in binary: of simulators, converters and asset libraries."""

from __future__ import annotations

import tempfile
from pathlib import Path

HEAD = '#usda 1.0\n(\n    defaultPrim = "o"\n    metersPerUnit = {}\n    kilogramsPerUnit = 1\n    upAxis = "{}"\n)\n'
BOX = (
    'def Mesh "mesh" (prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])\n{{\n'
    'uniform token physics:approximation = "convexHull"\nuniform token subdivisionScheme = "none"\n'
    "point3f[] points = [(0, 0, 0), ({0}, 0, 0), (0, {0}, 0), (0, 0, {0})]\nint[] faceVertexCounts = [3, 3, 3, 3]\n"
    "int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]\n}}\n"
)
CUBE = 'def Cube "cube" (prepend apiSchemas = ["PhysicsCollisionAPI"])\n{{\ndouble size = {0}\n}}\n'


def _body(name: str, place: str, shape: str, more: str = "", ops: str = "") -> str:
    order = ", ".join(f'"xformOp:{op}"' for op in ("translate", *(["scale"] if "scale" in ops else [])))
    return (
        f'def Xform "{name}" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])\n{{\n'
        "float physics:mass = 2\n"
        f"double3 xformOp:translate = {place}\n{ops}uniform token[] xformOpOrder = [{order}]\n{more}{shape}}}\n"
    )


def _joint(kind: str, name: str, ends: tuple[str, str], rows: str, schemas: str = '"PhysicsDriveAPI:angular"') -> str:
    bodies = "".join(f"rel physics:body{k} = </o/{end}>\n" for k, end in enumerate(ends) if end)
    return f'def Physics{kind}Joint "{name}" (prepend apiSchemas = [{schemas}])\n{{\n{bodies}{rows}}}\n'


def _object(content: str, unit: str = "1", up: str = "Z", schemas: str = '"PhysicsArticulationRootAPI"') -> str:
    return f'{HEAD.format(unit, up)}def Xform "o" (prepend apiSchemas = [{schemas}])\n{{\n{content}}}\n'


TURN = "float physics:lowerLimit = -30\nfloat physics:upperLimit = 90\n"
AT = "point3f physics:localPos0 = (0, 0, 0.5)\nquatf physics:localRot1 = (0.5, 0.5, -0.5, 0.5)\n"
PAIR = _body("base", "(0, 0, 0)", CUBE.format(0.4)) + _body("lid", "(0, 0, 0.5)", BOX.format(0.3))
THREE = PAIR + _body("tip", "(0, 0, 0.9)", CUBE.format(0.1))
LEAD = _joint(
    "Prismatic", "lead", ("base", "lid"), "float physics:lowerLimit = 0\nfloat physics:upperLimit = 0.2\n" + AT
)
LIMITS = '"PhysicsLimitAPI:transX", "PhysicsLimitAPI:transY", "PhysicsLimitAPI:transZ", "PhysicsLimitAPI:rotX"'
LOCKED = "".join(f"float limit:trans{k}:physics:low = 1\nfloat limit:trans{k}:physics:high = -1\n" for k in "XYZ")
GROUND = 'def Xform "ground"\n{\ndouble3 xformOp:translate = (0, 0, -5)\n'
GROUND += 'uniform token[] xformOpOrder = ["xformOp:translate"]\n'

TEXTS: dict[str, str] = {
    "hinge": _object(
        PAIR + _joint("Revolute", "j", ("base", "lid"), TURN + AT + "float drive:angular:physics:maxForce = 9\n")
    ),
    "generic": _object(
        PAIR
        + _joint(
            "",
            "j",
            ("base", "lid"),
            LOCKED + "float limit:rotX:physics:low = -45\nfloat limit:rotX:physics:high = 45\n" + AT,
            LIMITS,
        )
    ),
    "ball": _object(
        PAIR
        + _joint(
            "Spherical",
            "j",
            ("base", "lid"),
            "float physics:coneAngle0Limit = 30\nfloat physics:coneAngle1Limit = 45\n" + AT,
        )
    ),
    "newton": _object(
        THREE
        + LEAD
        + _joint(
            "Prismatic",
            "f",
            ("base", "tip"),
            "rel newton:mimicJoint = </o/lead>\nfloat newton:mimicCoef1 = -1\nfloat newton:mimicCoef0 = 0.1\n"
            "uniform double mjc:coef2 = 0\n" + AT,
            '"NewtonMimicAPI", "MjcEqualityJointAPI"',
        )
    ),
    "physx": _object(
        THREE
        + LEAD
        + _joint(
            "Revolute",
            "f",
            ("lid", "tip"),
            "rel physxMimicJoint:rotX:referenceJoint = </o/lead>\nfloat physxMimicJoint:rotX:gearing = -50\n"
            "float physxMimicJoint:rotX:offset = 5\nfloat physxJoint:maxJointVelocity = 100\n" + TURN,
            '"PhysxMimicJointAPI:rotX"',
        )
    ),
    "mirrored": _object(
        _body("base", "(0, 0, 0)", CUBE.format(40))
        + _body(
            "lid",
            "(0, 50, 0)",
            BOX.format(30),
            "float3 physics:diagonalInertia = (9, 8, 7)\n",
            "float3 xformOp:scale = (-1, 1, 2)\n",
        )
        + _joint("Revolute", "j", ("base", "lid"), TURN),
        "0.01",
        "Y",
    ),
    "two_hinges": _object(
        PAIR
        + _joint("Revolute", "j", ("base", "lid"), TURN + AT)
        + _joint("Revolute", "k", ("base", "lid"), 'uniform token physics:axis = "Z"\n' + TURN + AT)
    ),
    "ground": _object(
        PAIR
        + GROUND
        + CUBE.format(9)
        + "}\n"
        + _joint("Fixed", "hold", ("ground", "base"), "")
        + _joint("Revolute", "j", ("lid", "base"), TURN)
    ),
    "classes": _object(
        'def "Looks" {\n}\n'
        + _body("base", "(0, 0, 0)", 'def "shape" (instanceable = true\n    references = </proto>\n)\n{\n}\n')
        + _body(
            "lid",
            "(0, 0, 0.5)",
            'def "shape" (\n    inherits = </_class>\n    variants = {\n        string size = "small"\n    }\n'
            '    prepend variantSets = "size"\n)\n{\nvariantSet "size" = {\n"small" {\n'
            + CUBE.format(0.1)
            + '}\n"large" {\n'
            + CUBE.format(0.2)
            + "}\n}\n}\n",
        )
        + _joint("Revolute", "j", ("base", "lid"), TURN)
    )
    + 'class "_class"\n{\n'
    + BOX.format(0.2)
    + '}\nclass Xform "proto"\n{\n'
    + BOX.format(0.3)
    + "}\n",
    "world": _object(
        'def Xform "frame"\n{\n'
        + CUBE.format(1)
        + 'def Cylinder "rod"\n{\nuniform token axis = "X"\ndouble radius = 0.1\ndouble height = 2\n}\n}\n'
        + _body(
            "lid",
            "(0, 0, 0.5)",
            'def Capsule "c"\n{\ndouble radius = 0.1\ndouble height = 0.3\n}\n' + 'def Sphere "s" {\n}\n',
        )
        + _joint("Revolute", "j", ("frame", "lid"), TURN)
        + _joint("Prismatic", "off", ("", "lid"), "bool physics:jointEnabled = 0\n"),
    ),
}
"""By what is peculiar to each."""


def binary(text: str) -> bytes:
    """The same layer in USD's binary format."""
    from pxr import Sdf

    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(text)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "o.usdc"
        layer.Export(str(path))
        return path.read_bytes()
