//! Evaluation of the displacements of a body: fields for output, forces and their balance, errors against a known
//! solution. Each rank evaluates its part.

use super::body_mesh::BodyMesh;
use super::groups::point;
use crate::contact::add;
use crate::error::{Error, Result};
use crate::expression::Expression;
use crate::fem::displacement::{self, Strained};
use crate::fem::{Elasticity, Frame, NodalBlock, NodeGraph, Space, Split, assemble, pad, space};
use crate::output::{BodyField, CellKind, LargestStress};
use std::cell::OnceCell;
use std::rc::Rc;

/// A part of a body that is evaluated for states of the dofs of its nodes, without the space dimension.
pub trait Post {
    /// Return displacements and stresses of the cells that this rank writes, at nodes, and above order two at equally
    /// spaced points in their place. A node where the material jumps is several points, one for each material. `bent`
    /// is the state without the rigid motion that supports leave. Stresses come from `bent`, since a large rigid motion
    /// leaves few digits to the deformation.
    fn field(&self, v: &[f64], bent: &[f64]) -> BodyField;

    /// Return the largest strain in the cells that this rank writes. `bent` is as in [`Post::field`].
    fn strain(&self, bent: &[f64]) -> Strained;

    /// Return the integral of the rotation vector (x, y, z) over the cells that this rank writes.
    fn rotation(&self, v: &[f64]) -> [f64; 3];

    /// Return the forces on the owned nodes under the loads and the forces omega p of the contact rows of the body.
    fn balance(&self, v: &[f64], force: &[f64]) -> ForceBalance;

    /// Return the contribution of owned nodes to the displacement of the body towards each of its contact surfaces.
    fn approach(&self, v: &[f64]) -> Vec<f64>;

    /// Return the norms of the error against the known displacements of the scene, and the norms of these
    /// displacements. They are the L2 norm, the H1 seminorm and the energy norm ([`displacement::norms_of_error`]) on
    /// the cells that this rank writes. The result is `None` if the scene has no known displacements.
    fn errors(&self, v: &[f64]) -> Option<[[f64; 3]; 2]>;
}

/// A body with its elasticity, or the cells that one rank has of it, with their nodes in local numbers: the
/// implementation of [`Post`] in `D` dimensions.
///
/// The cells around owned nodes are complete, and so are those around the cells that touch owned nodes. Nodes of
/// contact rows and masters of tied nodes are included.
pub struct FemBody<const D: usize> {
    /// Name of the body.
    pub name: String,
    /// Known displacements, if the scene has them.
    pub exact: Option<Vec<Expression>>,
    /// Number of supports in the scene.
    pub supports: usize,
    /// Cells, nodes, supports, springs, and rows with displacements of nodes as columns.
    pub mesh: BodyMesh<D>,
    /// Whether this rank owns each node.
    pub own: Vec<bool>,
    /// Elasticity of the cells.
    pub elasticity: Rc<Elasticity>,
    /// See [`Self::split`].
    pub split: OnceCell<Split<D>>,
}

impl<const D: usize> FemBody<D> {
    /// Return the space, cut apart where the material jumps. It is made when it is first requested.
    pub fn split(&self) -> &Split<D> {
        self.split.get_or_init(|| Split::new(&self.mesh.space, &self.elasticity))
    }

    /// Check that the known displacements are finite at all nodes.
    ///
    /// # Errors
    /// One is not.
    pub fn check_exact(&self) -> Result<()> {
        let places = || self.mesh.space.nodes.iter().map(|&x| self.mesh.space.in_scene(x));
        for (component, x) in self.exact.iter().flatten().flat_map(|u| places().map(move |x| (u, x))) {
            let value = component.eval(&x[..D]);
            if !value.is_finite() {
                let message = format!("the known displacement is {value} at {}", point(x));
                return Err(Error::scene(component.place(), message)
                    .help("look for roots of negative numbers and divisions by zero in the expression"));
            }
        }
        Ok(())
    }

    /// Return the point of the mesh for each node of the cells that this rank writes.
    pub fn points(&self) -> Vec<u32> {
        let split = self.split();
        let shown = split.space.part(self.owned()).1;
        shown.into_iter().map(|node| self.mesh.points[split.origin(node) as usize]).collect()
    }

    /// Return the indices of the cells that this rank writes and measures. Each cell of the body belongs to the rank
    /// that owns its first node.
    pub fn owned(&self) -> impl Iterator<Item = usize> {
        let is_own = |cell: &[u32]| cell.iter().min().is_some_and(|&first| self.own[first as usize]);
        let cells = self.mesh.space.cells.chunks_exact(self.mesh.space.stride).enumerate();
        cells.filter(move |(_, cell)| is_own(cell)).map(|(number, _)| number)
    }

