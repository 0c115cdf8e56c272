struct Parameters {
    // Slots, or anchors.
    n_items: u32,
    n_offsets: u32,
    n_log_scales: u32,
    // Outputs of the covariance head an offset: 7, or 1 where Gaussians are isotropic.
    n_covariances: u32,
    mask_threshold: f32,
}

var<immediate> parameters: Parameters;

const NORM_FLOOR: f32 = 1e-12;
