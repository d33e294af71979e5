"""Handles, panes and other labelled pieces of loaded objects, by the names of their visuals or collision shapes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from artsim.common.products import matmul
from artsim.loading.bodies import RigidBody
from artsim.loading.meshes import MeshReader
from artsim.loading.urdf_document import UrdfLink
from artsim.model.details import Detail, detail_of, label_of_visual
from artsim.model.kinematics import Array
from artsim.model.objects import Part
from artsim.model.transforms import transform_points


def named_faces(names: Sequence[str], counts: Sequence[int]) -> dict[str, NDArray[np.int64]]:
    """Faces of each named shape of a body that is a detail, as its merged surface numbers them.

    Parameters
    ----------
    names : sequence of str
        Of the shapes; several of the same name are one thing.
    counts : sequence of int
        Faces of each.
    """
    found: dict[str, list[NDArray[np.int64]]] = {}
    first = 0
    for name, count in zip(names, counts, strict=True):
        if label_of_visual(name) is not None:
            found.setdefault(name, []).append(np.arange(first, first + count))
        first += count
    return {name: np.concatenate(faces) for name, faces in found.items()}


def with_details(
    parts: Sequence[Part], bodies: Sequence[RigidBody], links: Sequence[UrdfLink], reader: MeshReader,
    T_rest_part: Array,
) -> list[Part]:  # fmt: skip
    """The parts with the details that the names of their shapes say.

    Visuals count, as in PartNet-Mobility; of a part without such names, its collision shapes.

    Parameters
    ----------
    parts, bodies : sequence
        Parts in the rest frame, and the bodies that they were.
    links : sequence of UrdfLink
    reader : MeshReader
    T_rest_part : (K, 4, 4) float
        Maps each body from the file's zero to the rest frame.
    """
    by_name = {link.name: link for link in links}
    done = []
    for part, body, T in zip(parts, bodies, T_rest_part, strict=True):
        details: list[Detail] = []
        if len(part.faces):
            surface = part.vertices[np.unique(part.faces)]
            for name, faces in body.details.items():
                if len(faces) < len(part.faces):
                    points = part.vertices[part.faces[faces]].reshape(-1, 3)
                    details.append(_named(name, points, surface, faces=faces))
            if not body.details:
                pieces: dict[str, list[tuple[Array, NDArray[np.int32]]]] = {}
                for link in body.links:
                    for shape in by_name[link].details:
                        vertices, triangles = reader.shape(shape.geometry)
                        place = matmul(T, matmul(body.T_base_link[link], shape.origin))
                        pieces.setdefault(shape.name, []).append((transform_points(place, vertices), triangles))
                for name, own in pieces.items():
                    points = np.concatenate([vertices for vertices, _ in own])
                    details.append(_named(name, points, surface, pieces=tuple(own)))
        done.append(replace(part, details=tuple(details)))
    return done


def _named(name: str, points: Array, surface: Array, **more: object) -> Detail:
    label = label_of_visual(name)
    assert label is not None
    return detail_of(label, points, surface, **more)  # type: ignore[arg-type]
