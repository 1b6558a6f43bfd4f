//! The surfaces that the page shows: those of bodies after deformation, joined from the parts of all ranks, and those
//! in contact.

use crate::fem::{lagrange, length};
use crate::linalg::bounds;
use crate::output::{BodyField, CellKind, LEGEND, Mark, Role, UnstructuredGrid};
use crate::problem::order::Order;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Faces of a tetrahedron, oriented as seen from outside, with the mid-edges of a quadratic one.
const FACES: [[usize; 6]; 4] = [[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]];

/// Triangles of a body or of a contact surface. The surface of one rank's part of a body ends where the parts of other
/// ranks begin, until [`Surface::join`] has joined them.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Surface {
    /// Name of the body or surface.
    pub name: String,
    /// Index of the body, or of the first body of a contact surface.
    pub body: usize,
    /// Points before deformation.
    points: Vec<[f64; 3]>,
    /// Displacement at each point.
    displacement: Vec<[f64; 3]>,
    /// Von Mises stress at each point, or the contact pressure; NaN where there is none.
    value: Vec<f64>,
    /// Distance of both surfaces at each point where a contact is open; empty for bodies.
    opening: Vec<f64>,
    /// Points of each face: three corners, behind which those of second order have their mid-edges.
    faces: Vec<Vec<u32>>,
    /// Point of the mesh of each point; empty for contact surfaces.
    origin: Vec<u32>,
    /// Marked places by their kind: triangles (three points each), lines (two) and points.
    #[serde(skip)]
    marks: BTreeMap<&'static str, [Vec<u32>; 3]>,
}

impl Surface {
    /// Return the surface of a part of a body: all of its cells in the plane, the faces of one cell alone in space.
    pub fn of_body(field: &BodyField, origin: &[u32]) -> Self {
        let cells = field.connectivity.chunks_exact(field.cell.stride());
        let points = match field.cell {
            CellKind { dimension: 3, order } => 3 * order,
            _ => 0,
        };
        let faces: Vec<Vec<u32>> = match points {
            0 => cells.map(<[u32]>::to_vec).collect(),
            _ => cells.flat_map(|cell| FACES.map(|face| face[..points].iter().map(|&k| cell[k]).collect())).collect(),
        };
        Self {
            name: field.name.clone(),
            points: field.points.clone(),
            displacement: field.displacement.clone(),
            value: field.von_mises.clone(),
            faces: if points > 0 { single(faces) } else { faces },
            origin: origin.to_vec(),
            ..Self::default()
        }
        .without_other_points()
    }

    /// Return the surface of a pair with its pressures.
    pub fn of_contact(grid: UnstructuredGrid, body: usize) -> Self {
        let values = |names: &[&str]| {
            let array = grid.at_points.iter().find(|array| names.contains(&&*array.name));
            array.map_or(Vec::new(), |array| array.values.clone())
        };
        Self {
            displacement: values(&["displacement"]).as_chunks().0.to_vec(),
            value: values(&["pressure", "traction"]),
            opening: values(&["opening"]),
            name: grid.title,
            body,
            points: grid.points,
            faces: grid.connectivity.chunks_exact(grid.cell.stride()).map(<[u32]>::to_vec).collect(),
            ..Self::default()
        }
    }

    /// Return the surface of a body from those of its parts. Parts share points with the same coordinates, and the
    /// faces between them are inside.
    pub fn join(parts: Vec<Self>) -> Self {
        let mut all = Self::default();
        let mut numbers: HashMap<[u64; 3], u32> = HashMap::new();
        for part in parts {
            let mut own = Vec::new();
            let bits: Vec<[u64; 3]> = part.points.iter().map(|x| x.map(f64::to_bits)).collect();
            for (i, place) in bits.iter().enumerate() {
                // points of the same part stay separate, as on both sides of a crack
                own.push(numbers.get(place).copied().unwrap_or_else(|| {
                    all.points.push(part.points[i]);
                    all.displacement.push(part.displacement[i]);
                    all.value.push(part.value[i]);
                    all.origin.push(part.origin[i]);
                    all.points.len() as u32 - 1
                }));
            }
            numbers.extend(bits.into_iter().zip(own.iter().copied()));
            all.faces.extend(part.faces.iter().map(|face| face.iter().map(|&node| own[node as usize]).collect()));
            all.name = part.name;
        }
        let faces = single(std::mem::take(&mut all.faces));
        Self { faces, ..all }.without_other_points()
    }

