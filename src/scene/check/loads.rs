//! What supports, springs and loads of a body must satisfy.

use super::super::Scene;
use super::{At, Checked};
use crate::expression::Field;
use crate::problem::{BodySpec, Load, LoadKind, Plane, SpringKind, SpringSpec, Support};

impl Scene {
    /// Check all lines of a body with supports, springs and loads.
    pub(super) fn check_lines(&self, at: &At, body: &BodySpec) -> Checked {
        for (number, support) in body.fix.iter().enumerate() {
            self.check_support(&at.item("fix", number, &support.on.place), support)?;
        }
        for (number, spring) in body.spring.iter().enumerate() {
            check_spring(&at.item("spring", number, &spring.on.place), spring)?;
        }
        for (number, load) in body.load.iter().enumerate() {
            self.check_load(&at.item("load", number, &load.on.place), load)?;
        }
        Ok(())
    }

    fn check_support(&self, at: &At, support: &Support) -> Checked {
        let components = support.value.iter().flatten().count();
        if components > 0 && support.normal.is_some() {
            return at.refuse("a support holds some components, or the normal alone", "", "");
        }
        if self.is_plane() && support.value[2].is_some() {
            let help = "remove it, or set dimension = 3";
            return at.below("z").refuse("a support in `z` in a plane problem", "there is no z", help);
        }
        if components == 0 && support.normal.is_none() {
            let axes = if self.is_plane() { "x, y" } else { "x, y, z" };
            let help = format!("give the displacement in some of {axes}: x = 0; or symmetry = true");
            return at.refuse(format!("the support on `{}` holds no component", support.on.value), "", &help);
        }
        Ok(())
    }

    fn check_load(&self, at: &At, load: &Load) -> Checked {
        let acts_along_z = match &load.kind {
            LoadKind::Pressure(_) | LoadKind::Moment(_) => false,
            LoadKind::Traction(traction) => !traction[2].is_zero(),
            LoadKind::Force { total, .. } | LoadKind::Turning { force: total, .. } => total[2] != 0.0,
        };
        if self.is_plane() && acts_along_z {
            return at.refuse("a load in z in a plane problem", "", "");
        }
        if let LoadKind::Moment(moment) | LoadKind::Turning { moment, .. } = load.kind {
            self.check_moment(&at.below("moment"), moment)?;
        }
        let (LoadKind::Force { total, .. } | LoadKind::Turning { force: total, .. }) = load.kind else { return Ok(()) };
        if total.iter().any(|force| !force.is_finite()) {
            return at.below("force").refuse(format!("the force is {total:?}"), "", "");
        }
        if self.plane == Plane::Axisymmetric && total[0] != 0.0 {
            return at.below("force").refuse(
                "a total force across the axis in an axisymmetric scene",
                "radial forces cancel all around: the first component must be 0",
                "for a radial load give pressure = p or traction = [tr, ta]",
            );
        }
        Ok(())
    }

    fn check_moment(&self, at: &At, moment: [f64; 3]) -> Checked {
        if moment.iter().any(|component| !component.is_finite()) {
            return at.refuse(format!("the moment is {moment:?}"), "", "");
        }
        if self.is_plane() && [moment[0], moment[1]] != [0.0; 2] {
            return at.refuse("a moment about an axis in the plane", "bodies in the plane turn about z", "");
        }
        if self.plane == Plane::Axisymmetric {
            let help = "bodies of revolution do not bend; give a traction along the axis that depends on the radius";
            return at.refuse("a moment in an axisymmetric scene", "", help);
        }
        Ok(())
    }
}

fn check_spring(at: &At, spring: &SpringSpec) -> Checked {
    // expressions are checked where they are evaluated; here they count as > 0
    let constant = |field: &Field| if let Field::Constant(value) = field { *value } else { f64::MIN_POSITIVE };
    match &spring.kind {
        SpringKind::Normal(k) => at.positive_in("normal", "the stiffness", constant(k)),
        SpringKind::Vector(all) if all.iter().all(Field::is_zero) => {
            let label = "some component must be greater than 0";
            at.below("stiffness").refuse("the spring has no stiffness", label, "")
        }
        SpringKind::Vector(all) => {
            let mut negative = all.iter().map(constant).filter(|value| *value < 0.0 || value.is_nan());
            negative.try_for_each(|value| at.positive_in("stiffness", "the stiffness", value))
        }
    }
}
