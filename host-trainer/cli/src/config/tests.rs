use pocketsplat_capture::dataset::Background;

use super::*;
use pocketsplat_trainer::train::modules::pruning;

#[test]
fn a_written_configuration_reads_back_to_the_last_bit() {
    let mut config = RunConfig {
        dataset: "/captures/desk lamp".into(),
        output: "out/lamp.psb".into(),
        checkpoint_every: Some(700),
        keep_checkpoints: true,
        capture: CaptureOptions {
            max_resolution: Some(400),
            resolution: None,
            background: Some(Background::White),
            points: Some(pocketsplat_capture::dataset::PointsChoice::Matched),
            n_random_points: Some(5_000),
            scene: Some(pocketsplat_capture::dataset::SceneKind::Room),
            images: Some("images_2".to_owned()),
            model: Some(1),
            test_every: Some(5),
        },
        // A file says a weight.
        scales_lambda: false,
        ..RunConfig::default()
    };
    for i in 1..200u32 {
        let x = 1.0 / f64::from(i).powf(1.7);
        config.train.voxel_size = Some(x);
        config.train.rates.offset.end = x * 1e-9;
        config.encoding.quantisation.feature = (x * 0.1) as f32;
        config.train.seed = u64::from(i).pow(7) % i64::MAX as u64;
        assert_eq!(RunConfig::parse(&config.to_toml().unwrap()).unwrap(), config, "{i}");
    }
    config.train.modules = pocketsplat_trainer::train::modules::Modules::default();
    config.capture.max_resolution = None;
    let text = config.to_toml().unwrap();
    assert!(text.contains("unset = [\"capture.max_resolution\", \"train.modules.rdo\"]"), "{text}");
    assert_eq!(RunConfig::parse(&text).unwrap(), config, "what the preset has and the run has not");
}

#[test]
fn a_configuration_begins_where_a_run_without_one_begins() {
    assert_eq!(RunConfig::parse("").unwrap(), RunConfig::default());
    for preset in <Preset as clap::ValueEnum>::value_variants() {
        let config = preset.config();
        let text = format!("preset = \"{}\"", toml::Value::try_from(preset).unwrap().as_str().unwrap());
        assert_eq!(RunConfig::parse(&text).unwrap(), config, "{text}");
    }
    let scaffold = RunConfig::parse("train.backbone = \"scaffold\"").unwrap();
    assert_eq!(scaffold, RunConfig::default().with_backbone(Backbone::Scaffold));
    let display = RunConfig::parse("capture.resolution = \"160x120\"").unwrap();
    assert_eq!(display.capture.max_resolution, None, "one way to say the size replaces the other");
    let masks = RunConfig::parse("unset = [\"train.modules.rdo\"]\ntrain.hac.lambda = 0.001").unwrap();
    assert!(masks.train.modules.rdo.is_none() && !masks.scales_lambda);
}

#[test]
fn a_few_keys_are_enough() {
    let config = RunConfig::parse("[train]\niterations = 7\n[train.rates.offset]\nstart = 1\n").unwrap();
    assert_eq!(config.train.iterations, 7);
    assert_eq!(config.train.rates.offset.start, 1.0);
    assert_eq!(config.train.rates.offset.end, TrainConfig::default().rates.offset.end);
    assert_eq!(
        RunConfig::parse("[capture]\nbackground = \"white\"").unwrap().capture.background,
        Some(Background::White)
    );
}

#[test]
fn a_backbone_changes_nothing_else() {
    let config = RunConfig::parse("[train]\nbackbone = \"hac\"\niterations = 7").unwrap();
    assert_eq!(config.train, TrainConfig { iterations: 7, ..RunConfig::default().train });
    let config = RunConfig::parse("[train]\nbackbone = \"hac\"\n[train.shape]\nfeature_dim = 50").unwrap();
    assert_eq!(config.train.shape.feature_dim, 50);
    assert_eq!(RunConfig::parse(&config.to_toml().unwrap()).unwrap().train, config.train);
}

#[test]
fn what_is_not_understood_is_refused_by_its_name() {
    for (text, part) in [
        ("[train]\nbackbone = \"haç\"", "`scaffold`, `hac`, `hac-plus`"),
        ("[train.rates]\nfeatures = 1", "unknown key `train.rates.features`; known here: "),
        ("iterations = 3", "unknown key `iterations`; known here: "),
        ("[train]\niterations = \"many\"", "iterations"),
        ("[train]\niterations = -1", "iterations"),
        ("[capture]\nbackground = \"grey\"", "`black`, `white`, `learned`"),
        ("train = 3", "train"),
        ("preset = \"slow\"", "`quick`, `standard`, `full`"),
        (
            "unset = [\"train.modules.pruning\"]",
            "`unset` names `train.modules.pruning`, which the preset does not have",
        ),
        ("[train\n", "line 1"),
    ] {
        let message = format!("{:#}", RunConfig::parse(text).unwrap_err());
        assert!(message.contains(part), "{text}: {message}");
    }
}

