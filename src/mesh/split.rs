//! The division of quadrangles, hexahedra, prisms and pyramids into triangles and tetrahedra.
//!
//! Every cell is the cone from its vertex with the smallest number over the faces without that vertex. A quadrangle is
//! the cone from its smallest vertex over the edges without it. The diagonal of a quadrangle therefore depends on the
//! numbers of its vertices alone, so that cells of any kind agree on common faces.
//!
//! Cells of higher orders get nodes on the diagonals. A diagonal of a face has them where the map that blends the edges
//! of the face takes the diagonal of the reference square, and a diagonal through a quadratic cell has one where the
//! map of the cell takes the centre of the reference cube. The boundary of the simplices is thus interpolated from that
//! of the cells.

use super::shape::turned;
use super::simplex::{EDGES, ElementType, QUADRANGLE, Shape};
use smallvec::SmallVec;
use std::collections::HashMap;

/// Return the quadrangular faces of a shape. A quadrangle has one, itself.
fn quadrangles(shape: &Shape) -> impl Iterator<Item = &'static [usize]> {
    let faces: &[&[usize]] = if shape.dimension == 2 { &[&[0, 1, 2, 3]] } else { shape.faces };
    faces.iter().copied().filter(|face| face.len() == 4)
}

/// Return the simplices of a cell, `dimension + 1` vertices each, with any orientation. The vertices are the first
/// nodes of `cell`. Simplices in which a vertex occurs twice, since an edge was drawn into a point, are omitted.
fn divided(shape: &Shape, cell: &[u32]) -> Vec<u32> {
    let faces: Vec<Vec<u32>> = shape.faces.iter().map(|face| face.iter().map(|&at| cell[at]).collect()).collect();
    let all_differ =
        |simplex: &Vec<u32>| simplex.iter().enumerate().all(|(at, vertex)| !simplex[..at].contains(vertex));
    cone(&cell[..shape.corners], &faces).into_iter().filter(all_differ).flatten().collect()
}

/// Return the cone from the smallest vertex of a cell over its faces without this vertex.
fn cone(cell: &[u32], faces: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let Some(&apex) = cell.iter().min() else { return Vec::new() };
    let mut simplices = Vec::new();
    for face in faces.iter().filter(|face| !face.contains(&apex)) {
        let parts = if face.len() == 4 {
            let edges: Vec<Vec<u32>> = QUADRANGLE.edges.iter().map(|edge| edge.map(|at| face[at]).to_vec()).collect();
            cone(face, &edges)
        } else {
            vec![face.clone()]
        };
        simplices.extend(parts.into_iter().map(|part| [&[apex][..], &part].concat()));
    }
    simplices
}

/// The maker of the nodes in the middle of diagonals. Faces are known by their vertices, so that all cells and facets
/// at a face share its node. So do copies of a cell in several groups.
pub struct Middles<'a> {
    /// Coordinates of all points, to which new ones are appended.
    pub points: &'a mut Vec<[f64; 3]>,
    /// The first node of each divided face by its sorted vertices, and of each divided hexahedron by the ends of its
    /// diagonal, each twice. Further ones follow, from the end with the smaller number.
    pub known: &'a mut HashMap<[u32; 4], u32>,
}

impl Middles<'_> {
    /// Return the simplices of a cell with the nodes `cell`, with any orientation, each with vertices before mid-edge
    /// nodes.
    pub fn simplices(&mut self, kind: ElementType, cell: &[u32]) -> Vec<u32> {
        let Shape { dimension, .. } = *kind.shape;
        let vertices = divided(kind.shape, cell);
        if kind.inside() == 0 {
            return vertices;
        }
        let mut simplices = Vec::new();
        for simplex in vertices.chunks_exact(dimension + 1) {
            simplices.extend_from_slice(simplex);
            for [a, b] in &EDGES[..dimension * (dimension + 1) / 2] {
                simplices.extend(self.inside(kind, cell, [simplex[*a], simplex[*b]]));
            }
        }
        simplices
    }

    /// Return the nodes between two vertices of a cell with the nodes `cell`, from the first to the second one.
    ///
    /// Edges come first, since a diagonal of a face is an edge of the cell where another edge of the face was drawn
    /// into a point. For the same reason faces come before the cell.
    fn inside(&mut self, kind: ElementType, cell: &[u32], ends: [u32; 2]) -> SmallVec<[u32; 2]> {
        let (shape, count) = (kind.shape, kind.inside() as u32);
        if let Some(nodes) = on_edge(kind, cell, ends) {
            return nodes;
        }
        let in_middle = shape.corners + shape.edges.len();
        let has_ends = |face: &&[usize]| ends.iter().all(|end| face.iter().any(|at| cell[*at] == *end));
        let (mut key, face, given) = match quadrangles(shape).enumerate().find(|(_, face)| has_ends(face)) {
            Some((number, face)) => ([0, 1, 2, 3].map(|at| cell[face[at]]), Some(face), cell.get(in_middle + number)),
            None => ([ends[0], ends[0], ends[1], ends[1]], None, cell[in_middle..].last()),
        };
        key.sort_unstable();
        let known = self.known.get(&key).or(given.filter(|_| count == 1)).copied();
        let first = known.unwrap_or_else(|| {
            let first = self.points.len() as u32;
            for k in 0..count as usize {
                let terms = face.map_or_else(|| in_centre(shape, cell), |face| on_face(kind, cell, face, ends, k));
                let sum = |c| terms.iter().map(|&(weight, node)| weight * self.points[node as usize][c]).sum();
                let place = std::array::from_fn(sum);
                self.points.push(place);
            }
            first
        });
        self.known.insert(key, first);
        turned(&(first..first + count).collect::<Vec<_>>(), ends[0] > ends[1])
    }
}

