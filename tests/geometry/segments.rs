//! Properties of contact pieces on random pairs of surfaces, in the plane and in space: balls and waves over waves and
//! sockets, steep, curved and covered in part, of either order, with either side as the carrier.

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use std::collections::{BTreeMap, HashMap};
use winkler::api::Order;
use winkler::internals::contact::pieces::{self, Cut, Reach};
use winkler::internals::contact::{
    Side, assemble,
    law::{Law, Power},
};
use winkler::internals::fem::{EDGES, Frame, Space};
use winkler::internals::mesh::{Group, Mesh};

/// A surface over the square (in the plane: the interval) from -1 to 1, with the body behind it.
#[derive(Debug, Clone)]
struct Surface {
    /// Radius of a ball, negative for a socket; none for a wave.
    radius: Option<f64>,
    /// Half the angle of the ball in radians, half the width of the wave.
    width: f64,
    /// Amplitude, phase and slope of the wave.
    wave: [f64; 3],
    /// Its middle.
    at: [f64; 2],
    /// 1 if the body lies above, -1 if below.
    above: f64,
    order: Order,
    facets: usize,
}

impl Surface {
    /// The point with parameters `t` from -1 to 1.
    fn point<const D: usize>(&self, t: &[f64]) -> [f64; D] {
        let mut x = [0.0; D];
        let Some(radius) = self.radius else {
            let [amplitude, phase, slope] = self.wave;
            (0..D - 1).for_each(|c| x[c] = self.width * t[c]);
            x[D - 1] =
                self.at[1] + x[..D - 1].iter().map(|x| amplitude * (3.0 * x + phase).sin() + slope * x).sum::<f64>();
            x[0] += self.at[0];
            return x;
        };
        // with the same angles between the points
        (0..D - 1).for_each(|c| x[c] = (self.width * t[c]).tan());
        x[D - 1] = -1.0;
        x = unit(x).map(|x| radius.abs() * x);
        x[0] += self.at[0];
        x[D - 1] += self.at[1] + radius.abs();
        x
    }

    /// The body as a mesh: group `body`, and its face `face`.
    fn mesh<const D: usize>(&self) -> Mesh<D> {
        let n = self.facets;
        let (mut points, mut parameters) = (Vec::new(), Vec::new());
        let columns = if D == 2 { 1 } else { n + 1 };
        for place in 0..columns * (n + 1) {
            let t = [place % (n + 1), place / (n + 1)].map(|i| 2.0 * i as f64 / n as f64 - 1.0);
            points.push(self.point::<D>(&t));
            parameters.push(t);
        }
        let front = points.len();
        for i in 0..front {
            let mut behind = points[i];
            behind[D - 1] += 1.5 * self.above;
            points.push(behind);
        }
        let mut facets: Vec<Vec<u32>> = Vec::new();
        for i in 0..n {
            if D == 2 {
                facets.push(vec![i as u32, i as u32 + 1]);
            }
            for j in 0..if D == 2 { 0 } else { n } {
                let corner = (j * (n + 1) + i) as u32;
                let above = corner + n as u32 + 1;
                facets.push(vec![corner, corner + 1, above + 1]);
                facets.push(vec![corner, above, above + 1]);
            }
        }
        // a prism over each facet, cut so that neighbours agree: their corners are sorted
        let mut cells: Vec<Vec<u32>> = Vec::new();
        for facet in &facets {
            for k in 0..D {
                let mut cell = facet[k..].to_vec();
                cell.extend(facet[..=k].iter().map(|&node| node + front as u32));
                cells.push(cell);
            }
        }
        // of positive volume, as the readers of meshes leave them
        for cell in &mut cells {
            let edge = |c: usize, k: usize| points[cell[k + 1] as usize][c] - points[cell[0] as usize][c];
            if DMatrix::from_fn(D, D, edge).determinant() < 0.0 {
                cell.swap(0, 1);
            }
        }
        if self.order == Order::P2 {
            let mut middles = HashMap::new();
            for simplex in cells.iter_mut().chain(&mut facets) {
                let vertices = simplex.len();
                for &(i, j) in &EDGES[..vertices * (vertices - 1) / 2] {
                    let (p, q) = (simplex[i].min(simplex[j]) as usize, simplex[i].max(simplex[j]) as usize);
                    let middle = *middles.entry((p, q)).or_insert_with(|| {
                        points.push(if q < front {
                            self.point::<D>(&[0, 1].map(|c| 0.5 * (parameters[p][c] + parameters[q][c])))
                        } else {
                            std::array::from_fn(|c| 0.5 * (points[p][c] + points[q][c]))
                        });
                        points.len() as u32 - 1
                    });
                    simplex.push(middle);
                }
            }
        }
        let group = |name: &str, dimension: usize, simplices: Vec<Vec<u32>>| Group {
            name: name.to_owned(),
            dimension,
            stride: simplices[0].len(),
            tags: Vec::new(),
            connectivity: simplices.concat(),
        };
        let groups = vec![group("body", D, cells), group("face", D - 1, facets)].into();
        Mesh::new("random".into(), points, self.order, groups)
    }
}

