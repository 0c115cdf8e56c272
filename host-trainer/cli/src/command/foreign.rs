//! Options of other trainers. They are not taken, so that there is one way to say a thing; the error names ours.

use std::ffi::OsString;

use clap::error::{ContextKind, ContextValue, Error, ErrorKind};

/// Names of 3DGS, nerfstudio, gsplat, brush and LichtFeld Studio, and what says the same here.
const NAMES: [(&[&str], &str); 9] = [
    (
        &["data", "data-path", "data_dir", "data-dir", "source_path", "source-path"],
        "photographs are given without an option: `pocketsplat train PHOTOS -o scene.psb`",
    ),
    (
        &["max-steps", "max_steps", "total-steps", "steps", "max-num-iterations", "total-train-iters", "iter"],
        "`--iterations N` is its name here",
    ),
    (
        &["result_dir", "result-dir", "output-dir", "output-path", "model_path", "model-path"],
        "`--output scene.psb` is the file; its run lies beside it",
    ),
    (&["eval"], "views are held out without an option; `--test-every N` says which"),
    (&["test_every", "eval-split-every"], "`--test-every N` is its name here"),
    (
        &["data_factor", "data-factor", "downscale-factor", "resize_factor"],
        "`--max-resolution PX` says the longest side",
    ),
    (&["white_background", "white-background"], "`--background white` is its name here"),
    (
        &["cap_max", "cap-max", "max-cap", "max-splats"],
        "`--max-anchors N` bounds a scene; an anchor has up to ten Gaussians",
    ),
    (
        &["start_checkpoint", "load-checkpoint", "load-dir", "ckpt", "resume-from"],
        "`--resume` goes on from the run's own checkpoint",
    ),
];

/// What says the same here, where somebody gave `train` another trainer's option.
///
/// * `arguments`: without the program's name.
pub(super) fn hint(arguments: &[OsString], error: &Error) -> Option<&'static str> {
    if error.kind() != ErrorKind::UnknownArgument || !arguments.iter().any(|arg| arg == "train") {
        return None;
    }
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidArg) else { return None };
    let name = given.trim_start_matches('-').split('=').next().unwrap_or_default();
    NAMES.iter().find(|(names, _)| names.contains(&name)).map(|(_, hint)| *hint)
}

/// The names as docs/commands.md lists them.
#[cfg(test)]
pub(super) fn table() -> String {
    let rows = NAMES.iter().map(|(names, hint)| {
        let names: Vec<String> = names.iter().map(|name| format!("`--{name}`")).collect();
        format!("| {} | {hint} |\n", names.join(", "))
    });
    format!(
        "\nOptions of 3DGS, nerfstudio, gsplat, brush and LichtFeld Studio are not taken; the error says what is:\n\n| there | here |\n|---|---|\n{}",
        rows.collect::<String>()
    )
}

/// The hints name options that there are, and no name is one of ours.
#[cfg(test)]
pub(super) fn check(train: &clap::Command) {
    let ours = |name: &str| {
        train.get_arguments().any(|arg| arg.get_long_and_visible_aliases().is_some_and(|all| all.contains(&name)))
    };
    for (names, hint) in NAMES {
        for word in hint.split(['`', ' ']).filter_map(|word| word.strip_prefix("--")) {
            assert!(ours(word), "{hint}");
        }
        assert!(!names.iter().any(|name| ours(name)), "{names:?}");
    }
}
