//! PETSc options, typed as in any PETSc program, reach the bodies.

use crate::common::{Run, case, distance, solve, solve_on};
use std::fs;

const SCENE: [&str; 2] = ["--set", "mesh.set.n=8"];
const TIGHT: [&str; 2] = ["--set", "method.stop={residual=1e-8,iterations=5000}"];

/// Solves the groove on a coarse mesh with PETSc options.
fn groove(options: &str) -> Run {
    let words: Vec<&str> = options.split_whitespace().collect();
    solve(case("groove"), &[&SCENE[..], &words].concat())
}

/// The same, down to a small residual.
fn tight(options: &str) -> Run {
    let words: Vec<&str> = options.split_whitespace().collect();
    solve(case("groove"), &[&SCENE[..], &TIGHT, &words].concat()).converged()
}

#[test]
fn options_reach_all_bodies_or_one() {
    let cases = [
        ("", ["condensed to 32 dofs by mumps"; 2]),
        ("--set solver=mumps", ["preonly + cholesky by mumps"; 2]),
        ("-ksp_type cg -pc_type hypre", ["cg + hypre"; 2]),
        ("-pc_type gamg", ["cg + gamg"; 2]),
        ("-ksp_type cg", ["cg + cholesky by mumps"; 2]),
        ("-pc_type lu", ["preonly + lu by mumps"; 2]),
        ("-pc_type lu -pc_factor_mat_solver_type petsc", ["preonly + lu by petsc"; 2]),
        ("-upper_pc_type cholesky", ["condensed to 32 dofs by mumps", "preonly + cholesky by mumps"]),
        ("-upper_ksp_type cg -lower_pc_type gamg", ["cg + gamg", "cg + cholesky by mumps"]),
        // what the program chooses for one body does not reach another one
        (
            "--method robin --set solver=hypre --set body.0.order=1 --set body.1.order=2 -mg_levels_ksp_max_it 2",
            ["cg + hypre", "cg + mg by hypre"],
        ),
        // a body with options of its own has these alone
        ("-ksp_type fcg -pc_type hypre -upper_pc_type jacobi", ["fcg + hypre", "cg + jacobi"]),
        ("-ksp_type fcg -pc_type hypre -lower_ksp_type gmres", ["gmres + cholesky by mumps", "fcg + hypre"]),
        ("-pc_type hypre -UPPER_pc_type icc -upper_pc_factor_levels 2", ["cg + hypre", "cg + icc by petsc"]),
    ];
    for (options, solvers) in cases {
        let run = groove(options).converged();
        assert_eq!(run.solvers(), solvers, "{options}");
        assert_eq!(run.warnings(), "", "{options}");
    }
}

/// preonly never runs on a stale factor: the history is the same to rounding.
/// What is typed for the matrix of all bodies reaches it, whatever the program would have chosen for them, and by `auto`, too.
#[test]
fn options_of_all_bodies_together() {
    let expected = [("hypre", "cg + hypre"), ("gamg", "cg + gamg"), ("cholesky", "cg + cholesky by mumps")];
    for (method, (pc, solver)) in ["auto", "newton"].into_iter().flat_map(|method| expected.map(|pair| (method, pair)))
    {
        let args = ["--method", method, "--set", "mesh.set.n=4", "-newton_ksp_type", "cg", "-newton_pc_type", pc];
        let ranks = if method == "auto" { 1 } else { 2 };
        let run = solve_on(ranks, case("groove3d"), &args).converged();
        assert_eq!((run.text("method"), run.solvers()), ("newton", vec![solver; 2]), "{method} {pc} {ranks}");
    }
}

#[test]
fn preonly_factors_anew_although_reuse_is_requested() {
    let (fresh, reused) = (tight("--set solver=mumps"), tight("-ksp_reuse_preconditioner"));
    assert_eq!(fresh.count("iterations"), reused.count("iterations"));
    assert_eq!(fresh.history()["residual"], reused.history()["residual"]);
}

