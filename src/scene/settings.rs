//! The echo of a scene with all defaults filled in: for the report, and to compare scenes.
//!
//! A key that is missing here is also ignored where scenes are compared: by a restart, in a sweep, and between ranks. Structs are therefore
//! taken apart by patterns with all their fields, so that the compiler finds a field that is not echoed.

use crate::data::{DataSpec, Detrend, Fill, Interpolation, Missing, Outside};
use crate::expression::Field;
use crate::problem::{
    AsperitySpec, AutoContact, AxesSpec, BodySpec, Constants, ContactSpec, Depths, ElasticitySpec, Gamma, Guard,
    History, LayerSpec, Load, LoadKind, MeshSource, MethodName, MethodSpec, Overlap, Plane, RegionSpec, RobinRule,
    SolverSpec, SpringKind, SpringSpec, Start, StopRule, Support, Zone, name_of,
};
use crate::scene::{AdaptSpec, OutputSpec, Scene};
use serde_json::{Map, Value, json};

impl Scene {
    /// Return the scene as JSON, keyed like the scene file, with every default written out. Keys that have no default and were not given
    /// are left out. Expressions are texts.
    pub fn settings(&self) -> Value {
        #[rustfmt::skip]
        let Self {
            path, title, dimension, plane, units, mesh, laws: _, rules: _, data,
            bodies, contacts, auto, method, solver, estimate, adapt, output,
        } = self;
        let dimension = dimension.value;
        let data: Map<_, _> = data.values().map(|data| (data.spec.name.clone(), of_data(&data.spec))).collect();
        without_null(json!({
            "scene": path.display().to_string(),
            "title": title,
            "dimension": dimension,
            "plane": (dimension == 2).then(|| name_of(&Plane::ALL, plane)),
            "units": units.as_ref().map(|units| units.text()),
            "mesh": of_mesh(mesh),
            "data": (!data.is_empty()).then_some(data),
            "body": bodies.iter().map(|body| of_body(body, dimension)).collect::<Value>(),
            "contact": of_contacts(contacts, auto),
            "method": of_method(method),
            "solver": of_solver(solver),
            "estimate": estimate,
            "adapt": adapt.as_ref().map(of_adapt),
            "output": of_output(output),
        }))
    }
}

/// Return a table without the keys that have no value.
fn without_null(mut table: Value) -> Value {
    if let Value::Object(map) = &mut table {
        map.retain(|_, value| !value.is_null());
    }
    table
}

fn of_field(field: &Field) -> Value {
    match field {
        Field::Constant(value) => json!(value),
        other => json!(other.text()),
    }
}

fn of_vector(components: &[Field; 3], dimension: usize) -> Value {
    components.iter().take(dimension).map(of_field).collect()
}

fn of_mesh(mesh: &MeshSource) -> Value {
    match mesh {
        MeshSource::Arrays(arrays) => json!({ "points": arrays.points.len(), "groups": arrays.groups.len() }),
        MeshSource::Msh { file } => json!({ "msh": file.value.display().to_string() }),
        MeshSource::Geo { file, set, places: _, sizes: _, guard } => {
            let Guard { seconds, gigabytes, size, threads, trusted: _ } = guard;
            without_null(json!({
                "geo": file.value.display().to_string(),
                "set": set.iter().map(|(name, value)| (name.clone(), json!(value))).collect::<Map<_, _>>(),
                "timeout": seconds,
                "size": size,
                "threads": threads,
                "memory": gigabytes,
            }))
        }
    }
}

fn of_data(data: &DataSpec) -> Value {
    #[rustfmt::skip]
    let DataSpec {
        name: _, file, place: _, points, origin, spacing, unit, missing, fill, detrend, interpolation, outside,
    } = data;
    let named = missing.as_ref().map(|Missing { numbers, words }| {
        numbers.iter().map(|number| json!(number)).chain(words.iter().map(|word| json!(word))).collect::<Vec<_>>()
    });
    without_null(json!({
        "file": file.display().to_string(),
        "points": points,
        "origin": origin,
        "spacing": spacing,
        "unit": unit,
        "missing": named,
        "fill": name_of(&Fill::ALL, fill),
        "detrend": name_of(&Detrend::ALL, detrend),
        "interpolate": name_of(&Interpolation::ALL, interpolation),
        "outside": name_of(&Outside::ALL, outside),
    }))
}