    /// Return the surface with the points of its faces alone.
    fn without_other_points(mut self) -> Self {
        let (mut number, mut kept) = (vec![u32::MAX; self.points.len()], Vec::new());
        for node in self.faces.iter_mut().flatten() {
            let new = &mut number[*node as usize];
            if *new == u32::MAX {
                *new = kept.len() as u32;
                kept.push(*node as usize);
            }
            *node = *new;
        }
        self.points = kept.iter().map(|&node| self.points[node]).collect();
        self.displacement = kept.iter().map(|&node| self.displacement[node]).collect();
        self.value = kept.iter().map(|&node| self.value[node]).collect();
        self.origin = kept.iter().map(|&node| self.origin[node]).collect();
        self
    }

    /// Mark the places of a body. `is_closed` returns whether contact on a facet carries pressure, from its corners as
    /// points of the mesh.
    pub fn mark<'m>(&mut self, marks: impl Iterator<Item = &'m Mark>, is_closed: &dyn Fn(&[u32]) -> bool) {
        let number: HashMap<u32, u32> = self.origin.iter().copied().zip(0..).collect();
        for mark in marks {
            for simplex in &mark.simplices {
                let nodes: Vec<u32> = simplex.iter().map_while(|point| number.get(point).copied()).collect();
                let corners = mark.corners;
                if nodes.len() < corners {
                    continue;
                }
                let kind = match mark.role {
                    Role::Support => "support",
                    Role::Load => "load",
                    Role::Spring => "spring",
                    Role::Contact if is_closed(&simplex[..corners]) => "closed",
                    Role::Contact => "open",
                };
                let [triangles, lines, points] = self.marks.entry(kind).or_default();
                match nodes[..] {
                    [a] => points.push(a),
                    [a, b] => lines.extend([a, b]),
                    // a quadratic line has its middle last
                    [a, b, middle] if corners == 2 => lines.extend([a, middle, middle, b]),
                    [_, _, _, _, _, _] => triangles.extend(split(nodes.len()).into_iter().map(|k| nodes[k])),
                    _ => triangles.extend(&nodes[..corners]),
                }
            }
        }
    }

    /// Return the numbers of the corners of all triangles; a face of order k has k^2.
    fn triangles(&self) -> Vec<u32> {
        let split = self.faces.first().map_or(Vec::new(), |face| split(face.len()));
        self.faces.iter().flat_map(|face| split.iter().map(|&k| face[k])).collect()
    }

    fn travel(&self) -> impl Iterator<Item = f64> {
        self.displacement.iter().map(|&u| length(u))
    }

    /// Return the numbers of the view, with points relative to `low` (float32, which has too few digits for a small
    /// body far from the origin), and values scaled to the range (uint16).
    fn data(&self, low: [f64; 3], ends: [f64; 2], widest: f64) -> Value {
        let points: Vec<[f64; 3]> = self.points.iter().map(|x| relative(low, x)).collect();
        let floats = |points: &[[f64; 3]]| -> Vec<u8> {
            points.as_flattened().iter().flat_map(|&x| (x as f32).to_le_bytes()).collect()
        };
        json!({
            "name": self.name,
            "body": self.body,
            "points": STANDARD.encode(floats(&points)),
            "displacement": STANDARD.encode(floats(&self.displacement)),
            "value": scaled(&self.value, ends),
            "opening": scaled(&self.opening, [0.0, widest]),
            "triangles": numbers(&self.triangles()),
            "marks": self.marks.iter().map(|(kind, parts)| json!([kind, parts.each_ref().map(|part| numbers(part))])).collect::<Vec<_>>(),
        })
    }
}

/// Return the corners of the triangles into which the equally spaced points of a face cut it, as indices of this number
/// of points.
fn split(points: usize) -> Vec<usize> {
    let order = (1..=Order::HIGHEST)
        .filter_map(Order::new)
        .find(|order| (order.degree() + 1) * (order.degree() + 2) == 2 * points);
    let Some(order) = order else { return Vec::new() };
    let (k, inside) = (order.degree(), order.degree() - 1);
    let mut places = lagrange::equally_spaced(order, 3);
    // files have the edge 20 in this direction
    places[3 + 2 * inside..3 + 3 * inside].reverse();
    let step = |share: f64| (share * k as f64).round() as usize;
    let at: HashMap<[usize; 2], usize> = places.iter().map(|l| [l[1], l[2]].map(step)).zip(0..).collect();
    let mut corners = Vec::new();
    for (a, b) in (0..k).flat_map(|a| (0..k - a).map(move |b| (a, b))) {
        corners.extend([[a, b], [a + 1, b], [a, b + 1]].map(|place| at[&place]));
        if a + b + 1 < k {
            corners.extend([[a + 1, b], [a + 1, b + 1], [a, b + 1]].map(|place| at[&place]));
        }
    }
    corners
}