#[test]
fn a_file_of_options_is_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("my.opts");
    fs::write(&file, "# a comment\n-ksp_type cg\n-pc_type hypre\n-upper_pc_type gamg\n").expect("a file");
    let path = file.display().to_string();
    assert_eq!(groove(&format!("-options_file {path}")).converged().solvers(), ["cg + hypre", "cg + gamg"]);
    let run = groove(&format!("-options_file {path} -lower_pc_type jacobi")).converged();
    assert_eq!(run.solvers(), ["cg + jacobi", "cg + gamg"]);
    // no body is left for these
    for option in ["-ksp_type", "-pc_type"] {
        assert!(run.warnings().contains(&format!("{option} was not used")), "{}", run.warnings());
    }
    let run = groove("-options_file missing.opts");
    assert_eq!(run.code, 5, "{}", run.said());
    assert!(run.stderr.contains("missing.opts"), "{}", run.stderr);
}

#[test]
fn a_good_option_of_a_solver_not_in_use_is_a_warning() {
    for options in ["-pc_gamg_threshold 0.1", "-upper_pc_hypre_type pilut", "-pc_hypre_boomeramg_max_iter 2"] {
        let run = groove(options).converged();
        let name = options.split_whitespace().next().unwrap_or_default();
        assert!(run.warnings().contains(name), "{}", run.warnings());
        assert!(run.stdout.contains("warning") && run.stdout.contains(name), "{}", run.stdout);
    }
    // a method without a matrix of all bodies; a sweep over methods has some of them
    assert!(groove("-newton_pc_type hypre").converged().warnings().contains("-newton_pc_type was not used"));
    // capitals are those of PETSc
    let own = groove("-KSP_Type cg -pc_type gamg -upper_pc_type icc").converged();
    assert_eq!((own.warnings(), own.solvers()), (String::new(), vec!["cg + gamg", "cg + icc by petsc"]));
    // it is in use in one body of two, or of another rank
    assert_eq!(groove("-pc_gamg_threshold 0.1 -pc_type gamg -lower_pc_type icc").converged().warnings(), "");
    let upper = ["-upper_pc_type", "gamg", "-upper_pc_gamg_threshold", "0.1"];
    assert_eq!(solve_on(2, case("groove"), &[&SCENE[..], &upper].concat()).converged().warnings(), "");
    // a body with options of its own does not read it
    let apart = groove("-pc_gamg_threshold 0.1 -lower_pc_type gamg").converged();
    assert!(apart.warnings().contains("-pc_gamg_threshold was not used"), "{}", apart.warnings());
}

#[test]
fn petsc_prints_what_it_is_asked_for() {
    let monitor = groove("-ksp_type cg -ksp_monitor").converged();
    assert!(monitor.stdout.contains("KSP Residual norm"), "{}", monitor.stdout);
    let one = groove("-ksp_type cg -upper_ksp_type cg -upper_ksp_monitor").converged();
    let count = |run: &Run| run.stdout.matches("KSP Residual norm").count();
    assert!(count(&one) > 0 && 2 * count(&one) <= count(&monitor) + 4, "{}", one.stdout);
    let view = groove("-ksp_view -ksp_type preonly").converged();
    assert!(
        view.stdout.contains("KSP Object: upper 1 MPI process") && view.stdout.contains("mumps"),
        "{}",
        view.stdout
    );
    let stages = groove("-log_view -ksp_type cg").converged().stdout;
    for stage in ["mesh", "discretize", "set-up", "iterate", "linear solve", "output"] {
        assert!(stages.contains(&format!("{stage}: ")), "{stage}: {stages}");
    }
    let log = groove("-log_view").converged();
    assert!(log.stdout.contains("Performance Summary") || log.stdout.contains("MatCholFctrNum"), "{}", log.stdout);
    let reason = groove("-ksp_type cg -ksp_converged_reason").converged();
    assert!(reason.stdout.contains("Linear solve converged"), "{}", reason.stdout);
    let help = groove("-help");
    assert_eq!(help.code, 0, "{}", help.stderr);
    assert!(help.stdout.contains("ksp_type") && help.stdout.contains("-log_view"), "{}", help.stdout);
    for run in [monitor, one, view, log, reason, help] {
        assert_eq!(run.stderr, "");
    }
}

