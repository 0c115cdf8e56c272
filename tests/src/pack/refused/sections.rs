//! The section table, what lies between sections, and where the file ends.

use super::{Good, List, read_u32, section};

pub(super) fn add(list: &mut List, good: &Good) {
    let bytes = good.tables.clone().file();
    let file = bytes.as_slice();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let row_of = |kind: u8| section(file, kind).0;
    list.file("row-reserved", "A reserved byte of a row of the section table is 1.", &out("Reserved", 1))
        .patched((file, row_of(2) + 2), &[1]);
    for kind in [0, 9, 127] {
        let reason = format!("A section is of kind {kind}, which is reserved.");
        list.file(&format!("kind-{kind}"), &reason, &out("SectionKind", kind.into()))
            .patched((file, row_of(6)), &[kind]);
    }
    let (header, sections) = good.tables.clone().parts();
    let of = |sections: &[(u8, Vec<u8>)]| crate::pack::draft::assembled(&header, sections);
    let swap = |a: usize, b: usize| {
        let mut swapped = sections.clone();
        swapped.swap(a, b);
        of(&swapped)
    };
    let unexpected = |found: &str, expected: &str| format!("UnexpectedSection {{ found: {found}, expected: {expected}");
    list.file("order-of-sections", "The lattice comes before the heads.", &unexpected("Lattice", "Heads"))
        .of(swap(0, 1));
    let reason = "The directory comes before the manifest.";
    list.file("directory-before-manifest", reason, &unexpected("Directory", "Manifest")).of(swap(4, 5));
    let without = |at: usize| {
        let mut fewer = sections.clone();
        fewer.remove(at);
        of(&fewer)
    };
    list.file("no-masks", "Feature 3 is set, and there are no masks.", &unexpected("Tables", "Masks")).of(without(2));
    list.file("no-manifest", "There is no manifest.", &unexpected("Directory", "Manifest")).of(without(4));
    list.file("no-chunks", "There are no chunks.", "MissingSection { section: Chunks").of(without(6));
    let with = |at: usize, kind: u8, content: &[u8]| {
        let mut more = sections.clone();
        more.insert(at, (kind, content.to_vec()));
        of(&more)
    };
    let twice = with(1, 1, &sections[0].1);
    list.file("heads-twice", "There are two sections of heads.", &unexpected("Heads", "Lattice")).of(twice);
    list.file("context-beside-tables", "There is a context without feature 4.", &unexpected("Context", "Manifest"))
        .of(with(4, 5, &[0; 40]));
    let behind = with(7, 200, &[1, 2, 3, 4]);
    list.file("section-behind-chunks", "A section follows the chunks.", &unexpected("Other(200)", "Chunks")).of(behind);
    let features = read_u32(file, 16);
    list.file("masks-without-feature", "There are masks without feature 3.", &unexpected("Masks", "Tables"))
        .patched((file, 16), &(features & !8).to_le_bytes());
    list.file("tables-with-context", "Feature 4 is set, and there are tables.", &unexpected("Tables", "Context"))
        .patched((file, 16), &(features | 16).to_le_bytes());
    let baked = good.gaussians.clone().file();
    let counts = baked[section(&baked, 128).1].to_vec();
    let mut twice = good.gaussians.clone();
    twice.unknown = vec![(5, 128, counts)];
    list.file("gaussians-twice", "There are two sections gaussians.", &unexpected("Gaussians", "Chunks"))
        .of(twice.file());

    let manifest = section(file, 6);
    let offset = manifest.1.start as u32;
    let misplaced = "Misplaced { section: Manifest";
    for (name, reason, offset) in [
        ("section-overlaps", "The manifest begins 4 bytes before the end of the section before it.", offset - 4),
        ("section-gap", "The manifest begins 4 bytes too late.", offset + 4),
        ("section-misaligned", "The manifest does not begin at a multiple of 4.", offset + 1),
    ] {
        list.file(name, reason, misplaced).patched((file, manifest.0 + 4), &offset.to_le_bytes());
    }
    let reason = "The first section does not begin behind the header.";
    let first = section(file, 1).1.start as u32 + 4;
    list.file("first-section-gap", reason, "Misplaced { section: Heads")
        .patched((file, row_of(1) + 4), &first.to_le_bytes());
    list.file("section-beyond-file", "The heads reach beyond the file.", "Truncated { section: Heads")
        .patched((file, row_of(1) + 8), &(1_u32 << 20).to_le_bytes());
    list.file("section-len-overflows", "A length that passes 2³² with its offset.", "Truncated { section: Heads")
        .patched((file, row_of(1) + 8), &u32::MAX.to_le_bytes());
    for (kind, name) in [(1, "heads"), (4, "tables")] {
        let end = section(file, kind).1.end;
        if !end.is_multiple_of(4) {
            let (name, reason) = (format!("padding-behind-{name}"), format!("A byte behind the {name} is not 0."));
            list.file(&name, &reason, "OutOfRange { field: Padding").patched((file, end), &[1]);
        }
    }
    let end = file.len() as u32;
    for (name, reason, file_len, expected) in [
        ("file-len-inside-chunks", "file_len lies inside a tier.", end - 4, "Truncated { section: Chunks"),
        (
            "file-len-inside-directory",
            "file_len lies inside the directory.",
            section(file, 7).1.end as u32 - 4,
            "Truncated { section: Directory",
        ),
        (
            "file-len-beyond-chunks",
            "file_len is beyond the last tier, and bytes follow.",
            end + 4,
            "WrongLength { section: Chunks",
        ),
    ] {
        let longer = [file, &[0; 8]].concat();
        list.file(name, reason, expected).patched((&longer, 12), &file_len.to_le_bytes());
    }
    let reason = "The chunks have a CRC of their own in the section table.";
    list.file("chunks-crc", reason, "SectionChecksum { section: Chunks").patched((file, row_of(8) + 12), &[1]);
    for (kind, name) in [(1, "Heads"), (2, "Lattice"), (3, "Masks"), (4, "Tables"), (6, "Manifest"), (7, "Directory")] {
        let mut damaged = file.to_vec();
        damaged[section(file, kind).1.end - 1] ^= 0x10;
        let expected = format!("SectionChecksum {{ section: {name}");
        let lower = name.to_lowercase();
        list.file(&format!("{lower}-crc"), &format!("A bit of the {lower} is flipped."), &expected).of(damaged);
    }
    let mut skipped = good.tables.clone();
    skipped.unknown = vec![(3, 222, b"something".to_vec())];
    let mut skipped = skipped.file();
    let at = section(&skipped, 222).1.start;
    skipped[at] ^= 1;
    list.file("unknown-crc", "A bit of a section of unknown kind is flipped.", "SectionChecksum { section: Other(222)")
        .of(skipped);
    let end = section(file, 7).1.start + 5;
    list.file("cut-in-section", "The file ends in its directory.", "Truncated { section: Directory")
        .of(file[..end].to_vec());
    let chunks = section(file, 8).1;
    for (name, reason, end) in [
        ("cut-in-chunk", "The file ends in its first chunk.", chunks.start + 2),
        ("cut-before-end", "The file lacks its last byte.", file.len() - 1),
    ] {
        list.file(name, reason, "Truncated { section: Chunks").of(file[..end].to_vec());
    }
}
