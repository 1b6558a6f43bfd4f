//! A bolted joint of two flanges with rough faces.

use super::{close, solved};

/// The joint carries the bolts less the pull of the pipe; its pressure peaks under the bolts and it opens between them.
#[test]
fn joint() {
    for (pull, share) in [(1e4, 7e4), (0.0, 8e4)] {
        let load = format!("body.1.load.1.force=[0, 0, {pull:e}]");
        let run = solved("flange", &["body.0.order=1", "body.1.order=1", &load]);
        close("force in the joint", run.forces(0)[1][2], share, 1e-7);
        let table = run.contact();
        let largest = (0..table.rows()).max_by(|&p, &q| table["pressure"][p].total_cmp(&table["pressure"][q]));
        let peak = largest.expect("points");
        // both bolts are 86 from the axis; washers have a radius of 15
        let angle = table["y"][peak].atan2(table["x"][peak]).to_degrees();
        let beside = (angle - 22.5).abs().min((angle - 67.5).abs()).to_radians() * 86.0;
        assert!((table["x"][peak].hypot(table["y"][peak]) - 86.0).abs() < 20.0 && beside < 20.0, "peak at {angle}");
        let open = table["pressure"].iter().filter(|&&p| p == 0.0).count();
        assert!(open > 0 && open < table.rows() / 2, "{open} of {} points open", table.rows());
    }
}
