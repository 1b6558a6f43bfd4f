//! Meshes of boxes, in any place and with any digits.

use std::collections::HashMap;
use std::fmt::Write;

/// A mesh in Gmsh's format 2.2.
#[derive(Default)]
pub struct Blocks {
    names: Vec<(usize, String)>,
    nodes: Vec<[f64; 3]>,
    elements: Vec<(usize, usize, Vec<usize>)>,
}

impl Blocks {
    /// Add a box of `n` cells along each axis, divided into simplices, with its lower and upper face and the one along the first axis.
    pub fn add(&mut self, name: &str, dimension: usize, order: usize, n: usize, at: impl Fn([f64; 3]) -> [f64; 3]) {
        let mut number: HashMap<[usize; 3], usize> = HashMap::new();
        let last = dimension - 1;
        for (suffix, fixed) in
            [("", None), ("_low", Some((last, 0))), ("_high", Some((last, 2 * n))), ("_side", Some((0, 2 * n)))]
        {
            let free: Vec<usize> =
                (0..dimension).filter(|&axis| fixed.is_none_or(|(fixed, _)| fixed != axis)).collect();
            self.names.push((free.len(), format!("{name}{suffix}")));
            let group = self.names.len();
            for (cell, axes) in
                (0..n.pow(free.len() as u32)).flat_map(|cell| orders(&free).map(move |axes| (cell, axes)))
            {
                // Places are counted in halves of cells, so that the middles of edges have places, too.
                let mut place = [0; 3];
                fixed.into_iter().for_each(|(axis, at)| place[axis] = at);
                free.iter().enumerate().for_each(|(k, &axis)| place[axis] = 2 * (cell / n.pow(k as u32) % n));
                let mut all = vec![place];
                for axis in axes {
                    place[axis] += 2;
                    all.push(place);
                }
                for [i, j] in [[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]] {
                    if order == 2 && i.max(j) <= free.len() {
                        all.push([0, 1, 2].map(|c| (all[i][c] + all[j][c]) / 2));
                    }
                }
                let tag = |place: [usize; 3]| {
                    *number.entry(place).or_insert_with(|| {
                        self.nodes.push(at(place.map(|p| p as f64 / (2 * n) as f64)));
                        self.nodes.len()
                    })
                };
                let tags = all.into_iter().map(tag).collect();
                self.elements.push((free.len(), group, tags));
            }
        }
    }

    /// Return the text of the file, with each coordinate as `written`.
    pub fn text(&self, order: usize, written: impl Fn(f64) -> String) -> String {
        let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n", self.names.len());
        for (number, (dimension, name)) in (1..).zip(&self.names) {
            writeln!(text, "{dimension} {number} \"{name}\"").expect("a text");
        }
        writeln!(text, "$EndPhysicalNames\n$Nodes\n{}", self.nodes.len()).expect("a text");
        for (number, x) in (1..).zip(&self.nodes) {
            let [x, y, z] = x.map(&written);
            writeln!(text, "{number} {x} {y} {z}").expect("a text");
        }
        writeln!(text, "$EndNodes\n$Elements\n{}", self.elements.len()).expect("a text");
        for (number, (dimension, group, nodes)) in (1..).zip(&self.elements) {
            let kind = [[0, 1, 2, 4], [0, 8, 9, 11]][order - 1][*dimension];
            let nodes: Vec<String> = nodes.iter().map(ToString::to_string).collect();
            writeln!(text, "{number} {kind} 2 {group} {group} {}", nodes.join(" ")).expect("a text");
        }
        text + "$EndElements\n"
    }
}

/// Return the orders of one to three axes.
fn orders(axes: &[usize]) -> impl Iterator<Item = Vec<usize>> {
    let all: &[&[usize]] = match axes.len() {
        1 => &[&[0]],
        2 => &[&[0, 1], &[1, 0]],
        _ => &[&[0, 1, 2], &[0, 2, 1], &[1, 0, 2], &[1, 2, 0], &[2, 0, 1], &[2, 1, 0]],
    };
    let axes = axes.to_vec();
    all.iter().map(move |order| order.iter().map(|&k| axes[k]).collect())
}
