"""Kernel of :class:`artsim.renderers.ray_scenes.WarpScene`: a module of its own, since Warp compiles whole ones."""

import warp as wp

_FAR = wp.constant(wp.float32(1e30))


@wp.kernel
def first_hits(
    mesh: wp.uint64,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    face: wp.array(dtype=wp.int32),
):
    """The first face that each ray meets; -1 for none."""
    i = wp.tid()
    hit = wp.mesh_query_ray(mesh, origins[i], directions[i], _FAR)
    face[i] = wp.where(hit.result, hit.face, -1)
