use std::fs::Permissions;
use std::io;

use tempfile::TempDir;

use super::*;
use crate::FileKind;

const BUNDLE: Content = Content::Kind(FileKind::Bundle);
const BYTES: &[u8] = b"\x89PSB\r\n\x1a\n\x04new";
const PHOTOGRAPH: &[u8] = b"\xff\xd8\xff\xe0 a photograph";

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("a name").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn refused(outputs: &mut Outputs, path: &Path, content: Content) -> String {
    outputs.file(path, content).map(|_| ()).expect_err("refused").to_string()
}

#[test]
fn a_file_of_another_kind_is_replaced_only_when_asked() {
    let home = folder();
    let olds: [(&[u8], &str); 6] = [
        (PHOTOGRAPH, "is a JPEG picture, and a bundle (.psb) would replace it"),
        (b"# Image list with two lines of data per image", "is another file"),
        (b"{\"frames\": []}", "is a JSON file"),
        (b"<html>", "is a web page"),
        (b"\x89PSB\r\n\x1a\n\x04old", ""),
        (b"", ""),
    ];
    for (i, (old, said)) in olds.into_iter().enumerate() {
        let path = home.path().join(format!("{i}.psb"));
        fs::write(&path, old).expect("a file");
        if said.is_empty() {
            Outputs::new(false).file(&path, BUNDLE).expect("of its kind").write(BYTES).expect("room");
        } else {
            let found = refused(&mut Outputs::new(false), &path, BUNDLE);
            assert!(found.contains(said) && found.contains("--overwrite"), "{found}");
            assert_eq!(fs::read(&path).expect("there"), old);
            Outputs::new(true).file(&path, BUNDLE).expect("asked for").write(BYTES).expect("room");
        }
        assert_eq!(fs::read(&path).expect("there"), BYTES);
    }
    assert_eq!(names(home.path()).len(), 6, "nothing else is left");
}

#[test]
fn a_file_that_comes_between_is_kept() {
    let home = folder();
    let path = home.path().join("a.psb");
    let output = Outputs::new(false).file(&path, BUNDLE).expect("nothing there");
    fs::write(&path, PHOTOGRAPH).expect("hours later");
    let said = output.write(BYTES).expect_err("refused").to_string();
    assert!(said.contains("is a JPEG picture"), "{said}");
    assert_eq!(fs::read(&path).expect("there"), PHOTOGRAPH);
}

#[test]
fn pictures_of_ours_are_told_from_photographs() {
    let home = folder();
    let (ours, photograph) = (home.path().join("ours.jpg"), home.path().join("photograph.jpg"));
    fs::write(&ours, [b"\xff\xd8\xff\xfe\0\x0d".as_slice(), MARK.as_bytes()].concat()).expect("a file");
    fs::write(&photograph, PHOTOGRAPH).expect("a file");
    let picture = Content::Picture(FileKind::Jpeg);
    Outputs::new(false).file(&ours, picture).expect("drawn before");
    let said = refused(&mut Outputs::new(false), &photograph, picture);
    assert!(said.contains("is a JPEG picture that pocketsplat did not draw"), "{said}");
    Outputs::new(true).file(&photograph, picture).expect("asked for");
}

#[test]
fn text_is_told_by_how_it_begins() {
    let home = folder();
    let path = home.path().join("runs.csv");
    let table = Content::Text(&["run,"], "a table of runs");
    for (old, is_ours) in [("run,setting\n", true), ("runner,time\n", false), ("", true)] {
        fs::write(&path, old).expect("a file");
        assert_eq!(Outputs::new(false).file(&path, table).is_ok(), is_ours, "{old}");
    }
}

#[test]
fn what_is_read_is_never_replaced() {
    let home = folder();
    let capture = home.path().join("capture");
    fs::create_dir_all(capture.join("images")).expect("folders");
    let photograph = capture.join("images/a.jpg");
    fs::write(&photograph, PHOTOGRAPH).expect("a file");
    let config = home.path().join("run.psb");
    fs::write(&config, BYTES).expect("a file");
    let mut outputs = Outputs::new(true).reading(&config).reading_folder(&capture);
    let mut paths = vec![photograph.clone(), config, capture.join("images/../images/a.jpg")];
    let hard = home.path().join("hard.jpg");
    fs::hard_link(&photograph, &hard).expect("a link");
    paths.push(hard);
    #[cfg(unix)]
    {
        let soft = home.path().join("soft.jpg");
        std::os::unix::fs::symlink(&photograph, &soft).expect("a link");
        paths.push(soft);
    }
    for path in paths {
        let said = refused(&mut outputs, &path, BUNDLE);
        assert!(said.contains("is what this command reads"), "{said}");
    }
    // A bundle in the folder is no photograph; points may be the capture's.
    let (bundle, points) = (capture.join("a.psb"), capture.join("points.ply"));
    fs::write(&bundle, BYTES).expect("a file");
    fs::write(&points, "ply\nformat ascii 1.0\n").expect("a file");
    outputs.file(&bundle, BUNDLE).expect("written before");
    refused(&mut outputs, &points, Content::Kind(FileKind::Ply));
    assert_eq!(fs::read(&photograph).expect("there"), PHOTOGRAPH);
}

#[test]
fn two_outputs_are_two_files() {
    let home = folder();
    let mut outputs = Outputs::new(true);
    fs::create_dir(home.path().join("b")).expect("a folder");
    outputs.file(&home.path().join("a.html"), BUNDLE).expect("the first");
    let said = refused(&mut outputs, &home.path().join("b/../a.html"), BUNDLE);
    assert!(said.contains("are one file"), "{said}");
}

