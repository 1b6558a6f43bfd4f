//! What acts on a body from outside: supports, springs and loads. Each is read from a table of keys, `...Keys`, some of
//! which exclude each other, and written as one.

use super::geometry::{Geometry, Plane};
use super::pattern;
use super::read::{Check, Flaw, OneOrVector, Refused, Vector, geometry, only_one, place, positive};
use crate::error::{Error, Kind, Located, Result as Checked};
use crate::expression::Field;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Prescribed displacement components on a named group (a boundary, or points).
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(try_from = "SupportKeys", into = "SupportKeys")]
pub struct Support {
    /// The physical group.
    pub on: Located<String>,
    /// Prescribed displacement of each component (lengths); `None` leaves the component free.
    pub value: [Option<Field>; 3],
    /// Prescribed displacement along the outer normal of a plane surface (a length).
    pub normal: Option<Field>,
    /// Name of the factor of these displacements in a history.
    pub path: Option<Located<String>>,
    /// Factor of the displacements at the present load step; 1 without load steps.
    pub factor: f64,
}

/// Springs to the ground on a named boundary (per area) or at points.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(try_from = "SpringKeys", into = "SpringKeys")]
pub struct SpringSpec {
    /// The physical group.
    pub on: Located<String>,
    /// The stiffness: stress per length on a boundary, force per length at a point.
    pub kind: SpringKind,
}

/// The stiffness of springs, >= 0.
#[derive(Debug, Clone)]
pub enum SpringKind {
    /// Stiffness along x, y, z.
    Vector([Field; 3]),
    /// Stiffness along the normal of the surface.
    Normal(Field),
}

/// A load on a named boundary.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(try_from = "LoadKeys", into = "LoadKeys")]
pub struct Load {
    /// The physical group.
    pub on: Located<String>,
    /// The pressure, traction or force.
    pub kind: LoadKind,
    /// Name of the factor of this load in a history.
    pub path: Option<Located<String>>,
    /// Factor of the load at the present load step; 1 without load steps.
    pub factor: f64,
}

/// The kinds of load on a boundary.
#[derive(Debug, Clone)]
pub enum LoadKind {
    /// Pressure against the outer normal (a stress); > 0 pushes.
    Pressure(Field),
    /// Traction vector (x, y, z; stresses).
    Traction([Field; 3]),
    /// Force on the whole boundary.
    Force {
        /// The force (x, y, z).
        total: [f64; 3],
        /// Whether all nodes of the boundary have one displacement. Otherwise the force is spread evenly.
        rigid: bool,
    },
    /// Moment about the centre of the boundary (x, y, z; force times length), by tractions that are linear in the
    /// place. In the plane the first two components are zero.
    Moment([f64; 3]),
    /// Force and moment on a boundary that moves and turns as a rigid body.
    Turning {
        /// Force that acts at the centre of the boundary (x, y, z).
        force: [f64; 3],
        /// Moment about the centre (x, y, z; force times length). In the plane the first two components are zero.
        moment: [f64; 3],
    },
}

impl Support {
    /// Return whether it prescribes a displacement that is not zero.
    pub fn is_moved(&self) -> bool {
        self.value.iter().flatten().chain(&self.normal).any(|field| !field.is_zero())
    }
}

/// A support.
#[derive(Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SupportKeys {
    /// boundary or points, or a pattern of such
    on: Located<String>,
    /// displacement along x
    x: Option<Located<Field>>,
    /// displacement along y
    y: Option<Located<Field>>,
    /// displacement along z, in space
    z: Option<Located<Field>>,
    /// displacement along the outer normal of a plane surface
    normal: Option<Located<Field>>,
    /// whether a plane surface slides in its plane: normal = 0
    symmetry: Option<Located<bool>>,
    /// column of the table of load steps with its factor
    path: Option<Located<String>>,
}

impl TryFrom<SupportKeys> for Support {
    type Error = Refused;

