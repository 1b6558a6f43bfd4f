//! Every method minimises the same functional: one answer, and the sweeps that each may take.

use crate::common::here::solve_here;
use crate::common::{Scene, case, distance, root, solve, solve_on, text_of};

/// A case without its method: default settings.
fn plain(scene: &str) -> Scene {
    Scene::new(text_of(scene).split("[method]").next().unwrap_or_default())
}

/// What issue and guide promise of the default on the paper's mesh.
#[test]
fn the_default_is_fast() {
    let solved = |scene: &Scene, more: &[&str]| {
        let run = solve(scene, more).converged();
        assert!(run.number("residual") <= 1e-8, "{}", run.said());
        run
    };
    let held = plain("groove-held");
    let hard = ["--set", "contact.0.layer.power={B=1e-6, a=0.1}"];
    for (scene, more, steps) in [(&plain("groove"), &[][..], 7), (&held, &[], 5), (&held, &hard, 3)] {
        let run = solved(scene, more);
        assert_eq!((run.text("method"), run.count("iterations"), run.count("sweeps")), ("newton", steps, 0));
        // K is eliminated once a body, the joint matrix is factored once a step, and no body is solved for
        let work = ["factorizations", "dense_factorizations", "body_solves"].map(|name| run.count(name));
        assert_eq!(work, [2, steps, 0]);
    }
    // by sweeps, and with bodies that are too large to condense: one factorisation a step
    let sweeps = solved(&held, &[&hard[..], &["--method", "newton-robin"]].concat());
    assert!(sweeps.count("sweeps") <= 350, "{}", sweeps.count("sweeps"));
    let large = solved(&held, &[&hard[..], &["--set", "solver=mumps"]].concat());
    assert_eq!((large.text("method"), large.count("iterations"), large.count("factorizations")), ("newton", 3, 3));
}

/// Layers from far stiffer than the blocks to far softer, linear to a = 0.02, from both starts: few steps, and of those that
/// cannot be had to 1e-8 it is said so.
#[test]
fn any_power_law_takes_few_steps() {
    for (scene, most) in [("groove-held", 5), ("groove", 12)] {
        for start in ["\"auto\"", "{normal=1e-4}"] {
            for b in ["1e-12", "1e-7", "2e-4", "1e-2"] {
                for a in ["0.02", "0.1", "1"] {
                    let sets = [&format!("contact.0.layer.power={{B={b}, a={a}}}"), &format!("method.start={start}")];
                    let run = solve_here(plain(scene), &sets.each_ref().map(|set| set.as_str()));
                    // p'(c) times the rounding of c is 1e-8 of p and more
                    let rounded = b == "1e-12" && a != "1";
                    let steps = run.count("iterations");
                    match run.text("status") {
                        "roundoff-limited" if rounded => {
                            assert!(run.number("residual") < 4e-7 && steps <= 10, "{}", run.said())
                        }
                        status => {
                            assert!(status == "converged" && steps <= most, "{scene} B={b} a={a}: {}", run.said())
                        }
                    }
                }
            }
        }
    }
}

