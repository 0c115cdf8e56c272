//! Streams.

use pocketsplat_format::Bundle;

use super::{Good, List, read_u32, section};
use crate::pack::draft::Draft;
use crate::seal::reseal;

pub(super) fn add(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    let chunk = |index: usize| {
        let start = section(&file, 8).1.start;
        let bundle = Bundle::parse(&file).expect("a good file");
        let found = bundle.chunks().nth(index).expect("three chunks");
        start + found.offset() as usize..start + found.offset() as usize + found.n_bytes()
    };
    let padding =
        (0..2).map(chunk).find(|chunk| !chunk.end.is_multiple_of(4)).expect("a chunk with bytes behind it").end;
    list.file("padding-behind-chunk", "A byte between two chunks is not 0.", "OutOfRange { field: Padding")
        .patched((&file, padding), &[1]);
    let mut damaged = file.clone();
    damaged[chunk(1).start] ^= 4;
    list.file("chunk-crc", "A bit of the second chunk is flipped.", "ChunkChecksum { chunk: 1").of(damaged);
    let stream = |chunk: u32| format!("ChunkStream {{ chunk: {chunk}");
    list.file("chunk-stream", "The last word of the last chunk is another.", &stream(2))
        .patched((&file, chunk(2).end - 1), &[0xA5]);
    for (name, draft) in [("grid", &good.grid), ("following", &good.following)] {
        let file = draft.clone().file();
        let bundle = Bundle::parse(&file).expect("a good file");
        let first = bundle.chunks().next().expect("three chunks");
        let end = section(&file, 8).1.start + first.n_bytes();
        list.file(&format!("chunk-stream-{name}"), "The last word of the first chunk is another.", &stream(0))
            .patched((&file, end - 1), &[0x5A]);
    }
    let edited = |edit: fn(usize, &mut Vec<u8>)| Draft { edit_chunk: Some(edit), ..good.tables.clone() }.file();
    for (name, reason, edit) in [
        (
            "chunk-words-left",
            "Words are left behind the last symbol of the first chunk.",
            (|chunk, words| {
                if chunk == 0 {
                    words.extend([1, 0]);
                }
            }) as fn(usize, &mut Vec<u8>),
        ),
        ("chunk-words-missing", "The last word of the first chunk is missing.", |chunk, words| {
            if chunk == 0 {
                words.truncate(words.len() - 2);
            }
        }),
        (
            "chunk-first-word-0",
            "The first chunk begins with a word of 0 and is otherwise as it should be.",
            |chunk, words| {
                if chunk == 0 {
                    words.splice(0..0, [0, 0]);
                }
            },
        ),
        ("chunk-empty", "The first chunk has no words, though its symbols take some.", |chunk, words| {
            if chunk == 0 {
                words.clear();
            }
        }),
    ] {
        list.file(name, reason, &stream(0)).of(edited(edit));
    }
    // Two anchors of a trie become one, or three, wherever they are counted.
    for (name, reason, n) in [
        ("trie-with-more-leaves", "The trie of the first chunk has two leaves, its record has one anchor.", 1_u16),
        ("trie-with-fewer-leaves", "The trie of the first chunk has two leaves, its record has three anchors.", 3),
    ] {
        let mut counted = file.clone();
        let directory = section(&file, 7).1.start;
        counted[36] = 3;
        for at in [28, directory + 4, directory + 16] {
            let other = read_u32(&file, at) + u32::from(n) - 2;
            counted[at..at + 4].copy_from_slice(&other.to_le_bytes());
        }
        let record = directory + 2 * 12 + 24;
        counted[record + 8..record + 10].copy_from_slice(&n.to_le_bytes());
        reseal(&mut counted);
        list.file(name, reason, &stream(0)).of(counted);
    }
    let mut one_cell = good.tables.clone();
    for anchor in one_cell.tiers.iter_mut().flatten().flatten() {
        anchor.cell = [1, 2, 3];
    }
    list.file("one-cell-twice", "Two anchors of a chunk in a lattice of one cell.", &stream(0)).of(one_cell.file());
    for group in 0..3 {
        let what = ["feature", "log-scale", "coordinate of an offset"][group];
        let name = ["feature-beyond-its-bits", "log-scale-beyond-its-bits", "offset-beyond-its-bits"][group];
        let mut bits = [16; 3];
        bits[group] = 2;
        let narrow = Draft { symbol_bits: Some(bits), ..good.tables.clone() };
        list.file(name, &format!("A {what} has a symbol beyond the 2 bits that the header says."), &stream(0))
            .of(narrow.file());
    }
}
