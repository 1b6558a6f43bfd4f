//! Rigid motions of a body, and those that its supports leave unconstrained.

use super::assemble::NodalBlock;
use super::length;
use crate::exchange::Plain;
use crate::linalg::{Blocks, TOLERANCE, Total, around, bounds, dot, pad};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// A rigid motion as a sum of translations and rotations about a centre. It is stored in a few numbers, whatever the
/// number of nodes.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct RigidMotion<const D: usize> {
    /// Name such as "translation along y" or "rotation".
    pub name: String,
    centre: [f64; D],
    /// Largest distance along an axis from the centre, by which rotations are divided.
    size: f64,
    /// Weights of the translations along the axes, then of the rotations in [`PLANES`].
    weights: [f64; 6],
}

/// Plane of each rotation, from the first axis to the second, and its name in space.
const PLANES: [(usize, usize, &str); 3] =
    [(1, 2, "rotation about x"), (2, 0, "rotation about y"), (0, 1, "rotation about z")];

impl<const D: usize> RigidMotion<D> {
    /// Return the motion in words, up to a thousandth of it: a translation along a direction, or a rotation. A rotation
    /// with a translation is one about another axis.
    pub fn in_words(&self) -> String {
        let (kind, v) = self.kind();
        let largest = v.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or_default();
        let parts = v.map(|part| (part * largest.signum() / length(v) * 1e3).round() / 1e3 + 0.0);
        let axis = (0..3).find(|&c| parts[c] == 1.0).map(|c| ["x", "y", "z"][c].to_owned());
        let direction = axis.unwrap_or_else(|| {
            let parts: Vec<String> = parts[..D].iter().map(ToString::to_string).collect();
            format!("({})", parts.join(","))
        });
        if D == 2 && kind == TURN { "rotation".to_owned() } else { format!("{kind} {direction}") }
    }

    /// Return what of a support would hold the motion.
    pub fn support(&self) -> &'static str {
        let (kind, v) = self.kind();
        let most = (0..3).max_by(|&a, &b| v[a].abs().total_cmp(&v[b].abs())).unwrap_or(0);
        if kind == TURN { "beside the axis of the rotation" } else { ["with x = 0", "with y = 0", "with z = 0"][most] }
    }

    /// Return whether the motion is a translation or a rotation, with the vector of either.
    fn kind(&self) -> (&'static str, [f64; 3]) {
        let [along, about] = [0, 3].map(|first| std::array::from_fn(|c| self.weights[first + c]));
        if length(about) > SMALL * length(along) { (TURN, about) } else { ("translation along", along) }
    }

    /// Return the largest weight.
    fn largest(&self) -> f64 {
        self.weights.iter().fold(f64::MIN_POSITIVE, |largest, weight| largest.max(weight.abs()))
    }

    /// Return the displacement at a point.
    pub fn at(&self, x: &[f64; D]) -> [f64; D] {
        let mut u = std::array::from_fn(|c| self.weights[c]);
        for ((i, j, _), weight) in PLANES.into_iter().zip(&self.weights[3..]).filter(|(_, weight)| **weight != 0.0) {
            u[i] -= weight * (x[j] - self.centre[j]) / self.size;
            u[j] += weight * (x[i] - self.centre[i]) / self.size;
        }
        u
    }

    /// Return the rotation vector (x, y, z).
    pub fn rotation(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.weights[3 + k] / self.size)
    }

    /// Return the displacements of points, `D` entries each.
    pub fn nodal(&self, points: impl Iterator<Item = [f64; D]>) -> Vec<f64> {
        points.flat_map(|x| self.at(&x)).collect()
    }
}

/// The first words on a rotation.
const TURN: &str = "rotation about";

/// Share of a motion below which a part of it is not mentioned.
const SMALL: f64 = 1e-3;

/// Return other combinations of motions about the same centre, and of the vectors that go with them, in which
/// translations are apart from rotations, and both are along axes where these are among them. Translations come first.
pub fn apart<const D: usize>(span: Vec<(RigidMotion<D>, DVector<f64>)>) -> Vec<(RigidMotion<D>, DVector<f64>)> {
    let mut span = span;
    let mut done = 0;
    for k in [3, 4, 5, 0, 1, 2] {
        let size = |row: &(RigidMotion<D>, DVector<f64>)| row.0.weights[k].abs() / row.0.largest();
        let pivot = (done..span.len()).max_by(|&i, &j| size(&span[i]).total_cmp(&size(&span[j])));
        let Some(pivot) = pivot.filter(|&i| size(&span[i]) > SMALL) else { continue };
        span.swap(done, pivot);
        let (mut motion, vector) = span[done].clone();
        let scale = motion.weights[k].recip();
        motion.weights = motion.weights.map(|weight| scale * weight);
        span[done] = (motion.clone(), scale * vector);
        for row in (0..span.len()).filter(|&row| row != done) {
            let amount = span[row].0.weights[k];
            let change = amount * &span[done].1;
            span[row].1 -= change;
            span[row].0.weights.iter_mut().zip(motion.weights).for_each(|(own, weight)| *own -= amount * weight);
        }
        done += 1;
    }
    span.sort_by_key(|(motion, _)| motion.kind().0 == TURN);
    span
}