/// Return values scaled to their range (uint16).
fn scaled(values: &[f64], [least, most]: [f64; 2]) -> String {
    let short = |value: &f64| match value.is_finite() {
        // the least value is that of open contacts, or of closed ones, alone
        true => ((value - least) / (most - least) * f64::from(NONE - 1))
            .round()
            .max(f64::from(u8::from(*value > least))) as u16,
        false => NONE,
    };
    STANDARD.encode(values.iter().map(short).flat_map(u16::to_le_bytes).collect::<Vec<_>>())
}

/// Return the numbers of points or triangles (uint32).
fn numbers(numbers: &[u32]) -> String {
    STANDARD.encode(numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>())
}

/// Return the faces that occur once, whatever the order of their corners.
fn single(faces: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let key = |face: &[u32]| {
        let mut key = [face[0], face[1], face[2]];
        key.sort_unstable();
        key
    };
    let mut count: HashMap<[u32; 3], u8> = HashMap::new();
    faces.iter().for_each(|face| *count.entry(key(face)).or_default() += 1);
    faces.into_iter().filter(|face| count[&key(face)] == 1).collect()
}

/// Marks points without a value.
const NONE: u16 = u16::MAX;

/// Twelve colours from the smallest to the largest value: viridis, which colour-blind readers can follow.
const COLORS: [&str; 12] = [
    "#440154", "#482173", "#433e85", "#38588c", "#2d708e", "#25858e", "#1e9b8a", "#2ab07f", "#52c569", "#86d549",
    "#c2df23", "#fde725",
];

/// Return the numbers of the view of bodies and contact surfaces, which `viewer.js` reads.
pub fn view(bodies: &[Surface], contacts: &[Surface], marks: &[Mark], is_space: bool) -> Value {
    let [low, high] = bounds(bodies.iter().chain(contacts).flat_map(|part| &part.points).copied());
    let stress = range(bodies.iter().flat_map(|part| part.value.iter().copied()));
    let [_, most] = range(contacts.iter().flat_map(|part| part.value.iter().copied()));
    let [_, widest] = range(contacts.iter().flat_map(|part| part.opening.iter().copied()));
    let parts = |parts: &[Surface], ends| parts.iter().map(|part| part.data(low, ends, widest)).collect::<Vec<Value>>();
    json!({
        "bodies": parts(bodies, stress),
        "surfaces": parts(contacts, [0.0, most]),
        "travel": range(bodies.iter().flat_map(Surface::travel)),
        "stress": stress,
        "pressure": [0.0, most],
        "opening": [0.0, widest],
        "origin": low,
        "low": [0.0, 0.0, 0.0],
        "high": relative(low, &high),
        "scale": magnification(bodies),
        "space": is_space,
        "colors": COLORS,
        "roles": roles(marks),
    })
}

/// Return the roles of marked places, each with the words of its legend, which name the groups, and its colour.
fn roles(marks: &[Mark]) -> Vec<[String; 3]> {
    let all = [
        (Role::Support, "support", "supports", "#0072b2"),
        (Role::Load, "load", "loads", "#d55e00"),
        (Role::Spring, "spring", "springs", "#e69f00"),
        (Role::Contact, "closed", "closed contact", "#cc3fa0"),
        (Role::Contact, "open", "open contact", "#5c6670"),
    ];
    let legend = |(role, name, words, color): (Role, &str, &str, &str)| {
        let on: BTreeSet<&str> = marks.iter().filter(|mark| mark.role == role).map(|mark| mark.on.as_str()).collect();
        let names = on.iter().take(LEGEND).copied().collect::<Vec<_>>().join(", ");
        let more = if on.len() > LEGEND { ", ..." } else { "" };
        (!on.is_empty()).then(|| [name.to_owned(), format!("{words}: {names}{more}"), color.to_owned()])
    };
    all.into_iter().filter_map(legend).collect()
}

