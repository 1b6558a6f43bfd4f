//! A rough face between elastic boxes with mirror planes at the sides, against cosine series in the plane and closed forms in depth.

use super::{close, solved};
use crate::common::{case, root};
use nalgebra::DMatrix;
use std::f64::consts::PI;
use winkler::data::{Data, DataSpec};

const YOUNG: f64 = 2.1e5;
const POISSON: f64 = 0.3;
const HEIGHT: f64 = 0.5;
const STIFFNESS: f64 = 5e6;
/// Waves and points of the series along each side.
const N: usize = 64;

/// The heights of the case, as a scene has them.
fn rough() -> Data {
    let scene = winkler::scene::load(&case("rough"), &[]).expect("the case");
    let data = Data::new(DataSpec { file: root().join("meshes/rough/rough.csv"), ..scene.data["rough"].spec.clone() });
    data.load().expect("its heights");
    data
}

/// The same problem by series: cos(pi k x) cos(pi l y) of both bodies and the layer, pressures at the middles of N x N cells.
struct Series {
    /// Rows: waves with a norm of 1, columns: places.
    waves: DMatrix<f64>,
    /// Depth by which faces and layer yield to a wave of the pressure.
    compliance: DMatrix<f64>,
}

impl Series {
    fn new() -> Self {
        let place = |i: usize| (i as f64 + 0.5) / N as f64;
        Self { waves: waves(&(0..N).map(place).collect::<Vec<_>>()), compliance: DMatrix::from_fn(N, N, compliance) }
    }

    fn to_waves(&self, values: &DMatrix<f64>) -> DMatrix<f64> {
        &self.waves * values * self.waves.transpose()
    }

    fn yields(&self, pressure: &DMatrix<f64>) -> DMatrix<f64> {
        self.waves.transpose() * self.to_waves(pressure).component_mul(&self.compliance) * &self.waves
    }

    /// Pressures p >= 0 where p (yield + gap - approach) = 0 and yield + gap >= approach, by the constrained conjugate gradients of
    /// Polonsky and Keer (Wear 231, 1999) at a given approach.
    fn pressure(&self, gap: &DMatrix<f64>) -> DMatrix<f64> {
        let scale = gap.norm();
        let mut pressure = gap.map(|gap| (-gap).max(0.0) * STIFFNESS);
        let (mut direction, mut before, mut keeps) = (DMatrix::zeros(N, N), 1.0, false);
        for _ in 0..1000 {
            let residual = self.yields(&pressure) + gap;
            let on = pressure.map(|p| if p > 0.0 { 1.0 } else { 0.0 });
            let own = residual.component_mul(&on);
            let size = own.norm_squared();
            let share = if keeps { size / before } else { 0.0 };
            direction = (own.clone() + direction * share).component_mul(&on);
            let step = own.dot(&direction) / direction.dot(&self.yields(&direction));
            pressure = (pressure - &direction * step).map(|p| p.max(0.0));
            let mut joined = false;
            for (p, r) in pressure.iter_mut().zip(&residual).filter(|(p, r)| **p == 0.0 && **r < 0.0) {
                *p = -step * r;
                joined = true;
            }
            (before, keeps) = (size, !joined);
            if !joined && size.sqrt() < 1e-9 * scale {
                return pressure;
            }
        }
        panic!("the series do not converge");
    }
}

/// Rows: cosines of norm 1 over N places, columns: places.
fn waves(places: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(N, places.len(), |k, i| {
        (if k == 0 { 1.0 } else { 2.0 } / N as f64).sqrt() * (PI * k as f64 * places[i]).cos()
    })
}

/// Two layers of elastic material that slide on a rigid ground without friction, and the Winkler layer. K. L. Johnson, Contact
/// Mechanics, section 5.8: a wave of the pressure of number k sinks into a layer of height h by 2 (1 - nu^2)/(E k) (cosh 2kh -
/// 1)/(sinh 2kh + 2kh); a uniform one by h over the modulus without strain at the sides.
fn compliance(k: usize, l: usize) -> f64 {
    let wave = PI * (k as f64).hypot(l as f64);
    let (phase, modulus) = (2.0 * wave * HEIGHT, YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON)));
    let body = match () {
        _ if wave == 0.0 => HEIGHT / modulus,
        // beyond this the second factor is 1 in double numbers
        _ if phase > 50.0 => 2.0 * (1.0 - POISSON * POISSON) / (YOUNG * wave),
        _ => 2.0 * (1.0 - POISSON * POISSON) / (YOUNG * wave) * (phase.cosh() - 1.0) / (phase.sinh() + phase),
    };
    2.0 * body + 1.0 / STIFFNESS
}

/// Force, pressures at the contact points and area of contact, on two meshes: errors fall with the elements.
#[test]
fn rough_face() {
    let (data, series) = (rough(), Series::new());
    let place = |i: usize| (i as f64 + 0.5) / N as f64;
    let gap = |x: f64, y: f64| 1e-3 - data.sample(&[x, y]).value;
    let approach = 1.5e-3;
    let between = DMatrix::from_fn(N, N, |i, j| gap(place(i), place(j)) - approach);
    let pressure = series.pressure(&between);
    // the faces' yield is smooth: the layer has the pressure between the places, too
    let faces = series.compliance.map(|both| both - 1.0 / STIFFNESS);
    let amplitudes = series.to_waves(&pressure).component_mul(&faces);
    let errors = [6, 10].map(|n| {
        let sets = [format!("mesh.set.n={n}"), format!("body.upper.fix.2.z=-{approach}")];
        let run = solved("rough", &sets.each_ref().map(String::as_str));
        close("force", run.forces(0)[1][2].abs(), pressure.mean(), 2e-3);
        let table = run.contact();
        let (x, y) = (waves(&table["x"]), waves(&table["y"]));
        let yields = x.tr_mul(&amplitudes);
        let (mut error, mut size, mut area) = (0.0, 0.0, 0.0);
        for q in 0..table.rows() {
            let depth = (yields.row(q) * y.column(q))[0];
            let exact = STIFFNESS * (approach - gap(table["x"][q], table["y"][q]) - depth).max(0.0);
            let (ours, weight) = (table["pressure"][q], table["weight"][q]);
            error += weight * (ours - exact).powi(2);
            size += weight * exact * exact;
            area += if ours > 0.0 { weight } else { 0.0 };
        }
        let exact = pressure.iter().filter(|p| **p > 0.0).count() as f64 / (N * N) as f64;
        // a point is open or closed with all of its area: those on the edge count half too much or too little
        assert!((area - exact).abs() < 0.04, "area {area}, series {exact}");
        (error / size).sqrt()
    });
    assert!(errors[1] < 0.02 && errors[0] > 2.0 * errors[1], "{errors:?}");
}
