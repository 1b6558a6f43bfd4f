//! PETSc in earnest: failing factorisations, stale ones, several ranks, PETSc's own options.
//!
//! A process holds one session, so each test starts this program once more, for itself alone.

use crate::common::alone::{TIMEOUT, alone, expect_success};
use std::time::Instant;
use winkler::error::Result;
use winkler::internals::solver::options::{UserOptions, unread};
use winkler::petsc::{Int, Ksp, Matrix, Rows, Scope, Session};

fn words(line: &str) -> Vec<String> {
    line.split_whitespace().map(String::from).collect()
}

/// A chain of `n` springs, held at both ends.
fn chain(session: &Session, n: usize) -> Result<Matrix> {
    let (mut row_ptr, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for row in 0..n as Int {
        for column in (row - 1).max(0)..=(row + 1).min(n as Int - 1) {
            columns.push(column);
            values.push(if column == row { 2.0 } else { -1.0 });
        }
        row_ptr.push(columns.len() as Int);
    }
    let mut matrix = Matrix::from_csr(session, 1, row_ptr, columns, values)?;
    matrix.set_spd()?;
    Ok(matrix)
}

fn solver(session: &Session, prefix: &str, matrix: &Matrix) -> Result<Ksp> {
    let mut ksp = Ksp::new(session, prefix)?;
    ksp.set_operator(matrix)?;
    ksp.set_from_options()?;
    Ok(ksp)
}

/// Largest entry of `b - A x`.
fn residual(matrix: &Matrix, b: &[f64], x: &[f64]) -> Result<f64> {
    let mut ax = vec![0.0; b.len()];
    matrix.multiply(x, &mut ax)?;
    Ok(ax.iter().zip(b).map(|(ax, b)| (b - ax).abs()).fold(0.0, f64::max))
}

#[test]
fn a_failed_factorisation_is_a_reason_and_not_the_end() {
    for (test, line) in [
        ("mumps", "-ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type mumps"),
        ("petsc", "-ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type petsc"),
        ("lu", "-ksp_type cg -pc_type lu -pc_factor_mat_solver_type petsc"),
    ] {
        let environment = [("WINKLER_WORDS", line)];
        let output =
            alone("parallel::petsc::a_failed_factorisation_is_a_reason_and_not_the_end", 0, &environment, || {
                let line = std::env::var("WINKLER_WORDS").unwrap_or_default();
                let session = Session::start(&words(&line))?;
                let mut matrix = chain(&session, 2)?;
                // 1 -1 -1 1 is singular.
                matrix.update(|values| values.copy_from_slice(&[1.0, -1.0, -1.0, 1.0]))?;
                let ksp = solver(&session, "", &matrix)?;
                ksp.set_up()?;
                assert!(ksp.failure().is_some());
                let (b, mut x) = ([1.0, 1.0], [0.0; 2]);
                let solved = ksp.solve(&b, &mut x)?;
                println!("REASON {}", solved.reason);
                assert!(solved.reason.to_string().starts_with("DIVERGED_PC_FAILED: "), "{}", solved.reason);
                // Repaired, it works again.
                matrix.update(|values| values.copy_from_slice(&[2.0, -1.0, -1.0, 2.0]))?;
                assert!(ksp.solve(&b, &mut x)?.reason.converged());
                assert_eq!(ksp.failure(), None);
                assert!(residual(&matrix, &b, &x)? < 1e-12);
                Ok(())
            });
        if output.is_none() {
            return;
        }
        let out = expect_success(output);
        assert!(out.contains("NUMERIC_ZEROPIVOT"), "{out}");
        assert_eq!(out.contains("INFOG(1)=-10"), test == "mumps", "{out}");
    }
}

#[test]
fn preonly_never_solves_with_an_old_factor() {
    expect_success(alone("parallel::petsc::preonly_never_solves_with_an_old_factor", 0, &[], || {
        let line = "-ksp_type preonly -pc_type cholesky -ksp_reuse_preconditioner -cg_ksp_type cg -cg_pc_type cholesky -cg_ksp_rtol 1e-12";
        let session = Session::start(&words(line))?;
        let mut matrix = chain(&session, 50)?;
        let direct = solver(&session, "", &matrix)?;
        let lagged = solver(&session, "cg_", &matrix)?;
        let (b, mut x) = (vec![1.0; 50], vec![0.0; 50]);
        direct.solve(&b, &mut x)?;
        lagged.set_reuse_preconditioner(true)?;
        assert_eq!(lagged.solve(&b, &mut x)?.iterations, 1);
        matrix.update(|values| values[0] = 30.0)?;
        direct.solve(&b, &mut x)?;
        assert!(residual(&matrix, &b, &x)? < 1e-10);
        // The kept factor is one of another matrix: more iterations, the same solution.
        let solved = lagged.solve(&b, &mut x)?;
        assert!(solved.iterations > 1 && residual(&matrix, &b, &x)? < 1e-8, "{solved:?}");
        assert!(direct.set_reuse_preconditioner(true).is_err());
        Ok(())
    }));
}

#[test]
fn a_type_that_does_not_exist_is_refused_in_petscs_words() {
    expect_success(alone("parallel::petsc::a_type_that_does_not_exist_is_refused_in_petscs_words", 0, &[], || {
        let session = Session::start(&words("-d_pc_type nosuch"))?;
        let error = solver(&session, "d_", &chain(&session, 9)?).err().expect("no such type");
        assert!(error.message().contains("KSPSetFromOptions"), "{error}");
        assert!(error.to_string().contains("requested PC type nosuch"), "{error}");
        Ok(())
    }));
}

#[test]
fn a_solver_keeps_its_matrix_and_the_session() {
    expect_success(alone("parallel::petsc::a_solver_keeps_its_matrix_and_the_session", 0, &[], || {
        let session = Session::start(&words("-ksp_type cg -pc_type none -ksp_rtol 1e-12"))?;
        let matrix = chain(&session, 1000)?;
        let ksp = solver(&session, "", &matrix)?;
        drop(matrix);
        drop(session);
        // Memory that was given back would be taken by these.
        let others: Vec<Vec<f64>> = (0..20).map(|_| vec![7.0; 3000]).collect();
        let mut x = vec![0.0; 1000];
        assert!(ksp.solve(&[1.0; 1000], &mut x)?.reason.converged());
        assert!((x[499] - 500.0 * 501.0 / 2.0).abs() < 1e-3, "{}", x[499]);
        drop(others);
        Ok(())
    }));
}

#[test]
fn options_come_from_line_file_and_environment() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("petsc.opt");
    std::fs::write(&file, "# a comment\n-pc_type sor\n-ksp_rtol 1e-3\n").expect("a file");
    let file = file.to_str().expect("a plain path");
    let environment = [("PETSC_OPTIONS", "-ksp_max_it 7"), ("WINKLER_FILE", file)];
    expect_success(alone("parallel::petsc::options_come_from_line_file_and_environment", 0, &environment, || {
        let file = std::env::var("WINKLER_FILE").unwrap_or_default();
        let session = Session::start(&words(&format!("-ksp_type cg -options_file {file} -shift -1e-3")))?;
        let upper = UserOptions::read(&session).of("upper");
        for (name, value) in [("ksp_type", "cg"), ("pc_type", "sor"), ("ksp_rtol", "1e-3"), ("ksp_max_it", "7")] {
            assert_eq!(upper.typed(name), Some(value));
        }
        let error = unread(&session, &["upper"], &[]).expect_err("PETSc has no -shift");
        assert!(error.message().ends_with("the option -shift"), "{error}");
        Ok(())
    }));
}

