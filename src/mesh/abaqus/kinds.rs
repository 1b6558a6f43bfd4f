//! The types of elements of Abaqus and CalculiX, and how Gmsh numbers and orders them.

/// A shape of elements with corners numbered from 0.
#[derive(Debug, PartialEq, Eq)]
pub struct Shape {
    /// Dimension, 1 to 3.
    pub dimension: usize,
    /// Number of corners.
    pub corners: usize,
    /// Corners of the faces S1, S2, ... in the order of Abaqus. In the plane these are edges.
    pub faces: &'static [&'static [usize]],
    /// Ends of the edges in the order in which Abaqus numbers their middle nodes.
    edges: &'static [[usize; 2]],
    /// The same edges in the order of Gmsh.
    gmsh_edges: &'static [[usize; 2]],
    /// Gmsh's numbers of the linear and the quadratic element.
    numbers: [u8; 2],
}

pub const LINE: Shape =
    Shape { dimension: 1, corners: 2, faces: &[], edges: &[[0, 1]], gmsh_edges: &[[0, 1]], numbers: [1, 8] };

pub const TRIANGLE: Shape = Shape {
    dimension: 2,
    corners: 3,
    faces: &[&[0, 1], &[1, 2], &[2, 0]],
    edges: &[[0, 1], [1, 2], [2, 0]],
    gmsh_edges: &[[0, 1], [1, 2], [2, 0]],
    numbers: [2, 9],
};

pub const QUADRANGLE: Shape = Shape {
    dimension: 2,
    corners: 4,
    faces: &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    gmsh_edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    numbers: [3, 16],
};

const TETRAHEDRON: Shape = Shape {
    dimension: 3,
    corners: 4,
    faces: &[&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0]],
    edges: &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
    gmsh_edges: &[[0, 1], [1, 2], [2, 0], [0, 3], [2, 3], [1, 3]],
    numbers: [4, 11],
};

const PYRAMID: Shape = Shape {
    dimension: 3,
    corners: 5,
    faces: &[&[0, 1, 2, 3], &[0, 4, 1], &[1, 4, 2], &[2, 4, 3], &[3, 4, 0]],
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]],
    gmsh_edges: &[[0, 1], [0, 3], [0, 4], [1, 2], [1, 4], [2, 3], [2, 4], [3, 4]],
    numbers: [7, 19],
};

const PRISM: Shape = Shape {
    dimension: 3,
    corners: 6,
    faces: &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]],
    edges: &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]],
    gmsh_edges: &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 5], [4, 5]],
    numbers: [6, 18],
};

const HEXAHEDRON: Shape = Shape {
    dimension: 3,
    corners: 8,
    faces: &[&[0, 1, 2, 3], &[4, 7, 6, 5], &[0, 4, 5, 1], &[1, 5, 6, 2], &[2, 6, 7, 3], &[3, 7, 4, 0]],
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]],
    gmsh_edges: &[[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]],
    numbers: [5, 17],
};

impl Shape {
    /// Return the index of the middle node of an edge in an element of Abaqus.
    fn middle(&self, a: usize, b: usize) -> Option<usize> {
        let at = self.edges.iter().position(|&edge| edge == [a, b] || edge == [b, a])?;
        Some(self.corners + at)
    }

    /// Return the shape with this dimension and number of corners.
    pub fn of(dimension: usize, corners: usize) -> Option<&'static Shape> {
        const ALL: [&Shape; 7] = [&LINE, &TRIANGLE, &QUADRANGLE, &TETRAHEDRON, &PYRAMID, &PRISM, &HEXAHEDRON];
        ALL.into_iter().find(|shape| shape.dimension == dimension && shape.corners == corners)
    }
}

/// A shape with or without middle nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    /// The shape.
    pub shape: &'static Shape,
    /// Whether there is a node in the middle of each edge.
    pub is_quadratic: bool,
}

/// What the program makes of a type of elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Elements of this kind are cells in their own dimension, and facets or edges in a higher one.
    Mesh(Kind),
    /// Elements without a place in the mesh, such as springs.
    LeftOut,
    /// Solids that cannot be read. Without them the body would have holes.
    Refused,
}

impl Kind {
    /// Return the number of nodes.
    pub fn nodes(self) -> usize {
        self.shape.corners + if self.is_quadratic { self.shape.edges.len() } else { 0 }
    }

    /// Return Gmsh's number.
    pub fn number(self) -> u8 {
        self.shape.numbers[usize::from(self.is_quadratic)]
    }

    /// Return the nodes of an element in the order of Gmsh.
    pub fn in_gmsh_order(self, nodes: &[u64]) -> Vec<u64> {
        let mut ordered = nodes[..self.shape.corners].to_vec();
        if self.is_quadratic {
            let middle = |edge: &[usize; 2]| self.shape.middle(edge[0], edge[1]).map(|at| nodes[at]);
            ordered.extend(self.shape.gmsh_edges.iter().filter_map(middle));
        }
        ordered
    }

    /// Return a face of an element, numbered from 0: its kind, and its nodes in the order of Gmsh, corners first.
    pub fn face(self, nodes: &[u64], number: usize) -> Option<(Kind, Vec<u64>)> {
        let corners = *self.shape.faces.get(number)?;
        let shape = Shape::of(self.shape.dimension - 1, corners.len())?;
        let mut face: Vec<u64> = corners.iter().map(|&at| nodes[at]).collect();
        if self.is_quadratic {
            let ends = shape.edges.iter().map(|edge| edge.map(|at| corners[at]));
            face.extend(ends.filter_map(|[a, b]| self.shape.middle(a, b)).map(|at| nodes[at]));
        }
        Some((Kind { shape, is_quadratic: self.is_quadratic }, face))
    }

