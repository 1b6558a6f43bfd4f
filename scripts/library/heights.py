#!/usr/bin/env python3
"""Converts a surface file of an instrument to heights that a scene can read: scripts/library/heights.py FILE heights.npy

SDF files (ISO 25178-71) need `pip install sdfio`, x3p files (ISO 25178-72) `pip install x3pio`; all other files go to
`pip install surfalize`, which reads those of many makers. Heights and distances become mm; points without a height become NaN.
The keys for the scene are printed.
"""

import sys
from pathlib import Path

import numpy as np


def read(path):
    """Returns heights (rows along y) and the distances along x and y, all in mm."""
    if path.suffix.lower() == ".sdf":
        import sdfio

        surface = sdfio.read(path)
        return 1e3 * surface.data, 1e3 * surface.header.x_scale, 1e3 * surface.header.y_scale
    if path.suffix.lower() == ".x3p":
        import x3pio

        surface = x3pio.read(path)
        if not (isinstance(surface, x3pio.Surface) and surface.is_regular_grid and len(surface.layers) == 1):
            sys.exit(f"{path} is no surface of one layer on a regular grid")
        return 1e3 * surface.layers[0].z, 1e3 * surface.header.x.increment, 1e3 * surface.header.y.increment
    from surfalize import Surface

    surface = Surface.load(path)
    # its lengths are micrometres
    return 1e-3 * surface.data, 1e-3 * surface.step_x, 1e-3 * surface.step_y


if len(sys.argv) != 3 or not sys.argv[2].endswith(".npy"):
    sys.exit(__doc__)
heights, dx, dy = read(Path(sys.argv[1]))
np.save(sys.argv[2], np.asarray(heights, dtype=np.float64))
missing = int(np.count_nonzero(~np.isfinite(heights)))
print(f"# {heights.shape[1]} x {heights.shape[0]} heights in mm, {missing} missing")
print("[data.rough]")
print(f'file = "{sys.argv[2]}"')
print(f"spacing = [{dx:.10g}, {dy:.10g}]")
if missing:
    print('fill = "linear"')
