// A thread is an anchor of the view, so that its offsets are added up in their order.

struct Parameters {
    half_size_px: array<f32, 2>,
    n_anchors: u32,
    n_offsets: u32,
}

@group(0) @binding(0) var<storage, read> anchors: array<u32>;
@group(0) @binding(1) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(2) var<storage, read> footprints: array<Footprint>;
@group(0) @binding(3) var<storage, read> d_splats: array<Splat>;
@group(0) @binding(4) var<storage, read_write> opacity_sums: array<f32>;
@group(0) @binding(5) var<storage, read_write> n_views: array<u32>;
@group(0) @binding(6) var<storage, read_write> gradient_sums: array<f32>;
@group(0) @binding(7) var<storage, read_write> n_drawn: array<u32>;

var<immediate> parameters: Parameters;

@compute @workgroup_size(256)
fn add(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let row = item_of(group, thread);
    if row >= parameters.n_anchors {
        return;
    }
    let anchor = anchors[row];
    n_views[anchor] += 1u;
    var sum = opacity_sums[anchor];
    for (var k = 0u; k < parameters.n_offsets; k++) {
        let slot = row * parameters.n_offsets + k;
        sum += gaussians[slot].opacity;
        if footprints[slot].depth > 0.0 {
            let offset = anchor * parameters.n_offsets + k;
            let x = d_splats[slot].mean_px[0] * parameters.half_size_px[0];
            let y = d_splats[slot].mean_px[1] * parameters.half_size_px[1];
            gradient_sums[offset] += sqrt(x * x + y * y);
            n_drawn[offset] += 1u;
        }
    }
    opacity_sums[anchor] = sum;
}
