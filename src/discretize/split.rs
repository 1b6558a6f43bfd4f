//! A pair of surfaces, split where one of them has an edge: smooth faces that face each other become pairs of their own.

use crate::contact::pieces::{Cut, Reach};
use crate::contact::{Faces, Side};
use crate::fem::Facets;
use std::collections::{BTreeMap, BTreeSet};

/// A part of two surfaces that becomes one pair.
pub struct Piece<const D: usize> {
    /// Facets of both surfaces.
    pub facets: [Facets<D>; 2],
    /// Number of the face of each surface, from 1; `None` if no other face of the surface is in a pair.
    pub face: [Option<usize>; 2],
    /// Number of facets of each surface that belong to no pair. One piece of two surfaces counts them.
    pub idle: [usize; 2],
    /// Nodes of the facets of both surfaces that face each other, but are too far apart, with or without pairs.
    pub far: [BTreeSet<u32>; 2],
}

impl<const D: usize> Piece<D> {
    /// Exchange the two surfaces.
    pub fn swap(&mut self) {
        self.facets.swap(0, 1);
        self.face.swap(0, 1);
        self.idle.swap(0, 1);
        self.far.swap(0, 1);
    }
}

/// Which facets of each of two surfaces are in a pair.
type Used = [Vec<bool>; 2];

/// Faces of two surfaces that become one pair.
struct Group {
    faces: [BTreeSet<usize>; 2],
    used: Used,
}

/// Two surfaces with their faces, and the facets with common pieces for each two faces that have some.
pub struct Split<'a, const D: usize> {
    sides: [&'a Side<'a, D>; 2],
    faces: [Faces; 2],
    met: BTreeMap<[usize; 2], Used>,
    /// Nodes of the facets of both surfaces that face each other, but are too far apart.
    far: [BTreeSet<u32>; 2],
}

impl<'a, const D: usize> Split<'a, D> {
    /// Find the faces of two surfaces between edges of more than `edge` degrees, and the facets of each two faces that have common
    /// pieces. The normals of a face are those of its own facets, while all facets of the other surface take part, so that the
    /// nearest one is the partner.
    pub fn new(sides: [&'a Side<'a, D>; 2], edge: f64, cut: Cut<D>, reach: &Reach) -> Self {
        let faces = sides.map(|side| Faces::new(side, edge));
        let mut met: BTreeMap<[usize; 2], Used> = BTreeMap::new();
        let mut far = [BTreeSet::new(), BTreeSet::new()];
        for face in 0..faces[0].count {
            let is_own: Vec<bool> = faces[0].of_facet.iter().map(|&of| of == face).collect();
            let own: Vec<usize> = (0..is_own.len()).filter(|&i| is_own[i]).collect();
            let common = cut(&sides[0].only(&is_own), sides[1], reach);
            for (i, j) in common.far() {
                far[0].extend(sides[0].facets.facet(own[i]));
                far[1].extend(sides[1].facets.facet(j));
            }
            for point in common.points {
                let (i, j) = (own[point.facet_a], point.facet_b);
                let none = || sides.map(|side| vec![false; side.facets.count()]);
                let used = met.entry([face, faces[1].of_facet[j]]).or_insert_with(none);
                (used[0][i], used[1][j]) = (true, true);
            }
        }
        Self { sides, faces, met, far }
    }

    /// Return the pairs with the facets that have common pieces, and no others. The list is empty if nothing has common pieces.
    pub fn into_pieces(self) -> Vec<Piece<D>> {
        let groups = self.groups();
        groups.iter().map(|group| self.piece(group, groups.len() > 1)).collect()
    }

    /// Return the same pairs with all facets of their faces. A facet without a partner belongs to the first pair of its face.
    pub fn into_whole_pieces(self) -> Vec<Piece<D>> {
        let mut groups = self.groups();
        let mut taken = self.all_used();
        for Group { faces, used } in &mut groups {
            for side in 0..2 {
                let of_facet = &self.faces[side].of_facet;
                for i in (0..of_facet.len()).filter(|&i| faces[side].contains(&of_facet[i])) {
                    used[side][i] |= !taken[side][i];
                    taken[side][i] = true;
                }
            }
        }
        let mut pieces: Vec<Piece<D>> = groups.iter().map(|group| self.piece(group, groups.len() > 1)).collect();
        if let Some(first) = pieces.first_mut() {
            first.idle = taken.map(|taken| taken.iter().filter(|taken| !**taken).count());
        }
        pieces
    }

    /// Return one group of all faces that meet, or one of each two faces if faces of a surface have an edge between them.
    fn groups(&self) -> Vec<Group> {
        let all = self.all_used();
        let has_edge = |side: usize| self.faces[side].meet(self.sides[side], &all[side]);
        if has_edge(0) || has_edge(1) {
            let of_two = |(faces, used): (&[usize; 2], &Used)| Group {
                faces: faces.map(|face| BTreeSet::from([face])),
                used: used.clone(),
            };
            return self.met.iter().map(of_two).collect();
        }
        let faces = [0, 1].map(|side| self.met.keys().map(|faces| faces[side]).collect());
        if self.met.is_empty() { Vec::new() } else { vec![Group { faces, used: all }] }
    }

    /// Return the facets of both surfaces that have common pieces.
    fn all_used(&self) -> Used {
        let of_side = |side: usize| {
            let is_used = |i: usize| self.met.values().any(|used| used[side][i]);
            (0..self.sides[side].facets.count()).map(is_used).collect()
        };
        [of_side(0), of_side(1)]
    }

    fn piece(&self, group: &Group, is_one_of_several: bool) -> Piece<D> {
        let facets = [0, 1].map(|side| self.sides[side].facets.only(&group.used[side]));
        let number = |side: usize| {
            let face = *group.faces[side].first().filter(|_| is_one_of_several)?;
            self.number(side, face)
        };
        Piece { facets, face: [number(0), number(1)], idle: [0, 0], far: self.far.clone() }
    }

    /// Return the number of a face among the faces of its surface that are in pairs, from 1; `None` if it is the only one. Faces are
    /// in the order of their middles by x, then by y and z.
    ///
    /// Coordinates that differ by less than a thousandth of the surface count as equal, so that numbers do not depend on the mesh.
    fn number(&self, side: usize, face: usize) -> Option<usize> {
        let all: BTreeSet<usize> = self.met.keys().map(|faces| faces[side]).collect();
        let [low, high] = self.sides[side].extent();
        let size = (0..D).map(|c| high[c] - low[c]).fold(0.0, f64::max);
        let place = |face: usize| {
            let middle = self.faces[side].middle(self.sides[side], face);
            ((0..D).map(|c| (1e3 * (middle[c] - low[c]) / size).round() as i64).collect::<Vec<_>>(), face)
        };
        (all.len() > 1).then(|| 1 + all.iter().filter(|&&other| place(other) < place(face)).count())
    }
}
