//! Commands that are printed: words of a shell, whatever the folder is called.

use super::*;

#[test]
fn remedies_for_captures_without_poses() {
    /// What `poses` leaves in the folder that the command names; the command's own tests run it.
    fn reconstruct(fixture: &mut Fixture, said: &str) -> (PathBuf, LoadOptions) {
        let (photographs, capture) = poses_in(said);
        assert_eq!(unquoted(photographs), fixture.path());
        assert_eq!(unquoted(capture), fixture.path());
        fixture.write_files();
        again(fixture)
    }
    check_all(&[
        trouble("photographs", ColmapBinary, |_| {}).remedy("find them, and give the folder `", reconstruct),
        trouble("a camera of Polycam cut", Nerfstudio, |f| {
            write_polycam(f, "cameras", "images");
            f.write("keyframes/cameras/p_04.json", "{\"fx\": 20");
        })
        .remedy("export the capture again", |f, _| {
            let whole = std::fs::read(f.at("keyframes/cameras/p_05.json")).expect("written");
            f.write("keyframes/cameras/p_04.json", whole);
            again(f)
        }),
        trouble("cameras of Metashape without poses", Nerfstudio, |f| {
            f.write("cameras.xml", "<document><chunk><sensors/><cameras/></chunk></document>");
        })
        .remedy("export again with File > Export > Export Cameras", |f, _| {
            write_metashape(f, "frame");
            again(f)
        }),
    ]);
}

/// The photographs and the capture of the command that finds poses.
fn poses_in(said: &str) -> (&str, &str) {
    let command = said.lines().find_map(|line| line.trim().strip_prefix("pocketsplat poses ")).expect("a command");
    command.split_once(" -o ").expect("an output")
}

/// The path of a word of a shell.
fn unquoted(word: &str) -> PathBuf {
    let plain = word.strip_prefix('\'').and_then(|word| word.strip_suffix('\'')).map(|word| word.replace("'\\''", "'"));
    PathBuf::from(plain.unwrap_or_else(|| word.to_owned()))
}

#[test]
fn commands_are_words_of_a_shell_whatever_the_folder_is_called() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let capture = folder.path().join("Ann's $HOME photographs");
    std::fs::create_dir_all(capture.join("images")).expect("a folder");
    std::fs::write(capture.join("images/1.HEIC"), "").expect("a file");
    std::fs::write(folder.path().join("Ann's.zip"), "").expect("a file");
    std::fs::write(folder.path().join("Ann's.mov"), "").expect("a file");
    let said = |path: &Path| load(path, &LoadOptions::default()).expect_err("no capture").to_string();
    for path in [capture.clone(), folder.path().join("Ann's.zip"), folder.path().join("Ann's.mov")] {
        let message = said(&path);
        let commands: Vec<&str> =
            message.lines().skip(1).filter(|line| line.starts_with("  ")).map(str::trim).collect();
        assert!(!commands.is_empty(), "{message}");
        for command in commands {
            // The shell itself says how it takes the words apart.
            let printed = std::process::Command::new("sh")
                .args(["-c", &format!("set -f; printf '%s\\n' {command}")])
                .output()
                .expect("a shell");
            assert!(printed.status.success(), "{command}");
            let words = String::from_utf8(printed.stdout).expect("text");
            let is_of_folder = |word: &str| word.starts_with(folder.path().to_str().expect("text"));
            assert!(words.lines().any(is_of_folder), "{command} is {words}");
            assert!(
                words.lines().filter(|word| is_of_folder(word)).all(|word| word.contains("Ann's")),
                "{command}: {words}"
            );
        }
    }
}

#[cfg(unix)]
#[test]
fn a_folder_that_is_no_utf_8_is_named_so_that_it_can_be_found() {
    use std::os::unix::ffi::OsStrExt as _;
    let fixture = Fixture::new(ColmapText, N_VIEWS);
    fixture.write_files().remove("images/p_03.png");
    let odd = fixture.at("outer").join(std::ffi::OsStr::from_bytes(b"caf\xe9"));
    std::fs::create_dir_all(&odd).expect("a folder");
    for name in ["images", "sparse"] {
        std::fs::rename(fixture.at(name), odd.join(name)).expect("written");
    }
    let diagnosis = diagnose(&odd, &LoadOptions::default());
    assert!(diagnosis.to_string().contains("/caf\\xe9/images/p_03.png` does not exist"), "{diagnosis}");
    let json = serde_json::to_value(&diagnosis).expect("JSON").to_string();
    assert!(json.contains("caf\\\\xe9"), "{json}");
    std::fs::remove_dir_all(odd.join("sparse")).expect("written");
    let error = load(&odd, &LoadOptions::default()).expect_err("no poses").to_string();
    let (word, _) = poses_in(&error);
    assert!(word.starts_with("\"$(printf '") && word.ends_with("/caf\\351')\""), "{word}");
}

#[test]
fn a_packed_file_is_unpacked_by_the_commands_that_are_printed() {
    let gzip = |args: &[&str], path: &Path| std::process::Command::new("gzip").args(args).arg(path).status();
    let fixture = Fixture::new(ColmapText, N_VIEWS);
    let path = fixture.write_files().at("sparse/0/points3D.txt");
    if !gzip(&["-k"], &path).is_ok_and(|status| status.success()) {
        eprintln!("skipped: no gzip on this machine");
        return;
    }
    std::fs::rename(fixture.at("sparse/0/points3D.txt.gz"), &path).expect("packed");
    let error = fixture.load().expect_err("a gzip file").to_string();
    assert!(error.contains("points3D.txt` is a gzip file"), "{error}");
    for command in error.lines().skip(1) {
        let done = std::process::Command::new("sh").args(["-c", command]).status().expect("a shell");
        assert!(done.success(), "{command}");
    }
    assert_eq!(fixture.load().expect("a sound capture").0.train.len(), 10);
}
