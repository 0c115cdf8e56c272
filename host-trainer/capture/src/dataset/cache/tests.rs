use super::*;
use crate::dataset::{Image, Mask, Photograph};

const MADE_FROM: &str = "a test";

/// With a mask and every byte value.
fn photograph() -> Photograph {
    let (width_px, height_px) = (16, 32);
    let rgb = (0..width_px * height_px * 3).map(|i| (i * 31 % 256) as u8).collect();
    let valid = (0..width_px * height_px).map(|i| i % 3 != 0).collect();
    Photograph { image: Image { width_px, height_px, rgb }, mask: Some(Mask { width_px, height_px, valid }) }
}

#[test]
fn a_photograph_comes_back_as_it_was() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.photograph");
    for photograph in [photograph(), Photograph { mask: None, ..photograph() }] {
        let header = Header::new(MADE_FROM.to_owned(), &photograph, 1.0 / 3.0);
        file::write(&path, &header, &photograph).expect("room");
        let (read_header, read) = file::read(&path).expect("a sound file");
        assert_eq!((read_header.shown(), &read), (1.0 / 3.0, &photograph), "every bit");
        assert_eq!(read_header, header);
    }
}

#[test]
fn every_damage_is_found() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.photograph");
    let photograph = photograph();
    file::write(&path, &Header::new(MADE_FROM.to_owned(), &photograph, 0.5), &photograph).expect("room");
    let whole = fs::read(&path).expect("written");
    for at in 0..whole.len() {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x10;
        fs::write(&path, damaged).expect("room");
        assert!(file::read(&path).is_err(), "byte {at} of {}", whole.len());
    }
    for len in (0..whole.len()).step_by(37) {
        fs::write(&path, &whole[..len]).expect("room");
        assert!(file::read(&path).is_err(), "cut to {len} bytes");
    }
}

#[test]
fn a_disk_without_room_is_found_before_anything_is_decoded() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("photographs");
    let open = |needed, free| Cache::open_where(&path, needed, |_| Ok(free)).map(drop);
    let error = open(5_117_000_000, 1_203_000_000).expect_err("too little");
    assert!(matches!(error, DatasetError::DiskFull { needed: 5_117_000_000, found: 1_203_000_000, .. }), "{error}");
    let said = error.to_string();
    assert!(
        said.contains("need 5117000000 bytes") && said.contains("free: 1203000000") && said.contains("make room"),
        "{said}"
    );
    // What an interrupted run has decoded needs no room again.
    fs::write(path.join("00000.photograph"), [0; 1000]).expect("room");
    open(2000, 1000).expect("enough");
    assert!(open(2001, 1000).is_err());
}

#[test]
fn one_process_works_with_a_cache() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let open = || Cache::open_where(folder.path(), 1, |_| Ok(1));
    let first = open().expect("nobody has it");
    assert!(matches!(open(), Err(DatasetError::CacheInUse { .. })));
    remove_cache(folder.path()).expect("it stays");
    assert!(folder.path().join(LOCK).is_file(), "another process works with it");
    drop(first);
    open().expect("nobody has it any more");
}

#[test]
fn only_photographs_of_a_cache_are_removed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("photographs");
    remove_cache(&path).expect("there is none");
    drop(Cache::open_where(&path, 1, |_| Ok(1)).expect("room"));
    fs::write(path.join("00000.photograph"), "").expect("room");
    fs::write(path.join("mine.jpg"), "").expect("room");
    remove_cache(&path).expect("a cache");
    let left: Vec<_> = fs::read_dir(&path).expect("a folder").map(|entry| entry.expect("a file").file_name()).collect();
    assert_eq!(left, ["mine.jpg"]);
    // No longer a cache.
    fs::write(path.join("00000.photograph"), "").expect("room");
    remove_cache(&path).expect("nothing to do");
    assert!(path.join("00000.photograph").is_file());
}
