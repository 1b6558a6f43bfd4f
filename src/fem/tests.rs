//! Tests of rigid surfaces that turn: dofs, matrices and forces together.

use super::space::sample::block;
use super::{Elasticity, Frame, NodeGraph, PointExtent, RigidMotion, Space, assemble, rigid};
use crate::linalg::{cross, dot, minus, pad};
use crate::problem::{BodySpec, Order, Plane};

/// Return a space, and the frame in which its nodes at the end of the first axis turn.
fn turning<const D: usize>(order: Order) -> (Space<D>, Frame<D>) {
    let space = block::<D>(2, order);
    let places = space.nodes.clone();
    let at_end = |node: &u32| (places[*node as usize][0] - 0.2 * places[*node as usize][1] - 1.0).abs() < 0.05;
    let nodes: Vec<u32> = (0..places.len() as u32).filter(at_end).collect();
    let mut frame = Frame::default();
    frame.tie(&nodes);
    frame.let_turn(&nodes, |node| places[node as usize]);
    (space, frame)
}

/// Return dofs of all kinds: those of tied nodes are zero, except for the rotation.
fn some<const D: usize>(space: &Space<D>, frame: &Frame<D>, phase: f64) -> Vec<f64> {
    let [pole, _] = frame.poles().next().expect("a pole");
    let is_free = |dof: usize| match (dof / D) as u32 {
        node if node == pole => D == 3 || dof.is_multiple_of(D),
        node => frame.node(node) == node,
    };
    (0..space.dofs()).map(|dof| if is_free(dof) { (dof as f64 * 0.7 + phase).sin() } else { 0.0 }).collect()
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-11 * (1.0 + a.abs()), "{a} {b}");
}

/// The matrix in the dofs is that of the displacements: v'(T'KT)w = (Tv)'K(Tw).
fn same_form<const D: usize>(order: Order) {
    let (space, frame) = turning::<D>(order);
    let spec = BodySpec::new("block", 3.0, 0.3).elasticity();
    let elasticity = Elasticity::new(&[&spec], Vec::new(), D, Plane::Strain).expect("a material");
    let form = |frame: &Frame<D>, v: &[f64], w: &[f64]| {
        let graph = NodeGraph::new(&space, &[], frame);
        let matrix = assemble::stiffness(&space, &graph, frame, &elasticity).expect("a matrix");
        let mut of_w = vec![0.0; w.len()];
        matrix.multiply(w, &mut of_w);
        dot(v, &of_w)
    };
    let [v, w] = [0.0, 1.0].map(|phase| some(&space, &frame, phase));
    let [u_v, u_w] = [&v, &w].map(|v| frame.displacements(v));
    near(form(&frame, &v, &w), form(&Frame::default(), &u_v, &u_w));
}

#[test]
fn matrices_displacements_and_forces_belong_together() {
    for order in [Order::P1, Order::P2] {
        same_form::<2>(order);
        same_form::<3>(order);
    }
}

/// A force at the centre and a moment about it do the work of both on a rigid motion about the centre, whose dofs give
/// its displacements.
fn work<const D: usize>(moment: [f64; 3]) {
    let centre = std::array::from_fn(|c| 0.4 + 0.1 * c as f64);
    let (space, frame) = turning::<D>(Order::P2);
    let [pole, master] = frame.poles().next().expect("a pole");
    let x = |node: u32| space.nodes[node as usize];
    let force: [f64; D] = std::array::from_fn(|c| 2.0 - c as f64);
    let about_master = cross(pad(minus(centre, x(master))), pad(force));
    let all: [f64; 3] = std::array::from_fn(|c| moment[c] + about_master[c]);
    let mut at_dofs = vec![0.0; space.dofs()];
    for (node, force) in frame.force(master, force).chain([(pole, frame.moment(pole, all))]) {
        (0..D).for_each(|c| at_dofs[D * node as usize + c] += force[c]);
    }
    let motions: Vec<RigidMotion<D>> = rigid::modes(&PointExtent::of(space.nodes.iter().copied()));
    for motion in &motions {
        let u = motion.nodal(space.nodes.iter().copied());
        let v: Vec<f64> = (0..space.nodes.len() as u32)
            .flat_map(|node| frame.dofs(node, |node| motion.at(&x(node)), motion.rotation()))
            .collect();
        let mut tied = frame.tied().filter(|node| *node != pole);
        assert!(tied.all(|node| v[D * node as usize..][..D] == [0.0; D]));
        frame.displacements(&v).iter().zip(&u).for_each(|(a, b)| near(*a, *b));
        // The curl of the displacement is twice the rotation.
        let turned = |c: usize| {
            let [i, j] = [(c + 1) % 3, (c + 2) % 3];
            let along = |axis: usize, of: usize| {
                let moved: [f64; D] = std::array::from_fn(|k| centre[k] + f64::from(u8::from(k == axis)));
                if axis < D && of < D { motion.at(&moved)[of] - motion.at(&centre)[of] } else { 0.0 }
            };
            0.5 * (along(i, j) - along(j, i))
        };
        let expected = dot(&motion.at(&centre), &force) + (0..3).map(|c| moment[c] * turned(c)).sum::<f64>();
        near(dot(&at_dofs, &v), expected);
    }
}

#[test]
fn loads_do_the_work_of_force_and_moment() {
    work::<2>([0.0, 0.0, 1.5]);
    work::<3>([0.7, -1.1, 1.5]);
}
