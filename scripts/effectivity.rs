//! Estimated over true errors of pressures in space, where contact ends inside a surface, as a Markdown table: that of docs/theory.md, in
//! some minutes. `cargo run --release --example effectivity -- --quick`: the rows that the tests hold between 0.7 and 2.

// the tests have this program as a module, beside the series
#[allow(clippy::duplicate_mod)]
#[path = "../tests/common/series.rs"]
mod series;

use clap::Parser;
use series::{Boxes, Series};
use std::f64::consts::PI;
use std::path::Path;
use winkler::api::{ContactTable, Data, DataSpec, Error, Kind, Result, Session, load, solve};

/// Estimated over true errors of pressures in space.
#[derive(Parser)]
struct Asked {
    /// A few coarse meshes only
    #[arg(long)]
    quick: bool,
}

/// Estimated over true errors.
type Ratios = Vec<f64>;

/// Pressures at contact points.
type Exact<'a> = &'a dyn Fn(&ContactTable) -> Vec<f64>;

/// Print the row of one scene with values to replace. Return the ratio of the estimated to the true error.
fn row(session: &Session, case: &str, order: usize, stiffness: f64, sets: &[String], exact: Exact) -> Result<f64> {
    let mut all: Vec<String> = (0..2).map(|body| format!("body.{body}.order={order}")).collect();
    all.push(format!("contact.0.layer={{linear={{stiffness={stiffness:e}}}}}"));
    all.extend_from_slice(sets);
    let mut scene = load(&Path::new("meshes").join(case).join("scene.toml"), &all)?;
    scene.estimate = true;
    let solution = solve(session, scene)?;
    let table = solution.contact(0);
    let exact = exact(&table);
    let sum = |value: &dyn Fn(usize) -> f64| (0..exact.len()).map(|q| table.weight[q] * value(q).powi(2)).sum::<f64>();
    let error = (sum(&|q| table.pressure[q] - exact[q]) / sum(&|q| table.pressure[q])).sqrt();
    let Some(estimate) = solution.report().discretization_error.as_ref().filter(|_| solution.is_converged()) else {
        return Err(Error::new(Kind::Solver, format!("{case} was not solved")));
    };
    let (estimated, sets) = (estimate.pressure[0], sets.join(" "));
    let sets: String = sets.chars().take(80).collect();
    println!("| {case} {sets} | P{order} | {stiffness:e} | {error:.1e} | {estimated:.1e} | {:.2} |", estimated / error);
    Ok(estimated / error)
}

/// Two cubes, one with a paraboloidal face, free graded tetrahedra; `points` of the series along a side.
fn paraboloids(session: &Session, stiffness: f64, points: usize, meshes: &[(usize, f64)]) -> Result<Ratios> {
    let gap = |x: f64, y: f64| 4e-3 * (x * x + y * y);
    let boxes = Boxes { side: 0.5, height: 0.5, young: 2.1e5, poisson: 0.3, stiffness, approach: 3e-4, points };
    let series = Series::new(boxes, gap);
    let row = |(order, h): &(usize, f64)| {
        let sets = [format!("mesh.set.h={h}")];
        row(session, "paraboloid", *order, stiffness, &sets, &|table| at(&series, table, &gap))
    };
    meshes.iter().map(row).collect()
}

fn at(series: &Series, table: &ContactTable, gap: &dyn Fn(f64, f64) -> f64) -> Vec<f64> {
    let of = |c: usize| table.points.iter().map(|x| x[c]).collect::<Vec<f64>>();
    series.at(&of(0), &of(1), gap)
}

/// Spheres whose surfaces do not match, against Hertz: the layers are so stiff that they change the pressures by less than a tenth of the
/// errors.
fn spheres(session: &Session, stiffness: f64, meshes: &[(usize, usize, usize)]) -> Result<Ratios> {
    let hertz = |x: &[f64; 3]| 279.83 * (1.0 - x[0].powi(2) - x[1].powi(2)).max(0.0).sqrt();
    let row = |(order, n, edge): &(usize, usize, usize)| {
        let sets = [format!("mesh.set.n={n}"), format!("mesh.set.edge={edge}")];
        row(session, "hertz-sphere", *order, stiffness, &sets, &|table| table.points.iter().map(hertz).collect())
    };
    meshes.iter().map(row).collect()
}

/// Two boxes with a paraboloidal gap, regular tetrahedra; the elements of the upper face are `m` along a side.
fn regular(session: &Session, stiffness: f64, meshes: &[(usize, usize, usize)]) -> Result<Ratios> {
    let gap = |x: f64, y: f64| 1e-3 * (x * x + y * y);
    let boxes = Boxes { side: 1.0, height: 0.5, young: 2.1e5, poisson: 0.3, stiffness, approach: 3e-4, points: 128 };
    let series = Series::new(boxes, gap);
    let row = |(order, n, m): &(usize, usize, usize)| {
        let sets = [format!("mesh.set.n={n}"), format!("mesh.set.m={m}")];
        let case =
            [&sets[..], &["body.upper.fix.2.z=-3e-4".into(), "contact.0.gap=\"1e-3*(x^2 + y^2)\"".into()]].concat();
        row(session, "rough", *order, stiffness, &case, &|table| at(&series, table, &gap))
    };
    meshes.iter().map(row).collect()
}

