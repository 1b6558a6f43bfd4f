//! Owner ranks of bodies, and messages between ranks by the `mpi` crate.

use crate::error::{Error, Result};
use crate::exchange::Exchange;
use crate::petsc::Session;
use mpi::collective::SystemOperation;
use mpi::datatype::PartitionMut;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use std::cell::Cell;
use std::env;
use std::process::Command;

/// The ranks of a run.
pub struct Ranks {
    session: Session,
    messages: Cell<usize>,
}

impl Ranks {
    /// Return the ranks of a session.
    pub fn new(session: &Session) -> Self {
        Self { session: session.clone(), messages: Cell::new(0) }
    }

    fn count_message(&self) {
        self.messages.set(self.messages.get() + 1);
    }

    /// Return the bytes of one rank on all ranks. Collective.
    fn broadcast(&self, rank: usize, mut bytes: Vec<u8>) -> Vec<u8> {
        let world = self.session.world();
        let root = world.process_at_rank(rank as i32);
        let mut length = bytes.len() as u64;
        root.broadcast_into(&mut length);
        bytes.resize(length as usize, 0);
        bytes.chunks_mut(CHUNK).for_each(|chunk| root.broadcast_into(chunk));
        bytes
    }
}

impl Exchange for Ranks {
    fn sum(&self, values: &mut [f64]) {
        if self.session.size() > 1 && !values.is_empty() {
            let mine = values.to_vec();
            self.session.world().all_reduce_into(&mine[..], values, SystemOperation::sum());
            self.count_message();
        }
    }

    fn ranks(&self) -> usize {
        self.session.size()
    }

    fn rank(&self) -> usize {
        self.session.rank()
    }

    fn all_gather(&self, mine: Vec<u8>) -> Vec<Vec<u8>> {
        if self.session.size() == 1 {
            return vec![mine];
        }
        self.count_message();
        let world = self.session.world();
        let mut lengths = vec![0_u64; self.session.size()];
        world.all_gather_into(&(mine.len() as u64), &mut lengths[..]);
        if lengths.iter().sum::<u64>() <= CHUNK as u64 {
            let counts: Vec<i32> = lengths.iter().map(|&length| length as i32).collect();
            let starts: Vec<i32> =
                counts.iter().scan(0, |end, count| Some(std::mem::replace(end, *end + count))).collect();
            let mut all = vec![0_u8; lengths.iter().sum::<u64>() as usize];
            world.all_gather_varcount_into(&mine[..], &mut PartitionMut::new(&mut all[..], &counts[..], &starts[..]));
            let of_rank = |(&start, &count): (&i32, &i32)| all[start as usize..(start + count) as usize].to_vec();
            return starts.iter().zip(&counts).map(of_rank).collect();
        }
        let of_rank = |rank| self.broadcast(rank, if rank == self.session.rank() { mine.clone() } else { Vec::new() });
        (0..self.session.size()).map(of_rank).collect()
    }

    fn broadcast(&self, mine: Vec<u8>) -> Vec<u8> {
        self.broadcast(0, mine)
    }

    fn send(&self, to: usize, bytes: &[u8]) {
        let to = self.session.world().process_at_rank(to as i32);
        to.send(&(bytes.len() as u64));
        bytes.chunks(CHUNK).for_each(|chunk| to.send(chunk));
    }

    fn receive(&self, from: usize) -> Vec<u8> {
        let from = self.session.world().process_at_rank(from as i32);
        let (length, _) = from.receive::<u64>();
        let mut bytes = vec![0; length as usize];
        bytes.chunks_mut(CHUNK).for_each(|chunk| {
            from.receive_into(chunk);
        });
        bytes
    }

    fn messages(&self) -> usize {
        self.messages.get()
    }
}

/// Most bytes of one message: MPI counts them by 31 bits.
const CHUNK: usize = 1 << 30;

/// Return the owner rank of each body, where `loads` has the load of each body. Whole bodies are assigned, the largest
/// first, each to the rank with the least load so far.
pub fn owners(loads: &[usize], ranks: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..loads.len()).collect();
    order.sort_by_key(|&body| (std::cmp::Reverse(loads[body]), body));
    let mut sum = vec![0; ranks];
    let mut owner = vec![0; loads.len()];
    for body in order {
        let rank = (0..ranks).min_by_key(|&rank| (sum[rank], rank)).unwrap_or(0);
        owner[body] = rank;
        sum[rank] += loads[body];
    }
    owner
}

/// Return the least number of all ranks. Collective.
pub fn least(session: &Session, mine: u64) -> u64 {
    let mut least = mine;
    if session.size() > 1 {
        session.world().all_reduce_into(&mine, &mut least, SystemOperation::min());
    }
    least
}

/// Make the results of all ranks agree: if one rank failed, all fail, with the error of the lowest rank that has a
/// message. The other ranks get an error of the same kind without a message, which is not printed. Collective.
///
/// # Errors
/// As described.
pub fn collectively<T>(session: &Session, result: Result<T>) -> Result<T> {
    if session.size() == 1 {
        return result;
    }
    // an error without a message comes from another rank, which has the message
    let told = result.as_ref().err().filter(|error| !error.is_silent());
    // the rank in the upper half: the least number is that of the first rank with a message
    let mine = told.map_or(u64::MAX, |error| (session.rank() as u64) << 32 | error.kind().exit_code() as u64);
    let least = least(session, mine);
    match result {
        _ if least == u64::MAX => result,
        Err(error) if mine == least => Err(error.agreed()),
        _ => Err(Error::silent(least as u32 as i32)),
    }
}

/// Return the command that starts ranks of a program: the words of `$WINKLER_MPIEXEC`, or else `mpiexec`. Arguments to
/// add are `-n`, the number of ranks, and the program. Open MPI gets the permission to start more ranks than there are
/// cores.
pub fn launcher() -> Command {
    let typed = env::var("WINKLER_MPIEXEC").unwrap_or_default();
    let mut words = typed.split_whitespace();
    let mut command = Command::new(words.next().unwrap_or("mpiexec"));
    command.args(words);
    command.env("OMPI_MCA_rmaps_base_oversubscribe", "1"); // Open MPI 4
    command.env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe"); // Open MPI 5
    command
}

#[cfg(test)]
mod tests {
    use super::owners;

    #[test]
    fn bodies_are_packed_whole_by_their_load() {
        assert_eq!(owners(&[5, 5], 2), [0, 1]);
        assert_eq!(owners(&[1, 9, 4, 4], 2), [1, 0, 1, 1]);
        assert_eq!(owners(&[3], 4), [0]);
        assert_eq!(owners(&[1, 2, 3], 1), [0, 0, 0]);
    }
}
