//! What ranks that have not read a mesh know of it: all points, and the groups without the cells of bodies.

use super::groups::{Group, Groups};
use super::{Mesh, Order};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A mesh without most of its cells, as plain data.
#[derive(Debug, Serialize, Deserialize)]
pub struct Told {
    path: PathBuf,
    /// Coordinates, point by point.
    points: Vec<f64>,
    order: Order,
    groups: Vec<Group>,
    split: usize,
}

impl<const D: usize> Mesh<D> {
    /// The mesh without the cells of those groups of dimension `D` that are not `whole`; their names stay.
    pub fn told(&self, whole: impl Fn(&str) -> bool) -> Told {
        let groups = self.groups.iter().map(|group| match group.dimension == D && !whole(&group.name) {
            true => Group { name: group.name.clone(), connectivity: Vec::new(), tags: Vec::new(), ..*group },
            false => Group { tags: Vec::new(), ..group.clone() },
        });
        Told {
            path: self.path.clone(),
            points: self.points.as_flattened().to_vec(),
            order: self.order,
            groups: groups.collect(),
            split: self.split,
        }
    }

    /// The mesh that was told.
    pub fn of(told: Told) -> Self {
        let Told { path, points, order, groups, split } = told;
        let points = points.chunks_exact(D).map(|x| std::array::from_fn(|c| x[c])).collect();
        Self { path, points, order, groups: Groups::from(groups), split }
    }
}
