// The records of the kernels crate, field by field.

struct Gaussian {
    centre: array<f32, 3>,
    scale: array<f32, 3>,
    rotation: array<f32, 4>,
    opacity: f32,
    colour: array<f32, 3>,
}

struct Splat {
    mean_px: array<f32, 2>,
    shear: f32,
    row_precision: f32,
    column_precision: f32,
    opacity: f32,
    colour: array<f32, 3>,
}

// A splat that is not drawn has depth 0.
struct Footprint {
    depth: f32,
    half_extent_px: array<f32, 2>,
}