/// Return translations that turn rotations about all axes, as [`apart`] returns them, into rotations about one point;
/// zeros unless all three are there.
///
/// If the rotation about axis k comes with the translation T_kc along axis c, the symmetric part of T is what no common
/// point explains.
pub fn to_common_point<const D: usize>(motions: &[&RigidMotion<D>]) -> Vec<[f64; D]> {
    let mut shifts = vec![[0.0; D]; motions.len()];
    if D == 3 && motions.len() == 3 && motions.iter().all(|motion| motion.kind().0 == TURN) {
        for k in 0..3 {
            for c in 0..D {
                shifts[k][c] = -0.5 * (motions[k].weights[c] + motions[c].weights[k]);
            }
        }
    }
    shifts
}

/// Return the rigid motions of a body. A body of revolution has only the translation along its axis.
pub fn of<const D: usize>(extent: &PointExtent, axisymmetric: bool) -> Vec<RigidMotion<D>> {
    let mut all = modes(extent);
    if axisymmetric {
        all = vec![all.swap_remove(1)];
    }
    all
}

/// Return the 3 (2D) or 6 (3D) rigid motions about the mean of some points: translations, then rotations, scaled to
/// displacements of about one. Gmsh and PETSc call them rigid body modes.
pub fn modes<const D: usize>(extent: &PointExtent) -> Vec<RigidMotion<D>> {
    let (centre, size) = (extent.mean(), extent.farthest::<D>());
    let translations = (0..D).map(|c| (c, format!("translation along {}", ["x", "y", "z"][c])));
    let rotations = (0..3).filter(|&k| D == 3 || k == 2);
    let rotations = rotations.map(|k| (3 + k, if D == 2 { "rotation" } else { PLANES[k].2 }.to_owned()));
    let unit = |index: usize| std::array::from_fn(|k| if k == index { 1.0 } else { 0.0 });
    let motion = |(index, name)| RigidMotion { name, centre, size, weights: unit(index) };
    translations.chain(rotations).map(motion).collect()
}

/// Return a basis of the motions that prescribed dofs leave unconstrained, as vectors of the weights of `count`
/// motions. `value` gives the displacement of a motion at a dof.
pub fn left_by_supports(
    count: usize,
    value: impl Fn(usize, usize) -> f64,
    prescribed: &[(usize, f64)],
) -> Vec<DVector<f64>> {
    let rows = DMatrix::from_fn(prescribed.len(), count, |i, j| value(j, prescribed[i].0));
    Blocks::free(&(rows.transpose() * &rows), prescribed.len().max(1) as f64, TOLERANCE)
}

/// Return the stiffness of springs in terms of `count` motions. `at` gives the displacement of a motion at a node.
pub fn of_springs<'s, const D: usize>(
    count: usize,
    at: impl Fn(usize, u32) -> [f64; D],
    springs: impl Iterator<Item = &'s NodalBlock<D>>,
) -> DMatrix<f64> {
    let mut stiffness = DMatrix::zeros(count, count);
    for NodalBlock { nodes, block } in springs {
        let [of_a, of_b] = nodes.map(|node| (0..count).map(|k| at(k, node)).collect::<Vec<_>>());
        for (i, a) in of_a.iter().enumerate() {
            let force: [f64; D] = std::array::from_fn(|d| (0..D).map(|c| a[c] * block[c][d]).sum());
            of_b.iter().enumerate().for_each(|(j, b)| stiffness[(i, j)] += dot(&force, b));
        }
    }
    stiffness
}

/// Return the combination of motions about the same centre, scaled so that its largest weight is one.
pub fn combine<const D: usize>(motions: &[RigidMotion<D>], weights: &DVector<f64>) -> RigidMotion<D> {
    let sum = sum(motions, weights);
    let largest = sum.largest();
    RigidMotion { weights: sum.weights.map(|weight| weight / largest), ..sum }
}

/// Return a basis of the span of motions about the same centre that begins with the combinations of these orthonormal
/// weights. The motions that are farthest from the span so far complete it.
pub fn basis_from<const D: usize>(motions: &[RigidMotion<D>], first: &[DVector<f64>]) -> Vec<RigidMotion<D>> {
    let mut basis: Vec<RigidMotion<D>> = first.iter().map(|weights| combine(motions, weights)).collect();
    let mut rest = DMatrix::identity(motions.len(), motions.len());
    first.iter().for_each(|weights| rest -= weights * weights.tr_mul(&rest));
    while basis.len() < motions.len() {
        let norm = |k: usize| rest.column(k).norm();
        let farthest = (0..motions.len()).fold(0, |most, k| if norm(k) > norm(most) { k } else { most });
        let direction = rest.column(farthest).normalize();
        rest -= &direction * direction.tr_mul(&rest);
        basis.push(motions[farthest].clone());
    }
    basis
}

