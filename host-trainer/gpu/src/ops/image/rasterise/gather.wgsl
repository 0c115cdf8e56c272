// The gradient of a slot's splat: the sum over its pairs, tiles ascending.

@group(0) @binding(0) var<storage, read> first_pair: array<u32>;
@group(0) @binding(1) var<storage, read> n_tiles: array<u32>;
@group(0) @binding(2) var<storage, read> d_pairs: array<f32>;
// [slots, 9].
@group(0) @binding(3) var<storage, read_write> d_splats: array<f32>;

const N_NUMBERS: u32 = 9u;

var<immediate> n_values: u32;

@compute @workgroup_size(256)
fn gather(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= n_values {
        return;
    }
    let slot = i / N_NUMBERS;
    let first = first_pair[slot];
    var sum = 0.0;
    for (var pair = first; pair < first + n_tiles[slot]; pair++) {
        sum += d_pairs[pair * N_NUMBERS + i % N_NUMBERS];
    }
    d_splats[i] = sum;
}
