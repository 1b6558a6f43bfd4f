//! What acts on a body from outside: supports, springs and loads.

use super::check::{Check, Fault, positive};
use super::compile::{Compile, Names, compile};
use super::geometry::{Geometry, Plane};
use super::pattern;
use super::read::{OneOrVector, Refusal, Vector, check_numbers, only_one, place};
use crate::error::{Error, Located, Result as Checked};
use crate::expression::Field;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Prescribed displacements on a named group (a boundary, or points), of components or along the normal.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// boundary or points, or a pattern of such
    pub on: Located<String>,
    /// displacement along x
    pub x: Option<Located<Field>>,
    /// displacement along y
    pub y: Option<Located<Field>>,
    /// displacement along z, in space
    pub z: Option<Located<Field>>,
    /// displacement along the outer normal of a plane surface
    pub normal: Option<Located<Field>>,
    /// whether a plane surface slides in its plane: normal = 0
    pub symmetry: Option<Located<bool>>,
    /// column of the table of load steps with its factor
    pub path: Option<Located<String>>,
    /// Factor of the displacements at the present load step; 1 without load steps.
    #[serde(skip, default = "one")]
    pub factor: f64,
}

/// Return the factor of loads without load steps.
pub(super) fn one() -> f64 {
    1.0
}

compile!(Support { on, x, y, z, normal, symmetry, path } else { factor });

/// Springs to the ground on a named boundary (stiffness: stress per length) or at points (force per length).
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpringSpec {
    /// boundary (stiffness per area) or points
    pub on: Located<String>,
    /// stiffness, one for all or one for each component
    pub stiffness: Option<Located<OneOrVector>>,
    /// stiffness along the normal alone
    pub normal: Option<Located<Field>>,
}

compile!(SpringSpec { on, stiffness, normal } else {});

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
    Traction(Vector),
    /// Force on the whole boundary.
    Force {
        /// The force (x, y, z), numbers.
        total: Vector,
        /// Whether all nodes of the boundary have one displacement. Otherwise the force is spread evenly.
        rigid: bool,
    },
    /// Moment about the centre of the boundary (x, y, z; force times length), by tractions that are linear in the
    /// place: numbers. In the plane the first two components are zero.
    Moment(OneOrVector),
    /// Force and moment on a boundary that moves and turns as a rigid body.
    Turning {
        /// Force that acts at the centre of the boundary (x, y, z), numbers.
        force: Vector,
        /// Moment about the centre (x, y, z; force times length), numbers. In the plane the first two components are
        /// zero.
        moment: OneOrVector,
    },
}

impl Support {
    /// Return the prescribed displacement of each component (lengths); `None` leaves the component free.
    pub fn components(&self) -> [Option<&Field>; 3] {
        [&self.x, &self.y, &self.z].map(|value| value.as_deref())
    }

    /// Return the prescribed displacement along the outer normal of a plane surface (a length).
    pub fn along_normal(&self) -> Option<&Field> {
        const NONE: &Field = &Field::Constant(0.0);
        self.normal.as_deref().or(self.symmetry.as_ref().map(|_| NONE))
    }

    /// Return whether it prescribes a displacement that is not zero.
    pub fn is_moved(&self) -> bool {
        self.components().into_iter().flatten().chain(self.along_normal()).any(|field| !field.is_zero())
    }
}

impl Check for Support {
    fn check(&self, geometry: Geometry) -> Result<(), Fault> {
        let Self { on, x, y, z, normal, symmetry, .. } = self;
        pattern::check(on)?;
        let along = [("normal", place(normal)), ("symmetry", place(symmetry))];
        for axis in [("x", place(x)), ("y", place(y)), ("z", place(z))] {
            only_one("a support", &[axis, along[0], along[1]])?;
        }
        only_one("a support", &along)?;
        if symmetry.as_ref().is_some_and(|symmetry| !symmetry.value) {
            return Err(Fault::new("symmetry", "`symmetry = false` holds nothing", "", "remove this support"));
        }
        if geometry.is_plane() && z.is_some() {
            let help = "remove it, or set dimension = 3";
            return Err(Fault::new("z", "a support in `z` in a plane problem", "there is no z", help));
        }
        if self.components().into_iter().chain([self.along_normal()]).all(|value| value.is_none()) {
            let axes = if geometry.is_plane() { "x, y" } else { "x, y, z" };
            let help = format!("give the displacement in some of {axes}: x = 0; or symmetry = true");
            return Err(Fault::new("", format!("the support on `{}` holds no component", on.value), "", &help));
        }
        Ok(())
    }
}

