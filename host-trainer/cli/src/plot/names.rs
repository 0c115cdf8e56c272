//! Names of curves by the files they are in.

use std::path::Path;

/// A name for each file: its own without the extension, or that of its folder where every folder has a file of that
/// name (`progress.csv`, `results.csv`); the whole path where two would be named alike.
pub(crate) fn names_of<P: AsRef<Path>>(paths: &[P]) -> Vec<String> {
    let names: Vec<String> = paths.iter().map(|path| name_of(path.as_ref())).collect();
    let alone = |name: &String| names.iter().filter(|other| *other == name).count() == 1;
    let either = |(name, path): (&String, &P)| {
        if alone(name) { name.clone() } else { path.as_ref().display().to_string() }
    };
    names.iter().zip(paths).map(either).collect()
}

fn name_of(path: &Path) -> String {
    let stem = |path: &Path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let own = stem(path).unwrap_or_default();
    match own.as_str() {
        "progress" | "results" => path.parent().and_then(stem).unwrap_or(own),
        _ => own,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_named_apart() {
        assert_eq!(names_of(&["a/lego.run/progress.csv", "bonsai.csv"]), ["lego", "bonsai"]);
        assert_eq!(names_of(&["results.csv"]), ["results"]);
        assert_eq!(names_of(&["a/x.csv", "b/x.csv", "c/y.csv"]), ["a/x.csv", "b/x.csv", "y"]);
    }
}
