//! Readers on damaged files: bytes of small valid files of each format are changed at random. A reader gives a mesh
//! that keeps its promises, or an error with words; it never panics. `WINKLER_MUTATIONS` sets the number of files of
//! each seed.

use crate::mesh::{Asked, Duty, Mesh, MeshProducer, abaqus, parse};
use std::path::Path;

/// Valid files: their names tell which reader they are for.
const SEEDS: [(&str, &[u8]); 10] = [
    ("text2.msh", include_bytes!("seeds/text2.msh")),
    ("text2q.msh", include_bytes!("seeds/text2q.msh")),
    ("text3.msh", include_bytes!("seeds/text3.msh")),
    ("binary2.msh", include_bytes!("seeds/binary2.msh")),
    ("binary3.msh", include_bytes!("seeds/binary3.msh")),
    ("old2.msh", include_bytes!("seeds/old2.msh")),
    ("old2q.msh", include_bytes!("seeds/old2q.msh")),
    ("old3.msh", include_bytes!("seeds/old3.msh")),
    ("old3q.msh", include_bytes!("seeds/old3q.msh")),
    ("blocks.inp", include_bytes!("seeds/blocks.inp")),
];

/// Number of changed files of each seed: half a second for all.
const FILES: u64 = 300;

/// Words that stand in the place of another one. They are at the ends of what numbers can be.
const WORDS: [&str; 14] = [
    "",
    "-1",
    "0",
    "1",
    "3",
    "255",
    "2147483648",
    "4294967295",
    "18446744073709551615",
    "1e308",
    "-1e-320",
    "nan",
    "\"",
    ",",
];

/// Random numbers by a xorshift generator.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % bound.max(1)
    }

    /// Return a range of bytes, short ones more often.
    fn range(&mut self, length: usize) -> std::ops::Range<usize> {
        let (start, most) = (self.below(length), 1 << self.below(9));
        start..(start + 1 + self.below(most)).min(length)
    }

    fn change(&mut self, bytes: &mut Vec<u8>) {
        let range = self.range(bytes.len());
        if range.is_empty() {
            return;
        }
        match self.below(7) {
            0 => bytes[range.start] ^= 1 << self.below(8),
            1 => bytes[range.start] = self.below(256) as u8,
            2 => drop(bytes.drain(range)),
            3 => {
                let copy = bytes[range].to_vec();
                let at = self.below(bytes.len());
                bytes.splice(at..at, copy);
            }
            4 => {
                let word = WORDS[self.below(WORDS.len())];
                let is_end = |byte: &u8| byte.is_ascii_whitespace() || *byte == b',';
                let length = bytes[range.start..].iter().position(is_end).unwrap_or(0);
                bytes.splice(range.start..range.start + length, word.bytes());
            }
            5 => bytes[range].rotate_left(1),
            _ => bytes.truncate(bytes.len() - self.below(bytes.len() / 8)),
        }
    }
}

/// Read a file as one of its kind, in two dimensions and in three.
fn read_any(name: &str, bytes: &[u8]) {
    for (dimension, read) in [(2, read_as::<2> as fn(&[u8])), (3, read_as::<3>)] {
        if name.ends_with(".msh") {
            read(bytes);
        } else if let Ok(converted) = abaqus::convert(Path::new(name), bytes, dimension) {
            read(&converted.mesh);
        }
    }
}

/// Read a mesh, split its bodies and check them with every group as a load and a support.
fn read_as<const D: usize>(bytes: &[u8]) {
    for maker in [MeshProducer::User, MeshProducer::Other] {
        let mut mesh: Mesh<D> = match parse(Path::new("a.msh"), bytes, maker) {
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

#[test]
fn damaged_files_never_end_the_program() {
    let most = std::env::var("WINKLER_MUTATIONS").ok().and_then(|count| count.parse().ok()).unwrap_or(FILES);
    for (place, (name, seed)) in SEEDS.iter().enumerate() {
        read_any(name, seed);
        for number in 0..most {
            let mut random = Random(1 + ((place as u64) << 40 | number).wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let mut bytes = seed.to_vec();
            (0..1 + random.below(4)).for_each(|_| random.change(&mut bytes));
            let read = std::panic::catch_unwind(|| read_any(name, &bytes));
            if read.is_err() {
                let file = std::env::temp_dir().join(format!("mutation-{number}-{name}"));
                std::fs::write(&file, &bytes).unwrap();
                panic!("{} ends the program", file.display());
            }
        }
    }
}
