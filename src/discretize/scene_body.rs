//! The bodies of the scene on its mesh: space, elasticity, supports, loads, and the rigid motions that supports leave.
//! Errors name body and place.

use super::body_mesh::BodyMesh;
use super::groups::{FieldValues, Line, find_group, not_on_body, of_body, point, without_area};
use super::supports::{Constraints, moment_load, spring_blocks};
use super::verify::Verified;
use crate::contact::{ContactPair, Side};
use crate::error::{Error, Result, shown};
use crate::expression::Field;
use crate::fem::elasticity::Flaw;
use crate::fem::{Elasticity, Facets, Frame, NodalForces, PointExtent, RigidMotion, Space, assemble, surface};
use crate::linalg::{Csr, PART, Total};
use crate::mesh::{self, Group, Mesh};
use crate::model::{Motion, Segment};
use crate::problem::{BodySpec, Constants, ElasticitySpec, OneOrVector, Order, Plane};
use crate::problem::{Load, LoadKind};
use crate::scene::Scene;
use std::cell::OnceCell;
use std::collections::HashSet;
use std::rc::Rc;

/// Share of the largest possible work below which the work of the loads is rounding: the sum of a million works, each
/// rounded by 1e-16 of it, is rounded by 1e-10 at most.
pub const NO_WORK: f64 = 1e-9;

/// Poisson's ratio above which linear elements lock.
const LOCKING: f64 = 0.49;

/// A body of the scene on its mesh: whole, on the first rank, before its matrix is assembled.
#[derive(Clone)]
pub struct SceneBody<'a, const D: usize> {
    /// Description in the scene.
    pub spec: &'a BodySpec,
    /// Elasticity of the cells.
    pub elasticity: Rc<Elasticity>,
    /// Nodes, and all that is tied to them.
    pub mesh: BodyMesh<D>,
    /// Its contact rows, pair by pair, once pairs are known.
    pub segments: Vec<Segment>,
    /// Forces of all loads at dofs, once pairs are known.
    pub dof_load: NodalForces<D>,
}

impl<'a, const D: usize> SceneBody<'a, D> {
    /// Return a contact surface of the body, with edges where facets turn by more than `edge` degrees.
    pub fn side<'s>(&'s self, name: &'s str, facets: Facets<D>, edge: f64) -> Side<'s, D> {
        Side::new(name, &self.mesh.space, facets, &self.mesh.held.prescribed, &self.mesh.held.frame, edge)
    }

    /// Return a cell with the elasticity at each of these facets: the one that the facet bounds, if the elasticity
    /// differs between cells.
    pub fn cells_at(&self, facets: &Facets<D>) -> Vec<usize> {
        if self.elasticity.is_constant() { vec![0; facets.count()] } else { self.mesh.space.cells_at(facets) }
    }

    /// Return the area (volume) of the body, in a body of revolution the volume of the rings, and the means of the
    /// moduli along x, y, z ([`Elasticity::moduli`]). A cell whose constants make no material at its middle contributes
    /// zero; assembly refuses it.
    pub fn volume_and_moduli(&self) -> (f64, [f64; 3]) {
        let (space, elasticity) = (&self.mesh.space, &self.elasticity);
        let cells = || 0..space.cell_count();
        let volume = cells().map(|cell| space.share(cell)).collect::<Total>().value();
        if self.spec.regions.is_empty() && elasticity.is_constant() {
            return (volume, elasticity.moduli(0, [0.0; 3]).unwrap_or_default());
        }
        let mut sum = [0.0; 3];
        for cell in cells() {
            let moduli = elasticity.moduli(cell, space.in_scene(space.centroid(cell))).unwrap_or_default();
            crate::contact::add(&mut sum, moduli.map(|modulus| space.share(cell) * modulus));
        }
        (volume, sum.map(|sum| sum / volume))
    }

    /// Return the nodal forces of the loads without those on rigid surfaces. Supports are not taken into account.
    ///
    /// # Errors
    /// A load is not finite somewhere, or a surface is not on the body or has no area.
    pub fn load(&self, mesh: &Mesh<D>) -> Result<NodalForces<D>> {
        let mut load = body_force(self.spec, &self.mesh.space)?;
        for spec in &self.spec.load {
            load = load.and(self.on_surface(spec, spec.factor, mesh)?);
        }
        if load.is_finite() { Ok(load) } else { Err(too_large(self.spec)) }
    }