fn of_body(body: &BodySpec, dimension: usize) -> Value {
    let BodySpec { name, split, elasticity, regions, order, fix, load, spring, force, force_factor: _, exact } = body;
    let mut map = of_elasticity(elasticity);
    map["name"] = json!(name.value);
    map["split"] = json!(split.then_some(true));
    map["region"] = if regions.is_empty() { Value::Null } else { regions.iter().map(of_region).collect() };
    map["order"] = json!(order.degree());
    map["fix"] = fix.iter().map(of_support).collect();
    map["load"] = load.iter().map(|load| of_load(load, dimension)).collect();
    map["spring"] = spring.iter().map(|spring| of_spring(spring, dimension)).collect();
    map["force"] = json!(force.as_ref().map(|force| of_vector(force, dimension)));
    map["exact"] = json!(exact.as_ref().map(|exact| exact.iter().map(|u| u.text()).collect::<Vec<_>>()));
    without_null(map)
}

fn of_region(region: &RegionSpec) -> Value {
    let RegionSpec { on, elasticity } = region;
    let mut map = of_elasticity(elasticity);
    map["on"] = json!(on.value);
    map
}

fn of_support(support: &Support) -> Value {
    let Support { on, value, normal, path, factor: _ } = support;
    let [x, y, z] = value.each_ref().map(|value| value.as_ref().map(of_field));
    let (normal, path) = (normal.as_ref().map(of_field), path.as_ref().map(|path| &path.value));
    without_null(json!({ "on": on.value, "x": x, "y": y, "z": z, "normal": normal, "path": path }))
}

fn of_load(load: &Load, dimension: usize) -> Value {
    let Load { on, kind, path, factor: _ } = load;
    let mut map = match kind {
        LoadKind::Pressure(pressure) => json!({ "pressure": of_field(pressure) }),
        LoadKind::Traction(traction) => json!({ "traction": of_vector(traction, dimension) }),
        LoadKind::Moment(moment) if dimension == 2 => json!({ "moment": moment[2] }),
        LoadKind::Moment(moment) => json!({ "moment": moment }),
        LoadKind::Turning { force, moment } if dimension == 2 => {
            json!({ "force": force[..2], "moment": moment[2], "rigid": true })
        }
        LoadKind::Turning { force, moment } => json!({ "force": force, "moment": moment, "rigid": true }),
        LoadKind::Force { total, rigid } => json!({ "force": total[..dimension], "rigid": rigid }),
    };
    map["on"] = json!(on.value);
    map["path"] = json!(path.as_ref().map(|path| &path.value));
    without_null(map)
}

fn of_spring(spring: &SpringSpec, dimension: usize) -> Value {
    let SpringSpec { on, kind } = spring;
    match kind {
        SpringKind::Vector(fields) => json!({ "on": on.value, "stiffness": of_vector(fields, dimension) }),
        SpringKind::Normal(k) => json!({ "on": on.value, "normal": of_field(k) }),
    }
}

fn of_elasticity(elasticity: &ElasticitySpec) -> Value {
    let ElasticitySpec { constants, axes, place: _ } = elasticity;
    let mut map = match constants {
        Constants::Isotropic { young, poisson } => json!({ "young": of_field(young), "poisson": of_field(poisson) }),
        Constants::Orthotropic(fields) => {
            let named = Constants::ORTHOTROPIC.iter().zip(fields.iter());
            json!({ "orthotropic": named.map(|(name, value)| (name.to_string(), of_field(value))).collect::<Map<_, _>>() })
        }
        Constants::Anisotropic(fields) => json!({ "anisotropic": fields.iter().map(of_field).collect::<Value>() }),
    };
    map["axes"] = json!(axes.as_ref().map(of_axes));
    without_null(map)
}

fn of_axes(axes: &AxesSpec) -> Value {
    match axes {
        AxesSpec::Directions { first, second } => {
            let second = second.as_ref().map(|second| of_vector(second, 3));
            without_null(json!({ "first": of_vector(first, 3), "second": second }))
        }
        AxesSpec::Angle { angle, axis } => json!({ "angle": of_field(angle), "axis": of_vector(axis, 3) }),
    }
}

/// Return the tables of named pairs and of rules, in the order of the file.
fn of_contacts(contacts: &[ContactSpec], rules: &[AutoContact]) -> Value {
    let named = contacts.iter().map(|contact| (contact.table, of_contact(contact)));
    let found = rules.iter().map(|rule| (rule.contact.table, of_rule(rule)));
    let mut tables: Vec<(usize, Value)> = named.chain(found).collect();
    tables.sort_by_key(|(table, _)| *table);
    tables.into_iter().map(|(_, settings)| settings).collect()
}

fn of_contact(contact: &ContactSpec) -> Value {
    let ContactSpec { between, gap, angle, edge, distance, layer, touching, overlap, reference, table: _ } = contact;
    without_null(json!({
        "between": between.each_ref().map(|name| &name.value),
        "gap": of_field(gap),
        "touching": touching,
        "overlap": name_of(&Overlap::ALL, overlap),
        "angle": angle,
        "edge": edge,
        "distance": distance,
        "layer": of_layer(layer),
        "reference": reference.as_ref().map(of_field),
    }))
}

