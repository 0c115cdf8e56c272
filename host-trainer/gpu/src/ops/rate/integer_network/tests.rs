//! Against the decoder's integers: all are the same.

use pocketsplat_format::context::{Context, GridFrame, GridLevel, LevelKind};

use super::*;
use crate::parity::gpu;
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::integer_model;
use pocketsplat_kernels::ops::rate::hash_grid;
use pocketsplat_kernels::scene::{ContextModel, ModelShape};

const SHAPE: ModelShape = ModelShape { view_colour: true, ..ModelShape::plain(5, 2) };

/// A model of 16 hidden units and as many taps as features; weights of rows are of different sizes, some of the edge.
fn model(seed: u64) -> ContextModel<f32> {
    let levels = vec![
        GridLevel { kind: LevelKind::Volume, resolution: 5, n_rows: 125 },
        GridLevel { kind: LevelKind::Xz, resolution: 90, n_rows: 64 },
    ];
    let frame = GridFrame::spanning([-40, -30, 7], [200, 70, 90]);
    let model = ContextModel::filled(&SHAPE, frame, levels, 16, [1.0, 0.1, 0.2], 0.0);
    let mut model = model.with_taps(&SHAPE, SHAPE.feature_dim, 0.0);
    let fill = |values: &mut [f32], seed: u64| {
        let numbers = random(seed, values.len());
        let scales = (0..).map(|i| [0.01, 0.5, 3.0, 40.0][(i / 7) % 4]);
        values.iter_mut().zip(numbers.iter().zip(scales)).for_each(|(value, (x, scale))| *value = (x * scale) as f32);
    };
    fill(&mut model.rows, seed);
    for (group, values) in (1..).zip(model.networks[0].groups_mut()) {
        fill(values, seed + group);
    }
    model.networks[0].mlp.w1[..4].copy_from_slice(&[0.0, 127.0 / 8192.0, 0.5 / 8192.0, -1.5 / 8192.0]);
    model.networks[0].taps[..3].copy_from_slice(&[5.0, -5.0, 0.499_999_97 / 128.0]);
    model
}

#[test]
fn the_integers_are_the_decoders() {
    let Some(gpu) = gpu() else { return };
    let kernels = IntegerNetwork::new(gpu);
    let n_channels = SHAPE.values_per_anchor();
    for seed in [0, 100, 200] {
        let model = model(seed);
        let section = integer_model::section(&model, n_channels).expect("a sound model");
        let context = integer_model::parse(&section, &SHAPE).expect("a sound section");
        let network = &model.networks[0];
        let layout = HeadLayout::of(&network.mlp);
        let parameters = network.groups().concat();
        let weights = Buffer::upload(gpu, "weights", &parameters).expect("room");
        let integers = Integers::zeros(gpu, &layout, parameters.len()).expect("room");
        let cells: Vec<[i32; 3]> = (0..300).map(|i| [i - 60, 100 - i, 7 * i % 100]).collect();
        let units_of_cells: Vec<[u16; 3]> = cells.iter().map(|cell| model.frame.unit(*cell)).collect();
        let mut inputs = vec![0.0f32; cells.len() * layout.n_in];
        hash_grid::forward(&model.levels, &model.rows, &units_of_cells, &mut inputs);
        let inputs = Buffer::upload(gpu, "inputs", &inputs).expect("room");
        let units = Buffer::zeros(gpu, "units", cells.len() * layout.n_hidden).expect("room");
        let outputs = Buffer::zeros(gpu, "outputs", cells.len() * layout.n_out).expect("room");
        let exponents = Buffer::zeros(gpu, "exponents", cells.len() * N_GROUPS).expect("room");
        let steps = Buffer::zeros(gpu, "steps", cells.len() * N_GROUPS).expect("room");
        let table = Buffer::upload(gpu, "table", &table_of_steps(model.base_steps)).expect("room");
        let mut commands = Commands::new(gpu);
        kernels.round(&mut commands, &layout, &weights, &integers);
        kernels.hidden(&mut commands, &layout, &integers, &inputs, &units);
        kernels.outputs(&mut commands, &layout, &integers, 0, &units, &outputs);
        kernels.outputs(&mut commands, &layout, &integers, 2 * n_channels, &units, &exponents);
        kernels.steps(&mut commands, &table, &exponents, &steps);
        commands.submit().expect("runs");
        let rounded = &integer_model::rounded(&model, n_channels).expect("a sound model")[0];
        assert_eq!(integers.rounded.read(gpu).expect("runs"), rounded.groups().concat());
        let expected = of_decoder(&context, &cells);
        assert_eq!(units.read(gpu).expect("runs"), expected.units);
        assert_eq!(outputs.read(gpu).expect("runs"), expected.outputs);
        assert_eq!(steps.read(gpu).expect("runs"), expected.steps);
        let last = expected.outputs.chunks_exact(layout.n_out).flat_map(|row| &row[2 * n_channels..]);
        assert!(exponents.read(gpu).expect("runs").iter().eq(last));
    }
}

struct OfDecoder {
    units: Vec<i32>,
    outputs: Vec<f32>,
    steps: Vec<f32>,
}

fn of_decoder(context: &Context<'_>, cells: &[[i32; 3]]) -> OfDecoder {
    let mut all = OfDecoder { units: Vec::new(), outputs: Vec::new(), steps: Vec::new() };
    let n_means = SHAPE.values_per_anchor();
    for cell in cells {
        let (mut features, mut hidden) = (vec![0; context.n_inputs()], vec![0; context.n_hidden()]);
        context.features(*cell, &mut features);
        let network = context.network(0);
        network.hidden(&features, &mut hidden);
        all.units.extend(hidden.iter().map(|unit| i32::from(*unit)));
        let parts = |output| if output < n_means { 64.0 } else { 8.0 };
        all.outputs.extend((0..context.n_outputs()).map(|i| f32::from(network.output(i, &hidden)) / parts(i)));
        let steps = network.steps(&hidden);
        all.steps.extend(Group::ALL.map(|group| steps.value(group)));
    }
    all
}
