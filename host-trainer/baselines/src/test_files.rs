//! What the files of every method promise.

use pocketsplat_gaussians::Gaussians;
use pocketsplat_trainer::explicit::render::Renderer;

use crate::baseline::{Baseline, TrainedScene, Unreadable};
use crate::test_scenes::{capture_of, gaussians, short_config};

/// The Gaussians of a method's file for a scene of `n`: the file draws what was compressed, bit for bit, with any number of threads.
///
/// * `gaussians_of`: what is scored. * `read`: what a file holds.
pub(crate) fn gaussians_of_file<B: Baseline<Compressed: Send> + Sync>(
    method: &B,
    n: usize,
    gaussians_of: fn(&B::Compressed) -> Gaussians,
    read: fn(&[u8]) -> Result<B::Compressed, Unreadable>,
) -> Gaussians {
    let gaussians = gaussians(n);
    let (capture, config) = (capture_of(&gaussians, 4), short_config());
    let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
    let compressed = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| method.compress(&scene).unwrap())
    };
    let quantised = compressed(1);
    let bytes = B::encode(&quantised);
    let decoded = B::decode(&bytes).unwrap();
    let camera = &capture.train[2].camera;
    let [scored, drawn] = [&gaussians_of(&quantised), &decoded]
        .map(|g| Renderer::new(g).planes(camera, [0.1; 3]).into_iter().map(f32::to_bits).collect::<Vec<_>>());
    assert!(scored == drawn, "the same bits");
    assert!(B::encode(&read(&bytes).unwrap()) == bytes, "and the same bytes");
    assert!(B::encode(&compressed(3)) == bytes, "and with three threads");
    decoded
}

/// A body that is cut is refused, and one with another byte is refused or has as many Gaussians.
///
/// * `at`: where it is cut, and the byte that is another. * `flip`: its bits that are.
pub(crate) fn damage_of_a_body_is_noticed<Q>(
    sound: &[u8],
    (at, flip): (usize, u8),
    read: fn(&[u8]) -> Result<Q, Unreadable>,
    gaussians_of: fn(&Q) -> Gaussians,
) {
    let n_gaussians = |quantised: &Q| gaussians_of(quantised).len();
    assert!(read(&sound[..at]).is_err(), "cut at {at}");
    let mut damaged = sound.to_vec();
    damaged[at] ^= flip;
    if let Ok(read_anyway) = read(&damaged) {
        assert_eq!(n_gaussians(&read_anyway), n_gaussians(&read(sound).ok().unwrap()), "byte {at}");
    }
}

/// A body is refused that counts otherwise at any of these places.
pub(crate) fn other_counts_are_refused<Q>(
    sound: &[u8],
    places: &[usize],
    count: u32,
    read: fn(&[u8]) -> Result<Q, Unreadable>,
) {
    for place in places {
        let mut lied = sound.to_vec();
        lied[*place..place + 4].copy_from_slice(&count.to_le_bytes());
        assert!(read(&lied).is_err() || lied == sound, "{count} at {place}");
    }
}
