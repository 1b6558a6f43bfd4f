//! Mesh files, text and binary: what the reader accepts keeps the promises of a mesh, and its check ends with counts or words.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use winkler::internals::mesh::{Asked, Duty, Mesh, MeshProducer, parse};

fuzz_target!(|bytes: &[u8]| {
    read::<2>(bytes);
    read::<3>(bytes);
});

fn read<const D: usize>(bytes: &[u8]) {
    let mesh: Mesh<D> = match parse(Path::new("a.msh"), bytes, MeshProducer::User) {
        Ok(mesh) => mesh,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    assert!(mesh.points.iter().flatten().all(|x| x.is_finite()));
    for group in mesh.groups.iter() {
        assert!(!group.is_empty() && group.len() == group.tags.len());
        assert!(group.connectivity.iter().all(|point| (*point as usize) < mesh.points.len()));
    }
    // every group of cells as a body, with all others as its loads and supports
    let others = mesh.groups.iter().filter(|group| group.dimension < D);
    let groups: Vec<_> = others.flat_map(|group| [Duty::Acts, Duty::Holds].map(|duty| (&*group.name, duty))).collect();
    let asked = |name| Asked { name, order: mesh.order, groups: groups.clone() };
    let bodies: Vec<Asked> = mesh.group_names(D).map(asked).collect();
    for shared in [false, true] {
        match mesh.check(&bodies, &[], shared) {
            Ok(checked) => {
                assert_eq!(checked.len(), bodies.len());
                for (found, body) in checked.iter().zip(&bodies) {
                    let cells = mesh.group(body.name).map_or(0, |group| group.len());
                    assert_eq!(2 * found.inner + found.outer, (D + 1) * cells);
                }
            }
            Err(error) => assert!(error.advice().is_some(), "{error}"),
        }
    }
    let _ = mesh.lower_order();
}