    fn try_from(keys: SupportKeys) -> Result<Self, Refused> {
        let SupportKeys { on, x, y, z, normal, symmetry, path } = keys;
        pattern::check(&on)?;
        let along = [("normal", place(&normal)), ("symmetry", place(&symmetry))];
        for axis in [("x", place(&x)), ("y", place(&y)), ("z", place(&z))] {
            only_one("a support", &[axis, along[0], along[1]])?;
        }
        only_one("a support", &along)?;
        if let Some(symmetry) = symmetry.as_ref().filter(|symmetry| !symmetry.value) {
            return Err(Error::scene(&symmetry.place, "`symmetry = false` holds nothing")
                .help("remove this support")
                .into());
        }
        let normal = normal.map(|normal| normal.value).or(symmetry.map(|_| Field::Constant(0.0)));
        Ok(Self { on, value: [x, y, z].map(|value| value.map(|value| value.value)), normal, path, factor: 1.0 })
    }
}

impl From<Support> for SupportKeys {
    fn from(Support { on, value, normal, path, factor: _ }: Support) -> Self {
        let given = |value: Option<Field>| value.map(Located::from);
        let [x, y, z] = value.map(given);
        Self { on, x, y, z, normal: given(normal), symmetry: None, path }
    }
}

impl Check for Support {
    fn check(&self, geometry: Geometry) -> Result<(), Flaw> {
        let components = self.value.iter().flatten().count();
        if components > 0 && self.normal.is_some() {
            return Err(Flaw::new("", "a support holds some components, or the normal alone", "", ""));
        }
        if geometry.is_plane() && self.value[2].is_some() {
            let help = "remove it, or set dimension = 3";
            return Err(Flaw::new("z", "a support in `z` in a plane problem", "there is no z", help));
        }
        if components == 0 && self.normal.is_none() {
            let axes = if geometry.is_plane() { "x, y" } else { "x, y, z" };
            let help = format!("give the displacement in some of {axes}: x = 0; or symmetry = true");
            return Err(Flaw::new("", format!("the support on `{}` holds no component", self.on.value), "", &help));
        }
        Ok(())
    }
}

/// A spring.
#[derive(Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SpringKeys {
    /// boundary (stiffness per area) or points
    on: Located<String>,
    /// stiffness, one for all or one for each component
    stiffness: Option<Located<OneOrVector>>,
    /// stiffness along the normal alone
    normal: Option<Located<Field>>,
}

impl TryFrom<SpringKeys> for SpringSpec {
    type Error = Refused;

    fn try_from(SpringKeys { on, stiffness, normal }: SpringKeys) -> Result<Self, Refused> {
        pattern::check(&on)?;
        only_one("a spring", &[("stiffness", place(&stiffness)), ("normal", place(&normal))])?;
        let kind = match (stiffness.map(|stiffness| stiffness.value), normal) {
            (Some(OneOrVector::Vector(vector)), _) => SpringKind::Vector(vector.0),
            (Some(OneOrVector::One(field)), _) => SpringKind::Vector([field.clone(), field.clone(), field]),
            (None, Some(normal)) => SpringKind::Normal(normal.value),
            (None, None) => {
                return Err(Error::scene(&on.place, format!("the spring on `{}` has no stiffness", on.value))
                    .help("give stiffness = k, one for each component, or normal = k along the normal alone")
                    .into());
            }
        };
        Ok(Self { on, kind })
    }
}

impl From<SpringSpec> for SpringKeys {
    fn from(SpringSpec { on, kind }: SpringSpec) -> Self {
        match kind {
            SpringKind::Vector(fields) => {
                let stiffness = Some(OneOrVector::Vector(Vector(fields)).into());
                Self { on, stiffness, normal: None }
            }
            SpringKind::Normal(field) => Self { on, stiffness: None, normal: Some(field.into()) },
        }
    }
}

