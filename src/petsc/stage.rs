//! Stages of PETSc's log, which `-log_view` prints one by one.

use super::library::{self, petsc};
use super::{Int, Session};
use crate::error::Result;
use std::cell::RefCell;
use std::ffi::CString;

thread_local! {
    /// Stages by name, in the order in which they were first begun.
    static STAGES: RefCell<Vec<(String, Int)>> = const { RefCell::new(Vec::new()) };
}

/// A stage, which lasts until this is dropped; the one around it goes on then.
pub struct Stage {
    is_logged: bool,
}

impl Session {
    /// Begins a stage of PETSc's log; nothing if PETSc does not run. All processes begin the same ones.
    ///
    /// ```
    /// use winkler::petsc::Session;
    /// let session = Session::start(&["-log_view".to_owned(), ":/dev/null".to_owned()])?;
    /// let outer = session.stage("set-up");
    /// drop(session.stage("linear solve"));
    /// drop(session.stage("linear solve"));
    /// drop(outer);
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    pub fn stage(&self, name: &str) -> Stage {
        // a log that cannot be kept is no reason to end a run
        Stage { is_logged: library::runs() && begin(name).is_ok() }
    }
}

fn begin(name: &str) -> Result<()> {
    let known = STAGES.with_borrow(|stages| stages.iter().find(|stage| stage.0 == name).map(|stage| stage.1));
    let stage = match known {
        Some(stage) => stage,
        None => {
            let (mut stage, text) = (0, CString::new(name).unwrap_or_default());
            petsc!(PetscLogStageRegister(text.as_ptr(), &mut stage))?;
            STAGES.with_borrow_mut(|stages| stages.push((name.to_owned(), stage)));
            stage
        }
    };
    petsc!(PetscLogStagePush(stage))
}

impl Drop for Stage {
    fn drop(&mut self) {
        if self.is_logged && library::runs() {
            let _ = petsc!(PetscLogStagePop());
        }
    }
}
