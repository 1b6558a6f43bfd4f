//! A scene in other coordinates and units: moved, turned, mirrored, scaled. Its answer is known from that of the scene itself.

use std::rc::Rc;
use winkler::api::{
    AxesSpec, BodySpec, ContactSpec, Error, Field, LayerSpec, LoadKind, MeshArrays, MeshSource, OneOrVector,
    Orthotropic, Plane, Result, Scene, Start, Vector,
};
use winkler::error::Located;
use winkler::internals::expression::{Expression, KnownNames};
use winkler::internals::fem::cross;
use winkler::internals::mesh::Mesh;

/// x' = length * (Q x + shift), with a signed permutation Q: (Q x)_i = sign_i x_axis_i. Stresses are multiplied by `stress`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    pub axis: [usize; 3],
    pub sign: [f64; 3],
    /// In units of the scene.
    pub shift: [f64; 3],
    pub length: f64,
    pub stress: f64,
}

impl Change {
    /// Return the change that does nothing.
    pub fn none() -> Self {
        Self { axis: [0, 1, 2], sign: [1.0; 3], shift: [0.0; 3], length: 1.0, stress: 1.0 }
    }

    /// Return Q v.
    pub fn vector(&self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.sign[i] * v[self.axis[i]])
    }

    /// Return the vector of which Q makes `v`.
    pub fn back(&self, v: [f64; 3]) -> [f64; 3] {
        let mut back = [0.0; 3];
        (0..3).for_each(|i| back[self.axis[i]] = self.sign[i] * v[i]);
        back
    }

    /// Return the moment about the origin of the scene itself, as it is before the change, of a force and its moment about the origin of the changed scene. Moments
    /// turn with their scene, and change their sign in a mirror.
    pub fn moment_back(&self, force: [f64; 3], moment: [f64; 3], factor: f64) -> [f64; 3] {
        let arm = cross(self.shift.map(|x| self.length * x), force);
        let is_cyclic = (self.axis[0] + 1) % 3 == self.axis[1];
        let parity = self.sign.iter().product::<f64>() * if is_cyclic { 1.0 } else { -1.0 };
        self.back(std::array::from_fn(|c| moment[c] - arm[c])).map(|m| parity * m / (factor * self.length))
    }

    fn point(&self, x: [f64; 3]) -> [f64; 3] {
        let turned = self.vector(x);
        std::array::from_fn(|i| self.length * (turned[i] + self.shift[i]))
    }

    /// Return the factor of forces; in the plane they are those on a thickness of one.
    pub fn force(&self, scene: &Scene) -> f64 {
        let is_thin = scene.dimension.value == 2 && scene.plane != Plane::Axisymmetric;
        self.stress * if is_thin { self.length } else { self.length * self.length }
    }

    /// Return a field of the changed scene: `factor` times the old one at the old point.
    fn field(&self, field: &Field, factor: f64) -> Field {
        if let Field::Constant(value) = field {
            return Field::Constant(factor * value);
        }
        let (old, change) = (field.clone(), *self);
        Field::from(move |x: [f64; 3]| {
            let local = std::array::from_fn(|i| x[i] / change.length - change.shift[i]);
            factor * old.eval(change.back(local))
        })
    }

    /// Return the fields of the components of a vector.
    fn fields(&self, fields: &[Field; 3], factor: f64) -> [Field; 3] {
        std::array::from_fn(|i| self.field(&fields[self.axis[i]], self.sign[i] * factor))
    }

    /// Change a scene on its mesh.
    ///
    /// # Errors
    /// What the new scene refuses.
    pub fn apply<const D: usize>(&self, scene: &mut Scene, mesh: &Mesh<D>) -> Result<()> {
        let force = self.force(scene);
        scene.mesh = self.mesh(mesh);
        for body in &mut scene.bodies {
            self.body(body, mesh, force);
        }
        for contact in &mut scene.contacts {
            self.contact(contact, D)?;
        }
        if let Start::Normal(field) = &mut scene.method.start {
            *field = self.field(field, self.length);
        }
        Ok(())
    }

    fn mesh<const D: usize>(&self, mesh: &Mesh<D>) -> MeshSource {
        let mut arrays = MeshArrays::new(mesh.points.iter().map(|&x| self.point(mesh.in_scene(x))).collect());
        arrays.order = mesh.order;
        for group in mesh.groups.iter() {
            arrays = arrays.group(&group.name, group.dimension, group.connectivity.clone());
        }
        arrays.into()
    }

    /// Return a moment, where forces grow by `force`. The sense of a turn changes in a mirror.
    fn moment(&self, moment: [f64; 3], force: f64) -> [f64; 3] {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| self.vector(axis));
        let sense: f64 = cross(x, y).iter().zip(z).map(|(a, b)| a * b).sum();
        self.vector(moment).map(|m| sense * force * self.length * m)
    }

    fn body<const D: usize>(&self, body: &mut BodySpec, mesh: &Mesh<D>, force: f64) {
        let (l, s) = (self.length, self.stress);
        self.isotropic(&mut body.young, &mut body.poisson);
        self.anisotropic(&mut body.orthotropic, &mut body.anisotropic, &mut body.axes);
        for region in &mut body.regions {
            self.isotropic(&mut region.young, &mut region.poisson);
            self.anisotropic(&mut region.orthotropic, &mut region.anisotropic, &mut region.axes);
        }
        for fix in &mut body.fix {
            let value = |i: usize| Some(self.field(fix.components()[self.axis[i]]?, self.sign[i] * l).into());
            [fix.x, fix.y, fix.z] = [0, 1, 2].map(value);
            fix.normal.iter_mut().for_each(|normal| normal.value = self.field(normal, l));
        }
        for load in &mut body.load {
            match &mut load.kind {
                LoadKind::Pressure(field) => *field = self.field(field, s),
                LoadKind::Traction(fields) => *fields = self.fields(fields, s).into(),
                LoadKind::Moment(moment) => *moment = self.moment(moment.axial(Field::number), force).into(),
                LoadKind::Turning { force: total, moment } => {
                    *total = self.vector(total.numbers()).map(|f| force * f).into();
                    *moment = self.moment(moment.axial(Field::number), force).into();
                }
                LoadKind::Force { total, .. } => *total = self.vector(total.numbers()).map(|f| force * f).into(),
            }
        }
        for spring in &mut body.spring {
            let is_point = mesh.group(&spring.on.value).is_some_and(|group| group.dimension == 0);
            let factor = if is_point { force / l } else { s / l };
            spring.normal.iter_mut().for_each(|normal| normal.value = self.field(normal, factor));
            if let Some(k) = &mut spring.stiffness {
                let along: [Field; 3] = std::array::from_fn(|i| self.field(&k[self.axis[i]], factor));
                k.value = OneOrVector::Vector(along.into());
            }
        }
        body.force = body.force.as_ref().map(|fields| self.fields(fields, s / l).into());
        // it has no part in the answer
        body.exact = None;
    }

    fn isotropic(&self, young: &mut Option<Located<Field>>, poisson: &mut Option<Located<Field>>) {
        young.iter_mut().for_each(|young| young.value = self.field(young, self.stress));
        poisson.iter_mut().for_each(|poisson| poisson.value = self.field(poisson, 1.0));
    }

    fn anisotropic(
        &self,
        orthotropic: &mut Option<Located<Orthotropic>>,
        anisotropic: &mut Option<Located<Vec<Field>>>,
        axes: &mut Option<Located<AxesSpec>>,
    ) {
        if orthotropic.is_none() && anisotropic.is_none() {
            return;
        }
        if let Some(Located { value: Orthotropic { e1, e2, e3, nu12, nu13, nu23, g12, g13, g23 }, .. }) = orthotropic {
            [e1, e2, e3, g12, g13, g23].into_iter().for_each(|modulus| *modulus = self.field(modulus, self.stress));
            [nu12, nu13, nu23].into_iter().for_each(|ratio| *ratio = self.field(ratio, 1.0));
        }
        let constants = anisotropic.iter_mut().flat_map(|constants| &mut constants.value);
        constants.for_each(|constant| *constant = self.field(constant, self.stress));
        let constant = |v: [f64; 3]| v.map(Field::Constant);
        let AxesSpec { first, second, angle, axis } = axes.take().map(|axes| axes.value).unwrap_or_default();
        let fields = |vector: Located<Vector>| (*vector.value).clone();
        let [first, second] = match (first.map(fields), second.map(fields), angle) {
            (Some(first), Some(second), _) => [first, second],
            (Some(first), None, _) => {
                let across = |f: [f64; 3]| cross([0.0, 0.0, 1.0], f);
                let old = first.clone();
                let at = move |i: usize| {
                    let old = old.clone();
                    Field::from(move |x: [f64; 3]| across(old.each_ref().map(|field| field.eval(x)))[i])
                };
                [first, std::array::from_fn(at)]
            }
            (None, _, Some(angle)) => {
                let axis = axis.map_or_else(|| constant([0.0, 0.0, 1.0]), fields);
                [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|from| turned(from, &angle, &axis))
            }
            (None, ..) => [constant([1.0, 0.0, 0.0]), constant([0.0, 1.0, 0.0])],
        };
        // the third axis is the cross product of these: orthotropic constants do not see its sign
        let [first, second] = [first, second].map(|fields| Some(Vector::from(self.fields(&fields, 1.0)).into()));
        *axes = Some(AxesSpec { first, second, ..AxesSpec::default() }.into());
    }

    fn contact(&self, contact: &mut ContactSpec, dimension: usize) -> Result<()> {
        contact.distance = contact.distance.map(|distance| distance * self.length);
        let (l, s) = (self.length, self.stress);
        contact.gap = self.field(&contact.gap, l);
        contact.reference = None;
        match &mut contact.layer {
            LayerSpec::Linear(law) => law.stiffness = self.field(&law.stiffness, s / l),
            LayerSpec::Exponential(law) => (law.p0, law.c0) = (self.field(&law.p0, s), self.field(&law.c0, l)),
            LayerSpec::Cubic(law) => {
                (law.k1, law.k3) = (self.field(&law.k1, s / l), self.field(&law.k3, s / l.powi(3)));
            }
            // p = (c/B)^(1/a): B is the compression under p = 1
            LayerSpec::Power(law) => {
                let (b, a) = (self.field(&law.b, l), self.field(&law.a, 1.0));
                let exponent = a.clone();
                (law.b, law.a) = (product(b, move |x| s.powf(-exponent.eval(x))), a);
            }
            LayerSpec::Table(points) => points.iter_mut().for_each(|[c, p]| (*c, *p) = (l * *c, s * *p)),
            LayerSpec::Own(name) => {
                return Err(Error::new(winkler::api::Kind::Scene, format!("the law `{name}` has no text")));
            }
            LayerSpec::Pressure { law, up_to } => {
                *law = self.law(law, dimension)?;
                *up_to = up_to.map(|c| l * c);
            }
        }
        Ok(())
    }

    /// Return a law in c and coordinates with the old ones substituted, as a user would write it.
    fn law(&self, law: &Expression, dimension: usize) -> Result<Expression> {
        let names = ["c", "x", "y", "z"];
        let old = |name: &str| -> Option<String> {
            let place = names.iter().position(|known| *known == name)?;
            let Some(j) = place.checked_sub(1) else { return Some(format!("(c/({:e}))", self.length)) };
            let i = (0..3).find(|&i| self.axis[i] == j)?;
            Some(format!("(({:e})*({}/({:e}) - ({:e})))", self.sign[i], names[1 + i], self.length, self.shift[i]))
        };
        let text = format!("({:e})*({})", self.stress, substituted(law.text(), &old));
        Expression::parse(&text, law.place(), KnownNames::of(&names[..=dimension]))
    }
}

