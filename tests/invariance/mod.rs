//! A dozen of what `scripts/invariance` measures: answers do not depend on where a scene lies, how it is turned, and on its units.

mod cases;
mod change;
mod judge;

use self::cases::CASES;
use self::change::Change;
use self::judge::{Answer, Case, KINDS, Kind};
use crate::common::here::with_session;
use std::path::Path;
use winkler::api::{MeshSource, Order, Session, solve};
use winkler::internals::Interrupt;
use winkler::internals::fem::cross;

/// What a test takes: a scene, which of its cases, and a change by its name. Every change is there, and order 1 and 2, the plane, bodies
/// of revolution and space, curved surfaces, layers typed in, `auto`, springs, rigid surfaces, data, own axes.
const TESTED: [(&str, &[&str]); 15] = [
    ("anisotropic/scene.toml", &["turned", "mirrored"]),
    ("bearing/scene.toml", &["moved by 1e3"]),
    ("blocks/scene.toml", &["all, far"]),
    ("coating/scene.toml", &["moved by 1e3"]),
    ("groove/scene.toml", &["length 1e9", "stress 1e9"]),
    ("groove-held/scene.toml", &["turned"]),
    ("groove-held/graded.toml", &["moved by 1e6"]),
    ("hertz-sphere/axisymmetric.toml", &["moved by 1e3", "length 1e-9"]),
    ("manufactured/scene.toml", &["moved by 1", "moved by 1e3"]),
    ("patch-2d/scene.toml", &["moved by 1e6", "stress 1e9"]),
    ("patch-3d/scene.toml", &["moved by 1e3", "moved by 1e6", "turned"]),
    ("rings/scene.toml", &["moved by 1e3", "all, near"]),
    ("rough/scene.toml", &["moved by 1e3"]),
    ("sphere-layer/scene.toml", &["moved by 1e3", "mirrored"]),
    ("wall/scene.toml", &["stress 1e-9", "length 1e9"]),
];

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/meshes"))
}

#[test]
fn answers_are_the_same_everywhere() {
    with_session(compare);
}

/// Compare the answers of the tested cases with those of their changes.
fn compare(session: &Session) {
    for case in &CASES {
        let tested = TESTED.iter().find(|(scene, _)| *scene == case.scene);
        let kinds = tested.into_iter().flat_map(|(_, kinds)| kinds.iter());
        let kinds: Vec<&Kind> = kinds.filter_map(|name| KINDS.iter().find(|kind| kind.name == *name)).collect();
        assert_eq!(kinds.len(), tested.map_or(0, |(_, kinds)| kinds.len()), "a kind of {} does not exist", case.scene);
        if !kinds.is_empty() {
            check(session, case, &kinds);
        }
    }
    two_pairs_far_from_each_other(session);
}

fn check(session: &Session, case: &Case, kinds: &[&Kind]) {
    let run = |kind: Option<&Kind>| judge::run(session, root(), case, kind).expect("a scene that is solved");
    let (own, _) = run(None).expect("the scene itself");
    for kind in kinds {
        let (other, change) = run(Some(kind)).expect("a change of this scene");
        let differences = judge::differences(&own, &other, &change);
        assert!(differences.is_empty(), "{} {:?}, {}: {differences:#?}", case.scene, case.set, kind.name);
    }
}

/// Two patches in one scene, 10^5 sizes from each other: no point of reference is near both.
fn two_pairs_far_from_each_other(session: &Session) {
    let case = Case { scene: "patch-3d/scene.toml", set: &["body.0.order=2", "body.1.order=2"] };
    let (own, _): (Answer, Change) = judge::run(session, root(), &case, None).expect("solved").expect("a change");
    let set: Vec<String> = case.set.iter().map(|&set| set.to_owned()).collect();
    let mut scene = winkler::api::load(&root().join(case.scene), &set).expect("a scene");
    let mesh = winkler::internals::mesh::load::<3>(&scene.mesh, &[Some(Order::P2)], &Interrupt::default())
        .expect("a mesh")
        .mesh;
    let mut far = scene.clone();
    let mut change = Change::none();
    change.shift = [1e5 * 0.918_273_6, -7e4, 4.3e4];
    Change::none().apply(&mut scene, &mesh).expect("a scene");
    change.apply(&mut far, &mesh).expect("a scene");
    let (MeshSource::Arrays(near), MeshSource::Arrays(other)) = (&scene.mesh, &far.mesh) else { panic!("arrays") };
    let mut arrays = (**near).clone();
    let first = arrays.points.len() as u32;
    arrays.points.extend(&other.points);
    for group in &other.groups {
        let numbers = group.connectivity.iter().map(|number| first + number).collect();
        arrays = arrays.group(&format!("{}_2", group.name), group.dimension, numbers);
    }
    scene.mesh = arrays.into();
    for mut body in far.bodies {
        body.name.value += "_2";
        body.fix.iter_mut().for_each(|fix| fix.on.value += "_2");
        body.load.iter_mut().for_each(|load| load.on.value += "_2");
        scene.bodies.push(body);
    }
    for mut contact in far.contacts {
        contact.between.iter_mut().for_each(|name| name.value += "_2");
        scene.contacts.push(contact);
    }
    let solution = solve(session, scene).expect("solved");
    for pair in &solution.report().pairs {
        // coordinates have eleven digits of a body here, and gaps of 1e-4 eight
        assert!(
            (pair.result.peak_pressure - own.pairs[0].peak).abs() < 1e-5 * own.pairs[0].peak,
            "{}",
            pair.result.peak_pressure
        );
        assert!((pair.result.extent.contact() - 1.0).abs() < 1e-9, "{:?}", pair.result.extent);
        assert_eq!(pair.pieces_lost, 0);
    }
    // moments are about the origin of the scene, wherever coordinates are measured from
    let report = solution.report();
    let loads = |name: &str| {
        let body = report.bodies.iter().find(|body| body.name == name).expect("a body");
        assert!(body.balance.moment_imbalance < 1e-9, "{}", body.balance.moment_imbalance);
        &body.balance.loads
    };
    let [near, other] = ["upper", "upper_2"].map(loads);
    let pairs = [0, 1].map(|i| (&report.pairs[i].result.force[1], &report.pairs[i].result.moment[1]));
    for [(force, moment), (_, far_moment)] in [[(&near.force, &near.moment), (&other.force, &other.moment)], pairs] {
        let arm = cross(change.shift, *force);
        let size = force.iter().map(|f| f.abs()).sum::<f64>();
        for c in 0..3 {
            let off = (moment[c] + arm[c] - far_moment[c]).abs();
            assert!(off < 1e-9 * 1e5 * size, "{moment:?} {far_moment:?}");
            assert!(moment[c].abs() < 2.0 * size, "{moment:?}");
        }
    }
}
