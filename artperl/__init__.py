"""artperl: 9D pose of every part of an articulated object from a partial point cloud (ArtPERL)."""
