//! Scene and mesh -> [`Model`]: the one place where geometry ends. Nothing below it knows the dimension.

use crate::contact::{self, ContactPair, Fault, Side};
use crate::ddm::{Body, BodySlot, Exchange, Model, Motion, RobinZone, Segment};
use crate::error::{Error, Kind, Located, Result};
use crate::fem::{
    ElasticBody, Facets, Material, NodeGraph, Space, assemble,
    rigid::{self, RigidMotion},
    stress,
};
use crate::linalg::Csr;
use crate::mesh::{Group, Mesh};
use crate::output::vtu::{BodyField, CellKind};
use crate::scene::expression::Field;
use crate::scene::{BodySpec, ContactSpec, LoadKind, Order, Scene, Start, Zone};
use std::collections::HashMap;

/// A body ready for its inner solver: what [`Problem::build`] hands to the maker of bodies.
pub struct Assembled {
    /// Name in the scene.
    pub name: String,
    /// Number of the body.
    pub index: usize,
    /// Space dimension: block size of the matrix.
    pub dimension: usize,
    /// K, f and supports.
    pub body: ElasticBody,
    /// All contact rows of the body, pair by pair.
    pub rows: Csr,
    /// Rigid motions of the free body, for multigrid's near-null space.
    pub motions: Vec<RigidMotion>,
}

/// What is known of a body besides its matrices.
pub struct BodyInfo {
    /// Name in the scene.
    pub name: String,
    /// Nodes.
    pub nodes: usize,
    /// Cells.
    pub cells: usize,
    /// Degrees of freedom, supported ones included.
    pub dofs: usize,
    /// Supported degrees of freedom.
    pub supported: usize,
    /// Names of the rigid motions that the supports leave.
    pub left_by_supports: Vec<String>,
    /// Names of those that no contact row can hold either.
    pub left_by_all: Vec<String>,
    /// Rank that owns the body.
    pub rank: usize,
    field: Box<dyn Fn(&[f64]) -> BodyField>,
}

impl BodyInfo {
    /// Displacements and recovered stresses for output, from displacements of all dofs.
    pub fn field(&self, u: &[f64]) -> BodyField {
        (self.field)(u)
    }
}

/// The discrete problem and what reports need to know of its origin.
pub struct Problem {
    /// What the method works on.
    pub model: Model,
    /// Bodies in the order of the scene.
    pub bodies: Vec<BodyInfo>,
    /// For each pair, whether side a (which carries the points) is the second surface in the scene.
    pub swapped: Vec<bool>,
    /// Stiffness matrix and contact rows of every body, kept only when a method asked for them.
    pub kept: Vec<(Csr, Csr)>,
    /// Stiffness matrices assembled on this rank.
    pub assemblies: usize,
}

