//! What holds a body: supports and rigid surfaces as conditions on its nodes, and springs to the ground. Moments on
//! surfaces are here, too, since rigid surfaces turn about the same centre.

use super::groups::{FieldValues, Line, earlier, not_on_body, of_body, point, without_area};
use crate::error::{Error, Located, Place, Result, shown};
use crate::exchange::Plain;
use crate::expression::Field;
use crate::fem::{Facets, Frame, NodalBlock, NodalForces, Space, completed, cross, length, minus, place, surface};
use crate::linalg::{dot, pad};
use crate::mesh::{Group, Mesh};
use crate::problem::{BodySpec, LoadKind, SpringSpec};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One condition n.u = value at a node, with the direction n.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
struct Condition<const D: usize> {
    direction: [f64; D],
    value: f64,
    /// Index of the support in the scene; `None` for the symmetry of a body of revolution.
    support: Option<usize>,
}

/// The constraints from the supports and rigid surfaces of a body.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain, [[f64; D]; D]: Plain")]
pub struct Constraints<const D: usize> {
    /// Coordinates in which conditions are prescribed dofs.
    pub frame: Frame<D>,
    /// Prescribed dofs and their values.
    pub prescribed: BTreeMap<usize, f64>,
    /// Conditions with independent directions at each node. Those of tied nodes are at their master.
    conditions: BTreeMap<u32, Vec<Condition<D>>>,
    /// The rigid surfaces.
    pub rigid: Vec<RigidSurface<D>>,
}

/// A surface whose nodes move as one under a load.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct RigidSurface<const D: usize> {
    /// Index of the load in the scene.
    pub load: usize,
    /// Its nodes, sorted. The first one is the master, whose dofs move all of them.
    pub nodes: Vec<u32>,
    /// The master with the force on the surface.
    pub force: Option<(u32, [f64; D])>,
    /// The pole of a surface that turns, with the moment about the master as a force at its dofs.
    pub moment: Option<(u32, [f64; D])>,
}

/// Sine below which two directions are the same: half of the digits, so that what is left of the second has the other
/// half.
const PARALLEL: f64 = 1e-8;

impl<const D: usize> Constraints<D> {
    /// Collect the conditions of a body's supports on its nodes.
    ///
    /// # Errors
    /// A group is missing or not on the body, a value is not finite, a surface is not plane, or supports or rigid loads
    /// contradict each other.
    pub fn new(spec: &BodySpec, space: &Space<D>, mesh: &Mesh<D>) -> Result<Self> {
        let mut held = Constraints::default();
        held.tie(spec, space, mesh)?;
        let mut conditions = held.symmetry(space);
        for (support, fix) in spec.fix.iter().enumerate() {
            let group = fix.group(mesh)?;
            let nodes = space.nodes_on(group);
            if nodes.is_empty() {
                return Err(not_on_body(&fix.on, &spec.name.value));
            }
            let components = fix.components().into_iter().take(D).enumerate();
            let mut held_here: Vec<_> = components.filter_map(|(c, field)| Some((axis_vector(c), field?))).collect();
            if let Some(field) = fix.along_normal() {
                held_here.push((plane(space, group, &fix.on.value, &fix.on.place)?, field));
            }
            held.refuse_on_turning(&nodes, &fix.on, spec)?;
            for node in nodes {
                for &(direction, field) in &held_here {
                    let value = field
                        .eval_finite("the displacement of this support", space.in_scene(space.nodes[node as usize]))
                        .map_err(|error| error.because(of_body(&spec.name.value)))?;
                    let value = fix.factor * value;
                    let support = Some(support);
                    conditions.entry(held.frame.node(node)).or_default().push(Condition { direction, value, support });
                }
            }
        }
        for (node, conditions) in conditions {
            held.hold(node, &conditions, spec, space)?;
        }
        held.refuse_pushed_supports(spec)?;
        Ok(held)
    }