/// Return a vector turned by an angle about an axis of unit length, component by component.
fn turned(from: [f64; 3], angle: &Field, axis: &[Field; 3]) -> [Field; 3] {
    let (angle, axis) = (angle.clone(), axis.clone());
    let at = Rc::new(move |x: [f64; 3]| {
        let n = axis.each_ref().map(|field| field.eval(x));
        let size = n.iter().map(|n| n * n).sum::<f64>().sqrt();
        let n = n.map(|n| n / size);
        let (sine, cosine) = angle.eval(x).sin_cos();
        let (along, across) = ((0..3).map(|c| n[c] * from[c]).sum::<f64>(), cross(n, from));
        let part = |c: usize| cosine * from[c] + sine * across[c] + (1.0 - cosine) * along * n[c];
        [part(0), part(1), part(2)]
    });
    std::array::from_fn(|c| {
        let at = at.clone();
        Field::from(move |x: [f64; 3]| at(x)[c])
    })
}

/// Return the product of two functions of the place.
fn product(field: Field, factor: impl Fn([f64; 3]) -> f64 + 'static) -> Field {
    match field {
        // a law whose constants are numbers is one for all points
        Field::Constant(value) => Field::Constant(value * factor([0.0; 3])),
        field => Field::from(move |x: [f64; 3]| field.eval(x) * factor(x)),
    }
}

/// Return an expression with other texts for some of its names.
fn substituted(text: &str, other: &dyn Fn(&str) -> Option<String>) -> String {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
    let (mut made, mut rest) = (String::new(), text);
    while let Some(first) = rest.chars().next() {
        let end = match is_word(first) {
            // 1e3 is a word, too, and none of these names
            true => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            false => first.len_utf8(),
        };
        let (word, after) = rest.split_at(end);
        made += &other(word).unwrap_or_else(|| word.to_owned());
        rest = after;
    }
    made
}