/// To end a run at the first solve that does not converge is to steer its solvers: the bodies have some then.
#[test]
fn a_solve_that_must_converge_ends_the_run() {
    let good = groove("-ksp_error_if_not_converged").converged();
    assert_eq!(good.solvers(), ["preonly + cholesky by mumps"; 2]);
    let bad = groove("-ksp_type cg -pc_type jacobi -ksp_max_it 3 -ksp_error_if_not_converged");
    assert_eq!(bad.code, 5, "{}", bad.said());
    assert!(bad.stderr.contains("not converged") && bad.stderr.contains("DIVERGED_ITS"), "{}", bad.stderr);
}

/// `groove-held` on a coarse mesh by a method that PETSc's options reach.
fn held(options: &str) -> Run {
    let method = if options.contains("--method") { "" } else { "--method auto" };
    let all = format!("{method} --set mesh.set.n=8 --set method.stop={{residual=1e-8,iterations=200}} {options}");
    solve(case("groove-held"), &all.split_whitespace().collect::<Vec<_>>())
}

/// Inner solvers that end too early, or solve something else: forces summed anew find it out, or the answer is right.
#[test]
fn options_that_spoil_solves_are_found_out() {
    let exact = held("").converged();
    let pressure = &exact.contact()["pressure"];
    let options = [
        "-ksp_type cg -pc_type icc -ksp_atol 1e-2",
        "-ksp_type cg -pc_type hypre -ksp_atol 1",
        "-newton_ksp_type cg -newton_pc_type hypre -newton_ksp_atol 1e-1",
        "-ksp_type cg -pc_type icc -ksp_rtol 0.1",
        "-ksp_type richardson -pc_type icc -ksp_rtol 0.5",
        "-ksp_type preonly -pc_type icc",
        "-ksp_type cg -pc_type icc -pc_factor_shift_type nonzero -pc_factor_shift_amount 1e3",
        "--set solver=mumps -mat_mumps_icntl_35 1 -mat_mumps_cntl_7 1e-2",
        "--method robin --set method.robin={floor=1e300}",
    ];
    let mut found_out = 0;
    for options in options {
        let run = held(options);
        let off = distance(&run.contact()["pressure"], pressure);
        match run.code {
            0 => assert!(off < 1e-6, "{options}: {off:e}\n{}", run.said()),
            1 => {
                if run.text("status") == "inaccurate" {
                    assert!(off > 1e-9, "{options}: {off:e}\n{}", run.said());
                    // what is reported is what was found
                    let found = run.number("unbalanced");
                    assert!(found <= run.number("error_estimate") && run.report["error_bound"].is_null(), "{options}");
                }
                found_out += 1;
            }
            code => panic!("{options}: {code} {}", run.said()),
        }
    }
    assert!(found_out > 1, "{found_out}");
}

/// A factorisation that is replaced by the pivots of another matrix solves nothing, and no error is reported as if it did.
#[test]
fn a_factorisation_that_is_none_bounds_nothing() {
    let coarse = ["--set", "mesh.set.n=6", "--set", "method={stop={residual=1e-8,iterations=40}}"];
    let peak = solve(case("groove-held"), &coarse).converged().number("pairs/0/peak_pressure");
    let run =
        solve(case("groove-held"), &[&coarse[..], &["-pc_type", "cholesky", "-mat_mumps_cntl_4", "1e6"]].concat());
    let off = (run.number("pairs/0/peak_pressure") / peak - 1.0).abs();
    let is_told = run.code == 1 && run.report["error_estimate"].as_f64().is_none_or(|error| error > 0.1 * off);
    assert!(run.report["error_bound"].is_null() && is_told, "{off:e} {}", run.said());
}

