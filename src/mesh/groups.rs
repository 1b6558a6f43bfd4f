//! Compact numbering: points that no group uses go.

use super::Group;

/// Renumbers the points that the groups use, in their old order, and gives the old number of each new one.
/// `count` is the number of points before; every number in the groups is below it.
pub fn compact(groups: &mut [Group], count: usize) -> impl Iterator<Item = usize> + use<> {
    const UNUSED: u32 = u32::MAX;
    let mut number = vec![UNUSED; count];
    for point in groups.iter().flat_map(|group| &group.connectivity) {
        number[*point as usize] = 0;
    }
    for (new, slot) in number.iter_mut().filter(|slot| **slot != UNUSED).enumerate() {
        *slot = new as u32;
    }
    for point in groups.iter_mut().flat_map(|group| &mut group.connectivity) {
        *point = number[*point as usize];
    }
    (0..count).filter(move |old| number[*old] != UNUSED)
}