/// Return the nodes inside an edge of a cell from its first to its second end, if the ends belong to an edge.
fn on_edge(kind: ElementType, cell: &[u32], ends: [u32; 2]) -> Option<SmallVec<[u32; 2]>> {
    let of_edge = |[a, b]: [usize; 2]| [cell[a], cell[b]];
    let is_edge = |edge: &[usize; 2]| [ends, [ends[1], ends[0]]].contains(&of_edge(*edge));
    let (edge, count) = (kind.shape.edges.iter().position(is_edge)?, kind.inside());
    let nodes = &cell[kind.shape.corners + edge * count..][..count];
    Some(turned(nodes, of_edge(kind.shape.edges[edge]) != ends))
}

/// Return the weights of nodes in point `k` of the diagonal of a face, from its end with the smaller number: where the
/// map that blends the edges takes the diagonal of the reference square. In the centre they are -1/4 of each vertex
/// and 1/2 of each mid-edge node.
fn on_face(kind: ElementType, cell: &[u32], face: &[usize], ends: [u32; 2], k: usize) -> Vec<(f64, u32)> {
    let from = face.iter().position(|&at| cell[at] == ends[0].min(ends[1])).unwrap_or(0);
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| cell[face[(from + i) % 4]]);
    let s = (k + 1) as f64 / (kind.inside() + 1) as f64;
    let edges = [(1.0 - s, [a, b]), (s, [b, c]), (1.0 - s, [a, d]), (s, [d, c])];
    let on_edges = edges.into_iter().filter_map(|(weight, ends)| Some((weight, on_edge(kind, cell, ends)?[k])));
    let at_vertices = [((1.0 - s) * (s - 1.0), a), (s * (s - 1.0), b), (-s * s, c), (s * (s - 1.0), d)];
    on_edges.chain(at_vertices).collect()
}