/// Bodies with multigrid: the Newton matrix has one multigrid for all, and bodies have none of their own.
#[test]
fn multigrid_over_all_bodies() {
    let typed = |solver: &str, options: &[&str]| {
        let solver = format!("solver={solver}");
        let sets = ["mesh.set.n=6", "body.0.order=1", "body.1.order=1", "method={}", &solver];
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        solve(case("hertz-sphere"), &sets.chain(options.iter().copied()).collect::<Vec<_>>()).converged()
    };
    let run = |solver: &str| typed(solver, &[]);
    let (multigrid, condensed) = (run("hypre"), run("condensed"));
    assert_eq!((multigrid.text("method"), condensed.text("method")), ("newton", "newton"));
    assert!(distance(&multigrid.contact()["pressure"], &condensed.contact()["pressure"]) < 1e-7);
    // as many steps, although they are inexact; one set-up a step at most
    let steps = multigrid.count("iterations");
    assert_eq!([steps, condensed.count("iterations")], [4, 4]);
    assert!((1..=steps).contains(&multigrid.count("factorizations")), "{}", multigrid.count("factorizations"));
    assert_eq!([multigrid.count("body_solves"), multigrid.count("sweeps")], [0, 0]);
    // what is typed for one body reaches it: then bodies have multigrid of their own
    let sweeps = typed("hypre", &["-lower_ksp_rtol", "1e-8"]);
    assert_eq!(sweeps.text("method"), "newton-robin");
    assert!(sweeps.count("inner_iterations") > multigrid.count("inner_iterations"));
    assert_eq!(sweeps.count("body_solves"), 2 * sweeps.count("sweeps"));
}

/// Linear steps end by what the laws leave: pressures of stiff layers are right as soon as with exact steps, and no step is restarted once
/// the contact is found.
#[test]
fn inexact_steps_are_as_many_as_exact_ones() {
    for stiffness in ["1e5", "1e9"] {
        let run = |solver: &str| {
            let (solver, layer) =
                (format!("solver={solver}"), format!("contact.0.layer={{linear={{stiffness={stiffness}}}}}"));
            let sets = ["body.0.order=1", "body.1.order=1", "method={}", &solver, &layer];
            solve_here(case("hertz-sphere"), &sets).converged()
        };
        let (inexact, exact) = (run("hypre"), run("condensed"));
        assert_eq!(inexact.count("iterations"), exact.count("iterations"), "{stiffness}");
        assert!(distance(&inexact.contact()["pressure"], &exact.contact()["pressure"]) < 2e-8, "{stiffness}");
    }
}

/// Stiff and changed rows are solved exactly: one set-up serves all steps, and a run with layers that are all but rigid costs at most half as many
/// iterations more than one with soft ones (ten times as many if nothing is solved exactly). Elements of both orders, which have two kinds of
/// multigrid.
#[test]
fn rigid_layers_cost_multigrid_no_more_than_soft_ones() {
    for order in ["1", "2"] {
        let run = |stiffness: &str| {
            let layer = format!("contact.0.layer={{linear={{stiffness={stiffness}}}}}");
            let orders = [0, 1].map(|body| format!("body.{body}.order={order}"));
            let sets = [&orders[0], &orders[1], "method={}", "solver=hypre", &layer];
            solve_here(case("hertz-sphere"), &sets).converged()
        };
        let (soft, rigid) = (run("1e4"), run("1e9"));
        assert_eq!((soft.count("patches"), soft.count("factorizations")), (0, 1));
        assert_eq!((rigid.count("patches"), rigid.count("factorizations")), (rigid.count("iterations"), 1));
        let [hard, easy] = [&rigid, &soft].map(|run| run.count("inner_iterations"));
        assert!(2 * hard <= 3 * easy, "order {order}: {hard} {easy}");
    }
}

/// Rigid motions of all bodies around multigrid: iterations do not grow with the number of bodies (56, 150 and 223 without). Two bodies of
/// which one is held have no use for them.
#[test]
fn many_bodies_cost_multigrid_no_more_iterations() {
    for k in [2, 4, 6] {
        let set = format!("mesh.set.k={k}");
        let run = solve(case("blocks"), &["--set", &set, "--set", "solver=hypre", "--set", "output.plots=false"]);
        let run = run.converged();
        assert!(run.count("inner_iterations") <= 40, "{} bodies: {}", k * k * k, run.said());
        assert_eq!(run.text("linear_step"), "cg + hypre with rigid motions of all bodies");
    }
    let alone = solve(case("groove3d"), &["--set", "mesh.set.n=4", "--set", "method={}", "--set", "solver=hypre"]);
    assert_eq!(alone.converged().text("linear_step"), "cg + hypre");
}

