//! Which processes own an object together.

use super::{Int, Session};
use mpi::Count;
use mpi::collective::SystemOperation;
use mpi::datatype::PartitionMut;
use mpi::ffi::{MPI_Comm, RSMPI_COMM_SELF};
use mpi::raw::AsRaw;
use mpi::traits::{Communicator, CommunicatorCollectives, Root};

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

    /// Whether this process is its first.
    pub(super) fn is_first(self, session: &Session) -> bool {
        self == Scope::Process || session.rank() == 0
    }

    /// What its processes have, one after the other, on the first; nothing on others.
    pub(super) fn collect(self, session: &Session, mine: &[Int]) -> Vec<Int> {
        if self == Scope::Process {
            return mine.to_vec();
        }
        let mut lengths = vec![0; session.size()];
        session.world().all_gather_into(&(mine.len() as Count), &mut lengths[..]);
        let first = session.world().process_at_rank(0);
        if session.rank() > 0 {
            first.gather_varcount_into(mine);
            return Vec::new();
        }
        let mut all = vec![0; lengths.iter().sum::<Count>() as usize];
        first.gather_varcount_into_root(mine, &mut parts(&mut all, lengths));
        all
    }

    /// Gives all processes what the first one has.
    pub(super) fn tell(self, session: &Session, values: &mut [Int]) {
        if self == Scope::World {
            session.world().process_at_rank(0).broadcast_into(values);
        }
    }
}

/// Parts of these lengths, one behind the other.
fn parts(all: &mut [Int], lengths: Vec<Count>) -> PartitionMut<'_, [Int], Vec<Count>, Vec<Count>> {
    let starts = lengths.iter().scan(0, |next, length| Some(std::mem::replace(next, *next + length))).collect();
    PartitionMut::new(all, lengths, starts)
}