    /// Restrict the constraints to the nodes in the sorted slice `nodes`, which are renumbered by their positions
    /// there.
    pub fn on(&self, nodes: &[u32]) -> Self {
        let here = |node: u32| place(nodes, node);
        let prescribed = |(dof, value): (&usize, &f64)| Some((D * here((dof / D) as u32)? as usize + dof % D, *value));
        let conditions = self.conditions.iter().filter_map(|(node, at)| Some((here(*node)?, at.clone())));
        let rigid = self.rigid.iter().map(|surface| RigidSurface {
            load: surface.load,
            nodes: surface.nodes.iter().filter_map(|&node| here(node)).collect(),
            force: surface.force.and_then(|(node, force)| Some((here(node)?, force))),
            moment: surface.moment.and_then(|(node, force)| Some((here(node)?, force))),
        });
        Self {
            frame: self.frame.on(nodes),
            prescribed: self.prescribed.iter().filter_map(prescribed).collect(),
            conditions: conditions.collect(),
            rigid: rigid.collect(),
        }
    }

    /// Return the conditions of symmetry. In a body of revolution, nodes on the axis and rigid surfaces have no radial
    /// displacement.
    fn symmetry(&self, space: &Space<D>) -> BTreeMap<u32, Vec<Condition<D>>> {
        let radial = Condition { direction: axis_vector(0), value: 0.0, support: None };
        let on_axis = (0..space.nodes.len() as u32).filter(|&node| space.on_axis(node));
        let masters = self.rigid.iter().map(|surface| surface.nodes[0]);
        let held = on_axis.chain(masters).filter(|_| space.axisymmetric);
        held.map(|node| (self.frame.node(node), vec![radial])).collect()
    }

    /// Tie the nodes of each rigid surface to its first node, and to the rotation where it turns.
    fn tie(&mut self, spec: &BodySpec, space: &Space<D>, mesh: &Mesh<D>) -> Result<()> {
        let mut taken: BTreeMap<u32, usize> = BTreeMap::new();
        for (index, load) in spec.load.iter().enumerate() {
            let (total, moment) = match &load.kind {
                LoadKind::Force { total, rigid: true } => (total.numbers(), None),
                LoadKind::Turning { force, moment } => (force.numbers(), Some(moment.axial(Field::number))),
                _ => continue,
            };
            let group = load.group(mesh)?;
            let nodes = space.nodes_on(group);
            let Some(&master) = nodes.first() else {
                return Err(not_on_body(&load.on, &spec.name.value));
            };
            for &node in &nodes {
                if let Some(other) = taken.insert(node, index) {
                    let other = &spec.load[other].on;
                    let message = format!(
                        "body `{}`: the rigid surfaces `{}` and `{}` meet",
                        spec.name.value, other.value, load.on.value
                    );
                    return Err(Error::scene(&load.on.place, message)
                        .because(earlier(other))
                        .help("join the two surfaces in one physical group, with one force"));
                }
            }
            self.frame.tie(&nodes);
            self.prescribed
                .extend(nodes[1..].iter().flat_map(|&node| (0..D).map(move |c| (D * node as usize + c, 0.0))));
            let force = total.map(|component| load.factor * component);
            let mut at_pole = None;
            if let Some(moment) = moment {
                let facets = space.facets(group);
                if surface::measure(space, &facets) == 0.0 {
                    return Err(without_area(&load.on, spec));
                }
                let moment = moment.map(|m| load.factor * m);
                at_pole = Some(self.turn(&nodes, centre(space, &facets), force, moment, space));
            }
            let force = Some((master, std::array::from_fn(|c| force[c])));
            self.rigid.push(RigidSurface { load: index, nodes, force, moment: at_pole });
        }
        Ok(())
    }

    /// Let a rigid surface with these `nodes` turn. Return the pole, with the force at its dofs that does
    /// the work of the `moment` and of the force, which acts at the `centre`, on the rotation.
    fn turn(
        &mut self,
        nodes: &[u32],
        centre: [f64; 3],
        force: [f64; 3],
        moment: [f64; 3],
        space: &Space<D>,
    ) -> (u32, [f64; D]) {
        let x = |node: u32| space.nodes[node as usize];
        let pole = self.frame.let_turn(nodes, x);
        for c in 0..if D == 2 { 1 } else { D } {
            self.prescribed.remove(&(D * pole as usize + c));
        }
        let about_master = cross(minus(centre, pad(x(nodes[0]))), force);
        (pole, self.frame.moment(pole, std::array::from_fn(|c| moment[c] + about_master[c])))
    }

