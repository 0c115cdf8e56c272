//! Imports go down only: a file may name the rooms before its own, and no two files import each other. And decoder-core has few names.
//!
//! A room is a module at the root of a crate. [`CRATES`] lists them in the order in which data flows; a new one has to be put there.
//! [`FOLDERS`] does the same for the folders that have an order inside.
//! Tests may import whatever they like, and so may a module from its own submodules, and they from it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The folder of each crate's sources, and its rooms; one may import those to its left.
const CRATES: [&str; 15] = [
    "decoder-format/src: error rules math stopwatch camera bytes entropy context bundle",
    "decoder-core/src: arena fixed functions mlp scene project raster arithmetic bake budget decoder display",
    "host-trainer/files/src: kind shell reach ply output",
    "host-trainer/capture/src: camera dataset synth",
    "host-trainer/gaussians/src: degree frame axes notes error check meaning opacity account ply splat glb spz sog \
     format fit written file",
    "host-trainer/kernels/src: real finite_difference camera scene ops integer_model step",
    "host-trainer/metrics/src: baseline pchip bjontegaard seeds psnr colour ssim lpips",
    "host-trainer/gpu/src: error adapter gpu buffer kernel parity ops group context scene image anchors network_pass \
     levels coding step",
    "host-trainer/codec/src: bundle render manifest verify",
    "host-trainer/trainer/src: train explicit export device encode effects cost",
    "host-trainer/baselines/src: baseline packed bytes octree voxels k_means rotations tuning masks compact_3dgs \
     light_gaussian rdo_gaussian self_organizing",
    "host-trainer/instructions/src: context processor board level",
    "viewer/src: figures focus scene exports package page",
    "host-trainer/cli/src: say program plot config command",
    "python/src: error camera bundle",
];

/// Rooms with rooms inside: the sources' folder of the crate, the module, and what lies in it in order.
const FOLDERS: [&str; 4] = [
    "host-trainer/kernels/src ops: simd pinhole heads image loss rate adam",
    "host-trainer/gpu/src ops: primitives heads image loss rate adam sound",
    "host-trainer/trainer/src train: schedule streams read_ahead error views exposures poses optimiser density context \
     worth limits modules config run bench_scene",
    "host-trainer/trainer/src train::run: watchdog residence observer checkpoint state method save learned trainer \
     step device_sync anchor_changes fork folder",
];

/// Public names of decoder-core.
const MOST_NAMES: usize = 45;

#[test]
fn imports_go_down_and_never_in_circles() {
    let mut found = Vec::new();
    for line in CRATES {
        let (folder, rooms) = line.split_once(": ").expect("a folder and its rooms");
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder);
        let mut files = Vec::new();
        collect(&sources, &mut Vec::new(), &mut files);
        assert!(files.len() > rooms.split_whitespace().count(), "{folder}: {} files", files.len());
        let inside = FOLDERS.iter().filter_map(|line| line.strip_prefix(folder)?.strip_prefix(' '));
        let inside = inside.map(|line| line.split_once(": ").expect("a module and its rooms"));
        let inside = inside.map(|(module, rooms)| (path_of(module), rooms));
        let lists: Vec<_> = [(Vec::new(), rooms)].into_iter().chain(inside).collect();
        found.extend(complaints(&lists, &files).into_iter().map(|complaint| format!("{folder}: {complaint}")));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// Firmware depends on these names alone, and each is a promise.
#[test]
fn decoder_core_has_few_names() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../decoder-core/src/lib.rs");
    let text = product_code(&fs::read_to_string(&root).expect("readable"));
    assert!(!text.contains("pub mod "), "a public module has names of its own");
    let exports: String = text.split("pub use ").skip(1).map(|rest| format!("use {rest}")).collect();
    let names: BTreeSet<String> = declarations(&exports).into_iter().map(|import| import.name).collect();
    assert!(names.contains("Decoder") && names.contains("Bundle"), "{names:?}");
    assert!(names.len() <= MOST_NAMES, "{} names: {names:?}", names.len());
}

