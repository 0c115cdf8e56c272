// 16×16 pixels of one channel and the 5 around them that a window of 11 reaches.

const EDGE: u32 = 16u;
const RADIUS: u32 = 5u;
const PADDED: u32 = EDGE + 2u * RADIUS;

struct Parameters {
    size_px: array<u32, 2>,
    weight: f32,
    window: array<f32, 11>,
}

var<immediate> parameters: Parameters;

struct Place {
    channel: u32,
    // First pixel.
    x0: u32,
    y0: u32,
}

fn place_of(group: u32) -> Place {
    let across = (parameters.size_px[0] + EDGE - 1u) / EDGE;
    let down = (parameters.size_px[1] + EDGE - 1u) / EDGE;
    return Place(group / (across * down), group % across * EDGE, group / across % down * EDGE);
}

// The pixel of place i of the padded square, which may lie beyond the image.
fn pixel_of(place: Place, i: u32) -> vec2<i32> {
    return vec2<i32>(vec2(place.x0 + i % PADDED, place.y0 + i / PADDED)) - i32(RADIUS);
}

fn is_inside(pixel: vec2<i32>) -> bool {
    return all(pixel >= vec2(0)) && pixel.x < i32(parameters.size_px[0]) && pixel.y < i32(parameters.size_px[1]);
}
