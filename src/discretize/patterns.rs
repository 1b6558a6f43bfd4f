//! The groups of the mesh that a scene means: the single bodies of its tables, and the groups on which their lines act. Tables, and the
//! lines in them, may stand for many bodies by patterns of names; the last table that matches counts. Errors point into the scene.

use crate::error::{Error, Located, Result, few};
use crate::expression::Field;
use crate::mesh::{Group, Mesh};
use crate::problem::body::{BodySpec, LoadKind, fault, plain, plain_pattern};
use crate::problem::pattern::{BODY, Pattern, is_pattern};
use crate::scene::Scene;
use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};

/// Return the mesh group of this name if its dimension is one of `dimensions`. `what` says in an error what the group is for.
///
/// # Errors
/// The mesh has no such group.
pub fn find_group<'m, const D: usize>(
    mesh: &'m Mesh<D>,
    name: &Located<String>,
    dimensions: &[usize],
    what: &str,
) -> Result<&'m Group> {
    let named = mesh.group(&name.value);
    if let Some(group) = named.filter(|group| dimensions.contains(&group.dimension)) {
        return Ok(group);
    }
    let of = |dimension: usize| mesh.groups.iter().filter(move |group| group.dimension == dimension);
    let known = || dimensions.iter().flat_map(|&d| of(d)).map(|group| group.name.as_str());
    let kind = |dimension: usize| match (D - dimension, dimension) {
        (0, _) => "group of cells",
        (_, 0) => "group of points",
        (_, 1) => "curve",
        _ => "surface",
    };
    let wanted = if let [one] = dimensions { kind(*one) } else { "group" };
    let error = Error::scene(&name.place, format!("the mesh has no {wanted} `{}` for this {what}", name.value))
        .because(format!("mesh {}", mesh.path.display()));
    if let Some(other) = named {
        return Err(error.help(format!("`{}` is a {} there", name.value, kind(other.dimension))));
    }
    Err(error.suggest(&name.value, known(), || match few(known()) {
        none if none.is_empty() => format!("the mesh has no {wanted} at all"),
        names => format!("it has: {}", names.join(", ")),
    }))
}

/// Return the error of a support or load on a group of another body.
pub fn not_on_body(on: &Located<String>, body: &str) -> Error {
    Error::scene(&on.place, format!("`{}` does not touch body `{body}`", on.value))
        .help("a support or load acts on a physical group of its own body")
}

/// Return the error of a load or spring on the axis of a body of revolution.
pub fn without_area(on: &Located<String>, spec: &BodySpec) -> Error {
    Error::scene(&on.place, format!("body `{}`: `{}` lies on the axis and has no area", spec.name.value, on.value))
        .help("remove this line: per area nothing acts there")
}

/// Return a sentence with the place of the earlier support or load that conflicts with a refused one.
pub fn earlier(on: &Located<String>) -> String {
    let text = &on.place.source.text[..on.place.span.start];
    format!("the earlier one is on `{}`, line {} of {}", on.value, 1 + text.matches('\n').count(), on.place.source.name)
}

/// The values of fields at many points, with the first error. It is returned after all points are evaluated.
pub struct FieldValues<'a> {
    what: &'static str,
    body: &'a str,
    refused: RefCell<Option<Error>>,
}

impl<'a> FieldValues<'a> {
    /// Make an evaluator of the quantity `what` of a body, both in words for the error.
    pub fn of(what: &'static str, body: &'a str) -> Self {
        Self { what, body, refused: RefCell::new(None) }
    }

    /// Return the value of a field at a point of the scene, or zero where the field has none.
    pub fn at(&self, field: &Field, x: [f64; 3]) -> f64 {
        self.checked(field, x, |_| Ok(()))
    }

    /// Return the value of a field at a point of the scene, or zero where it has none or `check` refuses it.
    pub fn checked(&self, field: &Field, x: [f64; 3], check: impl Fn(f64) -> Result<()>) -> f64 {
        let value = field.eval_finite(self.what, x).and_then(|value| check(value).map(|()| value));
        value.unwrap_or_else(|error| {
            self.refused.borrow_mut().get_or_insert_with(|| error.because(of_body(self.body)));
            0.0
        })
    }

    /// Return the first error, if any.
    ///
    /// # Errors
    /// A value does not exist. The first one is reported, with its expression and the point.
    pub fn refused(self) -> Result<()> {
        self.refused.into_inner().map_or(Ok(()), Err)
    }
}

/// Return the reason that names the body in an error at an expression. The table of the expression may be for many bodies.
pub fn of_body(name: &str) -> String {
    format!("it is for body `{name}`")
}

