//! The files that an earlier run left in a folder of results. The next one removes them before it writes its first file, so that
//! nothing old stands beside what is new, however it ends.
//!
//! Names come from lists that the program itself wrote: those of the report, the collection of fields and the table of pairs. Files whose
//! names never change count only if they begin as the program begins them: those of users stay.

use serde_json::Value;
use std::fs;
use std::path::{Component, Path};

/// Files with one name in all runs, and texts of which their first line has one.
const TABLES: [(&str, &[&str]); 5] = [
    ("history.csv", &["iteration,residual,error,increment"]),
    ("steps.csv", &["step,time,"]),
    ("contacts.csv", &["a,b,surface_a,surface_b"]),
    ("sweep.csv", &[",status,iterations,sweeps,factorizations,"]),
    (SUMS, &[SUMS_TITLE]),
];

/// The sums of all files of a run.
pub const SUMS: &str = "SHA256SUMS";

/// How it begins.
pub const SUMS_TITLE: &str = "# the files of this run as it wrote them: sha256sum -c SHA256SUMS";

/// Page and pictures that go with a report.
const WITH_REPORT: [&str; 3] = ["report.html", "convergence.svg", "force-approach.svg"];

/// The report.
const REPORT: &str = "report.json";

/// The collection of fields.
const COLLECTION: &str = "bodies.pvd";

/// Endings of all files that reports and tables name.
const ENDINGS: [&str; 6] = ["csv", "svg", "vtu", "pvtu", "pvd", "msh"];

/// Folder of the fields of load steps.
pub const STEPS: &str = "steps";

/// Names of the files that `solve` or `sweep` left in a folder. Lists come after what they name: a removal that is cut short leaves
/// the rest to the next one.
pub fn of_runs(folder: &Path) -> Vec<String> {
    let has = |(name, starts): &(&str, &[&str])| {
        let line = text(folder, name).lines().next().unwrap_or_default().to_owned();
        starts.iter().any(|start| line.contains(start))
    };
    let tables: Vec<&str> = TABLES.iter().filter(|table| has(table)).map(|(name, _)| *name).collect();
    let report: Value = serde_json::from_str(&text(folder, REPORT)).unwrap_or_default();
    let is_report = report["status"].is_string() && report["files"].is_array();
    let mut lists = tables.clone();
    // fields of load steps come before the first report
    let mut named = match is_report || tables.contains(&"history.csv") {
        true => listed_in_collection(folder),
        false => Vec::new(),
    };
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
    named.retain(|name| is_ours(name) && !lists.contains(&name.as_str()));
    named.sort();
    named.dedup();
    named.extend(lists.into_iter().map(str::to_owned));
    named
}

/// Whether a name is one of a run: a file of the folder itself or of a step, with the ending of a result.
fn is_ours(name: &str) -> bool {
    let parts: Vec<Component> = Path::new(name).components().collect();
    let is_inside = match parts[..] {
        [Component::Normal(_)] => true,
        [Component::Normal(first), Component::Normal(_)] => first == STEPS,
        _ => false,
    };
    let ending = Path::new(name).extension().and_then(|ending| ending.to_str());
    is_inside && ending.is_some_and(|ending| ENDINGS.contains(&ending))
}

/// The text of a regular file; empty if there is none.
fn text(folder: &Path, name: &str) -> String {
    let path = folder.join(name);
    let is_file = fs::symlink_metadata(&path).is_ok_and(|data| data.is_file());
    let bytes = if is_file { fs::read(&path).unwrap_or_default() } else { Vec::new() };
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Fields of the last step and of those before.
fn listed_in_collection(folder: &Path) -> Vec<String> {
    let text = text(folder, COLLECTION);
    let lines = text.lines().filter(|line| line.contains(r#" group="" part=""#));
    let names = lines.flat_map(|line| line.split(" file=\"").skip(1)).filter_map(|rest| rest.split_once('"'));
    let mut names: Vec<String> = names.map(|(name, _)| name.to_owned()).collect();
    // parts of ranks stand in the files that join them
    for joined in names.clone().into_iter().filter(|name| name.ends_with(".pvtu") && is_ours(name)) {
        let base = joined.rsplit_once('/').map_or(String::new(), |(base, _)| format!("{base}/"));
        let parts = self::text(folder, &joined);
        let parts = parts.split(" Source=\"").skip(1).filter_map(|rest| rest.split_once('"'));
        names.extend(parts.map(|(part, _)| format!("{base}{part}")));
    }
    names
}

/// Tables and plots of pairs, which are written before the report.
fn listed_in_contacts(folder: &Path) -> Vec<String> {
    let text = text(folder, "contacts.csv");
    let mut table = csv::Reader::from_reader(text.as_bytes());
    let columns = table.headers().map(|header| ["table", "plot"].map(|name| header.iter().position(|h| h == name)));
    let columns: Vec<usize> = columns.into_iter().flatten().flatten().collect();
    let rows = table.records().map_while(Result::ok);
    let names = rows.flat_map(|row| columns.iter().filter_map(|&k| row.get(k).map(str::to_owned)).collect::<Vec<_>>());
    names.filter(|name| !name.is_empty()).collect()
}

/// Pictures called `stem-2.svg`, `stem-3.svg` and so on, as far as they go.
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
        // of a user
        write("steps.csv", "time,factor\n");
        let found = || of_runs(folder.path());
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
