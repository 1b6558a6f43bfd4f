//! The single bodies of a scene. Its tables, and the lines in them, may stand for many bodies by patterns of names.

use super::find::find_group;
use crate::error::{Error, Located, Place, Result, few};
use crate::mesh::{Group, Mesh};
use crate::problem::body::{BodySpec, LoadKind, fault};
use crate::problem::pattern::{BODY, Pattern, Rank, is_pattern};
use crate::scene::Scene;
use std::collections::{BTreeSet, HashMap};

/// Return the bodies of a scene, table by table. The bodies of a pattern are in the order of the mesh.
///
/// A body that several tables match belongs to the narrowest one. A line on groups named by a pattern acts on all groups that
/// match and lie on the body. In a table of a pattern, every line acts on those bodies on which its group lies.
///
/// # Errors
/// A pattern matches nothing, two tables match a body equally well, a group cannot name a body, or a total force acts on several
/// surfaces.
pub fn bodies<const D: usize>(scene: &Scene, mesh: &Mesh<D>, lying: &Lying) -> Result<Vec<BodySpec>> {
    if !scene.bodies.iter().any(is_plural) {
        return Ok(scene.bodies.clone());
    }
    let members = members(scene, mesh)?;
    let mut lying = lying.iter().map(|groups| groups.iter().map(|&group| &mesh.groups[group as usize]).collect());
    let mut bodies = Vec::new();
    for (table, names) in scene.bodies.iter().zip(&members) {
        let lines = Lines { table, mesh, names, lying: lying.by_ref().take(names.len()).collect() };
        let all: Vec<usize> = (0..=D).rev().collect();
        let regions = lines.deal(&table.regions, |line| &mut line.on, "region", |_| &[D])?;
        let fix = lines.deal(
            &table.fix,
            |line| &mut line.on,
            "support",
            |line| match line.normal {
                Some(_) => &all[1..2],
                None => &all,
            },
        )?;
        let load = lines.deal(&table.load, |line| &mut line.on, "load", |line| load_dimensions::<D>(&line.kind))?;
        let spring = lines.deal(&table.spring, |line| &mut line.on, "spring", |_| &[D - 1, 0])?;
        for line in &table.load {
            let places = load.iter().flatten().filter(|load| load.on.place == line.on.place).count();
            let own = line.on.value.contains(BODY) && !is_pattern(&line.on.value);
            if matches!(line.kind, LoadKind::Force { .. }) && places > 1 && !own {
                let message =
                    format!("a total force on {places} surfaces: `{}` of `{}`", line.on.value, table.name.value);
                return Err(Error::scene(&line.on.place, message).help(format!(
                    "give a pressure or a traction; or, for a force on each body, the group of each: on = \"{BODY}_top\""
                )));
            }
        }
        let lists = regions.into_iter().zip(fix).zip(load.into_iter().zip(spring));
        for (name, ((regions, fix), (load, spring))) in names.iter().zip(lists) {
            let name = Located::new((*name).to_owned(), table.name.place.clone());
            bodies.push(BodySpec { name, regions, fix, load, spring, ..table.clone() });
        }
    }
    Ok(bodies)
}

/// Return the dimensions of groups on which a load can act. A total force acts on points, too.
pub fn load_dimensions<const D: usize>(kind: &LoadKind) -> &'static [usize] {
    match kind {
        LoadKind::Force { rigid: false, .. } => const { &[D - 1, 0] },
        _ => const { &[D - 1] },
    }
}

/// Return whether a table stands for several bodies, or has lines for several groups.
fn is_plural(table: &BodySpec) -> bool {
    let lines = table.fix.iter().map(|line| &line.on).chain(table.load.iter().map(|line| &line.on));
    let lines = lines.chain(table.spring.iter().map(|line| &line.on)).chain(table.regions.iter().map(|line| &line.on));
    is_pattern(&table.name.value) || lines.into_iter().any(|on| is_open(&on.value))
}

/// Return whether the name of a group is a pattern, or contains the placeholder for the name of the body.
fn is_open(on: &str) -> bool {
    is_pattern(on) || on.contains(BODY)
}

/// Return the pattern of a name of the scene. Its spelling was checked with the scene.
pub fn pattern(name: &Located<String>) -> Result<Pattern<'_>> {
    Pattern::new(&name.value).map_err(|flaw| Error::scene(&name.place, flaw))
}

/// Return the names of the bodies of each table.
pub fn members<'a, const D: usize>(scene: &'a Scene, mesh: &'a Mesh<D>) -> Result<Vec<Vec<&'a str>>> {
    let patterns = scene.bodies.iter().map(|table| pattern(&table.name)).collect::<Result<Vec<_>>>()?;
    let single = (0..patterns.len()).filter(|&table| !patterns[table].is_plural());
    let named: HashMap<&str, usize> = single.map(|table| (scene.bodies[table].name.value.as_str(), table)).collect();
    let plural: Vec<(usize, &Pattern, Rank)> =
        patterns.iter().enumerate().filter(|(_, p)| p.is_plural()).map(|(table, p)| (table, p, p.rank())).collect();
    let mut members = vec![Vec::new(); patterns.len()];
    named.iter().for_each(|(&name, &table)| members[table].push(name));
    let mut unmatched: BTreeSet<usize> = plural.iter().map(|&(table, ..)| table).collect();
    for name in mesh.group_names(D) {
        let matching: Vec<_> = plural.iter().filter(|(_, pattern, _)| pattern.matches(name)).collect();
        unmatched.retain(|table| matching.iter().all(|(own, ..)| own != table));
        let Some(narrowest) = matching.iter().map(|(.., rank)| rank).max().filter(|_| !named.contains_key(name)) else {
            continue;
        };
        let mut best = matching.iter().filter(|(.., rank)| rank == narrowest).map(|&&(table, ..)| table);
        let own = best.next().unwrap_or_default();
        if let Some(other) = best.next() {
            let [own, other] = [own, other].map(|table| &scene.bodies[table].name);
            return Err(tie(name, [&own.value, &other.value], &other.place));
        }
        if let Some([label, help]) = fault(name) {
            let message =
                format!("`{name}`, which `{}` matches, cannot be the name of a body", scene.bodies[own].name.value);
            return Err(Error::scene(&scene.bodies[own].name.place, message).label(label).help(help));
        }
        members[own].push(name);
    }
    match unmatched.first().map(|&table| &scene.bodies[table].name) {
        None => Ok(members),
        Some(name) => {
            let message = format!("no group of cells matches `{}`", name.value);
            let error = Error::scene(&name.place, message).because(format!("mesh {}", mesh.path.display()));
            Err(error.help(format!("its groups of cells: {}", few(mesh.group_names(D)).join(", "))))
        }
    }
}

