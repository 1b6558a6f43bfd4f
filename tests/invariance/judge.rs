//! Runs of a scene and of its changes, and what they must have in common.

use super::change::Change;
use std::path::Path;
use winkler::api::{Constants, Field, MeshSource, Plane, Result, Scene, Session, Solution, solve};
use winkler::internals::Interrupt;
use winkler::internals::bounds;

/// Relative difference that is none.
const SAME: f64 = 1e-8;

/// How many roundings of a coordinate come together in a gap or in a shape function: a few of each of the nodes around.
const FEW: f64 = 20.0;

/// A scene of the repository on a coarse mesh.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// The scene file.
    pub scene: &'static str,
    /// What is set in it.
    pub set: &'static [&'static str],
}

/// A way to change a scene, in units of its size.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// How many sizes it is moved.
    pub sizes: f64,
    /// Whether it is turned: in the plane by a right angle, in space x to y, y to z, z to x.
    pub turn: bool,
    /// Whether it is mirrored.
    pub mirror: bool,
    /// Factor of lengths.
    pub length: f64,
    /// Factor of stresses.
    pub stress: f64,
}

const PLAIN: Kind = Kind { name: "", sizes: 0.0, turn: false, mirror: false, length: 1.0, stress: 1.0 };

/// All changes that a scene is measured by.
pub const KINDS: [Kind; 11] = [
    Kind { name: "moved by 1", sizes: 1.0, ..PLAIN },
    Kind { name: "moved by 1e3", sizes: 1e3, ..PLAIN },
    Kind { name: "moved by 1e6", sizes: 1e6, ..PLAIN },
    Kind { name: "turned", turn: true, ..PLAIN },
    Kind { name: "mirrored", mirror: true, ..PLAIN },
    Kind { name: "length 1e-9", length: 1e-9, ..PLAIN },
    Kind { name: "length 1e9", length: 1e9, ..PLAIN },
    Kind { name: "stress 1e-9", stress: 1e-9, ..PLAIN },
    Kind { name: "stress 1e9", stress: 1e9, ..PLAIN },
    Kind { name: "all, near", sizes: 1.0, turn: true, mirror: true, length: 1e-3, stress: 1e3 },
    Kind { name: "all, far", sizes: 1e3, turn: true, mirror: true, length: 1e3, stress: 1e-3 },
];

/// What a run found, in the coordinates and units of the scene itself.
#[derive(Debug, Clone)]
pub struct Answer {
    /// How it ended.
    pub status: String,
    /// Updates of the iterate.
    pub iterations: usize,
    /// Largest extent of the scene along an axis.
    pub size: f64,
    /// What each pair came to.
    pub pairs: Vec<PairAnswer>,
    /// Moments of the loads on each body about the origin.
    pub loads: Vec<[f64; 3]>,
}

/// What a pair came to.
#[derive(Debug, Clone)]
pub struct PairAnswer {
    /// Force on the first side.
    pub force: [f64; 3],
    /// Moment on it about the origin.
    pub moment: [f64; 3],
    /// Largest pressure.
    pub peak: f64,
    /// Area in contact.
    pub area: f64,
    /// How far the bodies come nearer to each other.
    pub approach: Option<f64>,
    /// Compression by which the peak pressure changes by all of itself: through the layer, or through a body under one point.
    pub sensitive: f64,
    /// Compression and area of each point.
    pub points: Vec<[f64; 2]>,
}

/// Solve a case, changed if it is to be. Return none if the kind is no change of this case: bodies of revolution keep their axis.
///
/// # Errors
/// Refusals of the scene and failures of solvers.
pub fn run(session: &Session, root: &Path, case: &Case, kind: Option<&Kind>) -> Result<Option<(Answer, Change)>> {
    let set: Vec<String> = case.set.iter().map(|&set| set.to_owned()).collect();
    let mut scene = winkler::api::load(&root.join(case.scene), &set)?;
    match scene.dimension.value {
        2 => run_in::<2>(session, &mut scene, kind),
        _ => run_in::<3>(session, &mut scene, kind),
    }
}

