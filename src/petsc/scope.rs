//! Which processes own an object together.

use super::Session;
use mpi::collective::SystemOperation;
use mpi::ffi::{MPI_Comm, RSMPI_COMM_SELF};
use mpi::raw::AsRaw;
use mpi::traits::CommunicatorCollectives;

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

    /// Adds up what its processes have.
    pub(super) fn sum(self, session: &Session, values: &mut [f64]) {
        if self == Scope::World {
            let mine = values.to_vec();
            session.world().all_reduce_into(&mine[..], values, SystemOperation::sum());
        }
    }

    /// Number of its processes.
    pub(super) fn processes(self, session: &Session) -> usize {
        if self == Scope::World { session.size() } else { 1 }
    }
}