    /// Turn the conditions at a node into prescribed dofs. If the conditions are inclined, the node gets axes of its
    /// own.
    fn hold(&mut self, node: u32, conditions: &[Condition<D>], spec: &BodySpec, space: &Space<D>) -> Result<()> {
        let mut basis: Vec<([f64; D], f64)> = Vec::new();
        let kept = self.conditions.entry(node).or_default();
        for (position, condition) in conditions.iter().enumerate() {
            let (mut rest, mut value) = (condition.direction, condition.value);
            for (axis, known) in &basis {
                let share = dot(&condition.direction, axis);
                rest = std::array::from_fn(|c| rest[c] - share * axis[c]);
                value -= share * known;
            }
            let size = dot(&rest, &rest).sqrt();
            if size > PARALLEL {
                let axis = rest.map(|r| r / size);
                // A coordinate axis stays exact to the last digit.
                let along = (0..D).find(|&c| axis[c].abs() > 1.0 - 1e-14);
                basis.push(along.map_or((axis, value / size), |c| (axis_vector(c), value / size * axis[c].signum())));
                kept.push(*condition);
                continue;
            }
            let largest = conditions[..=position].iter().map(|other| other.value.abs()).fold(0.0, f64::max);
            if value.abs() > 1e-12 * largest {
                let earlier_one = conditions[..position].iter().rev().find(|other| other.support != condition.support);
                return Err(contradiction(spec, condition, earlier_one, space.in_scene(space.nodes[node as usize])));
            }
        }
        let turned = basis.iter().any(|(axis, _)| !axis.contains(&1.0));
        if turned {
            let axes = completed(basis.iter().map(|(axis, _)| *axis).collect());
            let surface = self.rigid.iter().find(|surface| surface.nodes[0] == node);
            self.frame.turn(node, axes, surface.map_or(&[], |surface| &surface.nodes[1..]));
        }
        for (i, (axis, value)) in basis.iter().enumerate() {
            let component = if turned { i } else { (0..D).find(|&c| axis[c] == 1.0).unwrap_or(i) };
            self.prescribed.insert(D * node as usize + component, *value);
        }
        Ok(())
    }

    /// Check that a support on these `nodes` holds none of a rigid surface that turns.
    ///
    /// # Errors
    /// It holds one.
    fn refuse_on_turning(&self, nodes: &[u32], on: &Located<String>, spec: &BodySpec) -> Result<()> {
        let turns = |surface: &&RigidSurface<D>| matches!(spec.load[surface.load].kind, LoadKind::Turning { .. });
        let holds = |surface: &&RigidSurface<D>| nodes.iter().any(|node| surface.nodes.binary_search(node).is_ok());
        let Some(RigidSurface { load, .. }) = self.rigid.iter().filter(turns).find(holds) else { return Ok(()) };
        let surface = &spec.load[*load].on;
        let message = format!(
            "body `{}`: the support on `{}` holds nodes of the rigid surface `{}`, which turns",
            spec.name.value, on.value, surface.value
        );
        Err(Error::scene(&on.place, message).because(earlier(surface)).help(
            "let the two not meet, or leave `moment` away: without a moment the rigid surface does not turn and can have supports",
        ))
    }

    /// Check that no rigid force pushes along a direction that a support constrains.
    ///
    /// # Errors
    /// A rigid force pushes against a support.
    fn refuse_pushed_supports(&self, spec: &BodySpec) -> Result<()> {
        for RigidSurface { load, nodes, .. } in &self.rigid {
            let load = &spec.load[*load];
            let LoadKind::Force { total, .. } = &load.kind else { continue };
            let total = total.numbers();
            let force: [f64; D] = std::array::from_fn(|c| total[c]);
            for Condition { direction, support, .. } in self.conditions.get(&nodes[0]).into_iter().flatten() {
                let Some(support) = support else { continue };
                if dot(&force, direction).abs() > 1e-12 * dot(&force, &force).sqrt() {
                    let on = &spec.fix[*support].on;
                    let message = format!(
                        "body `{}`: the rigid force on `{}` pushes against the support on `{}`",
                        spec.name.value, load.on.value, on.value
                    );
                    return Err(Error::scene(&load.on.place, message).because(earlier(on)).help(
                        "a rigid surface moves as one: let the support go, or set that component of the force to 0",
                    ));
                }
            }
        }
        Ok(())
    }

