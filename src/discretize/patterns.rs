//! The single bodies of the tables of a scene. Tables, and the lines in them, may stand for many bodies by patterns of
//! names; the last table that matches counts. Errors point into the scene.

use super::groups::{Line, Owners};
use crate::error::{Error, Located, Result, few};
use crate::mesh::{Group, Mesh};
use crate::problem::RegionSpec;
use crate::problem::body::{fault, plain, plain_pattern};
use crate::problem::pattern::{BODY, Pattern, is_pattern};
use crate::problem::{BodySpec, Load, LoadKind, SpringSpec, Support};
use crate::scene::Scene;
use std::collections::{BTreeSet, HashMap};

/// Return the bodies of a scene, table by table. The bodies of a pattern are in the order of the mesh.
///
/// `lying` are the groups on each body ([`lying`]). A body that several tables match belongs to the last of these. A
/// line on groups named by a pattern acts on all groups that match and lie on the body. In a table of a pattern, every
/// line acts on those bodies on which its group lies.
///
/// # Errors
/// A table has no body, a group cannot name a body, a line acts on no body, or a total force acts on several surfaces.
pub fn bodies<const D: usize>(scene: &Scene, mesh: &Mesh<D>, lying: &[Vec<u32>]) -> Result<Vec<BodySpec>> {
    let mut bodies =
        if scene.bodies.iter().any(is_plural) { members_of_all(scene, mesh, lying)? } else { scene.bodies.clone() };
    bodies.iter_mut().for_each(|body| body.order = body.order.or(Some(mesh.default_order)));
    Ok(bodies)
}

/// Return the bodies of all tables. A table may stand for several bodies.
fn members_of_all<const D: usize>(scene: &Scene, mesh: &Mesh<D>, lying: &[Vec<u32>]) -> Result<Vec<BodySpec>> {
    let (members, mut lying, mut bodies) = (members(scene, mesh)?, lying.iter(), Vec::new());
    for (table, names) in scene.bodies.iter().zip(&members) {
        let name = |name: &&str| Located::new((*name).to_owned(), table.name.place.clone());
        let mut made: Vec<BodySpec> = names.iter().map(|body| BodySpec { name: name(body), ..table.clone() }).collect();
        let groups = lying.by_ref().take(names.len());
        let groups: Vec<Vec<&Group>> =
            groups.map(|on_it| on_it.iter().map(|&group| &mesh.groups[group as usize]).collect()).collect();
        give::<RegionSpec, D>(table, &mut made, &groups, mesh)?;
        give::<Support, D>(table, &mut made, &groups, mesh)?;
        give::<Load, D>(table, &mut made, &groups, mesh)?;
        give::<SpringSpec, D>(table, &mut made, &groups, mesh)?;
        refuse_totals(table, &made)?;
        bodies.extend(made);
    }
    Ok(bodies)
}

/// Give the bodies of a table those of its lines that act on them, each with the name of a single group. `groups` are
/// those that lie on each body.
///
/// # Errors
/// A line acts on no body.
fn give<L: Line, const D: usize>(
    table: &BodySpec,
    bodies: &mut [BodySpec],
    groups: &[Vec<&Group>],
    mesh: &Mesh<D>,
) -> Result<()> {
    let lines = L::of(&mut table.clone()).clone();
    bodies.iter_mut().for_each(|body| L::of(body).clear());
    for line in &lines {
        let (on, mut acts) = (line.on(), false);
        let is_of_kind = |group: &&&Group| line.dimensions::<D>().contains(&group.dimension);
        for (body, groups) in bodies.iter_mut().zip(groups) {
            let wanted = Located::new(on.value.replace(BODY, &body.name.value), on.place.clone());
            let found = if is_for_many(table) || is_open(&on.value) {
                called(&wanted, groups.iter().filter(is_of_kind))?
            } else {
                vec![&on.value]
            };
            acts |= !found.is_empty();
            L::of(body).extend(found.into_iter().map(|group| line.on_group(group)));
        }
        if !acts {
            let message = if is_open(&on.value) {
                format!("no group for this {} matches `{}` on `{}`", L::WHAT, on.value, table.name.value)
            } else {
                line.group(mesh)?;
                format!("`{}` lies on no body of `{}`", on.value, table.name.value)
            };
            let mut known: Vec<&str> =
                groups.iter().flatten().filter(is_of_kind).map(|group| group.name.as_str()).collect();
            known.dedup();
            let help = format!("groups of that kind on these bodies: {}", few(known).join(", "));
            return Err(Error::scene(&on.place, message).help(help));
        }
    }
    Ok(())
}

