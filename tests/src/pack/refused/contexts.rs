//! Section 7.

use super::{Good, List, WIDTHS};
use crate::pack::draft::n_channels;
use crate::pack::sample::NO_EFFECT;

pub(super) fn add(list: &mut List, good: &Good) {
    let file = good.grid.clone().file();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let step = |index: u32| format!("BadFloat {{ field: ContextStep, index: {index}");
    for (name, reason, index, value) in [
        ("base-step-0", "The base step of features is 0.", 0, 0.0_f32),
        ("base-step-small", "The base step of features is 10⁻¹².", 0, 1e-12),
        ("base-step-large", "The base step of log-scales is 10¹².", 1, 1e12),
        ("base-step-nan", "The base step of offsets is not a number.", 2, f32::NAN),
    ] {
        list.file(name, reason, &step(index)).in_section((&file, 5, 24 + 4 * index as usize), &value.to_le_bytes());
    }
    list.file("33-levels", "The grid has 33 levels.", &out("ContextLevels", 33)).in_section((&file, 5, 36), &[33]);
    let hidden = |n: u16| n.to_le_bytes();
    list.file("no-hidden-units", "The context has no hidden unit.", &out("ContextHidden", 0))
        .in_section((&file, 5, 38), &hidden(0));
    list.file("257-hidden-units", "The context has 257 hidden units.", &out("ContextHidden", 257))
        .in_section((&file, 5, 38), &hidden(257));
    list.file("level-kind-4", "A level of the grid is of kind 4.", &out("GridKind", 4))
        .in_section((&file, 5, 40), &[4]);
    list.file("level-reserved", "The reserved byte of a level is 1.", &out("Reserved", 1))
        .in_section((&file, 5, 41), &[1]);
    list.file("level-nodes-1", "A level has one node along an axis.", &out("GridResolution", 1))
        .in_section((&file, 5, 42), &[1, 0]);
    list.file("level-nodes-32769", "A level has 32769 nodes along an axis.", &out("GridResolution", 32769))
        .in_section((&file, 5, 42), &32769_u16.to_le_bytes());
    for n_rows in [0_u32, 7] {
        let reason = format!("A volume of 8 nodes has {n_rows} rows, which is no power of two either.");
        list.file(&format!("level-rows-{n_rows}"), &reason, &out("GridRows", n_rows))
            .in_section((&file, 5, 44), &n_rows.to_le_bytes());
    }
    let shifts = 40 + 2 * 8;
    list.file("shift1-32", "A shift of the hidden units is 32.", &out("ContextShift", 32))
        .in_section((&file, 5, shifts), &[32]);
    let outputs = 2 * n_channels(WIDTHS, NO_EFFECT) + 3;
    list.file("shift2-32", "A shift of the outputs is 32.", &out("ContextShift", 32))
        .in_section((&file, 5, shifts + 2 + outputs - 1), &[32]);
    let biases = shifts + 2 + outputs;
    let too_large = (1_i32 << 29) + 1;
    for (name, reason, at, value) in [
        ("b1-too-large", "A bias of the hidden units is 2²⁹ + 1.", biases, too_large),
        ("b2-too-small", "A bias of the outputs is −2²⁹ − 1.", biases + 8, -too_large),
    ] {
        list.file(name, reason, &out("ContextBias", too_large as u32)).in_section((&file, 5, at), &value.to_le_bytes());
    }
    let long = good.grid.clone().with_section(5, |bytes| bytes.push(0));
    list.file("context-long", "A byte is left behind the grid.", "WrongLength { section: Context").of(long);
    let short = good.grid.clone().with_section(5, |bytes| bytes.truncate(bytes.len() - 1));
    list.file("context-short", "The last row of the grid is missing.", "Truncated { section: Context").of(short);
    // 65 taps of a context of two features would have as many weights as one.
    list.file("65-taps", "The context has 65 taps.", &out("ContextTaps", 65)).in_section((&file, 5, 37), &[65]);

    let file = good.following.clone().file();
    for (name, reason, at, value, field) in [
        ("levels-fall", "Cells of level 2 are smaller than those of level 1.", 41, 1, "LevelShift"),
        ("level-edge-16", "Cells of level 2 have edges of 2¹⁶.", 41, 16, "LevelShift"),
        ("level-span-26", "What level 2 lies in has edges of 2²⁶.", 42, 26, "LevelShift"),
        ("levels-reserved", "The reserved byte behind the levels is 1.", 43, 1, "Reserved"),
        ("levels-with-taps", "Anchors follow anchors, and there is a tap.", 37, 1, "ContextTaps"),
    ] {
        list.file(name, reason, &out(field, value.into())).in_section((&file, 5, at), &[value]);
    }
}
