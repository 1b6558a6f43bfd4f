#!/usr/bin/env python3
"""Prints the layer that the summits of a rough surface make, after Greenwood and Williamson (Proc. R. Soc. A 295, 1966).

By numbers:  asperities.py MODULUS --density ETA --radius R --deviation S     of normally distributed summits
By heights:  asperities.py MODULUS --heights heights.npy --spacing D          of the points higher than the eight around them

Each summit is a sphere in Hertz' contact with a plane, independent of its neighbours. Under the compression c of the layer from first touch

    p(c) = 4/3 E* sqrt(R) eta mean((c - s)_+^(3/2)),    s the depth of a summit below the highest one,

with the modulus E*, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2, the number eta of summits in a unit of area and their radius R.
"""

import argparse

import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("modulus", type=float)
parser.add_argument("--density", type=float)
parser.add_argument("--radius", type=float)
parser.add_argument("--deviation", type=float, help="standard deviation of the heights of the summits")
parser.add_argument("--highest", type=float, default=4.0, help="highest summit above the mean, in deviations")
parser.add_argument("--heights", help=".npy of a grid")
parser.add_argument("--spacing", type=float, help="distance of its points")
parser.add_argument("--points", type=int, default=60, help="points of the table")
asked = parser.parse_args()
if asked.heights:
    heights = np.load(asked.heights)
    middle = heights[1:-1, 1:-1]
    shifted = [np.roll(heights, (i, j), (0, 1))[1:-1, 1:-1] for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    summits = middle > np.max(shifted, axis=0)
    bend = (np.sum([shifted[k] for k in (1, 3, 4, 6)], axis=0) - 4.0 * middle) / (2.0 * asked.spacing**2)
    radius, density = 1.0 / -bend[summits].mean(), summits.sum() / (middle.size * asked.spacing**2)
    depths = np.sort(middle[summits].max() - middle[summits])
    end = depths.mean()
else:
    radius, density, end = asked.radius, asked.density, asked.highest * asked.deviation
    # depths at equal steps of probability
    z = np.linspace(-asked.highest, asked.highest, 200001)
    share = np.cumsum(np.exp(-0.5 * z**2))
    depths = asked.deviation * (asked.highest - np.interp((np.arange(20000) + 0.5) / 20000 * share[-1], share, z))
factor = 4.0 / 3.0 * asked.modulus * np.sqrt(radius) * density
# closer near first touch, where the law rises steeply
compressions = 2.0 * max(end, depths.mean()) * (np.arange(1, asked.points + 1) / asked.points) ** 2
pressures = [factor * np.mean(np.maximum(c - depths, 0.0) ** 1.5) for c in compressions]
table = [[float(f"{c:.6e}"), float(f"{p:.6e}")] for c, p in zip(compressions, pressures) if p > 0.0]
print(f"# {density:.4g} summits in a unit of area, radius {radius:.4g}")
print(f"layer = {{ table = {table} }}")
