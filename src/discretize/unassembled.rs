//! A body of which all is known but its matrix, with what all ranks agreed on, and the cells and nodes that this rank needs of it.

use super::carried::Supported;
use super::distribute::Dealt;
use super::draft::{Draft, Loose};
use super::here::Here;
use super::info::{BodyInfo, Gauged};
use super::part::Part;
use super::ready::Ready;
use crate::contact::{self, ContactPair};
use crate::error::Result;
use crate::exchange::Exchange;
use crate::fem::{Elasticity, NodeGraph};
use crate::linalg::dot;
use crate::mesh::{Checked, Mesh};
use std::sync::Arc;

/// A body before its matrix is assembled.
pub struct Unassembled<'a, const D: usize> {
    /// Its space, supports and springs.
    pub part: Part<'a, D>,
    /// Its contact rows and loads.
    pub draft: Draft<D>,
    /// What its supports prescribe.
    pub supported: Supported<D>,
    /// Which nodes K couples, if that is known here.
    pub graph: Option<NodeGraph>,
    /// The part of this rank, if the body is split over the ranks.
    pub dealt: Option<Dealt>,
    /// Rank that owns the body, or most of it.
    pub owner: usize,
    /// Sum of its loads, but for those on rigid surfaces.
    pub load: [f64; 3],
    /// What the user should know of its elasticity.
    pub warning: Option<String>,
    /// Rigid motions that nothing but its mesh resists.
    pub gauged: Gauged,
    /// The rigid motions that supports and springs leave it.
    pub loose: Loose<D>,
    /// Elasticity of the cells that are here.
    pub elasticity: Elasticity,
}

/// What a body is like behind its contact surfaces.
struct Scales {
    /// Modulus along their normals.
    modulus: f64,
    /// Area or volume over their length or area; infinite without contact.
    depth: f64,
}

impl<'a, const D: usize> Unassembled<'a, D> {
    fn scales(&self, pairs: &[ContactPair]) -> Scales {
        let of_body = || self.draft.segments.iter().map(|segment| &pairs[segment.pair]);
        let surface: f64 = of_body().map(|pair| pair.weight.iter().sum::<f64>()).sum();
        Scales {
            modulus: dot(&self.part.known.moduli, &along_axes(of_body())),
            depth: self.part.known.volume / surface,
        }
    }

    /// Return the traces on its contact rows of the rigid motion that supports give it.
    pub fn carried(&self) -> Vec<f64> {
        let rows = &self.draft.rows;
        let Some(motion) = &self.supported.carried else { return vec![0.0; rows.rows()] };
        let at = |q: usize| rows.row(q).map(|(dof, b)| b * self.part.dof_of(motion, dof)).sum();
        (0..rows.rows()).map(at).collect()
    }

    /// Return what reports tell of it; its mesh was `checked`.
    pub fn info(&self, pairs: &[ContactPair], checked: &Checked) -> BodyInfo {
        let Self { part, loose, owner, .. } = self;
        let spec = part.spec;
        let Scales { modulus, depth } = self.scales(pairs);
        let is_held = loose.motions.len() == loose.unfelt.len() && depth.is_finite();
        let mut load = self.load;
        part.rigid_forces().for_each(|(_, total)| contact::add(&mut load, total));
        BodyInfo {
            name: spec.name.value.clone(),
            datum: contact::pad(part.space.datum),
            nodes: part.space.nodes.len(),
            points: Vec::new(),
            cells: part.known.cells,
            facets: Checked { nodes: Arc::default(), ..checked.clone() },
            dofs: part.space.dofs(),
            supported: part.held.supported(),
            left_by_supports: loose.left.iter().map(|motion| motion.name.clone()).collect(),
            left_by_all: loose.unfelt.iter().map(|(name, _)| name.clone()).collect(),
            gauged: self.gauged.clone(),
            warning: self.warning.clone(),
            stiffness: if is_held { modulus / depth } else { 0.0 },
            load,
            rank: *owner,
            ranks: self.dealt.as_ref().map_or_else(|| vec![*owner], |dealt| dealt.ranks.clone()),
            supports: spec.fix.iter().map(|support| support.on.value.clone()).collect(),
            springs: spec.spring.iter().map(|spring| spring.on.value.clone()).collect(),
            rigid: part.held.rigid.iter().map(|(load, _)| spec.load[*load].on.value.clone()).collect(),
            post: None,
        }
    }

    /// Return what its assembly needs on this rank; with what estimates of the error need, if they are wanted (`keep`). Collective.
    ///
    /// # Errors
    /// Those of [`Part::unloaded`].
    pub fn ready(
        mut self,
        pairs: &[ContactPair],
        mesh: &Mesh<D>,
        keep: bool,
        exchange: &dyn Exchange,
    ) -> Result<Ready<'a, D>> {
        let Scales { modulus, depth } = self.scales(pairs);
        let unloaded = if keep { self.part.unloaded(mesh)? } else { Vec::new() };
        let Draft { segments, rows, nodal_rows, nodal_load, .. } = self.draft;
        let (mut here, mut works, mut smooth, mut elsewhere) = (None, None, Vec::new(), None);
        if self.owner == exchange.rank() || self.dealt.is_some() {
            smooth = self.part.smooth();
            let whole = Here { part: self.part, rows: [rows, nodal_rows], load: nodal_load, supported: self.supported };
            here = Some(match &mut self.dealt {
                None => whole,
                Some(dealt) => {
                    let (known, work) = whole.of(dealt, &self.loose.left, exchange);
                    works = Some(work);
                    known
                }
            });
        } else if keep {
            elsewhere = Some((self.part.space, self.part.held));
        }
        Ok(Ready {
            segments,
            loose: self.loose,
            scales: [modulus, depth],
            elasticity: self.elasticity,
            graph: self.graph.filter(|_| exchange.ranks() == 1),
            dealt: self.dealt,
            here,
            works,
            smooth,
            elsewhere,
            unloaded,
        })
    }
}

/// Mean squared components of the normals on the contact surfaces of a body.
fn along_axes<'p>(pairs: impl Iterator<Item = &'p ContactPair>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for pair in pairs {
        for (weight, normal) in pair.weight.iter().zip(&pair.normal) {
            (0..3).for_each(|c| sum[c] += weight * normal[c] * normal[c]);
        }
    }
    let total: f64 = sum.iter().sum();
    if total > 0.0 { sum.map(|sum| sum / total) } else { sum }
}
