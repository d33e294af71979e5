"""Ten MJCF files such as people have, all our own, and small: each has features that the others have not."""

from __future__ import annotations

import struct

MICROWAVE = """<mujoco model="microwave">
  <compiler angle="radian" autolimits="true"/>
  <asset>
    <texture name="steel" type="2d" builtin="flat" rgb1=".7 .7 .7" width="8" height="8"/>
    <material name="steel" texture="steel" shininess="0.8"/><material name="glass" rgba=".2 .3 .3 .3"/>
    <material name="none" rgba="0 0 0 0"/>
  </asset>
  <default>
    <default class="visual"><geom group="1" contype="0" conaffinity="0" material="steel"/></default>
    <default class="collision"><geom group="0" rgba="0.5 0 0 0.5"/></default>
    <default class="region"><geom type="box" group="1" contype="0" conaffinity="0" rgba="0 1 0 0"/></default>
  </default>
  <worldbody>
    <body name="object">
      <geom class="visual" type="box" size=".25 .2 .01" pos="0 0 -.15"/>
      <geom class="visual" type="box" size=".25 .01 .15" pos="0 .2 0"/>
      <geom class="collision" type="box" size=".25 .2 .15"/>
      <geom class="region" name="reg_main" size=".25 .2 .15"/>
      <geom name="hidden" type="sphere" size=".4" material="none" contype="0" conaffinity="0" group="1"/>
      <site name="ext_p0" pos="-.25 -.2 -.15" size=".005" rgba="0 0 1 0"/>
      <body name="door" pos="-.25 -.2 0">
        <joint name="doorhinge" axis="0 0 1" range="-1.6 0" damping="2" frictionloss="1"/>
        <geom class="visual" type="box" size=".2 .01 .15" pos=".2 0 0" material="glass"/>
        <geom class="collision" type="box" size=".2 .01 .15" pos=".2 0 0"/>
        <body name="handle" pos=".38 -.03 0"><geom class="visual" type="capsule" size=".01 .1"/></body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

ARM = """<mujoco model="arm">
  <compiler angle="degree" meshdir="assets" autolimits="true"/>
  <option integrator="implicitfast"/>
  <default>
    <default class="arm">
      <joint armature="0.1" damping="1" axis="0 0 1" range="-170 170"/>
      <position kp="100" forcerange="-50 50"/>
      <default class="shown"><geom type="mesh" contype="0" conaffinity="0" group="2" mass="0"/></default>
      <default class="solid"><geom type="capsule" group="3"/></default>
    </default>
  </default>
  <asset><mesh name="link" class="arm" file="m.obj" scale="0.1 0.1 0.1"/></asset>
  <worldbody>
    <light pos="0 0 2"/>
    <body name="base" childclass="arm">
      <inertial mass="3" pos="0 0 0.05" diaginertia="0.01 0.01 0.01"/>
      <geom class="shown" mesh="link"/><geom class="solid" size="0.05 0.05"/>
      <body name="upper" pos="0 0 0.1" quat="1 1 0 0">
        <inertial mass="2" pos="0 0 0.1" fullinertia="0.01 0.01 0.01 0.001 0 0"/>
        <joint name="shoulder" range="-90 90"/>
        <geom class="shown" mesh="link"/><geom class="solid" size="0.04" fromto="0 0 0 0 0 0.2"/>
        <body name="lower" pos="0 0 0.2">
          <inertial mass="1" pos="0 0 0.05" diaginertia="0.001 0.001 0.001"/>
          <joint name="elbow" axis="0 1 0"/>
          <geom class="shown" mesh="link"/><site name="tool" pos="0 0 0.1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="base" body2="upper"/></contact>
  <actuator><position class="arm" name="a" joint="shoulder"/></actuator>
  <sensor><framepos objtype="site" objname="tool"/></sensor>
  <keyframe><key name="home" qpos="0 0"/></keyframe>
</mujoco>
"""

GRIPPER = """<mujoco model="gripper">
  <worldbody>
    <body name="palm"><geom type="box" size="0.05 0.02 0.02"/>
      <body name="left" pos="-0.03 0 0.02"><joint name="l" type="slide" axis="1 0 0" range="0 0.03"/>
        <geom type="box" size="0.005 0.01 0.03" pos="0 0 0.03"/></body>
      <body name="right" pos="0.03 0 0.02"><joint name="r" type="slide" axis="-1 0 0" range="0 0.03"/>
        <geom type="box" size="0.005 0.01 0.03" pos="0 0 0.03"/></body>
      <body name="wheel" pos="0 0.03 0"><joint name="w" axis="0 1 0"/><geom type="cylinder" size="0.02 0.005"/></body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="split"><joint joint="l" coef="0.5"/><joint joint="r" coef="-0.5"/></fixed>
    <fixed name="turn"><joint joint="w" coef="0.01"/></fixed><fixed name="slide"><joint joint="l" coef="1"/></fixed>
  </tendon>
  <equality>
    <tendon tendon1="split"/><tendon tendon1="turn" tendon2="slide" polycoef="0 1 0 0 0"/>
  </equality>
  <actuator><general tendon="split" ctrlrange="0 255"/></actuator>
