//! Sections 4 and 5.

use super::{Good, List, section};

pub(super) fn add(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let beyond = (1_i32 << 23) + 1;
    for (name, at, value) in [("lattice-min-beyond", 0, beyond), ("lattice-min-below", 8, -beyond)] {
        let reason = format!("The lattice begins at {value}.");
        list.file(name, &reason, &out("LatticeMin", beyond as u32)).in_section((&file, 2, at), &value.to_le_bytes());
    }
    list.file("lattice-min-lowest", "The lattice begins at −2³¹.", "OutOfRange { field: LatticeMin")
        .in_section((&file, 2, 4), &i32::MIN.to_le_bytes());
    list.file("lattice-bits-22", "The lattice has 22 bits an axis.", &out("LatticeBits", 22))
        .in_section((&file, 2, 12), &[22]);
    list.file("lattice-reserved", "A reserved byte of the lattice is 1.", &out("Reserved", 1))
        .in_section((&file, 2, 14), &[1]);
    let reason = "Frequencies of a level that the lattice does not have.";
    let bits = file[section(&file, 2).1.start + 12];
    list.file("lattice-long", reason, "WrongLength { section: Lattice").in_section((&file, 2, 12), &[bits - 1]);
    list.file("lattice-short", "The frequencies of three levels are missing.", "Truncated { section: Lattice")
        .in_section((&file, 2, 12), &[bits + 1]);
    let ends = |both: u16, zero: u16| [both.to_le_bytes(), zero.to_le_bytes()].concat();
    list.file("trie-beyond-4096", "end_zero is 4097.", &out("TrieFrequency", 4097))
        .in_section((&file, 2, 16), &ends(0, 4097));
    list.file("trie-falls", "end_both is above end_zero.", &out("TrieFrequency", 2001))
        .in_section((&file, 2, 16), &ends(2001, 2000));
    list.file("mask-0", "The frequency of a drawn offset is 0.", &out("MaskFrequency", 0))
        .in_section((&file, 3, 8), &[0, 0]);
    list.file("mask-4096", "The frequency of a drawn offset is 4096.", &out("MaskFrequency", 4096))
        .in_section((&file, 3, 2), &[0, 16]);
    let long = good.tables.clone().with_section(3, |bytes| bytes.extend([1, 0]));
    list.file("masks-long", "There is a frequency too many.", "WrongLength { section: Masks").of(long);
    let short = good.tables.clone().with_section(3, |bytes| bytes.truncate(14));
    list.file("masks-short", "There is a frequency too few.", "Truncated { section: Masks").of(short);
}
