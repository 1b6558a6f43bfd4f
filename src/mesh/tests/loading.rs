//! Tests of the way from scripts and files to meshes, with the cache.

use super::*;
use crate::mesh::{Origin, load, view};
use crate::problem::mesh::MeshSource;

#[test]
fn scripts_are_meshed_once_for_each_key() {
    let folder = tempfile::tempdir().unwrap();
    let cache = [folder.path().join("cache")];
    let geo = folder.path().join("main.geo");
    let part = folder.path().join("part.geo");
    std::fs::write(&geo, "Include \"part.geo\";\n").unwrap();
    std::fs::write(&part, SQUARE).unwrap();
    let run = |n: f64, order| meshed::<2>(&geo, &[("n".into(), n)], order, &cache).unwrap();

    let first = run(4.0, Order::P1);
    assert_eq!(first.origin, Origin::Gmsh);
    assert_eq!(first.mesh.group("left").unwrap().len(), 4);
    assert_eq!(first.mesh.path, geo);
    let again = run(4.0, Order::P1);
    assert_eq!((again.origin, &again.file), (Origin::Cache, &first.file));
    assert_eq!((again.mesh.points, &again.mesh.groups), (first.mesh.points, &first.mesh.groups));
    assert_eq!(run(3.0, Order::P1).origin, Origin::Gmsh);
    let quadratic = run(4.0, Order::P2);
    assert_eq!((quadratic.origin, quadratic.mesh.order), (Origin::Gmsh, Order::P2));

    // A damaged file is made anew.
    let whole = std::fs::read(&first.file).unwrap();
    std::fs::write(&first.file, &whole[..whole.len() / 2]).unwrap();
    assert_eq!(run(4.0, Order::P1).origin, Origin::Gmsh);
    assert_eq!(run(4.0, Order::P1).origin, Origin::Cache);
    // A change of an included file is seen, and its reversal is remembered.
    std::fs::write(&part, SQUARE.replace("1/4", "1/2")).unwrap();
    let moved = run(4.0, Order::P1);
    assert_eq!(moved.origin, Origin::Gmsh);
    assert!((extent(&moved.mesh, moved.mesh.group("steel").unwrap()) - 1.0).abs() < 1e-9);
    std::fs::write(&part, SQUARE).unwrap();
    assert_eq!(run(4.0, Order::P1).origin, Origin::Cache);
    // Only meshes are left: n = 4, n = 3, order 2, and the one of the changed file.
    assert_eq!(std::fs::read_dir(&cache[0]).unwrap().count(), 4);
}

/// Gmsh omits the last command of a script whose last line is not ended.
#[test]
fn the_last_line_of_a_script_need_not_end() {
    let folder = tempfile::tempdir().unwrap();
    let cache = [folder.path().join("cache")];
    let geo = folder.path().join("main.geo");
    std::fs::write(folder.path().join("part.geo"), SQUARE.trim_end()).unwrap();
    let corners = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]];
    let sizes = view(3, &corners, &[0.5; 3]);
    for script in [SQUARE.trim_end(), "Include 'part.geo';"] {
        std::fs::write(&geo, script).unwrap();
        for sizes in [None, Some(&sizes[..])].into_iter().take(if script.contains("Include") { 1 } else { 2 }) {
            let guard = (&Guard::default(), &Interrupt::default());
            let loaded = from_script::<2>(&located(geo.clone()), (&[], &[]), sizes, Order::P1, guard, &cache).unwrap();
            assert!(loaded.mesh.group("outside").is_some(), "{script}");
        }
    }
}

#[test]
fn scripts_in_error_are_refused_with_what_gmsh_says() {
    let folder = tempfile::tempdir().unwrap();
    let cache = [folder.path().join("cache")];
    let refuse = |script: &str, set: &[(String, f64)], order| {
        let geo = folder.path().join("a.geo");
        std::fs::write(&geo, script).unwrap();
        meshed::<2>(&geo, set, order, &cache).unwrap_err().to_string()
    };
    let message = refuse("Line(1) = {1, 7};", &[], Order::P1);
    assert!(message.contains("a.geo: Gmsh cannot mesh this script"), "{message}");
    assert!(message.contains("Unknown control point"), "{message}");
    let message = refuse(SQUARE, &[("m".into(), 1.0)], Order::P1);
    assert!(message.contains("did you mean `n`?") && message.contains("scene.toml"), "{message}");
    let message = refuse(&format!("{SQUARE}Mesh.ElementOrder = 1;"), &[], Order::P2);
    assert!(message.contains("remove `Mesh.ElementOrder`"), "{message}");
    // Lines and bytes of the mesh mean nothing to someone who wrote a script.
    let message = refuse(&format!("{SQUARE}Physical Curve(\"gone\") = {{99}};"), &[], Order::P1);
    assert!(message.contains("a.geo: ") && message.contains("`gone`") && !message.contains("byte"), "{message}");
    assert_eq!(std::fs::read_dir(&cache[0]).unwrap().count(), 0);
}