    /// Return the nodal forces of `factor` times a load of the scene. They are zero if its surface is rigid.
    fn on_surface(&self, spec: &Load, factor: f64, mesh: &Mesh<D>) -> Result<NodalForces<D>> {
        let name = &self.spec.name;
        let group = spec.group(mesh)?;
        if let (0, LoadKind::Force { total, .. }) = (group.dimension, &spec.kind) {
            return self.at_nodes(spec, group, total.numbers().map(|total| factor * total));
        }
        let facets = self.mesh.space.facets(group);
        if facets.count() == 0 {
            return Err(not_on_body(&spec.on, &name.value));
        }
        let area = surface::measure(&self.mesh.space, &facets);
        if area == 0.0 {
            return Err(without_area(&spec.on, self.spec));
        }
        if let LoadKind::Moment(moment) = &spec.kind {
            let moment = moment.axial(Field::number).map(|component| factor * component);
            let load = moment_load(&self.mesh.space, &facets, moment);
            return if load.is_finite() { Ok(load) } else { Err(too_large(self.spec)) };
        }
        let values = FieldValues::of("this load", &name.value);
        let load = surface::surface_load(&self.mesh.space, &facets, &|x, n| match &spec.kind {
            LoadKind::Pressure(field) => {
                let pressure = factor * values.at(field, self.mesh.space.in_scene(x));
                n.map(|n| -pressure * n)
            }
            LoadKind::Traction(fields) => {
                let x = self.mesh.space.in_scene(x);
                std::array::from_fn(|c| factor * values.at(&fields[c], x))
            }
            LoadKind::Force { rigid: true, .. } | LoadKind::Moment(_) | LoadKind::Turning { .. } => [0.0; D],
            LoadKind::Force { total, .. } => {
                let total = total.numbers();
                std::array::from_fn(|c| factor * total[c] / area)
            }
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
        let nodes = self.mesh.space.nodes_on(group);
        if nodes.is_empty() {
            return Err(not_on_body(&spec.on, &self.spec.name.value));
        }
        let each = std::array::from_fn(|c| total[c] / nodes.len() as f64);
        Ok(nodes.into_iter().map(|node| (node, each)).collect())
    }

    /// Return the nodal forces of a load of the scene without its factor. A force on a rigid surface is spread over its
    /// area.
    ///
    /// # Errors
    /// See [`SceneBody::load`].
    pub fn full_load(&self, load: &Load, mesh: &Mesh<D>) -> Result<NodalForces<D>> {
        match &load.kind {
            LoadKind::Force { total, rigid: true } | LoadKind::Turning { force: total, .. } => {
                let kind = LoadKind::Force { total: total.clone(), rigid: false };
                self.on_surface(&Load { kind, ..load.clone() }, 1.0, mesh)
            }
            _ => self.on_surface(load, 1.0, mesh),
        }
    }

    /// Return a warning if the largest Poisson's ratio is so large that linear elements are too stiff, except in plane
    /// stress. There the volume can hardly change.
    pub fn locking(&self, plane: Plane) -> Option<String> {
        if self.mesh.space.order > Order::P1 || (D == 2 && plane == Plane::Stress) {
            return None;
        }
        let places = || self.mesh.space.nodes.iter().map(|&x| self.mesh.space.in_scene(x));
        let largest = |spec: ElasticitySpec| match &spec.constants {
            Constants::Isotropic { poisson, .. } => places().map(|x| poisson.eval(x)).fold(0.0, f64::max),
            _ => 0.0,
        };
        let poisson = constants(self.spec).map(largest).fold(0.0, f64::max);
        let name = &self.spec.name.value;
        (poisson > LOCKING).then(|| {
            format!("body {name}: Poisson's ratio is {poisson}: linear elements are far too stiff there; set order = 2")
        })
    }

    /// Collect the contact rows of the body.
    pub fn collect_rows(&mut self, pairs: &[ContactPair]) {
        let rows = |of: fn(&ContactPair) -> &[Csr; 2]| {
            let mut all = Csr::new(self.mesh.space.dofs());
            for &Segment { pair, side } in &self.segments {
                (0..pairs[pair].len()).for_each(|q| all.push_row(of(&pairs[pair])[side].row(q)));
            }
            all
        };
        (self.mesh.rows, self.mesh.nodal_rows) = (rows(|pair| &pair.rows), rows(|pair| &pair.nodal));
    }

    /// Put the contact rows and loads of the body into the dofs of a frame.
    pub fn set_frame(&mut self, frame: Frame<D>, pairs: &mut [ContactPair]) {
        if frame == self.mesh.held.frame {
            return;
        }
        self.mesh.held.frame = frame;
        let held = &self.mesh.held;
        self.segments.iter().for_each(|segment| pairs[segment.pair].hold(segment.side, &held.frame, &held.prescribed));
        self.collect_rows(pairs);
        self.dof_load = self.mesh.load_on_dofs();
    }

    /// Return the motions that supports leave, as traces on the contact rows and works of the loads.
    pub fn motions(&self) -> Vec<Motion> {
        let of = |motion: &RigidMotion<D>| Motion {
            name: motion.name.clone(),
            trace: self.trace(motion),
            work: self.work(motion),
        };
        self.mesh.motions.iter().map(of).collect()
    }

    /// Return the trace of a motion on the contact rows.
    pub fn trace(&self, motion: &RigidMotion<D>) -> Vec<f64> {
        let row = |q: usize| self.mesh.rows.row(q).map(|(dof, b)| b * self.mesh.dof_of(motion, dof)).sum();
        (0..self.mesh.rows.rows()).map(row).collect()
    }

    /// Return the work of the loads on a motion, and the largest work that forces of their magnitudes could do.
    pub fn works(&self, motion: &RigidMotion<D>) -> [f64; 2] {
        self.dof_load.works(|node| self.mesh.at_dofs(motion, node))
    }

    /// Return the work of the loads on a motion. It is exactly zero where it is rounding.
    pub fn work(&self, motion: &RigidMotion<D>) -> f64 {
        let [work, largest] = self.works(motion);
        if work.abs() <= NO_WORK * largest { 0.0 } else { work }
    }

    /// Change each nodal force to what `changed` returns for its node.
    pub fn change_loads(&mut self, changed: impl Fn(&BodyMesh<D>, u32, [f64; D]) -> [f64; D]) {
        let mesh = &self.mesh;
        let load = mesh.load.iter().map(|(node, force)| (node, changed(mesh, node, force))).collect();
        self.mesh.load = load;
        self.dof_load = self.mesh.load_on_dofs();
    }

    /// Return the dof at which a motion can be fixed, and its displacement there. It is the one that the motion moves
    /// most, the last one of equal ones, outside the contact rows so that these do not change. The result is `None` if
    /// that displacement is rounding.
    pub fn candidate(&self, motion: &RigidMotion<D>) -> Option<(usize, f64)> {
        let in_rows: HashSet<usize> = self.mesh.rows.col.iter().map(|&dof| dof as usize).collect();
        let is_free = |dof: &usize| !in_rows.contains(dof) && !self.mesh.held.prescribed.contains_key(dof);
        let all = (0..self.mesh.space.dofs()).filter(is_free);
        let sizes = all.map(|dof| (dof, self.mesh.dof_of(motion, dof)));
        sizes.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).filter(|found| found.1.abs() > PART)
    }

    /// Fix a dof. The motions of the body are not found anew.
    pub fn fix(&mut self, dof: usize) {
        self.mesh.held.prescribed.insert(dof, 0.0);
    }
}

/// Return the nodal forces of the body force.
///
/// # Errors
/// The force is not finite somewhere, or beyond the range of numbers.
fn body_force<const D: usize>(spec: &BodySpec, space: &Space<D>) -> Result<NodalForces<D>> {
    let (name, Some(fields)) = (&spec.name, &spec.force) else { return Ok(NodalForces::default()) };
    let values = FieldValues::of("this body force", &name.value);
    let density = |x: [f64; D]| {
        let x = space.in_scene(x);
        std::array::from_fn(|c| spec.force_factor * values.at(&fields[c], x))
    };
    let load = assemble::body_force(space, &density);
    values.refused()?;
    if !load.is_finite() {
        return Err(Error::scene(&name.place, format!("body `{}`: the body force is too large", name.value))
            .label("its forces are beyond the range of numbers"));
    }
    Ok(load)
}

/// Return the error of loads whose sum is beyond the range of numbers.
pub fn too_large(spec: &BodySpec) -> Error {
    Error::scene(&spec.name.place, format!("body `{}`: its loads together are too large", spec.name.value))
        .label("their forces are beyond the range of numbers")
}

/// Return the bodies with their spaces, elasticity, supports and springs. `spaces` are those of an earlier problem on
/// the mesh; there are none before the first.
///
/// # Errors
/// The scene contradicts its mesh.
pub fn parts<'a, const D: usize>(
    scene: &'a Scene,
    verified: &Verified<D>,
    spaces: &[Rc<Space<D>>],
) -> Result<Vec<SceneBody<'a, D>>> {
    let Verified { mesh, checked, .. } = verified;
    let mut parts = Vec::new();
    for (index, spec) in scene.bodies.iter().enumerate() {
        let space = match spaces.get(index) {
            Some(space) => space.clone(),
            None => Rc::new(space(spec, mesh, scene.plane)?),
        };
        let checked = &checked[index];
        refuse_parts(spec, &space, &checked.parts, mesh)?;
        let elasticity = elasticity(spec, &space, mesh, scene.plane)?;
        let (points, extent) = (space.points_of_nodes(mesh.order), PointExtent::of(space.nodes.iter().copied()));
        let held = Constraints::new(spec, &space, mesh)?;
        let springs =
            spec.spring.iter().map(|spring| spring_blocks(spring, spec, &space, mesh)).collect::<Result<_>>()?;
        let cells = if spec.regions.is_empty() { 0 } else { space.cell_count() };
        let regions = (0..cells).map(|cell| elasticity.region(cell)).collect();
        let none = || Csr::new(space.dofs());
        let (rows, nodal_rows, approach) = (none(), none(), none());
        let mesh = BodyMesh {
            space,
            regions,
            held,
            springs,
            points,
            extent,
            rows,
            nodal_rows,
            approach,
            load: NodalForces::default(),
            motions: Vec::new(),
            free: 0,
            distribution: None,
            is_owned: true,
            graph: OnceCell::new(),
        };
        let (elasticity, dof_load) = (Rc::new(elasticity), NodalForces::default());
        parts.push(SceneBody { spec, elasticity, mesh, segments: Vec::new(), dof_load });
    }
    Ok(parts)
}