/// Turns a scene and its mesh into a model.
///
/// `ranks` is (this rank, number of ranks); `keep` keeps matrices and rows for a method that needs them; `cut` finds the common pieces of surfaces in this dimension. `make` turns each assembled body that `owner` gives to `rank` into one that
/// solves.
///
/// # Errors
/// Refusals of the scene against its mesh: missing groups, surfaces of the wrong body, supports that contradict each
/// other, surfaces that do not face each other; and failures of `make`.
pub fn discretize<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
    cut: contact::pieces::Cut<D>,
    ranks: (usize, usize),
    keep: bool,
    exchange: Box<dyn Exchange>,
    make: &mut dyn FnMut(Assembled) -> Result<Box<dyn Body>>,
) -> Result<Problem> {
    let parts = scene.bodies.iter().map(|spec| Part::new(spec, mesh)).collect::<Result<Vec<_>>>()?;
    let mut pairs = Vec::new();
    let mut swapped = Vec::new();
    for spec in &scene.contacts {
        let (pair, is_swapped) = make_pair(spec, mesh, cut, &parts)?;
        pairs.push(pair);
        swapped.push(is_swapped);
    }
    let loads: Vec<usize> = parts.iter().map(|part| part.space.dofs()).collect();
    let owner = crate::parallel::owners(&loads, ranks.1);
    let (mut slots, mut infos, mut kept, mut assemblies) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for (index, part) in parts.into_iter().enumerate() {
        let (segments, rows) = rows_of(index, &pairs, part.space.dofs());
        let free = rigid::modes(&part.space.nodes);
        let prescribed: Vec<(usize, f64)> = part.prescribed_sorted();
        let left = rigid::left_by_supports(&free, &prescribed);
        let motions: Vec<Motion> = left.iter().map(|motion| trace_of(motion, &rows)).collect();
        let mut slot = BodySlot {
            name: part.spec.name.value.clone(),
            local: None,
            segments,
            scale: 0.0,
            row_stiffness: Vec::new(),
            motions,
        };
        let material = Material::isotropic(part.spec.young.value, part.spec.poisson.value, D, scene.plane);
        if owner[index] == ranks.0 {
            let body = part.assemble(mesh, &rows, &material, prescribed)?;
            assemblies += 1;
            let diagonal = |i: usize| body.stiffness.position(i, i).map_or(0.0, |k| body.stiffness.values[k]);
            slot.scale = (0..body.load.len()).map(diagonal).fold(0.0, f64::max);
            slot.row_stiffness =
                (0..rows.rows()).map(|q| rows.row(q).map(|(i, b)| b * b * diagonal(i)).sum()).collect();
            if keep {
                kept.push((body.stiffness.clone(), rows.clone()));
            }
            slot.local =
                Some(make(Assembled { name: slot.name.clone(), index, dimension: D, body, rows, motions: free })?);
        }
        infos.push(BodyInfo {
            name: slot.name.clone(),
            nodes: part.space.nodes.len(),
            cells: part.space.cell_count(),
            dofs: part.space.dofs(),
            supported: part.prescribed.len(),
            left_by_supports: left.iter().map(|motion| motion.name.clone()).collect(),
            left_by_all: left_by_all(&slot.motions),
            rank: owner[index],
            field: field_maker(slot.name.clone(), part.space, material),
        });
        slots.push(slot);
    }
    let mut scales: Vec<f64> = slots.iter().map(|slot| slot.scale).collect();
    exchange.sum(&mut scales);
    slots.iter_mut().zip(scales).for_each(|(slot, scale)| slot.scale = scale);
    Ok(Problem { model: Model::new(slots, pairs, exchange), bodies: infos, swapped, kept, assemblies })
}

/// psi of the scene for the method.
pub fn robin_zone(scene: &Scene) -> RobinZone {
    match &scene.method.psi {
        Zone::None => RobinZone::None,
        Zone::Full => RobinZone::Full,
        Zone::Active => RobinZone::Active,
        Zone::Subset(field) => {
            let field = field.clone();
            RobinZone::Subset(Box::new(move |x, k| field.is_true_at(x, k)))
        }
    }
}

/// The scene's start as a trace vector of the model.
///
/// # Errors
/// A start that is not finite at a contact point.
pub fn start(scene: &Scene, model: &Model) -> Result<Vec<f64>> {
    let points = model.points();
    let mut trace = vec![0.0; 2 * points];
    if let Start::Normal(field) = &scene.method.start {
        let positions = model.pairs.iter().flat_map(|pair| &pair.position);
        for (q, &x) in positions.enumerate() {
            let value = field.eval(x);
            if !value.is_finite() {
                return Err(placed(field, format!("the start is {value} at {}", point(x))));
            }
            trace[q] = value;
            trace[points + q] = value;
        }
    }
    Ok(trace)
}

/// A body of the scene with its space, supports and the lookups that they need.
struct Part<'a, const D: usize> {
    spec: &'a BodySpec,
    space: Space<D>,
    prescribed: HashMap<usize, f64>,
}

impl<'a, const D: usize> Part<'a, D> {
    fn new(spec: &'a BodySpec, mesh: &Mesh<D>) -> Result<Self> {
        let group = find_group(mesh, &spec.name, &[D], "body")?;
        let space = Space::new(mesh, group, spec.order);
        let mut part = Self { spec, space, prescribed: HashMap::new() };
        part.support(mesh)?;
        Ok(part)
    }

