//! One body of the scene on its mesh: space, supports, loads, stiffness.

use super::facts::BodyFacts;
use super::find::{Values, find_group, not_on_body, point, without_area};
use super::roster::load_dimensions;
use super::supports::Constraints;
use super::{elastic, moment, springs};
use crate::contact::{self, Side};
use crate::error::{Error, Result};
use crate::expression::Field;
use crate::fem::interpolation::{coarse_nodes, from_vertices};
use crate::fem::{
    ElasticBody, Elasticity, Facets, Interpolation, NodalBlock, NodalForces, NodeGraph, Parts, RigidMotion, Space,
    assemble, rigid, support, surface,
};
use crate::linalg::{axpy, countable, dot};
use crate::mesh::{Group, Mesh};
use crate::problem::body::{BodySpec, Load, LoadKind};
use nalgebra::{DMatrix, DVector};
use std::rc::Rc;

/// A body of the scene with its space, supports and springs.
#[derive(Clone)]
pub struct Part<'a, const D: usize> {
    /// Description in the scene.
    pub spec: &'a BodySpec,
    /// Finite element space.
    pub space: Space<D>,
    /// Constraints from supports and rigid surfaces.
    pub held: Constraints<D>,
    /// Springs to the ground: the stiffness blocks between nodes for each spring of the scene.
    pub springs: Vec<Vec<NodalBlock<D>>>,
    /// Elasticity of the cells.
    pub elasticity: Rc<Elasticity>,
    /// Facts of the whole body.
    pub facts: BodyFacts,
}

/// A dof that can be fixed against a motion.
pub struct Candidate {
    /// Index of the dof.
    pub dof: usize,
    /// Magnitude of the motion there.
    pub size: f64,
}

impl<'a, const D: usize> Part<'a, D> {
    /// Apply the supports and springs of a body.
    ///
    /// # Errors
    /// The scene contradicts its mesh.
    pub fn new(
        spec: &'a BodySpec,
        mesh: &Mesh<D>,
        space: Space<D>,
        elasticity: Rc<Elasticity>,
        facts: BodyFacts,
    ) -> Result<Self> {
        let held = Constraints::new(spec, &space, mesh)?;
        let springs =
            spec.spring.iter().map(|spring| springs::blocks(spring, spec, &space, mesh)).collect::<Result<_>>()?;
        Ok(Self { spec, space, held, springs, elasticity, facts })
    }

    /// Return the displacements of all dofs in a rigid motion.
    pub fn dofs_of(&self, motion: &RigidMotion<D>) -> Vec<f64> {
        self.held.frame.dofs(&motion.nodal(self.space.nodes.iter().copied()))
    }

    /// Return the rigid motions of the free body.
    pub fn free(&self) -> Vec<RigidMotion<D>> {
        rigid::of(&self.facts.extent, self.space.axisymmetric)
    }

    /// Return the displacements of the dofs of a node in a rigid motion.
    pub fn at_dofs(&self, motion: &RigidMotion<D>, node: u32) -> [f64; D] {
        self.held.frame.at(node, |node| self.at(motion, node))
    }

    /// Return the displacement of a dof in a rigid motion.
    pub fn dof_of(&self, motion: &RigidMotion<D>, dof: usize) -> f64 {
        self.held.frame.dof(dof, |node| self.at(motion, node))
    }

    /// Return a contact surface of the body.
    pub fn side<'s>(&'s self, name: &'s str, facets: Facets<D>) -> Side<'s, D> {
        Side::new(name, &self.space, facets, &self.held.prescribed, &self.held.frame)
    }

    /// Return the products of rigid motions over all dofs without the `prescribed` ones, and the work of the load vector on each
    /// motion.
    pub fn products(
        &self,
        motions: &[RigidMotion<D>],
        prescribed: &[(usize, f64)],
        load: &[f64],
    ) -> (DMatrix<f64>, Vec<f64>) {
        let (count, mut held) = (motions.len(), prescribed.iter().map(|entry| entry.0).peekable());
        let (mut products, mut work) = (DMatrix::zeros(count, count), vec![0.0; count]);
        for node in 0..self.space.nodes.len() {
            let mut at: Vec<[f64; D]> = motions.iter().map(|motion| self.at_dofs(motion, node as u32)).collect();
            while let Some(dof) = held.next_if(|dof| dof / D <= node) {
                at.iter_mut().filter(|_| dof / D == node).for_each(|u| u[dof % D] = 0.0);
            }
            for (i, u) in at.iter().enumerate() {
                at.iter().enumerate().for_each(|(j, v)| products[(i, j)] += dot(u, v));
                work[i] += dot(u, &load[D * node..][..D]);
            }
        }
        (products, work)
    }

