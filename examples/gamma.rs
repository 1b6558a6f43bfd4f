//! A rule for gamma of one's own against the built-in ones: Chebyshev's steps, which wear down all modes of a spectrum
//! in turn.
//!
//! ```text
//! cargo run --release --example gamma
//! ```

use std::f64::consts::PI;
use std::path::Path;
use winkler::api::{
    Gamma, GammaRule, Iterate, MethodName, MethodSpec, Result, Session, Solution, Unbounded, load, solve,
};

/// Steps after which the rule begins anew.
const CYCLE: usize = 4;

/// 1/gamma runs through the roots of Chebyshev's polynomial from 1 to 2. No eigenvalue of G^-1 F1'' exceeds 2, and few
/// modes are slower than 1.
struct Chebyshev;

impl GammaRule for Chebyshev {
    fn gamma(&mut self, here: &mut Iterate) -> Result<f64, Unbounded> {
        let angle = PI * ((here.k % CYCLE) as f64 + 0.5) / CYCLE as f64;
        Ok(2.0 / (3.0 + angle.cos()))
    }
}

/// Solve the paper's groove by a rule for gamma.
pub fn by(session: &Session, gamma: Gamma) -> Result<Solution> {
    let overrides = ["mesh.set.n=16", "method.stop={residual=1e-9}", "solver=condensed"].map(str::to_owned);
    let mut scene = load(Path::new("meshes/groove/scene.toml"), &overrides)?;
    scene.method = MethodSpec { gamma, stop: scene.method.stop.clone(), ..MethodSpec::new(MethodName::Robin) };
    solve(session, scene.rule("chebyshev", || Chebyshev))
}

/// Return the rules to compare.
pub fn rules() -> [Gamma; 4] {
    let own = Gamma::Own("chebyshev".to_owned());
    [Gamma::Stationary(0.6), own, Gamma::Aitken, Gamma::LineSearch]
}

fn main() -> Result<()> {
    let session = Session::start(&[])?;
    for gamma in rules() {
        let name = format!("{gamma:?}");
        let solution = by(&session, gamma)?;
        let report = solution.report();
        let peak = solution.contact(0).pressure.into_iter().fold(0.0, f64::max);
        println!("{name:20} {} in {:3} sweeps, peak pressure {peak:.6}", report.status, report.sweeps);
    }
    Ok(())
}
