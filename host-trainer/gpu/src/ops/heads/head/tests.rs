//! Against the CPU. Bounds: products of up to 70 factors in f32, in another order: 1e-5 of the largest magnitude; sums over n rows of what
//! has either sign: 1e-7·√n more of it.

use super::*;
use crate::parity::{Bound, SIZES, assert_close, gpu, largest};
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::ops::heads::head as cpu;

fn head(seed: u64, [n_in, n_hidden, n_out]: [usize; 3]) -> scene::Head<f32> {
    let mut head = scene::Head::filled(n_in, n_hidden, n_out, 0.0f32);
    for (i, group) in (0..).zip(head.groups_mut()) {
        *group = values(seed + i, group.len());
    }
    head
}

fn values(seed: u64, len: usize) -> Vec<f32> {
    random(seed, len).iter().map(|v| *v as f32).collect()
}

fn close(name: &str, n_rows: usize, found: &[f32], expected: &[f32]) {
    let share = 1e-5 + 1e-7 * (n_rows as f64).sqrt();
    assert_close(name, found, expected, Bound { relative: 0.0, absolute: share * largest(expected) });
}

/// Both ways over `n` rows of `row` values, of a head or of its last outputs.
fn compare(gpu: &Gpu, n: usize, row: usize, widths: [usize; 3], last: Option<usize>) {
    let whole = head(n as u64, widths);
    let mut expected_head = whole.clone();
    let mut layout = HeadLayout::of(&whole);
    assert_eq!(layout.n_params(), whole.n_params());
    if let Some(last) = last {
        let first = whole.n_out - last;
        expected_head.w2.drain(..first * whole.n_hidden);
        expected_head.b2.drain(..first);
        expected_head.n_out = last;
        layout = layout.last_outputs(last);
    }
    let [n_in, n_hidden, n_out] = [layout.n_in, layout.n_hidden, layout.n_out];
    let (input, d_output) = (values(20, n * row), values(21, n * n_out));
    let (mut hidden, mut output) = (vec![0.0; n * n_hidden], vec![0.0; n * n_out]);
    cpu::forward(&expected_head, &input, &mut hidden, &mut output);
    let before = 0.5;
    let mut d_input = vec![before; n * row];
    let mut d_head = expected_head.map(|_| before);
    let mut d_hidden = vec![0.0; hidden.len()];
    cpu::backward(&expected_head, &input, &hidden, &d_output, &mut d_hidden, &mut d_input, &mut d_head);

    let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
    let mut kernels = Head::new(gpu).expect("room");
    let weights = upload(&parameters_of(&whole));
    let buffers = [upload(&vec![9.0; hidden.len()]), upload(&vec![9.0; output.len()])];
    let (x, exact_hidden, d_y) = (upload(&input), upload(&hidden), upload(&d_output));
    let (d_h, d_x) = (upload(&vec![9.0; hidden.len()]), upload(&vec![before; input.len()]));
    let d_weights = upload(&vec![before; whole.n_params()]);
    let mut commands = Commands::new(gpu);
    kernels.forward(&mut commands, &layout, &weights, &x, &buffers[0], &buffers[1]);
    // A unit that a rounding turns on has a gradient, so that the way back has the CPU's.
    let (w, d_w) = (&weights, &d_weights);
    kernels.backward(gpu, &mut commands, &layout, w, &x, &exact_hidden, &d_y, &d_h, &d_x, d_w).expect("room");
    commands.submit().expect("runs");
    let name = |what: &str| format!("{what} of {n} rows of {row}, {n_in} → {n_hidden} → {n_out}");
    let read = |buffer: &Buffer<f32>| buffer.read(gpu).expect("runs");
    close(&name("hidden"), 1, &read(&buffers[0]), &hidden);
    close(&name("output"), 1, &read(&buffers[1]), &output);
    close(&name("d_input"), 1, &read(&d_x), &d_input);
    let found = read(&d_weights);
    for (first, group) in layout.first.into_iter().zip(d_head.groups()) {
        close(&name("d_weights"), n, &found[first..first + group.len()], group);
    }
    // Nothing but the groups is touched.
    let of_groups: usize = d_head.groups().iter().map(|g| g.len()).sum();
    assert!(found.iter().filter(|d| **d == before).count() >= whole.n_params() - of_groups);
}

#[test]
fn head_agrees_with_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for n in SIZES {
        compare(gpu, n, 36, [33, 32, 70], None);
        compare(gpu, n, 5, [5, 3, 1], None);
    }
    compare(gpu, 64, 16, [16, 64, 16], None);
    compare(gpu, 65, 17, [17, 65, 17], None);
    // Parts of more than the fewest rows.
    compare(gpu, MAX_PARTS * MIN_PART_ROWS + 100, 4, [4, 4, 2], None);
    // The steps of a context network.
    compare(gpu, 700, 48, [48, 96, 175], Some(3));
}
