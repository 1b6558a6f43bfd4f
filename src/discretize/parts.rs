//! The bodies of a scene on its mesh, of which every rank has some cells.

use super::approach::{self, Outer};
use super::elastic;
use super::find::{find_group, point};
use super::known::Known;
use super::part::{self, Part};
use super::totals::totals;
use super::verify::{self, Verified};
use crate::contact::pad;
use crate::error::{Error, Result};
use crate::exchange::{Exchange, first, gather, share};
use crate::fem::{Elasticity, Extent, Parts, Space, place};
use crate::linalg::Total;
use crate::mesh::{Group, Key, Mesh, Nodes, Portion};
use crate::problem::{BodySpec, Plane};
use crate::scene::Scene;
use std::sync::Arc;

/// The cells of a body that a rank has of the mesh: those at its own points, with their elasticity.
pub struct Stock<'a, const D: usize> {
    portion: &'a Portion<D>,
    /// The place of its group.
    group: usize,
    /// Nodes of the cells; empty where one rank has all, as these are those of the body's space.
    pub nodes: Vec<u32>,
    /// Elasticity of each.
    pub elasticity: Elasticity,
    /// The nodes of the body that this rank has.
    known: Arc<Nodes>,
}

impl<const D: usize> Stock<'_, D> {
    /// Keys of the cells.
    pub fn keys(&self) -> &[Key] {
        self.portion.keys(self.group)
    }

    /// Points of a cell.
    fn points(&self, cell: u32) -> &[u32] {
        let Group { connectivity, stride, .. } = &self.portion.mesh.groups[self.group];
        &connectivity[cell as usize * stride..][..*stride]
    }

    /// Nodes of a cell that are points of this rank.
    pub fn own_of<'s>(&'s self, cell: u32, nodes: &'s [u32]) -> impl Iterator<Item = u32> + 's {
        let own = nodes.iter().zip(self.points(cell)).filter(|(_, point)| self.portion.is_own(**point));
        own.map(|(&node, _)| node)
    }

    /// The number of a node of the cells among the points of the mesh.
    pub fn number(&self, node: u32) -> Option<u32> {
        Some(self.portion.number(self.known.points[place(&self.known.numbers, node)? as usize]))
    }

    /// Numbers of the cells that this rank speaks for: each is one of one rank.
    pub fn home(&self, rank: usize) -> impl Iterator<Item = usize> + Clone {
        home(self.portion, self.group, rank)
    }
}

fn home<const D: usize>(portion: &Portion<D>, group: usize, rank: usize) -> impl Iterator<Item = usize> + Clone {
    let cells = portion.mesh.groups[group].simplices().enumerate();
    cells.filter(move |(_, cell)| portion.home(cell[0]) == rank).map(|(number, _)| number)
}

/// Nodes that are points of this rank, sorted.
fn own<const D: usize>(known: &Nodes, portion: &Portion<D>) -> impl Iterator<Item = u32> {
    let nodes = known.numbers.iter().copied().zip(known.points.iter().copied());
    nodes.filter(|(_, point)| portion.is_own(*point)).map(|(node, _)| node)
}

/// The bodies with their spaces, supports and springs, and the cells that this rank has of them. Where there are several ranks, the spaces have the
/// cells behind surfaces, which say which side of a facet is out. Collective.
///
/// # Errors
/// Refusals of the scene against its mesh.
pub fn parts<'a, const D: usize>(
    scene: &Scene,
    verified: &'a Verified<D>,
    bodies: &'a [BodySpec],
) -> Result<(Vec<Part<'a, D>>, Vec<Stock<'a, D>>)> {
    let Verified { portion, checked, exchange, .. } = verified;
    let exchange = &**exchange;
    let mesh = &portion.mesh;
    let on_surface = if exchange.ranks() > 1 { on_surfaces(mesh) } else { Vec::new() };
    let wanted = Wanted { plane: scene.plane, boundaries: !scene.auto.is_empty() };
    let (mut parts, mut stocks) = (Vec::new(), Vec::new());
    for (index, spec) in bodies.iter().enumerate() {
        find_group(mesh, &spec.name, &[D], "body")?;
        let group = mesh.groups.place(&spec.name.value).unwrap_or_default();
        let nodes_here = &checked[index].nodes;
        let (mut space, elasticity, known) = read(spec, (portion, group), nodes_here, wanted, exchange)?;
        let mut volume = 0.0;
        if spec.load.is_empty() && spec.fix.is_empty() && spec.spring.is_empty() {
            let own = approach::volumes(&space).into_iter().filter(|(node, _)| known.is_own(*node));
            volume = totals(exchange, &[own.map(|(_, volume)| volume).collect()])[0];
        }
        let mut nodes = Vec::new();
        if exchange.ranks() > 1 {
            let behind = behind(&space, (portion, group), &on_surface, exchange);
            let held = held(spec, &space, mesh);
            let wanted = known.boundary.iter().chain(&behind).chain(&held).copied();
            tell(&mut space, &known, wanted, exchange);
            (space, nodes) = space.of_cells(behind, known.measure);
        }
        let mut part = Part::new(spec, mesh, space, known, exchange)?;
        let resultant = |load: &_| part.resultant(load, mesh);
        part.known.outer = Outer::new(spec, &part.space, mesh, &resultant, volume, exchange)?;
        verify::held(&part, &checked[index].parts, mesh, exchange)?;
        parts.push(part);
        stocks.push(Stock { portion, group, nodes, elasticity, known: nodes_here.clone() });
    }
    Ok((parts, stocks))
}

