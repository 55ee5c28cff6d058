"""Write the Utah teapot with a colour at each vertex, 552 triangles: python colours.py FOLDER."""

import sys
from pathlib import Path

import numpy as np
import trimesh

from blysk.sim.meshes.teapot import teapot

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
mesh = teapot(552)
low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
colours = np.round(255 * (mesh.vertices - low) / (high - low)).astype(np.uint8)
shown = trimesh.Trimesh(
    mesh.vertices, mesh.faces, vertex_normals=mesh.normals, vertex_colors=colours, process=False
)
shown.export(folder / "colours.ply", vertex_normal=True)
print(f"{folder / 'colours.ply'}: {len(mesh.faces)} triangles, {len(mesh.vertices)} vertices")
