//! The groups of the mesh on which the lines of a body's table act, and the values of fields there. Errors point into
//! the scene.

use crate::error::{Error, Located, Result, few};
use crate::expression::Field;
use crate::mesh::{Group, Mesh};
use crate::problem::RegionSpec;
use crate::problem::{BodySpec, Load, LoadKind, SpringSpec, Support};
use std::cell::RefCell;

/// A line of a body's table that acts on a group of the mesh.
pub trait Line: Clone {
    /// What the line is, in errors.
    const WHAT: &'static str;

    /// Return the lines of this kind of a body.
    fn of(body: &mut BodySpec) -> &mut Vec<Self>;

    /// Return the name of the group.
    fn on(&self) -> &Located<String>;

    /// Return the line for the group `name`.
    fn on_group(&self, name: &str) -> Self;

    /// Return the dimensions of groups on which the line can act.
    fn dimensions<const D: usize>(&self) -> &'static [usize];

    /// Return the group of the mesh.
    ///
    /// # Errors
    /// The mesh has no such group.
    fn group<'m, const D: usize>(&self, mesh: &'m Mesh<D>) -> Result<&'m Group> {
        find_group(mesh, self.on(), self.dimensions::<D>(), Self::WHAT)
    }
}

/// Implement [`Line`] for a type with the field `on`, whose lines are in this field of a body and act on groups of
/// these dimensions.
macro_rules! line {
    ($type:ty, $what:literal, $field:ident, |$line:ident, $dimension:ident| $dimensions:expr) => {
        impl Line for $type {
            const WHAT: &'static str = $what;

            fn of(body: &mut BodySpec) -> &mut Vec<Self> {
                &mut body.$field
            }

            fn on(&self) -> &Located<String> {
                &self.on
            }

            fn on_group(&self, name: &str) -> Self {
                let mut line = self.clone();
                line.on.value = name.to_owned();
                line
            }

            fn dimensions<const $dimension: usize>(&self) -> &'static [usize] {
                let $line = self;
                $dimensions
            }
        }
    };
}

line!(RegionSpec, "region", regions, |_region, D| const { &[D] });
line!(SpringSpec, "spring", spring, |_spring, D| const { &[D - 1, 0] });
line!(Support, "support", fix, |support, D| match support.along_normal() {
    Some(_) => const { &[D - 1] },
    None => &[3, 2, 1, 0][3 - D..],
});
line!(Load, "load", load, |load, D| match load.kind {
    LoadKind::Force { rigid: false, .. } => const { &[D - 1, 0] },
    _ => const { &[D - 1] },
});

/// Return the mesh group of this name if its dimension is one of `dimensions`. `what` says in an error what the group
/// is for.
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

/// Return the reason that names the body in an error at an expression. The table of the expression may be for many
/// bodies.
pub fn of_body(name: &str) -> String {
    format!("it is for body `{name}`")
}

/// Return the text of a point.
pub fn point(x: [f64; 3]) -> String {
    format!("({}, {}, {})", x[0], x[1], x[2])
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