/// Largest angle that a facet of a ball or socket spans.
const COARSEST: f64 = 0.4;

/// A body above and one below; balls span up to `angle` to either side.
fn pairs(facets: std::ops::Range<usize>, angle: f64) -> impl Strategy<Value = [Surface; 2]> {
    let order = || prop_oneof![Just(Order::P1), Just(Order::P2)];
    let wave = || [0.0..0.15f64, 0.0..6.0f64, -0.4..0.4f64];
    let above = (
        prop_oneof![3 => (0.3..2.0f64).prop_map(Some), 1 => Just(None)],
        0.2..angle,
        wave(),
        -0.8..0.8f64,
        0.0..0.3f64,
    );
    let below =
        (prop_oneof![1 => Just(None), 1 => (1.0..3.0f64).prop_map(Some)], 0.3..angle.min(1.2), wave(), -0.3..0.0f64);
    let fine = |facets: usize, radius: Option<f64>, width: f64| match radius {
        Some(_) => facets.max((2.0 * width / COARSEST).ceil() as usize),
        None => facets,
    };
    (above, below, [order(), order()], [facets.clone(), facets]).prop_map(move |(above, below, orders, facets)| {
        let upper = Surface {
            radius: above.0,
            width: above.1,
            wave: above.2,
            at: [above.3, above.4],
            above: 1.0,
            order: orders[0],
            facets: fine(facets[0], above.0, above.1),
        };
        let lower = Surface {
            radius: below.0,
            width: below.1,
            wave: below.2,
            at: [0.0, below.3],
            above: -1.0,
            order: orders[1],
            facets: fine(facets[1], below.0, below.1),
        };
        [upper, lower]
    })
}

/// Equal parts of a simplex with `D` corners, each edge cut into `n`, by the barycentric coordinates of their corners.
fn parts<const D: usize>(n: usize) -> Vec<[[f64; D]; D]> {
    let at = |i: usize, j: usize| {
        let mut l = [0.0; D];
        (l[1], l[D - 1]) = if D == 2 { (i as f64, i as f64) } else { (i as f64, j as f64) };
        l[0] = n as f64 - l[1..].iter().sum::<f64>();
        l.map(|l| l / n as f64)
    };
    let corners = |all: &[(usize, usize)]| std::array::from_fn(|k| at(all[k].0, all[k].1));
    let mut parts = Vec::new();
    for i in 0..n {
        if D == 2 {
            parts.push(corners(&[(i, 0), (i + 1, 0)]));
        }
        for j in 0..if D == 2 { 0 } else { n - i } {
            parts.push(corners(&[(i, j), (i + 1, j), (i, j + 1)]));
            if i + j + 1 < n {
                parts.push(corners(&[(i + 1, j), (i + 1, j + 1), (i, j + 1)]));
            }
        }
    }
    parts
}