#[test]
fn any_key_can_be_set_by_its_path() {
    let config = RunConfig::default();
    let keys =
        ["train.iterations=9", "train.modules.pruning.form=tiered", "train.hac.sample = 1", "encoding.tiers=[0.5, 0]"];
    let set = config.with_keys(&keys.map(str::to_owned)).unwrap();
    let pruning = set.train.modules.pruning.unwrap();
    assert_eq!((set.train.iterations, set.train.hac.sample, set.encoding.tiers.as_slice()), (9, 1.0, &[0.5, 0.0][..]));
    assert_eq!((pruning.form, pruning.beta), (pruning::Form::Tiered, 1e-3), "the rest has its defaults");
    assert_eq!(RunConfig::parse(&set.to_toml().unwrap()).unwrap(), RunConfig { scales_lambda: false, ..set });
    for (key, part) in [
        ("train.iterations", "needs KEY=VALUE"),
        ("train.steps=3", "unknown key `train.steps`; known here: "),
        ("train.modules.pruning.depth=3", "unknown key `train.modules.pruning.depth`"),
        ("train.modules.pruning.form=soft", "soft"),
    ] {
        let message = format!("{:#}", config.with_keys(&[key.to_owned()]).unwrap_err());
        assert!(message.contains(part), "{key}: {message}");
    }
}

#[test]
fn only_what_decides_the_result_counts_as_a_difference() {
    let a = RunConfig::default();
    let difference = |other: &RunConfig| a.difference(other, ["here", "there"]).unwrap();
    let mut b = RunConfig { output: "elsewhere".into(), checkpoint_every: Some(3), ..a.clone() };
    assert_eq!(difference(&b), None);
    b.train.shape.n_offsets = 5;
    assert_eq!(difference(&b).unwrap(), "`train.shape.n_offsets` is 10 here, 5 there");
    b = RunConfig { capture: CaptureOptions { max_resolution: Some(200), ..a.capture.clone() }, ..a.clone() };
    assert_eq!(difference(&b).unwrap(), "`capture.max_resolution` is 400 here, 200 there");
}

#[test]
fn a_run_starts_from_one_random_point_at_least() {
    let config = |n: usize| {
        let capture = CaptureOptions { n_random_points: Some(n), ..RunConfig::default().capture };
        RunConfig { capture, ..RunConfig::default() }
    };
    for n in [1, 10_000_000] {
        config(n).check().unwrap();
    }
    for n in [0, 10_000_001] {
        let error = config(n).check().unwrap_err().to_string();
        let said = format!("`capture.n_random_points` asks for {n} random points, needed: 1 to 10,000,000; ");
        assert!(error.contains(&said), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn a_path_that_is_no_text_is_refused_as_it_is_shown() {
    use std::os::unix::ffi::OsStrExt as _;
    let odd = Path::new(std::ffi::OsStr::from_bytes(b"/captures/caf\xe9"));
    let said = |error: anyhow::Error| {
        let error = error.to_string();
        assert!(error.starts_with("`/captures/caf\\xe9` is not UTF-8"), "{error}");
        assert!(error.ends_with("rename it, or link to it by another name"), "{error}");
    };
    said(absolute(odd).unwrap_err());
    let explicit = ExplicitRunConfig::of_preset(Preset::Quick, odd.to_owned(), "a.ply".into());
    said(explicit.with_keys(&["gaussians.density.interval=50".to_owned()]).unwrap_err());
    assert_eq!(absolute(Path::new("/captures/café")).unwrap(), Path::new("/captures/café"));
}

#[test]
fn checkpoints_to_fork_from_lie_inside_the_run() {
    let config = |fork_at: u32| RunConfig { fork_at: vec![fork_at], ..RunConfig::default() };
    let n = RunConfig::default().train.iterations;
    assert!(config(n).check().is_ok());
    let error = config(n + 1).check().unwrap_err().to_string();
    assert!(error.contains(&format!("--fork-at names iteration {}, and the run has {n}", n + 1)), "{error}");
}

#[test]
fn coding_decides_where_limits_steer_the_run() {
    let steered = |keys: &[&str]| {
        RunConfig::default().with_keys(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>()).unwrap()
    };
    let difference = |one: &RunConfig, other: &RunConfig| one.difference(other, ["here", "there"]).unwrap();
    let (free, tables) = (RunConfig::default(), steered(&["encoding.coder=static", "encoding.tiers=[0.5, 0]"]));
    assert_eq!(difference(&free, &tables), None, "without limits bundles are coded when all is trained");
    let flash = steered(&["encoding.limits.flash_bytes=300000"]);
    for (key, is) in [
        ("encoding.limits.flash_bytes=200000", "`encoding.limits.flash_bytes` is 300000 here, 200000 there"),
        ("encoding.limits.ram_bytes=4096", "`encoding.limits.ram_bytes` is nothing here, 4096 there"),
        ("encoding.coder=static", "`encoding.coder` is \"auto\" here, \"static\" there"),
        ("encoding.tiers=[0.0]", "`encoding.tiers` is "),
    ] {
        let said = difference(&flash, &flash.with_keys(&[key.to_owned()]).unwrap()).expect(key);
        assert!(said.starts_with(is), "{key}: {said}");
    }
    assert!(difference(&free, &flash).expect("limits").contains("encoding.limits"));
    assert_eq!(difference(&flash, &flash), None);
}
