//! Messages between the ranks of a run: bytes, and plain data packed into bytes.

use crate::error::{Error, Kind, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::Range;

/// The messages between the ranks of a run. Calls are collective unless they say otherwise.
pub trait Exchange {
    /// Replace `values` by their sum over the ranks (MPI_Allreduce). All ranks get the same numbers, as MPI guarantees. If every body lives on one
    /// rank, every entry is non-zero on one rank only, so that sums are exact.
    fn sum(&self, values: &mut [f64]);
    /// Return the number of ranks.
    fn ranks(&self) -> usize;
    /// Return the number of this rank, from 0.
    fn rank(&self) -> usize;
    /// Return the bytes of every rank, in the order of the ranks (MPI_Allgather).
    fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>>;
    /// Return the bytes of the first rank (MPI_Bcast).
    fn tell(&self, mine: Vec<u8>) -> Vec<u8>;
    /// Send `mine[k]` to rank k, and return the bytes from every rank, in the order of the ranks (MPI_Alltoall).
    fn trade(&self, mine: Vec<Vec<u8>>) -> Vec<Vec<u8>>;
    /// Send bytes to one other rank, which has to receive them from this one. Not collective.
    fn send(&self, to: usize, bytes: &[u8]);
    /// Receive the bytes that another rank sends to this one. Not collective.
    fn receive(&self, from: usize) -> Vec<u8>;
    /// Return the number of sums, shares and trades between several ranks so far.
    fn messages(&self) -> usize;
}

/// Return the value of every rank, in the order of the ranks (all_gather). Collective.
pub fn share<T: Serialize + DeserializeOwned>(exchange: &dyn Exchange, mine: T) -> Vec<T> {
    if exchange.ranks() == 1 {
        return vec![mine];
    }
    exchange.share(pack(&mine)).into_iter().map(received).collect()
}

/// Return the elements of all ranks in one sorted list. Collective.
pub fn gather<T: Serialize + DeserializeOwned + Ord>(exchange: &dyn Exchange, mine: &[T]) -> Vec<T> {
    let mut all: Vec<T> = Vec::new();
    exchange.share(pack(&mine)).into_iter().for_each(|bytes| all.append(&mut received(bytes)));
    all.sort_unstable();
    all
}

/// Return the global index of each element of the sorted slice `mine`, in the order of the elements of all ranks. Elements are distinct across
/// ranks. Each rank sorts one interval of values; the ends of the intervals are found from samples. Collective.
pub fn places<T: Serialize + DeserializeOwned + Ord + Clone>(exchange: &dyn Exchange, mine: &[T]) -> Vec<u32> {
    let ranks = exchange.ranks();
    let sample = |all: &[T]| (1..ranks).filter_map(|k| all.get(k * all.len() / ranks).cloned()).collect::<Vec<T>>();
    let ends = sample(&gather(exchange, &sample(mine)));
    let mut rest = mine;
    let mut parts = Vec::with_capacity(ranks);
    for end in &ends {
        let part;
        (part, rest) = rest.split_at(rest.partition_point(|value| value < end));
        parts.push(part.to_vec());
    }
    parts.push(rest.to_vec());
    parts.resize(ranks, Vec::new());
    let theirs: Vec<Vec<T>> = trade(exchange, parts);
    let lengths = share(exchange, theirs.iter().map(Vec::len).sum::<usize>());
    let first = lengths[..exchange.rank()].iter().sum::<usize>() as u32;
    let mut indices: Vec<Vec<u32>> = theirs.iter().map(|theirs| vec![0; theirs.len()]).collect();
    // each value with its rank and its position there
    let of_rank = |(rank, theirs): (usize, Vec<T>)| theirs.into_iter().zip(0..).map(move |(value, k)| (value, rank, k));
    let mut all: Vec<(T, usize, usize)> = theirs.into_iter().enumerate().flat_map(of_rank).collect();
    all.sort_unstable();
    all.iter().zip(first..).for_each(|(&(_, rank, k), index)| indices[rank][k] = index);
    trade(exchange, indices).concat()
}

/// Return the range of each list that this rank gets, if the lists, of these lengths and one after the other, are cut into equal parts for the
/// ranks.
pub fn shares(lengths: impl Iterator<Item = usize> + Clone, exchange: &dyn Exchange) -> Vec<Range<usize>> {
    let (all, ranks): (usize, _) = (lengths.clone().sum(), exchange.ranks());
    let [begin, end] = [0, 1].map(|next| all * (exchange.rank() + next) / ranks);
    let mut first = 0;
    let of_list = |length| {
        let [from, to] = [begin, end].map(|at| at.clamp(first, first + length) - first);
        first += length;
        from..to
    };
    lengths.map(of_list).collect()
}

/// Send `mine[k]` to rank k, and return the values from every rank, in the order of the ranks (all_to_all). Collective.
pub fn trade<T: Serialize + DeserializeOwned>(exchange: &dyn Exchange, mine: Vec<T>) -> Vec<T> {
    if exchange.ranks() == 1 {
        return mine;
    }
    // values are packed and dropped one after the other, which limits the memory
    let packed = mine.into_iter().map(|mine| pack(&mine)).collect();
    exchange.trade(packed).into_iter().map(received).collect()
}

/// Return the data of a message; the bytes are freed.
fn received<T: DeserializeOwned>(bytes: Vec<u8>) -> T {
    unpack(&bytes).unwrap_or_else(|_| unreachable!("ranks run one program"))
}

/// Kinds of requests to a run from outside: three signals, a snapshot and a checkpoint. They are bits of one number. They are summed over the ranks in
/// messages that ranks send anyway.
pub const ASKS: usize = 5;

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

/// Return the result of this rank if no rank has an error. The ranks check different parts of the same data. If several fail, the error with the least
/// key counts, which is the one that a single rank with all the data would find first. Collective.
///
/// # Errors
/// That error, on the rank that has found it; on the other ranks an error of the same kind without a message.
pub fn first<K: Serialize + DeserializeOwned + Ord, T>(
    exchange: &dyn Exchange,
    found: Result<T, (K, Error)>,
) -> Result<T> {
    if exchange.ranks() == 1 {
        return found.map_err(|(_, error)| error);
    }
    let (mine, found) = match found {
        Ok(found) => (Vec::new(), Ok(found)),
        Err((key, error)) => (vec![(key, exchange.rank(), error.kind().exit_code())], Err(error)),
    };
    match gather(exchange, &mine).first() {
        Some((_, rank, code)) if *rank != exchange.rank() => Err(Error::silent(*code)),
        _ => found,
    }
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

/// The exchange of a single process, which has no messages.
#[derive(Debug, Default)]
pub struct Serial;

impl Exchange for Serial {
    fn sum(&self, _values: &mut [f64]) {}
    fn ranks(&self) -> usize {
        1
    }
    fn rank(&self) -> usize {
        0
    }
    fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>> {
        vec![mine]
    }
    fn tell(&self, mine: Vec<u8>) -> Vec<u8> {
        mine
    }
    fn trade(&self, mine: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        mine
    }
    fn send(&self, _to: usize, _bytes: &[u8]) {}
    fn receive(&self, _from: usize) -> Vec<u8> {
        Vec::new()
    }
    fn messages(&self) -> usize {
        0
    }
}

/// Ranks that are threads of a test.
#[cfg(test)]
pub mod crowd {
    use super::{Exchange, pack, unpack};
    use std::collections::{HashMap, VecDeque};
    use std::sync::{Barrier, Condvar, Mutex};

    struct Common {
        barrier: Barrier,
        slots: Mutex<Vec<Vec<Vec<u8>>>>,
        sent: Mutex<HashMap<[usize; 2], VecDeque<Vec<u8>>>>,
        news: Condvar,
    }

    struct Member<'a> {
        rank: usize,
        ranks: usize,
        common: &'a Common,
    }

    /// Return the result of `work` on each of so many ranks.
    pub fn on<T: Send>(ranks: usize, work: impl Fn(&dyn Exchange) -> T + Sync) -> Vec<T> {
        let (slots, sent) = (Mutex::new(vec![Vec::new(); ranks]), Mutex::default());
        let common = &Common { barrier: Barrier::new(ranks), slots, sent, news: Condvar::new() };
        let member = |rank| Member { rank, ranks, common };
        std::thread::scope(|scope| {
            let work = &work;
            let threads: Vec<_> = (0..ranks).map(|rank| scope.spawn(move || work(&member(rank)))).collect();
            threads.into_iter().map(|thread| thread.join().expect("a rank")).collect()
        })
    }

    impl Exchange for Member<'_> {
        fn sum(&self, values: &mut [f64]) {
            let all = self.share(pack(&&*values));
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
        fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>> {
            self.trade(vec![mine; self.ranks])
        }
        fn tell(&self, mine: Vec<u8>) -> Vec<u8> {
            self.share(mine).swap_remove(0)
        }
        fn trade(&self, mine: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
            self.common.slots.lock().expect("slots")[self.rank] = mine;
            self.common.barrier.wait();
            let all = self.common.slots.lock().expect("slots").iter().map(|of| of[self.rank].clone()).collect();
            self.common.barrier.wait();
            all
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
        fn messages(&self) -> usize {
            0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{crowd, places, shares};

    /// Values have the indices that one rank would give them, wherever they are.
    #[test]
    fn ranks_sort_together() {
        for ranks in [1, 2, 5] {
            let lists = crowd::on(ranks, |exchange| {
                let rank = exchange.rank() as u64;
                // some rank has nothing, and values of ranks lie among each other
                let mut mine: Vec<u64> = (0..40 * (rank % 3)).map(|k| 7919 * (k + 1000 * rank) % 10_007).collect();
                mine.sort_unstable();
                (places(exchange, &mine), mine)
            });
            let mut all: Vec<u64> = lists.iter().flat_map(|(_, mine)| mine).copied().collect();
            all.sort_unstable();
            for (places, mine) in lists {
                assert_eq!(places.len(), mine.len());
                assert!(mine.iter().zip(places).all(|(value, place)| all[place as usize] == *value));
            }
        }
    }

    /// Lists are cut into parts of equal length, one after the other.
    #[test]
    fn lists_are_cut_into_equal_parts() {
        let parts = crowd::on(3, |exchange| shares([4, 0, 2, 3].into_iter(), exchange));
        assert_eq!(parts, [[0..3, 0..0, 0..0, 0..0], [3..4, 0..0, 0..2, 0..0], [4..4, 0..0, 2..2, 0..3]]);
    }
}
