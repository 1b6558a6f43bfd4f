//! Tests in a process of their own, as a process holds one session of PETSc.

use std::process::{Command, Output};
use std::time::Duration;
use winkler::error::Result;
use winkler::internals::parallel::launcher;

/// The time after which ranks that wait for each other are ended.
pub const TIMEOUT: Duration = Duration::from_secs(60);

/// Run `body` in a process of its own, under `mpiexec` if `ranks` is not 0. Return what it printed, or `None` in that process.
///
/// The process is this test program once more, which runs the test `test` alone; its name has the module in front.
pub fn alone(
    test: &str,
    ranks: usize,
    environment: &[(&str, &str)],
    body: impl FnOnce() -> Result<()>,
) -> Option<Output> {
    if std::env::var("WINKLER_ALONE").as_deref() == Ok(test) {
        body().unwrap_or_else(|error| panic!("{error}"));
        return None;
    }
    let program = std::env::current_exe().expect("the path of this program");
    let mut command = match ranks {
        0 => {
            let mut command = Command::new(program);
            super::without_session(&mut command);
            command
        }
        ranks => {
            let mut command = launcher();
            super::without_session(&mut command).args(["-n", &ranks.to_string()]).arg(program);
            // A hang ends the test instead of stopping it for ever.
            command
                .env("MPIEXEC_TIMEOUT", TIMEOUT.as_secs().to_string())
                .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
                .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
            command
        }
    };
    command.args([test, "--exact", "--nocapture", "--test-threads=1"]);
    let command = command.env("WINKLER_ALONE", test).envs(environment.iter().copied());
    let output = command.output().expect("this program or mpiexec can be started");
    assert!(!String::from_utf8_lossy(&output.stdout).contains("running 0 tests"), "no test is called `{test}`");
    Some(output)
}

/// Expect that the inner process went well and that PETSc did not print an error by itself. Return its output.
pub fn expect_success(output: Option<Output>) -> String {
    let Some(output) = output else {
        return String::new();
    };
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{out}\n{err}");
    assert!(!err.contains("PETSC ERROR"), "{err}");
    out.into_owned()
}