    /// Return the displacements of the nodes of the part.
    fn nodal(&self, v: &[f64]) -> Vec<f64> {
        self.mesh.held.frame.displacements(v)
    }

    /// Return the reactions at the owned nodes of supports and rigid surfaces, in increasing order of the nodes.
    fn reactions(&self, u: &[f64], known: &[f64]) -> Vec<(u32, [f64; D])> {
        let (space, own) = (&self.mesh.space, &self.own);
        let mut held = vec![false; own.len()];
        let nodes = self.mesh.held.nodes().filter(|&node| own[node as usize]);
        nodes.for_each(|node| held[node as usize] = true);
        let touched = |cell: &[u32]| cell.iter().any(|&node| held[node as usize]);
        let cells = space.cells.chunks_exact(space.stride).enumerate().filter(|(_, cell)| touched(cell));
        let cells: Vec<usize> = cells.map(|(number, _)| number).collect();
        let (around, nodes) = space.part(cells.iter().copied());
        let elasticity = self.elasticity.of_cells(&cells);
        let frame = Frame::default();
        let graph = NodeGraph::new(&around, &[], &frame);
        let Ok(stiffness) = assemble::stiffness(&around, &graph, &frame, &elasticity) else { return Vec::new() };
        let dof = |row: usize| D * nodes[row / D] as usize + row % D;
        let force = |row: usize| stiffness.row(row).map(|(j, k)| k * u[dof(j)]).sum::<f64>() - known[dof(row)];
        let at = |place: usize| (nodes[place], std::array::from_fn(|c| force(D * place + c)));
        (0..nodes.len()).filter(|&place| held[nodes[place] as usize]).map(at).collect()
    }
}

impl<const D: usize> Post for FemBody<D> {
    fn field(&self, v: &[f64], bent: &[f64]) -> BodyField {
        let (u, split) = (self.nodal(v), self.split());
        let (mut owned, shown) = split.space.part(self.owned());
        let nodal = self.nodal(bent);
        let bent = split.values(&nodal);
        let stress = displacement::nodal_stresses(&split.space, &self.elasticity, &bent);
        let stress: Vec<[f64; 6]> = shown.iter().map(|&node| stress[node as usize]).collect();
        let stress = space::at_equally_spaced(&owned, stress.into()).into_owned();
        let von_mises: Vec<f64> = stress.iter().map(displacement::von_mises).collect();
        let largest = (0..shown.len()).max_by(|&i, &j| von_mises[i].total_cmp(&von_mises[j]));
        let change =
            |i: usize| displacement::change_within_cells(&split.space, &self.elasticity, &bent, shown[i], &stress[i]);
        let displacement = |&node: &u32| {
            let first = D * split.origin(node) as usize;
            pad(std::array::from_fn::<f64, D, _>(|c| u[first + c]))
        };
        let displacement = space::at_equally_spaced(&owned, shown.iter().map(displacement).collect()).into_owned();
        let points = space::at_equally_spaced(&owned, owned.nodes.clone().into());
        // files have the edge 20 in this direction
        let inside = (D + 1) + 2 * (owned.order.degree() - 1)..(D + 1) + 3 * (owned.order.degree() - 1);
        owned.cells.chunks_exact_mut(owned.stride).filter(|_| D == 2).for_each(|cell| cell[inside.clone()].reverse());
        BodyField {
            name: self.name.clone(),
            points: points.iter().map(|&x| owned.in_scene(x)).collect(),
            cell: CellKind { dimension: D, order: self.mesh.space.order.degree() },
            connectivity: owned.cells,
            displacement,
            von_mises,
            largest: largest.map(|point| LargestStress { point, change: change(point) }),
            principal: stress.iter().map(displacement::principal).collect(),
            stress,
        }
    }

    fn strain(&self, bent: &[f64]) -> Strained {
        displacement::largest_strain(&self.mesh.space, self.owned(), &self.nodal(bent))
    }

    fn rotation(&self, v: &[f64]) -> [f64; 3] {
        displacement::rotation(&self.mesh.space, self.owned(), &self.nodal(v))
    }