    /// Return the displacement of a node in a rigid motion.
    fn at(&self, motion: &RigidMotion<D>, node: u32) -> [f64; D] {
        motion.at(&self.space.nodes[node as usize])
    }

    /// Return the coordinates of all nodes in the scene.
    pub fn places(&self) -> impl Iterator<Item = [f64; 3]> + Clone {
        self.space.nodes.iter().map(|&x| self.space.in_scene(x))
    }

    /// Return the dof with the largest value, the last one of equal values. `size` is `None` for dofs that are excluded.
    pub fn largest(&self, size: impl Fn(usize) -> Option<f64>) -> Option<Candidate> {
        let all = (0..self.space.dofs()).filter_map(|dof| Some(Candidate { dof, size: size(dof)? }));
        all.max_by(|a, b| a.size.total_cmp(&b.size))
    }

    /// Fix a dof.
    pub fn fix(&mut self, found: &Candidate) {
        self.held.prescribed.insert(found.dof, 0.0);
    }

    /// Return the prescribed (dof, value), sorted by dof.
    pub fn prescribed_sorted(&self) -> Vec<(usize, f64)> {
        let mut all: Vec<_> = self.held.prescribed.iter().map(|(&dof, &value)| (dof, value)).collect();
        all.sort_unstable_by_key(|entry| entry.0);
        all
    }

    /// Return the weights of those combinations of `count` motions that neither supports nor springs resist. `u(k, node)` is the
    /// displacement of motion k at a node.
    pub fn left(&self, count: usize, u: &dyn Fn(usize, u32) -> [f64; D]) -> Vec<DVector<f64>> {
        let left = self.left_by_supports(count, u);
        let springs = self.springs.concat();
        if springs.is_empty() { left } else { rigid::left_by_springs(left, &rigid::of_springs(count, u, &springs)) }
    }

    fn left_by_supports(&self, count: usize, u: &dyn Fn(usize, u32) -> [f64; D]) -> Vec<DVector<f64>> {
        let value = |k: usize, dof: usize| self.held.frame.dof(dof, |node| u(k, node));
        rigid::left_by_supports(count, value, &self.prescribed_sorted())
    }

    /// Return the rigid motions that supports leave, with the stiffness of the springs in terms of them. The result is `None`
    /// without springs.
    pub fn sprung(&self, free: &[RigidMotion<D>]) -> Option<(Vec<RigidMotion<D>>, DMatrix<f64>)> {
        let springs = self.springs.concat();
        if springs.is_empty() {
            return None;
        }
        let left = self.left_by_supports(free.len(), &|k, node| free[k].at(&self.space.nodes[node as usize]));
        let left: Vec<_> = left.iter().map(|weights| rigid::combine(free, weights)).collect();
        let at = |k: usize, node: u32| left[k].at(&self.space.nodes[node as usize]);
        let stiffness = rigid::of_springs(left.len(), at, &springs);
        Some((left, stiffness))
    }

    /// Return the nodal forces of the loads without those on rigid surfaces. Supports are not taken into account.
    ///
    /// # Errors
    /// A load is not finite somewhere, or a surface is not on the body or has no area.
    pub fn load(&self, mesh: &Mesh<D>) -> Result<NodalForces<D>> {
        let load = body_force(self.spec, &self.space, Parts::Whole)?.and(self.on_surfaces(mesh, Parts::Whole)?);
        if load.is_finite() { Ok(load) } else { Err(too_large(self.spec)) }
    }

    /// Return the nodal forces of all loads that the quadrature misses. The result is empty if all loads are constant.
    ///
    /// # Errors
    /// See [`Part::load`].
    pub fn unloaded(&self, mesh: &Mesh<D>) -> Result<Vec<f64>> {
        let is_constant = |load: &Load| match &load.kind {
            LoadKind::Pressure(pressure) => pressure.is_constant(),
            LoadKind::Traction(traction) => traction.iter().all(Field::is_constant),
            LoadKind::Force { .. } | LoadKind::Moment(_) | LoadKind::Turning { .. } => true,
        };
        let force = self.spec.force.iter().flatten();
        if self.spec.load.iter().all(is_constant) && force.into_iter().all(Field::is_constant) {
            return Ok(Vec::new());
        }
        let all = |parts: Parts| {
            let load = body_force(self.spec, &self.space, parts)?.and(self.on_surfaces(mesh, parts)?);
            Ok(load.all(self.space.nodes.len()))
        };
        let (mut missed, load) = (all(Parts::Halves)?, all(Parts::Whole)?);
        axpy(-1.0, &load, &mut missed);
        Ok(missed)
    }

