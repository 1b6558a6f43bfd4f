//! Which rank owns which body, and what ranks tell each other, over the `mpi` crate.

use crate::error::{Error, Kind, Result};
use crate::model::Exchange;
use crate::petsc::Session;
use mpi::collective::SystemOperation;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::cell::Cell;

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

    fn deal(&self, of_rank: &mut dyn FnMut(usize) -> Vec<u8>) -> Vec<u8> {
        let world = self.session.world();
        if self.session.rank() == 0 {
            for rank in 1..self.session.size() {
                let (bytes, other) = (of_rank(rank), world.process_at_rank(rank as i32));
                other.send(&(bytes.len() as u64));
                bytes.chunks(CHUNK).for_each(|chunk| other.send(chunk));
            }
            return of_rank(0);
        }
        let root = world.process_at_rank(0);
        let (length, _) = root.receive::<u64>();
        let mut bytes = vec![0; length as usize];
        for chunk in bytes.chunks_mut(CHUNK) {
            root.receive_into(chunk);
        }
        bytes
    }

    fn messages(&self) -> usize {
        self.messages.get()
    }
}

/// Bytes of one message: MPI counts them by 31 bits.
const CHUNK: usize = 1 << 30;

/// What each rank knows, in their order; collective.
pub fn share<T: Serialize + DeserializeOwned>(exchange: &dyn Exchange, mine: &T) -> Vec<T> {
    exchange.share(pack(mine)).iter().filter_map(|bytes| unpack(bytes).ok()).collect()
}

/// What the first rank has found; `mine` is there alone, and is asked for nowhere else. Collective.
///
/// # Errors
/// That of the first rank, there; elsewhere one of the same kind without words.
pub fn tell<T: Serialize + DeserializeOwned>(exchange: &dyn Exchange, mine: impl FnOnce() -> Result<T>) -> Result<T> {
    if exchange.rank() == 0 {
        let found = mine();
        if exchange.ranks() > 1 {
            exchange.tell(pack(&found.as_ref().map_err(|error| error.kind().exit_code())));
        }
        return found;
    }
    unpack::<Result<T, i32>>(&exchange.tell(Vec::new()))?.map_err(Error::silent)
}

/// What the first rank makes for each rank; `of_rank` is called there alone. Collective.
///
/// # Errors
/// A message that cannot be read.
pub fn deal<T: Serialize + DeserializeOwned>(exchange: &dyn Exchange, of_rank: impl Fn(usize) -> T) -> Result<T> {
    unpack(&exchange.deal(&mut |rank| pack(&of_rank(rank))))
}

/// Plain data as bytes, numbers with all their digits.
fn pack<T: Serialize>(value: &T) -> Vec<u8> {
    postcard::to_allocvec(value).unwrap_or_default()
}

fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T> {
    postcard::from_bytes(bytes).map_err(|cause| {
        Error::new(Kind::Solver, "a message of another rank cannot be read").because(cause.to_string())
    })
}

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
    let mine = if result.is_err() { session.rank() as i32 } else { silent };
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
