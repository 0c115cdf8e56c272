//! A set of voxels as an octree, coded without loss: breadth first, a byte for each node that says which of its eight children are there
//! (Meagher 1982; the occupancy code of G-PCC's octree).

use crate::baseline::Unreadable;
use crate::packed::Body;

/// Levels, of which each halves the sides of a voxel.
pub(crate) const DEPTH: u32 = 20;

/// Appends the occupancy of the nodes above a set of leaves. Cost: one walk over the leaves per level.
///
/// * `leaves`: [Morton codes](crate::voxels::morton), ascending, each once.
pub(crate) fn put_leaves(leaves: &[u64], body: &mut Vec<u8>) {
    if leaves.is_empty() {
        body.push(0);
    }
    for level in (0..DEPTH).rev() {
        let child = |leaf: u64| leaf >> (3 * level);
        let siblings = leaves.chunk_by(|a, b| child(*a) >> 3 == child(*b) >> 3);
        body.extend(siblings.map(|leaves| leaves.iter().fold(0, |byte, leaf| byte | 1 << (child(*leaf) & 7))));
    }
}

/// The leaves that [`put_leaves`] was given.
///
/// # Errors
/// Bytes that end early, and a node that is there without a child. Memory: at most eight leaves for each byte.
pub(crate) fn leaves(body: &mut Body<'_>) -> Result<Vec<u64>, Unreadable> {
    let mut nodes = vec![0];
    for level in 0..DEPTH {
        let occupancy = body.bytes(nodes.len(), "the octree")?;
        if level == 0 && occupancy == [0] {
            return Ok(Vec::new());
        }
        if let Some(node) = occupancy.iter().position(|byte| *byte == 0) {
            return Err(Unreadable(format!(
                "node {node} on level {level} of the octree has no child, needed: one to eight; write the file again"
            )));
        }
        let children = nodes.iter().zip(occupancy).flat_map(|(node, byte)| {
            (0..8).filter(move |child| byte >> child & 1 == 1).map(move |child: u64| node << 3 | child)
        });
        nodes = children.collect();
    }
    Ok(nodes)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    fn read(bytes: &[u8]) -> Result<Vec<u64>, Unreadable> {
        let mut body = Body(bytes);
        let found = leaves(&mut body)?;
        body.end()?;
        Ok(found)
    }

    proptest! {
        #[test]
        fn any_set_of_voxels_comes_back(set in prop::collection::btree_set(0..1u64 << (3 * DEPTH), 0..80), near: u8) {
            // As drawn, and all in one corner, where nodes have several children.
            for shift in [0, 3 * DEPTH - u32::from(near % 12)] {
                let set: BTreeSet<u64> = set.iter().map(|leaf| leaf >> shift).collect();
                let set: Vec<u64> = set.into_iter().collect();
                let mut bytes = Vec::new();
                put_leaves(&set, &mut bytes);
                prop_assert!(bytes.len() <= 1 + set.len() * DEPTH as usize);
                prop_assert_eq!(read(&bytes), Ok(set));
                prop_assert!(bytes.is_empty() || read(&bytes[..bytes.len() - 1]).is_err());
            }
        }

        #[test]
        fn a_damaged_octree_is_another_or_an_error(
            set in prop::collection::btree_set(0..1u64 << (3 * DEPTH), 1..9), at: prop::sample::Index, byte: u8
        ) {
            let mut bytes = Vec::new();
            put_leaves(&set.into_iter().collect::<Vec<_>>(), &mut bytes);
            let at = at.index(bytes.len());
            bytes[at] = byte;
            if let Ok(leaves) = read(&bytes) {
                let mut again = Vec::new();
                put_leaves(&leaves, &mut again);
                prop_assert_eq!(again, bytes);
            }
        }
    }

    #[test]
    fn a_node_without_a_child_is_refused() {
        let said = read(&[1, 0]).unwrap_err().to_string();
        assert_eq!(said, "node 0 on level 1 of the octree has no child, needed: one to eight; write the file again");
    }
}