/// Return the weights of the nodes of a quadratic hexahedron in its centre.
fn in_centre(shape: &Shape, cell: &[u32]) -> Vec<(f64, u32)> {
    let weight = |at: usize| if at < shape.corners { -0.25 } else { 0.25 };
    (0..shape.corners + shape.edges.len()).map(|at| (weight(at), cell[at])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::simplex::{HEXAHEDRON, PRISM, PYRAMID, measure};
    use std::collections::BTreeMap;

    /// Corners of the unit cube in Gmsh's order.
    const CUBE: [[f64; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];

    /// Return six times the volume of the pieces of a cell, and the number of pieces that have each triangle as a face.
    fn pieces(kind: &Shape, cell: &[u32], points: &[[f64; 3]]) -> (f64, BTreeMap<Vec<u32>, usize>) {
        let (mut volume, mut faces) = (0.0, BTreeMap::new());
        for tetrahedron in divided(kind, cell).chunks_exact(4) {
            volume += measure(&[0, 1, 2, 3].map(|at| points[tetrahedron[at] as usize]), 3).abs();
            for left in 0..4 {
                let mut face: Vec<u32> = tetrahedron.iter().copied().filter(|v| *v != tetrahedron[left]).collect();
                face.sort_unstable();
                *faces.entry(face).or_insert(0) += 1;
            }
        }
        (volume, faces)
    }

    /// Whatever the numbers of the vertices, the pieces fill the cell, and those of two cells have the same triangles
    /// on the common face. The points are those of a cube and, beside its face x = 1, of a prism with the vertices 1 2
    /// 6 5 8 9.
    #[test]
    fn pieces_fill_cells_and_fit_across_faces() {
        let named = [&CUBE[..], &[[2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [3.0, 0.5, 0.5], [0.0; 3]]].concat();
        let mut seed = 7_u64;
        for _ in 0..500 {
            let mut order: Vec<u32> = (0..12).collect();
            for at in (1..12).rev() {
                seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                order.swap(at, (seed >> 33) as usize % (at + 1));
            }
            let mut points = vec![[0.0; 3]; 12];
            order.iter().zip(&named).for_each(|(&at, x)| points[at as usize] = *x);
            let of = |vertices: &[usize]| vertices.iter().map(|&v| order[v]).collect::<Vec<_>>();
            let common = of(&[1, 2, 5, 6]);
            let shared = |faces: &BTreeMap<Vec<u32>, usize>| -> Vec<Vec<u32>> {
                faces.keys().filter(|face| face.iter().all(|v| common.contains(v))).cloned().collect()
            };
            let (cube, of_cube) = pieces(&HEXAHEDRON, &of(&[0, 1, 2, 3, 4, 5, 6, 7]), &points);
            // A triangle inside the cube is a face of two pieces. A cube has 12 triangles on its boundary.
            assert!((cube - 6.0).abs() < 1e-12 && shared(&of_cube).len() == 2);
            assert!(
                of_cube.values().filter(|&&count| count == 1).count() == 12
                    && of_cube.values().all(|&count| count <= 2)
            );
            for (shape, vertices, volume) in
                [(&PRISM, &[2, 9, 6, 1, 8, 5][..], 3.0), (&PYRAMID, &[2, 6, 5, 1, 10], 4.0)]
            {
                let (found, faces) = pieces(shape, &of(vertices), &points);
                assert!((found - volume).abs() < 1e-12 && shared(&faces) == shared(&of_cube));
            }
            for triangle in divided(&QUADRANGLE, &of(&[1, 2, 6, 5])).chunks_exact_mut(3) {
                triangle.sort_unstable();
                assert!(shared(&of_cube).contains(&triangle.to_vec()));
            }
        }
        let (volume, _) = pieces(&HEXAHEDRON, &[0, 1, 2, 2, 4, 5, 6, 6], &CUBE);
        assert!((volume - 3.0).abs() < 1e-12, "an edge drawn into a point");
    }

    /// Cells of all kinds use the same node on a common face, which a full kind has among its own.
    #[test]
    fn faces_have_one_node() {
        let kind = |number| ElementType::of(number).expect("a kind");
        let order: Vec<u32> = (0..20).collect();
        let middle = |[a, b]: &[usize; 2]| [0, 1, 2].map(|c| 0.5 * (CUBE[*a][c] + CUBE[*b][c]));
        let bent = |[a, b, c]: [f64; 3]| [a + 0.3 * b * c, b, c + 0.2 * a * b];
        let mut points: Vec<_> = CUBE.into_iter().chain(HEXAHEDRON.edges.iter().map(middle)).map(bent).collect();
        let mut middles = Middles { points: &mut points, known: &mut HashMap::new() };
        let cell = middles.simplices(kind(17), &order);
        assert_eq!(cell, middles.simplices(kind(17), &order), "a copy in another group");
        assert_eq!(middles.points.len(), 27, "six faces and the cell");
        // The face 0 3 2 1 has the mid-edge nodes 9 13 11 8.
        let facet = middles.simplices(kind(16), &[0, 3, 2, 1, 9, 13, 11, 8]);
        let node = middles.known[&[0, 1, 2, 3]];
        assert_eq!(facet.iter().filter(|number| **number == node).count(), 2);
        let [x, y, z] = middles.points[node as usize];
        assert!((x - 0.5).abs() + (y - 0.5).abs() + (z - 0.05).abs() < 1e-15);
        let full = middles.simplices(kind(10), &[2, 3, 7, 6, 13, 15, 19, 14, 99]);
        assert!(!full.contains(&99), "the node that the hexahedron has made");
        // With an edge drawn into a point a hexahedron is a prism: 3 and 7 are 2 and 6, and with them go the mid-edge
        // nodes of 0 3, 2 3, 3 7, 4 7, 6 7.
        let sorted = |simplices: Vec<u32>| {
            let mut all: Vec<Vec<u32>> = simplices.chunks_exact(10).map(<[u32]>::to_vec).collect();
            all.iter_mut().for_each(|simplex| simplex.sort_unstable());
            all.sort_unstable();
            all
        };
        let drawn = [0, 1, 2, 2, 4, 5, 6, 6, 8, 9, 10, 11, 12, 2, 14, 14, 16, 17, 18, 6];
        let hexahedron = sorted(middles.simplices(kind(17), &drawn));
        let prism = sorted(middles.simplices(kind(18), &[0, 1, 2, 4, 5, 6, 8, 9, 10, 11, 12, 14, 16, 17, 18]));
        assert_eq!((hexahedron, prism.len()), (prism.clone(), 3));
    }
}