/// What a scene asks of all bodies.
#[derive(Clone, Copy)]
struct Wanted {
    /// Kind of a plane problem.
    plane: Plane,
    /// Whether contacts are to be found on whole boundaries.
    boundaries: bool,
}

/// The space of a body with the cells that are here, their elasticity, and what all ranks know of it. Collective.
///
/// # Errors
/// Refusals of the scene against its mesh, and bodies of revolution with points of negative radius.
fn read<const D: usize>(
    spec: &BodySpec,
    (portion, group): (&Portion<D>, usize),
    nodes: &Nodes,
    Wanted { plane, boundaries }: Wanted,
    exchange: &dyn Exchange,
) -> Result<(Space<D>, Elasticity, Known<D>)> {
    let (mesh, keys, cells_here) = (&portion.mesh, portion.keys(group), &portion.mesh.groups[group]);
    let mut space = match exchange.ranks() {
        1 => Space::new(mesh, cells_here, spec.order),
        _ => Space::of_nodes(mesh, nodes, cells_here, spec.order),
    };
    let own: Vec<u32> = own(nodes, portion).collect();
    if plane == Plane::Axisymmetric {
        let largest = share(exchange, space.largest_radius()).into_iter().fold(0.0, f64::max);
        space = space.revolved(largest);
        let negative = |node: &&u32| space.nodes[**node as usize][0] < 0.0;
        let refuse = |&node: &u32| {
            let x = point(space.in_scene(space.nodes[node as usize]));
            let message = format!("body `{}` has a negative radius at {x}", spec.name.value);
            let help = "axisymmetric bodies are drawn as meridians, x >= 0 with the axis at x = 0: leave out one half";
            Err((node, Error::mesh(&mesh.path, None, message).help(help)))
        };
        first(exchange, own.iter().find(negative).map_or(Ok(()), refuse))?;
    }
    let key = |cell: usize| keys.get(cell).copied().unwrap_or((0, cell as u32));
    let elasticity = elastic::of(spec, &space, mesh, plane, (&key, exchange))?;
    let home = || home(portion, group, exchange.rank());
    let shares: [Total; 2] =
        [home().map(|i| space.share(i)).collect(), home().map(|i| space.cell_measure(i)).collect()];
    let extent = Extent::of(own.iter().map(|&node| space.nodes[node as usize]));
    let (mut cells, mut all_shares, mut all_points) = (0, [Total::default(); 2], Extent::default());
    for (count, shares, extent) in share(exchange, (home().count(), shares, extent)) {
        cells += count;
        all_shares.iter_mut().zip(&shares).for_each(|(all, more)| all.join(more));
        all_points = all_points.join(&extent);
    }
    let ([volume, measure], extent) = (all_shares.map(|share| share.value()), all_points);
    let mut moduli = elasticity.moduli(0, [0.0; 3]).unwrap_or_default();
    // a rank may have no cell of it, and so none of a region
    if !spec.regions.is_empty() || !elasticity.is_constant() {
        moduli = elastic::moduli(&space, &elasticity, home());
        exchange.sum(&mut moduli);
        moduli = moduli.map(|sum| sum / volume);
    }
    let force = part::body_force(spec, &space, Parts::Whole).map_err(|error| (exchange.rank(), error));
    let force = first(exchange, force)?.only(|node| own.binary_search(&node).is_ok());
    let boundary = if boundaries { outside(&space, (portion, group), &key, exchange) } else { Vec::new() };
    let points = nodes.numbers.iter().zip(&nodes.points).map(|(&node, &point)| (node, point)).collect();
    let outer = Outer::default();
    let known = Known { own, extent, cells, volume, moduli, force, boundary, measure, points, outer };
    Ok((space, elasticity, known))
}