/// Refuse a total force or moment of a table that acts on several surfaces without naming that of each body.
fn refuse_totals(table: &BodySpec, made: &[BodySpec]) -> Result<()> {
    for line in &table.load {
        let is_total = matches!(line.kind, LoadKind::Force { .. } | LoadKind::Moment(_) | LoadKind::Turning { .. });
        let is_of_each = line.on.value.contains(BODY) && !is_pattern(&line.on.value);
        let places = made.iter().flat_map(|body| &body.load).filter(|load| load.on.place == line.on.place).count();
        if is_total && places > 1 && !is_of_each {
            let (on, name) = (&line.on.value, &table.name.value);
            let message = format!("a total force or moment on {places} surfaces: `{on}` of `{name}`");
            return Err(Error::scene(&line.on.place, message).help(format!(
                "give a pressure or a traction; or, for a force on each body, the group of each: on = \"{BODY}_top\""
            )));
        }
    }
    Ok(())
}

/// Return whether a table stands for many bodies: its name is a pattern, or it splits groups into their connected
/// parts.
fn is_for_many(table: &BodySpec) -> bool {
    is_pattern(&table.name.value) || table.split
}

/// Return whether a table stands for many bodies, or has lines for many groups.
fn is_plural(table: &BodySpec) -> bool {
    let lines = table.fix.iter().map(|line| &line.on).chain(table.load.iter().map(|line| &line.on));
    let lines = lines.chain(table.spring.iter().map(|line| &line.on)).chain(table.regions.iter().map(|line| &line.on));
    is_for_many(table) || lines.into_iter().any(|on| is_open(&on.value))
}

/// Return whether the name of a group is a pattern, or contains the placeholder for the name of the body.
fn is_open(on: &str) -> bool {
    is_pattern(on) || on.contains(BODY)
}

/// Return the pattern of a name of the scene. Its spelling was checked with the scene.
pub fn pattern(name: &Located<String>) -> Result<Pattern<'_>> {
    Pattern::new(&name.value).map_err(|flaw| Error::scene(&name.place, flaw))
}

/// Return the last table of the scene that matches a group of cells by its name, where `whole` is the group of which it
/// is a connected part. A table that splits groups stands for the parts of the groups that it matches.
fn table_of(scene: &Scene, patterns: &[Pattern], name: &str, whole: Option<&str>) -> Option<usize> {
    let called = |table: usize| if scene.bodies[table].split { whole } else { Some(name) };
    (0..patterns.len()).rev().find(|&table| called(table).is_some_and(|name| patterns[table].matches(name)))
}

/// Return the patterns of the names of all tables.
fn patterns_of(scene: &Scene) -> Result<Vec<Pattern<'_>>> {
    scene.bodies.iter().map(|table| pattern(&table.name)).collect()
}

/// Split the groups of cells whose table asks for it into connected parts, which become groups of their own.
///
/// # Errors
/// A name of a table is no pattern, or a part would have the name of another group.
pub fn split<const D: usize>(scene: &Scene, mesh: &mut Mesh<D>) -> Result<()> {
    let patterns = patterns_of(scene)?;
    let names: Vec<String> = mesh.group_names(D).map(str::to_owned).collect();
    for name in names {
        let Some(table) = table_of(scene, &patterns, &name, Some(&name)).map(|table| &scene.bodies[table]) else {
            continue;
        };
        if !table.split || mesh.groups.is_split(&name) {
            continue;
        }
        mesh.split(&name).map_err(|taken| {
            let message = format!("`{taken}` is a connected part of `{name}`, and the mesh has a group of that name");
            Error::scene(&table.name.place, message)
                .help("rename the group of the mesh, or name bodies without `split`")
        })?;
    }
    Ok(())
}

