//! What the ranks of a run tell each other: bytes, and plain data as bytes.

use crate::error::{Error, Kind, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::Range;

/// What the ranks of a parallel run tell each other; calls are collective unless they say otherwise.
pub trait Exchange {
    /// Replaces `values` on every rank by the sum over the ranks: the same numbers everywhere, as MPI promises. Where every body lives
    /// on one rank, every entry is non-zero on one only, so that sums are exact.
    fn sum(&self, values: &mut [f64]);
    /// Number of ranks.
    fn ranks(&self) -> usize;
    /// Number of this one.
    fn rank(&self) -> usize;
    /// The bytes of each rank, in their order.
    fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>>;
    /// The bytes of the first rank.
    fn tell(&self, mine: Vec<u8>) -> Vec<u8>;
    /// The bytes that each rank has for this one, in their order, where `mine` are those for each rank.
    fn trade(&self, mine: Vec<Vec<u8>>) -> Vec<Vec<u8>>;
    /// Bytes for one other rank, which takes them from this one; neither is collective.
    fn send(&self, to: usize, bytes: &[u8]);
    /// Bytes that another rank sends to this one.
    fn receive(&self, from: usize) -> Vec<u8>;
    /// Sums and shares so far between several ranks.
    fn messages(&self) -> usize;
}

/// Data that can go from rank to rank.
pub trait Plain: Serialize + DeserializeOwned {}

impl<T: Serialize + DeserializeOwned> Plain for T {}

/// Give each rank what the first rank has for it: `part` is called there alone, for each other rank and then for itself. Collective.
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

/// What each rank knows, in their order; collective.
pub fn share<T: Serialize + DeserializeOwned>(exchange: &dyn Exchange, mine: T) -> Vec<T> {
    if exchange.ranks() == 1 {
        return vec![mine];
    }
    exchange.share(pack(&mine)).into_iter().map(own).collect()
}

/// One list of what all ranks have, sorted; collective.
pub fn gather<T: Serialize + DeserializeOwned + Ord>(exchange: &dyn Exchange, mine: &[T]) -> Vec<T> {
    let mut all: Vec<T> = Vec::new();
    exchange.share(pack(&mine)).into_iter().for_each(|bytes| all.append(&mut own(bytes)));
    all.sort_unstable();
    all
}

/// The place of each of `mine`, which are sorted, among those of all ranks, of which no two are the same: each rank sorts those between two values, which
/// are found by samples. Collective.
pub fn places<T: Serialize + DeserializeOwned + Ord + Clone>(exchange: &dyn Exchange, mine: &[T]) -> Vec<u32> {
    let ranks = exchange.ranks();
    let every = |all: &[T]| (1..ranks).filter_map(|k| all.get(k * all.len() / ranks).cloned()).collect::<Vec<T>>();
    let between = every(&gather(exchange, &every(mine)));
    let mut rest = mine;
    let mut parts = Vec::with_capacity(ranks);
    for value in &between {
        let part;
        (part, rest) = rest.split_at(rest.partition_point(|other| other < value));
        parts.push(part.to_vec());
    }
    parts.push(rest.to_vec());
    parts.resize(ranks, Vec::new());
    let theirs: Vec<Vec<T>> = trade(exchange, parts);
    let lengths = share(exchange, theirs.iter().map(Vec::len).sum::<usize>());
    let first = lengths[..exchange.rank()].iter().sum::<usize>() as u32;
    let mut places: Vec<Vec<u32>> = theirs.iter().map(|theirs| vec![0; theirs.len()]).collect();
    let of_rank = |(rank, theirs): (usize, Vec<T>)| theirs.into_iter().zip(0..).map(move |(value, k)| (value, rank, k));
    let mut all: Vec<(T, usize, usize)> = theirs.into_iter().enumerate().flat_map(of_rank).collect();
    all.sort_unstable();
    all.iter().zip(first..).for_each(|(&(_, rank, k), place)| places[rank][k] = place);
    trade(exchange, places).concat()
}

/// What this rank has of lists of these lengths, if all of them one after the other are cut into equal parts for the ranks.
pub fn shares(lengths: impl Iterator<Item = usize> + Clone, exchange: &dyn Exchange) -> Vec<Range<usize>> {
    let (all, ranks): (usize, _) = (lengths.clone().sum(), exchange.ranks());
    let [begin, end] = [0, 1].map(|next| all * (exchange.rank() + next) / ranks);
    let mut first = 0;
    let of_list = |length| {
        let mine = [begin, end].map(|at| at.clamp(first, first + length) - first);
        first += length;
        mine[0]..mine[1]
    };
    lengths.map(of_list).collect()
}

/// What each rank has for this one, in their order, where `mine` is that for each rank; collective.
pub fn trade<T: Serialize + DeserializeOwned>(exchange: &dyn Exchange, mine: Vec<T>) -> Vec<T> {
    if exchange.ranks() == 1 {
        return mine;
    }
    // one after the other: what is packed is dropped
    let packed = mine.into_iter().map(|mine| pack(&mine)).collect();
    exchange.trade(packed).into_iter().map(own).collect()
}

/// The data of a message, which is dropped.
fn own<T: DeserializeOwned>(bytes: Vec<u8>) -> T {
    unpack(&bytes).unwrap_or_else(|_| unreachable!("ranks run one program"))
}

/// Kinds of asking of a run from outside, three signals, a snapshot and a checkpoint: bits of one number, which go as sums with messages that ranks
/// send anyway.
pub const ASKS: usize = 5;

/// One number a kind, to be added up over the ranks.
pub fn asks(asked: u8) -> [f64; ASKS] {
    std::array::from_fn(|bit| f64::from(asked >> bit & 1))
}

/// What at least one rank asks, from the sums of [`asks`].
pub fn asked(sums: &[f64]) -> u8 {
    sums.iter().enumerate().fold(0, |all, (bit, &count)| all | u8::from(count > 0.0) << bit)
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

/// What ranks have found that looked at different parts of one thing: the error, if there is any, with the least key, which is the one that a rank
/// would meet first that had all parts. Collective.
///
/// # Errors
/// That error on the rank that has found it; elsewhere one of the same kind without words.
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

/// Plain data as bytes, numbers with all their digits.
pub fn pack<T: Serialize>(value: &T) -> Vec<u8> {
    postcard::to_allocvec(value).unwrap_or_default()
}

/// The data of these bytes.
///
/// # Errors
/// Bytes of something else.
pub fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T> {
    postcard::from_bytes(bytes).map_err(|cause| {
        Error::new(Kind::Solver, "a message of another rank cannot be read").because(cause.to_string())
    })
}

/// One process: nothing to exchange.
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

    /// What each of so many ranks comes to.
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

    /// Values have the places that one rank would give them, wherever they are.
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
