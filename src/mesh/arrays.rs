//! Meshes from the arrays of a Rust program.

use super::{Group, Mesh, groups, simplex};
use crate::error::{Error, Result};
use crate::problem::body::plain;
use crate::problem::{GroupArrays, MeshArrays, Order};
use std::path::Path;

/// Name in messages, where meshes from files have their path.
const NAME: &str = "mesh arrays";

/// Return the mesh of these arrays, with cells turned to positive volume. Points keep their numbers. A mesh of order 1
/// gets straight edges with middles if `order` is above.
///
/// # Errors
/// A coordinate is not finite, or a point is off the plane if `D` is 2. A group has no name or no simplices, or two
/// groups have the same name. A group has numbers of points that do not exist, simplices without extent, or a dimension
/// above `D`.
pub fn mesh<const D: usize>(arrays: &MeshArrays, order: Order) -> Result<Mesh<D>> {
    let MeshArrays { points, order: own, groups } = arrays;
    if *own > Order::highest(D) {
        let message = format!("simplices have the order {}, in space at most {}", own.degree(), Order::P2.degree());
        return Err(refuse_arrays(message).help("give the points of order 2: corners and mid-edges"));
    }
    let largest = points.iter().flatten().fold(0.0_f64, |size, x| size.max(x.abs()));
    if let Some(number) = points.iter().position(|x| x.iter().any(|x| !x.is_finite())) {
        return Err(refuse_arrays(format!("point {number} has the coordinates {:?}", points[number])));
    }
    if let Some(number) = points.iter().position(|x| D == 2 && x[2].abs() > 1e-12 * largest) {
        let message = format!("point {number} has z = {}, but the scene has dimension 2", points[number][2]);
        return Err(refuse_arrays(message).help("draw plane bodies in the plane z = 0"));
    }
    let groups = groups.iter().map(|group| group_of::<D>(group, points, *own)).collect::<Result<Vec<_>>>()?;
    if let Some(twice) = groups::twice(&groups) {
        return Err(refuse_arrays(format!("two groups are called `{twice}`")));
    }
    let points = points.iter().map(|x| std::array::from_fn(|c| x[c])).collect();
    let mesh = Mesh::new(NAME.into(), points, *own, groups.into());
    Ok(if *own == Order::P1 && order > Order::P1 { mesh.higher_order(Order::P2) } else { mesh })
}

fn group_of<const D: usize>(arrays: &GroupArrays, points: &[[f64; 3]], order: Order) -> Result<Group> {
    let GroupArrays { name, dimension, connectivity } = arrays;
    let stride = simplex::stride(*dimension, Some(order));
    let refuse = |what: String| refuse_arrays(format!("group `{name}` {what}"));
    if name.is_empty() || *dimension > D {
        return Err(refuse(format!("is of dimension {dimension}"))
            .help(format!("groups have names, and dimensions from 0, points, to {D}, cells")));
    }
    if connectivity.is_empty() || connectivity.len() % stride != 0 {
        let count = connectivity.len();
        return Err(refuse(format!("has {count} numbers of points, its simplices have {stride} each"))
            .help("give one number a corner, and for order k the k - 1 points inside each edge, too"));
    }
    if let Some(number) = connectivity.iter().find(|number| **number as usize >= points.len()) {
        return Err(
            refuse(format!("has point {number}")).help(format!("there are {} points, numbered from 0", points.len()))
        );
    }
    let mut connectivity = connectivity.clone();
    for (index, simplex) in connectivity.chunks_exact_mut(stride).enumerate() {
        if !simplex::turn(simplex, points, *dimension, D) {
            return Err(refuse(format!("has no extent in its simplex {index}, of the points {simplex:?}")));
        }
    }
    let tags = (0..(connectivity.len() / stride) as u64).collect();
    let name = if *dimension == D { plain(name) } else { name.clone() };
    Ok(Group { name, dimension: *dimension, stride, connectivity, tags })
}

fn refuse_arrays(message: impl Into<String>) -> Error {
    Error::mesh(Path::new(NAME), None, message)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Return two triangles of the unit square, with the second one inverted, and its lower side.
    fn square() -> MeshArrays {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [9.0, 9.0, 0.0]];
        MeshArrays::new(points).group("all", 2, vec![0, 1, 2, 0, 3, 2]).group("low", 1, vec![1, 0])
    }

    #[test]
    fn cells_are_turned_and_points_keep_their_numbers() {
        let mesh = mesh::<2>(&square(), Order::P1).expect("a mesh");
        assert_eq!(mesh.group("all").expect("cells").connectivity, [0, 1, 2, 0, 2, 3]);
        assert_eq!(mesh.group("low").expect("a side").connectivity, [1, 0]);
        assert_eq!(mesh.points.len(), 5);
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let bad = |change: fn(&mut MeshArrays), order: Order, words: &str| {
            let mut arrays = square();
            change(&mut arrays);
            let error = mesh::<2>(&arrays, order).expect_err(words);
            assert!(error.to_string().contains(words), "{error}");
        };
        bad(|a| a.points[2][0] = f64::NAN, Order::P1, "point 2 has the coordinates [NaN");
        bad(|a| a.points[3][2] = 1e-3, Order::P1, "point 3 has z = 0.001");
        bad(|a| a.groups[1].name = "all".into(), Order::P1, "two groups are called `all`");
        bad(|a| a.groups[1].name.clear(), Order::P1, "groups have names");
        bad(|a| a.groups[0].dimension = 3, Order::P1, "`all` is of dimension 3");
        bad(|a| a.groups[0].connectivity.clear(), Order::P1, "0 numbers of points");
        bad(|a| a.groups[0].connectivity.truncate(5), Order::P1, "5 numbers of points, its simplices have 3");
        bad(|a| a.groups[0].connectivity[4] = 7, Order::P1, "has point 7");
        bad(|a| a.groups[0].connectivity[1] = 0, Order::P1, "simplex 0, of the points [0, 0, 2]");
        bad(|a| a.order = Order::P2, Order::P2, "simplices have 3 each");
        let third = Order::new(3).expect("an order");
        let solid = MeshArrays { order: third, ..square() };
        assert!(mesh::<2>(&solid, third).expect_err("nine points").to_string().contains("simplices have 9 each"));
        let error = super::mesh::<3>(&solid, third).expect_err("order 3 in space").to_string();
        assert!(error.contains("simplices have the order 3, in space at most 2"), "{error}");
    }
}
