//! The communicator of an object: one process or all.

use super::Session;
use mpi::collective::SystemOperation;
use mpi::ffi::{MPI_Comm, RSMPI_COMM_SELF};
use mpi::raw::AsRaw;
use mpi::traits::CommunicatorCollectives;

/// The processes that own an object together. Calls on an object of all processes are collective.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// This process alone.
    Process,
    /// All processes of the session. Each owns some rows.
    World,
}

impl Scope {
    /// Return the MPI communicator.
    pub(super) fn comm(self, session: &Session) -> MPI_Comm {
        match self {
            // SAFETY: the constant of MPI itself.
            Scope::Process => unsafe { RSMPI_COMM_SELF },
            Scope::World => session.world().as_raw(),
        }
    }

    /// Replace `values` by their sum over the processes.
    pub(super) fn sum(self, session: &Session, values: &mut [f64]) {
        if self == Scope::World {
            let mine = values.to_vec();
            session.world().all_reduce_into(&mine[..], values, SystemOperation::sum());
        }
    }

    /// Return the number of processes.
    pub(super) fn processes(self, session: &Session) -> usize {
        if self == Scope::World { session.size() } else { 1 }
    }
}