fn length<const D: usize>(x: [f64; D]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn unit<const D: usize>(x: [f64; D]) -> [f64; D] {
    x.map(|c| c / length(x))
}

/// The length or area of a flat simplex.
fn measure<const D: usize>(corners: [[f64; D]; D]) -> f64 {
    let edges = DMatrix::from_fn(D, D - 1, |c, k| corners[k + 1][c] - corners[0][c]);
    (edges.transpose() * edges).determinant().sqrt() / (D - 1) as f64
}

fn distance<const D: usize>(x: [f64; D], y: [f64; D]) -> f64 {
    length(std::array::from_fn::<f64, D, _>(|c| x[c] - y[c]))
}

/// The line of the normals of a side at a place of a facet.
fn normal<const D: usize>(side: &Side<D>, facet: usize, l: &[f64; D]) -> [f64; D] {
    let nodes: Vec<_> = side.facet_nodes(facet).collect();
    unit(std::array::from_fn(|c| (0..D).map(|k| l[k] * nodes[k].direction[c]).sum()))
}

/// Distance at which a line meets a flat simplex.
fn meets<const D: usize>(x: [f64; D], n: [f64; D], corners: &[[f64; D]; D]) -> Option<f64> {
    // most simplices lie beside the line
    let arm: [f64; D] = std::array::from_fn(|c| corners[0][c] - x[c]);
    let along: f64 = (0..D).map(|c| arm[c] * n[c]).sum();
    let beside = length(std::array::from_fn::<f64, D, _>(|c| arm[c] - along * n[c]));
    let edge = |k: usize| distance(corners[k], corners[0]);
    if beside > (1..D).map(edge).fold(0.0, f64::max) {
        return None;
    }
    let matrix = DMatrix::from_fn(D, D, |c, k| if k == 0 { -n[c] } else { corners[k][c] - corners[0][c] });
    let solution = matrix.lu().solve(&DVector::from_fn(D, |c, _| x[c] - corners[0][c]))?;
    let rest = 1.0 - solution.iter().skip(1).sum::<f64>();
    (rest >= 0.0 && solution.iter().skip(1).all(|&l| l >= 0.0)).then(|| solution[0])
}

/// Bounds of the area of side a that faces side b, by shooting rays: of what surely is found, nearer than twice the distance of
/// the surfaces there, and of all.
fn shot<const D: usize>(a: &Side<D>, b: &Side<D>, reach: &Reach) -> [f64; 2] {
    let places = parts::<D>(if D == 2 { 100 } else { 5 });
    let fine = parts::<D>(if b.facets.order == Order::P1 { 1 } else { 8 / (D - 1) });
    let targets: Vec<(usize, [[f64; D]; D])> = (0..b.facets.count())
        .flat_map(|j| fine.iter().map(move |part| (j, part)))
        .map(|(j, part)| (j, part.map(|l| b.facets.point(j, b.space, &l))))
        .collect();
    let mut sums = [0.0; 2];
    for i in 0..a.facets.count() {
        for part in &places {
            let l: [f64; D] = std::array::from_fn(|k| part.iter().map(|corner| corner[k]).sum::<f64>() / D as f64);
            let (x, n) = (a.facets.point(i, a.space, &l), normal(a, i, &l));
            let weight = measure(part.map(|l| a.facets.point(i, a.space, &l)));
            let met = targets.iter().filter(|(j, _)| reach.faces(unit(a.area(i)), unit(b.area(*j))));
            let gap = met.filter_map(|(_, corners)| meets(x, n, corners)).filter(|&t| reach.holds(t));
            let Some(gap) = gap.min_by(|s, t| s.abs().total_cmp(&t.abs())) else { continue };
            let nearest = targets.iter().flat_map(|(_, corners)| corners);
            let nearest = nearest.map(|&y| distance(x, y));
            sums[1] += weight;
            if gap.abs() <= nearest.fold(f64::MAX, f64::min) {
                sums[0] += weight;
            }
        }
    }
    sums
}

/// What must hold for any pair; `slack` is how far the shots may be off, as a share of side a.
fn check<const D: usize>(surfaces: &[Surface; 2], cut: Cut<D>, slack: f64) -> Result<(), TestCaseError> {
    let (free, frame) = (BTreeMap::new(), Frame::default());
    let meshes = surfaces.each_ref().map(Surface::mesh::<D>);
    let spaces: [Space<D>; 2] =
        std::array::from_fn(|k| Space::new(&meshes[k], meshes[k].group("body").expect("a body"), surfaces[k].order));
    let sides: [Side<D>; 2] = std::array::from_fn(|k| {
        Side::new("face", &spaces[k], spaces[k].facets(meshes[k].group("face").expect("a face")), &free, &frame, 180.0)
    });
    for (a, b) in [(&sides[0], &sides[1]), (&sides[1], &sides[0])] {
        let reach = Reach::between(a, b, 60.0, None);
        let common = cut(a, b, &reach);
        let covered: f64 = common.points.iter().map(|point| point.weight).sum();
        let whole = a.mean_measure() * a.facets.count() as f64;
        let [least, most] = shot(a, b, &reach);
        prop_assert!(covered <= most + slack * whole, "covered {covered} of {whole}, at most {most}");
        prop_assert!(covered >= least - slack * whole, "covered {covered} of {whole}, at least {least}");
        for p in &common.points {
            let (from, to) = (a.facets.point(p.facet_a, a.space, &p.at_a), b.facets.point(p.facet_b, b.space, &p.at_b));
            let n = normal(a, p.facet_a, &p.at_a);
            let miss = distance(std::array::from_fn(|c| from[c] + p.gap * n[c]), to);
            prop_assert!(miss < 1e-8 && reach.holds(p.gap), "{p:?} misses by {miss}");
            prop_assert!(p.at_b.iter().all(|l| (-0.1001..1.1001).contains(l)), "{p:?} is off its facet");
        }
        let law = |_: &[[f64; 3]]| Ok(Law::new(Power::linear(1.0)));
        let Ok(pair) = assemble(a, b, [0, 1], &common, &|_| 0.0, &law) else {
            prop_assert!(covered < 1e-9, "no pair, but {covered} is covered");
            continue;
        };
        let sum: f64 = pair.area.iter().sum();
        prop_assert!((sum - covered).abs() < 1e-11 * covered, "weights {sum}, covered {covered}");
        let shares: f64 = pair.cover.iter().map(|cover| cover.share).fold(0.0, f64::max);
        prop_assert!(shares < 1.01, "a facet is covered {shares} times");
        // what a mean may amplify, times the largest sum of the sizes of shape functions on a facet, in space with what lies a tenth beside it
        let [linear, quadratic] = if D == 2 { [1.0, 1.25] } else { [1.6, 2.8] };
        for q in 0..pair.len() {
            prop_assert!(pair.area[q] > 0.0);
            let n = pair.normal[q];
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                let miss = (0..3).map(|c| (pair.resultant[side][q][c] - sign * n[c]).abs()).fold(0.0, f64::max);
                prop_assert!(miss < 1e-9, "point {q}, side {side}: a translation is off by {miss}");
                let mut of_node: HashMap<usize, f64> = HashMap::new();
                pair.nodal[side].row(q).for_each(|(dof, entry)| *of_node.entry(dof / D).or_default() += entry * entry);
                let size: f64 = of_node.values().map(|square| square.sqrt()).sum();
                let most = 5.0 * if [a, b][side].facets.order == Order::P1 { linear } else { quadratic };
                prop_assert!(size <= most, "point {q}, side {side}: shares of {size} in all");
            }
            let net = (0..3).map(|c| (pair.resultant[0][q][c] + pair.resultant[1][q][c]).abs()).fold(0.0, f64::max);
            prop_assert!(net < 1e-12, "point {q}: forces differ by {net}");
        }
    }
    Ok(())
}

/// The same cases in every run.
fn run(
    cases: u32,
    facets: std::ops::Range<usize>,
    angle: f64,
    test: impl Fn(&[Surface; 2]) -> Result<(), TestCaseError>,
) {
    let config = Config { cases, rng_seed: RngSeed::Fixed(1211_7151), failure_persistence: None, ..Config::default() };
    if let Err(failure) = TestRunner::new(config).run(&pairs(facets, angle), |surfaces| test(&surfaces)) {
        panic!("{failure}");
    }
}

#[test]
fn random_pairs_in_the_plane() {
    run(200, 1..12, 1.4, |surfaces| check::<2>(surfaces, pieces::in_plane, 0.02));
}

#[test]
fn random_pairs_in_space() {
    run(24, 1..5, 0.9, |surfaces| check::<3>(surfaces, pieces::in_space, 0.04));
}
