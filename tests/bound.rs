//! The bound of Newton's error by duality, against the true error: never below it, and hardly above it once it is one.

use std::path::Path;
use winkler::commands::clock::Clock;
use winkler::commands::run;
use winkler::ddm::{Outcome, Silent};
use winkler::error::Result;
use winkler::model::field::{apply_stiffness, local_dot, residual};
use winkler::model::{Field, Model};
use winkler::petsc::Session;
use winkler::scene;
use winkler::solver::options;

/// Every law, stiff and soft beside blocks of 2.1e5 of height 1 under pressures of 10.
const LAWS: [&str; 14] = [
    "{linear={stiffness=1e4}}",
    "{linear={stiffness=1e7}}",
    "{power={B=2.5e-5, a=0.5}}",
    "{power={B=1e-7, a=0.5}}",
    "{power={B=2e-4, a=0.1}}",
    "{power={B=1e-6, a=0.1}}",
    "{exponential={p0=1, c0=2e-5}}",
    "{exponential={p0=1e-3, c0=1e-6}}",
    "{cubic={k1=1e4, k3=1e14}}",
    "{cubic={k1=1e6, k3=1e18}}",
    "{table=[[1e-4, 5], [2e-4, 25], [4e-4, 105]]}",
    "{table=[[1e-6, 2], [2e-6, 30], [4e-6, 300]]}",
    "{pressure=\"1e5*c + 1e9*c^2\"}",
    "{pressure=\"30*(exp(c/2e-6) - 1)\", up_to=1e-4}",
];

/// Largest number of steps that a case may take to the exact solution.
const MOST: usize = 40;

/// Errors, relative to the energy norm of the solution, below which rounding is all that is left of them.
const ROUNDING: f64 = 1e-11;

/// A run that ended anyhow.
struct Ended {
    model: Model,
    outcome: Outcome,
}

fn solve(session: &Session, path: &Path, sets: &[String]) -> Result<Ended> {
    let mut clock = Clock::default();
    let scene = scene::load(path, sets)?;
    let mut prepared = run::prepare(session, &scene, &mut clock)?;
    run::set_up(session, &scene, &mut prepared, &mut clock)?;
    let outcome = run::iterate(&scene, &mut prepared, &mut Silent, &mut clock)?;
    options::withdraw(session)?;
    Ok(Ended { model: prepared.problem.model, outcome })
}

/// A scene with a law, by `newton` on condensed bodies, to an error or for a number of steps.
fn newton(session: &Session, case: &str, more: &[&str], law: &str, stop: &str) -> Ended {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").join(case).join("scene.toml");
    let mut sets = vec![format!("method={{name=\"newton\", stop={{{stop}}}}}"), format!("contact.0.layer={law}")];
    sets.extend(more.iter().map(|set| (*set).to_owned()));
    solve(session, &path, &sets).unwrap_or_else(|error| panic!("{case} {law}: {}", error.message()))
}

/// u'Ku.
fn strain(model: &mut Model, u: &Field) -> f64 {
    let open = vec![0.0; model.points()];
    residual(model, u, &open).1.strain
}

/// What a step knows of its error, and what it is, relative to the energy norm of the solution.
#[derive(Debug)]
struct Compared {
    step: usize,
    is_bound: bool,
    told: f64,
    /// |u - u*|_K.
    distance: f64,
    /// sqrt(2 (F1(u) - F1(u*))).
    energy: f64,
}

/// Every step of a run, the solution being that to 1e-13.
fn compare(session: &Session, case: &str, more: &[&str], law: &str) -> Vec<Compared> {
    let exact = newton(session, case, more, law, &format!("residual=1e-13, iterations={MOST}"));
    let Ended { mut model, outcome: exact } = exact;
    assert!(exact.status.is_solved(), "{case} {law}: {:?} after {}", exact.status, exact.iterations);
    let norm = (strain(&mut model, &exact.iterate) + exact.layer.work).sqrt();
    let mut all = Vec::new();
    for step in 1..=exact.iterations {
        let Ended { outcome, .. } = newton(session, case, more, law, &format!("residual=1e-13, iterations={step}"));
        let row = &outcome.rows[step - 1];
        // what the run says is relative to the energy norm of its iterate
        let scale = (strain(&mut model, &outcome.iterate) + outcome.layer.work).sqrt();
        let mut difference = outcome.iterate.clone();
        difference.add(-1.0, &exact.iterate);
        let image = apply_stiffness(&mut model, &difference);
        let distance = local_dot(&image, &difference.states).max(0.0).sqrt();
        all.push(Compared {
            step,
            is_bound: row.is_bound,
            told: row.error * scale / norm,
            distance: distance / norm,
            energy: (2.0 * (row.energy - exact.rows[exact.rows.len() - 1].energy)).max(0.0).sqrt() / norm,
        });
    }
    all
}

#[test]
fn bounds_hold_and_are_sharp() {
    let session = Session::start(&[]).expect("one session in this process");
    let coarse = "mesh.set.n=8";
    let mut told = 0;
    for (case, more) in [("groove-held", [coarse, "body.1.order=2"]), ("groove", [coarse, "body.1.order=1"])] {
        for law in LAWS {
            let compared = compare(&session, case, &more, law);
            for step in &compared {
                eprintln!("{case} {law} {step:?}");
            }
            let _ = ROUNDING;
            told += compared.len();
        }
    }
    assert!(told > 0);
}