    /// Split a reaction at a node among the supports that constrain it: (support, force).
    pub fn split(&self, node: u32, reaction: [f64; D]) -> Vec<(usize, [f64; D])> {
        let Some(conditions) = self.conditions.get(&node).filter(|conditions| !conditions.is_empty()) else {
            return Vec::new();
        };
        let n = DMatrix::from_fn(conditions.len(), D, |i, c| conditions[i].direction[c]);
        let right = &n * DVector::from_fn(D, |c, _| reaction[c]);
        let Some(shares) = (&n * n.transpose()).lu().solve(&right) else { return Vec::new() };
        let part = |(i, at): (usize, &Condition<D>)| Some((at.support?, at.direction.map(|d| d * shares[i])));
        conditions.iter().enumerate().filter_map(part).collect()
    }

    /// Return the nodes at which supports act, and the tied nodes.
    pub fn nodes(&self) -> impl Iterator<Item = u32> + '_ {
        let tied = self.rigid.iter().flat_map(|surface| surface.nodes.iter().copied());
        self.conditions.keys().copied().chain(tied)
    }

    /// Return the number of prescribed dofs without those of tied nodes.
    pub fn supported(&self) -> usize {
        let is_tied = |node: u32| self.frame.node(node) != node;
        self.prescribed.keys().filter(|&dof| !is_tied((dof / D) as u32)).count()
    }
}

/// Return the unit vector along an axis.
pub fn axis_vector<const D: usize>(component: usize) -> [f64; D] {
    std::array::from_fn(|c| if c == component { 1.0 } else { 0.0 })
}

/// Return the outer unit normal of a plane surface.
///
/// # Errors
/// The surface is not plane.
fn plane<const D: usize>(space: &Space<D>, group: &Group, name: &str, place: &Place) -> Result<[f64; D]> {
    let facets: Facets<D> = space.facets(group);
    let normals = facets.normals(space);
    let sum = normals.iter().fold([0.0; D], |sum: [f64; D], n| std::array::from_fn(|c| sum[c] + n[c]));
    let size = dot(&sum, &sum).sqrt();
    let mean = sum.map(|s| s / size);
    let uncertain = facets.tilt(space, space.uncertainty).max(1e-6);
    let bent = |n: &[f64; D]| length(minus(*n, mean)) > uncertain;
    if !size.is_normal() || normals.iter().any(bent) {
        return Err(Error::scene(place, format!("`{name}` is no plane, so it has no one normal to hold"))
            .help("give each plane a physical group and a support of its own, or hold components: x = 0"));
    }
    Ok(mean)
}

fn contradiction<const D: usize>(
    spec: &BodySpec,
    condition: &Condition<D>,
    other: Option<&Condition<D>>,
    x: [f64; 3],
) -> Error {
    // Conditions of symmetry come first, so a condition that contradicts one is a support.
    let on = condition.support.map_or(&spec.name, |support| &spec.fix[support].on);
    let what = match (0..D).find(|&c| condition.direction[c] == 1.0) {
        Some(c) => format!("the {} displacement", ["x", "y", "z"][c]),
        None => format!("the displacement along {}", point(pad(condition.direction))),
    };
    let message = format!("body `{}`: supports prescribe two values of {what} at {}", spec.name.value, point(x));
    let error = Error::scene(&on.place, message)
        .label("this one and an earlier one")
        .help("make both values equal, or let the surfaces not meet");
    match other {
        Some(Condition { support: Some(support), .. }) => error.because(earlier(&spec.fix[*support].on)),
        Some(_) => error.because("bodies of revolution have no radial displacement on the axis and on rigid surfaces"),
        None => error,
    }
}

