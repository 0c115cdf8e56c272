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
        "<p>Training moved its cameras to where their photographs fit the scene best. Views that were held out stand where the \
         capture has them.</p>\n\
         <details><summary>{} photographs</summary>\n{}\n</details>",
        poses.len(),
        table(
            "How far each camera was moved",
            &["photograph", "turned, degrees", "moved, units of the capture"],
            poses.iter().map(row)
        )
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moved_cameras_are_listed() {
        assert_eq!(section(None), "");
        let pose = PoseChange { view: "a<b.jpg".to_owned(), turned_degrees: 0.1234, moved: 0.05 };
        let html = section(Some(&[pose]));
        for part in ["1 photographs", "a&lt;b.jpg", "<td>0.123</td>", "<td>0.0500</td>"] {
            assert!(html.contains(part), "{part}: {html}");
        }
    }
}