fn run_in<const D: usize>(
    session: &Session,
    scene: &mut Scene,
    kind: Option<&Kind>,
) -> Result<Option<(Answer, Change)>> {
    let orders: Vec<_> = scene.bodies.iter().map(|body| body.order).collect();
    let mesh = winkler::internals::mesh::load::<D>(&scene.mesh, &orders, &Interrupt::default())?.mesh;
    let [low, high] = bounds(mesh.points.iter().map(|&x| mesh.in_scene(x)));
    let size = (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max);
    let Some(change) = change::<D>(scene, size, kind) else { return Ok(None) };
    let modulus = scene.bodies.iter().map(|body| largest(&body.elasticity().constants)).fold(0.0, f64::max);
    change.apply(scene, &mesh)?;
    debug_assert!(matches!(scene.mesh, MeshSource::Arrays(_)));
    let force = change.force(scene);
    let solution = solve(session, scene.clone())?;
    let factors = Factors { force, modulus, size };
    Ok(Some((answer::<D>(&solution, &change, &factors), change)))
}

/// Return the largest modulus of a material whose constants are numbers.
fn largest(constants: &Constants) -> f64 {
    let fields: Vec<&Field> = match constants {
        Constants::Isotropic { young, .. } => vec![young],
        Constants::Orthotropic(fields) => fields.iter().collect(),
        Constants::Anisotropic(fields) => fields.iter().collect(),
    };
    fields.into_iter().map(|field| field.eval([0.0; 3])).fold(0.0, f64::max)
}

fn change<const D: usize>(scene: &Scene, size: f64, kind: Option<&Kind>) -> Option<Change> {
    let mut change = Change::none();
    let Some(kind) = kind else { return Some(change) };
    let revolves = scene.plane == Plane::Axisymmetric;
    if kind.turn && !revolves {
        (change.axis, change.sign) = match D {
            2 => ([1, 0, 2], [-1.0, 1.0, 1.0]),
            _ => ([2, 0, 1], [1.0; 3]),
        };
    }
    if kind.mirror {
        change.sign[usize::from(revolves)] *= -1.0;
    }
    // directions that are no simple ones
    let towards = [0.9182736, -0.7310529, 0.4567891];
    change.shift = std::array::from_fn(|c| kind.sizes * size * if c < D { towards[c] } else { 0.0 });
    if revolves {
        change.shift[0] = 0.0;
    }
    (change.length, change.stress) = (kind.length, kind.stress);
    (!(revolves && kind.turn && !kind.mirror)).then_some(change)
}

/// What an answer is measured by.
struct Factors {
    /// Factor of forces.
    force: f64,
    /// Largest modulus and largest extent of the scene itself.
    modulus: f64,
    size: f64,
}

fn answer<const D: usize>(solution: &Solution, change: &Change, factors: &Factors) -> Answer {
    let (l, s) = (change.length, change.stress);
    let Factors { force, modulus, size } = *factors;
    let report = solution.report();
    let per_point = force / s;
    let pair = |(i, pair): (usize, &winkler::api::PairReport)| {
        let table = solution.contact(i);
        let stiffest = table.compression.iter().zip(&table.pressure).map(|(c, p)| if *c > 0.0 { p / c } else { 0.0 });
        // what is below a point gives way by its pressure over E/h
        let spacing = table.weight.iter().map(|w| (w / per_point).powf(1.0 / (D - 1) as f64)).fold(f64::MAX, f64::min);
        let (layer, body) = (2.0 * stiffest.fold(0.0, f64::max) * l / s, modulus / spacing);
        let result = &pair.result;
        let peak = result.peak_pressure / s;
        PairAnswer {
            force: change.back(result.force[0]).map(|f| f / force),
            moment: change.moment_back(result.force[0], result.moment[0], force),
            peak,
            area: result.extent.contact() / per_point,
            approach: result.approach.map(|approach| approach / l),
            sensitive: peak / layer.min(body),
            points: table.compression.iter().zip(&table.weight).map(|(c, w)| [c / l, w / per_point]).collect(),
        }
    };
    let loads = report.bodies.iter().map(|body| &body.balance.loads);
    Answer {
        status: report.status.to_string(),
        iterations: report.iterations,
        size,
        loads: loads.map(|loads| change.moment_back(loads.force, loads.moment, force)).collect(),
        pairs: report.pairs.iter().enumerate().map(pair).collect(),
    }
}

