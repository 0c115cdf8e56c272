//! The commands by what they are for: the help of `pocketsplat` itself.

use std::fmt::Write as _;

use clap::builder::StyledStr;
use clap::{Arg, Command};
use pocketsplat_capture::dataset::Background;

use super::settings::backbone_of_anchors;
use crate::config::named::{DRAWN_BACKGROUNDS, one_of};

/// All commands, by what somebody wants.
const GROUPS: [(&str, &[&str]); 5] = [
    ("Create", &["train", "import", "export"]),
    ("Look", &["eval", "render", "view", "report", "inspect"]),
    ("Device", &["fit", "verify", "cost"]),
    ("Research", &["plan-runs", "tables", "compare", "survey", "plot"]),
    ("Captures and this machine", &["poses", "doctor", "synth", "demo", "devices", "bench", "completions", "man"]),
];

/// Commands that look at what was trained, as it was.
const LOOKING: &[&str] = &["eval", "render", "verify", "cost", "export"];
/// What the help of --effects says of a choice that `import` refuses.
const AUTO_OF_EFFECTS: &str = "auto, which tests them in runs of 16,000 iterations and more, or a list";
/// What the help of --backbone says of a kind that makes no bundle.
const EXPLICIT: &str = "; 3dgs (3D Gaussian Splatting) makes an uncompressed .ply to compare with";
/// Defaults in which commands that share an option differ.
const DEFAULTS: [(&[&str], &str, &str); 14] = [
    (&["train"], "max_resolution", "by the preset"),
    (LOOKING, "max_resolution", "the training size of the bundle"),
    (&["train"], "background", "black; white for 3dgs on a Blender capture"),
    (LOOKING, "background", "the bundle's"),
    (&["survey"], "max_resolution", "200"),
    (&["survey"], "background", "black; white on a Blender capture"),
    (&["survey"], "points", "the capture's; else of its depth maps; else matched, or random on a Blender capture"),
    (&["train"], "iterations", "by the preset"),
    (&["import"], "iterations", "5000"),
    (&["train"], "effects", "auto"),
    (&["train"], "feature_dim", "32; by the limits for a device; with --from that of its run"),
    (&["import"], "feature_dim", "32; by the limits for a device"),
    (&["import"], "effects", "view-colour,view-geometry,anisotropy"),
    (&["train", "import"], "modules", "rdo-pruning, with tiered-pruning for a device"),
];

/// The commands with what is each one's own: its defaults, and no choice that it refuses or that changes nothing for it.
pub(super) fn own_options(mut command: Command) -> Command {
    for (names, id, default) in DEFAULTS {
        for &name in names {
            command = command.mut_subcommand(name, |command| with(command, id, |arg| with_default(arg, default)));
        }
    }
    for &name in LOOKING {
        let hidden = |command, id| with(command, id, |arg| arg.hide(true));
        command = command.mut_subcommand(name, |command| hidden(hidden(command, "scene"), "points"));
    }
    let drawn = |arg: Arg| arg.value_parser(one_of::<Background>(DRAWN_BACKGROUNDS));
    command = command.mut_subcommand("survey", |command| with(command, "background", drawn));
    command.mut_subcommand("import", |command| {
        let command = with(command, "backbone", |arg| {
            with_help(arg.value_parser(backbone_of_anchors()), |help| help.replacen(EXPLICIT, "", 1))
        });
        let command =
            with(command, "effects", |arg| with_help(arg, |help| help.replacen(AUTO_OF_EFFECTS, "a list", 1)));
        with(command, "background", drawn)
    })
}

/// A command with a change of one option, if it has that.
fn with(command: Command, id: &str, change: impl FnOnce(Arg) -> Arg) -> Command {
    let has_it = command.get_arguments().any(|arg| arg.get_id() == id);
    if has_it { command.mut_arg(id, change) } else { command }
}

/// The option with another default in its help.
fn with_default(arg: Arg, default: &str) -> Arg {
    with_help(arg, |help| format!("{} [default: {default}]", help.split(" [default:").next().unwrap_or_default()))
}

/// The option with its help changed.
fn with_help(arg: Arg, change: impl FnOnce(&str) -> String) -> Arg {
    let help = arg.get_long_help().or(arg.get_help()).map(StyledStr::to_string).unwrap_or_default();
    let text = change(&help);
    arg.help(text.clone()).long_help(text)
}

