//! The scene echoed with all defaults filled in, for the report.

use crate::data::{DataSpec, Interpolation, Outside};
use crate::expression::Field;
use crate::problem::body::{BodySpec, LoadKind, SpringKind};
use crate::problem::contact::{ContactSpec, Overlap};
use crate::problem::elasticity::{AxesSpec, Constants, ElasticitySpec, Plane};
use crate::problem::history::History;
use crate::problem::layer::{AsperitySpec, Depths, LayerSpec};
use crate::problem::mesh::MeshSource;
use crate::problem::method::{Gamma, MethodName, MethodSpec, Start};
use crate::problem::order::Order;
use crate::problem::robin::{RobinRule, Zone};
use crate::problem::solver::SolverSpec;
use crate::problem::stop::StopRule;
use crate::scene::Scene;
use serde_json::{Map, Value, json};

impl Scene {
    /// The scene as JSON, keyed like the scene file, every default written out. What has no default and was not
    /// given is left out; expressions are texts.
    pub fn settings(&self) -> Value {
        let mut settings = Map::new();
        settings.insert("scene".into(), json!(self.path.display().to_string()));
        settings.insert("title".into(), json!(self.title));
        settings.insert("dimension".into(), json!(self.dimension.value));
        if self.dimension.value == 2 {
            let plane = Plane::ALL.iter().find(|(_, plane)| *plane == self.plane).map(|(name, _)| *name);
            settings.insert("plane".into(), json!(plane));
        }
        insert(&mut settings, "units", self.units.as_ref().map(|units| json!(units.text())));
        settings.insert("mesh".into(), mesh(&self.mesh));
        let data: Map<_, _> = self.data.values().map(|data| (data.spec.name.clone(), function(&data.spec))).collect();
        insert(&mut settings, "data", (!data.is_empty()).then(|| data.into()));
        let dimension = self.dimension.value;
        settings.insert("body".into(), self.bodies.iter().map(|item| body(item, dimension)).collect());
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
        settings.insert("contact".into(), contacts.into_iter().map(|(_, map)| map).collect());
        settings.insert("method".into(), method(&self.method));
        settings.insert("solver".into(), solver(&self.solver));
        settings.insert("estimate".into(), json!(self.estimate));
        let adapt = self.adapt.as_ref();
        let adapt = adapt.map(|adapt| json!({ "error": adapt.error, "cells": adapt.cells, "rounds": adapt.rounds }));
        insert(&mut settings, "adapt", adapt);
        let mut output = Map::new();
        insert(&mut output, "dir", self.output.dir.as_ref().map(|dir| json!(dir.display().to_string())));
        output.insert("vtu".into(), json!(self.output.vtu));
        output.insert("msh".into(), json!(self.output.msh));
        output.insert("report".into(), json!(self.output.report));
        let encoding = self.output.encoding;
        output.insert("precision".into(), json!(if encoding.single { "single" } else { "double" }));
        output.insert("compress".into(), json!(encoding.compress));
        output.insert("plots".into(), json!(self.output.plots));
        let pairs = |&most: &usize| if most == usize::MAX { json!("all") } else { json!(most) };
        insert(&mut output, "pairs", self.output.pairs.as_ref().map(pairs));
        insert(&mut output, "checkpoint", self.output.checkpoint.map(|minutes| json!(minutes)));
        settings.insert("output".into(), output.into());
        settings.into()
    }
}

fn insert(map: &mut Map<String, Value>, key: &str, value: Option<Value>) {
    if let Some(value) = value {
        map.insert(key.into(), value);
    }
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
        MeshSource::Geo { file, set, guard, .. } => {
            let set: Map<_, _> = set.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
            let (file, timeout, memory) = (file.value.display().to_string(), guard.seconds, guard.gigabytes);
            let mut mesh = json!({ "geo": file, "set": set, "timeout": timeout });
            if let Some(size) = guard.size {
                mesh["size"] = json!(size);
            }
            if let Some(threads) = guard.threads {
                mesh["threads"] = json!(threads);
            }
            if let Some(memory) = memory {
                mesh["memory"] = json!(memory);
            }
            mesh
        }
    }
}