/// A gap of 80 waves, the shortest with three elements in a wave on a face of 12, regular tetrahedra.
fn waves(session: &Session, stiffness: f64, meshes: &[(usize, usize)]) -> Result<Ratios> {
    let all: Vec<[f64; 3]> = (1..81)
        .map(|wave| [wave / 9, wave % 9].map(f64::from))
        .map(|[k, l]| [2.4e-4 * ((7.0 * k + 13.0 * l) % 10.0 / 10.0 - 0.45) / k.hypot(l).powf(1.5), k, l])
        .collect();
    let height = |[a, k, l]: &[f64; 3], x: f64, y: f64| a * (1.0 - (k * PI * x).cos() * (l * PI * y).cos());
    let gap = |x: f64, y: f64| all.iter().map(|wave| height(wave, x, y)).sum::<f64>();
    let terms: Vec<String> = all.iter().map(|[a, k, l]| format!("({a:e})*(1 - cos({k}*pi*x)*cos({l}*pi*y))")).collect();
    let boxes = Boxes { side: 1.0, height: 0.5, young: 2.1e5, poisson: 0.3, stiffness, approach: 3e-4, points: 128 };
    let series = Series::new(boxes, gap);
    let row = |(order, n): &(usize, usize)| {
        let sets = [
            format!("mesh.set.n={n}"),
            "body.upper.fix.2.z=-3e-4".to_owned(),
            format!("contact.0.gap=\"{}\"", terms.join(" + ")),
        ];
        row(session, "rough", *order, stiffness, &sets, &|table| at(&series, table, &gap))
    };
    meshes.iter().map(row).collect()
}

/// The rough face.
fn rough(session: &Session) -> Result<()> {
    let scene = load(Path::new("meshes/rough/scene.toml"), &[])?;
    let data = Data::new(DataSpec { file: "meshes/rough/rough.csv".into(), ..scene.data["rough"].spec.clone() });
    data.load()?;
    let gap = |x: f64, y: f64| 1e-3 - data.sample(&[x, y]).value;
    for (stiffness, approach) in [(1e5, 1.5e-3), (5e6, 5e-4), (5e6, 1.5e-3), (1e8, 1.5e-3)] {
        let boxes = Boxes { side: 1.0, height: 0.5, young: 2.1e5, poisson: 0.3, stiffness, approach, points: 128 };
        let series = Series::new(boxes, gap);
        for (order, n) in [(1, 16), (2, 8), (2, 12)] {
            let sets = [format!("mesh.set.n={n}"), format!("body.upper.fix.2.z=-{approach:e}")];
            row(session, "rough", order, stiffness, &sets, &|table| at(&series, table, &gap))?;
        }
    }
    Ok(())
}

/// Print a few rows on coarse meshes: a soft and a medium layer; nearly no layer, where points open and close by the estimate.
pub fn quick(session: &Session) -> Result<Ratios> {
    let rows = [
        paraboloids(session, 1e4, 64, &[(1, 0.03), (2, 0.05)])?,
        paraboloids(session, 1e6, 64, &[(1, 0.03), (2, 0.05)])?,
        spheres(session, 1e9, &[(1, 6, 1)])?,
        regular(session, 1e6, &[(1, 16, 6)])?,
        regular(session, 1e7, &[(2, 8, 6)])?,
        spheres(session, 1e8, &[(2, 3, 1)])?,
    ];
    Ok(rows.concat())
}

/// Print all rows.
fn all(session: &Session) -> Result<()> {
    let meshes = [(1, 0.03), (1, 0.02), (2, 0.05), (2, 0.03), (2, 0.02)];
    [1e4, 1e5, 1e6, 1e7, 1e8].iter().try_for_each(|k| paraboloids(session, *k, 192, &meshes).map(drop))?;
    let meshes = [(1, 16, 16), (1, 16, 12), (1, 16, 6), (2, 8, 8), (2, 8, 6), (2, 12, 12), (2, 10, 13)];
    [1e4, 1e5, 1e6, 1e7, 1e8].iter().try_for_each(|k| regular(session, *k, &meshes).map(drop))?;
    let meshes = [(1, 6, 1), (1, 12, 1), (2, 3, 1), (2, 4, 1), (2, 3, 3)];
    [1e7, 1e9].iter().try_for_each(|k| spheres(session, *k, &meshes).map(drop))?;
    let meshes = [(1, 12), (1, 16), (2, 8), (2, 12), (2, 16)];
    [1e4, 1e6, 1e8].iter().try_for_each(|k| waves(session, *k, &meshes).map(drop))?;
    rough(session)
}

fn main() -> Result<()> {
    let is_quick = Asked::parse().quick;
    let session = Session::start(&[])?;
    println!("| scene | elements | stiffness | error | estimated | ratio |\n| --- | --- | --- | --- | --- | --- |");
    if is_quick { quick(&session).map(drop) } else { all(&session) }
}