/// Return the weighted sum of motions about the same centre.
pub fn sum<const D: usize>(motions: &[RigidMotion<D>], weights: &DVector<f64>) -> RigidMotion<D> {
    let sum = |k: usize| motions.iter().zip(weights).map(|(motion, weight)| weight * motion.weights[k]).sum();
    let (centre, size) = motions.first().map_or(([0.0; D], 1.0), |motion| (motion.centre, motion.size));
    let sum = RigidMotion { name: String::new(), centre, size, weights: std::array::from_fn(sum) };
    RigidMotion { name: sum.in_words(), ..sum }
}

/// The number, the sum and the box of a set of points, on which the rigid motions of the points depend.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct PointExtent {
    count: usize,
    sum: [Total; 3],
    /// Corners of the box around the points, with the least and the largest coordinates.
    bounds: [[f64; 3]; 2],
}

impl Default for PointExtent {
    fn default() -> Self {
        Self { count: 0, sum: [Total::default(); 3], bounds: bounds([]) }
    }
}

impl PointExtent {
    /// Summarise these points.
    pub fn of<const D: usize>(points: impl Iterator<Item = [f64; D]>) -> Self {
        let mut all = Self::default();
        points.for_each(|x| all.add(x));
        all
    }

    /// Add a point.
    pub fn add<const D: usize>(&mut self, x: [f64; D]) {
        let x = pad(x);
        self.count += 1;
        self.sum.iter_mut().zip(x).for_each(|(sum, x)| sum.add(x));
        self.bounds = around(self.bounds, [x; 2]);
    }

    /// Return the summary of these points and others.
    #[must_use]
    pub fn join(mut self, others: &Self) -> Self {
        self.sum.iter_mut().zip(&others.sum).for_each(|(sum, more)| sum.join(more));
        Self { count: self.count + others.count, bounds: around(self.bounds, others.bounds), ..self }
    }

    /// Return the mean of the points.
    pub fn mean<const D: usize>(&self) -> [f64; D] {
        std::array::from_fn(|c| self.sum[c].value() / self.count.max(1) as f64)
    }

    /// Return the largest distance of a point from the mean along an axis, which is positive.
    pub fn farthest<const D: usize>(&self) -> f64 {
        let mean: [f64; D] = self.mean();
        let along = |c: usize| self.bounds.map(|x| (x[c] - mean[c]).abs());
        (0..D).filter(|_| self.count > 0).flat_map(along).fold(f64::MIN_POSITIVE, f64::max)
    }

    /// Return the largest side of the box around the points.
    pub fn size(&self) -> f64 {
        let [low, high] = self.bounds;
        (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max)
    }

    /// Return the corners of this box. A rigid motion that moves none of them moves no point.
    pub fn corners<const D: usize>(&self) -> impl Iterator<Item = [f64; D]> {
        let bounds = self.bounds;
        (0..1 << D).map(move |corner: usize| std::array::from_fn(|c| bounds[corner >> c & 1][c]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn supports_leave_what_they_do_not_hold() {
        let nodes = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        let all = modes(&PointExtent::of(nodes.into_iter()));
        let value = |k: usize, dof: usize| all[k].at(&nodes[dof / 2])[dof % 2];
        let remaining = |dofs: &[usize]| {
            let prescribed: Vec<_> = dofs.iter().map(|&dof| (dof, 0.0)).collect();
            let remaining = left_by_supports(3, value, &prescribed);
            remaining.iter().map(|weights| combine(&all, weights)).collect::<Vec<_>>()
        };
        let names = |dofs: &[usize]| remaining(dofs).into_iter().map(|motion| motion.name).collect::<Vec<_>>();
        assert_eq!(names(&[]).len(), 3);
        // With x prescribed on the edge x = 2, only the translation along y remains.
        assert_eq!(names(&[2, 4]), ["translation along y"]);
        assert_eq!(names(&[0, 1, 3]), Vec::<String>::new());
        // With one pinned node, the rotation about it remains.
        let pinned = remaining(&[0, 1]);
        assert_eq!(pinned.len(), 1);
        let u = pinned[0].nodal(nodes.into_iter());
        assert!(u[0].abs() < 1e-14 && u[1].abs() < 1e-14 && u[5].abs() > 0.4);
    }

    /// In space the rotation about z is that of the plane, and the rotation about x turns y to z.
    #[test]
    fn rotations_turn_their_planes() {
        let nodes = [[0.0, 0.0, 0.0], [2.0, 2.0, 2.0]];
        let all = modes(&PointExtent::of(nodes.into_iter()));
        let at = |name: &str| all.iter().find(|motion| motion.name == name).map(|motion| motion.at(&nodes[1]));
        assert_eq!(at("rotation about z"), Some([-1.0, 1.0, 0.0]));
        assert_eq!(at("rotation about x"), Some([0.0, -1.0, 1.0]));
        assert_eq!(at("rotation about y"), Some([1.0, 0.0, -1.0]));
        assert_eq!(at("translation along y"), Some([0.0, 1.0, 0.0]));
    }
}
