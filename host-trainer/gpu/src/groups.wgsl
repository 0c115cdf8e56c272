// Where a thread stands. More workgroups than one axis takes go on in the next row.

const GROUP_THREADS: u32 = 256u;
// Workgroups in a full row; kernel.rs has the same number.
const MAX_GROUPS: u32 = 65535u;

fn group_of(group: vec3<u32>) -> u32 {
    return group.y * MAX_GROUPS + group.x;
}

fn item_of(group: vec3<u32>, thread: u32) -> u32 {
    return group_of(group) * GROUP_THREADS + thread;
}
