//! Holds the code to ARCHITECTURE.md: a room imports only from rooms below it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The rooms from the ground up. Each may use those before it, and itself.
const FLOORS: [&str; 9] =
    ["math", "scene", "film", "accel", "shading", "transport", "integrators", "session", "bridge"];

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Rooms named after `crate::` in a text, one of `crate::{a, b}` included.
fn imports(text: &str) -> Vec<String> {
    let code: String =
        text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let mut rooms = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        let list = match rest.strip_prefix('{') {
            Some(group) => group.split('}').next().unwrap_or_default().split(',').collect(),
            None => vec![rest],
        };
        for item in list {
            let name: String = item.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            rooms.push(name);
        }
    }
    rooms
}

#[test]
fn rooms_import_only_from_rooms_below() {
    let floor: BTreeMap<&str, usize> = FLOORS.iter().enumerate().map(|(i, r)| (*r, i)).collect();
    let mut wrong = Vec::new();
    for (room, level) in &floor {
        let mut files = Vec::new();
        rust_files(&source().join(room), &mut files);
        assert!(!files.is_empty(), "the room {room} is empty");
        for file in files {
            for import in imports(&fs::read_to_string(&file).unwrap()) {
                match floor.get(import.as_str()) {
                    Some(other) if other <= level => {}
                    Some(_) => wrong.push(format!("{} imports {import}, which is above it", file.display())),
                    None => wrong.push(format!("{} imports {import}, which is no room", file.display())),
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_room_is_declared_and_on_a_floor() {
    let lib = fs::read_to_string(source().join("lib.rs")).unwrap();
    let declared: Vec<&str> = lib
        .lines()
        .filter_map(|l| l.trim().strip_prefix("pub mod ").or(l.trim().strip_prefix("mod ")))
        .collect();
    let declared: Vec<&str> = declared.iter().map(|l| l.trim_end_matches(';')).collect();
    let mut folders: Vec<String> = fs::read_dir(source())
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_dir())
        .map(|p| p.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    folders.sort();
    let mut expected: Vec<&str> = FLOORS.to_vec();
    expected.sort();
    assert_eq!(folders, expected);
    assert!(expected.iter().all(|r| declared.contains(r)), "{declared:?}");
}

/// A file that outgrew its subject is to be split. Tests count too: they are read.
#[test]
fn no_file_has_outgrown_its_subject() {
    let mut files = Vec::new();
    rust_files(&source(), &mut files);
    for file in files {
        let lines = fs::read_to_string(&file).unwrap().lines().count();
        assert!(lines <= 600, "{} has {lines} lines", file.display());
    }
}
