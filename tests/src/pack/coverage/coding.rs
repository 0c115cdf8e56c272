//! Heads, lattice, masks, tables and context: what their sections say.

use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::Coder;
use pocketsplat_format::context::{Context, LevelKind};
use pocketsplat_format::entropy::FREQUENCY_TOTAL;

use super::Found;

pub(super) const ENDS: &[(&str, &[i64])] = &[
    ("b", &[0, 21]),
    ("lattice min", &[-(1 << 23), 1 << 23]),
    ("end_both", &[0, 4096]),
    ("end_zero", &[0, 4096]),
    ("frequency of drawn", &[1, 4095]),
    ("n_tables", &[1, 360]),
    ("n_symbols", &[0, 1]),
    ("min_symbol", &[-32768]),
    ("max_symbol", &[32767]),
    ("slots of an escape", &[1, 4096]),
    ("n_levels", &[0, 1, 32]),
    ("n_taps", &[0, 64]),
    ("n_hidden", &[1, 256]),
    ("n_nodes", &[2, 32768]),
    ("shift", &[0, 31]),
    ("bias", &[-(1 << 29), 1 << 29]),
    ("weight", &[-128, 127]),
    ("frame scale", &[0, 4_294_967_295]),
    ("e1", &[0, 15]),
    ("e2", &[0, 15]),
    ("e3", &[0, 25]),
];

pub(super) const OTHERS: &[&str] = &[
    "an entry without slots",
    "an entry without slots at the front",
    "an origin",
    "a table of two groups",
    "a table that no channel uses",
    "a dense volume",
    "a dense plane of x and y",
    "a dense plane of x and z",
    "a dense plane of y and z",
    "a hashed volume",
    "a hashed plane of x and y",
    "a hashed plane of x and z",
    "a hashed plane of y and z",
    "a hashed level of one row",
    "an odd number of rows",
    "coded heads of a detail head",
    "coded heads without words",
    "a negative bias of a head",
];

pub(super) fn mark(found: &mut Found, bundle: &Bundle<'_>, file: &[u8]) {
    let lattice = bundle.lattice();
    let mut numbers = vec![("b", i64::from(lattice.bits))];
    numbers.extend(lattice.min.map(|min| ("lattice min", i64::from(min))));
    for node in (0..lattice.trie.n_levels()).flat_map(|level| (0..3).filter_map(move |n| lattice.trie.node(level, n))) {
        numbers.extend([("end_both", node.end_both.into()), ("end_zero", node.end_zero.into())]);
    }
    let masks = bundle.masks().map(|masks| masks.offsets().as_flattened()).unwrap_or_default();
    numbers.extend(masks.iter().map(|&frequency| ("frequency of drawn", u16::from_le_bytes(frequency).into())));
    mark_heads(found, bundle);
    match bundle.coder() {
        Coder::Static(tables) => {
            numbers.push(("n_tables", tables.len() as i64));
            for table in (0..tables.len()).filter_map(|table| tables.get(table)) {
                let n = table.n_symbols() as i64;
                let bounds: Vec<u16> = table.bounds().collect();
                let escape = FREQUENCY_TOTAL - bounds[table.n_symbols()];
                numbers.extend([("n_symbols", n), ("min_symbol", table.min_symbol.into())]);
                numbers.extend([
                    ("max_symbol", i64::from(table.min_symbol) + n - 1),
                    ("slots of an escape", escape.into()),
                ]);
                let entries = &bounds[..=table.n_symbols()];
                found.mark(entries.windows(2).any(|pair| pair[0] == pair[1]), "an entry without slots");
                found.mark(entries.len() > 1 && entries[1] == 0, "an entry without slots at the front");
                found.mark(table.origin != 0.0, "an origin");
            }
            let of: Vec<usize> = (0..tables.n_channels()).filter_map(|channel| tables.table_of(channel)).collect();
            let n_features = usize::from(bundle.header().feature_dim);
            found.mark(of[..n_features].iter().any(|table| of[n_features..].contains(table)), "a table of two groups");
            found.mark((0..tables.len()).any(|table| !of.contains(&table)), "a table that no channel uses");
        }
        Coder::Context(context) => numbers.extend(of_context(found, context, context_bytes(bundle, file))),
    }
    for (name, number) in numbers {
        let ends = ENDS.iter().find(|of| of.0 == name).map_or(&[][..], |of| of.1);
        found.mark_ends(name, number, ends);
    }
}

fn mark_heads(found: &mut Found, bundle: &Bundle<'_>) {
    let heads = bundle.heads();
    if let Some(coded) = heads.coded() {
        found.mark(heads.detail.is_some(), "coded heads of a detail head");
        found.mark(coded.words.is_empty(), "coded heads without words");
    }
    found.mark(
        heads.each().any(|head| head.b1.iter().chain(head.b2.iter()).any(|bias| bias < 0.0)),
        "a negative bias of a head",
    );
}

fn context_bytes<'a>(bundle: &Bundle<'_>, file: &'a [u8]) -> &'a [u8] {
    let section = bundle.sections().find(|section| section.code() == 5).expect("a context");
    &file[section.offset as usize..][..section.len as usize]
}

fn of_context(found: &mut Found, context: &Context<'_>, bytes: &[u8]) -> Vec<(&'static str, i64)> {
    let levels: Vec<_> = context.levels().collect();
    let mut numbers = vec![
        ("n_levels", levels.len() as i64),
        ("n_taps", context.n_taps() as i64),
        ("n_hidden", context.n_hidden() as i64),
    ];
    numbers.extend(context.frame().scale.map(|scale| ("frame scale", i64::from(scale))));
    for level in &levels {
        numbers.push(("n_nodes", level.resolution.into()));
        let axes = match level.kind {
            LevelKind::Volume => "volume",
            LevelKind::Xy => "plane of x and y",
            LevelKind::Xz => "plane of x and z",
            LevelKind::Yz => "plane of y and z",
        };
        let how = if level.is_dense() { "dense" } else { "hashed" };
        found.mark(true, &format!("a {how} {axes}"));
        found.mark(level.n_rows == 1, "a hashed level of one row");
    }
    found.mark(levels.iter().map(|level| u64::from(level.n_rows)).sum::<u64>() % 2 == 1, "an odd number of rows");
    if let Some([e1, e2, e3]) = context.level_shifts() {
        numbers.extend([("e1", e1.into()), ("e2", e2.into()), ("e3", e3.into())]);
    }
    // Shifts, biases and weights of the first network.
    let (n_hidden, n_outputs) = (context.n_hidden(), context.n_outputs());
    let n_inputs = if levels.is_empty() { 3 } else { context.n_inputs() };
    let first = 40 + if levels.is_empty() { 4 } else { 8 * levels.len() };
    let (shifts, rest) = bytes[first..].split_at(n_hidden + n_outputs);
    let (biases, rest) = rest.split_at(4 * (n_hidden + n_outputs));
    let weights = &rest[..n_hidden * (n_inputs + n_outputs)];
    numbers.extend(shifts.iter().map(|&shift| ("shift", i64::from(shift))));
    numbers.extend(biases.as_chunks().0.iter().map(|&bias| ("bias", i64::from(i32::from_le_bytes(bias)))));
    numbers.extend(weights.iter().map(|&weight| ("weight", i64::from(weight.cast_signed()))));
    numbers
}