#[test]
fn what_the_rule_forbids_is_found() {
    let complaints = |files: &[(&str, &str)]| {
        let files: Vec<_> = files.iter().map(|(module, text)| (path_of(module), (*text).to_owned())).collect();
        complaints(&[(Vec::new(), "low high"), (path_of("low"), "a b")], &files).join("; ")
    };
    let fine =
        [("", "mod low; mod high; pub use low::Leaf;"), ("low", "pub struct Leaf;"), ("high", "use crate::Leaf;")];
    assert_eq!(complaints(&fine), "");
    let mut up = fine;
    up[1].1 = "pub struct Leaf; fn f() { crate::high::g() }";
    assert_eq!(complaints(&up), "low imports high, which is a later room; high → low → high is a circle");
    let mut in_a_test = fine;
    in_a_test[1].1 = "pub struct Leaf; // crate::high\n#[cfg(test)] mod tests { use crate::high::G; }";
    assert_eq!(complaints(&in_a_test), "");
    let unlisted = [fine[0], fine[1], fine[2], ("attic", "use crate::low::Leaf;")];
    assert_eq!(complaints(&unlisted), "attic is not in the list of rooms");
    let up_inside = [("", ""), ("low", ""), ("low::a", "use super::b::B;"), ("low::b", ""), ("low::c", "")];
    let expected = "low::a imports low::b, which is a later room; low::c is not in the list of rooms";
    assert_eq!(complaints(&up_inside), expected);
    let circle = [
        ("", "mod low; mod high;"),
        ("high", ""),
        ("low", "mod a; mod b; pub use {a::A, b::B};"),
        ("low::a", "use super::B; pub struct A(B);"),
        ("low::b", "use crate::low::{self, A as C}; pub struct B;"),
    ];
    assert_eq!(
        complaints(&circle),
        "low::a imports low::b, which is a later room; low::a → low::b → low::a is a circle"
    );
    let with_its_child =
        [("", ""), ("high", ""), ("low", "mod a; use a::A; pub struct B;"), ("low::a", "use super::B;")];
    assert_eq!(complaints(&with_its_child), "", "a module and its submodule");
}

/// The names of a module from the crate's root down.
type ModulePath = Vec<String>;