    /// Reactions are the internal forces of the cells around the constrained nodes minus all known forces there.
    fn balance(&self, v: &[f64], force: &[f64]) -> ForceBalance {
        let u = self.nodal(v);
        let mut contact = vec![0.0; u.len()];
        self.mesh.nodal_rows.add_transpose(-1.0, force, &mut contact);
        let space = &self.mesh.space;
        let mut all = ForceBalance::default();
        let load = self.mesh.load.all(space.nodes.len());
        all.push(self, &load);
        all.push(self, &contact);
        let mut known: Vec<f64> = load.iter().zip(&contact).map(|(load, contact)| load + contact).collect();
        // forces of initial strains balance each other, and round as forces of their sizes
        let initial = assemble::initial_load(space, &self.elasticity, |_| false).unwrap_or_default().force;
        for (node, force) in initial.chunks_exact(D).enumerate().filter(|(node, _)| self.own[*node]) {
            all.grow(space, node as u32, std::array::from_fn(|c| force[c]));
        }
        known.iter_mut().zip(&initial).for_each(|(known, force)| *known += force);
        for blocks in &self.mesh.springs {
            let mut pull = vec![0.0; u.len()];
            for NodalBlock { nodes: [a, b], block } in blocks {
                for (i, row) in block.iter().enumerate() {
                    let at = D * *b as usize;
                    pull[D * *a as usize + i] -= (0..D).map(|j| row[j] * u[at + j]).sum::<f64>();
                }
            }
            all.push(self, &pull);
            crate::linalg::axpy(1.0, &pull, &mut known);
        }
        let mut supports = vec![Resultant::default(); self.supports];
        let mut rigid = vec![Resultant::default(); self.mesh.held.rigid.len()];
        for (node, reaction) in self.reactions(&u, &known) {
            all.grow(space, node, reaction);
            match self.mesh.held.rigid.iter().position(|surface| surface.nodes.binary_search(&node).is_ok()) {
                Some(surface) => rigid[surface].add(space, node, reaction),
                None => {
                    for (support, part) in self.mesh.held.split(node, reaction) {
                        supports[support].add(space, node, part);
                    }
                }
            }
        }
        let springs = all.parts.split_off(2);
        all.parts.extend(supports.into_iter().chain(springs).chain(rigid));
        all
    }

    fn approach(&self, v: &[f64]) -> Vec<f64> {
        let (u, rows) = (self.nodal(v), &self.mesh.approach);
        let own = |row: usize| rows.row(row).filter(|(dof, _)| self.own[dof / D]);
        (0..rows.rows()).map(|row| own(row).map(|(dof, weight)| weight * u[dof]).sum()).collect()
    }

    fn errors(&self, v: &[f64]) -> Option<[[f64; 3]; 2]> {
        let exact = self.exact.as_ref()?;
        let at = |x: [f64; D]| {
            let x = &self.mesh.space.in_scene(x)[..D];
            let gradient = std::array::from_fn(|i| std::array::from_fn(|j| exact[i].eval_by(j, x).1));
            (std::array::from_fn(|i| exact[i].eval(x)), gradient)
        };
        let (space, u) = (&self.mesh.space, self.nodal(v));
        Some(displacement::norms_of_error(space, self.owned(), &self.elasticity, &u, &at))
    }
}

/// A force and its moment about the datum (x, y, z).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Resultant {
    pub force: [f64; 3],
    pub moment: [f64; 3],
}

impl Resultant {
    fn add<const D: usize>(&mut self, space: &Space<D>, node: u32, force: [f64; D]) {
        add(&mut self.force, space.net_force(force));
        add(&mut self.moment, space.net_moment(node, force));
    }
}

/// All external forces on a body. In equilibrium their sum is zero.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ForceBalance {
    /// Loads without those on rigid surfaces; contacts; then each support, each spring, each rigid surface.
    pub parts: Vec<Resultant>,
    /// Sum of the magnitudes of all nodal forces, and of these times their distances from the datum. They are the scale
    /// of the sum of all parts. About a distant origin, moments would be little else than that of the sum of forces.
    pub size: [f64; 2],
}

impl ForceBalance {
    /// Append the resultant of forces at the owned nodes of a part.
    fn push<const D: usize>(&mut self, part: &FemBody<D>, forces: &[f64]) {
        let mut resultant = Resultant::default();
        for (node, force) in forces.chunks_exact(D).enumerate().filter(|(node, _)| part.own[*node]) {
            let force: [f64; D] = std::array::from_fn(|c| force[c]);
            resultant.add(&part.mesh.space, node as u32, force);
            self.grow(&part.mesh.space, node as u32, force);
        }
        self.parts.push(resultant);
    }

    /// Add a force at a node to the sizes.
    fn grow<const D: usize>(&mut self, space: &Space<D>, node: u32, force: [f64; D]) {
        let length = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let size = length(space.net_force(force));
        self.size[0] += size;
        self.size[1] += size * length(pad(space.nodes[node as usize]));
    }
}