/// Return the names of the bodies of each table.
///
/// # Errors
/// A table has no body, or a group cannot name a body.
pub fn members<'a, const D: usize>(scene: &'a Scene, mesh: &'a Mesh<D>) -> Result<Vec<Vec<&'a str>>> {
    let patterns = patterns_of(scene)?;
    let mut members = vec![Vec::new(); patterns.len()];
    for name in mesh.group_names(D).filter(|name| !mesh.groups.is_split(name)) {
        let Some(table) = table_of(scene, &patterns, name, mesh.groups.whole(name)) else { continue };
        if let Some([label, help]) = fault(name) {
            let own = &scene.bodies[table].name;
            let message = format!("`{name}`, which `{}` matches, cannot be the name of a body", own.value);
            return Err(Error::scene(&own.place, message).label(label).help(help));
        }
        members[table].push(name);
    }
    for (table, members) in members.iter_mut().enumerate().filter(|(_, members)| members.is_empty()) {
        let name = &scene.bodies[table].name;
        let mut matching = mesh.group_names(D).filter(|group| patterns[table].matches(group));
        if let Some(taken) = matching.next() {
            let message = format!("all bodies of `{}`, such as `{taken}`, belong to later tables", name.value);
            return Err(Error::scene(&name.place, message)
                .help("the last table that matches a body counts: let the table of few bodies follow that of many"));
        }
        if is_for_many(&scene.bodies[table]) {
            let error = Error::scene(&name.place, format!("no group of cells matches `{}`", name.value));
            return Err(error
                .because(format!("mesh {}", mesh.path.display()))
                .help(format!("its groups of cells: {}", few(mesh.group_names(D)).join(", "))));
        }
        // a group that the mesh lacks is refused with the space of its body
        members.push(&name.value);
    }
    Ok(members)
}

/// Return the indices of the groups that lie on each body, for the bodies of each table in turn: its own cells, and
/// each group with an element whose corners all belong to the body. The list is empty if no table or line stands for
/// many.
///
/// # Errors
/// A pattern of bodies matches nothing or too much.
pub fn lying<const D: usize>(scene: &Scene, mesh: &Mesh<D>) -> Result<Vec<Vec<u32>>> {
    if !scene.bodies.iter().any(is_plural) {
        return Ok(Vec::new());
    }
    let names = members(scene, mesh)?.concat();
    let number: HashMap<&str, usize> = names.iter().copied().zip(0..).collect();
    let mut last = vec![usize::MAX; mesh.points.len()];
    let mut owners: Vec<(u32, usize)> = Vec::new();
    for (body, name) in names.iter().enumerate() {
        for &point in mesh.group(name).iter().flat_map(|group| &group.connectivity) {
            if std::mem::replace(&mut last[point as usize], body) != body {
                owners.push((point, body));
            }
        }
    }
    let owners = Owners::new(owners);
    let mut lying = vec![Vec::new(); names.len()];
    for (place, group) in (0..).zip(mesh.groups.iter()) {
        if let Some(&body) = number.get(group.name.as_str()).filter(|_| group.dimension == D) {
            lying[body].push(place);
            continue;
        }
        let on_all =
            |corners: &[u32], body: usize| corners.iter().all(|&point| owners.of(point).any(|other| other == body));
        let on = |simplex: &[u32]| {
            let corners = simplex[1..=group.dimension].to_vec();
            owners.of(simplex[0]).filter(move |&body| on_all(&corners, body)).collect::<Vec<_>>()
        };
        let bodies: BTreeSet<usize> = group.simplices().flat_map(on).collect();
        bodies.into_iter().for_each(|body| lying[body].push(place));
    }
    Ok(lying)
}

/// Return the names of the groups that a name or pattern of the scene means. If none has such a name, those with the
/// same plain form count.
fn called<'a>(wanted: &Located<String>, groups: impl Iterator<Item = &'a &'a Group>) -> Result<Vec<&'a String>> {
    let names: Vec<&String> = groups.map(|group| &group.name).collect();
    let exact = pattern(wanted)?;
    let found: Vec<&String> = names.iter().copied().filter(|name| exact.matches(name)).collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let form = Located::new(plain_pattern(&wanted.value), wanted.place.clone());
    let form = pattern(&form)?;
    Ok(names.into_iter().filter(|name| form.matches(&plain(name))).collect())
}