fn path_of(module: &str) -> ModulePath {
    module.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

fn name_of(path: &[String]) -> String {
    if path.is_empty() { "the root".to_owned() } else { path.join("::") }
}

/// The modules below `folder`, each with its text; binaries and tests left out.
fn collect(folder: &Path, path: &mut ModulePath, files: &mut Vec<(ModulePath, String)>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut entries: Vec<_> = entries.map(|entry| entry.expect("readable").path()).collect();
    entries.sort();
    for entry in entries {
        let name = entry.file_stem().expect("a name").to_string_lossy().into_owned();
        let is_of_tests = name.ends_with("_tests") || name.starts_with("test_");
        if is_of_tests || ["tests", "testing", "bin", "main"].contains(&name.as_str()) {
            continue;
        }
        let is_own = ["mod", "lib"].contains(&name.as_str());
        if !is_own {
            path.push(name);
        }
        if entry.is_dir() {
            collect(&entry, path, files);
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            files.push((path.clone(), fs::read_to_string(&entry).expect("readable")));
        }
        if !is_own {
            path.pop();
        }
    }
}

/// What a `use` declaration makes a name stand for.
struct Import {
    name: String,
    path: Vec<String>,
}

/// The modules of a crate, and what each imports.
struct Modules(BTreeMap<ModulePath, Vec<Import>>);

/// Every upward import, unlisted room and circle.
///
/// * `lists`: modules, the root among them, with the rooms in each.
fn complaints(lists: &[(ModulePath, &str)], files: &[(ModulePath, String)]) -> Vec<String> {
    let mut modules = Modules(files.iter().map(|(module, _)| (module.clone(), Vec::new())).collect());
    let texts: Vec<_> = files.iter().map(|(module, text)| (module, product_code(text))).collect();
    for (module, text) in &texts {
        modules.0.insert((*module).clone(), declarations(text));
    }
    let mut edges: BTreeMap<&ModulePath, BTreeSet<ModulePath>> = BTreeMap::new();
    for (module, text) in &texts {
        let declared = modules.0[*module].iter().map(|import| import.path.clone());
        let targets = declared.chain(paths_in(text)).filter_map(|path| modules.file_of(module, &path, 0));
        edges.insert(module, targets.filter(|target| target != *module).collect());
    }
    let mut found = Vec::new();
    for (inside, rooms) in lists {
        let name = |module: &ModulePath| module.strip_prefix(inside.as_slice())?.first().cloned();
        let rooms: Vec<&str> = rooms.split_whitespace().collect();
        let room = |module: &ModulePath| rooms.iter().position(|room| Some(*room) == name(module).as_deref());
        for (module, targets) in &edges {
            if name(module).is_some() && room(module).is_none() {
                found.push(format!("{} is not in the list of rooms", name_of(module)));
            }
            for target in targets {
                if room(module).is_some() && room(target) > room(module) {
                    found.push(format!("{} imports {}, which is a later room", name_of(module), name_of(target)));
                }
            }
        }
    }
    let is_kin = |a: &ModulePath, b: &ModulePath| a.starts_with(b) || b.starts_with(a);
    let kept = edges.iter().map(|(module, targets)| {
        (*module, targets.iter().filter(|target| !is_kin(module, target)).collect::<Vec<_>>())
    });
    found.extend(first_circle(&kept.collect()));
    found
}

/// A circle of imports, if there is one.
fn first_circle(edges: &BTreeMap<&ModulePath, Vec<&ModulePath>>) -> Option<String> {
    // Whether all that a module imports has been looked at.
    let mut done: BTreeMap<&ModulePath, bool> = BTreeMap::new();
    for start in edges.keys() {
        let mut trail = vec![(*start, 0)];
        while let Some((module, next)) = trail.last_mut() {
            let (module, index) = (*module, *next);
            *next += 1;
            done.entry(module).or_insert(false);
            match edges.get(module).and_then(|targets| targets.get(index)) {
                Some(target) if done.get(target) == Some(&false) => {
                    let members = trail.iter().map(|(module, _)| *module).skip_while(|module| module != target);
                    let names: Vec<_> = members.chain([*target]).map(|module| name_of(module)).collect();
                    return Some(format!("{} is a circle", names.join(" → ")));
                }
                Some(target) if !done.contains_key(target) => trail.push((target, 0)),
                Some(_) => {}
                None => {
                    done.insert(module, true);
                    trail.pop();
                }
            }
        }
    }
    None
}

impl Modules {
    /// The module whose file has what `path` names in `module`; `None` for other crates.
    fn file_of(&self, module: &ModulePath, path: &[String], depth: usize) -> Option<ModulePath> {
        let (first, rest) = path.split_first()?;
        let parent = || module.split_last().map(|(_, parent)| parent.to_vec());
        let (mut at, rest) = match first.as_str() {
            "crate" => (Vec::new(), rest),
            "self" => (module.clone(), rest),
            "super" => (parent()?, rest),
            _ if self.0.contains_key(&[module.as_slice(), std::slice::from_ref(first)].concat()) => {
                (module.clone(), path)
            }
            _ => return None,
        };
        for (index, name) in rest.iter().enumerate() {
            let child = [at.as_slice(), std::slice::from_ref(name)].concat();
            if name == "super" {
                at.pop();
            } else if self.0.contains_key(&child) {
                at = child;
            } else if let Some(import) = self.0.get(&at)?.iter().find(|import| import.name == *name)
                && depth < 8
            {
                let path: Vec<String> = import.path.iter().chain(&rest[index + 1..]).cloned().collect();
                return self.file_of(&at, &path, depth + 1).or(Some(at));
            } else {
                break;
            }
        }
        Some(at)
    }
}

/// The `use` declarations of a file.
fn declarations(text: &str) -> Vec<Import> {
    let mut imports = Vec::new();
    for (start, _) in text.match_indices("use ") {
        let before = text[..start].chars().next_back();
        if before.is_none_or(|c| c.is_whitespace() || "{};]".contains(c)) {
            let tree = text[start + 4..].split(';').next().unwrap_or_default();
            expand(&[], tree, &mut imports);
        }
    }
    imports
}

/// The paths of a tree such as `a::{b, c::{self, d as e}}`.
fn expand(prefix: &[String], tree: &str, imports: &mut Vec<Import>) {
    let tree = tree.trim();
    let (path, group) = match tree.split_once('{') {
        Some((path, group)) => (path, Some(group.trim_end().strip_suffix('}').unwrap_or(group))),
        None => (tree, None),
    };
    let (path, alias) = path.split_once(" as ").map_or((path, None), |(path, alias)| (path, Some(alias.trim())));
    let names = path.split("::").map(str::trim).filter(|name| !name.is_empty() && *name != "*");
    let mut full: Vec<String> = prefix.iter().cloned().chain(names.map(str::to_owned)).collect();
    let Some(group) = group else {
        if full.len() > 1 && full.last().is_some_and(|name| name == "self") {
            full.pop();
        }
        let name = alias.or(full.last().map(String::as_str)).unwrap_or_default().to_owned();
        imports.push(Import { name, path: full });
        return;
    };
    let (mut depth, mut start) = (0, 0);
    for (at, c) in group.char_indices().chain([(group.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !group[start..at].trim().is_empty() {
                    expand(&full, &group[start..at], imports);
                }
                start = at + 1;
            }
            _ => {}
        }
    }
}

/// The paths from `crate` or `super` that code names without a `use`.
fn paths_in(text: &str) -> impl Iterator<Item = Vec<String>> {
    let starts = ["crate::", "super::"].into_iter().flat_map(|root| text.match_indices(root).map(|(start, _)| start));
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    starts.filter(move |start| !text[..*start].ends_with(|c| is_name(c) || c == ':' || c == '$')).map(move |start| {
        let end = text[start..].find(|c| !is_name(c) && c != ':').unwrap_or(text.len() - start);
        text[start..start + end].split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect()
    })
}

/// A file without comments, literals and what only tests see.
fn product_code(text: &str) -> String {
    let mut code = without_literals(text);
    while let Some(start) = code.find("#[cfg(test)]") {
        let rest = &code[start..];
        let open = rest.find('{').unwrap_or(rest.len());
        let semicolon = rest.find(';').unwrap_or(rest.len());
        let end = if semicolon < open {
            semicolon + 1
        } else {
            let mut depth = 0;
            let close = rest.char_indices().skip_while(|(at, _)| *at < open).find(|(_, c)| {
                depth += i32::from(*c == '{') - i32::from(*c == '}');
                depth == 0
            });
            close.map_or(rest.len(), |(at, _)| at + 1)
        };
        code.replace_range(start..start + end, "");
    }
    code
}

/// A file with comments, strings and characters blanked.
fn without_literals(text: &str) -> String {
    let mut code = String::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let raw = rest.strip_prefix('r').map_or(0, |rest| rest.len() - rest.trim_start_matches('#').len());
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if rest.starts_with('r') && rest[1 + raw..].starts_with('"') && !code.ends_with(char::is_alphanumeric) {
            let closing = format!("\"{}", "#".repeat(raw));
            let body = &rest[2 + raw..];
            2 + raw + body.find(&closing).map_or(body.len(), |end| end + closing.len())
        } else if c == '"' {
            let mut escaped = false;
            let end = rest.char_indices().skip(1).find(|&(_, c)| {
                let closes = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                closes
            });
            end.map_or(rest.len(), |(at, _)| at + 1)
        } else if let Some(character) = rest.strip_prefix('\'') {
            // A character, or else a lifetime.
            let mut characters = character.char_indices();
            let closing = match characters.next() {
                Some((_, '\\')) => character[2..].find('\'').map(|at| at + 2),
                _ => characters.next().filter(|(_, c)| *c == '\'').map(|(at, _)| at),
            };
            closing.map_or(0, |at| at + 2)
        } else {
            0
        };
        if skipped > 0 {
            code.push(' ');
            rest = &rest[skipped..];
        } else {
            code.push(c);
            rest = &rest[c.len_utf8()..];
        }
    }
    code
}
