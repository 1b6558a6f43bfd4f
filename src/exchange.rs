//! Messages between the ranks of a run: bytes, and plain data packed into bytes.

use crate::error::{Error, Kind, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The messages between the ranks of a run. Calls are collective unless they say otherwise. A single process has no
/// messages: it is the default.
pub trait Exchange {
    /// Replace `values` by their sum over the ranks (MPI_Allreduce). All ranks get the same numbers, as MPI guarantees.
    /// If every body lives on one rank, every entry is non-zero on one rank only, so that sums are exact.
    fn sum(&self, _values: &mut [f64]) {}
    /// Return the number of ranks.
    fn ranks(&self) -> usize {
        1
    }
    /// Return the number of this rank, from 0.
    fn rank(&self) -> usize {
        0
    }
    /// Return the bytes of every rank, in the order of the ranks (MPI_Allgather).
    fn all_gather(&self, mine: Vec<u8>) -> Vec<Vec<u8>> {
        vec![mine]
    }
    /// Return the bytes of the first rank (MPI_Bcast).
    fn broadcast(&self, mine: Vec<u8>) -> Vec<u8> {
        mine
    }
    /// Send bytes to one other rank, which has to receive them from this one. Not collective.
    fn send(&self, _to: usize, _bytes: &[u8]) {}
    /// Receive the bytes that another rank sends to this one. Not collective.
    fn receive(&self, _from: usize) -> Vec<u8> {
        Vec::new()
    }
    /// Return the number of sums and gathers between several ranks so far.
    fn messages(&self) -> usize {
        0
    }
}

/// The exchange of a single process.
#[derive(Debug, Default)]
pub struct Serial;

impl Exchange for Serial {}

/// Data that can go from rank to rank.
pub trait Plain: Serialize + DeserializeOwned {}

impl<T: Serialize + DeserializeOwned> Plain for T {}

/// Give each rank what the first rank has for it (scatter). `part` is called on the first rank only, for each other
/// rank and then for itself. Collective.
///
/// # Errors
/// A message that cannot be read.
pub fn scatter<T: Plain>(exchange: &dyn Exchange, mut part: impl FnMut(usize) -> T) -> Result<T> {
    if exchange.rank() > 0 {
        return unpack(&exchange.receive(0));
    }
    (1..exchange.ranks()).for_each(|rank| exchange.send(rank, &pack(&part(rank))));
    Ok(part(0))
}

/// Return the values of all ranks on the first one, in the order of the ranks, and none on the others (gather).
/// Collective.
///
/// # Errors
/// A message that cannot be read.
pub fn gather<T: Plain>(exchange: &dyn Exchange, mine: T) -> Result<Vec<T>> {
    if exchange.rank() > 0 {
        exchange.send(0, &pack(&mine));
        return Ok(Vec::new());
    }
    let others = (1..exchange.ranks()).map(|rank| unpack(&exchange.receive(rank)));
    std::iter::once(Ok(mine)).chain(others).collect()
}

/// Return the value of every rank, in the order of the ranks (all_gather). Collective.
pub fn all_gather<T: Plain>(exchange: &dyn Exchange, mine: T) -> Vec<T> {
    if exchange.ranks() == 1 {
        return vec![mine];
    }
    // the bytes of each are freed before the next
    let received = |bytes: Vec<u8>| unpack(&bytes).unwrap_or_else(|_| unreachable!("ranks run one program"));
    exchange.all_gather(pack(&mine)).into_iter().map(received).collect()
}

/// Signals that end a run. They are bits of one number, and are summed over the ranks in messages that ranks send
/// anyway.
pub const ASKS: usize = 3;

/// Return one number per kind of request, to be summed over the ranks.
pub fn asks(asked: u8) -> [f64; ASKS] {
    std::array::from_fn(|bit| f64::from(asked >> bit & 1))
}

/// Return the requests of at least one rank, from the sums of [`asks`].
pub fn asked(sums: &[f64]) -> u8 {
    sums.iter().enumerate().fold(0, |all, (bit, &count)| all | u8::from(count > 0.0) << bit)
}

/// Return the result of the first rank on all ranks (broadcast). `mine` is called on the first rank only. Collective.
///
/// # Errors
/// The error of the first rank, there; on the other ranks an error of the same kind without a message.
pub fn broadcast<T: Plain>(exchange: &dyn Exchange, mine: impl FnOnce() -> Result<T>) -> Result<T> {
    if exchange.rank() == 0 {
        let found = mine();
        if exchange.ranks() > 1 {
            exchange.broadcast(pack(&found.as_ref().map_err(|error| error.kind().exit_code())));
        }
        return found;
    }
    unpack::<Result<T, i32>>(&exchange.broadcast(Vec::new()))?.map_err(Error::silent)
}

/// Pack plain data into bytes; numbers keep all their digits.
pub fn pack<T: Serialize>(value: &T) -> Vec<u8> {
    postcard::to_allocvec(value).unwrap_or_default()
}

/// Unpack the data of these bytes.
///
/// # Errors
/// The bytes do not contain such data.
pub fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T> {
    postcard::from_bytes(bytes).map_err(|cause| {
        Error::new(Kind::Solver, "a message of another rank cannot be read").because(cause.to_string())
    })
}

/// Ranks that are threads of a test.
#[cfg(test)]
pub mod crowd {
    use super::{Exchange, pack, unpack};
    use std::collections::{HashMap, VecDeque};
    use std::sync::{Barrier, Condvar, Mutex};

    struct SharedMemory {
        barrier: Barrier,
        slots: Mutex<Vec<Vec<u8>>>,
        sent: Mutex<HashMap<[usize; 2], VecDeque<Vec<u8>>>>,
        news: Condvar,
    }

    struct Member<'a> {
        rank: usize,
        ranks: usize,
        common: &'a SharedMemory,
    }

    /// Return the result of `work` on each of so many ranks.
    pub fn on<T: Send>(ranks: usize, work: impl Fn(&dyn Exchange) -> T + Sync) -> Vec<T> {
        let (slots, sent) = (Mutex::new(vec![Vec::new(); ranks]), Mutex::default());
        let common = &SharedMemory { barrier: Barrier::new(ranks), slots, sent, news: Condvar::new() };
        let member = |rank| Member { rank, ranks, common };
        std::thread::scope(|scope| {
            let work = &work;
            let threads: Vec<_> = (0..ranks).map(|rank| scope.spawn(move || work(&member(rank)))).collect();
            threads.into_iter().map(|thread| thread.join().expect("a rank")).collect()
        })
    }

    impl Exchange for Member<'_> {
        fn sum(&self, values: &mut [f64]) {
            let all = self.all_gather(pack(&&*values));
            values.fill(0.0);
            for other in all {
                let other: Vec<f64> = unpack(&other).expect("numbers");
                assert_eq!(other.len(), values.len());
                values.iter_mut().zip(other).for_each(|(sum, other)| *sum += other);
            }
        }
        fn ranks(&self) -> usize {
            self.ranks
        }
        fn rank(&self) -> usize {
            self.rank
        }
        fn all_gather(&self, mine: Vec<u8>) -> Vec<Vec<u8>> {
            self.common.slots.lock().expect("slots")[self.rank] = mine;
            self.common.barrier.wait();
            let all = self.common.slots.lock().expect("slots").clone();
            self.common.barrier.wait();
            all
        }
        fn broadcast(&self, mine: Vec<u8>) -> Vec<u8> {
            self.all_gather(mine).swap_remove(0)
        }
        fn send(&self, to: usize, bytes: &[u8]) {
            self.common.sent.lock().expect("sent").entry([self.rank, to]).or_default().push_back(bytes.to_vec());
            self.common.news.notify_all();
        }
        fn receive(&self, from: usize) -> Vec<u8> {
            let mut sent = self.common.sent.lock().expect("sent");
            loop {
                match sent.get_mut(&[from, self.rank]).and_then(VecDeque::pop_front) {
                    Some(bytes) => return bytes,
                    None => sent = self.common.news.wait(sent).expect("sent"),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Kind, broadcast, crowd, scatter};
    use crate::error::Error;

    /// The first rank alone makes the parts, one for each rank.
    #[test]
    fn parts_go_to_their_ranks() {
        for ranks in [1, 2, 5] {
            let parts = crowd::on(ranks, |exchange| {
                let part = |rank: usize| {
                    assert_eq!(exchange.rank(), 0);
                    vec![rank as u64; rank]
                };
                scatter(exchange, part).expect("a part")
            });
            assert!(parts.iter().enumerate().all(|(rank, part)| *part == vec![rank as u64; rank]), "{parts:?}");
        }
    }

    /// An error of the first rank ends all with its kind; the words are printed once.
    #[test]
    fn errors_of_the_first_rank_are_those_of_all() {
        let found = crowd::on(3, |exchange| {
            let error = broadcast::<u8>(exchange, || Err(Error::new(Kind::Mesh, "flat"))).expect_err("an error");
            (error.kind().exit_code(), error.is_silent())
        });
        let code = Kind::Mesh.exit_code();
        assert_eq!(found, [(code, false), (code, true), (code, true)]);
    }
}
