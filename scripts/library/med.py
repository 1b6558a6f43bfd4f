#!/usr/bin/env python3
"""Converts a mesh of Salome with its groups of faces, edges and volumes: scripts/library/med.py part.med part.msh

Needs `pip install meshio h5py`. A cell in several groups is written once for each of them, as Gmsh does; cells in no group are left out.
"""

import sys

import meshio
import numpy as np

if len(sys.argv) != 3 or not sys.argv[2].endswith(".msh"):
    sys.exit(__doc__)
mesh = meshio.read(sys.argv[1])
families = getattr(mesh, "cell_tags", {})
blocks, tags, names = [], [], {}
for block, family in zip(mesh.cells, mesh.cell_data.get("cell_tags", [])):
    for number in np.unique(family):
        for name in families.get(int(number), []):
            tag = names.setdefault((name, block.dim), len(names) + 1)
            cells = block.data[family == number]
            blocks.append((block.type, cells))
            tags.append(np.full(len(cells), tag))
if not blocks:
    sys.exit(f"{sys.argv[1]} has no groups of cells: make groups of faces, edges and volumes in Salome")
groups = {name: np.array([tag, dim]) for (name, dim), tag in names.items()}
data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
meshio.Mesh(mesh.points, blocks, cell_data=data, field_data=groups).write(sys.argv[2], file_format="gmsh22", binary=False)
for (name, dim), tag in names.items():
    print(f"{name}: {sum(len(cells) for (_, cells), tagged in zip(blocks, tags) if tagged[0] == tag)} cells of dimension {dim}")
