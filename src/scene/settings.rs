//! The scene echoed with all defaults filled in, for the report.

use crate::data::{DataSpec, Interpolation, Outside};
use crate::expression::Field;
use crate::problem::{
    AsperitySpec, AxesSpec, BodySpec, Constants, ContactSpec, Depths, ElasticitySpec, Gamma, History, LayerSpec,
    LoadKind, MeshSource, MethodName, MethodSpec, Overlap, Plane, RobinRule, SpringKind, Start, StopRule, Zone,
    name_of,
};
use crate::scene::Scene;
use serde_json::{Map, Value, json};

impl Scene {
    /// The scene as JSON, keyed like the scene file, every default written out. What has no default and was not
    /// given is left out; expressions are texts.
    pub fn settings(&self) -> Value {
        let dimension = self.dimension.value;
        let data: Map<_, _> = self.data.values().map(|data| (data.spec.name.clone(), function(&data.spec))).collect();
        let auto = self.auto.iter().map(|auto| {
            let mut map = contact(&auto.contact);
            map["between"] = json!("auto");
            map["distance"] = json!(auto.distance);
            if let Some(of) = &auto.of {
                map["of"] = of.iter().map(|name| json!(name.value)).collect();
            }
            (auto.contact.table, map)
        });
        let named = self.contacts.iter().map(|spec| (spec.table, contact(spec)));
        let mut contacts: Vec<_> = named.chain(auto).collect();
        contacts.sort_by_key(|(table, _)| *table);
        let output = &self.output;
        let pairs = |&most: &usize| if most == usize::MAX { json!("all") } else { json!(most) };
        let preset = self.solver.preset.map(|preset| preset.name());
        given(json!({
            "scene": self.path.display().to_string(),
            "title": self.title,
            "dimension": dimension,
            "plane": (dimension == 2).then(|| name_of(&Plane::ALL, &self.plane)),
            "units": self.units.as_ref().map(|units| units.text()),
            "mesh": mesh(&self.mesh),
            "data": (!data.is_empty()).then_some(data),
            "body": self.bodies.iter().map(|item| body(item, dimension)).collect::<Value>(),
            "contact": contacts.into_iter().map(|(_, map)| map).collect::<Value>(),
            "method": method(&self.method),
            "solver": given(json!({ "preset": preset, "options": self.solver.options.join(" ") })),
            "estimate": self.estimate,
            "adapt": self.adapt.as_ref().map(|adapt| {
                json!({ "error": adapt.error, "cells": adapt.cells, "rounds": adapt.rounds })
            }),
            "output": given(json!({
                "dir": output.dir.as_ref().map(|dir| dir.display().to_string()),
                "vtu": output.vtu,
                "msh": output.msh,
                "report": output.report,
                "precision": if output.encoding.single { "single" } else { "double" },
                "compress": output.encoding.compress,
                "plots": output.plots,
                "pairs": output.pairs.as_ref().map(pairs),
                "checkpoint": output.checkpoint,
            })),
        }))
    }
}

/// A table without the keys that have no value.
fn given(mut table: Value) -> Value {
    if let Value::Object(map) = &mut table {
        map.retain(|_, value| !value.is_null());
    }
    table
}

fn field(field: &Field) -> Value {
    match field {
        Field::Constant(value) => json!(value),
        other => json!(other.text()),
    }
}

fn vector(components: &[Field; 3], dimension: usize) -> Value {
    components.iter().take(dimension).map(field).collect()
}

fn mesh(mesh: &MeshSource) -> Value {
    match mesh {
        MeshSource::Arrays(arrays) => json!({ "points": arrays.points.len(), "groups": arrays.groups.len() }),
        MeshSource::Msh { file } => json!({ "msh": file.value.display().to_string() }),
        MeshSource::Geo { file, set, guard, .. } => given(json!({
            "geo": file.value.display().to_string(),
            "set": set.iter().map(|(name, value)| (name.clone(), json!(value))).collect::<Map<_, _>>(),
            "timeout": guard.seconds,
            "size": guard.size,
            "threads": guard.threads,
            "memory": guard.gigabytes,
        })),
    }
}

fn function(data: &DataSpec) -> Value {
    json!({
        "file": data.file.display().to_string(),
        "points": data.points,
        "origin": data.origin,
        "spacing": data.spacing,
        "unit": data.unit,
        "interpolate": name_of(&Interpolation::ALL, &data.interpolation),
        "outside": name_of(&Outside::ALL, &data.outside),
    })
}

fn body(body: &BodySpec, dimension: usize) -> Value {
    let fix = body.fix.iter().map(|support| {
        let [x, y, z] = support.value.each_ref().map(|value| value.as_ref().map(field));
        let (normal, path) = (support.normal.as_ref().map(field), support.path.as_ref().map(|path| &path.value));
        given(json!({ "on": support.on.value, "x": x, "y": y, "z": z, "normal": normal, "path": path }))
    });
    let load = body.load.iter().map(|load| {
        let mut map = match &load.kind {
            LoadKind::Pressure(pressure) => json!({ "pressure": field(pressure) }),
            LoadKind::Traction(traction) => json!({ "traction": vector(traction, dimension) }),
            LoadKind::Force { total, rigid } => json!({ "force": total[..dimension], "rigid": rigid }),
        };
        (map["on"], map["path"]) = (json!(load.on.value), json!(load.path.as_ref().map(|path| &path.value)));
        given(map)
    });
    let spring = body.spring.iter().map(|spring| match &spring.kind {
        SpringKind::Vector(fields) => json!({ "on": spring.on.value, "stiffness": vector(fields, dimension) }),
        SpringKind::Normal(k) => json!({ "on": spring.on.value, "normal": field(k) }),
    });
    let regions = body.regions.iter().map(|region| {
        let mut map = elasticity(&region.elasticity);
        map["on"] = json!(region.on.value);
        map
    });
    let mut map = elasticity(&body.elasticity);
    map["name"] = json!(body.name.value);
    map["region"] = if body.regions.is_empty() { Value::Null } else { regions.collect() };
    map["order"] = json!(body.order.degree());
    (map["fix"], map["load"], map["spring"]) = (fix.collect(), load.collect(), spring.collect());
    map["force"] = json!(body.force.as_ref().map(|force| vector(force, dimension)));
    let exact = body.exact.as_ref().map(|exact| exact.iter().map(|u| u.text()).collect::<Vec<_>>());
    map["exact"] = json!(exact);
    given(map)
}