/// Return the space of a body.
///
/// # Errors
/// The mesh lacks the cells of the body, or a body of revolution has points of negative radius.
fn space<const D: usize>(spec: &BodySpec, mesh: &Mesh<D>, plane: Plane) -> Result<Space<D>> {
    let space = Space::new(mesh, find_group(mesh, &spec.name, &[D], "body")?, spec.order.unwrap_or_default());
    if plane != Plane::Axisymmetric {
        return Ok(space);
    }
    let space = space.revolved();
    let Some(&negative) = space.nodes.iter().find(|x| x[0] < 0.0) else { return Ok(space) };
    let x = point(space.in_scene(negative));
    let message = format!("body `{}` has a negative radius at {x}", spec.name.value);
    let help = "axisymmetric bodies are drawn as meridians, x >= 0 with the axis at x = 0: leave out one half";
    Err(Error::mesh(&mesh.path, None, message).help(help))
}

/// Check that all cells of a body are connected by facets.
///
/// # Errors
/// They are not. The error names the place of the second part.
fn refuse_parts<const D: usize>(
    spec: &BodySpec,
    space: &Space<D>,
    parts: &mesh::Components,
    mesh: &Mesh<D>,
) -> Result<()> {
    let Some(other) = parts.of_node.iter().position(|&part| part == 1) else { return Ok(()) };
    let (name, at) = (&spec.name.value, point(space.in_scene(space.nodes[other])));
    let message = format!("body `{name}` is in {} parts that share no facet, one of them at {at}", parts.count);
    Err(Error::mesh(&mesh.path, None, message)
        .help("make a body of each part (`split = true` in its table), or let them share facets (in the script: `Coherence;`)"))
}

