//! Poisson's equation on the unit square by the five-point formula, with any solver of PETSc, on any number of ranks:
//!
//!     cargo run --example poisson -- -n 200 -ksp_type cg -pc_type gamg -ksp_monitor
//!     mpiexec -n 2 target/debug/examples/poisson -n 200 -ksp_type cg -pc_type hypre
//!
//! The exact solution sin(pi x) sin(pi y) gives the right-hand side and the error, which falls as 1/n^2.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use std::f64::consts::PI;
use std::ops::Range;
use std::process::ExitCode;
use winkler::error::{Error, Kind, Result};
use winkler::petsc::{Int, Ksp, Matrix, Rows, Scope, Session};

/// Some rows of the matrix on `n` by `n` inner points, scaled by the squared spacing: 4 in the middle, -1 for
/// neighbours.
fn laplace(session: &Session, n: usize, own: Range<usize>) -> Result<Matrix> {
    let (mut row_ptr, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for row in own.clone() {
        let (i, j) = (row % n, row / n);
        let neighbours = [
            (j > 0, row.wrapping_sub(n), -1.0),
            (i > 0, row.wrapping_sub(1), -1.0),
            (true, row, 4.0),
            (i + 1 < n, row + 1, -1.0),
            (j + 1 < n, row + n, -1.0),
        ];
        for (_, column, value) in neighbours.into_iter().filter(|(inside, ..)| *inside) {
            columns.push(column as Int);
            values.push(value);
        }
        row_ptr.push(columns.len() as Int);
    }
    let mut matrix = Matrix::new(session, 1, Rows::of_process(own.start, n * n, row_ptr, columns, values)?)?;
    matrix.set_spd()?;
    Ok(matrix)
}

fn run(words: &[String]) -> Result<()> {
    let session = Session::start(words)?;
    let options = session.options();
    let n = match options.get("-n") {
        None => 50,
        Some(text) => match text.parse() {
            Ok(n) if n > 0 => n,
            _ => {
                return Err(Error::new(Kind::Usage, format!("-n takes a positive number, not `{text}`")));
            }
        },
    };

    let h = 1.0 / (n + 1) as f64;
    let first = |rank: usize| n * n * rank / session.size();
    let own = first(session.rank())..first(session.rank() + 1);
    let exact: Vec<f64> = own
        .clone()
        .map(|row| {
            let (x, y) = ((row % n + 1) as f64 * h, (row / n + 1) as f64 * h);
            (PI * x).sin() * (PI * y).sin()
        })
        .collect();
    let b: Vec<f64> = exact.iter().map(|u| 2.0 * PI * PI * h * h * u).collect();

    let matrix = laplace(&session, n, own.clone())?;
    let mut ksp = Ksp::of(&session, Scope::World, "")?;
    ksp.set_operator(&matrix)?;
    ksp.set_from_options()?;
    ksp.set_up()?;
    let mut u = vec![0.0; own.len()];
    let solved = ksp.solve(&b, &mut u)?;

    let mine = u.iter().zip(&exact).map(|(u, exact)| (u - exact).abs()).fold(0.0, f64::max);
    let mut error = 0.0;
    session.world().all_reduce_into(&mine, &mut error, SystemOperation::max());
    if session.rank() == 0 {
        println!("PETSc {}, {}", session.petsc_version(), session.blas_name());
        println!("{} unknowns, {} with {}", n * n, ksp.ksp_type(), ksp.pc_type());
        println!("{} iterations: {}", solved.iterations, solved.reason);
        println!("largest error {error:.3e}");
    }
    Ok(())
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match run(&words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(error.kind().exit_code() as u8)
        }
    }
}