    fn support(&mut self, mesh: &Mesh<D>) -> Result<()> {
        for support in &self.spec.fix {
            let dimensions: Vec<usize> = (0..=D).rev().collect();
            let group = find_group(mesh, &support.on, &dimensions, "support")?;
            let nodes = self.space.nodes_on(group);
            if nodes.is_empty() {
                return Err(not_on_body(&support.on, &self.spec.name.value));
            }
            for node in nodes {
                for (c, value) in support.value[..D].iter().enumerate() {
                    let Some(value) = value else { continue };
                    let before = self.prescribed.insert(D * node as usize + c, *value);
                    if before.is_some_and(|before| before != *value) {
                        let x = contact::pad(self.space.nodes[node as usize]);
                        let message = format!(
                            "body `{}`: supports prescribe two values of the {} displacement at {}",
                            self.spec.name.value,
                            ["x", "y", "z"][c],
                            point(x)
                        );
                        return Err(Error::scene(&support.on.place, message)
                            .label("this one and an earlier one")
                            .help("make both values equal, or let the surfaces not meet"));
                    }
                }
            }
        }
        Ok(())
    }

    fn prescribed_sorted(&self) -> Vec<(usize, f64)> {
        let mut all: Vec<_> = self.prescribed.iter().map(|(&dof, &value)| (dof, value)).collect();
        all.sort_unstable_by_key(|entry| entry.0);
        all
    }

    fn assemble(
        &self,
        mesh: &Mesh<D>,
        rows: &Csr,
        material: &Material,
        prescribed: Vec<(usize, f64)>,
    ) -> Result<ElasticBody> {
        let coupled: Vec<Vec<u32>> = (0..rows.rows())
            .map(|q| {
                let mut nodes: Vec<u32> = rows.row(q).map(|(dof, _)| (dof / D) as u32).collect();
                nodes.dedup();
                nodes
            })
            .filter(|nodes| nodes.len() > 1)
            .collect();
        let graph = NodeGraph::new(&self.space, &coupled);
        let name = &self.spec.name;
        let stiffness = assemble::stiffness(&self.space, &graph, material).map_err(|defect| {
            let assemble::Defect::Inverted(cell) = defect;
            let corner = contact::pad(self.space.cell_nodes(cell)[0]);
            let message = format!("body `{}`: the curved cell at {} is folded", name.value, point(corner));
            Error::mesh(&mesh.path, None, message).help("refine the mesh there, or use order = 1")
        })?;
        let mut load = vec![0.0; self.space.dofs()];
        for spec in &self.spec.load {
            let group = find_group(mesh, &spec.on, &[D - 1], "load")?;
            let facets = self.space.facets(group);
            if facets.count() == 0 {
                return Err(not_on_body(&spec.on, &name.value));
            }
            assemble::surface_load(
                &self.space,
                &facets,
                &|x, n| match &spec.kind {
                    LoadKind::Pressure(field) => {
                        let pressure = field.eval(contact::pad(x));
                        n.map(|n| -pressure * n)
                    }
                    LoadKind::Traction(fields) => std::array::from_fn(|c| fields[c].eval(contact::pad(x))),
                },
                &mut load,
            );
            if load.iter().any(|f| !f.is_finite()) {
                return Err(Error::scene(
                    &spec.on.place,
                    format!("body `{}`: this load is not finite everywhere on its surface", name.value),
                )
                .help("mind roots of negative numbers and divisions by zero in the expression"));
            }
        }
        if let Some(fields) = &self.spec.force {
            let density = |x: [f64; D]| std::array::from_fn(|c| fields[c].eval(contact::pad(x)));
            assemble::body_force(&self.space, &density, &mut load);
            if load.iter().any(|f| !f.is_finite()) {
                return Err(Error::scene(
                    &name.place,
                    format!("body `{}`: its body force is not finite everywhere", name.value),
                )
                .help("mind roots of negative numbers and divisions by zero in the expression"));
            }
        }
        Ok(assemble::support(stiffness, load, prescribed))
    }
}