    /// Return the edges of an element: two ends, and the middle node if there is one.
    pub fn edges(self, nodes: &[u64]) -> Vec<Vec<u64>> {
        let edge = |(at, [a, b]): (usize, &[usize; 2])| {
            let middle = self.is_quadratic.then(|| nodes[self.shape.corners + at]);
            [nodes[*a], nodes[*b]].into_iter().chain(middle).collect()
        };
        self.shape.edges.iter().enumerate().map(edge).collect()
    }
}

/// Families of elements by the beginning of their names, with their dimension. The number of nodes follows.
const FAMILIES: [(&str, usize); 24] = [
    ("C3D", 3),
    ("DC3D", 3),
    ("SC", 3),
    ("CPS", 2),
    ("CPE", 2),
    ("CPEG", 2),
    ("CAX", 2),
    ("CGAX", 2),
    ("DC2D", 2),
    ("DCAX", 2),
    ("S", 2),
    ("DS", 2),
    ("STRI", 2),
    ("M3D", 2),
    ("SFM3D", 2),
    ("R3D", 2),
    ("T2D", 1),
    ("T3D", 1),
    ("R2D", 1),
    ("RAX", 1),
    ("B2", 1),
    ("B3", 1),
    ("SAX", 1),
    ("MAX", 1),
];

impl Role {
    /// Return what the elements of a type are.
    pub fn of(name: &str) -> Role {
        let name = name.to_ascii_uppercase();
        let begins =
            |family: &str| name.strip_prefix(family).filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        let matching = FAMILIES.iter().filter_map(|&(family, dimension)| Some((family, dimension, begins(family)?)));
        let Some((family, dimension, rest)) = matching.max_by_key(|(family, ..)| family.len()) else {
            return Role::LeftOut;
        };
        let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
        let nodes = match (family, digits.as_str()) {
            // Beams are named by the order of their interpolation, STRI65 by nodes and dofs.
            ("B2" | "B3" | "SAX" | "MAX", "2") => 3,
            ("B2" | "B3" | "SAX" | "MAX", _) => 2,
            ("STRI", "65") => 6,
            (_, digits) => digits.parse().unwrap_or(0),
        };
        let orders = |is_quadratic| move |shape: &'static Shape| Kind { shape, is_quadratic };
        let shapes = (2..=8).filter_map(|corners| Shape::of(dimension, corners));
        let mut kinds = shapes.clone().map(orders(false)).chain(shapes.map(orders(true)));
        match kinds.find(|kind| kind.nodes() == nodes) {
            Some(kind) => Role::Mesh(kind),
            None if dimension == 3 || name.starts_with('C') => Role::Refused,
            None => Role::LeftOut,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_give_shapes() {
        let of = |name: &str| match Role::of(name) {
            Role::Mesh(kind) => (kind.shape.dimension, i32::from(kind.number())),
            Role::LeftOut => (0, 0),
            Role::Refused => (0, -1),
        };
        for (names, expected) in [
            ("C3D4 c3d4h DC3D4", (3, 4)),
            ("C3D10 C3D10M C3D10I", (3, 11)),
            ("C3D8 C3D8R C3D8I SC8R DC3D8", (3, 5)),
            ("C3D20 C3D20R C3D20RH", (3, 17)),
            ("C3D6 SC6R", (3, 6)),
            ("C3D15", (3, 18)),
            ("C3D5", (3, 7)),
            ("CPS3 CAX3 CPEG3 S3R STRI3 M3D3 R3D3 SFM3D3", (2, 2)),
            ("CPS6M CAX6 S6 STRI65 M3D6", (2, 9)),
            ("CPS4R CPE4H S4R5 R3D4 DS4", (2, 3)),
            ("CPS8R CAX8 S8R", (2, 16)),
            ("T3D2 T2D2 B31 B31H B21 B23 SAX1 R2D2", (1, 1)),
            ("T3D3 B32R B22 SAX2", (1, 8)),
            ("SPRINGA MASS ROTARYI GAPUNI CONN3D2 DASHPOTA D DCOUP3D F3D8R COH3D8 U1 S9R5", (0, 0)),
            ("C3D27 CPS5", (0, -1)),
        ] {
            names.split(' ').for_each(|name| assert_eq!(of(name), expected, "{name}"));
        }
    }

    /// The middle node of an edge has the number 10 a + b for its ends a < b, wherever it stands.
    #[test]
    fn middle_nodes_stay_between_their_ends() {
        for name in ["T3D3", "CPS6", "CPS8", "C3D10", "C3D15", "C3D20"] {
            let Role::Mesh(kind) = Role::of(name) else { panic!("{name}") };
            let shape = kind.shape;
            let number = |a: usize, b: usize| 10 * (a.min(b) as u64 + 1) + a.max(b) as u64 + 1;
            let mut nodes: Vec<u64> = (1..=shape.corners as u64).collect();
            nodes.extend(shape.edges.iter().map(|&[a, b]| number(a, b)));
            let ordered = kind.in_gmsh_order(&nodes);
            assert_eq!(ordered.len(), kind.nodes(), "{name}");
            for (middle, &[a, b]) in ordered[shape.corners..].iter().zip(shape.gmsh_edges) {
                assert_eq!(*middle, number(a, b), "{name}");
            }
            for face in 0..shape.faces.len() {
                let (kind, face) = kind.face(&nodes, face).unwrap();
                let corner = |at: usize| face[at] as usize - 1;
                for (middle, &[a, b]) in face[kind.shape.corners..].iter().zip(kind.shape.edges) {
                    assert_eq!(*middle, number(corner(a), corner(b)), "{name}");
                }
            }
        }
    }
}
