// What a splat does to a pixel, in forward and backward of ops/image/rasterise.rs. A workgroup is a tile, a thread a pixel.

const TILE_PX: u32 = 16u;
const TILE_PIXELS: u32 = 256u;
const ALPHA_CUTOFF: f32 = 1.0 / 255.0;
const ALPHA_MAX: f32 = 0.99;
const TRANSMITTANCE_MIN: f32 = 1e-4;
// Splats that are kept in shared memory at a time.
const BATCH: u32 = 64u;

struct Parameters {
    size_px: array<u32, 2>,
    n_tiles: u32,
    // 1 where the background is a parameter, else what it is does not matter.
    background: array<f32, 3>,
}

var<immediate> parameters: Parameters;
var<workgroup> batch: array<Splat, BATCH>;

struct Blend {
    // Before the stop rule.
    alpha: f32,
    // dx − shear·dy.
    dx: f32,
    dy: f32,
}

fn blend(splat: Splat, centre: vec2<f32>) -> Blend {
    let dy = centre.y - splat.mean_px[1];
    let dx = centre.x - splat.mean_px[0] - splat.shear * dy;
    let power = -0.5 * splat.column_precision * dy * dy - 0.5 * splat.row_precision * dx * dx;
    let raw = splat.opacity * exp_of(max(power, -80.0));
    return Blend(select(min(raw, ALPHA_MAX), 0.0, raw < ALPHA_CUTOFF), dx, dy);
}