    /// Return the nodal forces of loads on surfaces that the quadrature misses.
    ///
    /// # Errors
    /// See [`Part::load`].
    pub fn missed_load(&self, mesh: &Mesh<D>) -> Result<NodalForces<D>> {
        let whole: NodalForces<D> =
            self.on_surfaces(mesh, Parts::Whole)?.iter().map(|(node, force)| (node, force.map(|f| -f))).collect();
        Ok(self.on_surfaces(mesh, Parts::Halves)?.and(whole))
    }

    /// Return the nodal forces of all loads on surfaces that are not rigid.
    fn on_surfaces(&self, mesh: &Mesh<D>, parts: Parts) -> Result<NodalForces<D>> {
        let mut load = NodalForces::default();
        for spec in &self.spec.load {
            load = load.and(self.on_surface(spec, spec.factor, mesh, parts)?);
        }
        Ok(load)
    }

    /// Return the nodal forces of `factor` times a load of the scene. They are zero if its surface is rigid.
    fn on_surface(&self, spec: &Load, factor: f64, mesh: &Mesh<D>, parts: Parts) -> Result<NodalForces<D>> {
        let name = &self.spec.name;
        let group = find_group(mesh, &spec.on, load_dimensions::<D>(&spec.kind), "load")?;
        if let (0, LoadKind::Force { total, .. }) = (group.dimension, &spec.kind) {
            return self.at_nodes(spec, group, total.map(|total| factor * total));
        }
        let facets = self.space.facets(group);
        if facets.count() == 0 {
            return Err(not_on_body(&spec.on, &name.value));
        }
        let area = surface::measure(&self.space, &facets);
        if area == 0.0 {
            return Err(without_area(&spec.on, self.spec));
        }
        if let LoadKind::Moment(moment) = spec.kind {
            let load = moment::load(&self.space, &facets, parts, moment.map(|component| factor * component));
            return if load.is_finite() { Ok(load) } else { Err(too_large(self.spec)) };
        }
        let values = Values::of("this load", &name.value);
        let load = surface::surface_load(&self.space, &facets, parts, &|x, n| match &spec.kind {
            LoadKind::Pressure(field) => {
                let pressure = factor * values.at(field, self.space.in_scene(x));
                n.map(|n| -pressure * n)
            }
            LoadKind::Traction(fields) => {
                let x = self.space.in_scene(x);
                std::array::from_fn(|c| factor * values.at(&fields[c], x))
            }
            LoadKind::Force { rigid: true, .. } | LoadKind::Moment(_) | LoadKind::Turning { .. } => [0.0; D],
            LoadKind::Force { total, .. } => std::array::from_fn(|c| factor * total[c] / area),
        });
        values.refused()?;
        if !load.is_finite() {
            return Err(Error::scene(&spec.on.place, format!("body `{}`: the load is too large", name.value))
                .label("its forces are beyond the range of numbers"));
        }
        Ok(load)
    }

    /// Return a total force as equal forces at the nodes of a group of points.
    fn at_nodes(&self, spec: &Load, group: &Group, total: [f64; 3]) -> Result<NodalForces<D>> {
        let nodes = self.space.nodes_on(group);
        if nodes.is_empty() {
            return Err(not_on_body(&spec.on, &self.spec.name.value));
        }
        let each = std::array::from_fn(|c| total[c] / nodes.len() as f64);
        Ok(nodes.into_iter().map(|node| (node, each)).collect())
    }

    /// Return the sum of the nodal forces of a load of the scene at its full value. It is zero if the surface is rigid.
    ///
    /// # Errors
    /// See [`Part::load`].
    pub fn resultant(&self, spec: &Load, mesh: &Mesh<D>) -> Result<[f64; 3]> {
        let mut sum = [0.0; 3];
        for (_, force) in self.on_surface(spec, 1.0, mesh, Parts::Whole)?.iter() {
            contact::add(&mut sum, self.space.net_force(force));
        }
        Ok(sum)
    }

