//! Which rank owns which body, and what ranks tell each other, over the `mpi` crate.

use crate::error::{Error, Result};
use crate::exchange::{Exchange, pack, share};
use crate::petsc::Session;
use mpi::collective::SystemOperation;
use mpi::point_to_point::send_receive_into;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use sha2::{Digest, Sha256};
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

/// The ranks of a run.
pub struct Ranks {
    session: Session,
    messages: Cell<usize>,
}

impl Ranks {
    /// The ranks of a session.
    pub fn new(session: &Session) -> Self {
        Self { session: session.clone(), messages: Cell::new(0) }
    }
}

impl Ranks {
    /// The bytes of one rank, on all.
    fn from(&self, rank: usize, mut bytes: Vec<u8>) -> Vec<u8> {
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
            self.messages.set(self.messages.get() + 1);
        }
    }

    fn ranks(&self) -> usize {
        self.session.size()
    }

    fn rank(&self) -> usize {
        self.session.rank()
    }

    fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>> {
        if self.session.size() == 1 {
            return vec![mine];
        }
        self.messages.set(self.messages.get() + 1);
        let of_rank = |rank| self.from(rank, if rank == self.session.rank() { mine.clone() } else { Vec::new() });
        (0..self.session.size()).map(of_rank).collect()
    }

    fn tell(&self, mine: Vec<u8>) -> Vec<u8> {
        self.from(0, mine)
    }

    fn trade(&self, mut mine: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        let (world, rank, ranks) = (self.session.world(), self.session.rank(), self.session.size());
        self.messages.set(self.messages.get() + 1);
        let lengths: Vec<u64> = mine.iter().map(|bytes| bytes.len() as u64).collect();
        let mut theirs = vec![0_u64; ranks];
        world.all_to_all_into(&lengths[..], &mut theirs[..]);
        // rounds are the same for all, however long the messages of each
        let (mine_most, mut most) = (lengths.iter().copied().max().unwrap_or(0), 0u64);
        world.all_reduce_into(&mine_most, &mut most, SystemOperation::max());
        let mut all = vec![Vec::new(); ranks];
        all[rank] = std::mem::take(&mut mine[rank]);
        for step in 1..ranks {
            let [to, from] = [(rank + step) % ranks, (rank + ranks - step) % ranks];
            let (sent, mut got) = (std::mem::take(&mut mine[to]), vec![0; theirs[from] as usize]);
            let ends = [to, from].map(|rank| world.process_at_rank(rank as i32));
            // a message of several chunks meets one of others, or empty ones
            for chunk in 0..(most as usize).div_ceil(CHUNK) {
                let part = |length: usize| (chunk * CHUNK).min(length)..((chunk + 1) * CHUNK).min(length);
                let part_of_got = part(got.len());
                send_receive_into(&sent[part(sent.len())], &ends[0], &mut got[part_of_got], &ends[1]);
            }
            all[from] = got;
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

/// Bytes of one message: MPI counts them by 31 bits.
const CHUNK: usize = 1 << 30;

/// Owner of each body: whole bodies, largest first, each to the rank with the least load so far.
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

/// What a rank has otherwise than the first one.
pub struct Difference {
    /// The rank.
    pub rank: usize,
    /// What it is that differs.
    pub what: String,
}

/// Compare facts, each with a name of what it tells, which all ranks should have alike; return what differs, the same on all ranks. One short
/// message if nothing does. Collective.
pub fn differences(session: &Session, facts: &BTreeMap<String, String>) -> Vec<Difference> {
    let sum = Sha256::digest(pack(facts));
    let sum = u64::from_le_bytes(std::array::from_fn(|byte| sum[byte]));
    // the largest of all sums, and by its complement the least
    let (mine, mut most) = ([sum, !sum], [0; 2]);
    session.world().all_reduce_into(&mine[..], &mut most[..], SystemOperation::max());
    if most[0] == !most[1] {
        return Vec::new();
    }
    let all = share(&Ranks::new(session), facts.clone());
    let mut found = Vec::new();
    for (rank, other) in all.iter().enumerate().skip(1) {
        let names: BTreeSet<&String> = other.keys().chain(all[0].keys()).collect();
        let differing = names.into_iter().filter(|name| other.get(*name) != all[0].get(*name));
        found.extend(differing.map(|what| Difference { rank, what: what.clone() }));
    }
    found
}

/// Makes a result that ranks reached separately a common one: if it failed anywhere it fails everywhere, with the error
/// of the lowest rank that has one. Other ranks get an error of the same kind without words, which is not printed.
///
/// # Errors
/// As described; collective, so every rank must call it.
pub fn agree<T>(session: &Session, result: Result<T>) -> Result<T> {
    if session.size() == 1 {
        return result;
    }
    let silent = i32::MAX;
    // who has no words has them from another one
    let has_words = result.as_ref().is_err_and(|error| !error.is_silent());
    let mine = if has_words { session.rank() as i32 } else { silent };
    let mut first = silent;
    session.world().all_reduce_into(&mine, &mut first, SystemOperation::min());
    if first == silent {
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