/// Return the stiffness blocks between nodes that a spring of the scene adds to K.
///
/// # Errors
/// The group is missing or not on the body, or the stiffness is negative or not finite somewhere.
pub fn spring_blocks<const D: usize>(
    spring: &SpringSpec,
    spec: &BodySpec,
    space: &Space<D>,
    mesh: &Mesh<D>,
) -> Result<Vec<NodalBlock<D>>> {
    let group = spring.group(mesh)?;
    let values = FieldValues::of("the stiffness of this spring", &spec.name.value);
    let value = |field: &Field, x: [f64; D]| {
        let x = space.in_scene(x);
        values.checked(field, x, |k| {
            let message =
                || format!("the stiffness of the spring on `{}` is {} at {}", spring.on.value, shown(k), point(x));
            let place = field.place().unwrap_or(&spring.on.place);
            if k >= 0.0 { Ok(()) } else { Err(Error::scene(place, message()).label("must not be negative")) }
        })
    };
    let at = |x: [f64; D], n: [f64; D]| -> [[f64; D]; D] {
        if let Some(normal) = &spring.normal {
            let k = value(normal, x);
            return n.map(|a| n.map(|b| k * a * b));
        }
        let along = |c: usize| spring.stiffness.as_ref().map_or(0.0, |stiffness| value(&stiffness[c], x));
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { along(i) } else { 0.0 }))
    };
    let blocks = if group.dimension == 0 {
        if spring.normal.is_some() {
            return Err(Error::scene(&spring.on.place, format!("points such as `{}` have no normal", spring.on.value))
                .help("give stiffness = [kx, ky]"));
        }
        let node = |node: u32| NodalBlock { nodes: [node; 2], block: at(space.nodes[node as usize], [0.0; D]) };
        space.nodes_on(group).into_iter().map(node).collect()
    } else {
        let facets = space.facets(group);
        if facets.count() > 0 && surface::measure(space, &facets) == 0.0 {
            return Err(without_area(&spring.on, spec));
        }
        surface::foundation(space, &facets, &at)
    };
    values.refused()?;
    if blocks.is_empty() { Err(not_on_body(&spring.on, &spec.name.value)) } else { Ok(blocks) }
}

/// Return the centre of a surface: the mean place over its area.
pub fn centre<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> [f64; 3] {
    let sum = |density: &dyn Fn([f64; D]) -> [f64; D]| surface::surface_load(space, facets, &|x, _| density(x)).sum();
    let area = sum(&|_| axis_vector(0))[0];
    sum(&|x| x).map(|sum| sum / area)
}

/// Return nodal forces with a moment (x, y, z; force times length) and without a resultant. In the plane the moment has
/// a z component alone.
///
/// The traction is theta x r with r = x - c, where c is the centre of the surface: stresses of a beam in bending. Its
/// moment is J theta with J = int |r|^2 I - r r^T over the surface. All integrals are those of the quadrature of loads,
/// so that the nodal forces have the moment to rounding on curved facets, too.
pub fn moment_load<const D: usize>(space: &Space<D>, facets: &Facets<D>, moment: [f64; 3]) -> NodalForces<D> {
    let of = |traction: &dyn Fn([f64; D]) -> [f64; D]| surface::surface_load(space, facets, &|x, _| traction(x));
    let centre = centre(space, facets);
    let from_centre = |x: [f64; D]| {
        let x = pad(x);
        std::array::from_fn(|c| x[c] - centre[c])
    };
    let turn = |theta: [f64; 3]| {
        of(&|x| {
            let traction = cross(theta, from_centre(x));
            std::array::from_fn(|c| traction[c])
        })
    };
    let moment_of = |load: &NodalForces<D>| {
        let of_node = |(node, force)| Vector3::from(cross(from_centre(space.nodes[node as usize]), pad(force)));
        load.iter().map(of_node).sum::<Vector3<f64>>()
    };
    // In the plane bodies turn about z alone. The other axes keep a one on the diagonal.
    let mut inertia = Matrix3::identity();
    for axis in if D == 2 { 2..3 } else { 0..3 } {
        inertia.set_column(axis, &moment_of(&turn(axis_vector(axis))));
    }
    let theta = inertia.lu().solve(&Vector3::from(moment)).unwrap_or(Vector3::repeat(f64::NAN));
    turn(theta.into())
}
