//! Readers on damaged files: pieces of small valid files of each format are replaced at random. A reader gives a mesh
//! that keeps its promises, or an error with words; it never panics.

use crate::mesh::{Asked, Duty, MeshProducer, abaqus, parse};
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::{Config, RngSeed, TestRunner};
use std::path::Path;

/// A valid file, whose name tells which reader it is for.
#[derive(Debug, Clone, Copy)]
struct Seed {
    name: &'static str,
    bytes: &'static [u8],
}

const SEEDS: [Seed; 5] = [
    Seed { name: "text2.msh", bytes: include_bytes!("seeds/text2.msh") },
    Seed { name: "text3.msh", bytes: include_bytes!("seeds/text3.msh") },
    Seed { name: "binary3.msh", bytes: include_bytes!("seeds/binary3.msh") },
    Seed { name: "old3q.msh", bytes: include_bytes!("seeds/old3q.msh") },
    Seed { name: "blocks.inp", bytes: include_bytes!("seeds/blocks.inp") },
];

/// What stands in the place of a piece: nothing, signs, and numbers at the ends of what numbers can be.
const WORDS: [&str; 12] =
    ["", "-1", "0", "3", "255", "2147483648", "18446744073709551615", "1e308", "nan", "\"", ",", "\u{fffd}"];

/// Read a file as one of its kind, in two dimensions and in three.
fn read_any(name: &str, bytes: &[u8]) {
    read_as::<2>(name, bytes);
    read_as::<3>(name, bytes);
}

/// Read a mesh, split its bodies and check them with every group as a load and a support.
fn read_as<const D: usize>(name: &str, bytes: &[u8]) {
    for maker in [MeshProducer::User, MeshProducer::Other] {
        let path = Path::new(name);
        let read = if name.ends_with(".msh") {
            parse::<D>(path, bytes, maker)
        } else {
            abaqus::read(path, bytes).map(|(mesh, _)| mesh)
        };
        let mut mesh = match read {
            Ok(mesh) => mesh,
            Err(error) => {
                assert!(!error.to_string().is_empty());
                continue;
            }
        };
        assert!(mesh.points.iter().flatten().all(|x| x.is_finite()));
        for group in mesh.groups.iter() {
            assert!(!group.is_empty() && group.len() == group.tags.len());
            assert!(group.connectivity.iter().all(|point| (*point as usize) < mesh.points.len()));
        }
        let bodies: Vec<String> = mesh.group_names(D).map(str::to_owned).collect();
        bodies.iter().for_each(|name| drop(mesh.split(name)));
        let others = mesh.groups.iter().filter(|group| group.dimension < D);
        let groups: Vec<_> =
            others.flat_map(|group| [Duty::Acts, Duty::Holds].map(|duty| (&*group.name, duty))).collect();
        let asked = |name| Asked { name, order: mesh.order, groups: groups.clone() };
        let bodies: Vec<Asked> = mesh.group_names(D).map(asked).collect();
        if let Err(error) = mesh.check(&bodies, &[], true) {
            assert!(error.advice().is_some(), "{error}");
        }
        let _ = mesh.lower_order();
    }
}

/// Where a piece begins, its length, and the word in its place.
type Change = (Index, usize, &'static str);

#[test]
fn damaged_files_never_end_the_program() {
    SEEDS.iter().for_each(|seed| read_any(seed.name, seed.bytes));
    let change = (any::<Index>(), 0..40_usize, select(&WORDS[..]));
    let changes = (select(&SEEDS[..]), proptest::collection::vec(change, 1..4));
    let config =
        Config { cases: 2000, rng_seed: RngSeed::Fixed(1211_7151), failure_persistence: None, ..Config::default() };
    let test = |(seed, changes): (Seed, Vec<Change>)| {
        let mut bytes = seed.bytes.to_vec();
        for (start, length, word) in changes {
            let start = start.index(bytes.len());
            bytes.splice(start..(start + length).min(bytes.len()), word.bytes());
        }
        read_any(seed.name, &bytes);
        Ok(())
    };
    if let Err(failure) = TestRunner::new(config).run(&changes, test) {
        panic!("{failure}");
    }
}