impl Check for SpringSpec {
    fn check(&self, geometry: Geometry) -> Result<(), Fault> {
        let Self { on, stiffness, normal } = self;
        pattern::check(on)?;
        only_one("a spring", &[("stiffness", place(stiffness)), ("normal", place(normal))])?;
        // expressions are checked where they are evaluated; here they count as > 0
        let constant = |field: &Field| if let Field::Constant(value) = field { *value } else { f64::MIN_POSITIVE };
        match (stiffness.as_deref(), normal.as_deref()) {
            (None, None) => Err(Error::scene(&on.place, format!("the spring on `{}` has no stiffness", on.value))
                .help("give stiffness = k, one for each component, or normal = k along the normal alone")
                .into()),
            (None, Some(normal)) => positive("normal", "the stiffness", constant(normal)),
            (Some(all), _) => {
                if let OneOrVector::Vector(vector) = all {
                    vector.check("stiffness", geometry)?;
                }
                if all.fields().iter().all(Field::is_zero) {
                    let label = "some component must be greater than 0";
                    return Err(Fault::new("stiffness", "the spring has no stiffness", label, ""));
                }
                let mut negative = all.fields().iter().map(constant).filter(|value| *value < 0.0 || value.is_nan());
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

compile!(Load { on, kind, path } else { factor });

impl Compile for LoadKind {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        match self {
            Self::Pressure(pressure) => pressure.compile(names),
            Self::Traction(vector) | Self::Force { total: vector, .. } => vector.compile(names),
            Self::Moment(moment) => moment.compile(names),
            Self::Turning { force, moment } => force.compile(names).and_then(|()| moment.compile(names)),
        }
    }
}

impl TryFrom<LoadKeys> for Load {
    type Error = Refusal;

    fn try_from(keys: LoadKeys) -> Result<Self, Refusal> {
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
        let kind = match (pressure, traction, force, moment) {
            (Some(pressure), ..) => LoadKind::Pressure(pressure.value),
            (_, Some(traction), ..) => LoadKind::Traction(traction.value),
            (.., force, Some(moment)) if rigid => {
                let force = force.map_or_else(|| [0.0; 3].into(), |force| force.value);
                LoadKind::Turning { force, moment: moment.value }
            }
            (.., Some(_), Some(moment)) => {
                return Err(Error::scene(&moment.place, "a load has both `force` and `moment`")
                    .help("give two loads, or rigid = true for a surface that moves and turns as a rigid body")
                    .into());
            }
            (.., Some(force), None) => LoadKind::Force { total: force.value, rigid },
            (.., None, Some(moment)) => LoadKind::Moment(moment.value),
            (None, None, None, None) => {
                let help = "give pressure = p, traction = [tx, ty], in space [tx, ty, tz], or a total force = [...] or \
                            moment";
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
        match kind {
            LoadKind::Pressure(pressure) => Self { pressure: Some(pressure.into()), ..keys },
            LoadKind::Traction(traction) => Self { traction: Some(traction.into()), ..keys },
            LoadKind::Moment(moment) => Self { moment: Some(moment.into()), ..keys },
            LoadKind::Turning { force, moment } => {
                Self { force: Some(force.into()), moment: Some(moment.into()), rigid: Some(true.into()), ..keys }
            }
            LoadKind::Force { total, rigid } => {
                Self { force: Some(total.into()), rigid: rigid.then(|| true.into()), ..keys }
            }
        }
    }
}

impl Check for Load {
    fn check(&self, geometry: Geometry) -> Result<(), Fault> {
        let (along, moment) = match &self.kind {
            LoadKind::Pressure(_) => (None, None),
            LoadKind::Traction(traction) => (Some(("traction", traction)), None),
            LoadKind::Force { total, .. } => (Some(("force", total)), None),
            LoadKind::Moment(moment) => (None, Some(moment)),
            LoadKind::Turning { force, moment } => (Some(("force", force)), Some(moment)),
        };
        if let Some((key, vector)) = along {
            vector.check(key, geometry)?;
            if geometry.is_plane() && !vector[2].is_zero() {
                return Err(Fault::new("", "a load in z in a plane problem", "", ""));
            }
        }
        moment.map_or(Ok(()), |moment| check_moment(moment, geometry))?;
        let (LoadKind::Force { total, .. } | LoadKind::Turning { force: total, .. }) = &self.kind else {
            return Ok(());
        };
        check_numbers(&total[..])?;
        let total = total.numbers();
        if total.iter().any(|force| !force.is_finite()) {
            return Err(Fault::new("force", format!("the force is {total:?}"), "", ""));
        }
        if geometry.plane == Plane::Axisymmetric && total[0] != 0.0 {
            return Err(Fault::new(
                "force",
                "a total force across the axis in an axisymmetric scene",
                "radial forces cancel all around: the first component must be 0",
                "for a radial load give pressure = p or traction = [tr, ta]",
            ));
        }
        Ok(())
    }
}

fn check_moment(moment: &OneOrVector, geometry: Geometry) -> Result<(), Fault> {
    moment.check_axial("moment", geometry)?;
    check_numbers(moment.fields())?;
    let moment = moment.axial(Field::number);
    let refuse = |message: &str, label: &str, help: &str| Err(Fault::new("moment", message, label, help));
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
