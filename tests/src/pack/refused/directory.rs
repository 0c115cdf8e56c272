//! The manifest and section 9 but its streams.

use super::{Good, List, read_u32, section};

const NAN: [u8; 4] = f32::NAN.to_le_bytes();

const INFINITE: [u8; 4] = f32::INFINITY.to_le_bytes();

pub(super) fn add(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let float = |index: u32| format!("BadFloat {{ field: InkFrame, index: {index}");
    let psnr = "BadFloat { field: ManifestPsnr";
    list.file("psnr-infinite", "A PSNR is infinite.", psnr).in_section((&file, 6, 0), &INFINITE);
    list.file("psnr-nan", "A PSNR is not a number, of other bits than those of \\\"not measured\\\".", psnr)
        .in_section((&file, 6, 0), &0x7FC0_0001_u32.to_le_bytes());
    list.file("level-6", "The first tier declares level 6.", &out("TierLevel", 6)).in_section((&file, 6, 60), &[6]);
    let reason = "A reserved byte behind the level of the second tier is 1.";
    list.file("level-reserved-byte", reason, "OutOfRange { field: TierLevel").in_section((&file, 6, 64 + 63), &[1]);
    let long = good.tables.clone().with_section(6, |bytes| bytes.extend([0; 4]));
    list.file("manifest-long", "The manifest has bytes of no tier.", "WrongLength { section: Manifest").of(long);
    let short = good.tables.clone().with_section(6, |bytes| bytes.truncate(bytes.len() - 4));
    list.file("manifest-short", "The manifest lacks bytes of the last tier.", "Truncated { section: Manifest")
        .of(short);

    let tiers = 2 * 12;
    let start = section(&file, 7).1.start;
    let field = |at: usize| read_u32(&file, start + at);
    for (name, reason, at, value, named) in [
        ("tier-with-too-many-chunks", "The first tier has more chunks than there are.", 0, 4, "TierChunks"),
        ("tiers-fall", "The second tier has fewer chunks than the first.", 12, 1, "TierChunks"),
        ("tiers-lack-chunks", "The last tier does not have all chunks.", 12, 2, ""),
        ("tier-anchors", "The first tier has an anchor more than its chunks.", 4, field(4) + 1, "TierAnchors"),
        ("tier-end", "The first tier ends 4 bytes late.", 8, field(8) + 4, "TierEnd"),
    ] {
        let expected = if named.is_empty() { "OutOfRange".to_owned() } else { out(named, value) };
        list.file(name, reason, &expected).in_section((&file, 7, at), &value.to_le_bytes());
    }
    let reason = "The header has an anchor more than the last tier.";
    let n_anchors = read_u32(&file, 28);
    list.file("n-anchors", reason, "OutOfRange { field: NAnchors").patched((&file, 28), &(n_anchors + 1).to_le_bytes());
    list.file("ink-min-nan", "The ink's lowest corner is not a number.", &float(0)).in_section((&file, 7, tiers), &NAN);
    list.file("ink-min-infinite", "The ink's lowest corner is infinite.", &float(2))
        .in_section((&file, 7, tiers + 8), &INFINITE);
    list.file("ink-step-negative", "A step of the ink is negative.", &float(1))
        .in_section((&file, 7, tiers + 16), &(-0.1_f32).to_le_bytes());
    list.file("ink-reach", "The highest corner that the ink's steps reach is infinite.", &float(0))
        .in_section((&file, 7, tiers + 12), &1e35_f32.to_le_bytes());
    let record = tiers + 24;
    let len = field(record);
    list.file("chunk-len-odd", "A chunk has an odd number of bytes.", &out("ChunkLen", 1))
        .in_section((&file, 7, record), &(len + 1).to_le_bytes());
    let last = record + 2 * 24;
    let longer = (field(last) + 4).to_le_bytes();
    list.file("chunk-len", "The last chunk ends behind its tier.", "OutOfRange { field: TierEnd")
        .in_section((&file, 7, last), &longer);
    list.file("chunk-without-anchors", "A chunk has no anchors.", &out("ChunkAnchors", 0))
        .in_section((&file, 7, record + 8), &[0, 0]);
    list.file("chunk-too-large", "A chunk has more anchors than max_chunk_anchors.", &out("ChunkAnchors", 3))
        .in_section((&file, 7, record + 8), &[3, 0]);
    list.file("record-reserved", "The reserved number of a chunk record is not 0.", "OutOfRange { field: Reserved")
        .in_section((&file, 7, record + 11), &[1]);
    let high = u16::from_le_bytes(*file[start + record + 18..].first_chunk().expect("a record"));
    list.file("ink-box", "The lowest corner of an ink box is above its highest.", &out("InkBox", u32::from(high) + 1))
        .in_section((&file, 7, record + 12), &(high + 1).to_le_bytes());
    let long = good.tables.clone().with_section(7, |bytes| bytes.extend([0; 24]));
    list.file("directory-long", "There is a chunk record too many.", "WrongLength { section: Directory").of(long);
    let short = good.tables.clone().with_section(7, |bytes| bytes.truncate(bytes.len() - 24));
    list.file("directory-short", "There is a chunk record too few.", "Truncated { section: Directory").of(short);

    let baked = good.gaussians.clone().file();
    let too_many = 2 * 4 + 1;
    let reason = "There are more Gaussians in the first tier than offsets.";
    list.file("gaussians-too-many", reason, &out("TierGaussians", too_many))
        .in_section((&baked, 128, 0), &too_many.to_le_bytes());
    let first = read_u32(&baked, section(&baked, 128).1.start);
    let reason = "The first two tiers have fewer Gaussians than the first.";
    list.file("gaussians-fall", reason, &out("TierGaussians", first - 1))
        .in_section((&baked, 128, 4), &(first - 1).to_le_bytes());
    let long = good.gaussians.clone().with_section(128, |bytes| bytes.extend([0; 4]));
    list.file("gaussians-long", "There are Gaussians of a tier too many.", "WrongLength { section: Gaussians").of(long);
}
