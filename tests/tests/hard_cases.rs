//! Every hard case keeps its bound, and the page says so.

use std::collections::BTreeMap;
use std::path::Path;
use std::{env, fs, panic};

use conformance::hard_cases::{Case, Outcome, families, gathered, page};
use pocketsplat_codec::verify::variants_match;
use pocketsplat_core::{Budget, Bundle, MaxSplats};
use rayon::prelude::*;

/// Set, the page is written anew.
const WRITE: &str = "POCKETSPLAT_BLESS";

fn run(case: &Case) -> Result<Outcome, String> {
    let panicked = |cause: Box<dyn std::any::Any + Send>| {
        let text = cause.downcast_ref::<String>().cloned();
        text.or_else(|| cause.downcast_ref::<&str>().map(|&text| text.to_owned())).unwrap_or_default()
    };
    panic::catch_unwind(|| case.run()).unwrap_or_else(|cause| Err(format!("panicked: {}", panicked(cause))))
}

#[test]
fn every_case_keeps_its_bound_and_the_page_says_so() {
    let families = families();
    let cases: Vec<&Case> = families.iter().flat_map(|family| &family.cases).collect();
    let only = env::var("POCKETSPLAT_CASE").ok();
    let cases = cases.into_iter().filter(|case| only.as_ref().is_none_or(|name| case.name.contains(name.as_str())));
    let outcomes: Vec<_> = cases.collect::<Vec<_>>().into_par_iter().map(|case| (case.name, run(case))).collect();
    let (mut found, mut failures) = (BTreeMap::new(), Vec::new());
    for (name, outcome) in outcomes {
        match outcome {
            Ok(outcome) => {
                println!("{name}: {outcome:?}");
                found.insert(name, outcome);
            }
            Err(failure) => failures.push(format!("{name}: {failure}")),
        }
    }
    assert!(failures.is_empty(), "{} cases beyond their bounds:\n{}", failures.len(), failures.join("\n"));

    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/numerical-stability.md");
    let written = page::render(&families, |case| found.get(case.name));
    if env::var_os(WRITE).is_some() {
        fs::write(&path, &written).expect("the page can be written");
    }
    let committed = fs::read_to_string(&path).expect("the page is there");
    let [committed, written] = [committed, written].map(|page| page::without_measures(&page));
    let line = committed.lines().zip(written.lines()).find(|(a, b)| a != b);
    assert!(committed == written, "the page does not say what the cases do, set {WRITE}=1 to write it: {line:?}");
}

/// Strips and slabs cut through needles, walls and stacks; no pixel shows where.
#[test]
fn hard_splats_are_the_same_in_every_way_to_draw_them() {
    let bytes = gathered();
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let camera = bundle.header().preview;
    let budget = Budget::for_frame(camera.width_px, camera.height_px).with_max_splats(MaxSplats::Worst);
    variants_match(&bundle, budget, &camera).unwrap_or_else(|violation| panic!("{violation}"));
}

#[test]
fn names_are_unique_and_at_most_a_fifth_are_refusals() {
    let families = families();
    let cases: Vec<&Case> = families.iter().flat_map(|family| &family.cases).collect();
    let names: std::collections::BTreeSet<_> = cases.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), cases.len(), "a name a case");
    let n_refused = cases.iter().filter(|case| case.is_refusal()).count();
    assert!(5 * n_refused <= cases.len(), "{n_refused} of {} cases are refusals", cases.len());
}
