//! A rough face between elastic boxes with mirror planes at the sides, against cosine series in the plane and closed forms in depth.

use super::{close, solved};
use crate::common::series::{Boxes, Series};
use crate::common::{case, root};
use winkler::api::{Data, DataSpec, load};

/// The heights of the case, as a scene has them.
fn rough() -> Data {
    let scene = load(&case("rough"), &[]).expect("the case");
    let data =
        Data::new(DataSpec { file: root().join("meshes/rough/rough.csv").into(), ..scene.data["rough"].spec.clone() });
    data.load().expect("its heights");
    data
}

/// Force, pressures at the contact points and area of contact, on two meshes: errors fall with the elements.
#[test]
fn rough_face() {
    let data = rough();
    let gap = |x: f64, y: f64| 1e-3 - data.sample(&[x, y]).value;
    let approach = 1.5e-3;
    let boxes = Boxes { side: 1.0, height: 0.5, young: 2.1e5, poisson: 0.3, stiffness: 5e6, approach, points: 64 };
    let series = Series::new(boxes, gap);
    let errors = [6, 10].map(|n| {
        let sets = [format!("mesh.set.n={n}"), format!("body.upper.fix.2.z=-{approach}")];
        let run = solved("rough", &sets.each_ref().map(String::as_str));
        close("force", run.forces(0)[1][2].abs(), series.pressure.mean(), 2e-3);
        let table = run.contact();
        let exact = series.at(&table["x"], &table["y"], gap);
        let (mut error, mut size, mut area) = (0.0, 0.0, 0.0);
        for q in 0..table.rows() {
            let (ours, weight) = (table["pressure"][q], table["weight"][q]);
            error += weight * (ours - exact[q]).powi(2);
            size += weight * exact[q] * exact[q];
            area += if ours > 0.0 { weight } else { 0.0 };
        }
        let closed = series.pressure.iter().filter(|p| **p > 0.0).count() as f64;
        let exact = closed / series.pressure.len() as f64;
        // a point is open or closed with all of its area: those on the edge count half too much or too little
        assert!((area - exact).abs() < 0.04, "area {area}, series {exact}");
        (error / size).sqrt()
    });
    assert!(errors[1] < 0.02 && errors[0] > 2.0 * errors[1], "{errors:?}");
}