/// Layers far stiffer than the blocks: what rounding leaves of residuals on rigid motions is taken out in each iteration, so that the preconditioner
/// stays positive definite. The answer is that of a factorisation.
#[test]
fn many_bodies_under_stiff_layers_have_a_definite_preconditioner() {
    for stiffness in ["1e4", "1e6"] {
        let layer = format!("contact.0.layer={{linear={{stiffness={stiffness}}}}}");
        let run = |solver: &str| {
            let sets = [solver, &layer, "output.plots=false", "output.pairs=all"];
            solve_here(case("blocks"), &sets).converged()
        };
        let [multigrid, direct] = ["solver=hypre", "solver=mumps"].map(run);
        assert!(multigrid.count("inner_iterations") <= 50, "{}", multigrid.said());
        let [ours, theirs] = [&multigrid, &direct].map(|run| run.contact_of(0)["pressure"].to_vec());
        assert!(distance(&ours, &theirs) < 1e-6, "{stiffness}: {}", distance(&ours, &theirs));
    }
}

/// Rigid bodies foretell a large curved contact, and Newton's steps need not grow it from within.
#[test]
fn rigid_bodies_foretell_the_contact() {
    let sets = ["mesh.set={n=14,edge=1}", "body.0.order=1", "body.1.order=1", "solver=hypre", "method={}"];
    let run = solve(case("hertz-sphere"), &sets.iter().flat_map(|set| ["--set", set]).collect::<Vec<_>>()).converged();
    assert!(run.count("iterations") <= 6, "{}", run.said());
    // the first step finds the contact but for its edge: 200 points
    let closed = run.history().counts("closed");
    let last = closed[closed.len() - 1];
    assert!(last > 100 && closed[0].abs_diff(last) <= 40, "{closed:?}");
}

/// Loads that push a body off its contact have no solution: said at once, by every method.
#[test]
fn a_body_that_is_pulled_off() {
    for method in ["auto", "robin", "newton", "newton-robin", "semismooth"] {
        let off = ["--method", method, "--set", "body.1.load.0.pressure=-10", "--set", "mesh.set.n=4"];
        let run = solve(case("groove-held"), &off);
        assert_eq!((run.code, run.text("status"), run.count("sweeps")), (1, "unbounded", 0), "{method}");
    }
}

/// A tower of blocks that only contact holds, under a load that leans: each joint carries the whole of it. Rigid motions are deflated, so
/// its height hardly matters: without that the sweeps are 27 and 53.
#[test]
fn a_tower_takes_as_long_as_a_wall() {
    let geo = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/stack/stack.geo");
    let tower = |rows: usize| {
        let mut text =
            format!("dimension = 2\nmesh = {{ geo = \"{geo}\", set = {{ rows = {rows}, n1 = 4, n2 = 3, n3 = 5 }} }}\n");
        for block in 1..=rows {
            let bottom = if block == 1 { "{ on = \"b1_bottom\", y = 0 }, " } else { "" };
            let fix = format!("fix = [{bottom}{{ on = \"b{block}_left\", x = 0 }}]");
            text += &format!("[[body]]\nname = \"b{block}\"\norder = 1\nyoung = 2.1e5\npoisson = 0.3\n{fix}\n");
        }
        text += &format!("load = [{{ on = \"b{rows}_top\", pressure = \"10 + 2*x\" }}]\n");
        for block in 1..rows {
            let between = format!("between = [\"b{block}_top\", \"b{}_bottom\"]", block + 1);
            text += &format!("[[contact]]\n{between}\nlayer = {{ linear = {{ stiffness = 2e5 }} }}\n");
        }
        let run = solve(Scene::new(text), &["--method", "newton-robin"]).converged();
        for joint in 0..rows - 1 {
            let force = run.number(&format!("pairs/{joint}/force/0/1"));
            assert!((force + 11.0).abs() < 1e-6, "joint {joint} of {rows} blocks carries {force}");
        }
        run.count("sweeps")
    };
    let sweeps = [tower(4), tower(12)];
    assert_eq!(sweeps, [17, 19]);
}