#[test]
fn folders_are_made_and_files_are_no_folders() {
    let home = folder();
    let deep = home.path().join("a/b/c.psb");
    Outputs::new(false).file(&deep, BUNDLE).expect("made").write(BYTES).expect("room");
    let said = refused(&mut Outputs::new(true), home.path(), BUNDLE);
    assert!(said.contains("is a folder, and needs to be a file"), "{said}");
    refused(&mut Outputs::new(true), &deep.join("d.psb"), BUNDLE);
    let said = Outputs::folder(&deep).expect_err("a file").to_string();
    assert!(said.contains("is no folder"), "{said}");
    Outputs::folder(&home.path().join("x/y")).expect("made");
}

#[test]
fn a_write_that_fails_leaves_the_older_file() {
    let home = folder();
    let path = home.path().join("file");
    fs::write(&path, "older").expect("a file");
    let error = write_whole(&path, |out| {
        out.write_all(&vec![0; 100_000])?;
        Err(io::ErrorKind::StorageFull.into())
    });
    assert_eq!(error.expect_err("no room").kind(), io::ErrorKind::StorageFull);
    assert_eq!(fs::read(&path).expect("there"), b"older");
    assert_eq!(names(home.path()), ["file"]);
}

#[cfg(unix)]
mod on_unix {
    use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _, PermissionsExt as _, symlink};
    use std::os::unix::net::UnixListener;
    use std::process::Command;

    use super::*;

    #[test]
    fn a_link_stays_a_link() {
        let home = folder();
        let at = |name: &str| home.path().join(name);
        fs::create_dir(at("elsewhere")).expect("a folder");
        symlink("elsewhere/second", at("first")).expect("a link");
        symlink("target.psb", at("elsewhere/second")).expect("a link that dangles");
        for round in [b"1", b"2"] {
            let bytes = [BYTES, round].concat();
            Outputs::new(false).file(&at("first"), BUNDLE).expect("fine").write(&bytes).expect("room");
            assert!(fs::symlink_metadata(at("first")).expect("there").is_symlink());
            assert!(fs::symlink_metadata(at("elsewhere/second")).expect("there").is_symlink());
            assert_eq!(fs::read(at("elsewhere/target.psb")).expect("written"), bytes);
        }
        assert_eq!(names(&at("elsewhere")), ["second", "target.psb"]);
        symlink("gone/a.psb", at("nowhere")).expect("a link");
        let said = refused(&mut Outputs::new(true), &at("nowhere"), BUNDLE);
        assert!(said.contains("whose folder is not there") && !at("gone").exists(), "{said}");
        symlink("circle", at("circle")).expect("a link");
        refused(&mut Outputs::new(true), &at("circle"), BUNDLE);
    }

    #[test]
    fn permissions_are_kept_and_what_is_read_only_stays() {
        let home = folder();
        let path = home.path().join("a.psb");
        fs::write(&path, BYTES).expect("a file");
        fs::set_permissions(&path, Permissions::from_mode(0o640)).expect("mine");
        let before = fs::metadata(&path).expect("there");
        Outputs::new(false).file(&path, BUNDLE).expect("fine").write(BYTES).expect("room");
        let after = fs::metadata(&path).expect("there");
        assert_eq!((after.mode(), after.uid(), after.gid()), (before.mode(), before.uid(), before.gid()));
        fs::set_permissions(&path, Permissions::from_mode(0o444)).expect("mine");
        assert!(refused(&mut Outputs::new(false), &path, BUNDLE).contains("is read-only"));
        Outputs::new(true).file(&path, BUNDLE).expect("asked for").write(BYTES).expect("room");
        assert_eq!(fs::metadata(&path).expect("there").mode() & 0o777, 0o444);
    }

    #[test]
    fn fifos_and_devices_are_written_through_and_stay() {
        let home = folder();
        let fifo = home.path().join("fifo");
        assert!(Command::new("mkfifo").arg(&fifo).status().is_ok_and(|status| status.success()));
        let reader = std::thread::spawn({
            let fifo = fifo.clone();
            move || fs::read(fifo).expect("bytes")
        });
        Outputs::new(false).file(&fifo, BUNDLE).expect("not opened").write(BYTES).expect("a reader");
        assert_eq!(reader.join().expect("no panic"), BYTES);
        assert!(fs::metadata(&fifo).expect("there").file_type().is_fifo());

        let socket = home.path().join("socket");
        let _listener = UnixListener::bind(&socket).expect("a socket");
        assert!(refused(&mut Outputs::new(true), &socket, BUNDLE).contains("is a socket"));

        // A node of our own, which root alone can make.
        let node = home.path().join("null");
        let made = Command::new("mknod").arg(&node).args(["c", "1", "3"]).status();
        if !made.is_ok_and(|status| status.success()) {
            eprintln!("skipped: no device can be made here");
            return;
        }
        let link = home.path().join("link");
        symlink("null", &link).expect("a link");
        for path in [&node, &link] {
            match Outputs::new(false).file(path, BUNDLE).expect("a device").write(BYTES) {
                Ok(()) => {}
                // A folder that is mounted without devices.
                Err(error) => eprintln!("skipped: {error}"),
            }
            assert!(fs::metadata(&node).expect("there").file_type().is_char_device());
        }
        assert_eq!(names(home.path()), ["fifo", "link", "null", "socket"]);
    }
}