/// Return the text of a point.
pub fn point(x: [f64; 3]) -> String {
    format!("({}, {}, {})", x[0], x[1], x[2])
}

/// Return the bodies of a scene, table by table. The bodies of a pattern are in the order of the mesh.
///
/// A body that several tables match belongs to the last of these. A line on groups named by a pattern acts on all groups that
/// match and lie on the body. In a table of a pattern, every line acts on those bodies on which its group lies.
///
/// # Errors
/// A table has no body, a group cannot name a body, or a total force acts on several surfaces.
pub fn bodies<const D: usize>(scene: &Scene, mesh: &Mesh<D>, lying: &Lying) -> Result<Vec<BodySpec>> {
    if !scene.bodies.iter().any(is_plural) {
        return Ok(scene.bodies.clone());
    }
    let members = members(scene, mesh)?;
    let mut lying = lying.iter().map(|groups| groups.iter().map(|&group| &mesh.groups[group as usize]).collect());
    let mut bodies = Vec::new();
    for (table, names) in scene.bodies.iter().zip(&members) {
        let lines = PatternTable { table, mesh, names, lying: lying.by_ref().take(names.len()).collect() };
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
            if matches!(line.kind, LoadKind::Force { .. } | LoadKind::Moment(_) | LoadKind::Turning { .. })
                && places > 1
                && !own
            {
                let message = format!(
                    "a total force or moment on {places} surfaces: `{}` of `{}`",
                    line.on.value, table.name.value
                );
                return Err(Error::scene(&line.on.place, message).help(format!(
                    "give a pressure or a traction; or, for a force on each body, the group of each: on = \"{BODY}_top\""
                )));
            }
        }
        let first = bodies.len();
        bodies.extend(names.iter().zip(regions).map(|(name, regions)| {
            let name = Located::new((*name).to_owned(), table.name.place.clone());
            BodySpec { name, regions, ..table.clone() }
        }));
        let new = &mut bodies[first..];
        new.iter_mut().zip(fix).for_each(|(body, fix)| body.fix = fix);
        new.iter_mut().zip(load).for_each(|(body, load)| body.load = load);
        new.iter_mut().zip(spring).for_each(|(body, spring)| body.spring = spring);
    }
    Ok(bodies)
}

/// Return whether a table stands for many bodies: its name is a pattern, or it splits groups into their connected parts.
fn is_for_many(table: &BodySpec) -> bool {
    is_pattern(&table.name.value) || table.split
}

/// Return the dimensions of groups on which a load can act. A total force acts on points, too.
pub fn load_dimensions<const D: usize>(kind: &LoadKind) -> &'static [usize] {
    match kind {
        LoadKind::Force { rigid: false, .. } => const { &[D - 1, 0] },
        _ => const { &[D - 1] },
    }
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

/// Return the last table of the scene that matches a group of cells by its name, where `whole` is the group of which it is a connected
/// part. A table that splits groups stands for the parts of the groups that it matches.
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

/// The bodies of every point of the mesh: (point, body), sorted.
pub struct Owners(Vec<(u32, usize)>);

impl Owners {
    /// Sort the bodies of points.
    pub fn new(mut all: Vec<(u32, usize)>) -> Self {
        all.sort_unstable();
        all.dedup();
        Self(all)
    }

    /// Return the bodies of a point.
    pub fn of(&self, point: u32) -> impl Iterator<Item = usize> {
        let first = self.0.partition_point(|entry| entry.0 < point);
        self.0[first..].iter().take_while(move |entry| entry.0 == point).map(|entry| entry.1)
    }
}

/// Return the names of the groups that a name or pattern of the scene means. If none has such a name, those with the same plain
/// form count.
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

/// A table with its bodies, and the groups on each of them.
struct PatternTable<'a, const D: usize> {
    table: &'a BodySpec,
    mesh: &'a Mesh<D>,
    names: &'a [&'a str],
    lying: Vec<Vec<&'a Group>>,
}

impl<const D: usize> PatternTable<'_, D> {
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
            if !is_for_many(self.table) && !is_open(&name.value) {
                given.iter_mut().for_each(|own| own.push(line.clone()));
                continue;
            }
            let before: usize = given.iter().map(Vec::len).sum();
            for ((own, groups), body) in given.iter_mut().zip(&self.lying).zip(self.names) {
                let wanted = Located::new(name.value.replace(BODY, body), name.place.clone());
                let of_kind = groups.iter().filter(|group| kinds(line).contains(&group.dimension));
                own.extend(called(&wanted, of_kind)?.into_iter().map(|group| {
                    let mut line = line.clone();
                    on(&mut line).value.clone_from(group);
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