/// The pair of a contact, and whether its side a is the scene's second surface.
fn make_pair<const D: usize>(
    spec: &ContactSpec,
    mesh: &Mesh<D>,
    cut: contact::pieces::Cut<D>,
    parts: &[Part<D>],
) -> Result<(ContactPair, bool)> {
    let mut sides = Vec::new();
    for name in &spec.between {
        let group = find_group(mesh, name, &[D - 1], "contact surface")?;
        let (body, facets) = owner_of(name, group, parts)?;
        let part = &parts[body];
        sides.push((body, Side::new(&name.value, &part.space, facets, &part.prescribed)));
    }
    let (body_b, b) = sides.remove(1);
    let (body_a, a) = sides.remove(0);
    if body_a == body_b {
        return Err(Error::scene(
            &spec.between[1].place,
            format!("both surfaces belong to body `{}`", parts[body_a].spec.name.value),
        )
        .help("contact of a body with itself is out of scope; make two bodies of it"));
    }
    // the finer side carries the points, whatever the order in the scene
    let (fine_a, fine_b) = (a.mean_measure(), b.mean_measure());
    let a_carries = if (fine_a - fine_b).abs() > 1e-6 * fine_a { fine_a < fine_b } else { a.name < b.name };
    let (a, b, bodies) = if a_carries { (a, b, [body_a, body_b]) } else { (b, a, [body_b, body_a]) };
    let pair = pair_on(spec, cut, a, b, bodies)?;
    Ok((pair, !a_carries))
}

fn pair_on<const D: usize>(
    spec: &ContactSpec,
    cut: contact::pieces::Cut<D>,
    a: Side<D>,
    b: Side<D>,
    bodies: [usize; 2],
) -> Result<ContactPair> {
    let shared = cut(&a, &b);
    let law = contact::law::make(&spec.layer);
    contact::assemble(&a, &b, bodies, &shared, &|x| spec.gap.eval(x), law).map_err(|fault| match fault {
        Fault::NoPartner => {
            let names = [&spec.between[0].value, &spec.between[1].value];
            Error::scene(
                &spec.between[0].place,
                format!("`{}` and `{}` do not face each other anywhere", names[0], names[1]),
            )
            .help("a pair needs surfaces whose outer normals point at each other; look at the mesh with `gmsh`")
        }
        Fault::Gap(x) => placed(&spec.gap, format!("the gap is not finite at {}", point(x))),
    })
}

/// The body that a contact surface bounds, with the facets.
fn owner_of<const D: usize>(name: &Located<String>, group: &Group, parts: &[Part<D>]) -> Result<(usize, Facets<D>)> {
    let mut found: Vec<(usize, Facets<D>)> = parts
        .iter()
        .enumerate()
        .map(|(body, part)| (body, part.space.facets(group)))
        .filter(|(_, facets)| facets.count() > 0)
        .collect();
    let all = group.connectivity.len() / group.stride;
    match (found.pop(), found.len()) {
        (Some((body, facets)), 0) if facets.count() == all => Ok((body, facets)),
        (Some((body, facets)), 0) => {
            let body = &parts[body].spec.name.value;
            let message = format!("only {} of {all} facets of `{}` bound body `{body}`", facets.count(), name.value);
            Err(Error::scene(&name.place, message)
                .help("a contact surface must lie on one body as a whole: split the physical group"))
        }
        (None, _) => Err(Error::scene(&name.place, format!("surface `{}` bounds no body of the scene", name.value))
            .help("add the body it belongs to, or name another surface")),
        (Some((last, _)), _) => {
            let bodies = [found[0].0, last].map(|body| parts[body].spec.name.value.clone());
            let message = format!("surface `{}` bounds both `{}` and `{}`", name.value, bodies[0], bodies[1]);
            Err(Error::scene(&name.place, message)
                .help("the bodies share mesh nodes there: give each its own curve or surface in the geometry"))
        }
    }
}

/// Contact rows of a body over all pairs, in the order of its segments.
fn rows_of(body: usize, pairs: &[ContactPair], dofs: usize) -> (Vec<Segment>, Csr) {
    let mut segments = Vec::new();
    let mut rows = Csr::new(dofs);
    for (index, pair) in pairs.iter().enumerate() {
        for side in 0..2 {
            if pair.bodies[side] == body {
                segments.push(Segment { pair: index, side });
                for q in 0..pair.len() {
                    rows.push_row(pair.rows[side].row(q));
                }
            }
        }
    }
    (segments, rows)
}

