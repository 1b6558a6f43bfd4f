#!/usr/bin/env python3
"""Prepares a measured surface for a scene: scripts/library/heights.py FILE heights.npy [--detrend plane|parabola] [--missing VALUE]...

Reads text with numbers in rows (any separator, decimal commas), points in rows (x y height) with --points, ASCII grids of ESRI (.asc),
grids of Surfer (.grd, text or binary of version 6), SDF (ISO 25178-71, `pip install sdfio`), x3p (ISO 25178-72, `pip install x3pio`), and
what `pip install surfalize` reads of other instruments. Heights of the last three become mm. Points in any order, and gaps, need SciPy: the
surface is linear between the points around. The keys for the scene are printed.
"""

import argparse
import re
import struct
import sys
from pathlib import Path

import numpy as np


def rows(path, missing):
    """Returns the numbers of a text in rows, NaN where a field is no number or one of `missing`. Lines without numbers are skipped."""
    table = []
    for line in path.read_text(encoding="utf-8-sig", errors="replace").splitlines():
        line = line.strip()
        separator = next((s for s in (";", "\t") if s in line), None)
        if separator:
            line = line.replace(",", ".")
        separator = separator or ("," if "," in line else None)
        fields = [field.strip().strip('"') for field in line.rstrip(separator).split(separator)]
        values = [float(f) if re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", f) else np.nan for f in fields]
        if line and line[0] != "#" and (table or not np.isnan(values).all()):
            table.append([np.nan if f in missing else value for f, value in zip(fields, values)])
    if len({len(row) for row in table}) != 1:
        sys.exit(f"{path}: its rows have different numbers of fields")
    return np.array(table)


def esri(path):
    """Returns heights (upwards along y) and both distances of an ASCII grid of ESRI."""
    words = path.read_text().split()
    head = {}
    while words[0][0].isalpha():
        name, value = words.pop(0), words.pop(0)
        head[name.lower()] = float(value.replace(",", "."))
    heights = np.array(words, dtype=float).reshape(int(head["nrows"]), int(head["ncols"]))[::-1]
    heights[np.isin(heights, [head.get("nodata_value", -9999.0)])] = np.nan
    return heights, head.get("cellsize", head.get("dx")), head.get("cellsize", head.get("dy"))


def surfer(path):
    """Returns heights and both distances of a grid of Surfer."""
    data = path.read_bytes()
    if data[:4] == b"DSBB":
        columns, count, *box = struct.unpack("<hh4d", data[4:40])
        heights = np.frombuffer(data[56:], dtype="<f4").astype(float)
    else:
        words = data.decode().split()[1:]
        columns, count, *box = [int(w) for w in words[:2]] + [float(w) for w in words[2:6]]
        heights = np.array(words[8:], dtype=float)
    heights = heights.reshape(count, columns)
    heights[heights > 1.7e38] = np.nan
    return heights, (box[1] - box[0]) / (columns - 1), (box[3] - box[2]) / (count - 1)


def instrument(path):
    """Returns heights and both distances in mm, by a maintained reader of the format."""
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
    return 1e-3 * surface.data, 1e-3 * surface.step_x, 1e-3 * surface.step_y


def gridded(points):
    """Returns heights at as many places of a regular grid as there are points (x, y, height), both distances, and the first place."""
    from scipy.interpolate import griddata

    points = points[~np.isnan(points).any(axis=1)]
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    step = np.sqrt(np.prod(high - low) / len(points))
    counts = np.maximum(2, np.rint((high - low) / step).astype(int) + 1)
    dx, dy = (high - low) / (counts - 1)
    grid = np.meshgrid(np.linspace(low[0], high[0], counts[0]), np.linspace(low[1], high[1], counts[1]))
    return griddata(points[:, :2], points[:, 2], tuple(grid)), dx, dy, low


def filled(heights):
    """Returns heights without gaps: linear between the points around a gap, that of the nearest point beyond them."""
    from scipy.interpolate import griddata

    known = np.argwhere(np.isfinite(heights))
    for method in ("linear", "nearest"):
        gaps = np.argwhere(~np.isfinite(heights))
        if len(gaps):
            heights[tuple(gaps.T)] = griddata(known, heights[tuple(known.T)], gaps, method=method)
    return heights


def detrended(heights, degree):
    """Returns heights without their polynomial of least squares."""
    y, x = np.mgrid[0 : heights.shape[0], 0 : heights.shape[1]]
    x, y = (2.0 * x / max(1, x.max()) - 1.0), (2.0 * y / max(1, y.max()) - 1.0)
    terms = np.stack([(x**i * y**j).ravel() for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)
    known = np.isfinite(heights).ravel()
    factors = np.linalg.lstsq(terms[known], heights.ravel()[known], rcond=None)[0]
    return heights - (terms @ factors).reshape(heights.shape)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("file", type=Path)
parser.add_argument("output", help="ends in .npy")
parser.add_argument("--points", action="store_true", help="each row is x, y and a height")
parser.add_argument("--missing", action="append", default=[], help="number or word that stands for a point without a height")
parser.add_argument("--detrend", choices=["plane", "parabola"], help="what is subtracted")
asked = parser.parse_args()
start, origin, spacing = asked.file.read_bytes()[:5].lower(), (0.0, 0.0), None
if asked.points:
    heights, *spacing, origin = gridded(rows(asked.file, asked.missing))
elif start in (b"ncols", b"nrows"):
    heights, *spacing = esri(asked.file)
elif start[:4] in (b"dsaa", b"dsbb"):
    heights, *spacing = surfer(asked.file)
elif asked.file.suffix.lower() in (".csv", ".txt", ".asc", ".dat", ".xyz"):
    heights = rows(asked.file, asked.missing)
else:
    heights, *spacing = instrument(asked.file)
heights = np.asarray(heights, dtype=np.float64)
for value in asked.missing:
    try:
        heights[np.isclose(heights, float(value), rtol=5e-6, atol=0.0)] = np.nan
    except ValueError:
        pass  # a word
gaps = int(np.count_nonzero(~np.isfinite(heights)))
heights[~np.isfinite(heights)] = np.nan
if asked.detrend:
    heights = detrended(heights, {"plane": 1, "parabola": 2}[asked.detrend])
np.save(asked.output, filled(heights) if gaps else heights)
print(f"# {heights.shape[1]} x {heights.shape[0]} heights from {np.nanmin(heights):.3e} to {np.nanmax(heights):.3e}, {gaps} gaps filled")
print(f'[data.rough]\nfile = "{asked.output}"')
print(f"spacing = [{spacing[0]:.10g}, {spacing[1]:.10g}]" if spacing else "# spacing = distance of the heights")
if any(origin):
    print(f"origin = [{origin[0]:.10g}, {origin[1]:.10g}]")
