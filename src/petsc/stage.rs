//! Stages of PETSc's log, which `-log_view` lists separately.

use super::Session;
use super::library::{self, petsc};
use super::table::text;
use crate::error::Result;

/// A guard: its stage lasts until it is dropped. Then the enclosing stage goes on.
pub struct Stage {
    is_logged: bool,
}

impl Session {
    /// Begin a stage of PETSc's log, if PETSc runs. All processes have to begin the same stages.
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
        // a failure of the log does not end a run
        Stage { is_logged: library::runs() && begin(name).is_ok() }
    }
}

fn begin(name: &str) -> Result<()> {
    let (text, mut stage) = (text(name)?, -1);
    // SAFETY: PETSc copies the text, and the number of the stage comes from PETSc.
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
            // SAFETY: this stage was pushed, and the stages within it were dropped before.
            let _ = unsafe { petsc!(PetscLogStagePop()) };
        }
    }
}
