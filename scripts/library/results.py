#!/usr/bin/env python3
"""Reads the results of a run with numpy, pandas and meshio: scripts/library/results.py FOLDER

Cells begin with "# %%", as notebooks of Jupyter and editors have them. pandas and meshio may be missing: their cells are left out then.
"""

# %% the report: status, counts, forces, settings
import json
import sys
from pathlib import Path

import numpy as np

folder = Path(sys.argv[1])
report = json.loads((folder / "report.json").read_text())
print(report["status"], "in", report["iterations"], "iterations,", report["dofs"], "dofs")
for pair in report["pairs"]:
    print(*pair["bodies"], "force", pair["force"][0], "peak pressure", pair["peak_pressure"])

# %% the history: one row an iterate
history = np.genfromtxt(folder / "history.csv", delimiter=",", names=True, ndmin=1)
print("residuals", history["residual"])

# %% pressures at the contact points: the file of each pair is in contacts.csv
contacts = np.genfromtxt(folder / "contacts.csv", delimiter=",", names=True, dtype=None, encoding="utf-8", ndmin=1)
contact = np.genfromtxt(folder / str(contacts["table"][0]), delimiter=",", names=True)
force = np.sum(contact["weight"] * contact["pressure"])
print("pressures add up to", force)
closed = contact["compression"] > 0
print("contact covers", np.sum(contact["weight"][closed]), "of", np.sum(contact["weight"]))

# %% the same with pandas
try:
    import pandas
except ImportError:
    print("no pandas")
else:
    pairs = pandas.read_csv(folder / "contacts.csv").set_index(["surface_a", "surface_b"])
    print(pairs[["points", "closed", "peak_pressure", "table"]])
    frame = pandas.read_csv(folder / pairs["table"].iloc[0])
    print("mean pressure by pandas", np.average(frame["pressure"], weights=frame["weight"]))
    print(pandas.read_csv(folder / "history.csv")[["iteration", "residual", "closed"]].to_string(index=False))

# %% displacements and stresses of a run with --vtu
fields = sorted(folder.glob("*.vtu"))
try:
    import meshio
except ImportError:
    print("no meshio")
else:
    for path in fields:
        mesh = meshio.read(path)
        largest = {name: float(np.abs(values).max()) for name, values in mesh.point_data.items()}
        print(path.name, len(mesh.points), "points", largest)