/// Return the error of two patterns that match a body, or a pair of bodies, equally well.
pub fn tie(what: &str, [first, second]: [&str; 2], place: &Place) -> Error {
    Error::scene(place, format!("`{first}` and `{second}` match `{what}` equally well"))
        .label("this one and an earlier one")
        .help("the name itself wins, then the pattern with more characters of its own: give one of them more")
}

/// Indices of the groups that lie on each body, for the bodies of each table in turn. The list is empty if no table or line
/// stands for many.
pub type Lying = Vec<Vec<u32>>;

/// Return the groups that lie on each body: its own cells, and each group with an element whose corners all belong to the body.
///
/// # Errors
/// A pattern of bodies matches nothing or too much.
pub fn lying<const D: usize>(scene: &Scene, mesh: &Mesh<D>) -> Result<Lying> {
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
    owners.sort_unstable();
    owners.dedup();
    let of = |point: u32| {
        let first = owners.partition_point(|entry| entry.0 < point);
        owners[first..].iter().take_while(move |entry| entry.0 == point).map(|entry| entry.1)
    };
    let mut lying = vec![Vec::new(); names.len()];
    for (place, group) in (0..).zip(mesh.groups.iter()) {
        if let Some(&body) = number.get(group.name.as_str()).filter(|_| group.dimension == D) {
            lying[body].push(place);
            continue;
        }
        let on_all = |corners: &[u32], body: usize| corners.iter().all(|&point| of(point).any(|other| other == body));
        let on = |simplex: &[u32]| {
            let corners = simplex[1..=group.dimension].to_vec();
            of(simplex[0]).filter(move |&body| on_all(&corners, body)).collect::<Vec<_>>()
        };
        let bodies: BTreeSet<usize> = group.simplices().flat_map(on).collect();
        bodies.into_iter().for_each(|body| lying[body].push(place));
    }
    Ok(lying)
}

/// A table with its bodies, and the groups on each of them.
struct Lines<'a, const D: usize> {
    table: &'a BodySpec,
    mesh: &'a Mesh<D>,
    names: &'a [&'a str],
    lying: Vec<Vec<&'a Group>>,
}

impl<const D: usize> Lines<'_, D> {
    /// Return the lines of one key for each body, each with the name of a single group. `kinds` are the dimensions of the groups
    /// on which a line can act.
    fn deal<'k, T: Clone>(
        &self,
        lines: &[T],
        on: fn(&mut T) -> &mut Located<String>,
        what: &str,
        kinds: impl Fn(&T) -> &'k [usize],
    ) -> Result<Vec<Vec<T>>> {
        let mut given = vec![Vec::new(); self.lying.len()];
        for line in lines {
            let name = on(&mut line.clone()).clone();
            if !is_pattern(&self.table.name.value) && !is_open(&name.value) {
                given.iter_mut().for_each(|own| own.push(line.clone()));
                continue;
            }
            let before: usize = given.iter().map(Vec::len).sum();
            for ((own, groups), body) in given.iter_mut().zip(&self.lying).zip(self.names) {
                let wanted = Located::new(name.value.replace(BODY, body), name.place.clone());
                let wanted = pattern(&wanted)?;
                let kinds = kinds(line);
                let fitting =
                    groups.iter().filter(|group| kinds.contains(&group.dimension) && wanted.matches(&group.name));
                own.extend(fitting.map(|group| {
                    let mut line = line.clone();
                    on(&mut line).value.clone_from(&group.name);
                    line
                }));
            }
            let after: usize = given.iter().map(Vec::len).sum();
            if before == after && !given.is_empty() {
                return Err(self.acts_nowhere(&name, what, kinds(line)));
            }
        }
        Ok(given)
    }

    /// Return the error of a line that acts on no body.
    fn acts_nowhere(&self, on: &Located<String>, what: &str, kinds: &[usize]) -> Error {
        if let (false, Err(error)) = (is_open(&on.value), find_group(self.mesh, on, kinds, what)) {
            return error;
        }
        let message = match is_open(&on.value) {
            true => format!("no group for this {what} matches `{}` on `{}`", on.value, self.table.name.value),
            false => format!("`{}` lies on no body of `{}`", on.value, self.table.name.value),
        };
        let mut known: Vec<&str> = self
            .lying
            .iter()
            .flatten()
            .filter(|group| kinds.contains(&group.dimension))
            .map(|group| group.name.as_str())
            .collect();
        known.dedup();
        Error::scene(&on.place, message).help(format!("groups of that kind on these bodies: {}", few(known).join(", ")))
    }
}
