//! Cases of real trouble, a folder each, where they are at hand: `$POCKETSPLAT_CASES`, or `../shared/cases` beside the workspace.
//!
//! Every case ends as its README says: right, or with words that name the cause and a remedy. Each kind has tests of instances of its own
//! beside the code that it is about; these are those that people met.

mod captures;
mod case;
mod formats;
mod outputs;
mod splats;

/// What `sound` reaches less a decibel: below it a result has to come with a warning.
const TRAINED_DB: f64 = 24.0;
const IMPORTED_DB: f64 = 34.0;

#[test]
fn the_sound_case_is_what_others_are_compared_with() {
    let Some(case) = case::Case::find("sound") else { return };
    case.run(&case::TRAIN).trained(TRAINED_DB);
    case.run(&case::IMPORT).imported(IMPORTED_DB);
}