fn relative(low: [f64; 3], x: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| x[c] - low[c])
}

/// Return the smallest and the largest finite value. They are never equal.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = crate::linalg::range(values.filter(|value| value.is_finite()));
    if low < high {
        [low, high]
    } else if low == high {
        [low, low + low.abs().max(1e-300)]
    } else {
        [0.0, 1.0]
    }
}

/// Return the factor by which displacements are multiplied: the largest of 1, 2, 5 times a power of ten with which no
/// displacement is longer than a twentieth of the diagonal of all bodies, but 1 at least. Motions can then be seen, and
/// bodies still look like themselves.
fn magnification(bodies: &[Surface]) -> f64 {
    let [low, high] = bounds(bodies.iter().flat_map(|part| &part.points).copied());
    let most = bodies.iter().flat_map(Surface::travel).fold(0.0, f64::max);
    let wish = 0.05 * length(relative(low, &high)) / most;
    if !wish.is_finite() || wish <= 1.0 {
        return 1.0;
    }
    let unit = 10f64.powf(wish.log10().floor());
    unit * [5.0, 2.0].into_iter().find(|factor| factor * unit <= wish).unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tetrahedra with a common face, each on a rank of its own: six faces, and five points.
    #[test]
    fn parts_are_joined_at_their_common_face() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        let part = |nodes: [usize; 4]| {
            Surface::of_body(
                &BodyField {
                    name: "body".to_owned(),
                    points: nodes.map(|node| points[node]).to_vec(),
                    cell: CellKind { dimension: 3, order: 1 },
                    connectivity: vec![0, 1, 2, 3],
                    displacement: vec![[0.0, 0.0, 0.01]; 4],
                    stress: vec![[0.0; 6]; 4],
                    von_mises: vec![1.0; 4],
                    largest: None,
                    principal: vec![[0.0; 3]; 4],
                },
                &nodes.map(|node| node as u32),
            )
        };
        let parts = vec![part([0, 1, 2, 3]), part([4, 1, 2, 3])];
        assert_eq!(parts[0].faces.len(), 4);
        let mut whole = Surface::join(parts);
        let mark = |role, point: u32| Mark {
            role,
            on: String::new(),
            body: 0,
            corners: 3,
            simplices: vec![vec![0, 1, point]],
        };
        // the face in the middle is none of the surface, but its corners are
        let marks = [mark(Role::Support, 3), mark(Role::Load, 7)];
        whole.mark(marks.iter(), &|_| false);
        assert_eq!(whole.marks.keys().collect::<Vec<_>>(), [&"support"]);
        let corners = whole.marks["support"][0].iter().map(|&node| whole.points[node as usize]);
        assert_eq!(corners.collect::<Vec<_>>(), [points[0], points[1], points[3]]);
        assert_eq!((whole.points.len(), whole.faces.len(), whole.triangles().len()), (5, 6, 18));
        // a twentieth of the diagonal sqrt(3) is 8.7 displacements
        assert_eq!(magnification(&[whole]), 5.0);
    }

    /// The triangles of a face of order k cover it once: with the corners 0, (1, 0) and (0, 1) each has the area 1/(2
    /// k^2), with one sign.
    #[test]
    fn faces_of_any_order_are_covered() {
        for order in (1..=Order::HIGHEST).filter_map(Order::new) {
            let k = order.degree();
            let mut places = lagrange::equally_spaced(order, 3);
            places[3 + 2 * (k - 1)..3 + 3 * (k - 1)].reverse();
            let corners = split(places.len());
            assert_eq!(corners.len(), 3 * k * k);
            for triangle in corners.chunks(3) {
                let [a, b, c] = [0, 1, 2].map(|i| places[triangle[i]]);
                let doubled = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]);
                assert!((doubled * (k * k) as f64 - 1.0).abs() < 1e-12, "order {k}: {doubled}");
            }
        }
    }

    #[test]
    fn a_range_is_never_a_point() {
        assert_eq!(range([3.0, f64::NAN, 1.0].into_iter()), [1.0, 3.0]);
        assert_eq!(range([2.0, 2.0].into_iter()), [2.0, 4.0]);
        assert_eq!(range([].into_iter()), [0.0, 1.0]);
    }
}
