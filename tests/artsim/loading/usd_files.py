"""Small USD files of bodies and joints, for tests."""

from __future__ import annotations

from pathlib import Path

from artsim.model.objects import ArticulatedObject

HEAD = '#usda 1.0\n(\n    defaultPrim = "o"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
BODY = 'prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]'
CUBE = 'def Cube "shape" (prepend apiSchemas = ["PhysicsCollisionAPI"]) { double size = 0.2 }'


def body(name: str, place: tuple[float, float, float] = (0, 0, 0), more: str = "", shape: str = CUBE) -> str:
    at = f'double3 xformOp:translate = {place}\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    return f'def Xform "{name}" ({BODY}) {{\n{at}\n{more}\n{shape}\n}}\n'


def joint(kind: str, first: str, second: str, more: str = "", name: str = "j") -> str:
    ends = f"rel physics:body0 = </o/{first}>\nrel physics:body1 = </o/{second}>\n"
    return f'def Physics{kind}Joint "{name}" {{\n{ends}{more}\n}}\n'


def written(folder: Path, content: str, head: str = HEAD, name: str = "object.usda") -> Path:
    """A USD file with these prims below its object's."""
    path = folder / name
    content = content.replace("{ ", "{\n").replace(" }", "\n}")  # a closing brace stands in a row of its own
    path.write_text(f'{head}def Xform "o" {{\n{content}\n}}\n')
    return path


def repairs_of(obj: ArticulatedObject) -> str:
    return "\n".join(map(str, obj.repairs))


HINGE = "float physics:lowerLimit = -30\nfloat physics:upperLimit = 90\n"
HALF = "float physics:lowerLimit = 0\nfloat physics:upperLimit = 0.5\n"
PAIR = body("base") + body("lid", (0, 0, 1))
AT_LID = "point3f physics:localPos0 = (0, 0, 1)\n"
