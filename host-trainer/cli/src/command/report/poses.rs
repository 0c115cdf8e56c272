//! How far the training cameras were moved, where poses were refined.

use super::super::train::result::PoseChange;
use super::sections::table;

/// A table; nothing where the capture's poses were kept.
pub(super) fn section(poses: Option<&[PoseChange]>) -> String {
    let Some(poses) = poses else { return String::new() };
    let row = |pose: &PoseChange| {
        vec![pose.view.clone(), format!("{:.3}", pose.turned_degrees), format!("{:.4}", pose.moved)]
    };
    format!(
        "<p>Training moved its cameras to where their photographs fit the scene best. Views that were held out stand where the capture has them.</p>\n\
         <details><summary>{} photographs</summary>\n{}\n</details>",
        poses.len(),
        table(
            "How far each camera was moved",
            &["photograph", "turned, degrees", "moved, units of the capture"],
            poses.iter().map(row)
        )
    )
}
