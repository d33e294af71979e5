"""Objects from files: URDF documents, their meshes, and the side files of PartNet-Mobility."""