</mujoco>
"""

KITCHEN = """<mujoco model="kitchen">
  <include file="defaults.xml"/>
  <worldbody>
    <geom name="floor" type="plane" size="4 4 0.1"/>
    <body name="counter" pos="0 0 0.4"><geom class="board" size="0.6 0.3 0.4"/>
      <include file="drawer.xml"/>
    </body>
  </worldbody>
</mujoco>
"""
DEFAULTS = b"""<mujocoinclude><compiler angle="radian"/><statistic extent="2"/>
  <default><default class="board"><geom type="box" density="600" rgba="0.6 0.4 0.2 1"/></default></default>
</mujocoinclude>
"""
DRAWER = b"""<mujoco><body name="drawer" pos="0 -0.31 0.1">
  <joint name="pull" type="slide" axis="0 -1 0" range="0 0.35"/>
  <geom class="board" size="0.25 0.01 0.1"/></body></mujoco>
"""

SCENE = """<mujoco model="scene">
  <worldbody>
    <body name="table" pos="0 0 0.35"><geom type="box" size="0.5 0.5 0.02"/></body>
    <body name="mug" pos="0.2 0 0.45"><freejoint/><geom type="cylinder" size="0.04 0.05"/></body>
    <body name="laptop" pos="-0.2 0 0.4"><freejoint name="free" align="true"/>
      <geom type="box" size="0.15 0.1 0.01"/>
      <body name="lid" pos="0 0.1 0.01"><joint name="hinge" axis="1 0 0" range="-120 0"/>
        <geom type="box" size="0.15 0.1 0.005" pos="0 -0.1 0.005"/></body>
    </body>
    <body name="target" mocap="true"><site name="goal"/></body>
  </worldbody>
</mujoco>
"""

POLE = """<mujoco model="cart">
  <option timestep="0.01"><flag contact="disable"/></option>
  <visual><map znear="0.01"/></visual>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1=".4 .6 .8" rgb2="0 0 0" width="8" height="48"/>
  </asset>
  <default><joint damping="5e-4"/><geom friction="1 .1 .1"/></default>
  <worldbody>
    <camera name="fixed" pos="0 -4 1" zaxis="0 -1 0"/>
    <geom name="rail" type="capsule" pos="0 .07 1" zaxis="1 0 0" size="0.02 2"/>
    <body name="cart" pos="0 0 1">
      <joint name="slider" type="slide" limited="true" axis="1 0 0" range="-1.8 1.8" solreflimit=".08 1"/>
      <geom name="cart" type="box" size="0.2 0.15 0.1" mass="1"/>
      <body name="pole" childclass="pole"><joint name="hinge" axis="0 1 0"/>
        <geom class="pole" name="pole" type="capsule" fromto="0 0 0 0 0 1" size="0.045" mass="0.1"/></body>
    </body>
  </worldbody>
  <default><default class="pole"><geom rgba="0.5 0.5 0.9 1"/></default></default>
  <actuator><motor name="slide" joint="slider" gear="10" ctrllimited="true" ctrlrange="-1 1"/></actuator>
</mujoco>
"""

FIGURE = """<mujoco model="figure">
  <compiler eulerseq="zyx" inertiafromgeom="true"/>
  <default><geom type="capsule" density="1000"/><joint limited="true"/></default>
  <worldbody>
    <body name="torso" pos="0 0 1.3"><freejoint name="root"/>
      <geom fromto="0 -.07 0 0 .07 0" size=".07"/><geom type="ellipsoid" size=".05 .07 .1" pos="0 0 .19"/>
      <frame euler="0 0 30" pos="0 0.17 0.06"><body name="arm">
        <joint name="ball" type="ball" range="0 80"/><geom fromto="0 0 0 .16 .16 -.16" size=".04 .16"/>
        <body name="hand" pos=".18 .18 -.18"><joint name="wrist" axis="0 -1 1" range="-90 50" ref="10"/>
          <geom type="sphere" size=".04"/></body></body></frame>
      <replicate count="3" euler="0 0 120" sep="_"><body name="leg" pos=".1 0 -.2">
        <joint name="hip" axis="0 1 0" range="-30 30"/><geom fromto="0 0 0 0 0 -.4" size=".03"/></body></replicate>
    </body>
  </worldbody>
