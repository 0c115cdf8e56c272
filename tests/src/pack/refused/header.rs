//! Sections 1 and 2 of FORMAT.md: the fixed fields of the header.

use super::{Good, List, read_u32};

pub(super) fn add(list: &mut List, good: &Good) {
    let bytes = good.tables.clone().file();
    let (file, detail) = (bytes.as_slice(), good.detail.clone().file());
    list.file("empty", "The file has no bytes.", "NotABundle").of(Vec::new());
    list.file("magic", "The first byte is another.", "NotABundle").patched((file, 0), &[0x88]);
    list.file("magic-line-ends", "A text transfer changed the line ends of the magic.", "NotABundle")
        .patched((file, 4), b"\n\x1a\n\x04");
    list.file("cut-in-header", "The file ends in its header.", "Truncated { section: Header").of(file[..100].to_vec());
    for version in [3, pocketsplat_format::bundle::VERSION + 1] {
        let expected = format!("UnsupportedVersion {{ found: {version}");
        list.file(&format!("version-{version}"), &format!("Version {version}."), &expected)
            .patched((file, 8), &version.to_le_bytes());
    }
    let header_len = u16::from_le_bytes([file[10], file[11]]);
    for (name, len) in [("header-len-short", 164 + 5 * 16), ("header-len-of-another-table", header_len + 16)] {
        let expected = format!("OutOfRange {{ field: HeaderLen, found: {len}");
        let reason = format!("header_len is {len}.");
        list.file(name, &reason, &expected).patched((file, 10), &len.to_le_bytes());
    }
    let mut crc = file.to_vec();
    crc[44] ^= 1;
    let reason = "A bit of the header is flipped and its CRC is as it was.";
    list.file("header-crc", reason, "SectionChecksum { section: Header").of(crc);
    for bit in [9, 11, 31] {
        let bits = read_u32(file, 16) | 1 << bit;
        let expected = format!("UnsupportedFeatures {{ unknown_bits: {}", 1_u32 << bit);
        let reason = format!("Bit {bit} of the required features, which is reserved, is set.");
        list.file(&format!("feature-{bit}"), &reason, &expected).patched((file, 16), &bits.to_le_bytes());
    }
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let u16s: [(&str, &str, usize, u16, &str); 13] = [
        ("f-0", "F is 0.", 24, 0, "FeatureDim"),
        ("f-257", "F is 257.", 24, 257, "FeatureDim"),
        ("k-0", "K is 0.", 26, 0, "NOffsets"),
        ("k-33", "K is 33.", 26, 33, "NOffsets"),
        ("max-chunk-anchors-0", "max_chunk_anchors is 0.", 36, 0, "MaxChunkAnchors"),
        ("max-chunk-anchors-1025", "max_chunk_anchors is 1025.", 36, 1025, "MaxChunkAnchors"),
        ("training-width-0", "The training width is 0.", 40, 0, "TrainingSize"),
        ("training-height-0", "The training height is 0.", 42, 0, "TrainingSize"),
        ("colour-hidden-0", "The colour head has no hidden unit.", 52, 0, "ColourHidden"),
        ("colour-hidden-257", "The colour head has 257 hidden units.", 52, 257, "ColourHidden"),
        ("detail-hidden-without-detail", "There is no detail head, and it has a hidden unit.", 54, 1, "DetailHidden"),
        ("detail-hidden-0", "The detail head has no hidden unit.", 54, 0, "DetailHidden"),
        ("detail-hidden-257", "The detail head has 257 hidden units.", 54, 257, "DetailHidden"),
    ];
    for (name, reason, at, value, field) in u16s {
        let of = if name == "detail-hidden-0" || name == "detail-hidden-257" { detail.as_slice() } else { file };
        list.file(name, reason, &out(field, value.into())).patched((of, at), &value.to_le_bytes());
    }
    let too_many = (1 << 24) + 1;
    let about_counts: [(&str, &str, usize, u32, &str); 2] = [
        ("n-anchors-too-many", "There are 2²⁴ + 1 anchors.", 28, too_many, "NAnchors"),
        ("n-chunks-above-anchors", "There are more chunks than anchors.", 32, 7, "NChunks"),
    ];
    for (name, reason, at, value, field) in about_counts {
        list.file(name, reason, &out(field, value)).patched((file, at), &value.to_le_bytes());
    }
    let u8s: [(&str, &str, usize, u8, &str); 10] = [
        ("camera-convention-1", "The camera convention is 1.", 38, 1, "CameraConvention"),
        ("n-sections-5", "The section table has 5 rows.", 39, 5, "NSections"),
        ("background-without-feature", "There is a background without feature 8.", 45, 1, "Background"),
        ("n-tiers-0", "There are no tiers.", 47, 0, "NTiers"),
        ("n-tiers-9", "There are 9 tiers.", 47, 9, "NTiers"),
        ("symbol-bits-0", "Features have symbols of 0 bits.", 156, 0, "SymbolBits"),
        ("symbol-bits-17", "Features have symbols of 17 bits.", 156, 17, "SymbolBits"),
        ("log-scale-bits-17", "Log-scales have symbols of 17 bits.", 157, 17, "SymbolBits"),
        ("offset-bits-0", "Offsets have symbols of 0 bits.", 158, 0, "SymbolBits"),
        ("header-reserved", "The reserved byte of the header is 1.", 159, 1, "Reserved"),
    ];
    for (name, reason, at, value, field) in u8s {
        list.file(name, reason, &out(field, value.into())).patched((file, at), &[value]);
    }
    let float = |field: &str| format!("BadFloat {{ field: {field}");
    let floats: [(&str, &str, usize, f32, &str); 15] = [
        ("voxel-size-0", "The voxel size is 0.", 48, 0.0, "VoxelSize"),
        ("voxel-size-negative", "The voxel size is negative.", 48, -0.5, "VoxelSize"),
        ("voxel-size-infinite", "The voxel size is infinite.", 48, f32::INFINITY, "VoxelSize"),
        ("voxel-size-nan", "The voxel size is not a number.", 48, f32::NAN, "VoxelSize"),
        ("voxel-size-large", "The voxel size is 10⁹.", 48, 1e9, "VoxelSize"),
        ("preview-rotation-nan", "A number of the preview's rotation is not a number.", 92, f32::NAN, "PreviewCamera"),
        ("preview-translation-infinite", "The preview's translation is infinite.", 128, f32::INFINITY, "PreviewCamera"),
        ("preview-translation-large", "The preview's translation is −10¹⁵.", 128, -1e15, "PreviewCamera"),
        ("preview-focal-0", "A focal length of the preview is 0.", 136, 0.0, "PreviewCamera"),
        ("preview-focal-negative", "A focal length of the preview is negative.", 140, -60.0, "PreviewCamera"),
        ("preview-focal-infinite", "A focal length of the preview is infinite.", 140, f32::INFINITY, "PreviewCamera"),
        ("preview-focal-large", "A focal length of the preview is 10¹⁵.", 140, 1e15, "PreviewCamera"),
        ("preview-principal-large", "The preview's principal point is 10¹⁵.", 148, 1e15, "PreviewCamera"),
        ("preview-principal-nan", "The preview's principal point is not a number.", 144, f32::NAN, "PreviewCamera"),
        (
            "preview-principal-infinite",
            "The preview's principal point is infinite.",
            148,
            f32::NEG_INFINITY,
            "PreviewCamera",
        ),
    ];
    for (name, reason, at, value, field) in floats {
        list.file(name, reason, &float(field)).patched((file, at), &value.to_le_bytes());
    }
    let doubles: [(&str, &str, usize, f64); 4] = [
        ("normalisation-centre-infinite", "The normalisation's centre is infinite.", 64, f64::INFINITY),
        ("normalisation-scale-0", "The normalisation's scale is 0.", 80, 0.0),
        ("normalisation-scale-negative", "The normalisation's scale is negative.", 80, -1.0),
        ("normalisation-scale-nan", "The normalisation's scale is not a number.", 80, f64::NAN),
    ];
    for (name, reason, at, value) in doubles {
        list.file(name, reason, &float("Normalisation")).patched((file, at), &value.to_le_bytes());
    }
    for (name, at) in [("preview-width-0", 152), ("preview-height-0", 154)] {
        list.file(name, "The preview has no pixels.", &out("PreviewCamera", 0)).patched((file, at), &[0, 0]);
    }
    let row = |x: [f32; 3]| x.map(f32::to_le_bytes).concat();
    let rows = [row([1.0, 0.0, 0.0]), row([0.0, 1.0, 0.0]), row([0.0, 0.0, -1.0])].concat();
    list.file("preview-mirrored", "The preview's rotation is a reflection.", &out("PreviewRotation", 20_000))
        .patched((file, 88), &rows);
    let rows = [row([1.0, 0.0, 0.0]), row([0.0, 1.0, 0.0]), row([0.0, 0.0, 1.0302])].concat();
    let reason = "The preview's rotation is off by 302 ten-thousandths; 300 are allowed.";
    list.file("preview-not-quite-a-rotation", reason, &out("PreviewRotation", 302)).patched((file, 88), &rows);
}