fn function(data: &DataSpec) -> Value {
    let word = |list: &[(&'static str, bool)]| list.iter().find(|(_, is)| *is).map(|(name, _)| *name);
    json!({
        "file": data.file.display().to_string(),
        "points": data.points,
        "origin": data.origin,
        "spacing": data.spacing,
        "unit": data.unit,
        "interpolate": word(&Interpolation::ALL.map(|(name, known)| (name, known == data.interpolation))),
        "outside": word(&Outside::ALL.map(|(name, known)| (name, known == data.outside))),
    })
}

fn body(body: &BodySpec, dimension: usize) -> Value {
    let fix = body.fix.iter().map(|support| {
        let mut map = Map::new();
        map.insert("on".into(), json!(support.on.value));
        for (axis, value) in ["x", "y", "z"].iter().zip(&support.value) {
            insert(&mut map, axis, value.as_ref().map(field));
        }
        insert(&mut map, "normal", support.normal.as_ref().map(field));
        insert(&mut map, "path", support.path.as_ref().map(|path| json!(path.value)));
        Value::Object(map)
    });
    let load = body.load.iter().map(|load| {
        let mut map = json!({ "on": load.on.value });
        match &load.kind {
            LoadKind::Pressure(pressure) => map["pressure"] = field(pressure),
            LoadKind::Traction(traction) => map["traction"] = vector(traction, dimension),
            LoadKind::Force { total, rigid } => {
                (map["force"], map["rigid"]) = (json!(total[..dimension]), json!(rigid));
            }
        }
        if let Some(path) = &load.path {
            map["path"] = json!(path.value);
        }
        map
    });
    let spring = body.spring.iter().map(|spring| match &spring.kind {
        SpringKind::Vector(fields) => json!({ "on": spring.on.value, "stiffness": vector(fields, dimension) }),
        SpringKind::Normal(k) => json!({ "on": spring.on.value, "normal": field(k) }),
    });
    let order = match body.order {
        Order::P1 => 1,
        Order::P2 => 2,
    };
    let mut map = Map::new();
    map.insert("name".into(), json!(body.name.value));
    map.extend(elasticity(&body.elasticity));
    let regions = body.regions.iter().map(|region| {
        let mut map = elasticity(&region.elasticity);
        map.insert("on".into(), json!(region.on.value));
        Value::Object(map)
    });
    insert(&mut map, "region", (!body.regions.is_empty()).then(|| regions.collect()));
    map.insert("order".into(), json!(order));
    map.insert("fix".into(), fix.collect());
    map.insert("load".into(), load.collect());
    map.insert("spring".into(), spring.collect());
    insert(&mut map, "force", body.force.as_ref().map(|force| vector(force, dimension)));
    insert(&mut map, "exact", body.exact.as_ref().map(|exact| exact.iter().map(|u| json!(u.plain().text())).collect()));
    map.into()
}

fn elasticity(elasticity: &ElasticitySpec) -> Map<String, Value> {
    let mut map = Map::new();
    match &elasticity.constants {
        Constants::Isotropic { young, poisson } => {
            map.insert("young".into(), field(young));
            map.insert("poisson".into(), field(poisson));
        }
        Constants::Orthotropic(fields) => {
            let named = Constants::ORTHOTROPIC.iter().zip(fields.iter());
            let named: Map<_, _> = named.map(|(name, value)| (name.to_string(), field(value))).collect();
            map.insert("orthotropic".into(), named.into());
        }
        Constants::Anisotropic(fields) => {
            map.insert("anisotropic".into(), fields.iter().map(field).collect());
        }
    }
    let axes = elasticity.axes.as_ref().map(|axes| match axes {
        AxesSpec::Directions { first, second: Some(second) } => {
            json!({ "first": vector(first, 3), "second": vector(second, 3) })
        }
        AxesSpec::Directions { first, second: None } => json!({ "first": vector(first, 3) }),
        AxesSpec::Angle { angle, axis } => json!({ "angle": field(angle), "axis": vector(axis, 3) }),
    });
    insert(&mut map, "axes", axes);
    map
}

fn contact(contact: &ContactSpec) -> Value {
    let layer = match &contact.layer {
        LayerSpec::Form { form, values } => {
            let values: Map<_, _> =
                form.parameters.iter().zip(values).map(|(known, value)| (known.key.into(), field(value))).collect();
            json!({ form.name: values })
        }
        LayerSpec::Table(points) => json!({ "table": points }),
        LayerSpec::Own(name) => json!({ "own": name }),
        LayerSpec::Asperities(spec) => json!({ "asperities": asperities(spec) }),
        LayerSpec::Pressure { law, up_to } => {
            let mut map = Map::new();
            map.insert("pressure".into(), json!(law.plain().text()));
            insert(&mut map, "up_to", up_to.map(|c| json!(c)));
            map.into()
        }
    };
    let mut map = Map::new();
    map.insert("between".into(), contact.between.iter().map(|name| json!(name.value)).collect());
    map.insert("gap".into(), field(&contact.gap));
    map.insert("touching".into(), json!(contact.touching));
    let overlap = Overlap::ALL.iter().find(|(_, named)| *named == contact.overlap).map(|(name, _)| name);
    map.insert("overlap".into(), json!(overlap));
    map.insert("angle".into(), json!(contact.angle));
    map.insert("layer".into(), layer);
    insert(&mut map, "reference", contact.reference.as_ref().map(field));
    map.into()
}

fn asperities(spec: &AsperitySpec) -> Value {
    let AsperitySpec { density, radius, modulus, depths, data } = spec;
    let mut map = json!({ "density": density, "radius": radius, "modulus": modulus });
    if let Some(data) = data {
        map["data"] = json!(data);
    }
    match depths {
        Depths::Normal { deviation, highest } => {
            (map["deviation"], map["highest"]) = (json!(deviation), json!(highest));
        }
        Depths::Measured(depths) => map["summits"] = json!(depths.len()),
    }
    map
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
    let mut stop = Map::new();
    insert(&mut stop, "residual", residual.map(|value| json!(value)));
    insert(&mut stop, "increment", increment.map(|value| json!(value)));
    if *balanced {
        stop.insert("balanced".into(), json!(true));
    }
    stop.insert("iterations".into(), json!(iterations));
    let gamma = match &method.gamma {
        Gamma::Stationary(gamma) => json!(gamma),
        Gamma::Schedule(list) => json!(list),
        Gamma::Own(name) => json!({ "own": name }),
        rule => json!(Gamma::NAMED.iter().find(|(_, named)| named == rule).map(|(name, _)| name)),
    };
    let robin = match method.robin {
        RobinRule::Tangent => json!("tangent"),
        RobinRule::Frozen => json!("frozen"),
        RobinRule::Floor(floor) => json!({ "floor": floor }),
        RobinRule::Auto => json!("auto"),
    };
    let name = MethodName::ALL.iter().find(|(_, named)| *named == method.name).map(|(name, _)| name);
    let mut map = json!({ "name": name, "psi": psi, "robin": robin, "start": start, "stop": stop });
    if method.name == MethodName::Robin {
        map["gamma"] = gamma;
        if method.interval {
            map["interval"] = json!(true);
        }
    }
    if !method.steps.is_empty() {
        map["steps"] = history(&method.steps);
    }
    if let Some(linear) = method.linear {
        map["linear"] = json!(linear.name());
    }
    if method.name == MethodName::Anderson {
        map["depth"] = json!(method.depth);
    }
    map
}

fn history(history: &History) -> Value {
    let column = |place: usize| history.steps.iter().map(|step| step.factors[place]).collect::<Vec<_>>();
    let Some(table) = &history.table else { return json!(column(0)) };
    let mut columns = Map::new();
    columns.insert("time".into(), history.steps.iter().map(|step| json!(step.time)).collect());
    columns.extend(history.names.iter().enumerate().map(|(place, name)| (name.clone(), json!(column(place)))));
    json!({ "table": table.value.display().to_string(), "columns": columns })
}

fn solver(solver: &SolverSpec) -> Value {
    let mut map = Map::new();
    insert(&mut map, "preset", solver.preset.map(|preset| json!(preset.name())));
    map.insert("options".into(), json!(solver.options.join(" ")));
    map.into()
}