/// An inaccurate result with three digits tells the tolerance that accepts it.
#[test]
fn an_inaccurate_result_tells_what_accepts_it() {
    let options = "--method newton-robin -ksp_type cg -pc_type icc -ksp_atol 1e-6";
    let refused = held(options);
    assert_eq!(refused.text("status"), "inaccurate", "{}", refused.said());
    let message = refused.text("message");
    let (_, set) = message.split_once("--set ").expect("the first advice");
    let (_, set) = set.split_once("--set method.stop.residual=").expect("the tolerance");
    let accepting = format!("{options} --set method.stop.residual={}", set.trim_end_matches(')'));
    held(&accepting).converged();
}

/// The error of a run that stopped too early, from its forces: never more than that from the energies, and not nothing.
#[test]
fn unbalanced_forces_are_a_part_of_the_error() {
    let sets = ["--set", "mesh.set.n=8", "--set", "contact.0.layer={linear={stiffness=1e5}}", "--method", "robin"];
    let at = |residual: &str| {
        let stop = format!("method.stop={{residual={residual},iterations=5000}}");
        solve(case("groove-held"), &[&sets[..], &["--set", &stop]].concat())
    };
    let least = at("1e-9").number("F1");
    for residual in ["1e-1", "1e-2", "1e-3"] {
        let run = at(residual);
        // the gap is small beside the compressions, so that all is about linear, and F1 half of the energy
        let error = (1.0 - run.number("F1") / least).sqrt();
        let share = run.number("unbalanced") / error;
        assert!((0.01..2.0).contains(&share), "{residual}: {share} of {error:e}");
    }
}

/// Options that look at a run leave it as it is, bit by bit, and say so where there is nothing to look at.
#[test]
fn options_that_look_change_nothing() {
    let counts = ["iterations", "sweeps", "factorizations", "dense_factorizations"];
    let of = |run: &Run| {
        (counts.map(|key| run.count(key)), run.number("residual"), run.report["bodies"][0]["solver"].clone())
    };
    for method in ["robin", "newton"] {
        let plain = groove(&format!("--method {method}")).converged();
        for options in
            ["-ksp_view", "-upper_ksp_monitor -ksp_converged_reason", "-mat_view ::ascii_info", "-log_view", "-help"]
        {
            let run = groove(&format!("--method {method} {options}")).converged();
            assert_eq!(of(&run), of(&plain), "{method} {options}");
            for name in options.split_whitespace().filter(|word| word.starts_with("-ksp") || word.starts_with("-upper"))
            {
                let option = format!("{name} ");
                assert!(
                    run.warnings().contains(option.trim()) && run.warnings().contains("nothing to show"),
                    "{}",
                    run.warnings()
                );
            }
        }
    }
}

/// A log of PETSc lies in the folder of results, which is not there before.
#[test]
fn a_log_is_a_result() {
    let run = groove("-log_view :results/log.txt").converged();
    assert!(fs::read_to_string(run.folder.join("log.txt")).expect("a log").contains("Performance Summary"));
}

/// PETSc's `mg` has as many levels as the program interpolates between, or is refused.
#[test]
fn multigrid_has_no_levels_that_nobody_made() {
    let peak = groove("").number("pairs/0/peak_pressure");
    for order in [1, 2] {
        let orders = format!("--set body.0.order={order} --set body.1.order={order}");
        let same = |options: &str| groove(&format!("{options} {orders}"));
        for options in
            ["-pc_type mg", "-upper_pc_type mg -lower_ksp_type cg -lower_pc_type icc", "-pc_type mg -pc_mg_levels 1"]
        {
            let found = same(options).converged().number("pairs/0/peak_pressure");
            assert!((found / peak - 1.0).abs() < 0.2, "{options}: {found} {peak}");
        }
        for options in
            ["-ksp_type cg -pc_type mg -pc_mg_levels 3", "--method newton -newton_pc_type mg -newton_pc_mg_levels 3"]
        {
            let run = same(options);
            assert!(run.code == 5 && run.stderr.contains("multigrid `mg` has 3 levels"), "{options}: {}", run.said());
        }
    }
}

