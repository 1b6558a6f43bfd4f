//! Two elastic boxes with mirror planes at the sides, pressed over a gap with a linear layer, by cosine series in the plane and closed
//! forms in depth.

use nalgebra::DMatrix;
use std::f64::consts::PI;

/// The boxes and their layer.
#[derive(Debug, Clone, Copy)]
pub struct Boxes {
    /// Length of the sides of the face.
    pub side: f64,
    /// Height of each box.
    pub height: f64,
    /// Young's modulus of both.
    pub young: f64,
    /// Poisson's ratio of both.
    pub poisson: f64,
    /// Of the layer.
    pub stiffness: f64,
    /// By how much the far faces approach.
    pub approach: f64,
    /// Waves and points of the series along each side.
    pub points: usize,
}

/// Pressures of two boxes.
pub struct Series {
    boxes: Boxes,
    /// Rows: waves with a norm of 1, columns: places.
    waves: DMatrix<f64>,
    /// Pressures at the middles of the cells of a grid.
    pub pressure: DMatrix<f64>,
    /// Waves of the depth by which the faces yield.
    depth: DMatrix<f64>,
}

impl Series {
    /// Solves for the pressures over a gap.
    pub fn new(boxes: Boxes, gap: impl Fn(f64, f64) -> f64) -> Self {
        let n = boxes.points;
        let places: Vec<f64> = (0..n).map(|i| (i as f64 + 0.5) / n as f64).collect();
        let between =
            DMatrix::from_fn(n, n, |i, j| gap(boxes.side * places[i], boxes.side * places[j]) - boxes.approach);
        let faces = DMatrix::from_fn(n, n, |k, l| boxes.compliance(k, l));
        let mut series = Self { boxes, waves: waves(n, &places), pressure: between.clone(), depth: faces.clone() };
        series.pressure = series.solve(&between, &faces.map(|faces| faces + 1.0 / boxes.stiffness));
        series.depth = series.to_waves(&series.pressure).component_mul(&faces);
        series
    }

    fn to_waves(&self, values: &DMatrix<f64>) -> DMatrix<f64> {
        &self.waves * values * self.waves.transpose()
    }

    fn yields(&self, pressure: &DMatrix<f64>, compliance: &DMatrix<f64>) -> DMatrix<f64> {
        self.waves.transpose() * self.to_waves(pressure).component_mul(compliance) * &self.waves
    }

    /// Pressures p >= 0 where p (yield + gap - approach) = 0 and yield + gap >= approach, by the constrained conjugate gradients of
    /// Polonsky and Keer (Wear 231, 1999) at a given approach.
    fn solve(&self, gap: &DMatrix<f64>, compliance: &DMatrix<f64>) -> DMatrix<f64> {
        let scale = gap.norm();
        let mut pressure = gap.map(|gap| (-gap).max(0.0) * self.boxes.stiffness);
        let n = self.boxes.points;
        let (mut direction, mut before, mut keeps) = (DMatrix::zeros(n, n), 1.0, false);
        for _ in 0..1000 {
            let residual = self.yields(&pressure, compliance) + gap;
            let on = pressure.map(|p| if p > 0.0 { 1.0 } else { 0.0 });
            let own = residual.component_mul(&on);
            let size = own.norm_squared();
            let share = if keeps { size / before } else { 0.0 };
            direction = (own.clone() + direction * share).component_mul(&on);
            let step = own.dot(&direction) / direction.dot(&self.yields(&direction, compliance));
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

    /// Depths by which both faces together yield at places x, y.
    pub fn depths(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let scaled = |x: &[f64]| x.iter().map(|x| x / self.boxes.side).collect::<Vec<f64>>();
        let (of_x, of_y) = (waves(self.boxes.points, &scaled(x)), waves(self.boxes.points, &scaled(y)));
        let yields = of_x.tr_mul(&self.depth);
        (0..x.len()).map(|q| (yields.row(q) * of_y.column(q))[0]).collect()
    }

    /// Pressures at places x, y with these gaps. What the faces yield is smooth: the layer has the pressure between the points of
    /// the series, too.
    pub fn at(&self, x: &[f64], y: &[f64], gap: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let pressure =
            |(q, depth): (usize, f64)| self.boxes.stiffness * (self.boxes.approach - gap(x[q], y[q]) - depth).max(0.0);
        self.depths(x, y).into_iter().enumerate().map(pressure).collect()
    }
}

/// Rows: n cosines of norm 1 over n places, columns: places in a side of length one.
fn waves(n: usize, places: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(n, places.len(), |k, i| {
        (if k == 0 { 1.0 } else { 2.0 } / n as f64).sqrt() * (PI * k as f64 * places[i]).cos()
    })
}

impl Boxes {
    /// Two layers of elastic material that slide on a rigid ground without friction. K. L. Johnson, Contact Mechanics, section 5.8: a
    /// wave of the pressure of number k sinks into a layer of height h by 2 (1 - nu^2)/(E k) (cosh 2kh - 1)/(sinh 2kh + 2kh); a
    /// uniform one by h over the modulus without strain at the sides.
    fn compliance(&self, k: usize, l: usize) -> f64 {
        let Self { young, poisson, height, .. } = self;
        let wave = PI * (k as f64).hypot(l as f64) / self.side;
        let (phase, modulus) =
            (2.0 * wave * height, young * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson)));
        let body = match () {
            _ if wave == 0.0 => height / modulus,
            // beyond this the second factor is 1 in double numbers
            _ if phase > 50.0 => 2.0 * (1.0 - poisson * poisson) / (young * wave),
            _ => 2.0 * (1.0 - poisson * poisson) / (young * wave) * (phase.cosh() - 1.0) / (phase.sinh() + phase),
        };
        2.0 * body
    }
}