fn elasticity(elasticity: &ElasticitySpec) -> Value {
    let mut map = match &elasticity.constants {
        Constants::Isotropic { young, poisson } => json!({ "young": field(young), "poisson": field(poisson) }),
        Constants::Orthotropic(fields) => {
            let named = Constants::ORTHOTROPIC.iter().zip(fields.iter());
            json!({ "orthotropic": named.map(|(name, value)| (name.to_string(), field(value))).collect::<Map<_, _>>() })
        }
        Constants::Anisotropic(fields) => json!({ "anisotropic": fields.iter().map(field).collect::<Value>() }),
    };
    map["axes"] = json!(elasticity.axes.as_ref().map(|axes| match axes {
        AxesSpec::Directions { first, second } => {
            let second = second.as_ref().map(|second| vector(second, 3));
            given(json!({ "first": vector(first, 3), "second": second }))
        }
        AxesSpec::Angle { angle, axis } => json!({ "angle": field(angle), "axis": vector(axis, 3) }),
    }));
    given(map)
}

fn contact(contact: &ContactSpec) -> Value {
    let layer = match &contact.layer {
        LayerSpec::Form { form, values } => {
            let values = form.parameters.iter().zip(values).map(|(known, value)| (known.key.into(), field(value)));
            json!({ form.name: values.collect::<Map<_, _>>() })
        }
        LayerSpec::Table(points) => json!({ "table": points }),
        LayerSpec::Own(name) => json!({ "own": name }),
        LayerSpec::Asperities(spec) => json!({ "asperities": asperities(spec) }),
        LayerSpec::Pressure { law, up_to } => given(json!({ "pressure": law.text(), "up_to": up_to })),
    };
    given(json!({
        "between": contact.between.each_ref().map(|name| &name.value),
        "gap": field(&contact.gap),
        "touching": contact.touching,
        "overlap": name_of(&Overlap::ALL, &contact.overlap),
        "angle": contact.angle,
        "layer": layer,
        "reference": contact.reference.as_ref().map(field),
    }))
}

fn asperities(spec: &AsperitySpec) -> Value {
    let AsperitySpec { density, radius, modulus, depths, data } = spec;
    let mut map = json!({ "density": density, "radius": radius, "modulus": modulus, "data": data });
    match depths {
        Depths::Normal { deviation, highest } => {
            (map["deviation"], map["highest"]) = (json!(deviation), json!(highest));
        }
        Depths::Measured(depths) => map["summits"] = json!(depths.len()),
    }
    given(map)
}

fn method(method: &MethodSpec) -> Value {
    let psi = match &method.psi {
        Zone::None => json!("none"),
        Zone::Full => json!("full"),
        Zone::Active => json!("active"),
        // Text also for a constant condition, as the key takes no number.
        Zone::Subset(condition) => json!(condition.text()),
    };
    let start = match &method.start {
        Start::Auto => json!("auto"),
        Start::Zero => json!("zero"),
        Start::Nested => json!("nested"),
        Start::Normal(normal) => json!({ "normal": field(normal) }),
    };
    let StopRule { residual, increment, balanced, iterations } = &method.stop;
    let gamma = match &method.gamma {
        Gamma::Stationary(gamma) => json!(gamma),
        Gamma::Schedule(list) => json!(list),
        Gamma::Own(name) => json!({ "own": name }),
        rule => json!(name_of(&Gamma::NAMED, rule)),
    };
    let robin = match method.robin {
        RobinRule::Tangent => json!("tangent"),
        RobinRule::Frozen => json!("frozen"),
        RobinRule::Floor(floor) => json!({ "floor": floor }),
        RobinRule::Auto => json!("auto"),
    };
    let is_robin = method.name == MethodName::Robin;
    given(json!({
        "name": name_of(&MethodName::ALL, &method.name),
        "psi": psi,
        "robin": robin,
        "start": start,
        "stop": given(json!({
            "residual": residual, "increment": increment, "balanced": balanced.then_some(true), "iterations": iterations,
        })),
        "gamma": is_robin.then_some(gamma),
        "interval": (is_robin && method.interval).then_some(true),
        "steps": (!method.steps.is_empty()).then(|| history(&method.steps)),
        "linear": method.linear.map(|linear| linear.name()),
        "depth": (method.name == MethodName::Anderson).then_some(method.depth),
    }))
}

fn history(history: &History) -> Value {
    let column = |place: usize| history.steps.iter().map(|step| step.factors[place]).collect::<Vec<_>>();
    let Some(table) = &history.table else { return json!(column(0)) };
    let mut columns = Map::new();
    columns.insert("time".into(), history.steps.iter().map(|step| json!(step.time)).collect());
    columns.extend(history.names.iter().enumerate().map(|(place, name)| (name.clone(), json!(column(place)))));
    json!({ "table": table.value.display().to_string(), "columns": columns })
}