#[test]
fn mesh_files_serve_lower_orders_but_not_higher_ones() {
    let folder = tempfile::tempdir().unwrap();
    let source = |name: &str| MeshSource::Msh { file: located(folder.path().join(name)) };
    for order in ["1", "2"] {
        std::fs::write(folder.path().join(order), gmsh(SQUARE, &["-2", "-order", order])).unwrap();
    }
    let load = |name: &str, order| load::<2>(&source(name), order, &Interrupt::default());
    let loaded = load("2", Order::P1).unwrap();
    assert_eq!((loaded.origin, loaded.mesh.order, loaded.mesh.points.len()), (Origin::File, Order::P1, 15));
    assert_eq!(load("2", Order::P2).unwrap().mesh.order, Order::P2);
    let message = load("1", Order::P2).unwrap_err().to_string();
    assert!(message.contains("the mesh is of order 1") && message.contains("scene.toml"), "{message}");
    let message = load("3", Order::P2).unwrap_err().to_string();
    assert!(message.contains("cannot read") && message.contains("scene.toml"), "{message}");
}

/// A mesh that Gmsh converts depends on Gmsh, and one that is read directly does not.
#[test]
fn converted_meshes_are_made_by_gmsh() {
    let folder = tempfile::tempdir().unwrap();
    let made_from = |name: &str| {
        let file = folder.path().join(name);
        std::fs::write(&file, "$MeshFormat\n4.1 0 8\n").unwrap();
        load::made_from(&MeshSource::Msh { file: located(file) }, 2, Order::P1).unwrap()
    };
    let [direct, converted] = ["a.msh", "a.unv"].map(made_from);
    assert_ne!(direct, converted);
}

#[test]
fn loads_at_the_same_time_do_not_meet() {
    let folder = tempfile::tempdir().unwrap();
    let cache = [folder.path().join("cache")];
    let geo = folder.path().join("a.geo");
    std::fs::write(&geo, SQUARE).unwrap();
    let load = || meshed::<2>(&geo, &[], Order::P1, &cache).unwrap();
    std::thread::scope(|scope| {
        let threads = [(); 4].map(|()| scope.spawn(load));
        for thread in threads {
            assert_eq!(thread.join().unwrap().mesh.points.len(), 15);
        }
    });
    assert_eq!(std::fs::read_dir(&cache[0]).unwrap().count(), 1);
    assert_eq!(load().origin, Origin::Cache);
}

/// Gmsh's parallel algorithm makes another mesh of the same cube. This mesh has its own file in the cache, and it does not
/// depend on the number of threads.
#[test]
fn free_meshes_in_space_by_threads() {
    let folder = tempfile::tempdir().unwrap();
    let cache = [folder.path().join("cache")];
    let geo = folder.path().join("cube.geo");
    let cube = "SetFactory(\"OpenCASCADE\");\nBox(1) = {0, 0, 0, 1, 1, 1};\nMeshSize{:} = 0.2;\n\
                Physical Volume(\"all\") = {1};\nPhysical Surface(\"bottom\") = {5};\n";
    std::fs::write(&geo, cube).unwrap();
    let run = |threads: Option<usize>| {
        let guard = Guard { threads, ..Guard::default() };
        let limits = (&guard, &Interrupt::default());
        let loaded = from_script::<3>(&located(geo.clone()), (&[], &[]), None, Order::P1, limits, &cache).unwrap();
        (loaded.origin, loaded.mesh.points)
    };
    let ((_, usual), (origin, parallel)) = (run(None), run(Some(1)));
    assert_eq!(origin, Origin::Gmsh);
    // The numbers of points may be equal, but the points differ.
    let counts = [&usual, &parallel].map(Vec::len);
    assert!(usual != parallel && counts[0].abs_diff(counts[1]) < counts[0] / 4, "{counts:?}");
    assert_eq!((run(Some(2)), run(None)), ((Origin::Cache, parallel), (Origin::Cache, usual)));
}