impl Check for SpringSpec {
    fn check(&self, _: Geometry) -> Result<(), Flaw> {
        // expressions are checked where they are evaluated; here they count as > 0
        let constant = |field: &Field| if let Field::Constant(value) = field { *value } else { f64::MIN_POSITIVE };
        match &self.kind {
            SpringKind::Normal(k) => positive("normal", "the stiffness", constant(k)),
            SpringKind::Vector(all) if all.iter().all(Field::is_zero) => {
                let label = "some component must be greater than 0";
                Err(Flaw::new("stiffness", "the spring has no stiffness", label, ""))
            }
            SpringKind::Vector(all) => {
                let mut negative = all.iter().map(constant).filter(|value| *value < 0.0 || value.is_nan());
                negative.try_for_each(|value| positive("stiffness", "the stiffness", value))
            }
        }
    }
}

/// A load.
#[derive(Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct LoadKeys {
    /// boundary, or a pattern of such
    on: Located<String>,
    /// pressure against the outer normal
    pressure: Option<Located<Field>>,
    /// force per area, one for each component
    traction: Option<Located<Vector>>,
    /// total force on the whole boundary, numbers: [FX, FY], in space [FX, FY, FZ]
    force: Option<Located<Vector>>,
    /// moment about the centre of the boundary, a number: M, in space [MX, MY, MZ]
    moment: Option<Located<OneOrVector>>,
    /// whether the boundary moves as a rigid body under the force, without a turn, or with a turn under a moment; false
    rigid: Option<Located<bool>>,
    /// column of the table of load steps with its factor
    path: Option<Located<String>>,
}

impl TryFrom<LoadKeys> for Load {
    type Error = Refused;

    fn try_from(keys: LoadKeys) -> Result<Self, Refused> {
        let LoadKeys { on, pressure, traction, force, moment, rigid, path } = keys;
        pattern::check(&on)?;
        let given = [
            ("pressure", place(&pressure)),
            ("traction", place(&traction)),
            ("force", place(&force)),
            ("moment", place(&moment)),
        ];
        only_one("a load", &given[..3])?;
        only_one("a load", &[given[0], given[1], given[3]])?;
        if let (Some(rigid), None, None) = (&rigid, &force, &moment) {
            return Err(Error::scene(&rigid.place, "`rigid` without a force or a moment")
                .help("a rigid surface moves as one under a total force: force = [0, -10], rigid = true")
                .into());
        }
        let rigid = rigid.is_some_and(|rigid| rigid.value);
        let total = |force: Located<Vector>| force.numbers().map_err(|error| error.or_at(&force.place));
        let kind = match (pressure, traction, force, moment) {
            (Some(pressure), ..) => LoadKind::Pressure(pressure.value),
            (_, Some(traction), ..) => LoadKind::Traction(traction.value.0),
            (.., force, Some(moment)) if rigid => {
                LoadKind::Turning { force: force.map_or(Ok([0.0; 3]), total)?, moment: moment_of(moment)? }
            }
            (.., Some(_), Some(moment)) => {
                return Err(Error::scene(&moment.place, "a load has both `force` and `moment`")
                    .help("give two loads, or rigid = true for a surface that moves and turns as a rigid body")
                    .into());
            }
            (.., Some(force), None) => LoadKind::Force { total: total(force)?, rigid },
            (.., None, Some(moment)) => LoadKind::Moment(moment_of(moment)?),
            (None, None, None, None) => {
                let components = ["tx", "ty", "tz"][..geometry().dimension].join(", ");
                let help = format!("give pressure = p, traction = [{components}], or a total force = [...] or moment");
                let message = format!("the load on `{}` has no component", on.value);
                return Err(Error::scene(&on.place, message).help(help).into());
            }
        };
        Ok(Load { on, kind, path, factor: 1.0 })
    }
}