</mujoco>
"""

OLD = """<mujoco model="old">
  <compiler assetdir="assets" strippath="true" fitaabb="true" settotalmass="4" inertiagrouprange="0 2"/>
  <asset><mesh file="far/away/m.msh" scale="1 1 -1"/><hfield file="ground.png" size="1 1 .1 .1"/>
    <mesh name="twin" file="m.msh" refpos="0 0 0.1" refquat="1 0 0 1"/></asset>
  <worldbody>
    <geom type="hfield" hfield="ground"/>
    <body name="a"><geom type="mesh" mesh="m"/><geom type="box" mesh="twin" pos="0 0 1"/>
      <body name="b" pos="0 0 1"><joint name="j" axis="0 0 1" range="-1 1"/><geom type="mesh" mesh="twin"/></body>
    </body>
  </worldbody>
</mujoco>
"""

CLOSED = """<mujoco model="closed">
  <worldbody>
    <body name="mocap" mocap="true" pos="0 0 1"><geom type="box" size=".01 .01 .01" contype="0" conaffinity="0"/></body>
    <body name="frame"><geom type="box" size=".3 .02 .02"/><site name="end" pos=".3 0 .2"/>
      <body name="crank" pos="-.3 0 0"><joint name="c" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 .2" size=".01"/>
        <body name="rod" pos="0 0 .2"><joint name="d" axis="0 1 0"/><site name="tip" pos=".6 0 0"/>
          <geom type="capsule" fromto="0 0 0 .6 0 0" size=".01"/></body></body>
    </body>
  </worldbody>
  <equality>
    <connect name="loop" site1="tip" site2="end"/><weld body1="mocap" body2="frame" solref="0.02 1"/>
    <weld site1="tip" site2="end" active="false"/><joint joint1="d" joint2="c" polycoef="0 -1 0.1 0 0"/>
    <joint joint1="c" polycoef="0.3" active="false"/>
  </equality>
</mujoco>
"""

PARTS = """<mujoco model="parts">
  <extension><plugin plugin="mujoco.sdf.torus"><instance name="t"/></plugin></extension>
  <asset>
    <mesh name="wedge" vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="0 2 1 0 1 3 0 3 2 1 2 3" scale=".3 .3 .3"/>
    <mesh name="round" builtin="sphere" params="2" scale=".1 .1 .1"/>
    <mesh name="torus"><plugin instance="t"/></mesh>
    <skin name="cloth" file="s.skn"/>
  </asset>
  <worldbody>
    <body name="a" xyaxes="0 1 0 -1 0 0"><geom type="mesh" mesh="wedge"/><geom type="sdf" mesh="torus"/>
      <flexcomp name="f" type="grid" count="3 3 1" spacing=".1 .1 .1" dim="2" mass="1"/>
      <body name="b" axisangle="0 0 1 30" pos=".5 0 0"><joint name="t" range="0 90"/><joint name="s" type="slide"/>
        <geom type="mesh" mesh="round" mass="1"/></body></body>
  </worldbody>
</mujoco>
"""


def msh() -> bytes:
    """A tetrahedron in MuJoCo's old format of meshes, with normals and texture coordinates."""
    points = (0, 0, 0, 0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5)
    faces = (0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3)
    return struct.pack("<4i12f", 4, 4, 4, 4, *points) + bytes(48 + 32) + struct.pack("<12i", *faces)


def files(obj: bytes) -> dict[str, dict[str, bytes]]:
    """Files of each object by their names, ``mobility.xml`` among them; ``obj`` is a mesh for those that have one."""
    found: dict[str, dict[str, str | bytes]] = {
        "microwave": {"mobility.xml": MICROWAVE},
        "arm": {"mobility.xml": ARM, "assets/m.obj": obj},
        "gripper": {"mobility.xml": GRIPPER},
        "kitchen": {"mobility.xml": KITCHEN, "defaults.xml": DEFAULTS, "drawer.xml": DRAWER},
        "scene": {"mobility.xml": SCENE},
        "pole": {"mobility.xml": POLE},
        "figure": {"mobility.xml": FIGURE},
        "old": {"mobility.xml": OLD, "assets/m.msh": msh()},
        "closed": {"mobility.xml": CLOSED},
        "parts": {"mobility.xml": PARTS},
    }
    return {
        name: {path: text if isinstance(text, bytes) else text.encode() for path, text in some.items()}
        for name, some in found.items()
    }
