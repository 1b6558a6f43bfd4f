//! Heights for the points of a grid that have none.

use super::grid::Axis;
use super::knots::Knots;
use super::rule::Fill;
use super::scattered::Scattered;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Replace the values of a grid that are NaN; at least one is not.
///
/// Only the points beside a gap are used. The nearest point of any place in the gap is among them, because one step further into the gap
/// there is a point that is still nearer.
pub fn grid(fill: Fill, axes: &[Axis; 2], values: &mut [f64]) {
    let gaps: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_nan()).collect();
    if gaps.is_empty() {
        return;
    }
    let place = |k: usize| {
        let index = [k % axes[0].count, k / axes[0].count];
        [0, 1].map(|d| axes[d].origin + axes[d].spacing * index[d] as f64)
    };
    let mut rim: Vec<usize> = gaps.iter().flat_map(|&k| around(axes, k)).filter(|&k| !values[k].is_nan()).collect();
    rim.sort_unstable();
    rim.dedup();
    let is_profile = axes[1].count == 1;
    let rim: Vec<[f64; 3]> = rim.iter().map(|&k| [place(k)[0], place(k)[1], values[k]]).collect();
    let between = match fill {
        Fill::Linear if is_profile => Between::lines(&rim),
        Fill::Linear => Between::planes(&rim),
        Fill::Nearest | Fill::Error => None,
    };
    let between = between.unwrap_or_else(|| Between::nearest(&rim));
    gaps.iter().for_each(|&k| values[k] = between.at(place(k)));
}

/// A function that gives heights between points and beyond them.
enum Between {
    Lines(Knots),
    Planes(Scattered),
    Nearest(RTree<GeomWithData<[f64; 2], f64>>),
}

impl Between {
    /// Return straight lines between points with increasing x; none for a single point.
    fn lines(points: &[[f64; 3]]) -> Option<Self> {
        (points.len() > 1).then(|| Self::Lines(Knots(points.iter().map(|&[x, _, height]| [x, height]).collect())))
    }

    /// Return planes over triangles; none if all points are on one line. The nearest point is then as good, as no place is between them.
    fn planes(points: &[[f64; 3]]) -> Option<Self> {
        Scattered::new(points).map(Self::Planes)
    }

    fn nearest(points: &[[f64; 3]]) -> Self {
        Self::Nearest(RTree::bulk_load(
            points.iter().map(|&[x, y, height]| GeomWithData::new([x, y], height)).collect(),
        ))
    }

    fn at(&self, place: [f64; 2]) -> f64 {
        match self {
            Self::Lines(knots) => knots.sample(place[0], true).value,
            Self::Planes(planes) => planes.sample(place, true).value,
            Self::Nearest(points) => points.nearest_neighbor(place).map_or(f64::NAN, |point| point.data),
        }
    }
}

/// Return the points around a point of a grid: eight inside, fewer at the border.
fn around(axes: &[Axis; 2], k: usize) -> Vec<usize> {
    let [columns, rows] = [axes[0].count, axes[1].count];
    let near = |at: usize, count: usize| at.saturating_sub(1)..=(at + 1).min(count - 1);
    let row = |j: usize| near(k % columns, columns).map(move |i| i + columns * j);
    near(k / columns, rows).flat_map(row).filter(|&other| other != k).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(counts: [usize; 2]) -> [Axis; 2] {
        let axis = |origin, spacing, count| Axis { origin, spacing, count };
        [axis(5.0, 0.5, counts[0]), axis(-1.0, 2.0, counts[1])]
    }

    #[test]
    fn gaps_are_filled_from_their_rims() {
        let plane = |k: usize| 3.0 + (k % 6) as f64 - 10.0 * (k / 6) as f64;
        let gaps = [7, 8, 13, 14, 15, 0, 29];
        let holed: Vec<f64> = (0..30).map(|k| if gaps.contains(&k) { f64::NAN } else { plane(k) }).collect();
        let mut linear = holed.clone();
        grid(Fill::Linear, &axes([6, 5]), &mut linear);
        for k in [8, 13, 14, 15] {
            assert!((linear[k] - plane(k)).abs() < 1e-12, "{k}: {} {}", linear[k], plane(k));
        }
        // the corners are beyond all others
        assert!(linear.iter().all(|height| height.is_finite()));
        let mut nearest = holed;
        grid(Fill::Nearest, &axes([6, 5]), &mut nearest);
        // along a row points are 0.5 apart, from row to row 2
        assert_eq!([nearest[7], nearest[8], nearest[15], nearest[0]], [plane(6), plane(9), plane(16), plane(1)]);
    }

    #[test]
    fn profiles_and_rims_on_a_line() {
        let gap = f64::NAN;
        let mut profile = [gap, 1.0, gap, gap, 4.0, gap];
        grid(Fill::Linear, &axes([6, 1]), &mut profile);
        assert_eq!(profile, [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        // one row beside the gap is all that there is
        let mut half: Vec<f64> = (0..12).map(|k| if k < 6 { f64::from(k) } else { gap }).collect();
        grid(Fill::Linear, &axes([3, 4]), &mut half);
        assert_eq!(half[6..], [3.0, 4.0, 5.0, 3.0, 4.0, 5.0]);
    }
}