    /// Return the forces on rigid surfaces, at few nodes of each.
    pub fn rigid_forces(&self) -> impl Iterator<Item = (u32, [f64; D])> + '_ {
        self.held.rigid.iter().flat_map(|(index, nodes)| {
            let Load { kind, factor, .. } = &self.spec.load[*index];
            let in_space = |force: &[f64; 3]| std::array::from_fn(|c| factor * force[c]);
            let master = nodes.first().copied();
            match (master, kind) {
                (Some(master), LoadKind::Force { total, .. }) => vec![(master, in_space(total))],
                (Some(master), LoadKind::Turning { force, moment }) => {
                    let moment = moment.map(|component| factor * component);
                    self.held.frame.levers[&master].forces(master, in_space(force), moment)
                }
                _ => Vec::new(),
            }
        })
    }

    /// Return the nodal forces of [`Part::load`] and those on rigid surfaces as forces at dofs.
    pub fn load_on_dofs(&self, load: &NodalForces<D>) -> NodalForces<D> {
        load.iter().chain(self.rigid_forces()).flat_map(|(node, force)| self.held.frame.force(node, force)).collect()
    }

    /// Return the load vector f at all dofs, from the nodal forces at all nodes.
    pub fn load_vector(&self, load: &NodalForces<D>) -> Vec<f64> {
        let mut load = load.all(self.space.nodes.len());
        for (node, total) in self.rigid_forces() {
            (0..D).for_each(|c| load[D * node as usize + c] += total[c]);
        }
        self.held.frame.forces(&mut load);
        load
    }

    /// Return the nodes of linear displacements, sorted.
    pub fn coarse_nodes(&self) -> Vec<u32> {
        coarse_nodes(&self.space, &self.held.frame)
    }

    /// Return the interpolation of the dofs from those at these nodes.
    pub fn interpolation(&self, coarse: &[u32]) -> Interpolation {
        from_vertices(&self.space, &self.held.frame, |dof| self.held.prescribed.contains_key(&dof), coarse)
    }

    /// Assemble K on its graph, with f and the supports. `carried` is the rigid motion that was subtracted from `prescribed`, if
    /// any. If the graph has the rows of some nodes only, so have K and f.
    pub fn assemble(
        &self,
        mesh: &Mesh<D>,
        graph: &NodeGraph,
        mut load: Vec<f64>,
        prescribed: Vec<(usize, f64)>,
        carried: Vec<f64>,
    ) -> Result<ElasticBody> {
        let name = &self.spec.name;
        countable(&format!("the stiffness matrix of body `{}`", name.value), graph.entries::<D>())?;
        let mut stiffness = assemble::stiffness(&self.space, graph, &self.held.frame, &self.elasticity).map_err(
            |defect| match defect {
                assemble::Defect::Inverted(cell) => {
                    let corner = self.space.in_scene(self.space.cell_nodes(cell)[0]);
                    let message = format!("body `{}`: the curved cell at {} is folded", name.value, point(corner));
                    Error::mesh(&mesh.path, None, message).help("refine the mesh there, or use order = 1")
                }
                assemble::Defect::Elasticity(number, x, flaw) => elastic::refusal(self.spec, number, Some(x), &flaw),
            },
        )?;
        if (0..stiffness.rows()).any(|row| stiffness.row(row).any(|(_, k)| !k.is_finite())) {
            let message = format!("body `{}`: its stiffness is beyond the range of numbers", name.value);
            return Err(Error::scene(&self.spec.elasticity.place, message).label("far too large"));
        }
        let frame = &self.held.frame;
        self.springs.iter().for_each(|springs| assemble::add_blocks(graph, frame, springs, &mut stiffness));
        frame.turn_matrix(&mut stiffness);
        // These rows belong to other ranks.
        (0..load.len()).filter(|&i| stiffness.range(i).is_empty()).for_each(|i| load[i] = 0.0);
        Ok(support(stiffness, load, prescribed, carried))
    }
}

/// Return the nodal forces of the body force.
///
/// # Errors
/// The force is not finite somewhere, or beyond the range of numbers.
fn body_force<const D: usize>(spec: &BodySpec, space: &Space<D>, parts: Parts) -> Result<NodalForces<D>> {
    let (name, Some(fields)) = (&spec.name, &spec.force) else { return Ok(NodalForces::default()) };
    let values = Values::of("this body force", &name.value);
    let density = |x: [f64; D]| {
        let x = space.in_scene(x);
        std::array::from_fn(|c| spec.force_factor * values.at(&fields[c], x))
    };
    let load = assemble::body_force(space, parts, &density);
    values.refused()?;
    if !load.is_finite() {
        return Err(Error::scene(&name.place, format!("body `{}`: the body force is too large", name.value))
            .label("its forces are beyond the range of numbers"));
    }
    Ok(load)
}

/// Return the error of loads whose sum is beyond the range of numbers.
fn too_large(spec: &BodySpec) -> Error {
    Error::scene(&spec.name.place, format!("body `{}`: its loads together are too large", spec.name.value))
        .label("their forces are beyond the range of numbers")
}