#[test]
fn a_missing_options_file_is_reported_in_petscs_words() {
    expect_success(alone("parallel::petsc::a_missing_options_file_is_reported_in_petscs_words", 0, &[], || {
        let error = Session::start(&words("-options_file nosuch.opt")).err().expect("no such file");
        // the sentence around the name differs between versions
        assert!(error.to_string().contains("nosuch.opt"), "{error}");
        assert_eq!(winkler::error::Error::from(error).kind().exit_code(), 5);
        Ok(())
    }));
}

#[test]
fn an_option_read_on_one_rank_is_read() {
    expect_success(alone("parallel::petsc::an_option_read_on_one_rank_is_read", 2, &[], || {
        let line = "-lower_ksp_rtol 1e-3 -upper_ksp_rtol 1e-9 -upper_ksp_rtoll 1e-9 -pc_sor_its 2 -newton_ksp_rtol 1";
        let session = Session::start(&words(line))?;
        let bodies = ["upper", "lower"];
        // Each rank has one body, and tells PETSc only what concerns that.
        let body = bodies[session.rank()];
        let solvers = [UserOptions::read(&session).of(body)];
        let matrix = chain(&session, 9)?;
        let ksp = solver(&session, solvers[0].prefix(), &matrix)?;
        ksp.set_up()?;
        let error = unread(&session, &bodies, &solvers).expect_err("a typing mistake");
        assert!(error.message().ends_with("the option -upper_ksp_rtoll"), "{error}");
        assert_eq!(error.advice(), Some("did you mean -upper_ksp_rtol?"));
        session.options().clear("-upper_ksp_rtoll")?;
        // both count as read now
        for name in ["-pc_sor_its", "-newton_ksp_rtol"] {
            session.options().clear(name)?;
            session.options().set(name, Some("2"))?;
        }
        let warnings = unread(&session, &bodies, &solvers)?;
        assert!(warnings.len() == 2 && warnings.iter().all(|text| text.contains("was not used")), "{warnings:?}");
        assert!(warnings[0].contains("-newton_ksp_rtol") && warnings[1].contains("-pc_sor_its"), "{warnings:?}");
        assert_eq!(session.options().left()?, []);
        Ok(())
    }));
}