/// Return what differs between the answer of a scene and that of the changed one, beyond the digits that its coordinates have.
pub fn differences(own: &Answer, other: &Answer, change: &Change) -> Vec<String> {
    let mut all = Vec::new();
    if own.status != other.status {
        all.push(format!("{} is {}", own.status, other.status));
        return all;
    }
    // an error of half a unit of the last place in every coordinate
    let rounding = f64::EPSILON * change.shift.iter().map(|x| x.abs()).fold(0.0, f64::max);
    let digits = |pair: &PairAnswer| SAME + FEW * rounding / pair.sensitive;
    let worst = own.pairs.iter().filter(|pair| pair.peak > 0.0).map(digits).fold(SAME, f64::max);
    if own.iterations.abs_diff(other.iterations) > usize::from(worst > 10.0 * SAME) {
        all.push(format!("{} iterations are {}", own.iterations, other.iterations));
    }
    if own.pairs.len() != other.pairs.len() {
        all.push(format!("{} pairs are {}", own.pairs.len(), other.pairs.len()));
        return all;
    }
    let size = |f: &[f64; 3]| f.iter().map(|f| f * f).sum::<f64>().sqrt();
    let apart = |a: &[f64; 3], b: &[f64; 3]| size(&std::array::from_fn(|c| a[c] - b[c]));
    let largest = own.pairs.iter().map(|pair| size(&pair.force)).fold(0.0, f64::max);
    // moments of the changed scene are about an origin that may be far away
    let reach = own.size + size(&change.shift);
    for (body, (a, b)) in own.loads.iter().zip(&other.loads).enumerate() {
        let off = apart(a, b) / (size(a) + largest * reach);
        if off > worst {
            all.push(format!("body {body}: moment {a:?} of the loads is {b:?}: {off:.1e} off, {worst:.1e} allowed"));
        }
    }
    let highest = own.pairs.iter().map(|pair| pair.peak).fold(0.0, f64::max);
    for (i, (own, other)) in own.pairs.iter().zip(&other.pairs).enumerate() {
        let mut compare = |what: &str, a: f64, b: f64, scale: f64, allowed: f64| {
            let off = (a - b).abs() / scale;
            if !(off <= allowed || a == b) {
                all.push(format!("pair {i}: {what} {a:e} is {b:e}: {off:.1e} off, {allowed:.1e} allowed"));
            }
        };
        compare("force", size(&own.force), size(&own.force) + apart(&own.force, &other.force), largest, worst);
        let turned = size(&own.moment) + apart(&own.moment, &other.moment);
        compare("moment", size(&own.moment), turned, largest * reach, worst);
        compare("peak", own.peak, other.peak, highest, worst);
        // a point whose compression is zero to these digits may be open or closed
        let deepest = own.points.iter().map(|point| point[0].abs()).fold(0.0, f64::max);
        let unsure = |point: &&[f64; 2]| point[0].abs() <= worst * deepest + FEW * rounding;
        let unsure: f64 = own.points.iter().filter(unsure).map(|point| point[1]).sum();
        let whole: f64 = own.points.iter().map(|point| point[1]).sum();
        compare("area", own.area, other.area, whole, worst + 2.0 * unsure / whole);
        if let (Some(a), Some(b)) = (own.approach, other.approach) {
            compare("approach", a, b, deepest.max(a.abs()), worst);
        }
    }
    all
}
