//! Scenes solved in this process, by the library. PETSc runs once in a process and in one thread, so they are solved one after the other.

use super::{Report, Table, Tables};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Mutex, OnceLock};
use winkler::api::{Error, Session, load, solve};

/// Work for the thread that has the session.
type Job = Box<dyn FnOnce(&Session) + Send>;

/// Return what `work` returns in the thread that has the session of this process. A panic of `work` is one of the caller.
pub fn with_session<T: Send + 'static>(work: impl FnOnce(&Session) -> T + Send + 'static) -> T {
    static JOBS: OnceLock<Mutex<Sender<Job>>> = OnceLock::new();
    let jobs = JOBS.get_or_init(|| Mutex::new(start()));
    let (sender, receiver) = channel::<Result<T, Box<dyn Any + Send>>>();
    let job: Job = Box::new(move |session| {
        // the caller has ended if nobody receives
        let _ = sender.send(catch_unwind(AssertUnwindSafe(|| work(session))));
    });
    jobs.lock().expect("no thread panics while it sends").send(job).expect("the thread of the session lives");
    receiver.recv().expect("an answer to each job").unwrap_or_else(|panic| resume_unwind(panic))
}

/// Start the thread with the session.
fn start() -> Sender<Job> {
    let (sender, receiver) = channel::<Job>();
    std::thread::spawn(move || {
        let environment = super::ENVIRONMENT.write();
        let session = Session::start(&[]).expect("one session in this process");
        drop(environment);
        receiver.iter().for_each(|job| job(&session));
    });
    sender
}

/// Solve a scene with values to replace (`"mesh.set.n=4"`), as `--set` does. Return the refusal if the program refuses it.
pub fn try_here(scene: impl AsRef<Path>, set: &[&str]) -> Result<Report, Error> {
    let (path, set) = (scene.as_ref().to_owned(), set.iter().map(|&set| set.to_owned()).collect::<Vec<_>>());
    with_session(move |session| {
        let solution = solve(session, load(&path, &set)?)?;
        let table = |pair: usize| {
            let mut bytes = Vec::new();
            solution.contact(pair).write(&mut bytes).expect("memory can be written");
            Table::of(&bytes[..], "the contact table")
        };
        let tables = Tables::Memory((0..solution.pairs()).map(table).collect());
        let value = serde_json::to_value(solution.report()).expect("a report is JSON");
        Ok(Report { value, said: String::new(), tables })
    })
}

/// Solve a scene with values to replace, which the program must not refuse.
pub fn solve_here(scene: impl AsRef<Path>, set: &[&str]) -> Report {
    try_here(scene, set).unwrap_or_else(|error| panic!("{}", error.render(false)))
}