/// Return the elasticity of the cells of a body.
///
/// # Errors
/// A region is missing, lies on another body or overlaps another one, or constants make no material.
fn elasticity<const D: usize>(spec: &BodySpec, space: &Space<D>, mesh: &Mesh<D>, plane: Plane) -> Result<Elasticity> {
    let mut of_cell = vec![0; if spec.regions.is_empty() { 0 } else { space.cell_count() }];
    for (number, region) in spec.regions.iter().enumerate() {
        let cells = space.cells_in(region.group(mesh)?);
        if cells.is_empty() {
            return Err(not_on_body(&region.on, &spec.name.value));
        }
        for cell in cells {
            if of_cell[cell] != 0 {
                let (first, second) = (&spec.regions[of_cell[cell] - 1].on.value, &region.on.value);
                let at = point(space.in_scene(space.centroid(cell)));
                let message = format!("the regions `{first}` and `{second}` share the cell at {at}");
                return Err(Error::scene(&region.on.place, message).help("let each cell be in one region at most"));
            }
            of_cell[cell] = number + 1;
        }
    }
    elasticity_of(spec, of_cell, D, plane)
}

/// Return the elasticity of some cells of a body. `of_cell` is the index of the constants of each cell; it is empty if
/// the body has no regions.
///
/// # Errors
/// Constants make no material.
pub fn elasticity_of(spec: &BodySpec, of_cell: Vec<usize>, dimension: usize, plane: Plane) -> Result<Elasticity> {
    let constants: Vec<ElasticitySpec> = constants(spec).collect();
    let constants: Vec<&ElasticitySpec> = constants.iter().collect();
    let elasticity = Elasticity::new(&constants, of_cell, dimension, plane)
        .map_err(|(number, flaw)| refusal(spec, number, None, &flaw))?;
    Ok(match &spec.temperature {
        Some(temperature) => elasticity.heated(temperature.value.clone(), spec.heat_factor),
        None => elasticity,
    })
}

