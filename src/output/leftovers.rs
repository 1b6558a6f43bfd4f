//! The files that an earlier run left in a folder of results. The next run removes them before it writes its first file, so that
//! old and new results are never mixed, however the run ends.
//!
//! Names come from lists that the program itself wrote: in the report, the collection of fields and the table of pairs. Files
//! with fixed names are removed only if their first line is one that the program writes, so that files of users stay.

use serde_json::Value;
use std::fs;
use std::path::{Component, Path};

/// Files with a fixed name. A file counts as a result if its first line contains one of these texts.
const TABLES: [(&str, &[&str]); 5] = [
    ("history.csv", &["iteration,residual,error,increment"]),
    ("steps.csv", &["step,time,"]),
    ("contacts.csv", &["a,b,surface_a,surface_b"]),
    ("sweep.csv", &[",status,iterations,sweeps,factorizations,"]),
    (SUMS, &[SUMS_TITLE]),
];

/// The list of the checksums of all files of a run.
pub const SUMS: &str = "SHA256SUMS";

/// First line of [`SUMS`].
pub const SUMS_TITLE: &str = "# the files of this run as it wrote them: sha256sum -c SHA256SUMS";

/// Page and pictures that belong to a report.
const WITH_REPORT: [&str; 3] = ["report.html", "convergence.svg", "force-approach.svg"];

/// The report of a run.
const REPORT: &str = "report.json";

/// The collection of the fields of a run.
const COLLECTION: &str = "bodies.pvd";

/// Extensions of the files that reports and tables name.
const EXTENSIONS: [&str; 6] = ["csv", "svg", "vtu", "pvtu", "pvd", "msh"];

/// Folder of the fields of load steps.
pub const STEPS: &str = "steps";

/// Return the names of the files that `solve` or `sweep` left in a folder. Lists come after the files that they name, so that
/// the next removal can complete one that was cut short.
pub fn files_of_runs(folder: &Path) -> Vec<String> {
    let is_result = |(name, starts): &&(&str, &[&str])| {
        let text = text(folder, name);
        let first = text.lines().next().unwrap_or_default();
        starts.iter().any(|start| first.contains(start))
    };
    let tables: Vec<&str> = TABLES.iter().filter(is_result).map(|(name, _)| *name).collect();
    let report: Value = serde_json::from_str(&text(folder, REPORT)).unwrap_or_default();
    let is_report = report["status"].is_string() && report["files"].is_array();
    let mut lists = tables.clone();
    let mut named = Vec::new();
    // fields of load steps are written before the first report
    if is_report || tables.contains(&"history.csv") {
        named.extend(listed_in_collection(folder));
    }
    if !named.is_empty() {
        lists.push(COLLECTION);
    }
    if is_report {
        named.extend(report["files"].as_array().into_iter().flatten().filter_map(|f| f.as_str().map(str::to_owned)));
        lists.extend(WITH_REPORT);
        lists.push(REPORT);
    }
    if tables.contains(&"contacts.csv") {
        named.extend(listed_in_contacts(folder));
    }
    if tables.contains(&"sweep.csv") {
        named.extend(["convergence.svg", "pressure.svg"].map(str::to_owned));
        named.extend(numbered(folder, "pressure"));
    }
    named.retain(|name| may_be_result(name) && !lists.contains(&name.as_str()));
    named.sort();
    named.dedup();
    named.extend(lists.into_iter().map(str::to_owned));
    named
}

/// Whether a run may have written a file of this name: in the folder itself or in [`STEPS`], with the extension of a result.
fn may_be_result(name: &str) -> bool {
    let parts: Vec<Component> = Path::new(name).components().collect();
    let is_inside = match parts[..] {
        [Component::Normal(_)] => true,
        [Component::Normal(first), Component::Normal(_)] => first == STEPS,
        _ => false,
    };
    let extension = Path::new(name).extension().and_then(|extension| extension.to_str());
    is_inside && extension.is_some_and(|extension| EXTENSIONS.contains(&extension))
}

