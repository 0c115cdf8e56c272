//! Header, section table, manifest, directory, and where the file ends.

use pocketsplat_format::Bundle;

use super::Found;
use crate::pack::expected::FEATURES;

/// Numbers whose limits, or all values of which, must occur.
pub(super) const ENDS: &[(&str, &[i64])] = &[
    ("F", &[1, 256]),
    ("K", &[1, 32]),
    ("n_anchors", &[0]),
    ("max_chunk_anchors", &[1, 1024]),
    ("anchors of a chunk", &[1, 1024]),
    ("n_sections", &[6, 255]),
    ("training size", &[1, 65535]),
    ("preview size", &[1]),
    ("H_c", &[1, 256]),
    ("H_d", &[0, 1, 256]),
    ("n_tiers of the header", &[1, 2, 3, 8]),
    ("tiers in the file", &[1, 2, 3, 5, 6, 7, 8]),
    ("bits of features", &[1, 16]),
    ("bits of log-scales", &[1, 16]),
    ("bits of offsets", &[1, 16]),
    ("kind", &[1, 2, 3, 4, 5, 6, 7, 8, 128, 129]),
    ("bytes behind a section", &[0, 1, 2, 3]),
    ("bytes behind a chunk", &[0, 2]),
    ("bytes of the protocol", &[0, 200]),
    ("level", &[0, 1, 2, 3, 4, 5]),
];

pub(super) const OTHERS: &[&str] = &[
    "optional features",
    "no background, feature 8 set or not",
    "chunks as many as anchors",
    "an unknown section",
    "an unknown section before the heads",
    "an unknown section twice",
    "an empty section",
    "kind 255",
    "whole, with bytes behind it",
    "cut by a transfer",
    "cut by its length, with bytes behind it",
    "cut to no anchors",
    "an empty tier",
    "an empty first tier",
    "PSNR not measured",
    "PSNR below 0",
    "measured",
    "ink without extent",
    "gaussians with a meaning",
    "gaussians without a meaning",
    "no gaussians where they would have a meaning",
];

pub(super) fn mark(found: &mut Found, bundle: &Bundle<'_>, file: &[u8]) {
    let header = bundle.header();
    let bits = header.features.to_bits();
    for (bit, _) in FEATURES {
        found.mark(bits >> bit & 1 == 1, &format!("feature {bit} set"));
        found.mark(bits >> bit & 1 == 0, &format!("feature {bit} clear"));
        found.mark(bits == 1 << bit, &format!("feature {bit} alone"));
    }
    let numbers = [
        ("F", i64::from(header.feature_dim)),
        ("K", header.n_offsets.into()),
        ("n_anchors", header.n_anchors.into()),
        ("max_chunk_anchors", header.max_chunk_anchors.into()),
        ("n_sections", bundle.sections().count() as i64),
        ("H_c", header.colour_hidden.into()),
        ("H_d", header.detail_hidden.into()),
        ("n_tiers of the header", header.n_tiers.into()),
        ("tiers in the file", bundle.n_tiers().into()),
        ("bits of features", header.symbol_bits[0].into()),
        ("bits of log-scales", header.symbol_bits[1].into()),
        ("bits of offsets", header.symbol_bits[2].into()),
        ("preview size", header.preview.width_px.min(header.preview.height_px).into()),
    ];
    let sizes = header.training_px.map(|size| ("training size", i64::from(size)));
    let chunks = bundle.chunks().flat_map(|chunk| {
        let behind = chunk.n_bytes().next_multiple_of(4) - chunk.n_bytes();
        [("anchors of a chunk", i64::from(chunk.n_anchors())), ("bytes behind a chunk", behind as i64)]
    });
    let levels = (0..header.n_tiers).filter_map(|tier| bundle.measures(tier)).map(|of| ("level", i64::from(of.level)));
    for (name, number) in numbers.into_iter().chain(sizes).chain(chunks).chain(levels) {
        mark_one(found, name, number);
    }
    found.mark(file[20..24] != [0; 4], "optional features");
    found.mark(header.background == [0; 3], "no background, feature 8 set or not");
    found.mark(header.n_chunks > 1 && header.n_chunks == header.n_anchors, "chunks as many as anchors");
    mark_sections(found, bundle);
    mark_tiers(found, bundle, file);
    let counts = bundle.sections().any(|section| section.code() == 128);
    let sees_view = header.features.effects.see_view();
    found.mark(counts && !sees_view, "gaussians with a meaning");
    found.mark(counts && sees_view, "gaussians without a meaning");
    found.mark(!counts && !sees_view && header.n_anchors > 0, "no gaussians where they would have a meaning");
}

fn mark_one(found: &mut Found, name: &str, number: i64) {
    let ends = ENDS.iter().find(|of| of.0 == name).map_or(&[][..], |of| of.1);
    found.mark_ends(name, number, ends);
}

fn mark_sections(found: &mut Found, bundle: &Bundle<'_>) {
    let sections: Vec<_> = bundle.sections().collect();
    for (at, section) in sections.iter().enumerate() {
        let code = section.code();
        mark_one(found, "kind", code.into());
        let end = section.offset + section.len;
        let behind = sections.get(at + 1).map_or(0, |next| next.offset - end);
        mark_one(found, "bytes behind a section", behind.into());
        found.mark(section.len == 0, "an empty section");
        if code == 129 {
            mark_one(found, "bytes of the protocol", section.len.into());
        }
        found.mark(code >= 130, "an unknown section");
        found.mark(code >= 130 && at == 0, "an unknown section before the heads");
        found.mark(code >= 130 && sections[..at].iter().any(|other| other.code() == code), "an unknown section twice");
        found.mark(code == 255, "kind 255");
    }
}

fn mark_tiers(found: &mut Found, bundle: &Bundle<'_>, file: &[u8]) {
    let header = bundle.header();
    let (n_bytes, file_len) = (file.len() as u32, header.file_len);
    let is_cut = bundle.n_tiers() < header.n_tiers;
    found.mark(!is_cut && n_bytes > file_len, "whole, with bytes behind it");
    found.mark(is_cut && n_bytes < file_len, "cut by a transfer");
    found.mark(is_cut && n_bytes > file_len, "cut by its length, with bytes behind it");
    found.mark(is_cut && bundle.n_anchors() == 0, "cut to no anchors");
    let ends: Vec<u32> = (0..header.n_tiers).filter_map(|tier| bundle.tier(tier)).map(|tier| tier.n_chunks).collect();
    found.mark(ends.windows(2).any(|pair| pair[0] == pair[1]), "an empty tier");
    found.mark(ends.len() > 1 && ends[0] == 0, "an empty first tier");
    for measures in (0..header.n_tiers).filter_map(|tier| bundle.measures(tier)) {
        found.mark(measures.psnr_db.is_none(), "PSNR not measured");
        found.mark(measures.psnr_db.is_some_and(|psnr_db| psnr_db < 0.0), "PSNR below 0");
        found.mark(measures.n_cameras > 0 && measures.max_splats > 0, "measured");
    }
    found.mark(bundle.directory().ink_frame.step == [0.0; 3], "ink without extent");
}