/// Nodes of this rank that supports on groups of cells hold, and those on the axis of a body of revolution.
fn held<const D: usize>(spec: &BodySpec, space: &Space<D>, mesh: &Mesh<D>) -> Vec<u32> {
    let groups = spec.fix.iter().filter_map(|fix| mesh.group(&fix.on.value)).filter(|group| group.dimension == D);
    let on_axis = space.nodes.known().filter(|&node| space.on_axis(node));
    groups.flat_map(|group| space.nodes_on(group)).chain(on_axis).collect()
}

/// Tells all ranks the places of these nodes, each of which at least its own rank wants to tell. Collective.
fn tell<const D: usize>(
    space: &mut Space<D>,
    known: &Known<D>,
    wanted: impl Iterator<Item = u32>,
    exchange: &dyn Exchange,
) {
    let mut own: Vec<u32> = wanted.filter(|&node| known.is_own(node)).collect();
    own.sort_unstable();
    own.dedup();
    let mine: Vec<(u32, [f64; 3])> = own.into_iter().map(|node| (node, pad(space.nodes[node as usize]))).collect();
    let all = share(exchange, mine).into_iter().flatten();
    space.nodes.learn(all.map(|(node, x)| (node, std::array::from_fn(|c| x[c]))));
}

/// Nodes of the facets of the boundary. Whoever has the least corner of a facet has its cells. Collective.
fn outside<const D: usize>(
    space: &Space<D>,
    (portion, group): (&Portion<D>, usize),
    key: &dyn Fn(usize) -> Key,
    exchange: &dyn Exchange,
) -> Vec<u32> {
    let mut places = space.lone_facets().collect::<Vec<_>>();
    if exchange.ranks() == 1 {
        return space.facets_of(places.into_iter()).nodes;
    }
    places.retain(|&(cell, opposite)| {
        let Group { connectivity, stride, .. } = &portion.mesh.groups[group];
        let corners = space.cells[cell * space.stride..][..=D].iter().zip(&connectivity[cell * stride..]).enumerate();
        let least = corners.filter(|(corner, _)| *corner != opposite).map(|(_, of_corner)| of_corner).min();
        least.is_some_and(|(_, &point)| portion.is_own(point))
    });
    let facets = space.facets_of(places.iter().copied());
    let facets = places.iter().zip(facets.nodes.chunks_exact(facets.stride));
    let mine: Vec<(Key, u8, Vec<u32>)> =
        facets.map(|(&(cell, opposite), nodes)| (key(cell), opposite as u8, nodes.to_vec())).collect();
    gather(exchange, &mine).into_iter().flat_map(|(.., nodes)| nodes).collect()
}

/// Nodes of the cells behind surfaces, which have all corners but one there. Collective.
fn behind<const D: usize>(
    space: &Space<D>,
    (portion, group): (&Portion<D>, usize),
    on_surface: &[bool],
    exchange: &dyn Exchange,
) -> Vec<u32> {
    let cell = |number: usize| &space.cells[number * space.stride..][..space.stride];
    let Group { connectivity, stride, .. } = &portion.mesh.groups[group];
    let on_surface = |point: &&u32| on_surface[**point as usize];
    let is_behind = |number: &usize| connectivity[number * stride..][..=D].iter().filter(on_surface).count() >= D;
    let mine = home(portion, group, exchange.rank()).filter(is_behind);
    let mine: Vec<(Key, Vec<u32>)> = mine.map(|number| (portion.keys(group)[number], cell(number).to_vec())).collect();
    gather(exchange, &mine).into_iter().flat_map(|(_, nodes)| nodes).collect()
}

/// Whether each point of a mesh is on a surface.
fn on_surfaces<const D: usize>(mesh: &Mesh<D>) -> Vec<bool> {
    let mut on_surface = vec![false; mesh.points.len()];
    let surfaces = mesh.groups.iter().filter(|group| group.dimension == D - 1);
    surfaces.flat_map(|group| &group.connectivity).for_each(|&point| on_surface[point as usize] = true);
    on_surface
}
