//! Every picture again, in the arithmetics that are meant for use.

use pocketsplat_codec::bundle::{self, WriteOptions};
use pocketsplat_format::Bundle;
use pocketsplat_trainer::cost::ArithmeticChoice;

use super::picture::worst_tile;
use super::{Case, Family, Probe, error, pictures};
use crate::difference::worse;
use crate::frame::{draw, draw_in, info_for, to_core};

const ANSWER: &str = "\
Without an FPU a frame is drawn with functions of a table, and heads and pixels in integers. Functions of a table and pixels in integers change a channel by a step where the reference arithmetic draws everything,
and no tile visibly. Integer heads turn the longest needles by a tenth of a pixel, which is seen along their edges alone.";

const ANALYSIS: &str = "\
All pictures of the families above are drawn by the decoder in another arithmetic and compared with those of the reference arithmetic, in steps of
8 bits. Functions right to 10⁻⁴ move every alpha by a part in 5,000, and pixels in integers by one in 1,000, which is nothing in a sum. But a contribution at 1/255 may be
drawn in one and not in the other: a step, and half a step of rounding on either side. So may the last layer of an opaque stack: 2.5
steps, over whole tiles. That makes 4.5 steps, and 3.2 in a tile's mean.

With heads in 16-bit integers a step of an output is 2⁻¹⁵ of the largest weight of its row or 2⁻¹⁶ of their sum. So a needle may turn by
6·10⁻⁵, a tenth of a pixel at the end of the longest, where a flank rises by 1.1 a pixel: 28 steps along an edge one pixel wide. With the
others that makes 32, and 4 in a tile's mean.";

/// The worst channel of all pictures, and the worst mean of a tile, against the reference arithmetic; steps of 8 bits.
fn worst(choice: ArithmeticChoice) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for case in pictures() {
        let Probe::Picture { picture, .. } = case.probe else { continue };
        let picture = picture();
        let info = info_for(&picture.camera);
        let written = bundle::write(&picture.scene, &info, &WriteOptions::default()).expect("a scene to be written");
        let bundle = Bundle::parse(&written.bytes).expect("the writer's bundle is sound");
        let camera = to_core(&picture.camera);
        let (reference, _) = draw(&bundle, &camera).expect("the worst case is planned for");
        let (frame, _) = draw_in(choice, &bundle, &camera).expect("no more memory than planned");
        let channels = reference.rgb.iter().zip(&frame.rgb).map(|(a, b)| f64::from(a.abs_diff(*b)));
        let colours: Vec<[f64; 3]> =
            reference.rgb.as_chunks::<3>().0.iter().map(|rgb| rgb.map(|byte| f64::from(byte) / 255.0)).collect();
        let found = [channels.fold(0.0, worse), worst_tile(&frame.rgb, &colours, reference.width_px)];
        if std::env::var_os("POCKETSPLAT_CASE").is_some() {
            println!("{choice:?}, {}: {found:?}", case.name);
        }
        worst = [worse(worst[0], found[0]), worse(worst[1], found[1])];
    }
    worst
}

pub(super) fn family() -> Family {
    const WHAT: &str = "all pictures, against the reference arithmetic";
    let cases: Vec<Case> = vec![
        error("without an FPU", WHAT, "worst channel, steps", 32.0, || worst(ArithmeticChoice::WithoutFpu)[0]),
        error("without an FPU, tiles", WHAT, "worst tile, steps", 4.0, || worst(ArithmeticChoice::WithoutFpu)[1]),
    ];
    Family { title: "Other arithmetics", answer: ANSWER, analysis: ANALYSIS, cases }
}