fn trace_of(motion: &RigidMotion, rows: &Csr) -> Motion {
    let mut trace = vec![0.0; rows.rows()];
    rows.multiply(&motion.displacement, &mut trace);
    Motion { name: motion.name.clone(), trace }
}

/// Motions left by supports that no contact row feels.
fn left_by_all(motions: &[Motion]) -> Vec<String> {
    let felt = nalgebra::DMatrix::from_fn(motions.len(), motions.len(), |i, j| {
        crate::linalg::dot(&motions[i].trace, &motions[j].trace)
    });
    let rows = motions.first().map_or(1, |motion| motion.trace.len().max(1));
    crate::linalg::kernel(&felt, rows as f64, 1e-13)
        .iter()
        .map(|weights| {
            let parts = (0..motions.len()).filter(|&i| weights[i].abs() > 1e-6 * weights.amax());
            parts.map(|i| motions[i].name.as_str()).collect::<Vec<_>>().join(" with ")
        })
        .collect()
}

fn field_maker<const D: usize>(name: String, space: Space<D>, material: Material) -> Box<dyn Fn(&[f64]) -> BodyField> {
    Box::new(move |u| {
        let stress = stress::nodal(&space, &material, u);
        BodyField {
            name: name.clone(),
            points: space.nodes.iter().map(|&x| contact::pad(x)).collect(),
            cell: match (D, space.order) {
                (2, Order::P1) => CellKind::Triangle,
                (2, Order::P2) => CellKind::QuadraticTriangle,
                (_, Order::P1) => CellKind::Tetra,
                (_, Order::P2) => CellKind::QuadraticTetra,
            },
            connectivity: space.cells.clone(),
            displacement: u
                .chunks_exact(D)
                .map(|u| std::array::from_fn(|c| u.get(c).copied().unwrap_or(0.0)))
                .collect(),
            von_mises: stress.iter().map(stress::von_mises).collect(),
            stress,
        }
    })
}

/// A mesh group by name, of one of the dimensions in order of preference.
fn find_group<'m, const D: usize>(
    mesh: &'m Mesh<D>,
    name: &Located<String>,
    dimensions: &[usize],
    what: &str,
) -> Result<&'m Group> {
    let of = |dimension: usize| mesh.groups.iter().filter(move |group| group.dimension == dimension);
    if let Some(group) = dimensions.iter().find_map(|&d| of(d).find(|group| group.name == name.value)) {
        return Ok(group);
    }
    let known: Vec<&str> = dimensions.iter().flat_map(|&d| of(d)).map(|group| group.name.as_str()).collect();
    let kind = |dimension: usize| match (D - dimension, dimension) {
        (0, _) => "region",
        (1, 1) => "curve",
        (1, _) => "surface",
        (_, 0) => "point group",
        _ => "curve",
    };
    let error =
        Error::scene(&name.place, format!("the mesh has no {} `{}` for this {what}", kind(dimensions[0]), name.value))
            .because(format!("mesh {}", mesh.path.display()));
    if let Some(other) = mesh.groups.iter().find(|group| group.name == name.value) {
        return Err(error.help(format!("`{}` is a {} there", name.value, kind(other.dimension))));
    }
    Err(match crate::error::nearest(&name.value, known.iter().copied()) {
        Some(near) => error.help(format!("did you mean `{near}`?")),
        None => error.help(format!("physical groups of that kind: {}", known.join(", "))),
    })
}

fn not_on_body(on: &Located<String>, body: &str) -> Error {
    Error::scene(&on.place, format!("`{}` does not touch body `{body}`", on.value))
        .help("a support or load acts on a physical group of its own body")
}

/// A refusal that points at an expression of the scene.
fn placed(field: &Field, message: String) -> Error {
    let error =
        Error::new(Kind::Scene, message).help("mind roots of negative numbers and divisions by zero in the expression");
    match field.place() {
        Some(place) => error.at(place),
        None => error,
    }
}

fn point(x: [f64; 3]) -> String {
    format!("({}, {}, {})", x[0], x[1], x[2])
}
