//! Rigid motions of a body and what its supports leave of them.

use super::assemble::NodalBlock;
use super::space::Space;
use crate::linalg::{Blocks, PART, TOLERANCE};
use nalgebra::{DMatrix, DVector};

/// A rigid motion: displacement of every node and a name for messages.
#[derive(Debug, Clone)]
pub struct RigidMotion {
    /// "translation along y", "rotation", or a mixture of them.
    pub name: String,
    /// Displacement, one entry a dof (`D * node + component`), largest entry about one.
    pub displacement: Vec<f64>,
}

/// A rigid motion that supports leave free.
#[derive(Debug, Clone)]
pub struct FreeMotion {
    /// Displacement, one entry a dof, zero at supports.
    pub displacement: Vec<f64>,
    /// Work of the loads on it.
    pub work: f64,
}

/// The motions of [`left_by_supports`] with the work that `load` does on them.
pub fn free(left: &[RigidMotion], prescribed: &[(usize, f64)], load: &[f64]) -> Vec<FreeMotion> {
    let of = |motion: &RigidMotion| {
        let mut displacement = motion.displacement.clone();
        prescribed.iter().for_each(|entry| displacement[entry.0] = 0.0);
        FreeMotion { work: crate::linalg::dot(&displacement, load), displacement }
    };
    left.iter().map(of).collect()
}

/// The rigid motions of a body; of one of revolution the translation along its axis alone.
pub fn of<const D: usize>(space: &Space<D>) -> Vec<RigidMotion> {
    of_all(&[space])
}

/// The rigid motions of several bodies as one, node by node and body by body.
pub fn of_all<const D: usize>(spaces: &[&Space<D>]) -> Vec<RigidMotion> {
    let mut all = match spaces {
        [space] => modes(&space.nodes),
        _ => modes(&spaces.iter().flat_map(|space| space.nodes.iter().copied()).collect::<Vec<_>>()),
    };
    if spaces.iter().any(|space| space.axisymmetric) {
        all = vec![all.swap_remove(1)];
    }
    all
}

/// The 3 (2D) or 6 (3D) rigid motions about the centre of `nodes`: translations, then rotations, scaled to
/// displacements of about one. Gmsh and PETSc call them rigid body modes.
pub fn modes<const D: usize>(nodes: &[[f64; D]]) -> Vec<RigidMotion> {
    let n = nodes.len().max(1) as f64;
    let centre: [f64; D] = std::array::from_fn(|i| nodes.iter().map(|x| x[i]).sum::<f64>() / n);
    let size =
        nodes.iter().flat_map(|x| (0..D).map(move |i| (x[i] - centre[i]).abs())).fold(f64::MIN_POSITIVE, f64::max);
    let mut all = Vec::new();
    for c in 0..D {
        let mut displacement = vec![0.0; D * nodes.len()];
        displacement.iter_mut().skip(c).step_by(D).for_each(|u| *u = 1.0);
        all.push(RigidMotion { name: format!("translation along {}", ["x", "y", "z"][c]), displacement });
    }
    let planes: &[(usize, usize, &str)] = if D == 2 {
        &[(0, 1, "rotation")]
    } else {
        &[(1, 2, "rotation about x"), (2, 0, "rotation about y"), (0, 1, "rotation about z")]
    };
    for &(i, j, name) in planes {
        let mut displacement = vec![0.0; D * nodes.len()];
        for (node, x) in nodes.iter().enumerate() {
            displacement[D * node + i] = -(x[j] - centre[j]) / size;
            displacement[D * node + j] = (x[i] - centre[i]) / size;
        }
        all.push(RigidMotion { name: name.to_owned(), displacement });
    }
    all
}

/// The rigid motions that vanish on the prescribed dofs: a basis of what the supports leave free.
pub fn left_by_supports(motions: &[RigidMotion], prescribed: &[(usize, f64)]) -> Vec<RigidMotion> {
    let rows = DMatrix::from_fn(prescribed.len(), motions.len(), |i, j| motions[j].displacement[prescribed[i].0]);
    Blocks::free(&(rows.transpose() * &rows), prescribed.len().max(1) as f64, TOLERANCE)
        .into_iter()
        .map(|weights| combine(motions, &weights))
        .collect()
}

/// Stiffness of springs in terms of motions of the nodes.
pub fn of_springs<const D: usize>(motions: &[RigidMotion], springs: &[NodalBlock<D>]) -> DMatrix<f64> {
    let energy = |a: &RigidMotion, b: &RigidMotion| -> f64 {
        let at = |motion: &RigidMotion, node: u32, c: usize| motion.displacement[D * node as usize + c];
        let of = |spring: &NodalBlock<D>| -> f64 {
            let [i, j] = spring.nodes;
            let terms = (0..D).flat_map(|c| (0..D).map(move |d| (c, d)));
            terms.map(|(c, d)| at(a, i, c) * spring.block[c][d] * at(b, j, d)).sum()
        };
        springs.iter().map(of).sum()
    };
    DMatrix::from_fn(motions.len(), motions.len(), |i, j| energy(&motions[i], &motions[j]))
}

/// Of the motions in `left`, those that springs do not feel; `all` are the motions of the free body, which set the scale.
pub fn left_by_springs<const D: usize>(
    left: Vec<RigidMotion>,
    all: &[RigidMotion],
    springs: &[NodalBlock<D>],
) -> Vec<RigidMotion> {
    let scale = of_springs(all, springs).diagonal().max();
    if scale == 0.0 {
        return left;
    }
    let gram = of_springs(&left, springs);
    Blocks::free(&gram, scale, TOLERANCE).into_iter().map(|weights| combine(&left, &weights)).collect()
}

/// Combination of motions, named after the parts that matter.
pub fn combine(motions: &[RigidMotion], weights: &DVector<f64>) -> RigidMotion {
    let largest = weights.amax();
    let mut name = Vec::new();
    let mut displacement = vec![0.0; motions.first().map_or(0, |m| m.displacement.len())];
    for (motion, &weight) in motions.iter().zip(weights.iter()) {
        if weight.abs() > PART * largest {
            name.push(motion.name.as_str());
        }
        crate::linalg::axpy(weight / largest, &motion.displacement, &mut displacement);
    }
    RigidMotion { name: crate::error::joined(name), displacement }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn supports_leave_what_they_do_not_hold() {
        let nodes = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        let all = modes(&nodes);
        let left = |dofs: &[usize]| {
            let prescribed: Vec<_> = dofs.iter().map(|&dof| (dof, 0.0)).collect();
            left_by_supports(&all, &prescribed).into_iter().map(|m| m.name).collect::<Vec<_>>()
        };
        assert_eq!(left(&[]).len(), 3);
        // x held on the edge x = 2: translation along y is left, and nothing else
        assert_eq!(left(&[2, 4]), ["translation along y"]);
        assert_eq!(left(&[0, 1, 3]), Vec::<String>::new());
        // one pinned node: a rotation about it
        let pinned = left_by_supports(&all, &[(0, 0.0), (1, 0.0)]);
        assert_eq!(pinned.len(), 1);
        assert!(pinned[0].displacement[0].abs() < 1e-14 && pinned[0].displacement[1].abs() < 1e-14);
        assert!(pinned[0].displacement[5].abs() > 0.4);
    }
}
