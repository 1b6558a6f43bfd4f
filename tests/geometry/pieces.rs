//! Distributed bodies: each rank recovers and writes its part, and all parts together are the body of one rank.

use crate::common::vtu::{Grid, attribute};
use crate::common::{Run, case, solve, solve_on};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

type Place = [u64; 3];

/// A body by its places: numbers at each point, whichever file they are in, and all cells.
struct Body {
    /// Displacement, stress, von Mises stress, principal stresses.
    at: BTreeMap<Place, Vec<Vec<f64>>>,
    cells: Vec<BTreeSet<Place>>,
}

impl Body {
    fn read(folder: &Path, file: &str) -> Self {
        let mut body = Body { at: BTreeMap::new(), cells: Vec::new() };
        if file.ends_with(".vtu") {
            body.add(&Grid::read(&folder.join(file)));
        } else {
            let text = fs::read_to_string(folder.join(file)).expect("a file that joins parts");
            let parts = text.lines().filter(|line| line.starts_with("<Piece "));
            parts.for_each(|tag| body.add(&Grid::read(&folder.join(attribute(tag, "Source")))));
        }
        body.cells.sort();
        body
    }

    fn add(&mut self, grid: &Grid) {
        let places: Vec<Place> = grid.points.chunks_exact(3).map(|x| [0, 1, 2].map(|k| x[k].to_bits())).collect();
        let mut numbers = vec![Vec::new(); places.len()];
        for name in ["displacement", "stress", "von_mises", "principal"] {
            let values = grid.arrays[name].chunks_exact(grid.components[name]);
            numbers.iter_mut().zip(values).for_each(|(to, value)| to.extend(value));
        }
        places.iter().zip(numbers).for_each(|(place, numbers)| self.at.entry(*place).or_default().push(numbers));
        self.cells.extend(grid.cells.iter().map(|cell| cell.iter().map(|&node| places[node]).collect()));
    }
}

const STOP: &str = "method.stop={residual=1e-11}";

/// The fields of `body` in the run on several ranks are those of one rank, at each point of each part; whether
/// parts share points.
fn same_fields(serial: &Run, parallel: &Run, body: &str, file: &str) -> bool {
    let (whole, parts) = (Body::read(&serial.folder, &format!("{body}.vtu")), Body::read(&parallel.folder, file));
    assert_eq!(whole.cells, parts.cells, "{body}: each cell once");
    assert!(whole.at.keys().eq(parts.at.keys()), "{body}: all points");
    let size = |k: usize| whole.at.values().map(|all| all[0][k].abs()).fold(0.0, f64::max);
    let sizes: Vec<f64> = (0..whole.at.values().next().expect("a point")[0].len()).map(size).collect();
    // displacement 3, stress 6, von Mises 1, principal 3
    let largest = |range: std::ops::Range<usize>| sizes[range].iter().copied().fold(0.0, f64::max);
    let of = [largest(0..3), largest(3..13)];
    for (place, all) in &parts.at {
        assert!(
            all.iter().all(|numbers| *numbers == all[0]),
            "{body}: parts differ at {:?}",
            place.map(f64::from_bits)
        );
        for numbers in all {
            for (k, (a, b)) in whole.at[place][0].iter().zip(numbers).enumerate() {
                let to = 1e-8 * of[usize::from(k >= 3)];
                assert!((a - b).abs() <= to, "{body}: {a} and {b} at {:?}", place.map(f64::from_bits));
            }
        }
    }
    parts.at.values().any(|all| all.len() > 1)
}

/// Plane, of revolution, in space, P1 and P2, on springs with a rigid surface, and parts of which some are empty.
#[test]
fn parts_have_the_fields_of_the_whole() {
    let scenes: [(&str, usize, &[&str]); 4] = [
        ("groove3d", 3, &["mesh.set.n=4"]),
        ("flange", 4, &["mesh.set.n=2", "body.0.order=2", "body.1.order=2"]),
        ("coating", 3, &["mesh.set.n=4"]),
        ("patch-3d", 24, &["mesh.set={nl=2,nu=2}"]),
    ];
    for (scene, ranks, sets) in scenes {
        let mut words = vec!["--method", "newton", "--set", "solver=hypre", "--set", STOP, "--vtu"];
        sets.iter().for_each(|set| words.extend(["--set", set]));
        let serial = solve(case(scene), &words).converged();
        let parallel = solve_on(ranks, case(scene), &words).converged();
        let collection = fs::read_to_string(parallel.folder.join("bodies.pvd")).expect("a collection");
        let files: Vec<&str> =
            parallel.report["files"].as_array().into_iter().flatten().filter_map(|f| f.as_str()).collect();
        let mut in_parts = 0;
        for body in serial.report["bodies"].as_array().into_iter().flatten().filter_map(|body| body["name"].as_str()) {
            let [joined, alone] = ["pvtu", "vtu"].map(|ending| format!("{body}.{ending}"));
            let parts = files.iter().filter(|file| file.starts_with(&format!("{body}-r"))).count();
            let file = if parts > 0 { joined } else { alone };
            in_parts += usize::from(same_fields(&serial, &parallel, body, &file));
            assert!(collection.contains(&format!("file=\"{file}\"")), "{scene}: {collection}");
        }
        assert!(in_parts > 0, "{scene}: {files:?}");
        let lost: Vec<_> = files.iter().filter(|file| !parallel.folder.join(file).is_file()).collect();
        assert!(lost.is_empty(), "{scene}: the report names {lost:?}");
    }
}
