// What both tests of ops/image/prefilter.rs know of an anchor.

struct Parameters {
    rotation: array<f32, 9>,
    translation: array<f32, 3>,
    focal_px: array<f32, 2>,
    principal_px: array<f32, 2>,
    size_px: array<f32, 2>,
    slope_low: array<f32, 2>,
    slope_high: array<f32, 2>,
    near: f32,
    dilation_px2: f32,
    dilation_reach_px: f32,
    ink_deviations: f32,
    mask_threshold: f32,
    pruned_share: f32,
    n_anchors: u32,
    n_offsets: u32,
    n_log_scales: u32,
}

var<immediate> parameters: Parameters;

@group(0) @binding(0) var<storage, read> positions: array<f32>;
@group(0) @binding(1) var<storage, read> log_scales: array<f32>;
@group(0) @binding(2) var<storage, read> mask_logits: array<f32>;
@group(0) @binding(3) var<storage, read> prune_rank: array<f32>;
@group(0) @binding(4) var<storage, read_write> is_visible: array<u32>;

fn position_of(anchor: u32) -> vec3<f32> {
    return vec3(positions[3u * anchor], positions[3u * anchor + 1u], positions[3u * anchor + 2u]);
}

// e^ of log-scales 0 to 2.
fn extent_of(anchor: u32) -> vec3<f32> {
    let first = anchor * parameters.n_log_scales;
    return vec3(exp_of(log_scales[first]), exp_of(log_scales[first + 1u]), exp_of(log_scales[first + 2u]));
}

fn is_open(offset: u32) -> bool {
    return mask_logits[offset] > parameters.mask_threshold;
}

fn is_kept(anchor: u32) -> bool {
    return prune_rank[anchor] >= parameters.pruned_share;
}

fn world_to_camera(point_world: vec3<f32>) -> vec3<f32> {
    let r = parameters.rotation;
    return vec3(
        parameters.translation[0] + (r[0] * point_world.x + r[1] * point_world.y + r[2] * point_world.z),
        parameters.translation[1] + (r[3] * point_world.x + r[4] * point_world.y + r[5] * point_world.z),
        parameters.translation[2] + (r[6] * point_world.x + r[7] * point_world.y + r[8] * point_world.z),
    );
}

fn clamped(slope: vec2<f32>) -> vec2<f32> {
    let low = vec2(parameters.slope_low[0], parameters.slope_low[1]);
    let high = vec2(parameters.slope_high[0], parameters.slope_high[1]);
    return clamp(slope, low, high);
}

fn overlaps_image(point_px: vec2<f32>, reach_px: vec2<f32>) -> bool {
    let size = vec2(parameters.size_px[0], parameters.size_px[1]);
    return all(point_px + reach_px > vec2(0.0)) && all(point_px - reach_px < size);
}

fn focal() -> vec2<f32> {
    return vec2(parameters.focal_px[0], parameters.focal_px[1]);
}

fn principal() -> vec2<f32> {
    return vec2(parameters.principal_px[0], parameters.principal_px[1]);
}
