"""The groove solved by NGSolve, and compared with winkler. scripts/order calls it.

order.py solve P HMAX H0 RATIO B A END FILE    one solve by NGSolve; prints a line of JSON
order.py compare WINKLER FOLDER [--quick]      all solves; writes docs/benchmark-order.csv, its plot, and prints a table
"""

import csv
import json
import os
import resource
import subprocess
import sys

# Stiffness B and exponent a of the layer, and where contact ends, to seven digits from the reference.
LAYERS = [(1e-5, 1.0, 3.555372), (2.5e-5, 0.5, 3.454351), (1e-5, 0.3, 3.278391)]
REFERENCE = (10, 0.15, 0.002, 1.8)
# Runs of each solve, of which the fastest counts.
RUNS = 3


def seconds():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def lobatto(order):
    """Return the Gauss-Lobatto points and weights on -1 to 1."""
    import numpy as np
    from numpy.polynomial import legendre

    inner = legendre.legroots(legendre.legder([0] * order + [1])).real if order > 1 else []
    points = np.concatenate(([-1], np.sort(inner), [1]))
    return points, 2 / (order * (order + 1) * legendre.legval(points, [0] * order + [1]) ** 2)


def graded(start, end, largest, first, ratio, fine):
    """Return points from start to end whose steps grow from `first` at the `fine` end, or at both ("lr")."""
    import numpy as np

    if fine == "lr":
        half = graded(start, (start + end) / 2, largest, first, ratio, "l")
        return np.concatenate((half, (start + end - half[::-1])[1:]))
    steps, step, length = [0.0], first, end - start
    while steps[-1] + step < 0.999 * length:
        steps.append(steps[-1] + step)
        step = min(step * ratio, largest)
    if len(steps) > 1 and length - steps[-1] < 0.5 * (steps[-1] - steps[-2]):
        steps[-1] = length
    else:
        steps.append(length)
    return start + np.array(steps) if fine == "l" else end - np.array(steps)[::-1]


