//! A folder of results is written whole, or left unchanged.

use std::fs;
use std::path::Path;

use rlg::output::{OutputFolder, write_file};

/// Returns every name under `folder`, hidden ones included.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let name = |entry: std::io::Result<fs::DirEntry>| {
        entry
            .expect("an entry")
            .file_name()
            .to_string_lossy()
            .into_owned()
    };
    let mut names: Vec<_> = entries.map(name).collect();
    names.sort();
    names
}

#[test]
fn nothing_appears_before_commit_and_nothing_stays_without_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let target = folder.path().join("a/b/out");
    let mut out = OutputFolder::create(&target).unwrap_or_else(|error| panic!("{error}"));
    out.write("plots/one.svg", b"<svg/>")
        .unwrap_or_else(|error| panic!("{error}"));
    assert!(!target.exists());
    drop(out);
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_new_folder_appears_with_all_its_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let target = folder.path().join("a/out");
    let mut out = OutputFolder::create(&target).unwrap_or_else(|error| panic!("{error}"));
    for name in ["one.json", "plots/two.svg"] {
        out.write(name, name.as_bytes())
            .unwrap_or_else(|error| panic!("{error}"));
    }
    out.commit().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(names(&target), ["one.json", "plots"]);
    assert_eq!(names(&target.join("plots")), ["two.svg"]);
    assert_eq!(names(folder.path()), ["a"]);
}

#[test]
fn an_existing_folder_keeps_its_other_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("notes.txt"), "mine").expect("a file");
    fs::write(folder.path().join("one.json"), "old").expect("a file");
    let mut out = OutputFolder::create(folder.path()).unwrap_or_else(|error| panic!("{error}"));
    out.write("one.json", b"new")
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        fs::read(folder.path().join("one.json")).expect("kept"),
        b"old"
    );
    out.commit().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(names(folder.path()), ["notes.txt", "one.json"]);
    assert_eq!(
        fs::read(folder.path().join("one.json")).expect("replaced"),
        b"new"
    );
}

#[test]
fn a_folder_in_the_way_of_a_file_stops_before_anything_is_replaced() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("one.json"), "old").expect("a file");
    fs::create_dir(folder.path().join("two.json")).expect("a folder");
    let mut out = OutputFolder::create(folder.path()).unwrap_or_else(|error| panic!("{error}"));
    for name in ["one.json", "two.json"] {
        out.write(name, b"new")
            .unwrap_or_else(|error| panic!("{error}"));
    }
    let error = out.commit().expect_err("a folder is in the way");
    assert!(error.to_string().contains("cannot be written"), "{error}");
    assert_eq!(
        fs::read(folder.path().join("one.json")).expect("kept"),
        b"old"
    );
    assert_eq!(names(folder.path()), ["one.json", "two.json"]);
}

#[test]
fn a_file_where_a_folder_belongs_is_refused_at_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("file");
    fs::write(&file, "x").expect("a file");
    for target in [file.clone(), file.join("below")] {
        let error = OutputFolder::create(&target).expect_err("a file is in the way");
        assert!(error.to_string().contains("file"), "{error}");
    }
    assert_eq!(names(folder.path()), ["file"]);
}

#[test]
fn a_single_file_is_replaced_whole() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.toml");
    for content in ["a longer first version", "second"] {
        write_file(&path, content.as_bytes()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(fs::read(&path).expect("written"), content.as_bytes());
    }
    assert_eq!(names(folder.path()), ["model.toml"]);
}
