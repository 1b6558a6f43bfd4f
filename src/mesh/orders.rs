//! The order of the elements of a file.
//!
//! Some programs write the boundary of quadratic cells as linear lines and facets. These get the mid-edge nodes of the cells.

use super::check::EDGES;
use super::cursor::Cursor;
use super::groups::Group;
use crate::error::Result;
use crate::problem::order::Order;
use std::collections::HashMap;

/// The first elements of each dimension.
#[derive(Default)]
pub struct Orders([Option<First>; 4]);

/// The order of some elements, with their position in the file and the name of a group with them.
struct First {
    order: Order,
    position: usize,
    name: String,
}

impl Orders {
    /// Record elements of a dimension and an order that stand at `position` and belong to the group `name`.
    ///
    /// # Errors
    /// The elements of this dimension before them are of another order.
    pub fn add(&mut self, cursor: &Cursor, dimension: usize, order: Order, position: usize, name: &str) -> Result<()> {
        let new = First { order, position, name: name.to_owned() };
        match self.0[dimension].get_or_insert(First { name: name.to_owned(), ..new }).order == order {
            true => Ok(()),
            false => new.refuse(cursor),
        }
    }

    /// Return the order of the cells, which have the dimension `space`, or `None` if there are none.
    ///
    /// # Errors
    /// Elements of a lower dimension are of a higher order.
    pub fn of_cells(&self, cursor: &Cursor, space: usize) -> Result<Option<Order>> {
        let Some(order) = self.0[space].as_ref().map(|first| first.order) else { return Ok(None) };
        match self.0[..space].iter().flatten().find(|first| first.order > order) {
            Some(first) => first.refuse(cursor),
            None => Ok(Some(order)),
        }
    }
}

impl First {
    fn refuse<T>(&self, cursor: &Cursor) -> Result<T> {
        let message = format!("group `{}` is of another order than other elements", self.name);
        let help = "save all elements with one order: gmsh -order 1 or 2";
        Err(cursor.error_at(self.position, message).help(help))
    }
}

/// Give linear elements below the dimension `space` of quadratic cells the mid-edge nodes of the cells. Elements that are no
/// edges or facets of cells get new nodes, with straight edges.
pub fn raise(groups: &mut [Group], points: &mut Vec<[f64; 3]>, space: usize) {
    let is_linear = |group: &&mut Group| group.dimension > 0 && group.stride == group.dimension + 1;
    let mut of_edge: HashMap<[u32; 2], u32> = HashMap::new();
    if !groups.iter_mut().any(|group| is_linear(&group)) {
        return;
    }
    for cell in groups.iter().filter(|group| group.dimension == space).flat_map(Group::simplices) {
        let middles = EDGES.iter().zip(&cell[space + 1..]);
        of_edge.extend(middles.map(|([a, b], middle)| (sorted([cell[*a], cell[*b]]), *middle)));
    }
    for group in groups.iter_mut().filter(is_linear) {
        let (vertices, edges) = (group.stride, group.dimension * (group.dimension + 1) / 2);
        let mut connectivity = Vec::with_capacity(group.len() * (vertices + edges));
        for simplex in group.simplices() {
            connectivity.extend_from_slice(simplex);
            for [a, b] in &EDGES[..edges] {
                let ends = sorted([simplex[*a], simplex[*b]]);
                connectivity.push(*of_edge.entry(ends).or_insert_with(|| straight(points, ends)));
            }
        }
        (group.stride, group.connectivity) = (vertices + edges, connectivity);
    }
}

fn sorted(mut ends: [u32; 2]) -> [u32; 2] {
    ends.sort_unstable();
    ends
}

/// Append the point in the middle between two others, and return its number.
fn straight(points: &mut Vec<[f64; 3]>, ends: [u32; 2]) -> u32 {
    let [a, b] = ends.map(|end| points[end as usize]);
    points.push(std::array::from_fn(|c| 0.5 * (a[c] + b[c])));
    (points.len() - 1) as u32
}