#[test]
fn a_panic_on_one_rank_ends_the_others() {
    let test = "parallel::petsc::a_panic_on_one_rank_ends_the_others";
    let start = Instant::now();
    let output = alone(test, 2, &[], || {
        use mpi::traits::CommunicatorCollectives;
        let session = Session::start(&[])?;
        assert!(session.rank() == 0, "the planted panic");
        session.world().barrier();
        Ok(())
    });
    if let Some(output) = output {
        assert!(!output.status.success());
        assert!(start.elapsed() < TIMEOUT, "the other rank waited");
        assert!(String::from_utf8_lossy(&output.stderr).contains("the planted panic"));
    }
}

/// One rank that needs PETSc before the others would wait for them for ever.
#[test]
fn several_ranks_start_petsc_together() {
    let inside = || {
        let session = Session::start(&[])?;
        assert!(session.size() == 2);
        Ok(())
    };
    expect_success(alone("parallel::petsc::several_ranks_start_petsc_together", 2, &[], inside));
}

/// A chain of springs on three ranks, of which the second has none: each solver finds the solution of the first matrix, and of the next one
/// with values changed in place on both sides of the cut.
#[test]
fn a_matrix_of_several_ranks() {
    let inside = || -> Result<()> {
        let solvers = "-a_ksp_type cg -a_pc_type hypre -a_ksp_rtol 1e-12 -b_ksp_type cg -b_pc_type gamg -b_ksp_rtol 1e-12 \
                       -c_ksp_type preonly -c_pc_type cholesky -c_pc_factor_mat_solver_type mumps";
        let session = Session::start(&words(solvers))?;
        let n = 60;
        let first: [usize; 4] = [0, 40, 40, n];
        let own = first[session.rank()]..first[session.rank() + 1];
        let exact = |row: usize| ((row * row) % 7) as f64;
        for prefix in ["a_", "b_", "c_"] {
            let (mut row_ptr, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
            for row in own.clone() {
                let entries = [(row.wrapping_sub(1), -1.0), (row, 2.0), (row + 1, -1.0)];
                for (column, value) in entries.into_iter().filter(|entry| entry.0 < n) {
                    columns.push(column as Int);
                    values.push(value);
                }
                row_ptr.push(columns.len() as Int);
            }
            let rows = Rows::of_process(own.start, n, row_ptr, columns, values)?;
            let mut matrix = Matrix::new(&session, 1, rows)?;
            matrix.set_spd()?;
            matrix.set_near_null_space(&[vec![1.0; own.len()]])?;
            assert_eq!((matrix.rows(), matrix.scope()), (own.len(), Scope::World));
            assert!(Ksp::new(&session, prefix)?.set_operator(&matrix).is_err());
            let mut ksp = Ksp::of(&session, Scope::World, prefix)?;
            ksp.set_operator(&matrix)?;
            ksp.set_from_options()?;
            for scale in [1.0, 3.0] {
                matrix.update(|values| values.iter_mut().for_each(|value| *value *= scale))?;
                let at = |row: usize| if row < n { exact(row) } else { 0.0 };
                let of = |row: usize| scale * (2.0 * at(row) - at(row.wrapping_sub(1)) - at(row + 1));
                let b: Vec<f64> = own.clone().map(of).collect();
                let (mut x, mut y) = (vec![0.0; own.len()], vec![0.0; own.len()]);
                assert!(ksp.solve(&b, &mut x)?.reason.converged());
                let error = own.clone().zip(&x).map(|(row, x)| (x - exact(row)).abs()).fold(0.0, f64::max);
                assert!(error < 1e-8, "{prefix} {scale}: {error:e}");
                matrix.multiply(&x, &mut y)?;
                assert!(y.iter().zip(&b).all(|(y, b)| (y - b).abs() < 1e-7));
            }
        }
        Ok(())
    };
    expect_success(alone("parallel::petsc::a_matrix_of_several_ranks", 3, &[], inside));
}

/// Rows of a sheet of `side` by `side` nodes with two dofs each, held at its rim: springs between neighbours, a thousand times as stiff where
/// both are in rows 8 to 13, and between the two dofs of a node.
fn sheet(side: usize, dofs: std::ops::Range<usize>) -> (Vec<Int>, Vec<Int>, Vec<f64>) {
    let (mut row_ptr, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for dof in dofs {
        let (node, part) = (dof / 2, dof % 2);
        let (x, y) = (node % side, node / side);
        let stiffness = |other: usize| if [y, other].iter().all(|y| (8..14).contains(y)) { 1e3 } else { 1.0 };
        // beyond the rim there is the ground
        let springs = [(x, y.wrapping_sub(1)), (x.wrapping_sub(1), y), (x + 1, y), (x, y + 1)];
        let sum: f64 = springs.iter().map(|place| stiffness(place.1)).sum();
        let others = springs.into_iter().filter(|(x, y)| *x < side && *y < side);
        let mut row: Vec<_> = others.map(|(x, y)| (2 * (x + side * y) + part, -stiffness(y))).collect();
        row.extend([(dof, sum + 0.5), (dof ^ 1, -0.5)]);
        row.sort_unstable_by_key(|entry| entry.0);
        columns.extend(row.iter().map(|entry| entry.0 as Int));
        values.extend(row.iter().map(|entry| entry.1));
        row_ptr.push(columns.len() as Int);
    }
    (row_ptr, columns, values)
}

/// Dofs are solved exactly with the same iterations, however many processes have their rows. The second of three has no rows.
#[test]
fn processes_share_an_exact_solve() {
    let inside = || -> Result<()> {
        let session = Session::start(&words("-ksp_type cg -pc_type jacobi -ksp_rtol 1e-10"))?;
        let (side, ranks, rank) = (24, session.size(), session.rank());
        let n = 2 * side * side;
        let first = |rank: usize| if ranks == 3 { [0, n / 2, n / 2, n][rank] } else { 2 * (n / 2 * rank / ranks) };
        let own = first(rank)..first(rank + 1);
        let (row_ptr, columns, values) = sheet(side, 0..n);
        let alone = Rows::all(row_ptr, columns, values)?;
        let (row_ptr, columns, values) = sheet(side, own.clone());
        let shared = Rows::of_process(own.start, n, row_ptr, columns, values)?;
        let mut iterations = [[0; 3]; 2];
        for (rows, iterations) in [alone, shared].into_iter().zip(&mut iterations) {
            let own = rows.own();
            let mut matrix = Matrix::new(&session, 2, rows)?;
            matrix.set_spd()?;
            let mut ksp = Ksp::of(&session, matrix.scope(), "")?;
            ksp.set_operator(&matrix)?;
            ksp.set_from_options()?;
            ksp.set_up()?;
            ksp.set_reuse_preconditioner(true)?;
            // none, one dof of each stiff node, all
            let dofs: Vec<usize> = (16 * side..28 * side).step_by(2).collect();
            for (k, dofs) in [Vec::new(), dofs, (0..n).collect()].into_iter().enumerate() {
                let b: Vec<f64> = own.clone().map(|dof| (dof * dof % 11) as f64 - 4.0).collect();
                let (mut x, mut y) = (vec![0.0; own.len()], vec![0.0; own.len()]);
                assert!(dofs.is_empty() || ksp.patch(&matrix, &dofs, 1)?);
                let solved = ksp.solve(&b, &mut x)?;
                ksp.unwrap()?;
                assert!(solved.reason.converged());
                matrix.multiply(&x, &mut y)?;
                let error = y.iter().zip(&b).map(|(y, b)| (y - b).abs()).fold(0.0, f64::max);
                assert!(error < 1e-6, "{error:e}");
                iterations[k] = solved.iterations;
            }
        }
        let [none, some, all] = iterations[0];
        assert!(4 * some < 3 * none && all == 1, "{iterations:?}");
        assert!(iterations[1][1].abs_diff(some) <= 1 && iterations[1][2] == 1, "{iterations:?}");
        Ok(())
    };
    for ranks in [2, 3, 5] {
        let Some(output) = alone("parallel::petsc::processes_share_an_exact_solve", ranks, &[], inside) else { return };
        expect_success(Some(output));
    }
}
