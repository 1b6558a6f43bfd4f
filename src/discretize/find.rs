//! Mesh groups by name, and errors that point into the scene.

use crate::error::{Error, Located, Result, few};
use crate::expression::Field;
use crate::mesh::{Group, Mesh};
use crate::problem::body::BodySpec;
use std::cell::RefCell;

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
pub struct Values<'a> {
    what: &'static str,
    body: &'a str,
    refused: RefCell<Option<Error>>,
}

impl<'a> Values<'a> {
    /// Make an evaluator of the quantity `what` of a body, both in words for the error.
    pub fn of(what: &'static str, body: &'a str) -> Self {
        Self { what, body, refused: RefCell::new(None) }
    }

    /// Return the value of a field at a point of the scene, or zero where the field has none.
    pub fn at(&self, field: &Field, x: [f64; 3]) -> f64 {
        field.eval_finite(self.what, x).unwrap_or_else(|error| {
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
