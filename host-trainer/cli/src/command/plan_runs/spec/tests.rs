use super::*;

const PLAN: &str = r#"
published = "published.csv"

[captures.Synthetic]
lego = "lego"

[captures.Photographs]
fox = { folder = "fox", images = "images_2" }

[options]
iterations = 100
set = ["train.shape.feature_dim=8", "train.shape.n_offsets=3"]

[vary]
backbone = ["scaffold", "hac"]
lambda = [0.004, 0.001]
seed = [1, 2]

[[exclude]]
scene = "fox"
seed = 2

[names]
hac = "HAC"
"#;

fn parse(text: &str) -> Result<Spec> {
    Spec::parse(text, Path::new("/plans"))
}

fn message(text: &str) -> String {
    let runs = parse(text).and_then(|spec| spec.runs());
    format!("{:#}", runs.map(|runs| runs.len()).unwrap_err())
}

#[test]
fn every_combination_is_a_run_and_a_weight_without_bits_is_none() {
    let spec = parse(PLAN).unwrap();
    assert_eq!(spec.published.as_deref(), Some(Path::new("/plans/published.csv")));
    let runs = spec.runs().unwrap();
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
    let expected = [
        "fox/scaffold-seed-1",
        "fox/hac-lambda-0.004-seed-1",
        "fox/hac-lambda-0.001-seed-1",
        "lego/scaffold-seed-1",
        "lego/scaffold-seed-2",
        "lego/hac-lambda-0.004-seed-1",
        "lego/hac-lambda-0.004-seed-2",
        "lego/hac-lambda-0.001-seed-1",
        "lego/hac-lambda-0.001-seed-2",
    ];
    assert_eq!(names, expected);
    let (fox, lego) = (&runs[1], &runs[5]);
    let place = (&*fox.dataset, &*fox.scene, &*fox.size, &*fox.method, &*fox.rate);
    assert_eq!(place, ("Photographs", "fox", "", "HAC", "lambda=0.004"));
    assert_eq!((&*runs[0].method, &*runs[0].rate), ("scaffold", "default"));
    assert_eq!(fox.folder, Path::new("/plans/fox"));
    let mut options = fox.options();
    options.sort();
    let expected = [
        "--backbone=hac",
        "--images=images_2",
        "--iterations=100",
        "--lambda=0.004",
        "--seed=1",
        "--set=train.shape.feature_dim=8",
        "--set=train.shape.n_offsets=3",
    ];
    assert_eq!(options, expected);
    assert!(!lego.options().iter().any(|option| option.starts_with("--images")), "its own options are a scene's");
}

#[test]
fn plans_that_mean_nothing_are_refused_by_what_is_wrong() {
    assert!(message("[captures]").contains("no run is left"));
    assert!(message("captures.a = \"lego\"").contains("needs SCENE = \"FOLDER\""));
    assert!(message("captures.a.lego = 3").contains("`captures.a.lego` names no folder"));
    assert!(message("captures.a.lego = \"x\"\nvary.lambda = 0.1").contains("`vary.lambda` is 0.1, needs a list"));
    assert!(message("captures.a.lego = \"x\"\nvary.lambda = []").contains("needs a list"));
    assert!(message("captures.a.lego = \"x\"\nexclude = [{ seed = 1 }]").contains("[[exclude]] names `seed`"));
    let alike = "captures.a.lego = \"x\"\nvary.modules = [\"a,b\", \"a-b\"]";
    assert!(message(alike).contains("two runs would be called lego/a-b"), "{}", message(alike));
    assert!(parse("captures.a.lego = \"x\"\noption.seed = 3").is_err());
}

#[test]
fn what_files_are_called_by_is_a_plain_name_and_none_of_the_tables_own() {
    let dataset = |name: &str| message(&format!("captures.{name:?}.lego = \"x\""));
    let scene = |name: &str| message(&format!("captures.a.{name:?} = \"x\""));
    for name in ["../../esc", "..", "", "a/b", "a\\b", "C:", ".hidden", "dot.", " a", "what?"] {
        let needed = "needs a plain file name";
        let (of_dataset, of_scene) = (dataset(name), scene(name));
        assert!(of_dataset.contains("names a dataset") && of_dataset.contains(needed), "{name}: {of_dataset}");
        assert!(of_scene.contains("names a scene") && of_scene.contains(needed), "{name}: {of_scene}");
    }
    for name in ["runs", "bd_rate", "comparison", "Runs"] {
        let said = dataset(name);
        assert!(said.contains(&format!("names a dataset `{name}`")), "{said}");
        assert!(said.contains("tables keep runs, bd_rate, comparison"), "{said}");
    }
    for (dataset, scene) in [("a", "runs"), ("Tanks & Temples (T&T)", "Dr. Johnson"), ("mip-nerf_360.v2", "Übung")] {
        let spec = parse(&format!("captures.{dataset:?}.{scene:?} = \"x\"")).unwrap();
        assert_eq!(spec.runs().unwrap()[0].dataset, dataset, "{scene}");
    }
}

#[test]
fn a_plan_that_varies_nothing_is_one_run() {
    let runs = parse("captures.a.lego = \"x\"").unwrap().runs().unwrap();
    assert_eq!((runs.len(), &*runs[0].name, &*runs[0].method), (1, "lego/run", "ours"));
}
