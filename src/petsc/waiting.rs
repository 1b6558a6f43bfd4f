//! The table of options until PETSc is started.

use std::cell::RefCell;
use std::collections::BTreeMap;

/// An option: its name with the dash, and its value if it has one.
pub type Entry = (String, Option<String>);

#[derive(Default)]
struct Slot {
    value: Option<String>,
    is_read: bool,
}

thread_local! {
    static TABLE: RefCell<BTreeMap<String, Slot>> = const { RefCell::new(BTreeMap::new()) };
}

/// Return the key of an option in the table. PETSc ignores the case of letters.
fn key(table: &BTreeMap<String, Slot>, name: &str) -> String {
    table.keys().find(|known| known.eq_ignore_ascii_case(name)).cloned().unwrap_or_else(|| name.to_owned())
}

/// Set an option. Names of this module have their dash.
pub(super) fn set(name: &str, value: Option<&str>) {
    TABLE.with_borrow_mut(|table| {
        let key = key(table, name);
        table.insert(key, Slot { value: value.map(str::to_owned), is_read: false });
    });
}

/// Remove an option.
pub(super) fn clear(name: &str) {
    TABLE.with_borrow_mut(|table| table.remove(&key(table, name)));
}

/// Mark an option as read and return its value.
pub(super) fn read(name: &str) -> Option<String> {
    TABLE.with_borrow_mut(|table| {
        let slot = table.get_mut(&key(table, name))?;
        slot.is_read = true;
        slot.value.clone()
    })
}

/// Return whether an option was read.
pub(super) fn used(name: &str) -> bool {
    TABLE.with_borrow(|table| table.get(&key(table, name)).is_some_and(|slot| slot.is_read))
}

/// Return all options sorted by name, or only those that nobody has read.
pub(super) fn entries(only_unread: bool) -> Vec<Entry> {
    let entry =
        |(name, slot): (&String, &Slot)| (!only_unread || !slot.is_read).then(|| (name.clone(), slot.value.clone()));
    TABLE.with_borrow(|table| table.iter().filter_map(entry).collect())
}

/// Take all options out of the table: name, value, and whether it was read.
pub(super) fn take() -> impl Iterator<Item = (String, Option<String>, bool)> {
    TABLE.take().into_iter().map(|(name, slot)| (name, slot.value, slot.is_read))
}
