//! Which processes own an object together.

use super::Session;
use mpi::ffi::{MPI_Comm, RSMPI_COMM_SELF};
use mpi::raw::AsRaw;

/// The processes that own an object; calls on one of all processes are collective.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// This process alone.
    Process,
    /// All processes of the session, each with rows of its own.
    World,
}

impl Scope {
    /// PETSc's communicator for it.
    pub(super) fn comm(self, session: &Session) -> MPI_Comm {
        match self {
            // SAFETY: the constant of MPI itself.
            Scope::Process => unsafe { RSMPI_COMM_SELF },
            Scope::World => session.world().as_raw(),
        }
    }
}
