//! Options that were set while PETSc waits to be started: its table till then.

use std::cell::RefCell;
use std::collections::BTreeMap;

/// An option: its name with the dash, and its value if it has one.
pub type Entry = (String, Option<String>);

#[derive(Default)]
struct Slot {
    value: Option<String>,
    read: bool,
}

thread_local! {
    static TABLE: RefCell<BTreeMap<String, Slot>> = const { RefCell::new(BTreeMap::new()) };
}

/// The key under which an option stands: PETSc does not tell capital from small letters.
fn place(table: &BTreeMap<String, Slot>, name: &str) -> String {
    table.keys().find(|known| known.eq_ignore_ascii_case(name)).cloned().unwrap_or_else(|| name.to_owned())
}

/// Sets an option, by its name with the dash.
pub(super) fn set(name: &str, value: Option<&str>) {
    TABLE.with_borrow_mut(|table| {
        let place = place(table, name);
        table.insert(place, Slot { value: value.map(str::to_owned), read: false });
    });
}

/// Removes an option.
pub(super) fn clear(name: &str) {
    TABLE.with_borrow_mut(|table| table.remove(&place(table, name)));
}

/// Marks an option as read and returns its value.
pub(super) fn read(name: &str) -> Option<String> {
    TABLE.with_borrow_mut(|table| {
        let slot = table.get_mut(&place(table, name))?;
        slot.read = true;
        slot.value.clone()
    })
}

/// Whether an option was read.
pub(super) fn used(name: &str) -> bool {
    TABLE.with_borrow(|table| table.get(&place(table, name)).is_some_and(|slot| slot.read))
}

/// All options by name, or those that nobody has read.
pub(super) fn entries(unread: bool) -> Vec<Entry> {
    let entry = |(name, slot): (&String, &Slot)| (!unread || !slot.read).then(|| (name.clone(), slot.value.clone()));
    TABLE.with_borrow(|table| table.iter().filter_map(entry).collect())
}

/// Takes all options out: name, value, and whether it was read.
pub(super) fn take() -> impl Iterator<Item = (String, Option<String>, bool)> {
    TABLE.take().into_iter().map(|(name, slot)| (name, slot.value, slot.read))
}