/// Quadratic elements have a level of their own: half of the iterations, fewer with each, for the same pressures. What is typed for hypre
/// means hypre for all nodes.
#[test]
fn multigrid_of_quadratic_elements_has_two_levels() {
    let run_on = |ranks: usize, options: &str| {
        let words = "--set mesh.set.n=2 --set mesh.set.edge=4 --set method.stop={residual=1e-8} --set solver=hypre";
        let words: Vec<&str> = words.split_whitespace().chain(options.split_whitespace()).collect();
        solve_on(ranks, case("hertz-sphere"), &words).converged()
    };
    let run = |options: &str| run_on(1, options);
    let plain = run("-pc_type hypre");
    let inner = |run: &Run| run.count("inner_iterations");
    for (options, solver) in [
        ("", "cg + mg by hypre"),
        ("-newton_pc_type mg", "cg + mg by hypre"),
        ("-newton_mg_coarse_pc_type gamg", "cg + mg by gamg"),
        ("--method newton-robin", "cg + mg by hypre"),
    ] {
        let two = run(options);
        assert!(two.solvers().iter().all(|name| *name == solver), "{options}: {:?}", two.solvers());
        assert!(distance(&two.contact()["pressure"], &plain.contact()["pressure"]) < 1e-7, "{options}");
        if ["", "-newton_pc_type mg"].contains(&options) {
            let counts = [&two, &plain].map(inner);
            assert!(3 * counts[0] < 2 * counts[1], "{options}: {counts:?}");
        }
    }
    // another smoother, whose bounds hold for one matrix: it is set up for each contact set, where one rank keeps its own
    let one = inner(&run(""));
    let distributed = run_on(3, "");
    assert!(distance(&distributed.contact()["pressure"], &plain.contact()["pressure"]) < 1e-7, "three ranks");
    assert!(inner(&distributed) < 2 * one, "three ranks: {} and {one}", inner(&distributed));
    assert_eq!(distributed.solvers(), ["cg + mg by hypre"; 2]);
    let typed = run("-newton_pc_hypre_boomeramg_strong_threshold 0.5");
    assert!(typed.solvers().iter().all(|name| *name == "cg + hypre"), "{:?}", typed.solvers());
    // linear elements have one level
    assert!(run("--set body.0.order=1 --set body.1.order=1").solvers().iter().all(|name| *name == "cg + hypre"));
}

/// A limit of no iteration is refused for every solver, also for the estimates of eigenvalues in multigrid. Smoothers
/// may have none, and solvers that do not iterate read no limit.
#[test]
fn a_solver_without_iterations_is_refused() {
    for (options, named) in [
        ("--method newton --set solver=hypre -ksp_max_it 0", "-ksp_max_it is 0"),
        ("--method newton -newton_pc_type hypre -newton_ksp_max_it 0", "-newton_ksp_max_it is 0"),
        ("--method newton-robin --set solver=hypre -ksp_max_it -1", "-ksp_max_it is -1"),
        ("--set solver=icc -ksp_max_it 0", "-ksp_max_it is 0"),
        ("-ksp_type gmres -pc_type jacobi -ksp_max_it 0", "-ksp_max_it is 0"),
        ("-upper_pc_type gamg -upper_ksp_max_it 0", "-upper_ksp_max_it is 0"),
        ("-pc_type gamg -pc_gamg_esteig_ksp_max_it 0", "-pc_gamg_esteig_ksp_max_it is 0"),
    ] {
        let run = groove(options);
        assert_eq!(run.code, 5, "{options}: {}", run.said());
        assert!(run.stderr.contains(&format!("{named}: the solver would do nothing")), "{options}: {}", run.said());
    }
    for options in ["-pc_type cholesky -ksp_max_it 0", "-ksp_type preonly -pc_type lu -ksp_max_it 0"] {
        assert!(groove(options).converged().warnings().contains("-ksp_max_it was not used"), "{options}");
    }
    let smoother = groove("-pc_type gamg -mg_levels_ksp_max_it 0");
    assert!([0, 1].contains(&smoother.code), "{}", smoother.said());
}

