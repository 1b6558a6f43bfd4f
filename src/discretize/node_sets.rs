//! Surfaces that a scene names by sets of nodes, as meshes of other programs have them.

use super::find::earlier;
use super::roster;
use crate::error::{Error, Located, Result};
use crate::mesh::Mesh;
use crate::problem::body::{BodySpec, LoadKind, SpringKind, plain, plain_pattern};
use crate::problem::pattern::{BODY, Pattern};
use crate::scene::Scene;
use std::collections::{HashMap, HashSet};

/// What a line of a scene needs of the group that it names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Need {
    /// Facets.
    Facets,
    /// Facets or points: a total force.
    Either,
    /// The nodes: a support.
    Nodes,
    /// Points: springs.
    Points,
}

/// A line of the scene that names a group.
type Use<'a> = (&'a Located<String>, Need);

/// Replace each group of points that the scene names as a surface by facets: those of the boundary of a body all of whose nodes
/// belong to the group. Return what is to be said of nodes that belong to no such facet.
///
/// # Errors
/// The scene names the group for points, too, and some of these would be lost.
pub fn to_surfaces<const D: usize>(scene: &Scene, mesh: &mut Mesh<D>) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let uses: Vec<Use> = scene.bodies.iter().flat_map(of_body).chain(of_contacts(scene)).collect();
    for place in 0..mesh.groups.len() {
        let group = &mesh.groups[place];
        let own: Vec<Use> =
            uses.iter().copied().filter(|(on, _)| group.dimension == 0 && names(on, mesh, &group.name)).collect();
        if !own.iter().any(|(_, need)| matches!(need, Need::Facets | Need::Either)) {
            continue;
        }
        let points: HashSet<u32> = group.connectivity.iter().copied().collect();
        let (stride, connectivity) = facets(scene, mesh, &points)?;
        let covered = connectivity.iter().collect::<HashSet<_>>().len();
        let lost = points.len() - covered;
        let has = |wanted: Need| own.iter().any(|(_, need)| *need == wanted);
        let is_surface = has(Need::Facets) || lost == 0 && !has(Need::Points);
        if connectivity.is_empty() || !is_surface {
            continue;
        }
        refuse_points(&own, lost)?;
        let name = mesh.groups[place].name.clone();
        if lost > 0 {
            notes.push(format!(
                "the surface of the node set `{name}` has the facets whose nodes all belong to it, and {lost} of its {} nodes \
                 belong to no such facet",
                points.len()
            ));
        }
        let group = &mut mesh.groups[place];
        (group.dimension, group.stride, group.connectivity, group.tags) = (D - 1, stride, connectivity, Vec::new());
    }
    Ok(notes)
}

/// Refuse a group that is named as a surface, and also where points would be lost.
fn refuse_points(own: &[Use], lost: usize) -> Result<()> {
    let is_point = |need: Need| need == Need::Points || need == Need::Nodes && lost > 0;
    let as_points = own.iter().find(|(_, need)| is_point(*need));
    let as_surface = own.iter().find(|(_, need)| *need == Need::Facets);
    match (as_points, as_surface.or(own.first())) {
        (Some((on, _)), Some((other, _))) => {
            let message = format!("`{}` is a set of nodes here, and a surface elsewhere in the scene", on.value);
            Err(Error::scene(&on.place, message).because(earlier(other)).help("give the mesh two sets, one for each"))
        }
        _ => Ok(()),
    }
}

/// Return whether a line names a group, itself or by a pattern. The plain form of the name counts if no group has the name itself.
fn names<const D: usize>(on: &Located<String>, mesh: &Mesh<D>, group: &str) -> bool {
    let any = on.value.replace(BODY, "*");
    let form = plain_pattern(&any);
    let is = |form: &str, name: &str| Pattern::new(form).is_ok_and(|pattern| pattern.matches(name));
    is(&any, group) || is(&form, &plain(group)) && !mesh.groups.iter().any(|other| is(&any, &other.name))
}

fn of_body(body: &BodySpec) -> Vec<Use<'_>> {
    let load = body.load.iter().map(|load| match load.kind {
        LoadKind::Force { rigid: false, .. } => (&load.on, Need::Either),
        _ => (&load.on, Need::Facets),
    });
    let fix = body.fix.iter().map(|fix| (&fix.on, if fix.normal.is_some() { Need::Facets } else { Need::Nodes }));
    let spring = body.spring.iter().map(|spring| match spring.kind {
        SpringKind::Normal(_) => (&spring.on, Need::Facets),
        SpringKind::Vector(_) => (&spring.on, Need::Points),
    });
    load.chain(fix).chain(spring).collect()
}

fn of_contacts(scene: &Scene) -> impl Iterator<Item = Use<'_>> {
    scene.contacts.iter().flat_map(|contact| &contact.between).map(|on| (on, Need::Facets))
}

/// Return the facets of the boundaries of all bodies with all their nodes among `points`: nodes per facet, and nodes.
fn facets<const D: usize>(scene: &Scene, mesh: &Mesh<D>, points: &HashSet<u32>) -> Result<(usize, Vec<u32>)> {
    let (mut stride, mut all) = (D, Vec::new());
    for name in roster::members(scene, mesh)?.concat() {
        let Some(cells) = mesh.group(name).filter(|group| group.dimension == D) else { continue };
        // Facets with the number of cells that have them; those of the boundary have one.
        let mut found: HashMap<Vec<u32>, (usize, Vec<u32>)> = HashMap::new();
        for cell in cells.simplices() {
            for opposite in 0..=D {
                let facet = facet::<D>(cell, opposite);
                if facet.iter().all(|node| points.contains(node)) {
                    let mut corners = facet[..D].to_vec();
                    corners.sort_unstable();
                    found.entry(corners).or_insert((0, facet)).0 += 1;
                }
            }
        }
        let mut outer: Vec<Vec<u32>> =
            found.into_values().filter(|(cells, _)| *cells == 1).map(|(_, facet)| facet).collect();
        outer.sort_unstable();
        stride = outer.first().map_or(stride, Vec::len);
        all.extend(outer.into_iter().flatten());
    }
    Ok((stride, all))
}

/// Return the nodes of the facet of a cell without its vertex `opposite`, in the local numbering of a mesh.
fn facet<const D: usize>(cell: &[u32], opposite: usize) -> Vec<u32> {
    let corners: Vec<usize> = (0..=D).filter(|&corner| corner != opposite).collect();
    let mut facet: Vec<u32> = corners.iter().map(|&corner| cell[corner]).collect();
    if cell.len() > D + 1 {
        let edges: &[[usize; 2]] =
            if D == 2 { &[[0, 1], [1, 2], [0, 2]] } else { &[[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]] };
        // The order of the middle nodes of a facet is that of its own edges.
        let own: &[[usize; 2]] = if D == 2 { &[[0, 1]] } else { &[[0, 1], [1, 2], [0, 2]] };
        for ends in own.iter().map(|edge| edge.map(|at| corners[at])) {
            let edge = edges.iter().position(|edge| *edge == ends);
            facet.extend(edge.map(|edge| cell[D + 1 + edge]));
        }
    }
    facet
}
