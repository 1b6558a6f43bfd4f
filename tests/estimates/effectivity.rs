//! Estimated over true errors of pressures in space, where contact ends inside a surface.

use crate::common::series::{Boxes, Series};
use std::path::Path;
use winkler::api::{ContactTable, Error, Kind, Result, Session, load, solve};

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

/// Return a few ratios on coarse meshes: a soft and a medium layer; nearly no layer, where points open and close by the estimate.
fn rows(session: &Session) -> Result<Ratios> {
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

/// Linear and quadratic elements, free graded tetrahedra and surfaces that do not match, under soft and stiff layers.
#[test]
fn estimates_are_of_the_size_of_errors() {
    let ratios = crate::common::here::with_session(|session| rows(session).expect("all rows"));
    assert!(ratios.len() == 8 && ratios.iter().all(|ratio| (0.7..2.0).contains(ratio)), "{ratios:?}");
}

/// The reference of the scene, by which `bench` measures errors, has an error of 1e-5 in the mean square.
#[test]
fn the_reference_of_the_paraboloid_is_its_series() {
    let scene = load(Path::new("meshes/paraboloid/scene.toml"), &[]).expect("a scene");
    let gap = |x: f64, y: f64| 4e-3 * (x * x + y * y);
    let boxes =
        Boxes { side: 0.5, height: 0.5, young: 2.1e5, poisson: 0.3, stiffness: 1e6, approach: 3e-4, points: 256 };
    let place = |i: u32| 0.5 * f64::from(i) / 400.0;
    let (x, y): (Vec<f64>, Vec<f64>) = (0..400).map(|i| (place(i), place(i * 7 % 400))).unzip();
    let reference = scene.contacts[0].reference.as_ref().expect("a reference");
    let exact = Series::new(boxes, gap).at(&x, &y, gap);
    let square = |error: &dyn Fn(usize) -> f64| (0..x.len()).map(|q| error(q).powi(2)).sum::<f64>();
    let error = (square(&|q| reference.eval([x[q], y[q], 0.0]) - exact[q]) / square(&|q| exact[q])).sqrt();
    assert!(exact.iter().any(|p| *p > 90.0) && error < 3e-5, "{error}");
}