/// The command with its help grouped.
pub(super) fn grouped(command: Command) -> Command {
    let mut list = String::new();
    for (group, names) in GROUPS {
        let _ = writeln!(list, "{group}:");
        for name in names {
            let about = command.find_subcommand(name).and_then(Command::get_about).map(ToString::to_string);
            let _ = writeln!(list, "  {name:11} {}", about.unwrap_or_default());
        }
        list.push('\n');
    }
    command.help_template(format!("{{about}}\n\n{{usage-heading}} {{usage}}\n\n{list}Options:\n{{options}}\n"))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::CommandFactory as _;

    use super::*;
    use crate::command::Cli;

    const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/commands.md");
    /// What stands above is written by hand.
    const MARK: &str = "<!-- written by the test `the_page_of_commands_is_their_help` -->\n";

    #[test]
    fn no_help_speaks_of_another_command_or_offers_what_is_refused() {
        let cli = own_options(Cli::command());
        for command in cli.get_subcommands() {
            for arg in command.get_arguments().filter(|arg| !arg.is_hide_set()) {
                let help = arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default();
                let default = help.split("[default:").nth(1).unwrap_or_default();
                let mut words = default.split(|c: char| !c.is_alphanumeric());
                assert!(
                    !words.any(|word| ["train", "import", "elsewhere"].contains(&word)),
                    "{} --{}: {help}",
                    command.get_name(),
                    arg.get_id()
                );
                let has_3dgs = arg.get_id() == "backbone" && help.contains("3dgs");
                assert!(!has_3dgs || command.get_name() == "train", "{}: {help}", command.get_name());
                let offers = |value: &str| arg.get_possible_values().iter().any(|other| other.get_name() == value);
                assert!(!offers("3dgs") || command.get_name() == "train", "{}", command.get_name());
                let speaks_of_auto =
                    command.get_name() == "import" && arg.get_id() == "effects" && help.contains("auto");
                assert!(!speaks_of_auto, "{help}");
                assert!(!offers("learned") || !["import", "survey"].contains(&command.get_name()));
            }
        }
    }

    #[test]
    fn every_command_stands_in_one_group() {
        let cli = Cli::command();
        let there: BTreeSet<&str> = cli.get_subcommands().map(Command::get_name).collect();
        let grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        assert_eq!(grouped.len(), there.len());
        assert_eq!(grouped.into_iter().collect::<BTreeSet<&str>>(), there);
    }

    /// The options as docs/commands.md lists them; `POCKETSPLAT_BLESS=1` writes it.
    #[test]
    fn the_page_of_commands_is_their_help() {
        let mut cli = own_options(Cli::command());
        cli.build();
        let mut text = String::new();
        for (group, names) in GROUPS {
            let _ = writeln!(text, "\n## {group}");
            for name in names {
                text += &section(cli.find_subcommand(name).expect("a command"));
                if *name == "train" {
                    text += &crate::command::foreign::table();
                }
            }
        }
        let page = std::fs::read_to_string(PAGE).expect("the page");
        let (by_hand, found) = page.split_once(MARK).expect("the mark");
        if std::env::var_os("POCKETSPLAT_BLESS").is_some() {
            std::fs::write(PAGE, format!("{by_hand}{MARK}{text}")).expect("written");
        } else {
            assert!(
                found == text,
                "docs/commands.md is not what the commands say; write it: POCKETSPLAT_BLESS=1 cargo test -p pocketsplat page_of_commands"
            );
        }
    }

    fn section(command: &Command) -> String {
        let name = command.get_name();
        let about = command.get_long_about().or(command.get_about()).map(ToString::to_string).unwrap_or_default();
        let positionals = command.get_positionals().map(|arg| {
            let value = arg.get_value_names().map_or_else(|| arg.get_id().to_string(), |names| names[0].to_string());
            let more = if matches!(arg.get_action(), clap::ArgAction::Append) { "…" } else { "" };
            if arg.is_required_set() { format!(" {value}{more}") } else { format!(" [{value}{more}]") }
        });
        let mut text = format!("\n### {name}\n\n`pocketsplat {name}{} [OPTIONS]`\n\n", positionals.collect::<String>());
        let _ = writeln!(text, "{}\n\n| option | meaning |\n|---|---|", in_page(&about).replace('|', "\\|"));
        let shown = |arg: &&Arg| !arg.is_hide_set() && !["help", "version", "threads"].contains(&arg.get_id().as_str());
        for arg in command.get_arguments().filter(shown) {
            let _ = writeln!(text, "| `{}` | {} |", spelled(arg).replace('|', "\\|"), meaning(arg).replace('|', "\\|"));
        }
        text
    }

    fn spelled(arg: &Arg) -> String {
        let value = arg.get_value_names().map_or_else(String::new, |names| names[0].to_string());
        let takes_value = arg.get_action().takes_values();
        match (arg.get_long(), arg.get_short()) {
            (None, None) => value,
            (long, short) => {
                let names: Vec<String> = short
                    .map(|short| format!("-{short}"))
                    .into_iter()
                    .chain(long.map(|long| format!("--{long}")))
                    .chain(arg.get_visible_aliases().into_iter().flatten().map(|alias| format!("--{alias}")))
                    .collect();
                let names = names.join(", ");
                match takes_value {
                    true if arg.is_require_equals_set() => format!("{names}[={value}]"),
                    true => format!("{names} {value}"),
                    false => names,
                }
            }
        }
    }

    fn meaning(arg: &Arg) -> String {
        let help = arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default();
        let mut text = in_page(&help);
        let values: Vec<String> =
            arg.get_possible_values().iter().map(|value| format!("`{}`", value.get_name())).collect();
        if arg.get_action().takes_values() && !values.is_empty() {
            let _ = write!(text, ": {}", values.join(", "));
        }
        let defaults: Vec<String> =
            arg.get_default_values().iter().map(|value| value.to_string_lossy().into_owned()).collect();
        if arg.get_action().takes_values() && !defaults.is_empty() && !help.contains("[default") {
            let _ = write!(text, " [default: {}]", defaults.join(","));
        }
        text
    }

    /// One paragraph a line; what looks like a tag is no tag.
    fn in_page(text: &str) -> String {
        text.replace('<', "&lt;")
            .split("\n\n")
            .map(|paragraph| paragraph.replace('\n', " "))
            .collect::<Vec<_>>()
            .join(" ")
    }
}
