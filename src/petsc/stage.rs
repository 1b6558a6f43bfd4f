//! Stages of PETSc's log, which `-log_view` prints one by one.

use super::Session;
use super::library::{self, petsc};
use super::table::text;
use crate::error::Result;

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
    let (text, mut stage) = (text(name)?, -1);
    // SAFETY: PETSc copies the text, and the stage is one that it has given.
    unsafe {
        petsc!(PetscLogStageGetId(text.as_ptr(), &mut stage))?;
        if stage < 0 {
            petsc!(PetscLogStageRegister(text.as_ptr(), &mut stage))?;
        }
        petsc!(PetscLogStagePush(stage))
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        if self.is_logged && library::runs() {
            // SAFETY: this stage was pushed, and those within it are gone: they were dropped before.
            let _ = unsafe { petsc!(PetscLogStagePop()) };
        }
    }
}
