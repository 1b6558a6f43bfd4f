//! The echo of a scene with all defaults filled in, for the report. A new key of a scene is written here, too.

use crate::data::{DataSpec, Interpolation, Outside};
use crate::expression::Field;
use crate::problem::{
    AsperitySpec, AutoContact, AxesSpec, BodySpec, Constants, ContactSpec, Depths, ElasticitySpec, Gamma, History,
    LayerSpec, LoadKind, MeshSource, MethodName, MethodSpec, Overlap, Plane, RobinRule, SpringKind, Start, StopRule,
    Zone, name_of,
};
use crate::scene::{OutputSpec, Scene};
use serde_json::{Map, Value, json};

impl Scene {
    /// Return the scene as JSON, keyed like the scene file, with every default written out. Keys that have no default and were not given
    /// are left out. Expressions are texts.
    pub fn settings(&self) -> Value {
        let dimension = self.dimension.value;
        let data: Map<_, _> = self.data.values().map(|data| (data.spec.name.clone(), function(&data.spec))).collect();
        let preset = self.solver.preset.map(|preset| preset.name());
        without_null(json!({
            "scene": self.path.display().to_string(),
            "title": self.title,
            "dimension": dimension,
            "plane": (dimension == 2).then(|| name_of(&Plane::ALL, &self.plane)),
            "units": self.units.as_ref().map(|units| units.text()),
            "mesh": mesh(&self.mesh),
            "data": (!data.is_empty()).then_some(data),
            "body": self.bodies.iter().map(|item| body(item, dimension)).collect::<Value>(),
            "contact": self.contact_tables(),
            "method": method(&self.method),
            "solver": without_null(json!({ "preset": preset, "options": self.solver.options.join(" ") })),
            "estimate": self.estimate,
            "adapt": self.adapt.as_ref().map(|adapt| {
                json!({ "error": adapt.error, "cells": adapt.cells, "rounds": adapt.rounds })
            }),
            "output": output(&self.output),
        }))
    }

    /// Return the tables of named pairs and of rules, in the order of the file.
    fn contact_tables(&self) -> Value {
        let named = self.contacts.iter().map(|spec| (spec.table, contact(spec)));
        let rules = self.auto.iter().map(|auto| (auto.contact.table, rule(auto)));
        let mut tables: Vec<(usize, Value)> = named.chain(rules).collect();
        tables.sort_by_key(|(table, _)| *table);
        tables.into_iter().map(|(_, settings)| settings).collect()
    }
}

/// Return a table without the keys that have no value.
fn without_null(mut table: Value) -> Value {
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
        MeshSource::Geo { file, set, guard, .. } => without_null(json!({
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
        without_null(json!({ "on": support.on.value, "x": x, "y": y, "z": z, "normal": normal, "path": path }))
    });
    let load = body.load.iter().map(|load| {
        let mut map = match &load.kind {
            LoadKind::Pressure(pressure) => json!({ "pressure": field(pressure) }),
            LoadKind::Traction(traction) => json!({ "traction": vector(traction, dimension) }),
            LoadKind::Force { total, rigid } => json!({ "force": total[..dimension], "rigid": rigid }),
        };
        (map["on"], map["path"]) = (json!(load.on.value), json!(load.path.as_ref().map(|path| &path.value)));
        without_null(map)
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
    without_null(map)
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
            without_null(json!({ "first": vector(first, 3), "second": second }))
        }
        AxesSpec::Angle { angle, axis } => json!({ "angle": field(angle), "axis": vector(axis, 3) }),
    }));
    without_null(map)
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
        LayerSpec::Pressure { law, up_to } => without_null(json!({ "pressure": law.text(), "up_to": up_to })),
    };
    without_null(json!({
        "between": contact.between.each_ref().map(|name| &name.value),
        "gap": field(&contact.gap),
        "touching": contact.touching,
        "overlap": name_of(&Overlap::ALL, &contact.overlap),
        "angle": contact.angle,
        "layer": layer,
        "reference": contact.reference.as_ref().map(field),
    }))
}

fn rule(auto: &AutoContact) -> Value {
    let mut map = contact(&auto.contact);
    map["between"] = json!("auto");
    map["distance"] = json!(auto.distance);
    if let Some(of) = &auto.of {
        map["of"] = of.iter().map(|name| json!(name.value)).collect();
    }
    map
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
    without_null(map)
}

fn method(method: &MethodSpec) -> Value {
    let psi = match &method.psi {
        Zone::None => json!("none"),
        Zone::Full => json!("full"),
        Zone::Active => json!("active"),
        // a constant condition is a text, too, as the key takes no number
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
    without_null(json!({
        "name": name_of(&MethodName::ALL, &method.name),
        "psi": psi,
        "robin": robin,
        "start": start,
        "stop": without_null(json!({
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
    let factors = |column: usize| history.steps.iter().map(|step| step.factors[column]).collect::<Vec<_>>();
    let Some(table) = &history.table else { return json!(factors(0)) };
    let mut columns = Map::new();
    columns.insert("time".into(), history.steps.iter().map(|step| json!(step.time)).collect());
    columns.extend(history.names.iter().enumerate().map(|(column, name)| (name.clone(), json!(factors(column)))));
    json!({ "table": table.value.display().to_string(), "columns": columns })
}

fn output(output: &OutputSpec) -> Value {
    without_null(json!({
        "dir": output.dir.as_ref().map(|dir| dir.display().to_string()),
        "vtu": output.vtu,
        "msh": output.msh,
        "report": output.report,
        "precision": if output.encoding.single { "single" } else { "double" },
        "compress": output.encoding.compress,
        "plots": output.plots,
        "pairs": output.pairs.map(|most| if most == usize::MAX { json!("all") } else { json!(most) }),
        "checkpoint": output.checkpoint,
    }))
}