def mesh_of(largest, first, ratio, end):
    """Return two rows of rectangles, graded to the edge of the groove, to the end of the contact, and to the contact."""
    import numpy as np
    from netgen.csg import Pnt
    from netgen.meshing import Element1D, Element2D, FaceDescriptor, Mesh, MeshPoint
    import ngsolve

    parts = [graded(0, 3, largest, first, ratio, "r")]
    parts += [graded(3, end, largest, first, ratio, "lr")[1:], graded(end, 4, largest, first, ratio, "l")[1:]]
    xs, lower = np.concatenate(parts), graded(0, 1, max(largest, 0.34), first, ratio, "r")
    ys, top = np.concatenate((lower, (2 - lower[::-1])[1:])), len(lower)
    mesh = Mesh()
    mesh.dim = 2
    at = [[mesh.Add(MeshPoint(Pnt(x, y, 0))) for y in ys] for x in xs]
    mesh.Add(FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
    mesh.Add(FaceDescriptor(surfnr=2, domin=2, domout=0, bc=2))
    mesh.SetMaterial(1, "lower")
    mesh.SetMaterial(2, "upper")
    for i in range(len(xs) - 1):
        for j in range(len(ys) - 1):
            mesh.Add(Element2D(1 if j < top - 1 else 2, [at[i][j], at[i + 1][j], at[i + 1][j + 1], at[i][j + 1]]))
        for j, reverse, index in ((0, False, 1), (-1, True, 3), (top - 1, False, 5)):
            ends = [at[i][j], at[i + 1][j]]
            mesh.Add(Element1D(ends[::-1] if reverse else ends, index=index))
    for j in range(len(ys) - 1):
        mesh.Add(Element1D([at[-1][j], at[-1][j + 1]], index=2))
        mesh.Add(Element1D([at[0][j + 1], at[0][j]], index=4))
    for index, name in enumerate(["bottom", "axis", "top", "free", "contact"]):
        mesh.SetBCName(index, name)
    return ngsolve.Mesh(mesh)


def solve(order, largest, first, ratio, stiffness, power, end, file):
    """Solve by Newton's method with a line search: elements of an order, condensed, elasticity assembled once, sparse Cholesky."""
    import numpy as np
    from ngsolve import CF, SEGM, BilinearForm, BitArray, GridFunction, IfPos, InnerProduct, IntegrationRule, LinearForm
    from ngsolve import Grad, Integrate, Projector, SetNumThreads, Sym, VectorH1, div, ds, dx, x

    SetNumThreads(1)
    young, poisson, load = 2.1e5, 0.3, 10.0
    lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    mesh = mesh_of(largest, first, ratio, end)
    began = seconds()
    on = lambda body, **more: VectorH1(mesh, order=order, definedon=body, dirichletx="axis", **more)
    space = on("lower", dirichlety="bottom") * on("upper")
    (u1, u2), (v1, v2) = space.TnT()
    closing, of_test = (u1.Trace() - u2.Trace())[1], (v1.Trace() - v2.Trace())[1]
    elastic = BilinearForm(space, condense=True)
    for u, v, body in ((u1, v1, "lower"), (u2, v2, "upper")):
        strain = lambda w: Sym(Grad(w))
        elastic += (2 * shear * InnerProduct(strain(u), strain(v)) + lame * div(u) * div(v)) * dx(definedon=mesh.Materials(body))
    elastic += 0 * closing * of_test * ds("contact")
    elastic.Assemble()
    force = LinearForm(space)
    force += -load * v2.Trace()[1] * ds("top")
    force.Assemble()
    right = force.vec.CreateVector()
    right.data = force.vec
    right.data += elastic.harmonic_extension_trans * force.vec
    solution = GridFunction(space)
    g1, g2 = solution.components
    gap = 5e-4 * IfPos(1 - (x - 4) ** 2, 1 - (x - 4) ** 2, 0) ** 1.5
    compression = IfPos(g1[1] - g2[1] - gap, g1[1] - g2[1] - gap, 0)
    pressure = (compression / stiffness) ** (1 / power)
    tangent = IfPos(compression, (compression / stiffness) ** (1 / power - 1) / (power * stiffness), 0)
    energy = power / (1 + power) * compression * pressure
    degree = max(2 * order + 4, int(2 * order + order / power) if power >= 0.3 else 4 * order) + 2
    contact = ds("contact", intrules={SEGM: IntegrationRule(SEGM, degree)})
    springs, pressing = BilinearForm(space, condense=True), LinearForm(space)
    springs += tangent * closing * of_test * contact
    pressing += pressure * of_test * contact
    matrix = elastic.mat
    values = matrix.AsVector().FV().NumPy()
    of_elasticity, stiff = values.copy(), matrix.CreateMatrix()
    stiff.AsVector().data = matrix.AsVector()
    g2.Set(CF((0, -1.5 * stiffness * load**power)), definedon=mesh.Materials("upper"))
    free, active = BitArray(space.FreeDofs(True)), BitArray(space.ndof)
    active.Clear()
    for i, body in enumerate(("lower", "upper")):
        first_dof = space.Range(i).start
        for dof in np.flatnonzero(np.array(list(space.components[i].GetDofs(mesh.Materials(body))))):
            active.Set(first_dof + int(dof))
    free &= active
    project, u = Projector(free, True), solution.vec
    residual, step, work, before = (u.CreateVector() for _ in range(4))

    def potential():
        work.data = stiff * u
        return 0.5 * InnerProduct(u, work) - InnerProduct(right, u) + Integrate(energy * contact, mesh)

    def keys(sparse):
        _, columns, rows = sparse.CSR()
        rows = np.asarray(rows).astype(np.int64)
        return np.repeat(np.arange(len(rows) - 1), np.diff(rows)) * space.ndof + np.asarray(columns).astype(np.int64)

    work.data = u
    u.data = project * work
    places = inverse = None
    value = potential()
    for steps in range(1, 40):
        pressing.Assemble()
        springs.Assemble()
        residual.data = stiff * u
        residual.data += pressing.vec
        residual.data -= right
        residual.data = project * residual
        if places is None:
            known = keys(matrix)
            sorting = np.argsort(known)
            places = sorting[np.searchsorted(known[sorting], keys(springs.mat))]
        values[:] = of_elasticity
        values[places] += springs.mat.AsVector().FV().NumPy()
        if inverse is None:
            inverse = matrix.Inverse(free, inverse="sparsecholesky")
        else:
            inverse.Update()
        step.data = inverse * residual
        slope, length, before.data = -InnerProduct(residual, step), 1.0, u
        while True:
            u.data = before - length * step
            new = potential()
            if new <= value + 1e-4 * length * slope + 1e-13 * abs(value) or length < 1e-3:
                break
            length /= 2
        value = new
        if np.abs(step.FV().NumPy()).max() < 1e-9 * np.abs(u.FV().NumPy()).max():
            break
    u.data += elastic.harmonic_extension * u
    work.data = elastic.inner_solve * force.vec
    u.data += work
    ended = seconds()
    nodes, weights = lobatto(order)
    rule = IntegrationRule([((1 + node) / 2,) for node in nodes], [1.0] * (order + 1))
    points = mesh.MapToAllElements(rule, mesh.Boundaries("contact"))
    places, pressures = np.asarray(x(points)).reshape(-1, order + 1), np.asarray(pressure(points)).reshape(-1, order + 1)
    # edges may run either way
    along = np.argsort(places, axis=1)
    places, pressures = (np.take_along_axis(values, along, axis=1) for values in (places, pressures))
    rows = np.argsort(places[:, 0])
    areas = 0.5 * (places[:, -1:] - places[:, :1]) * weights
    np.save(file, np.stack((places[rows], pressures[rows], areas[rows])))
    print(json.dumps({"dofs": space.ndof, "solve": ended - began, "process": seconds(), "steps": steps}))


def between(reference, at):
    """Return the pressures of the reference at points, by the polynomials of its edges."""
    import numpy as np

    places, pressures, _ = reference
    edge = np.clip(np.searchsorted(places[:, 0], at, side="right") - 1, 0, len(places) - 1)
    nodes = lobatto(places.shape[1] - 1)[0]
    weights = np.array([1 / np.prod(node - np.delete(nodes, i)) for i, node in enumerate(nodes)])
    local = 2 * (at - places[edge, 0]) / (places[edge, -1] - places[edge, 0]) - 1
    apart = local[:, None] - nodes
    apart[apart == 0] = 1e-300
    shares = weights / apart
    return (shares * pressures[edge]).sum(1) / shares.sum(1)


def error(reference, places, pressures, areas):
    """Return the relative error of pressures at their points, in the mean square."""
    places, pressures, areas = (values.ravel() for values in (places, pressures, areas))
    exact = between(reference, places)
    return float(((areas * (pressures - exact) ** 2).sum() / (areas * exact**2).sum()) ** 0.5)


def run(words):
    """Return the output of a command and its CPU seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    output = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return output, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def peer(folder, settings, layer, runs=RUNS):
    """Solve by NGSolve in processes of their own. Return its numbers and its pressures."""
    import numpy as np

    file = os.path.join(folder, "pressures.npy")
    words = [sys.executable, __file__, "solve", *map(str, settings), *map(str, layer), file]
    numbers = [json.loads(run(words)[0].splitlines()[-1]) for _ in range(runs)]
    return min(numbers, key=lambda each: each["solve"]), np.load(file)


def ours(winkler, folder, order, tolerance, layer):
    """Solve on meshes adapted to a tolerance, and once more on the last of them. Return the row of the table and the pressures."""
    import numpy as np

    adapted, again = os.path.join(folder, "adapted"), os.path.join(folder, "again")
    keys = [f"body.{body}.order={order}" for body in range(2)]
    keys += [f"contact.0.layer={{power={{B={layer[0]},a={layer[1]}}}}}", "method={stop={residual=1e-10}}"]
    words = [winkler, "solve", "meshes/groove-held/scene.toml", "-q", *(word for key in keys for word in ("--set", key))]
    run([*words, "--tolerance", str(tolerance), "-o", adapted])
    _, whole = run([*words, "--tolerance", str(tolerance), "-o", adapted])
    best = None
    for _ in range(RUNS):
        _, process = run([*words, "--set", f"mesh={os.path.abspath(adapted)}/adapted.msh", "-o", again])
        report = json.load(open(f"{again}/report.json"))
        times = report["times"]
        # phases are wall seconds, which are more than those of the processor on a machine that does other work
        share = min(1.0, process / times["total"])
        spent = share * sum(times[phase] for phase in ("discretize", "set-up", "iterate"))
        best = min(best or (spent, process), (spent, process))
    table = list(csv.DictReader(open(f"{adapted}/contact-lower-upper.csv")))
    estimated = json.load(open(f"{adapted}/report.json"))
    last = estimated["rounds"][-1]
    columns = [np.array([float(row[name]) for row in table]) for name in ("x", "pressure", "weight")]
    numbers = {"dofs": report["dofs"], "solve": best[0], "process": best[1], "all_meshes": whole, "estimate": last["pressure"]}
    return numbers, columns


def plot(rows, file):
    """Plot seconds of the solve against the error: for each layer the fastest solves of both programs to each error."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "order", "font.size": 9})
    figure, all_axes = pyplot.subplots(1, len(LAYERS), sharey=True, figsize=(9, 3.2), layout="constrained")
    for axes, layer in zip(all_axes, LAYERS):
        for program, colour in (("NGSolve", "#7a7a7a"), ("winkler", "#1f6fb2")):
            solves = sorted((row["error"], row["solve"]) for row in rows if row["program"] == program and row["a"] == layer[1])
            axes.loglog(*zip(*solves), ".", color=colour, alpha=0.4) if solves else None
            front, least = [], float("inf")
            for error, seconds in solves:
                if seconds < least:
                    front.append((error, seconds))
                    least = seconds
            axes.loglog(*zip(*front), "o-", color=colour, label=program) if front else None
        axes.set_title(f"a = {layer[1]:g}")
        axes.set_xlabel("error of the pressures")
        axes.grid(alpha=0.3)
    all_axes[0].set_ylabel("CPU s of the solve")
    all_axes[1].legend()
    figure.savefig(file, metadata={"Date": None})


def compare(winkler, folder, quick):
    """Solve all cases, write the table, and print the fastest solve to each error."""
    rows = []
    add = lambda program, layer, settings, numbers, error: rows.append(
        {"program": program, "a": layer[1], "settings": settings, **numbers, "error": error})
    for layer in LAYERS[1:2] if quick else LAYERS:
        _, reference = peer(folder, REFERENCE, layer, 1)
        grids = [(h, h0, r) for h in (0.5, 1) for h0 in (0.3, 0.1, 0.03, 0.01) for r in (2, 3)]
        for order in (4,) if quick else (2, 3, 4, 5, 6):
            for grid in grids[:2] if quick else grids:
                numbers, pressures = peer(folder, (order, *grid), layer)
                add("NGSolve", layer, "order {} h {} to {} by {}".format(order, *grid), numbers, error(reference, *pressures))
        for order in (4,) if quick else (2, 3, 4, 6):
            for tolerance in (1e-3,) if quick else [digit * 10**-power for power in range(3, 7) for digit in (5, 2, 1)]:
                if order == 2 and tolerance < 1e-4:
                    continue
                numbers, columns = ours(winkler, folder, order, tolerance, layer)
                add("winkler", layer, f"order {order} tolerance {tolerance:g}", numbers, error(reference, *columns))
    file = os.path.join(folder if quick else "docs", "benchmark-order.csv")
    names = ["program", "a", "settings", "dofs", "error", "estimate", "solve", "process", "all_meshes"]
    with open(file, "w", newline="") as out:
        table = csv.DictWriter(out, names, extrasaction="ignore", lineterminator="\n")
        table.writeheader()
        table.writerows({k: f"{v:.3g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)
    plot(rows, file.replace(".csv", "-time-error.svg"))
    print("| a | error | NGSolve, s | winkler, s | ratio | all meshes, s |\n| --- | --- | ---: | ---: | ---: | ---: |")
    for layer in LAYERS:
        for least in (1e-3, 1e-4, 1e-5, 1e-6):
            good = lambda program: [row for row in rows if row["program"] == program and row["a"] == layer[1] and row["error"] <= least]
            both = [min(good(program), key=lambda row: row["solve"], default=None) for program in ("NGSolve", "winkler")]
            if all(both):
                theirs, own = (row["solve"] for row in both)
                print(f"| {layer[1]:g} | {least:g} | {theirs:.3f} | {own:.3f} | {own / theirs:.2f} | {both[1]['all_meshes']:.2f} |")
    print(f"Written: {file}", file=sys.stderr)


if __name__ == "__main__":
    if sys.argv[1] == "solve":
        p, *numbers = sys.argv[2:9]
        solve(int(p), *map(float, numbers), sys.argv[9])
    else:
        compare(sys.argv[2], sys.argv[3], sys.argv[4:] == ["--quick"])
