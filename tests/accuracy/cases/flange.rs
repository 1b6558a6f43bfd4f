//! A bolted joint of two flanges with rough faces.

use super::{close, solved};

/// The joint carries the bolts less the pull of the pipe; its pressure peaks at the edge of a hole and it opens between the bolts.
#[test]
fn joint() {
    for (pull, share) in [(1e4, 7e4), (0.0, 8e4)] {
        let load = format!("body.1.load.1.force=[0, 0, {pull:e}]");
        let run = solved("flange", &["body.0.order=1", "body.1.order=1", &load]);
        close("force in the joint", run.forces(0)[1][2], share, 1e-7);
        let table = run.contact();
        let largest = (0..table.rows()).max_by(|&p, &q| table["pressure"][p].total_cmp(&table["pressure"][q]));
        let peak = largest.expect("points");
        // from the axis of the nearer bolt, which is 86 from that of the pipe: holes have a radius of 8
        let away = [22.5f64, 67.5].map(|angle| {
            let (s, c) = angle.to_radians().sin_cos();
            (table["x"][peak] - 86.0 * c).hypot(table["y"][peak] - 86.0 * s)
        });
        let away = away[0].min(away[1]);
        assert!((7.9..10.0).contains(&away), "the peak is {away} from the axis of a bolt");
        let open = table["pressure"].iter().filter(|&&p| p == 0.0).count();
        assert!(open > 0 && open < table.rows() / 2, "{open} of {} points open", table.rows());
    }
}