impl From<Load> for LoadKeys {
    fn from(Load { on, kind, path, factor: _ }: Load) -> Self {
        let keys = LoadKeys { on, pressure: None, traction: None, force: None, moment: None, rigid: None, path };
        let total = |force: [f64; 3]| Some(Located::from(Vector::from(force)));
        let about = |moment: [f64; 3]| Some(Located::from(echo_of(moment.map(Field::Constant))));
        match kind {
            LoadKind::Pressure(pressure) => Self { pressure: Some(pressure.into()), ..keys },
            LoadKind::Traction(traction) => Self { traction: Some(Vector(traction).into()), ..keys },
            LoadKind::Moment(moment) => Self { moment: about(moment), ..keys },
            LoadKind::Turning { force, moment } => {
                Self { force: total(force), moment: about(moment), rigid: Some(true.into()), ..keys }
            }
            LoadKind::Force { total: force, rigid } => Self { force: total(force), rigid: Some(rigid.into()), ..keys },
        }
    }
}

impl Check for Load {
    fn check(&self, geometry: Geometry) -> Result<(), Flaw> {
        let acts_along_z = match &self.kind {
            LoadKind::Pressure(_) | LoadKind::Moment(_) => false,
            LoadKind::Traction(traction) => !traction[2].is_zero(),
            LoadKind::Force { total, .. } | LoadKind::Turning { force: total, .. } => total[2] != 0.0,
        };
        if geometry.is_plane() && acts_along_z {
            return Err(Flaw::new("", "a load in z in a plane problem", "", ""));
        }
        if let LoadKind::Moment(moment) | LoadKind::Turning { moment, .. } = self.kind {
            check_moment(moment, geometry)?;
        }
        let (LoadKind::Force { total, .. } | LoadKind::Turning { force: total, .. }) = self.kind else { return Ok(()) };
        if total.iter().any(|force| !force.is_finite()) {
            return Err(Flaw::new("force", format!("the force is {total:?}"), "", ""));
        }
        if geometry.plane == Plane::Axisymmetric && total[0] != 0.0 {
            return Err(Flaw::new(
                "force",
                "a total force across the axis in an axisymmetric scene",
                "radial forces cancel all around: the first component must be 0",
                "for a radial load give pressure = p or traction = [tr, ta]",
            ));
        }
        Ok(())
    }
}

fn check_moment(moment: [f64; 3], geometry: Geometry) -> Result<(), Flaw> {
    let refuse = |message: &str, label: &str, help: &str| Err(Flaw::new("moment", message, label, help));
    if moment.iter().any(|component| !component.is_finite()) {
        return refuse(&format!("the moment is {moment:?}"), "", "");
    }
    if geometry.is_plane() && [moment[0], moment[1]] != [0.0; 2] {
        return refuse("a moment about an axis in the plane", "bodies in the plane turn about z", "");
    }
    if geometry.plane == Plane::Axisymmetric {
        let help = "bodies of revolution do not bend; give a traction along the axis that depends on the radius";
        return refuse("a moment in an axisymmetric scene", "", help);
    }
    Ok(())
}

/// Return a moment (x, y, z) of numbers: see [`axial_of`].
fn moment_of(moment: Located<OneOrVector>) -> Checked<[f64; 3]> {
    let place = moment.place.clone();
    Vector::from(axial_of(moment)?).numbers().map_err(|error| error.or_at(&place))
}

/// Return a moment or a rotation (x, y, z): a number in the plane, a vector in space.
pub(super) fn axial_of(moment: Located<OneOrVector>) -> Checked<[Field; 3]> {
    let zero = || Field::Constant(0.0);
    let fields = match (moment.value, geometry().is_plane()) {
        (OneOrVector::One(about_z), true) => Ok([zero(), zero(), about_z]),
        (OneOrVector::Vector(vector), false) => Ok(vector.0),
        (_, true) => Err(Error::new(Kind::Scene, "a moment is a number in the plane").help("moment = M, about z")),
        (_, false) => Err(Error::new(Kind::Scene, "a moment is a vector in space").help("moment = [MX, MY, MZ]")),
    };
    fields.map_err(|error| error.or_at(&moment.place))
}

/// Return a moment as [`moment_of`] reads it.
pub(super) fn echo_of(moment: [Field; 3]) -> OneOrVector {
    match (geometry().is_plane(), moment) {
        (true, [_, _, about_z]) => OneOrVector::One(about_z),
        (false, moment) => OneOrVector::Vector(moment.into()),
    }
}
