//! One body of the scene on its mesh: space, supports, loads, stiffness.

use super::find::{find_group, not_on_body, point};
use crate::contact;
use crate::error::{Error, Result};
use crate::fem::{ElasticBody, Material, NodeGraph, Space, assemble};
use crate::linalg::Csr;
use crate::mesh::Mesh;
use crate::scene::{BodySpec, LoadKind};
use std::collections::HashMap;

/// A body of the scene with its space, supports and the lookups that they need.
pub struct Part<'a, const D: usize> {
    /// What the scene says.
    pub spec: &'a BodySpec,
    /// Its finite element space.
    pub space: Space<D>,
    /// Prescribed dofs and their values.
    pub prescribed: HashMap<usize, f64>,
}

impl<'a, const D: usize> Part<'a, D> {
    /// Finds the body's cells in the mesh and applies its supports.
    pub fn new(spec: &'a BodySpec, mesh: &Mesh<D>) -> Result<Self> {
        let group = find_group(mesh, &spec.name, &[D], "body")?;
        let space = Space::new(mesh, group, spec.order);
        let mut part = Self { spec, space, prescribed: HashMap::new() };
        part.support(mesh)?;
        Ok(part)
    }

    fn support(&mut self, mesh: &Mesh<D>) -> Result<()> {
        for support in &self.spec.fix {
            let dimensions: Vec<usize> = (0..=D).rev().collect();
            let group = find_group(mesh, &support.on, &dimensions, "support")?;
            let nodes = self.space.nodes_on(group);
            if nodes.is_empty() {
                return Err(not_on_body(&support.on, &self.spec.name.value));
            }
            for node in nodes {
                for (c, value) in support.value[..D].iter().enumerate() {
                    let Some(value) = value else { continue };
                    let before = self.prescribed.insert(D * node as usize + c, *value);
                    if before.is_some_and(|before| before != *value) {
                        let x = contact::pad(self.space.nodes[node as usize]);
                        let message = format!(
                            "body `{}`: supports prescribe two values of the {} displacement at {}",
                            self.spec.name.value,
                            ["x", "y", "z"][c],
                            point(x)
                        );
                        return Err(Error::scene(&support.on.place, message)
                            .label("this one and an earlier one")
                            .help("make both values equal, or let the surfaces not meet"));
                    }
                }
            }
        }
        Ok(())
    }

    /// Prescribed (dof, value), sorted by dof.
    pub fn prescribed_sorted(&self) -> Vec<(usize, f64)> {
        let mut all: Vec<_> = self.prescribed.iter().map(|(&dof, &value)| (dof, value)).collect();
        all.sort_unstable_by_key(|entry| entry.0);
        all
    }

    /// The load vector f, supports not regarded.
    pub fn load(&self, mesh: &Mesh<D>) -> Result<Vec<f64>> {
        let name = &self.spec.name;
        let mut load = vec![0.0; self.space.dofs()];
        for spec in &self.spec.load {
            let group = find_group(mesh, &spec.on, &[D - 1], "load")?;
            let facets = self.space.facets(group);
            if facets.count() == 0 {
                return Err(not_on_body(&spec.on, &name.value));
            }
            assemble::surface_load(
                &self.space,
                &facets,
                &|x, n| match &spec.kind {
                    LoadKind::Pressure(field) => {
                        let pressure = field.eval(contact::pad(x));
                        n.map(|n| -pressure * n)
                    }
                    LoadKind::Traction(fields) => std::array::from_fn(|c| fields[c].eval(contact::pad(x))),
                },
                &mut load,
            );
            if load.iter().any(|f| !f.is_finite()) {
                return Err(Error::scene(
                    &spec.on.place,
                    format!("body `{}`: this load is not finite everywhere on its surface", name.value),
                )
                .help("mind roots of negative numbers and divisions by zero in the expression"));
            }
        }
        if let Some(fields) = &self.spec.force {
            let density = |x: [f64; D]| std::array::from_fn(|c| fields[c].eval(contact::pad(x)));
            assemble::body_force(&self.space, &density, &mut load);
            if load.iter().any(|f| !f.is_finite()) {
                return Err(Error::scene(
                    &name.place,
                    format!("body `{}`: its body force is not finite everywhere", name.value),
                )
                .help("mind roots of negative numbers and divisions by zero in the expression"));
            }
        }
        Ok(load)
    }

    /// K, f and supports.
    pub fn assemble(
        &self,
        mesh: &Mesh<D>,
        rows: &Csr,
        material: &Material,
        load: Vec<f64>,
        prescribed: Vec<(usize, f64)>,
    ) -> Result<ElasticBody> {
        let coupled: Vec<Vec<u32>> = (0..rows.rows())
            .map(|q| {
                let mut nodes: Vec<u32> = rows.row(q).map(|(dof, _)| (dof / D) as u32).collect();
                nodes.dedup();
                nodes
            })
            .filter(|nodes| nodes.len() > 1)
            .collect();
        let graph = NodeGraph::new(&self.space, &coupled);
        let name = &self.spec.name;
        let stiffness = assemble::stiffness(&self.space, &graph, material).map_err(|defect| {
            let assemble::Defect::Inverted(cell) = defect;
            let corner = contact::pad(self.space.cell_nodes(cell)[0]);
            let message = format!("body `{}`: the curved cell at {} is folded", name.value, point(corner));
            Error::mesh(&mesh.path, None, message).help("refine the mesh there, or use order = 1")
        })?;
        Ok(assemble::support(stiffness, load, prescribed))
    }
}
