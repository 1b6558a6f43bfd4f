//! The law that a scene asks for, at the points of a pair.

use super::asperities::asperities;
use super::own::{self, OwnLaws};
use super::{Cubic, Exponential, LayerLaw, Linear, PerPoint, Power, Table, Typed};
use crate::error::{Error, Kind, Result, shown};
use crate::expression::Field;
use crate::problem::layer::{LawForm, LawKind, LayerSpec, Parameter};
use std::rc::Rc;

/// Make the law of a layer at the contact points `position`. `laws` are the laws that the program brings, by name.
///
/// A law whose parameters are constant is one object for all points.
///
/// # Errors
/// Parameters out of their range at a point, and expressions or the program's own laws that are not the law of a layer.
pub fn make(spec: &LayerSpec, laws: &OwnLaws, position: &[[f64; 3]]) -> Result<Rc<dyn LayerLaw>> {
    match spec {
        LayerSpec::Form { form, values } => match form.kind {
            LawKind::Linear => formed(form, values, position, |v| Linear { stiffness: v[0] }),
            LawKind::Power => formed(form, values, position, |v| Power::new(v[0], v[1])),
            LawKind::Exponential => formed(form, values, position, |v| Exponential::new(v[0], v[1])),
            LawKind::Cubic => formed(form, values, position, |v| Cubic { k1: v[0], k3: v[1] }),
        },
        LayerSpec::Asperities(spec) => Ok(Rc::new(asperities(spec))),
        LayerSpec::Own(name) => own::make(laws, name, position, extent(position)),
        LayerSpec::Table(points) => Ok(Rc::new(Table::new(points))),
        LayerSpec::Pressure { law, up_to } => {
            let size = extent(position);
            let at = |&x: &[f64; 3]| Typed::new(law, x, *up_to, size);
            match law.uses_only_first() {
                true => Ok(Rc::new(at(&position[0])?)),
                false => Ok(Rc::new(PerPoint(position.iter().map(at).collect::<Result<_>>()?))),
            }
        }
    }
}

/// Make a law of a known form: one for all points, or one a point where a parameter varies.
///
/// # Errors
/// A parameter that is not finite or out of its range at a point.
fn formed<L: LayerLaw + 'static>(
    form: &LawForm,
    values: &[Field],
    position: &[[f64; 3]],
    new: fn(&[f64]) -> L,
) -> Result<Rc<dyn LayerLaw>> {
    let at = |&x: &[f64; 3]| -> Result<L> {
        let parameters = form.parameters.iter().zip(values).map(|(parameter, field)| checked(parameter, field, x));
        Ok(new(&parameters.collect::<Result<Vec<f64>>>()?))
    };
    match values.iter().all(Field::is_constant) {
        true => Ok(Rc::new(at(&[0.0; 3])?)),
        false => Ok(Rc::new(PerPoint(position.iter().map(at).collect::<Result<_>>()?))),
    }
}

/// Return the value of a parameter at a point.
///
/// # Errors
/// A value that is not finite or out of its range.
fn checked(parameter: &Parameter, field: &Field, x: [f64; 3]) -> Result<f64> {
    let value = field.eval_finite(parameter.what, x)?;
    let Some(breach) = parameter.bounds.breach(value) else { return Ok(value) };
    let message = format!("{} is {} at ({}, {}, {})", parameter.what, shown(value), x[0], x[1], x[2]);
    let error = Error::new(Kind::Scene, message);
    Err(match field.place() {
        Some(place) => error.at(place).label(breach),
        None => error.help(breach),
    })
}

/// Return the diagonal of the box around all points. No layer is compressed by more.
fn extent(position: &[[f64; 3]]) -> f64 {
    let spread = |c: usize| {
        let values = position.iter().map(|x| x[c]);
        values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
    };
    let size = (0..3).map(|c| spread(c).powi(2)).sum::<f64>().sqrt();
    if size > 0.0 { size } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::extent;

    #[test]
    fn the_extent_is_a_diagonal() {
        assert_eq!(extent(&[[1.0, -2.0, 5.0], [2.0, 2.0, 5.0], [-2.0, 1.0, 5.0]]), 32f64.sqrt());
        assert_eq!(extent(&[[1.0; 3]]), 1.0);
    }
}
