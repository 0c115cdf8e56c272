// Which tiles a splat touches.

const TILE_PX: u32 = 16u;

struct Parameters {
    size_px: array<u32, 2>,
    grid: array<u32, 2>,
    // Slots, or pairs.
    n_items: u32,
}

var<immediate> parameters: Parameters;

struct Range {
    first: u32,
    end: u32,
}

// Half-open, tiles along one axis.
fn tiles_along(centre: f32, half: f32, size_px: u32) -> Range {
    // Pixel p has its centre at p + ½. One part in 10⁵ of slack, because the rasteriser compares alpha, not distance; and a thousandth
    // of a pixel, to which a place on an image of 10,000 pixels is known.
    let slack = 1e-5 * half + 1e-3;
    let last_px = f32(size_px) - 1.0;
    let first = clamp(ceil(centre - half - slack - 0.5), 0.0, 1e9);
    let last = clamp(floor(centre + half + slack - 0.5), -1.0, last_px);
    let first_tile = u32(first) / TILE_PX;
    let end_tile = (u32(last + 1.0) + TILE_PX - 1u) / TILE_PX;
    return Range(first_tile, max(end_tile, first_tile));
}