/// Return the text of a regular file, or an empty text if there is none.
fn text(folder: &Path, name: &str) -> String {
    let path = folder.join(name);
    let is_file = fs::symlink_metadata(&path).is_ok_and(|data| data.is_file());
    let bytes = if is_file { fs::read(&path).unwrap_or_default() } else { Vec::new() };
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Return the names of the fields of all load steps from the collection.
fn listed_in_collection(folder: &Path) -> Vec<String> {
    let text = text(folder, COLLECTION);
    let lines = text.lines().filter(|line| line.contains(r#" group="" part=""#));
    let names = lines.flat_map(|line| line.split(" file=\"").skip(1)).filter_map(|rest| rest.split_once('"'));
    let mut names: Vec<String> = names.map(|(name, _)| name.to_owned()).collect();
    // a `.pvtu` file lists the parts that the ranks wrote
    for joined in names.clone().into_iter().filter(|name| name.ends_with(".pvtu") && may_be_result(name)) {
        let base = joined.rsplit_once('/').map_or(String::new(), |(base, _)| format!("{base}/"));
        let parts = self::text(folder, &joined);
        let parts = parts.split(" Source=\"").skip(1).filter_map(|rest| rest.split_once('"'));
        names.extend(parts.map(|(part, _)| format!("{base}{part}")));
    }
    names
}

/// Return the names of the tables and plots of pairs, which are written before the report.
fn listed_in_contacts(folder: &Path) -> Vec<String> {
    let text = text(folder, "contacts.csv");
    let mut table = csv::Reader::from_reader(text.as_bytes());
    let columns = table.headers().map(|header| ["table", "plot"].map(|name| header.iter().position(|h| h == name)));
    let columns: Vec<usize> = columns.into_iter().flatten().flatten().collect();
    let rows = table.records().map_while(Result::ok);
    let names = rows.flat_map(|row| columns.iter().filter_map(|&k| row.get(k).map(str::to_owned)).collect::<Vec<_>>());
    names.filter(|name| !name.is_empty()).collect()
}

/// Return the pictures `stem-2.svg`, `stem-3.svg` and so on, up to the first that is missing.
fn numbered(folder: &Path, stem: &str) -> Vec<String> {
    let names = (2..).map(|number| format!("{stem}-{number}.svg"));
    names.take_while(|name| folder.join(name).symlink_metadata().is_ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_lists_name_are_ours_and_no_others() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        fs::create_dir(folder.path().join(STEPS)).unwrap();
        write("bodies.pvd", r#"<DataSet timestep="0" group="" part="0" name="a" file="steps/a-1.pvtu"/>"#);
        write("steps/a-1.pvtu", r#"<Piece Source="a-1-r0.vtu"/>"#);
        write(
            "contacts.csv",
            "a,b,surface_a,surface_b,table,plot\n1,2,3,4,contact-a-b.csv,pressure-3.svg\n1,2,3,4,,\n",
        );
        write("history.csv", "step,iteration,residual,error,increment\n");
        // a file of a user
        write("steps.csv", "time,factor\n");
        let found = || files_of_runs(folder.path());
        let fields = ["contact-a-b.csv", "pressure-3.svg", "steps/a-1-r0.vtu", "steps/a-1.pvtu"];
        assert_eq!(found(), [&fields[..], &["history.csv", "contacts.csv", COLLECTION]].concat());
        let foreign = ["../x.csv", "/etc/x.csv", "steps/../x.csv", "scene.toml", "b/c.vtu"];
        let files = [&foreign[..], &["a.vtu"]].concat();
        write("report.json", &serde_json::json!({ "status": "converged", "files": files }).to_string());
        let all = found();
        assert!(
            all.contains(&"a.vtu".to_owned()) && foreign.iter().all(|name| !all.contains(&(*name).to_owned())),
            "{all:?}"
        );
        assert_eq!(all.last().unwrap(), REPORT);
        assert!(!all.contains(&"steps.csv".to_owned()));
    }
}
