// Where a thread stands. More workgroups than one axis takes go on in the next row.

const GROUP_THREADS: u32 = 256u;

fn group_of(group: vec3<u32>, n_groups: vec3<u32>) -> u32 {
    return group.y * n_groups.x + group.x;
}

fn item_of(group: vec3<u32>, n_groups: vec3<u32>, thread: u32) -> u32 {
    return group_of(group, n_groups) * GROUP_THREADS + thread;
}
