//! Faces and edges of cells by their corners, to find those that shells, membranes and trusses lie on.

use super::kinds::{Kind, LINE};
use super::model::Model;
use std::collections::HashMap;

/// A facet or edge in the form of a mesh: its kind and nodes, in the order of Gmsh.
pub type Piece = (Kind, Vec<u64>);

/// Corners in ascending order, with zeros before them.
type Corners = [u64; 4];

/// A face of a cell.
struct Place {
    cell: u64,
    face: usize,
    /// Number of cells that have the face.
    cells: usize,
}

/// The faces of all cells, and in space their edges where these are asked for.
pub struct Faces<'a> {
    model: &'a Model,
    places: HashMap<Corners, Place>,
    edges: HashMap<Corners, Vec<u64>>,
}

impl<'a> Faces<'a> {
    /// Collect the faces of the cells of a dimension. Edges are collected in space if `with_edges`.
    pub fn new(model: &'a Model, dimension: usize, with_edges: bool) -> Self {
        let mut faces = Self { model, places: HashMap::new(), edges: HashMap::new() };
        for (&cell, element) in &model.elements {
            let Some(kind) = element.kind.filter(|kind| kind.shape.dimension == dimension) else { continue };
            for face in 0..kind.shape.faces.len() {
                let Some((piece, nodes)) = kind.face(&element.nodes, face) else { continue };
                let key = corners(&nodes[..piece.shape.corners]);
                faces.places.entry(key).or_insert(Place { cell, face, cells: 0 }).cells += 1;
            }
            if with_edges && dimension == 3 {
                let edges = kind.edges(&element.nodes);
                faces.edges.extend(edges.into_iter().map(|nodes| (corners(&nodes[..2]), nodes)));
            }
        }
        faces
    }

    /// Return the faces of a cell that no other cell has.
    pub fn free(&self, cell: u64) -> Vec<Piece> {
        let Some((kind, element)) = self.model.elements.get(&cell).and_then(|element| Some((element.kind?, element)))
        else {
            return Vec::new();
        };
        let faces = (0..kind.shape.faces.len()).filter_map(|face| kind.face(&element.nodes, face));
        let is_free = |(piece, nodes): &Piece| {
            self.places.get(&corners(&nodes[..piece.shape.corners])).is_some_and(|place| place.cells == 1)
        };
        faces.filter(is_free).collect()
    }

    /// Return the face or edge of a cell that an element of lower dimension lies on, if there is one. Its nodes are those of
    /// the cell, which may have middle nodes that the element does not have.
    pub fn under(&self, kind: Kind, nodes: &[u64]) -> Option<Piece> {
        match nodes {
            // Programs do not agree on the place of the middle node of a line.
            [a, b, c, ..] if kind.shape.dimension == 1 && kind.is_quadratic => {
                let ends = [([a, b], c), ([a, c], b), ([b, c], a)];
                ends.into_iter().find_map(|([a, b], middle)| {
                    self.piece(corners(&[*a, *b])).filter(|(_, nodes)| nodes.get(2) == Some(middle))
                })
            }
            _ => self.piece(corners(&nodes[..kind.shape.corners])),
        }
    }

    fn piece(&self, key: Corners) -> Option<Piece> {
        if let Some(nodes) = self.edges.get(&key) {
            return Some((Kind { shape: &LINE, is_quadratic: nodes.len() == 3 }, nodes.clone()));
        }
        let place = self.places.get(&key)?;
        let element = &self.model.elements[&place.cell];
        element.kind?.face(&element.nodes, place.face)
    }
}

fn corners(nodes: &[u64]) -> Corners {
    let mut key = [0; 4];
    key.iter_mut().zip(nodes).for_each(|(key, node)| *key = *node);
    key.sort_unstable();
    key
}