/// Return the constants of a body and of its regions.
fn constants(spec: &BodySpec) -> impl Iterator<Item = ElasticitySpec> {
    std::iter::once(spec.elasticity()).chain(spec.regions.iter().map(|region| region.elasticity()))
}

/// Return the error of the constants of a body (`number` 0) or of one of its regions. The point is given if the
/// constants depend on it.
pub fn refusal(spec: &BodySpec, number: usize, x: Option<[f64; 3]>, flaw: &Flaw) -> Error {
    let elasticity = constants(spec).nth(number).unwrap_or_else(|| spec.elasticity());
    let place = &elasticity.place;
    let temperature = spec.temperature.iter().map(|temperature| ("temperature", &temperature.value));
    let expansion = elasticity.expansion.iter().flat_map(OneOrVector::fields).map(|field| ("expansion", field));
    let fields: Vec<_> = elasticity.fields().into_iter().chain(temperature).chain(expansion).collect();
    // A value that does not exist causes every other flaw, so it is reported first.
    if let Some(error) = x.and_then(|x| fields.iter().find_map(|(name, field)| field.eval_finite(name, x).err())) {
        return error.because(of_body(&spec.name.value));
    }
    let at = x.map(|x| format!(" at {}", point(x))).unwrap_or_default();
    let name = &spec.name.value;
    match flaw {
        Flaw::Constant(constant, value, rule) => {
            let own = fields.iter().find(|(name, _)| name == constant).and_then(|(_, field)| field.place());
            Error::scene(own.unwrap_or(place), format!("body `{name}`: {constant} is {}{at}", shown(*value)))
                .label(*rule)
        }
        Flaw::Axes(what) => Error::scene(place, format!("body `{name}`: axes{at}: {what}")),
        Flaw::NotCoercive(eigenvalue) => {
            let value = if eigenvalue.is_finite() {
                format!("the least eigenvalue of C is {eigenvalue:.6e}")
            } else {
                "C is not finite".to_owned()
            };
            Error::scene(place, format!("body `{name}`: the elasticity tensor is not positive definite{at}"))
                .label(value)
                .help("a strain must cost energy, whatever its direction: look for a slip among the constants")
        }
        Flaw::Twists => Error::scene(place, format!("body `{name}`: a body of revolution would twist{at}"))
            .label("strains of the meridian cause shear stresses along the circles")
            .help("in axisymmetric scenes one axis of the material runs along the circles: turn axes 1 and 2 alone"),
    }
}