/// Two clamped leaves of a spring, the shorter one below, which touch at its tip alone; `n` elements along the upper.
fn leaves(n: usize, layer: &str) -> Scene {
    let mesh = root().join("tests/stress/meshes/leaves.geo");
    let set = format!("l1 = 200, t1 = 4, n1 = {}, l2 = 300, t2 = 6, n2 = {n}, through = 2", 7 * n / 10);
    let body = |name: &str, more: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = 2\nyoung = 2.1e5\npoisson = 0\nfix = [{{ on = \"{name}_left\", x = 0, y = 0 }}]\n{more}\n"
        )
    };
    Scene::new(format!(
        "dimension = 2\nplane = \"stress\"\nmesh = {{ geo = \"{}\", set = {{ {set} }} }}\n{}{}[[contact]]\nbetween = [\"b1_top\", \"b2_bottom\"]\nlayer = {{ {layer} }}\n",
        mesh.display(),
        body("b2", "load = [{ on = \"b2_right\", force = [0, -5] }]"),
        body("b1", ""),
    ))
}

/// Slender bodies peel off each other in a few steps, as many on fine meshes as on coarse ones, by smoothed laws; to the answer of a start that
/// needs none. Beams share the load of 5 so that 2 goes through the tip.
#[test]
fn leaves_peel_in_a_few_steps() {
    for (layer, most) in [("linear = { stiffness = 1e7 }", 14), ("power = { B = 1e-5, a = 0.5 }", 16)] {
        let mut steps = Vec::new();
        for n in [60, 120] {
            let run = solve(&leaves(n, layer).path, &["--method", "newton"]).converged();
            steps.push(run.count("iterations"));
            let smoothed = run.history().counts("smoothed");
            assert_eq!(smoothed.last(), Some(&run.count("smoothed_steps")));
            assert!(run.count("smoothed_steps") > 0, "{}", run.said());
            assert!((run.number("pairs/0/force/1/1") - 2.0).abs() < 2e-3, "{}", run.said());
            // small load steps
            let steps = ["--set", "method={name=\"newton\", steps=20}"];
            let reference = solve(&leaves(n, layer).path, &steps).converged().contact();
            let apart = distance(&run.contact()["pressure"], &reference["pressure"]);
            assert!(apart < 1e-7, "{layer} {n}: {apart:e}");
        }
        assert!(steps[0].abs_diff(steps[1]) <= 1 && steps[0].max(steps[1]) <= most, "{layer}: {steps:?}");
    }
}

/// Smoothed laws are the same with multigrid, by one factorisation, and on two ranks.
#[test]
fn leaves_peel_by_any_linear_step() {
    let scene = leaves(60, "linear = { stiffness = 1e5 }");
    let whole = solve(&scene.path, &["--method", "newton"]).converged();
    let pressure = &whole.contact()["pressure"];
    let others: [(usize, &[&str]); 3] = [
        (1, &["--method", "newton", "--set", "solver=hypre"]),
        (1, &["--method", "newton", "--set", "solver=mumps"]),
        (2, &["--method", "newton"]),
    ];
    for (ranks, args) in others {
        let run = solve_on(ranks, &scene.path, args);
        // MUMPS leaves about as much rounding as is allowed
        assert_eq!(run.code, 0, "{args:?}: {}", run.said());
        // inexact steps may come to the laws without the path
        let is_smoothed = run.count("smoothed_steps") > 0 || args.contains(&"solver=hypre");
        assert!(is_smoothed && run.count("iterations") <= 15, "{args:?}: {}", run.said());
        let apart = distance(&run.contact()["pressure"], pressure);
        assert!(apart < 1e-6, "{args:?}: {apart:e}");
    }
}
