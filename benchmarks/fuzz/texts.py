"""Small files as text, one of each format, all our own: what seeds are made of."""

from __future__ import annotations

from typing import Any

MESH_ROBOT = (
    '<robot name="r"><link name="a"><visual><geometry><mesh filename="m.{}"/></geometry></visual></link></robot>'
)

TWO_BOXES = """<?xml version="1.0"?>
<!-- two boxes -->
<robot name="pair">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual name="v"><origin xyz="0 0 0.1" rpy="0 0 1.57"/><geometry><box size="1 0.5 0.2"/></geometry>
      <material name="red"/></visual>
    <collision><geometry><box size="1 0.5 0.2"/></geometry></collision>
  </link>
  <link name="lid"><visual><origin xyz="0.5 0 0"/><geometry><box size="1 0.5 0.02"/></geometry></visual></link>
  <joint name="hinge" type="revolute">
    <origin xyz="-0.5 0 0.2" rpy="0 0 0"/><parent link="base"/><child link="lid"/><axis xyz="0 -1 0"/>
    <limit lower="0" upper="2.5" effort="10" velocity="1"/><dynamics damping="0.1" friction="0"/>
  </joint>
</robot>
"""

CHAIN = """<robot name="chain">
  <link name="base"/>
  <link name="body"><visual><geometry><mesh filename="m.obj" scale="1 1 1"/></geometry></visual></link>
  <link name="drawer"><visual><geometry><cylinder radius="0.1" length="0.3"/></geometry></visual></link>
  <link name="knob"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
  <link name="dial"><visual><geometry><mesh filename="./m.obj" scale="0.5 -0.5 0.5"/></geometry></visual></link>
  <link name="thread"/>
  <link name="cap"><visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual></link>
  <joint name="fix" type="fixed"><origin rpy="1.5707963 0 -1.5707963" xyz="0 0 0"/><parent link="base"/>
    <child link="body"/></joint>
  <joint name="slide" type="prismatic"><origin xyz="0 0.2 0"/><axis xyz="1 0 0"/><limit lower="-0.1" upper="0.4"/>
    <parent link="body"/><child link="drawer"/></joint>
  <joint name="turn" type="continuous"><axis xyz="0 0 1"/><parent link="drawer"/><child link="knob"/></joint>
  <joint name="follow" type="revolute"><axis xyz="0 1 0"/><limit lower="-1" upper="1"/><parent link="body"/>
    <child link="dial"/><mimic joint="turn" multiplier="0.5" offset="0.1"/></joint>
  <joint name="lift" type="prismatic"><axis xyz="0 0 1"/><limit lower="0" upper="0.05"/><parent link="body"/>
    <child link="thread"/></joint>
  <joint name="spin" type="continuous"><axis xyz="0 0 1"/><parent link="thread"/><child link="cap"/></joint>
</robot>
"""

MJCF = """<mujoco model="pair">
  <compiler angle="radian" autolimits="true"/>
  <default><default class="seen"><geom group="2" contype="0" conaffinity="0" mass="0"/></default></default>
  <asset><mesh name="m" file="m.obj" scale="0.5 0.5 0.5" inertia="shell"/></asset>
  <worldbody>
    <body name="base" pos="0 0 0.1" euler="0 0 1.57">
      <geom type="box" size="0.5 0.25 0.1"/><geom class="seen" type="mesh" mesh="m"/>
      <body name="lid" pos="-0.5 0 0.1">
        <joint name="hinge" axis="0 -1 0" range="0 2.5" damping="0.1" frictionloss="0.01" actuatorfrcrange="-9 9"/>
        <geom type="cylinder" fromto="0 0 0 0.5 0 0" size="0.02"/>
      </body>
      <body name="knob" pos="0 0 0.3">
        <joint name="turn" ref="0.5"/><joint name="push" type="slide" range="0 0.01"/><geom size="0.05"/>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="push" joint2="turn" polycoef="0 0.001 0 0 0"/></equality>
</mujoco>
"""