fn of_rule(rule: &AutoContact) -> Value {
    let AutoContact { of, contact } = rule;
    let mut map = of_contact(contact);
    map["between"] = json!("auto");
    map["of"] = json!(of.as_ref().map(|of| of.each_ref().map(|name| &name.value)));
    without_null(map)
}

fn of_layer(layer: &LayerSpec) -> Value {
    match layer {
        LayerSpec::Form { form, values } => {
            let values = form.parameters.iter().zip(values).map(|(known, value)| (known.key.into(), of_field(value)));
            json!({ form.name: values.collect::<Map<_, _>>() })
        }
        LayerSpec::Table(points) => json!({ "table": points }),
        LayerSpec::Own(name) => json!({ "own": name }),
        LayerSpec::Asperities(spec) => json!({ "asperities": of_asperities(spec) }),
        LayerSpec::Pressure { law, up_to } => without_null(json!({ "pressure": law.text(), "up_to": up_to })),
    }
}

fn of_asperities(spec: &AsperitySpec) -> Value {
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

fn of_method(method: &MethodSpec) -> Value {
    let MethodSpec { name, psi, robin, gamma, interval, depth, linear, start, steps, stop } = method;
    let is_robin = *name == MethodName::Robin;
    without_null(json!({
        "name": name_of(&MethodName::ALL, name),
        "psi": of_zone(psi),
        "robin": of_robin(*robin),
        "start": of_start(start),
        "stop": of_stop(stop),
        "gamma": is_robin.then(|| of_gamma(gamma)),
        "interval": (is_robin && *interval).then_some(true),
        "steps": (!steps.is_empty()).then(|| of_history(steps)),
        "linear": linear.map(|linear| linear.name()),
        "depth": (*name == MethodName::Anderson).then_some(depth),
    }))
}

/// Return the zone as a text, as its key takes no number.
fn of_zone(zone: &Zone) -> Value {
    match zone {
        Zone::None => json!("none"),
        Zone::Full => json!("full"),
        Zone::Active => json!("active"),
        Zone::Subset(condition) => json!(condition.text()),
    }
}

fn of_robin(robin: RobinRule) -> Value {
    match robin {
        RobinRule::Tangent => json!("tangent"),
        RobinRule::Frozen => json!("frozen"),
        RobinRule::Floor(floor) => json!({ "floor": floor }),
        RobinRule::Auto => json!("auto"),
    }
}

fn of_start(start: &Start) -> Value {
    match start {
        Start::Auto => json!("auto"),
        Start::Zero => json!("zero"),
        Start::Nested => json!("nested"),
        Start::Normal(normal) => json!({ "normal": of_field(normal) }),
    }
}

fn of_stop(stop: &StopRule) -> Value {
    let StopRule { residual, increment, balanced, iterations } = stop;
    let balanced = balanced.then_some(true);
    without_null(json!({
        "residual": residual, "increment": increment, "balanced": balanced, "iterations": iterations,
    }))
}

fn of_gamma(gamma: &Gamma) -> Value {
    match gamma {
        Gamma::Stationary(gamma) => json!(gamma),
        Gamma::Schedule(list) => json!(list),
        Gamma::Own(name) => json!({ "own": name }),
        rule => json!(name_of(&Gamma::NAMED, rule)),
    }
}

fn of_history(history: &History) -> Value {
    let factors = |column: usize| history.steps.iter().map(|step| step.factors[column]).collect::<Vec<_>>();
    let Some(table) = &history.table else { return json!(factors(0)) };
    let mut columns = Map::new();
    columns.insert("time".into(), history.steps.iter().map(|step| json!(step.time)).collect());
    columns.extend(history.names.iter().enumerate().map(|(column, name)| (name.clone(), json!(factors(column)))));
    json!({ "table": table.value.display().to_string(), "columns": columns })
}

fn of_solver(solver: &SolverSpec) -> Value {
    let SolverSpec { preset, options } = solver;
    without_null(json!({ "preset": preset.map(|preset| preset.name()), "options": options.join(" ") }))
}

fn of_adapt(adapt: &AdaptSpec) -> Value {
    let AdaptSpec { error, cells, rounds, place: _ } = adapt;
    json!({ "error": error, "cells": cells, "rounds": rounds })
}

fn of_output(output: &OutputSpec) -> Value {
    let OutputSpec { dir, vtu, msh, encoding, report, plots, pairs, checkpoint } = output;
    without_null(json!({
        "dir": dir.as_ref().map(|dir| dir.display().to_string()),
        "vtu": vtu,
        "msh": msh,
        "report": report,
        "precision": if encoding.single { "single" } else { "double" },
        "compress": encoding.compress,
        "plots": plots,
        "pairs": pairs.map(|most| if most == usize::MAX { json!("all") } else { json!(most) }),
        "checkpoint": checkpoint,
    }))
}
