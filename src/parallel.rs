//! Owner ranks of bodies, and messages between ranks by the `mpi` crate.

use crate::error::{Error, Result};
use crate::exchange::Exchange;
use crate::petsc::Session;
use mpi::collective::SystemOperation;
use mpi::point_to_point::send_receive_into;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use std::cell::Cell;

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
        let of_rank = |rank| self.broadcast(rank, if rank == self.session.rank() { mine.clone() } else { Vec::new() });
        (0..self.session.size()).map(of_rank).collect()
    }

    fn broadcast(&self, mine: Vec<u8>) -> Vec<u8> {
        self.broadcast(0, mine)
    }

    fn all_to_all(&self, mut mine: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        let (world, rank, ranks) = (self.session.world(), self.session.rank(), self.session.size());
        self.count_message();
        let lengths: Vec<u64> = mine.iter().map(|bytes| bytes.len() as u64).collect();
        let mut theirs = vec![0_u64; ranks];
        world.all_to_all_into(&lengths[..], &mut theirs[..]);
        // all ranks take as many rounds as the longest message of any rank needs
        let (my_longest, mut longest) = (lengths.iter().copied().max().unwrap_or(0), 0u64);
        world.all_reduce_into(&my_longest, &mut longest, SystemOperation::max());
        let mut all = vec![Vec::new(); ranks];
        all[rank] = std::mem::take(&mut mine[rank]);
        for step in 1..ranks {
            let [to, from] = [(rank + step) % ranks, (rank + ranks - step) % ranks];
            let (sent, mut received) = (std::mem::take(&mut mine[to]), vec![0; theirs[from] as usize]);
            let [target, source] = [to, from].map(|rank| world.process_at_rank(rank as i32));
            // a chunk may be exchanged for a shorter or an empty one
            for chunk in 0..(longest as usize).div_ceil(CHUNK) {
                let part = |length: usize| (chunk * CHUNK).min(length)..((chunk + 1) * CHUNK).min(length);
                let taken = part(received.len());
                send_receive_into(&sent[part(sent.len())], &target, &mut received[taken], &source);
            }
            all[from] = received;
        }
        all
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

/// Return the owner rank of each body, where `loads` has the load of each body. Whole bodies are assigned, the largest first, each to the rank
/// with the least load so far.
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

/// Make the results of all ranks agree: if one rank failed, all fail, with the error of the lowest rank that has a message. The other ranks get an
/// error of the same kind without a message, which is not printed. Collective.
///
/// # Errors
/// As described.
pub fn collectively<T>(session: &Session, result: Result<T>) -> Result<T> {
    if session.size() == 1 {
        return result;
    }
    let none = i32::MAX;
    // an error without a message comes from another rank, which has the message
    let has_message = result.as_ref().is_err_and(|error| !error.is_silent());
    let mine = if has_message { session.rank() as i32 } else { none };
    let mut first = none;
    session.world().all_reduce_into(&mine, &mut first, SystemOperation::min());
    if first == none {
        return result;
    }
    let mine = match &result {
        Err(error) if session.rank() as i32 == first => error.kind().exit_code(),
        _ => 0,
    };
    let mut code = 0;
    session.world().all_reduce_into(&mine, &mut code, SystemOperation::max());
    match result {
        Err(error) if session.rank() as i32 == first => Err(error.agreed()),
        _ => Err(Error::silent(code)),
    }
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