USD = """#usda 1.0
(
    defaultPrim = "o"
    metersPerUnit = 0.01
    upAxis = "Y"
)
def Xform "o"
{
    def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 2
        def Cube "shape" (prepend apiSchemas = ["PhysicsCollisionAPI"])
        {
            double size = 20
        }
    }
    def Xform "lid" (prepend apiSchemas = ["PhysicsRigidBodyAPI"])
    {
        double3 xformOp:translate = (0, 30, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Mesh "shape" (prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])
        {
            uniform token physics:approximation = "convexHull"
            point3f[] points = [(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)]
            int[] faceVertexCounts = [3, 3, 3, 3]
            int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]
        }
    }
    def PhysicsRevoluteJoint "hinge" (prepend apiSchemas = ["PhysicsDriveAPI:angular"])
    {
        rel physics:body0 = </o/base>
        rel physics:body1 = </o/lid>
        uniform token physics:axis = "Z"
        point3f physics:localPos0 = (0, 30, 0)
        quatf physics:localRot0 = (1, 0, 0, 0)
        float physics:lowerLimit = -30
        float physics:upperLimit = 90
        float drive:angular:physics:maxForce = 100
    }
}
"""

META = b'{"model_cat": "Laptop", "anno_id": "10211", "artsim": {"parts": ["base", "lid"], "helpers": []}}'
SEMANTICS = b"base free base_body\nlid hinge lid\n"
MOBILITY = b'[{"id": 0, "parent": -1, "joint": "free", "jointData": {}}, {"id": 1, "parent": 0, "joint": "hinge"}]'

OBJ = b"""# a tetrahedron and a quad
mtllib m.mtl
o thing
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
v 1 1 0 0.5 0.5 0.5
vt 0 0
vt 1 0
vn 0 0 1
usemtl red
f 1 3 2
f 1/1/1 2/2/1 4/1/1
f 2//1 3//1 4//1
g back
f -5 -4 -3
s off
f 1 2 5 3
"""

STL = b"""solid s
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 0 1 0
 endloop
endfacet
facet normal 0 1 0
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 0 0 1
 endloop
endfacet
endsolid s
"""

PLY = b"""ply
format ascii 1.0
comment a corner
element vertex 4
property float x
property float y
property float z
property uchar red
element face 2
property list uchar int vertex_indices
end_header
0 0 0 255
1 0 0 255
0 1 0 0
0 0 1 0
3 0 1 2
3 0 3 1
"""

DAE = b"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
 <library_effects><effect id="e"><profile_COMMON><technique sid="t"><phong>
   <diffuse><color>1 0 0 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
 <library_materials><material id="mat"><instance_effect url="#e"/></material></library_materials>
 <library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="pa" count="12">0 0 0 10 0 0 0 10 0 0 0 10</float_array>
   <technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
    <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="2" material="mat"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3</p></triangles>
  <polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><vcount>4</vcount><p>0 1 3 2</p></polylist>
 </mesh></geometry></library_geometries>
 <library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes>
 <library_visual_scenes><visual_scene id="s"><node id="root"><translate>1 2 3</translate><rotate>0 0 1 90</rotate>
   <matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#g"><bind_material><technique_common>
   <instance_material symbol="mat" target="#mat"/></technique_common></bind_material></instance_geometry>
   <instance_node url="#n"/></node></visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""

PCD = b"""# .PCD v0.7
VERSION 0.7
FIELDS x y z rgb
SIZE 4 4 4 4
TYPE F F F F
COUNT 1 1 1 1
WIDTH 4
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS 4
DATA ascii
0 0 0.5 0
0.1 0 0.5 0
0 0.1 0.5 0
0.1 0.1 0.6 0
"""

CAMERAS: dict[str, Any] = {
    "own": {"fx": 20.0, "fy": 20.0, "cx": 8.0, "cy": 6.0, "width": 16, "height": 12},
    "matrix": {"K": [[20, 0, 8], [0, 20, 6], [0, 0, 1]]},
    "bop": {"0": {"cam_K": [20.0, 0, 8, 0, 20.0, 6, 0, 0, 1], "depth_scale": 0.1}},
    "open3d": {"width": 16, "height": 12, "intrinsic_matrix": [20, 0, 0, 0, 20, 0, 8, 6, 1]},
    "realsense": {"width": 16, "height": 12, "ppx": 8.0, "ppy": 6.0, "fx": 20.0, "fy": 20.0, "model": "none"},
}
CAMERA_YAML = b"""image_width: 16
image_height: 12
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [20.0, 0.0, 8.0, 0.0, 20.0, 6.0, 0.0, 0.0, 1.0]
k: [20.0, 0.0, 8.0, 0.0, 20.0, 6.0, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
d: [0, 0, 0, 0, 0]
"""
