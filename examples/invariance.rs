//! Every case moved, turned, mirrored and in other units, as a Markdown table. `scripts/invariance --help`.

#[path = "../tests/invariance/cases.rs"]
mod cases;
#[path = "../tests/invariance/change.rs"]
mod change;
#[path = "../tests/invariance/judge.rs"]
mod judge;

use clap::Parser;
use judge::{Case, KINDS};
use std::path::Path;
use std::process::ExitCode;
use winkler::api::{Result, Session};

/// Solves every case of docs/verification.md on a coarse mesh, and again moved by 1, 10^3 and 10^6 of its sizes,
/// turned, mirrored, with lengths and stresses times 10^-9 and 10^9. Forces, peak pressure, area, approach and
/// iterations must be the same to 1e-8, or to the digits that moved coordinates have. Exits with 1 if one differs.
#[derive(Parser)]
#[command(name = "scripts/invariance")]
struct Arguments {
    /// Cases whose scene has this in its name
    #[arg(long, default_value = "")]
    only: String,
    /// Changes that have this in their name
    #[arg(long, default_value = "")]
    change: String,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(differ) => {
            println!("\n{differ} differ");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprint!("{}", error.render(false));
            ExitCode::from(error.kind().exit_code() as u8)
        }
    }
}

/// Return the number of changes by which an answer differs.
fn run(arguments: &Arguments) -> Result<usize> {
    let session = Session::start(&[])?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
    let mut differ = 0;
    println!("| case | change | same |\n| --- | --- | --- |");
    for case in cases::CASES.iter().filter(|case| case.scene.contains(&arguments.only)) {
        let own = match judge::run(&session, &root, case, None) {
            Ok(Some((own, _))) => own,
            Ok(None) => continue,
            Err(error) => {
                differ += 1;
                println!("| {} {} | | NO: {error} |", case.scene, case.set.join(" "));
                continue;
            }
        };
        for kind in KINDS.iter().filter(|kind| kind.name.contains(&arguments.change)) {
            let Case { scene, set } = case;
            let found = match judge::run(&session, &root, case, Some(kind)) {
                Ok(None) => continue,
                Ok(Some((other, change))) => judge::differences(&own, &other, &change),
                Err(error) => vec![error.to_string()],
            };
            differ += usize::from(!found.is_empty());
            let said = if found.is_empty() { "yes".to_owned() } else { format!("NO: {}", found.join("; ")) };
            println!("| {scene} {} | {} | {said} |", set.join(" "), kind.name);
        }
    }
    Ok(differ)
}