/// Options of other programs with PETSc, and types that PETSc does not know, are refused with what takes their place.
#[test]
fn what_takes_the_place_of_an_option_is_told() {
    for (options, words) in [
        ("-mat_type baij", "matrices are AIJ"),
        ("--method newton -newton_vec_type cuda", "matrices are AIJ"),
        ("-snes_rtol 1e-8", "not PETSc's SNES"),
        ("-snes_monitor", "not PETSc's SNES"),
        ("-upper_pc_type mumps", "-upper_pc_type cholesky -upper_pc_factor_mat_solver_type mumps"),
        ("-pc_type bjacobi -sub_pc_type mumps", "-sub_pc_type cholesky -sub_pc_factor_mat_solver_type mumps"),
        ("-pc_type jacoby", "did you mean -pc_type jacobi?"),
        ("--method newton -newton_ksp_type gmers", "did you mean -newton_ksp_type gmres?"),
        ("-ksp_type nothing_like_it", "this PETSc does not know the type `nothing_like_it`"),
    ] {
        let run = groove(options);
        assert!(run.code == 5 && run.stderr.contains(words), "{options}: {}", run.said());
    }
}

/// Conjugate gradients that stagnate, because an option changes the problem, end with their last iteration.
#[test]
fn a_solve_that_stagnates_ends() {
    let run = held("--set solver=hypre -ksp_constant_null_space -ksp_max_it 1500");
    assert!(run.code == 1 && run.text("status") != "converged", "{}", run.said());
}

/// Where a sweep applies multigrid once, an option that steers the iteration lets it solve, and one that only looks is
/// told to show nothing.
#[test]
fn options_of_the_iteration_are_never_ignored() {
    let swept = |options: &str| held(&format!("--method newton-robin --set solver=hypre {options}")).converged();
    let once = swept("");
    assert_eq!(once.count("inner_iterations") % once.count("sweeps"), 0);
    let exact = swept("-ksp_rtol 1e-12 -ksp_converged_reason");
    assert_eq!(exact.warnings(), "");
    assert!(exact.stdout.matches("solve converged due to CONVERGED_RTOL").count() >= exact.count("sweeps"));
    assert!(exact.count("sweeps") < once.count("sweeps"), "{} {}", exact.count("sweeps"), once.count("sweeps"));
    assert!(exact.count("inner_iterations") > 4 * exact.count("sweeps"));
    assert!(swept("-upper_ksp_type gmres").count("sweeps") < once.count("sweeps"));
    let looking = swept("-ksp_monitor -upper_ksp_view");
    assert_eq!(looking.count("sweeps"), once.count("sweeps"));
    assert!(looking.warnings().contains("nothing to show for -ksp_monitor -upper_ksp_view"), "{}", looking.warnings());
    // solves that nobody makes have no reason to converge
    for options in ["--method newton -upper_ksp_converged_reason", "--method robin -newton_ksp_converged_reason"] {
        let run = held(&format!("{options} --set solver=mumps"));
        let option = options.split(' ').next_back().unwrap_or_default();
        assert!(run.warnings().contains(option), "{options}: {}", run.warnings());
    }
    // the preset of the scene is that of the matrix of all bodies, too
    for (solver, name) in [("icc", "cg + icc"), ("gamg", "cg + gamg")] {
        assert_eq!(held(&format!("--method newton --set solver={solver}")).converged().solvers(), [name; 2]);
    }
}

/// Algebraic multigrid of all bodies has the rigid motions of each, on one rank and on two. Without them it takes 115
/// iterations on one.
#[test]
fn multigrid_of_all_bodies_has_their_rigid_motions() {
    let words = ["--method", "newton", "--set", "mesh.set.n=4", "-newton_pc_type", "gamg"];
    let runs = [1, 2].map(|ranks| solve_on(ranks, case("groove3d"), &words).converged());
    let counts = [0, 1].map(|k| runs[k].count("inner_iterations"));
    assert!(counts.iter().all(|count| *count < 60), "{counts:?}");
}
